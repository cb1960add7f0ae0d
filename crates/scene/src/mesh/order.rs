//! The order of a mesh's triangles.

use super::Mesh;

/// The most steps of [`Mesh::ordering_steps`], about a second. A face of a hundred thousand corners has vertices that would take minutes.
const MOST_ORDERING_STEPS: u64 = 1 << 26;

impl Mesh {
    /// The steps that [`Mesh::order_triangles`] takes for vertices with many triangles: it visits all triangles of a vertex whenever it takes one.
    fn ordering_steps(&self) -> u64 {
        let mut triangles = vec![0_u64; self.positions.len()];
        self.indices.iter().for_each(|&index| triangles[index as usize] += 1);
        triangles.iter().filter(|&&own| own > 64).map(|own| own * own).sum()
    }

    /// Reorders the triangles so that triangles with shared vertices follow each other, and a device transforms most vertices once (Forsyth,
    /// "Linear-Speed Vertex Cache Optimisation", 2006). Which of several equally far triangles is drawn may change. Needs the feature `readers`.
    pub fn order_triangles(&mut self) {
        if self.is_strokes || self.ordering_steps() > MOST_ORDERING_STEPS {
            return;
        }
        let mut workspace = meshoptimizer_rs::Workspace::default();
        // Beyond the limits of that library the order stays, and the picture is as good.
        if let Ok(indices) =
            meshoptimizer_rs::optimize_vertex_cache(&self.indices, self.positions.len(), &mut workspace)
        {
            self.indices = indices;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::{grid_indices, transformed_vertices};
    use super::*;

    #[test]
    fn triangles_that_share_vertices_come_to_follow_each_other() {
        let points: Vec<DVec3> = (0..1600).map(|i| DVec3::new(f64::from(i % 40), 0.0, f64::from(i / 40))).collect();
        let indices = grid_indices(40);
        let triangles = indices.as_chunks::<3>().0.to_vec();
        let count = triangles.len();
        // A step that is prime to their number takes each once.
        let scattered: Vec<u32> = (0..count).flat_map(|i| triangles[i * 1009 % count]).collect();
        let mut grid = Mesh { indices: scattered, ..Mesh::from_points("grid", &points) };
        assert!(transformed_vertices(&grid.indices) > 2 * count);
        grid.order_triangles();
        assert!(transformed_vertices(&grid.indices) < count, "{}", transformed_vertices(&grid.indices));
        let sorted = |mut triangles: Vec<[u32; 3]>| {
            triangles.sort_unstable();
            triangles
        };
        // Each begins with the corner that it began with.
        assert_eq!(sorted(grid.indices.as_chunks::<3>().0.to_vec()), sorted(triangles));
    }
}
