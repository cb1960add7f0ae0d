//! Meshes as far as they hide something: triangles, and which of them share an edge.

use std::collections::HashMap;

use glam::Vec3;

/// Triangles that share positions, not vertices.
#[derive(Debug, Clone)]
pub(super) struct OccluderMesh {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// For each edge of each triangle, which goes from its corner to the next, the one other triangle that has it in the opposite direction.
    pub(super) neighbours: Vec<[Option<u32>; 3]>,
}

impl OccluderMesh {
    pub(super) fn of(mesh: &crate::scene::Mesh) -> Self {
        let mut places = HashMap::new();
        let mut positions = Vec::new();
        let mut place = |index: u32| {
            let position = mesh.positions[index as usize];
            // Positions with equal bits are drawn at the same place.
            *places.entry(position.map(f32::to_bits)).or_insert_with(|| {
                positions.push(Vec3::from(position));
                (positions.len() - 1) as u32
            })
        };
        let corners = mesh.indices.as_chunks::<3>().0.iter().map(|triangle| triangle.map(&mut place));
        let triangles: Vec<[u32; 3]> = corners.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        let mut edges: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
        for (index, triangle) in triangles.iter().enumerate() {
            for corner in 0..3 {
                edges.entry((triangle[corner], triangle[(corner + 1) % 3])).or_default().push(index as u32);
            }
        }
        let neighbour = |from: u32, to: u32| match (edges.get(&(from, to)), edges.get(&(to, from))) {
            // Of edges with more triangles it is not known which belong together.
            (Some(own), Some(other)) if own.len() == 1 && other.len() == 1 => Some(other[0]),
            _ => None,
        };
        let neighbours =
            triangles.iter().map(|&[a, b, c]| [neighbour(a, b), neighbour(b, c), neighbour(c, a)]).collect();
        Self { positions, triangles, neighbours }
    }
}
