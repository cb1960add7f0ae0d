//! Boxes around meshes that shapes and joints deform, without a look at each vertex.

use glam::{DAffine3, DVec3, Vec3};

use crate::scene::{Aabb, Mesh};

/// By how much a box grows beyond what it holds, as a share of its longest edge: positions on a device are f32.
const SLACK: f64 = 1e-6;

/// What of a mesh moves together: the vertices that hang on one joint with any weight, or all vertices.
#[derive(Debug, Clone, PartialEq)]
struct Part {
    /// Index in the skin's joints; `None` where the mesh hangs on none.
    joint: Option<usize>,
    /// Around its vertices, in mesh space.
    bounds: Aabb,
    /// By shape: around what it adds to them. Empty of a shape that moves none of them.
    shapes: Vec<Aabb>,
}

/// Boxes of a mesh from which follows a box around it however it is deformed.
///
/// A vertex of a linear blend is a mean of the places that its joints alone would give it. So all vertices lie in the convex hull of, for each
/// joint, the box around its vertices moved by that joint. What shapes add is bounded by interval arithmetic, for each joint on its own.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DeformBounds {
    parts: Vec<Part>,
}

impl DeformBounds {
    /// Looks at each vertex once. `is_skinned` says whether joints will be given to [`DeformBounds::bounds`].
    pub fn of(mesh: &Mesh, is_skinned: bool) -> Self {
        let influences = mesh.influences.as_ref().filter(|own| is_skinned && own.per_vertex > 0);
        let mut parts: Vec<Part> = Vec::new();
        // By joint, the number of its part.
        let mut numbers: Vec<Option<usize>> = Vec::new();
        let mut whole = None;
        for (vertex, &position) in mesh.positions.iter().enumerate() {
            let place = mesh.origin + Vec3::from(position).as_dvec3();
            let mut hold = |joint: Option<usize>| {
                let number = match joint {
                    None => &mut whole,
                    Some(joint) => {
                        numbers.resize(numbers.len().max(joint + 1), None);
                        &mut numbers[joint]
                    }
                };
                let number = *number.get_or_insert_with(|| {
                    let shapes = vec![Aabb::EMPTY; mesh.morphs.len()];
                    parts.push(Part { joint, bounds: Aabb::EMPTY, shapes });
                    parts.len() - 1
                });
                parts[number].hold(mesh, vertex, place);
            };
            let own = influences.map(|own| {
                let range = vertex * own.per_vertex..(vertex + 1) * own.per_vertex;
                (own.joints.get(range.clone()).unwrap_or_default(), own.weights.get(range).unwrap_or_default())
            });
            match own {
                None | Some(([], _)) => hold(None),
                // As `deform` has it: without a weight the first joint counts.
                Some((joints, weights)) if weights.iter().all(|weight| *weight <= 0.0) => hold(Some(joints[0].into())),
                Some((joints, weights)) => {
                    let counting = joints.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
                    counting.for_each(|(&joint, _)| hold(Some(joint.into())));
                }
            }
        }
        Self { parts }
    }

    /// A box around the mesh with so much of each shape, hung on these joints: what [`deform`](super::deform) gives for the same lies in it.
    /// Empty of a mesh without vertices.
    pub fn bounds(&self, joints: &[DAffine3], weights: &[f64]) -> Aabb {
        let all = self.parts.iter().fold(Aabb::EMPTY, |all, part| {
            let place = part.joint.and_then(|joint| joints.get(joint)).copied().unwrap_or(DAffine3::IDENTITY);
            all.union(&moved(&part.shaped(weights), &place))
        });
        if all.is_empty() {
            return all;
        }
        let slack =
            DVec3::splat(SLACK * all.size().max_element()) + all.min.abs().max(all.max.abs()) * f64::EPSILON * 8.0;
        Aabb { min: all.min - slack, max: all.max + slack }
    }
}

impl Part {
    fn hold(&mut self, mesh: &Mesh, vertex: usize, place: DVec3) {
        let grow = |bounds: &mut Aabb, place: DVec3| {
            *bounds = Aabb { min: bounds.min.min(place), max: bounds.max.max(place) };
        };
        grow(&mut self.bounds, place);
        for (bounds, shape) in self.shapes.iter_mut().zip(&mesh.morphs) {
            if let Some(&offset) = shape.positions.get(vertex) {
                grow(bounds, Vec3::from(offset).as_dvec3());
            }
        }
    }

    fn shaped(&self, weights: &[f64]) -> Aabb {
        let mut all = self.bounds;
        for (shape, &weight) in self.shapes.iter().zip(weights) {
            if !shape.is_empty() && weight != 0.0 {
                let (a, b) = (shape.min * weight, shape.max * weight);
                all = Aabb { min: all.min + a.min(b), max: all.max + a.max(b) };
            }
        }
        all
    }
}

/// The box around a moved box, by its middle and half its size (J. Arvo, "Transforming Axis-Aligned Bounding Boxes", Graphics Gems 1990).
fn moved(bounds: &Aabb, transform: &DAffine3) -> Aabb {
    if bounds.is_empty() {
        return Aabb::EMPTY;
    }
    let matrix = transform.matrix3;
    let middle = transform.transform_point3(bounds.center());
    let half = bounds.size() * 0.5;
    let reach = matrix.x_axis.abs() * half.x + matrix.y_axis.abs() * half.y + matrix.z_axis.abs() * half.z;
    Aabb { min: middle - reach, max: middle + reach }
}
