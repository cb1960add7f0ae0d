//! Bounding boxes of meshes that shapes and joints deform, computed without a loop over the vertices.

use glam::{DAffine3, DVec3, Vec3};

use crate::{Aabb, Mesh};

/// The growth of a box beyond its contents, as a share of its longest edge: positions on a device are f32.
const SLACK: f64 = 1e-6;

/// A part of a mesh that moves together: the vertices that hang on one joint with any weight, or all vertices.
#[derive(Debug, Clone, PartialEq)]
struct JointBounds {
    /// Index in the skin's joints; `None` for a mesh without joints.
    joint: Option<usize>,
    /// The box around its vertices, in mesh space.
    bounds: Aabb,
    /// For each shape, a box around the offsets that it adds to these vertices; empty if the shape moves none of them.
    shapes: Vec<Aabb>,
    /// The sum of its vertices' weights, and the weighted sums of their positions and of the shapes' offsets.
    weight: f64,
    places: DVec3,
    offsets: Vec<DVec3>,
}

/// Boxes of a mesh's parts, from which a bounding box follows for any deformation.
///
/// A vertex of a linear blend is a mean of the places that its joints alone would give it. So all vertices lie in the convex hull of, for each
/// joint, the box around its vertices moved by that joint. Offsets by shapes are bounded by interval arithmetic, for each joint on its own.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DeformBounds {
    parts: Vec<JointBounds>,
    vertices: usize,
}

impl DeformBounds {
    /// Visits each vertex once. `is_skinned` is true if joints will be given to [`DeformBounds::bounds`].
    pub fn of(mesh: &Mesh, is_skinned: bool) -> Self {
        let influences = mesh.influences.as_ref().filter(|own| is_skinned && own.per_vertex > 0);
        let mut parts: Vec<JointBounds> = Vec::new();
        // The index of each joint's part.
        let mut numbers: Vec<Option<usize>> = Vec::new();
        let mut whole = None;
        for (vertex, &position) in mesh.positions.iter().enumerate() {
            let place = mesh.origin + Vec3::from(position).as_dvec3();
            let mut hold = |joint: Option<usize>, weight: f64| {
                let number = match joint {
                    None => &mut whole,
                    Some(joint) => {
                        numbers.resize(numbers.len().max(joint + 1), None);
                        &mut numbers[joint]
                    }
                };
                let number = *number.get_or_insert_with(|| {
                    parts.push(JointBounds::of(joint, mesh.morphs.len()));
                    parts.len() - 1
                });
                parts[number].hold(mesh, vertex, place, weight);
            };
            let own = influences.map(|own| {
                let range = vertex * own.per_vertex..(vertex + 1) * own.per_vertex;
                (own.joints.get(range.clone()).unwrap_or_default(), own.weights.get(range).unwrap_or_default())
            });
            match own {
                None | Some(([], _)) => hold(None, 1.0),
                // As in `deform`, a vertex without weights follows its first joint.
                Some((joints, weights)) if weights.iter().all(|weight| *weight <= 0.0) => {
                    hold(Some(joints[0].into()), 1.0);
                }
                Some((joints, weights)) => {
                    let sum: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
                    let counting = joints.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
                    counting.for_each(|(&joint, &weight)| hold(Some(joint.into()), f64::from(weight) / sum));
                }
            }
        }
        Self { parts, vertices: mesh.positions.len() }
    }

    /// Returns a box that contains the mesh as [`deform`](fn@super::deform) moves it by these joints and weights of shapes. It is empty for a mesh
    /// without vertices.
    pub fn bounds(&self, joints: &[DAffine3], weights: &[f64]) -> Aabb {
        let all = self.parts.iter().fold(Aabb::EMPTY, |all, part| {
            let place = part.joint.and_then(|joint| joints.get(joint)).copied().unwrap_or(DAffine3::IDENTITY);
            all.union(&moved(&part.shaped(weights), &place))
        });
        if all.is_empty() {
            return all;
        }
        let slack = DVec3::splat(SLACK * all.size().max_element());
        Aabb { min: all.min - slack, max: all.max + slack }
    }

    /// Returns the mean of the vertices as [`deform`](fn@super::deform) moves them by these joints and weights. The middle of the box may be far from
    /// the mesh if a distant joint has a vertex with next to no weight.
    pub fn mean(&self, joints: &[DAffine3], weights: &[f64]) -> DVec3 {
        let sums = self.parts.iter().map(|part| {
            let place = part.joint.and_then(|joint| joints.get(joint)).copied().unwrap_or(DAffine3::IDENTITY);
            let offsets: DVec3 = part.offsets.iter().zip(weights).map(|(sum, &weight)| *sum * weight).sum();
            place.matrix3 * (part.places + offsets) + place.translation * part.weight
        });
        sums.sum::<DVec3>() / self.vertices.max(1) as f64
    }
}

impl JointBounds {
    fn of(joint: Option<usize>, shapes: usize) -> Self {
        let (bounds, places) = (Aabb::EMPTY, DVec3::ZERO);
        Self { joint, bounds, shapes: vec![bounds; shapes], weight: 0.0, places, offsets: vec![places; shapes] }
    }

    fn hold(&mut self, mesh: &Mesh, vertex: usize, place: DVec3, weight: f64) {
        let grow = |bounds: &mut Aabb, place: DVec3| {
            *bounds = Aabb { min: bounds.min.min(place), max: bounds.max.max(place) };
        };
        grow(&mut self.bounds, place);
        self.weight += weight;
        self.places += place * weight;
        for ((bounds, sum), shape) in self.shapes.iter_mut().zip(&mut self.offsets).zip(&mesh.morphs) {
            if let Some(&offset) = shape.positions.get(vertex) {
                let offset = Vec3::from(offset).as_dvec3();
                grow(bounds, offset);
                *sum += offset * weight;
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

/// The box around a moved box, by its middle and half its size (J. Arvo, "Transforming Axis-Aligned Bounding Boxes", Graphics Gems 1990), and by what
/// f64 rounds on the way: terms that are large and cancel leave their rounding.
fn moved(bounds: &Aabb, transform: &DAffine3) -> Aabb {
    if bounds.is_empty() {
        return Aabb::EMPTY;
    }
    let matrix = transform.matrix3;
    let middle = transform.transform_point3(bounds.center());
    let half = bounds.size() * 0.5;
    let along = |by: DVec3| matrix.x_axis.abs() * by.x + matrix.y_axis.abs() * by.y + matrix.z_axis.abs() * by.z;
    let largest = along(bounds.min.abs().max(bounds.max.abs())) + transform.translation.abs();
    let reach = along(half) + largest * f64::EPSILON * 8.0;
    Aabb { min: middle - reach, max: middle + reach }
}
