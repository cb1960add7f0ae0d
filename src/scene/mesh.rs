//! Triangle meshes and where they stand.

use glam::{DAffine3, DVec3, Vec3};

use super::Aabb;

/// An indexed triangle list with one material's worth of vertices. Counter-clockwise is the front.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    pub name: String,
    /// Where the vertices' zero lies in mesh space. Subtracted in f64 before positions became f32.
    pub origin: DVec3,
    /// Relative to `origin`, metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit length; as many as positions.
    pub normals: Vec<[f32; 3]>,
    /// Empty, or as many as positions. (0, 0) is the image's upper left corner.
    pub uvs: Vec<[f32; 2]>,
    /// Empty, or as many as positions: MikkTSpace tangents; bitangent = w * cross(normal, tangent).
    pub tangents: Vec<[f32; 4]>,
    /// Three a triangle, each below `positions.len()`.
    pub indices: Vec<u32>,
    /// Of `origin + positions`.
    pub bounds: Aabb,
}

impl Mesh {
    /// The box around `origin + positions`; what `bounds` must hold.
    pub fn compute_bounds(&self) -> Aabb {
        Aabb::of_points(self.positions.iter().map(|&p| self.origin + Vec3::from(p).as_dvec3()))
    }
}

/// A mesh placed in the world with a material.
#[derive(Debug, Clone)]
pub struct Object {
    pub name: String,
    pub mesh: usize,
    pub material: usize,
    /// From mesh space to world space. May mirror.
    pub transform: DAffine3,
}

impl Object {
    /// World-space box.
    pub fn bounds(&self, meshes: &[Mesh]) -> Aabb {
        meshes[self.mesh].bounds.transformed(&self.transform)
    }
}
