//! Triangle meshes, and their placement.

#[cfg(feature = "readers")]
mod order;
mod strokes;
#[cfg(feature = "readers")]
mod tangents;

use glam::{DAffine3, DVec3, Vec3};

use super::motion::{Influences, Morph};
use super::{Aabb, Levels, Look};

pub use strokes::{STROKE_ENDS, STROKE_VERTICES, stroke_indices};

/// A triangle of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TriangleId {
    /// Index in `Scene::objects`.
    pub object: u32,
    /// Index of the triangle in the object's mesh: its corners are `indices[3 * triangle..][..3]`.
    pub triangle: u32,
}

/// An indexed triangle list with one material's worth of vertices. Counter-clockwise is the front.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// The name in messages and reports.
    pub name: String,
    /// The place in mesh space that positions are relative to. It was subtracted in f64 before they became f32.
    pub origin: DVec3,
    /// Relative to `origin`, metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit length; as many as positions.
    pub normals: Vec<[f32; 3]>,
    /// Empty, or as many as positions. (0, 0) is the image's upper left corner.
    pub uvs: Vec<[f32; 2]>,
    /// Empty, or as many as positions: MikkTSpace tangents; bitangent = w * cross(normal, tangent), towards the image's top.
    pub tangents: Vec<[f32; 4]>,
    /// Empty, or as many as positions: the second set of texture coordinates.
    pub uvs_1: Vec<[f32; 2]>,
    /// Empty, or as many as positions: linear RGB and alpha, which multiply the material's base colour and alpha.
    pub colors: Vec<[f32; 4]>,
    /// The joints of a skin that move each vertex, if the mesh was made for a skin.
    pub influences: Option<Influences>,
    /// The shapes that it blends to.
    pub morphs: Vec<Morph>,
    /// Three a triangle, each below `positions.len()`.
    pub indices: Vec<u32>,
    /// True if it is points and lines, which are drawn one pixel wide: [`STROKE_VERTICES`] vertices each, with the indices of [`stroke_indices`].
    pub is_strokes: bool,
    /// The box around all of `origin + positions`.
    pub bounds: Aabb,
    /// The levels that [`Mesh::levels_of_detail`] has made.
    pub levels: Levels,
}

impl Mesh {
    /// A mesh at `points`, in mesh space: they are recentred in f64 before they become f32, so that a model far from zero
    /// keeps its shape. Sets `origin`, `positions` and `bounds`.
    pub fn from_points(name: impl Into<String>, points: &[DVec3]) -> Self {
        let origin = Aabb::of_points(points.iter().copied()).center();
        let positions = points.iter().map(|&p| (p - origin).as_vec3().to_array()).collect();
        let mut mesh = Self { name: name.into(), origin, positions, ..Self::default() };
        mesh.bounds = mesh.compute_bounds();
        mesh
    }

    /// Smooth normals from the triangles around each vertex, weighted by their angle there, which makes them independent of
    /// how polygons were cut (Thürmer and Wüthrich 1998). A hard edge needs separate vertices on its two sides.
    pub fn compute_normals(&mut self) {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for triangle in self.indices.as_chunks::<3>().0 {
            let points = triangle.map(|i| Vec3::from(self.positions[i as usize]).as_dvec3());
            let Some(normal) = triangle_normal(&points) else { continue };
            for (corner, &vertex) in triangle.iter().enumerate() {
                sums[vertex as usize] += normal * corner_angle(&points, corner);
            }
        }
        // A vertex of no proper triangle still needs a unit vector.
        self.normals = sums.iter().map(|sum| sum.normalize_or(DVec3::Y).as_vec3().to_array()).collect();
    }

    /// Drops triangles without area, which draw nothing but distort normals and tangents. Returns their number. Points and lines stay.
    pub fn remove_degenerate_triangles(&mut self) -> usize {
        if self.is_strokes {
            return 0;
        }
        let before = self.indices.len();
        let kept = self.indices.as_chunks::<3>().0.iter().filter(|triangle| {
            let points = triangle.map(|i| Vec3::from(self.positions[i as usize]).as_dvec3());
            triangle_normal(&points).is_some()
        });
        self.indices = kept.flatten().copied().collect();
        (before - self.indices.len()) / 3
    }

    /// Triangles that are wound against the mean of their corners' normals.
    pub(crate) fn faces_against_their_normals(&self) -> usize {
        let corner = |values: &[[f32; 3]], index: u32| Vec3::from(values[index as usize]);
        let against = |triangle: &&[u32]| {
            let [a, b, c] = [0, 1, 2].map(|i| corner(&self.positions, triangle[i]));
            let mean: Vec3 = triangle.iter().map(|&index| corner(&self.normals, index)).sum();
            (b - a).cross(c - a).dot(mean) < 0.0
        };
        self.indices.chunks_exact(3).filter(against).count()
    }

    /// Returns the box around `origin + positions`, which `bounds` must contain.
    pub fn compute_bounds(&self) -> Aabb {
        Aabb::of_points(self.positions.iter().map(|&p| self.origin + Vec3::from(p).as_dvec3()))
    }
}

/// Unit normal of a counter-clockwise triangle; none when it has no area.
pub(crate) fn triangle_normal(points: &[DVec3; 3]) -> Option<DVec3> {
    (points[1] - points[0]).cross(points[2] - points[0]).try_normalize()
}

