//! Tangents of a mesh that has none.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace};
use glam::Vec3;

use super::{Influences, Mesh, Morph};

impl Mesh {
    /// MikkTSpace tangents from positions, normals and texture coordinates; none without texture coordinates. A vertex whose
    /// triangles disagree, as at a mirrored seam, is split. Needs the feature `readers`.
    pub fn compute_tangents(&mut self) {
        self.tangents.clear();
        if self.uvs.is_empty() || self.normals.is_empty() {
            return;
        }
        let mut corners = Corners { mesh: self, tangents: vec![None; self.indices.len()] };
        // The error type has no values today; should it get some, the fallback below is still a valid frame.
        let _ = bevy_mikktspace::generate_tangents(&mut corners);
        let tangents = corners.tangents;
        self.tangents = self.normals.iter().map(|&normal| any_tangent(normal)).collect();
        let mut is_set = vec![false; self.positions.len()];
        let mut splits = HashMap::new();
        for (corner, tangent) in tangents.into_iter().enumerate() {
            let vertex = self.indices[corner] as usize;
            let Some(tangent) = tangent.filter(|&tangent| spans_plane(self.normals[vertex], tangent)) else { continue };
            if !is_set[vertex] {
                is_set[vertex] = true;
                self.tangents[vertex] = tangent;
            } else if self.tangents[vertex] != tangent {
                let key = (vertex, tangent.map(f32::to_bits));
                self.indices[corner] = *splits.entry(key).or_insert_with(|| self.split_vertex(vertex, tangent));
            }
        }
    }

    fn split_vertex(&mut self, vertex: usize, tangent: [f32; 4]) -> u32 {
        fn again<T: Copy>(values: &mut Vec<T>, vertex: usize) {
            values.extend(values.get(vertex).copied());
        }
        again(&mut self.positions, vertex);
        again(&mut self.normals, vertex);
        again(&mut self.uvs, vertex);
        again(&mut self.uvs_1, vertex);
        again(&mut self.colors, vertex);
        self.tangents.push(tangent);
        if let Some(Influences { per_vertex, joints, weights }) = &mut self.influences {
            let own = vertex * *per_vertex..(vertex + 1) * *per_vertex;
            joints.extend_from_within(own.clone());
            weights.extend_from_within(own);
        }
        for Morph { name: _, positions, normals, tangents, uvs, colors } in &mut self.morphs {
            again(positions, vertex);
            again(normals, vertex);
            again(tangents, vertex);
            again(uvs, vertex);
            again(colors, vertex);
        }
        (self.positions.len() - 1) as u32
    }
}

/// Returns true if normal and tangent give a bitangent: MikkTSpace answers (1, 0, 0) where texture coordinates coincide, and huge
/// triangles overflow its f32.
fn spans_plane(normal: [f32; 3], [x, y, z, _]: [f32; 4]) -> bool {
    // The comparison is false for NaN.
    Vec3::from(normal).cross(Vec3::new(x, y, z)).length_squared() > 1e-6
}

/// An arbitrary tangent for a vertex whose texture coordinates give none.
fn any_tangent(normal: [f32; 3]) -> [f32; 4] {
    Vec3::from(normal).any_orthonormal_vector().extend(1.0).to_array()
}

/// A mesh as MikkTSpace reads it, and the tangent that it writes for each corner.
struct Corners<'a> {
    mesh: &'a Mesh,
    tangents: Vec<Option<[f32; 4]>>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.indices[face * 3 + corner] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.indices.len() / 3
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)]
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)]
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // MikkTSpace's V runs up, ours down; so the bitangent points to the image's top, as normal maps with +Y up want it.
        let [u, v] = self.mesh.uvs[self.vertex(face, corner)];
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, tangent_space: Option<TangentSpace>, face: usize, corner: usize) {
        self.tangents[face * 3 + corner] = tangent_space.map(|space| space.tangent_encoded());
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::tests::quad;
    use super::*;

    #[test]
    fn tangent_runs_along_u_and_bitangent_to_the_top_of_the_image() {
        let mut mesh = quad();
        mesh.compute_normals();
        mesh.compute_tangents();
        assert_eq!(mesh.normals, vec![[0.0, 0.0, 1.0]; 4]);
        assert_eq!(mesh.tangents, vec![[1.0, 0.0, 0.0, 1.0]; 4]);
    }

    #[test]
    fn texture_coordinates_without_area_still_give_a_frame() {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let (u, v) = axis.any_orthonormal_pair();
            let mut mesh = Mesh::from_points("flat", &[DVec3::ZERO, u, v]);
            mesh.uvs = vec![[0.5, 0.5]; 3];
            mesh.indices = vec![0, 1, 2];
            mesh.compute_normals();
            mesh.compute_tangents();
            assert!((0..3).all(|i| spans_plane(mesh.normals[i], mesh.tangents[i])), "{axis}");
        }
    }

    #[test]
    fn mirrored_texture_coordinates_split_the_shared_vertices() {
        let mut mesh = quad();
        // The second triangle's image is mirrored about the diagonal's u.
        mesh.uvs = vec![[0.0, 1.0], [1.0, 1.0], [0.5, 0.0], [1.0, 1.0]];
        mesh.compute_normals();
        mesh.compute_tangents();
        assert!(mesh.positions.len() > 4);
        assert_eq!(mesh.tangents.len(), mesh.positions.len());
        assert_eq!(mesh.uvs.len(), mesh.positions.len());
        let sign = |corner: usize| mesh.tangents[mesh.indices[corner] as usize][3];
        assert_eq!((sign(0), sign(3)), (1.0, -1.0));
    }
}
