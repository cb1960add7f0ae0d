//! The light path `visibility` identifies a triangle by its first vertex. A fragment shader that reads `primitive_index` would make a GPU draw
//! triangles for a third longer (docs/LIGHT_PATHS.md, "What a G-buffer costs"). A flat value, taken from the first vertex, costs nothing, but no two
//! triangles may begin with the same vertex.

use crate::scene::Mesh;

/// A mesh with vertices and indices in another order: its triangle i begins with its vertex i.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct NumberedMesh {
    /// The index of each vertex in the scene's mesh. Vertices that begin no triangle of the mesh come last.
    pub sources: Vec<u32>,
    /// Three indices a triangle, in the order and with the winding of the mesh's triangles.
    pub indices: Vec<u32>,
    /// The levels of detail.
    pub levels: Vec<NumberedLevel>,
}

/// A level of detail, whose triangle i begins with the vertex `begin + i`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NumberedLevel {
    pub begin: u32,
    /// Three a triangle.
    pub indices: Vec<u32>,
}

/// No vertex.
const NONE: u32 = u32::MAX;

/// The vertices so far.
struct VertexCopies {
    sources: Vec<u32>,
    /// The newest copy of each vertex of the scene's mesh.
    latest: Vec<u32>,
}

impl VertexCopies {
    fn push(&mut self, source: u32) -> u32 {
        let vertex = self.sources.len() as u32;
        self.latest[source as usize] = vertex;
        self.sources.push(source);
        vertex
    }

    /// Adds a first vertex for each triangle, and returns the indices of all triangles. A GPU transforms vertices in groups of some 32 consecutive
    /// ones, so triangles should share vertices with their neighbours: each begins with the corner that has no copy yet, or the oldest one, and uses
    /// the nearest copies of its other corners.
    fn add(&mut self, indices: &[u32]) -> Vec<u32> {
        let mut triangles: Vec<([u32; 3], [u32; 3])> = Vec::with_capacity(indices.len() / 3);
        for &[a, b, c] in indices.as_chunks::<3>().0 {
            // NONE becomes 0, which sorts before all others.
            let since = |source: u32| self.latest[source as usize].wrapping_add(1);
            let turned = [[a, b, c], [b, c, a], [c, a, b]];
            let own = turned.into_iter().min_by_key(|&[begin, ..]| since(begin)).unwrap_or([a, b, c]);
            let begin = self.push(own[0]);
            triangles.push((own, [begin, self.latest[own[1] as usize], self.latest[own[2] as usize]]));
        }
        let mut following = vec![NONE; self.latest.len()];
        for (sources, [begin, near @ ..]) in triangles.iter_mut().rev() {
            following[sources[0] as usize] = *begin;
            for (&source, near) in sources[1..].iter().zip(near) {
                let after = following[source as usize];
                if *near == NONE && after == NONE {
                    following[source as usize] = self.push(source);
                }
                *near = nearest(*begin, *near, following[source as usize]);
            }
        }
        triangles.into_iter().flat_map(|(_, corners)| corners).collect()
    }
}

/// Returns the nearer of two vertices, one before and one after; if one is NONE, the other.
fn nearest(own: u32, before: u32, after: u32) -> u32 {
    match (before, after) {
        (NONE, after) => after,
        (before, NONE) => before,
        (before, after) if own - before <= after - own => before,
        (_, after) => after,
    }
}