/// The triangle's inner angle at one of its corners, in radians.
pub(crate) fn corner_angle(points: &[DVec3; 3], corner: usize) -> f64 {
    let here = points[corner];
    let a = (points[(corner + 1) % 3] - here).normalize_or_zero();
    let b = (points[(corner + 2) % 3] - here).normalize_or_zero();
    a.dot(b).clamp(-1.0, 1.0).acos()
}

/// A mesh placed in the world with a material.
#[derive(Debug, Clone)]
pub struct Object {
    /// The name in messages and reports.
    pub name: String,
    /// Index in `Scene::meshes`.
    pub mesh: usize,
    /// Index in `Scene::materials`.
    pub material: usize,
    /// The transform from mesh space to world space. May mirror.
    pub transform: DAffine3,
    /// The faces that cast shadows.
    pub casts_shadow: CastsShadow,
    /// True if shadows fall on it.
    pub receives_shadow: bool,
    /// The node of [`Motion::nodes`](super::Motion::nodes) that it is attached to; `None` if no node moves it. The node's weights weight its shapes.
    /// An object with a skin is placed by its joints, not by its node, and `transform` moves it from there, so several objects may share the joints
    /// of one skeleton.
    pub node: Option<usize>,
    /// Index in [`Motion::skins`](super::Motion::skins) of the skin that deforms its mesh.
    pub skin: Option<usize>,
    /// True if the program will move it, so that plans keep the lights and parts that it may need elsewhere. Motion by clips counts without this.
    pub movable: bool,
    /// The look, if it may differ from other objects of the same mesh and material; `None` if it never does. Any look, even a plain one, keeps the
    /// parts that looks need in the plan, so that `Renderer::set_look` needs no other plan.
    pub look: Option<Look>,
}

/// The faces of an object that cast shadows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum CastsShadow {
    /// No faces.
    No,
    /// Only faces that are turned to the light.
    Front,
    /// All faces.
    #[default]
    Yes,
}

impl Object {
    /// A mesh with a material at a place, which casts and receives shadows.
    pub fn new(name: impl Into<String>, mesh: usize, material: usize, transform: DAffine3) -> Self {
        let casts_shadow = CastsShadow::Yes;
        Self {
            name: name.into(),
            mesh,
            material,
            transform,
            casts_shadow,
            receives_shadow: true,
            node: None,
            skin: None,
            movable: false,
            look: None,
        }
    }

    /// Returns true if a node or a skin moves it.
    pub fn moves(&self) -> bool {
        self.node.is_some() || self.skin.is_some()
    }

    /// World-space box; empty if it has none of these meshes.
    pub fn bounds(&self, meshes: &[Mesh]) -> Aabb {
        meshes.get(self.mesh).map_or(Aabb::EMPTY, |mesh| mesh.bounds.transformed(&self.transform))
    }
}

/// The triangles of a grid of squares with `edge` vertices along each edge, row by row.
pub fn grid_indices(edge: u32) -> Vec<u32> {
    let corners = (0..edge - 1).flat_map(|row| (0..edge - 1).map(move |column| edge * row + column));
    corners.flat_map(|i| [i, i + edge, i + 1, i + 1, i + edge, i + edge + 1]).collect()
}

/// The number of vertices that a device transforms for a list of triangles, if it takes them in groups of 32 consecutive vertices.
pub fn transformed_vertices(indices: &[u32]) -> usize {
    use std::collections::HashSet;

    let (mut all, mut group) = (0, HashSet::<u32>::new());
    for triangle in indices.as_chunks::<3>().0 {
        if group.len() + triangle.iter().filter(|vertex| !group.contains(*vertex)).count() > 32 {
            all += group.len();
            group.clear();
        }
        group.extend(triangle.iter().copied());
    }
    all + group.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn quad() -> Mesh {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let mut mesh = Mesh::from_points("quad", &points);
        mesh.uvs = vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
        mesh.indices = vec![0, 1, 2, 0, 2, 3];
        mesh
    }

    #[test]
    fn far_from_zero_a_millimetre_is_kept() {
        let base = DVec3::new(1e7, -3e6, 5e8);
        let mesh = Mesh::from_points("far", &[base, base + DVec3::X * 0.001, base + DVec3::Y * 0.002]);
        let width = f64::from(mesh.positions[1][0]) - f64::from(mesh.positions[0][0]);
        assert!((width - 0.001).abs() < 1e-8, "{width}");
    }

    #[test]
    fn triangles_without_area_are_dropped_and_counted() {
        let mut mesh = quad();
        mesh.indices.extend([0, 0, 1, 1, 1, 1]);
        assert_eq!(mesh.remove_degenerate_triangles(), 2);
        assert_eq!(mesh.indices.len(), 6);
    }

    #[test]
    fn normals_do_not_depend_on_how_a_corner_is_cut() {
        // A cube's corner: three faces, one of them cut in two there.
        let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 0.]].map(DVec3::from);
        let mut mesh = Mesh::from_points("corner", &points);
        mesh.indices = vec![0, 4, 1, 0, 2, 4, 0, 1, 3, 0, 3, 2];
        mesh.compute_normals();
        let expected = DVec3::NEG_ONE.normalize();
        assert!((Vec3::from(mesh.normals[0]).as_dvec3() - expected).length() < 1e-6);
    }
}
