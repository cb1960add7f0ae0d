//! A jellyfish that pulses by a shape, swims by its node and carries a light.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3};

use super::node;
use crate::builtin::shapes::MeshBuilder;
use crate::builtin::stage::SceneBuilder;
use crate::{
    AlphaMode, Channel, ChannelTarget, Clip, Falloff, Interpolation, Light, LightKind, LightValue, Material,
    MaterialValue, Mesh, Morph, Placement,
};

/// Seconds of its way, and pulses along it.
const SWIM: f64 = 8.0;
const PULSES: usize = 4;
const COLOR: Vec3 = Vec3::new(1.0, 0.45, 0.7);

/// Adds it, and the clip that it swims by.
pub fn add(stage: &mut SceneBuilder) {
    let skin = stage.material(Material {
        name: "jellyfish".into(),
        base_color: Vec3::new(0.9, 0.55, 0.75),
        roughness: 0.25,
        alpha: 0.4,
        alpha_mode: AlphaMode::Glass,
        emissive: COLOR * 5.0,
        two_sided: true,
        ..Material::default()
    });
    stage.scene.meshes.push(mesh());
    let mesh = stage.scene.meshes.len() - 1;
    let rotation = DQuat::from_rotation_z(-0.25);
    let own =
        node(stage, "jellyfish".into(), None, Placement { translation: way(0.0), rotation, scale: DVec3::splat(0.85) });
    stage.scene.motion.nodes[own].weights = vec![0.0];
    let lamp = Placement { translation: DVec3::Y * 0.1, ..Placement::default() };
    let lamp = node(stage, "lamp".into(), Some(own), lamp);
    stage.place(mesh, skin, DAffine3::IDENTITY);
    stage.hang(own, None);
    let kind = LightKind::Point { position: DVec3::ZERO, range: Some(5.0), falloff: Falloff::InverseSquare };
    stage.light(Light { name: "jellyfish".into(), color: COLOR, intensity: 16.0, ..Light::of(kind) });
    stage.scene.motion.light_nodes = vec![Some(lamp)];
    let channels = channels(own, skin);
    stage.scene.motion.clips.push(Clip { name: "swim".into(), channels });
}

/// Returns its place at a time: it swims around the garden's middle, up and down.
fn way(time: f64) -> DVec3 {
    let (sin, cos) = (TAU * time / SWIM).sin_cos();
    DVec3::new(-0.25 + 0.45 * cos, 1.75 + 0.22 * (2.0 * TAU * time / SWIM).sin(), 0.5 + 0.3 * sin)
}

fn channels(own: usize, skin: usize) -> Vec<Channel> {
    const KEYS: usize = 8;
    let times: Vec<f64> = (0..=KEYS).map(|key| SWIM * key as f64 / KEYS as f64).collect();
    let swim = times.iter().flat_map(|&time| {
        const STEP: f64 = 1e-4;
        let speed = (way(time + STEP) - way(time - STEP)) / (2.0 * STEP);
        [speed, way(time), speed].into_iter().flat_map(|part| part.to_array())
    });
    let swim = swim.collect();
    let translation = ChannelTarget::Translation(own);
    let swim = Channel { target: translation, times, values: swim, interpolation: Interpolation::CubicSpline };
    // A quick stroke and a slow recovery.
    let beats: Vec<f64> = (0..PULSES).map(|beat| SWIM * beat as f64 / PULSES as f64).collect();
    let times: Vec<f64> = beats.iter().flat_map(|&beat| [beat, beat + 0.5]).chain([SWIM]).collect();
    let pulse = |rest: f64, stroke: f64| {
        let mut values = [rest, stroke].repeat(PULSES);
        values.push(rest);
        values
    };
    let each =
        |target, values: Vec<f64>, interpolation| Channel { target, times: times.clone(), values, interpolation };
    // A cubic with slopes of 0 at the keys eases in and out.
    let eased = |values: Vec<f64>| values.into_iter().flat_map(|value| [0.0, value, 0.0]).collect();
    let light = ChannelTarget::Light(0, LightValue::Intensity);
    let glow = ChannelTarget::Material(skin, MaterialValue::EmissiveStrength);
    vec![
        swim,
        each(ChannelTarget::Weights(own), eased(pulse(0.0, 1.0)), Interpolation::CubicSpline),
        each(light, pulse(16.0, 48.0), Interpolation::Linear),
        each(glow, pulse(0.8, 1.8), Interpolation::Linear),
    ]
}

/// The bell with its arms; the shape draws it together.
fn mesh() -> Mesh {
    let mut mesh = shaped(0.0).finish("jellyfish");
    let drawn = shaped(1.0).finish("");
    let place = |mesh: &Mesh, vertex: usize| mesh.origin + Vec3::from(mesh.positions[vertex]).as_dvec3();
    let vertices = 0..mesh.positions.len();
    let positions = vertices.clone().map(|own| (place(&drawn, own) - place(&mesh, own)).as_vec3().to_array()).collect();
    let normal = |own: usize| (Vec3::from(drawn.normals[own]) - Vec3::from(mesh.normals[own])).to_array();
    let normals = vertices.map(normal).collect();
    mesh.morphs = vec![Morph { name: "stroke".into(), positions, normals, ..Morph::default() }];
    mesh
}

/// A jellyfish at this stroke, from 0 for open to 1 for drawn together. Every stroke has the same vertices.
fn shaped(stroke: f64) -> MeshBuilder {
    let mut mesh = MeshBuilder::new();
    mesh.grid_smooth([48, 20], |u, v| {
        let (sin, cos) = (u * TAU).sin_cos();
        // The angle goes from the rim, which curls in, up to the top.
        let angle = FRAC_PI_2 * (1.0 - v) * 1.25 + 0.004;
        let frill = 0.03 * (12.0 * u * TAU).cos() * (1.0 - v).powi(3);
        let radius = (0.46 - 0.13 * stroke * (1.0 - v)) * (angle.sin() + frill);
        let height = (0.3 + 0.1 * stroke) * angle.cos() - 0.03 * stroke;
        (DVec3::new(radius * cos, height, -radius * sin), DVec2::new(u, -v))
    });
    for arm in 0..7 {
        let turn = DQuat::from_rotation_y(TAU * f64::from(arm) / 7.0);
        let long = 0.75 + 0.3 * f64::from(arm * 3 % 7) / 7.0;
        mesh.grid_smooth([2, 24], |u, v| {
            let width = 0.028 * (1.0 - v) + 0.003;
            let wave = (0.05 + 0.03 * stroke) * v * (7.0 * v + f64::from(arm) - 2.5 * stroke).sin();
            let out = 0.13 + wave - 0.05 * stroke * v;
            let place = DVec3::new(out, 0.08 - v * long * (1.0 + 0.12 * stroke), (u - 0.5) * 2.0 * width);
            (turn * place, DVec2::new(u, -v))
        });
    }
    mesh
}
