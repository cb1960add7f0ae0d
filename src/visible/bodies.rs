//! The shape of a body of glass, as one number from a pane to a ball.

use glam::Vec3;

use crate::scene::Mesh;

/// A surface whose radius of curvature is below twice the longest edge of its mesh's box is round, and a flatter one is flat.
const ROUND: f32 = 0.5;

/// The share of a mesh's surface that is round, and 1 over the longest edge of its box. A body is taken for a ball as far as its surface is round and it is thick for its length.
pub(super) fn shape(mesh: &Mesh) -> [f32; 2] {
    let longest = (mesh.bounds.max - mesh.bounds.min).max_element() as f32;
    if longest > 0.0 { [round_share(mesh, longest), 1.0 / longest] } else { [0.0; 2] }
}

/// The share of the surface that is round: by the angle between the normals at both ends of an edge, over its length.
fn round_share(mesh: &Mesh, longest: f32) -> f32 {
    let (mut round, mut all) = (0.0, 0.0);
    for corners in mesh.indices.as_chunks::<3>().0 {
        let places = corners.map(|corner| Vec3::from(mesh.positions[corner as usize]));
        let normals =
            corners.map(|corner| mesh.normals.get(corner as usize).map_or(Vec3::ZERO, |own| Vec3::from(*own)));
        let [a, b, c] = places;
        let area = (b - a).cross(c - a).length();
        let bends = |from: usize, to: usize| {
            normals[from].distance(normals[to]) * longest > ROUND * places[from].distance(places[to])
        };
        all += area;
        if bends(0, 1) || bends(1, 2) || bends(2, 0) {
            round += area;
        }
    }
    if all > 0.0 { round / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::shapes::{cuboid, sphere};

    #[test]
    fn a_ball_is_round_however_finely_it_is_made_and_a_block_is_not() {
        for segments in [32, 1024] {
            let [round, slender] = shape(&sphere(0.5, segments).finish("ball"));
            assert!(round > 0.99 && (slender - 1.0).abs() < 1e-3, "{segments}: {round} {slender}");
        }
        assert_eq!(shape(&cuboid([1.0, 2.0, 0.5]).finish("block")), [0.0, 0.5]);
    }
}
