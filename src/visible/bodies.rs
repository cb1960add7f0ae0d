//! The shape of a body of glass, as one number from a pane to a ball.

use glam::Vec3;

use crate::scene::Mesh;

/// A surface whose radius of curvature is below twice the longest edge of its mesh's box is round, and a flatter one is flat.
const ROUND: f32 = 0.5;

/// How round a body is that is so thick, in units of the mesh: 0, a pane, whose far side lies even with the near one; 1, a ball of that diameter. Thin walls are panes, and so
/// are bodies with flat faces.
pub(super) fn roundness(mesh: &Mesh, thickness: f32) -> f32 {
    let longest = (mesh.bounds.max - mesh.bounds.min).max_element();
    if longest <= 0.0 {
        return 0.0;
    }
    // A pane up to a quarter of the longest edge, and a ball from half of it on.
    let solid = (4.0 * f64::from(thickness) / longest - 1.0).clamp(0.0, 1.0);
    if solid > 0.0 { solid as f32 * round_share(mesh, longest as f32) } else { 0.0 }
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
    fn a_ball_is_round_and_a_pane_a_block_and_a_thin_wall_are_not() {
        let ball = sphere(0.5, 32).finish("ball");
        let found = [1.0, 0.5, 0.1].map(|thickness| roundness(&ball, thickness));
        assert!(found[0] > 0.99 && found[0] == found[1] && found[2] == 0.0, "{found:?}");
        assert!((0.4..0.6).contains(&roundness(&ball, 0.375)));
        assert_eq!(roundness(&cuboid([1.0; 3]).finish("block"), 1.0), 0.0);
        // However finely it is made.
        assert!(roundness(&sphere(0.5, 1024).finish("ball"), 1.0) > 0.99);
    }
}
