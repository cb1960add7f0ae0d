//! The Cornell box from its published measurements (Cornell University Program of Computer Graphics, "Cornell Box Data"), in metres:
//! the walls are not quite square in reality, and neither are they here. Reflectances are the measured spectra as linear RGB,
//! rounded to two digits.

use glam::{DVec3, Vec3};

use super::Builtin;
use super::params::Params;
use super::shapes::MeshBuilder;
use super::stage::SceneBuilder;
use crate::{Brdf, Camera, Environment, Falloff, Light, LightKind, Material, Projection, Scene};

pub(super) const CORNELL: Builtin =
    Builtin { name: "cornell", about: "The Cornell box from its measurements.", parameters: &[], build };

type Quad = [[f64; 3]; 4];

/// Corners in millimetres, counter-clockwise from inside. Seen from the camera, +X is left.
const FLOOR: Quad = [[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]];
const CEILING: Quad = [[556.0, 548.8, 0.0], [556.0, 548.8, 559.2], [0.0, 548.8, 559.2], [0.0, 548.8, 0.0]];
const BACK: Quad = [[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]];
const RIGHT: Quad = [[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]];
const LEFT: Quad = [[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]];
/// A hair below the ceiling, in which the original has a hole.
const LAMP: Quad = [[343.0, 548.7, 227.0], [343.0, 548.7, 332.0], [213.0, 548.7, 332.0], [213.0, 548.7, 227.0]];

/// Tops of the blocks and their heights; the sides go straight down.
const SHORT: ([[f64; 2]; 4], f64) = ([[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]], 165.0);
const TALL: ([[f64; 2]; 4], f64) = ([[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]], 330.0);

/// Candela straight down.
const LAMP_INTENSITY: f32 = 20.0;

fn build(_: &Params) -> Scene {
    let mut stage = SceneBuilder::default();
    let mut paint = |name: &str, r: f32, g: f32, b: f32| {
        let base_color = Vec3::new(r, g, b);
        stage.material(Material { name: name.into(), brdf: Brdf::Lambert, base_color, ..Material::default() })
    };
    let (white, red, green) =
        (paint("white", 0.73, 0.73, 0.73), paint("red", 0.65, 0.05, 0.05), paint("green", 0.12, 0.45, 0.15));
    // A lambert emitter of area A and radiance L sends L A candela straight ahead.
    let area = 0.130 * 0.105;
    let lamp = stage.material(Material {
        name: "lamp".into(),
        base_color: Vec3::splat(0.78),
        emissive: Vec3::new(1.0, 0.85, 0.6) * (LAMP_INTENSITY / area),
        ..Material::default()
    });
    for (name, quad, material) in [
        ("floor", FLOOR, white),
        ("ceiling", CEILING, white),
        ("back wall", BACK, white),
        ("right wall", RIGHT, green),
        ("left wall", LEFT, red),
        ("lamp", LAMP, lamp),
    ] {
        let mut mesh = MeshBuilder::new();
        mesh.quad_metric(quad.map(|p| DVec3::from(p) * 0.001));
        stage.add(name, mesh, material);
    }
    stage.add("short block", block(SHORT), white);
    stage.add("tall block", block(TALL), white);
    stage.light(Light {
        name: "lamp".into(),
        color: Vec3::new(1.0, 0.85, 0.6),
        intensity: LAMP_INTENSITY,
        casts_shadow: true,
        ..Light::of(LightKind::Spot {
            position: DVec3::new(0.278, 0.548, 0.2795),
            direction: DVec3::NEG_Y,
            inner_angle_degrees: 0.0,
            outer_angle_degrees: 90.0,
            range: None,
            falloff: Falloff::InverseSquare,
        })
    });
    stage.scene.environment = Environment { ambient: Vec3::new(4.0, 3.6, 3.0), background: Vec3::ZERO, ground: None };
    let eye = DVec3::new(0.278, 0.273, -0.8);
    // A film of 25 mm behind a lens of 35 mm.
    let fov_y_degrees = 2.0 * (12.5f64 / 35.0).atan().to_degrees();
    stage.scene.camera = Camera {
        projection: Projection::perspective(fov_y_degrees),
        near: 0.01,
        ..Camera::looking_at(eye, eye + DVec3::Z, DVec3::Y)
    };
    stage.scene
}

fn block((top, height): ([[f64; 2]; 4], f64)) -> MeshBuilder {
    let at = |corner: usize, height: f64| DVec3::new(top[corner % 4][0], height, top[corner % 4][1]) * 0.001;
    let mut mesh = MeshBuilder::new();
    mesh.quad_metric([0, 1, 2, 3].map(|corner| at(corner, height)));
    for corner in 0..4 {
        mesh.quad_metric([at(corner, 0.0), at(corner + 1, 0.0), at(corner + 1, height), at(corner, height)]);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use crate::builtin;

    #[test]
    fn every_wall_faces_into_the_box_and_every_block_out() {
        let scene = builtin::open("cornell").unwrap();
        let middle = scene.bounds().center();
        for object in &scene.objects {
            let mesh = &scene.meshes[object.mesh];
            let inner = if object.name.contains("block") { mesh.bounds.center() } else { middle };
            let expected = if object.name.contains("block") { -1.0 } else { 1.0 };
            for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
                let place = mesh.origin + glam::Vec3::from(*position).as_dvec3();
                let inward = glam::Vec3::from(*normal).as_dvec3().dot(inner - place);
                assert!(inward * expected > 0.0, "{}", object.name);
            }
        }
    }
}
