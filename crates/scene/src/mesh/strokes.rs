//! Points and lines in a mesh.
//!
//! A *stroke* is a line from one end to another; a point is a stroke whose ends are equal. Renderer and truth draw it as the rectangle of the picture that
//! is one pixel wide and reaches half a pixel beyond both ends. On the mesh it has no area: all code that draws triangles, hits them with rays or sums their
//! areas then needs no case for it.

use glam::DVec3;

use super::Mesh;

/// Vertices of a stroke.
pub const STROKE_VERTICES: usize = 6;

/// The end, 0 or 1, of each of a stroke's vertices. The first four are the rectangle's corners, counter-clockwise in the picture. The vertex two
/// further on is always at the other end, so that a vertex stage finds the other end in the same stream.
pub const STROKE_ENDS: [usize; STROKE_VERTICES] = [0, 1, 1, 0, 0, 1];

/// The triangles of a stroke.
const TRIANGLES: [u32; 6] = [0, 1, 2, 0, 2, 3];

/// The indices of a number of strokes.
pub fn stroke_indices(strokes: usize) -> impl Iterator<Item = u32> {
    (0..strokes).flat_map(|stroke| TRIANGLES.map(|corner| (STROKE_VERTICES * stroke) as u32 + corner))
}

impl Mesh {
    /// Lines between these places in mesh space, and points for pairs of equal places. All normals are +Y; without light the strokes need an unlit
    /// material.
    pub fn of_strokes(name: impl Into<String>, strokes: &[[DVec3; 2]]) -> Self {
        let points: Vec<DVec3> = strokes.iter().flat_map(|ends| STROKE_ENDS.map(|end| ends[end])).collect();
        let normals = vec![[0.0, 1.0, 0.0]; points.len()];
        let indices = stroke_indices(strokes.len()).collect();
        Self { normals, indices, is_strokes: true, ..Self::from_points(name, &points) }
    }

    /// The first and the last vertex of each stroke; nothing for a mesh of triangles.
    pub fn strokes(&self) -> impl Iterator<Item = [usize; 2]> {
        let count = if self.is_strokes { self.positions.len() / STROKE_VERTICES } else { 0 };
        (0..count).map(|stroke| [STROKE_VERTICES * stroke, STROKE_VERTICES * stroke + 1])
    }

    /// Explains why vertices or indices do not form strokes; `None` if they do.
    pub(crate) fn strokes_fault(&self) -> Option<String> {
        let vertices = self.positions.len();
        if !vertices.is_multiple_of(STROKE_VERTICES) {
            return Some(format!("its {vertices} vertices are not {STROKE_VERTICES} a stroke"));
        }
        let expected = stroke_indices(vertices / STROKE_VERTICES);
        if !self.indices.iter().copied().eq(expected) {
            return Some("its indices are not those of strokes: set them with `stroke_indices`".into());
        }
        let strokes = self.positions.as_chunks::<STROKE_VERTICES>().0.iter();
        let is_odd = |own: &[[f32; 3]; STROKE_VERTICES]| (0..STROKE_VERTICES).any(|at| own[at] != own[STROKE_ENDS[at]]);
        let stroke = strokes.into_iter().position(is_odd)?;
        Some(format!("the vertices of stroke {stroke} are not at its two ends"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_has_no_area_and_the_other_end_two_vertices_on() {
        let mesh = Mesh::of_strokes("one", &[[DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)]]);
        for corners in mesh.indices.as_chunks::<3>().0 {
            let points = corners.map(|corner| DVec3::from(mesh.positions[corner as usize].map(f64::from)));
            assert_eq!(crate::mesh::triangle_normal(&points), None);
        }
        for corner in 0..4 {
            assert_ne!(mesh.positions[corner], mesh.positions[corner + 2]);
        }
        assert_eq!(mesh.strokes().collect::<Vec<_>>(), [[0, 1]]);
        assert_eq!(mesh.strokes_fault(), None);
    }

    #[test]
    fn triangles_that_are_no_strokes_are_a_fault() {
        let good = Mesh::of_strokes("one", &[[DVec3::ZERO, DVec3::X]]);
        let mut short = good.clone();
        short.positions.pop();
        assert!(short.strokes_fault().unwrap().contains("5 vertices are not 6"));
        let mut turned = good.clone();
        turned.indices.swap(0, 1);
        assert!(turned.strokes_fault().unwrap().contains("stroke_indices"));
        let mut moved = good;
        moved.positions[4][1] += 1.0;
        assert!(moved.strokes_fault().unwrap().contains("stroke 0"));
    }
}