impl NumberedMesh {
    /// Numbers the triangles of a mesh and of its first `levels` levels of detail.
    pub fn of(mesh: &Mesh, levels: usize) -> Self {
        let mut vertices = VertexCopies {
            sources: Vec::with_capacity(mesh.indices.len() / 3),
            latest: vec![NONE; mesh.positions.len()],
        };
        let indices = vertices.add(&mesh.indices);
        let made = if levels > 0 { mesh.levels_of_detail() } else { Default::default() };
        let level = |level: &crate::scene::Level| {
            let begin = vertices.sources.len() as u32;
            NumberedLevel { begin, indices: vertices.add(&level.indices) }
        };
        let levels = made.iter().take(levels).map(level).collect();
        Self { sources: vertices.sources, indices, levels }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::{grid_indices, transformed_vertices};

    fn mesh(vertices: usize, indices: Vec<u32>) -> Mesh {
        let points: Vec<_> = (0..vertices).map(|i| DVec3::new(i as f64, (i * i) as f64, 0.0)).collect();
        Mesh { indices, ..Mesh::from_points("mesh", &points) }
    }

    /// The triangles as corners of the scene's mesh, each from its least corner on: turning one changes nothing.
    fn triangles(indices: &[u32], source: impl Fn(u32) -> u32) -> Vec<[u32; 3]> {
        let turned = |&triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(&source);
            [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default()
        };
        indices.as_chunks::<3>().0.iter().map(turned).collect()
    }

    #[test]
    fn a_strip_needs_a_vertex_for_each_triangle_and_two_more() {
        let strip = mesh(6, vec![0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 5]);
        let numbered = NumberedMesh::of(&strip, 0);
        assert_eq!((numbered.sources.len(), numbered.indices.len()), (6, 12));
        // A fan has all its triangles about one vertex, and each begins with another.
        let fan = mesh(5, vec![0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1]);
        assert_eq!(NumberedMesh::of(&fan, 0).sources.len(), 5);
    }

    #[test]
    fn triangles_take_vertices_of_those_near_them() {
        let numbered = NumberedMesh::of(&mesh(1600, grid_indices(40)), 0);
        // One for each triangle is the least. Were a vertex's first copy taken wherever it lies, it would be 1.55.
        let share = transformed_vertices(&numbered.indices) as f64 / (2 * 39 * 39) as f64;
        assert!((1.0..1.12).contains(&share), "{share}");
    }

    proptest! {
        #[test]
        fn each_triangle_begins_with_its_own_vertex_and_is_the_one_that_it_was(
            indices in proptest::collection::vec(0..12u32, 0..60),
        ) {
            let indices = indices[..indices.len() / 3 * 3].to_vec();
            let numbered = NumberedMesh::of(&mesh(12, indices.clone()), 0);
            let source = |vertex: u32| numbered.sources[vertex as usize];
            prop_assert_eq!(triangles(&numbered.indices, source), triangles(&indices, |vertex| vertex));
            let count = indices.len() / 3;
            prop_assert!((0..).zip(numbered.indices.as_chunks::<3>().0).all(|(number, triangle)| triangle[0] == number));
            prop_assert!(numbered.sources.len() <= count + 12);
        }
    }

    #[test]
    fn triangles_of_levels_begin_with_vertices_of_their_own() {
        let height = |x: f64, z: f64| (0.3 * x).sin() * (0.2 * z).cos();
        let points: Vec<_> = (0..40 * 40).map(|i| (f64::from(i % 40), f64::from(i / 40))).collect();
        let points: Vec<_> = points.into_iter().map(|(x, z)| DVec3::new(x, height(x, z), z)).collect();
        let mut hills = Mesh::from_points("hills", &points);
        hills.indices = grid_indices(40);
        hills.compute_normals();
        let made = hills.levels_of_detail();
        let numbered = NumberedMesh::of(&hills, made.len());
        assert!(made.len() >= 2 && numbered.levels.len() == made.len());
        let source = |vertex: u32| numbered.sources[vertex as usize];
        let mut end = hills.indices.len() as u32 / 3;
        for (own, level) in numbered.levels.iter().zip(made.iter()) {
            assert_eq!(triangles(&own.indices, source), triangles(&level.indices, |vertex| vertex));
            assert!(own.begin >= end);
            for (number, triangle) in (own.begin..).zip(own.indices.as_chunks::<3>().0) {
                assert_eq!(triangle[0], number);
                end = number + 1;
            }
        }
        assert!(
            numbered
                .indices
                .iter()
                .chain(numbered.levels.iter().flat_map(|level| &level.indices))
                .all(|&index| (index as usize) < numbered.sources.len())
        );
    }
}
