//! Texture coordinates far from zero. Textures repeat, so that whole repeats can be taken off in f64, before the rest becomes f32.

use glam::DVec2;

/// Coordinates nearer to zero than this stay as they are: f32 still tells a thousandth of a texel of a large texture apart there.
const NEAR: f64 = 16.0;

/// Converts texture coordinates to f32. Each connected part of a mesh is moved towards zero by a whole number of repeats. A part that spans many
/// repeats stays as wide as it is.
pub(super) fn wrapped(uvs: &[DVec2], indices: &[u32]) -> Vec<[f32; 2]> {
    let is_near = |uv: &DVec2| uv.abs().max_element() <= NEAR;
    if uvs.iter().all(is_near) {
        return uvs.iter().map(|uv| uv.as_vec2().to_array()).collect();
    }
    let mut parts = DisjointSets((0..uvs.len() as u32).collect());
    indices.as_chunks::<3>().0.iter().for_each(|&[a, b, c]| {
        parts.join(a, b);
        parts.join(b, c);
    });
    let roots: Vec<usize> = (0..uvs.len() as u32).map(|vertex| parts.root(vertex) as usize).collect();
    let mut boxes = vec![(DVec2::INFINITY, DVec2::NEG_INFINITY); uvs.len()];
    for (&root, &uv) in roots.iter().zip(uvs) {
        let (low, high) = &mut boxes[root];
        (*low, *high) = (low.min(uv), high.max(uv));
    }
    let repeats = |root: usize| {
        let middle = (boxes[root].0 * 0.5 + boxes[root].1 * 0.5).floor();
        DVec2::new(
            if middle.x.abs() <= NEAR { 0.0 } else { middle.x },
            if middle.y.abs() <= NEAR { 0.0 } else { middle.y },
        )
    };
    roots.iter().zip(uvs).map(|(&root, &uv)| (uv - repeats(root)).as_vec2().to_array()).collect()
}

/// Connected vertices: each points to another one of its part, or to itself (Tarjan 1975).
struct DisjointSets(Vec<u32>);

impl DisjointSets {
    fn root(&mut self, mut vertex: u32) -> u32 {
        while self.0[vertex as usize] != vertex {
            let above = self.0[self.0[vertex as usize] as usize];
            self.0[vertex as usize] = above;
            vertex = above;
        }
        vertex
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The lower index becomes the root, so that the result does not depend on the order.
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec2; 3] = [DVec2::ZERO, DVec2::new(0.25, 0.0), DVec2::new(0.0, 0.75)];

    #[test]
    fn coordinates_near_zero_stay_as_they_are() {
        let uvs = CORNERS.map(|uv| uv + 15.0);
        assert_eq!(wrapped(&uvs, &[0, 1, 2]), uvs.map(|uv| uv.as_vec2().to_array()));
    }

    #[test]
    fn whole_repeats_are_taken_off_and_what_is_left_is_kept() {
        for offset in [17.0, -1e4, 1e6, 1e9] {
            let uvs = CORNERS.map(|uv| uv + DVec2::new(offset, -offset));
            let found = wrapped(&uvs, &[0, 1, 2]);
            assert!(found.iter().flatten().all(|value| value.abs() <= 1.0), "{offset}: {found:?}");
            for (found, corner) in found.iter().zip(CORNERS) {
                let moved = DVec2::new(f64::from(found[0]), f64::from(found[1])) - corner;
                assert_eq!(moved, moved.round(), "{offset}");
            }
        }
    }

    #[test]
    fn parts_are_moved_on_their_own_and_none_is_torn() {
        let uvs = [CORNERS.map(|uv| uv + 1e6), CORNERS.map(|uv| uv - 3e7), CORNERS.map(|uv| uv * 4e3)].concat();
        let found = wrapped(&uvs, &[0, 1, 2, 5, 4, 3, 6, 7, 8]);
        for (part, corners) in found.chunks_exact(3).zip(uvs.chunks_exact(3)) {
            for corner in 1..3 {
                let wide = (corners[corner] - corners[0]).as_vec2();
                assert_eq!([part[corner][0] - part[0][0], part[corner][1] - part[0][1]], wide.to_array());
            }
        }
        assert!(found[..6].iter().flatten().all(|value| value.abs() <= 1.0));
        assert!(found[6..].iter().flatten().all(|value| value.abs() <= 1.5e3 + 1.0));
    }
}
