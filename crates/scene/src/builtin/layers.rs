//! Layers of overdraw, lit by N lights, and nothing else: where deferred shading starts to pay.

use glam::{DQuat, DVec3, Vec3};

use super::Builtin;
use super::params::{Parameter, Params};
use super::shapes::{self, MeshBuilder};
use super::stage::{Random, SceneBuilder, hue};
use crate::{Camera, Environment, Falloff, Light, LightKind, Material, Projection, Scene};

pub(super) const LAYERS: Builtin = Builtin {
    name: "layers",
    about: "Quads behind each other that fill the view, every one of them rasterized, under point lights before the first.",
    parameters: &[
        Parameter::integer(
            "count",
            [1, 256],
            8,
            "layers, listed from the back; the picture is the same for any number",
        ),
        Parameter::integer("lights", [0, 1_000_000], 16, "point lights"),
        Parameter::number("range", [0.0, 1e6], 2.0, "reach of a light in metres; 0: no limit"),
        Parameter::integer("seed", [0, u64::MAX], 1, "of the lights' places and hues"),
    ],
    build,
};

/// Metres from the camera to the first layer, and from one to the next.
const NEAREST: f64 = 4.0;
const APART: f64 = 0.05;
const FOV_Y_DEGREES: f64 = 60.0;
/// Width over height that is filled, of pictures that are wider than most.
const ASPECT: f64 = 4.0;

fn build(params: &Params) -> Scene {
    let mut stage = SceneBuilder::default();
    let slope = (FOV_Y_DEGREES * 0.5).to_radians().tan();
    let count = params.integer("count");
    // One mesh: no renderer sorts the triangles of a mesh, so each layer hides the layers before it in the list after they were shaded.
    let mut layers = MeshBuilder::new();
    for index in (0..count).rev() {
        let distance = NEAREST + index as f64 * APART;
        let [x, y] = [distance * slope * ASPECT, distance * slope * 1.1];
        let corners = [(-x, -y), (x, -y), (x, y), (-x, y)].map(|(x, y)| DVec3::new(x, y, -distance));
        layers.quad(corners, shapes::WHOLE_IMAGE);
    }
    let base_color = Vec3::splat(0.7);
    let material =
        stage.material(Material { name: "layers".into(), base_color, roughness: 0.6, ..Material::default() });
    stage.add("layers", layers, material);
    let (range, lights) = (params.number("range"), params.integer("lights"));
    let range = (range > 0.0).then_some(range);
    // One sum is shared out, so that the picture is about as bright for any number.
    let intensity = 1_600.0 / lights.max(1) as f32;
    let mut random = Random(params.integer("seed") as u64);
    for index in 0..lights {
        let [x, y] = [slope * NEAREST * 16.0 / 9.0, slope * NEAREST].map(|edge| random.between(-edge, edge));
        let position = DVec3::new(x, y, -NEAREST + random.between(0.3, 1.2));
        stage.light(Light {
            name: format!("light {index}"),
            color: Vec3::ONE.lerp(hue(random.unit()), 0.7),
            intensity,
            ..Light::of(LightKind::Point { position, range, falloff: Falloff::InverseSquare })
        });
    }
    stage.scene.environment = Environment { ambient: Vec3::splat(2.0), background: Vec3::splat(1.0), ground: None };
    stage.scene.settings.exposure = Some(6.5);
    stage.scene.camera = Camera {
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        projection: Projection::perspective(FOV_Y_DEGREES),
        near: 0.1,
        ..Camera::default()
    };
    stage.scene
}
