//! The shape of a body of glass, as far as one number tells it.

use glam::Vec3;

use crate::scene::Mesh;

/// Cosine of the angle between the normals of a triangle's corners from which on it is taken for curved: of one degree.
const CURVED: f32 = 0.99985;

/// How round a body is that is so thick, in units of the mesh: 0, a pane, whose far side lies even with the near one; 1, a ball of that diameter. Thin walls are panes, and so
/// are bodies with flat faces.
pub(super) fn roundness(mesh: &Mesh, thickness: f32) -> f32 {
    let longest = (mesh.bounds.max - mesh.bounds.min).max_element();
    if longest <= 0.0 {
        return 0.0;
    }
    // A pane up to a quarter of the longest edge, and a ball from half of it on.
    let solid = (4.0 * f64::from(thickness) / longest - 1.0).clamp(0.0, 1.0);
    if solid > 0.0 { solid as f32 * curved_share(mesh) } else { 0.0 }
}

/// The share of the surface whose normals change within triangles.
fn curved_share(mesh: &Mesh) -> f32 {
    let (mut curved, mut all) = (0.0, 0.0);
    for corners in mesh.indices.as_chunks::<3>().0 {
        let [a, b, c] = corners.map(|corner| Vec3::from(mesh.positions[corner as usize]));
        let area = (b - a).cross(c - a).length();
        let [x, y, z] =
            corners.map(|corner| mesh.normals.get(corner as usize).map_or(Vec3::ZERO, |own| Vec3::from(*own)));
        all += area;
        if x.dot(y).min(y.dot(z)).min(z.dot(x)) < CURVED {
            curved += area;
        }
    }
    if all > 0.0 { curved / all } else { 0.0 }
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
    }
}
