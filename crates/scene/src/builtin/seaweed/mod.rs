//! A garden under water in which everything moves, for trying clips without a file: stalks on skins, a jellyfish of one shape that carries a
//! light, and a ship's wheel that turns.

mod jellyfish;
mod stalks;

use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3};

use super::params::{Parameter, Params};
use super::shapes::{self, MeshBuilder};
use super::stage::{Random, SceneBuilder};
use super::{Builtin, paint};
use crate::{
    Camera, Channel, ChannelTarget, Clip, Environment, Interpolation, Local, Material, Node, Placement, Projection,
    Scene,
};

pub(super) const SEAWEED: Builtin = Builtin {
    name: "seaweed",
    about: "Stalks that sway on skins, a jellyfish of one shape with a light in it, and a wheel that turns: all kinds of motion.",
    parameters: &[
        Parameter::integer("count", [1, 10_000], 28, "stalks, each with a skin of its own"),
        Parameter::integer("joints", [2, 1000], 8, "joints of a stalk, in a chain"),
        Parameter::integer("seed", [0, u64::MAX], 1, "of the stalks' places, sizes and phases"),
    ],
    build,
};

/// Seconds of a turn of the wheel.
const TURN: f64 = 12.0;

fn build(params: &Params) -> Scene {
    let mut stage = SceneBuilder::default();
    let mut random = Random(params.integer("seed") as u64);
    ground(&mut stage);
    let garden = stalks::Garden { count: params.integer("count"), joints: params.integer("joints") };
    garden.plant(&mut stage, &mut random);
    jellyfish::add(&mut stage);
    wheel(&mut stage);
    stage.sun(DVec3::new(-0.35, -1.0, -0.3), 95.0, Vec3::new(0.62, 0.93, 1.0), true);
    stage.scene.environment = Environment {
        ambient: Vec3::new(0.8, 3.6, 5.2),
        ground: Some(Vec3::new(0.7, 1.5, 1.6)),
        background: Vec3::new(0.12, 1.5, 2.9),
    };
    stage.scene.settings.exposure = Some(4.0);
    stage.scene.camera = Camera {
        projection: Projection::perspective(42.0),
        near: 0.05,
        ..Camera::looking_at(DVec3::new(0.3, 1.35, 5.6), DVec3::new(0.0, 1.15, 0.0), DVec3::Y)
    };
    stage.scene.rest();
    stage.scene
}

/// Returns the height of the sand.
fn sand(x: f64, z: f64) -> f64 {
    let ripples = 0.018 * (9.0 * x + 2.0 * (0.9 * z).sin() + 3.0 * z).sin();
    0.1 * (0.7 * x).sin() * (0.5 * z + 0.4).cos() + ripples
}

fn ground(stage: &mut SceneBuilder) {
    let material = stage.material(Material {
        name: "sand".into(),
        base_color: Vec3::new(0.36, 0.31, 0.23),
        roughness: 0.9,
        ..Material::default()
    });
    let mut mesh = MeshBuilder::new();
    // Finer towards the camera: a grid whose rows grow with their distance.
    mesh.grid_smooth([160, 120], |u, v| {
        let (x, z) = ((u - 0.5) * 36.0 * (0.25 + 0.75 * v), 7.0 - 31.0 * (0.15 * v + 0.85 * v * v));
        (DVec3::new(x, sand(x, z), z), DVec2::new(x, z))
    });
    stage.add("sand", mesh, material);
    let stone = stage.material(Material {
        name: "stone".into(),
        base_color: Vec3::new(0.2, 0.22, 0.21),
        roughness: 0.85,
        ..Material::default()
    });
    for (x, z, size, seed) in [(-2.1, 0.6, 0.42, 3), (-1.55, 1.15, 0.2, 5), (2.5, -1.2, 0.6, 8), (0.9, 1.9, 0.14, 9)] {
        let mut mesh = MeshBuilder::new();
        mesh.grid_smooth([48, 24], |u, v| {
            let polar = (0.02 + 0.96 * v) * std::f64::consts::PI;
            let (sin, cos) = (u * TAU).sin_cos();
            let bump = 0.8 + 0.35 * f64::from(paint::fractal(u.rem_euclid(1.0) as f32, v as f32, 4, 3, seed));
            let place = DVec3::new(polar.sin() * cos, -0.7 * polar.cos(), -polar.sin() * sin);
            (place * size * bump + DVec3::new(x, sand(x, z) + 0.2 * size, z), DVec2::new(u, v))
        });
        stage.add("stone", mesh, stone);
    }
}

/// Adds a node that stands by its parts, and returns its number.
fn node(stage: &mut SceneBuilder, name: String, parent: Option<usize>, placement: Placement) -> usize {
    stage.scene.motion.nodes.push(Node { name, parent, local: Local::Parts(placement), weights: Vec::new() });
    stage.scene.motion.nodes.len() - 1
}

fn wheel(stage: &mut SceneBuilder) {
    let wood = stage.material(Material {
        name: "wood".into(),
        base_color: Vec3::new(0.33, 0.19, 0.1),
        roughness: 0.7,
        ..Material::default()
    });
    let mut mesh = shapes::torus(0.5, 0.05, 48);
    mesh.append(&shapes::torus(0.36, 0.025, 48), &DAffine3::IDENTITY);
    mesh.append(&shapes::cylinder(0.11, 0.16, 24), &DAffine3::IDENTITY);
    let mut spoke = MeshBuilder::new();
    let profile = [(0.0, 0.05), (0.025, 0.06), (0.022, 0.5), (0.03, 0.56), (0.035, 0.64), (0.02, 0.72), (0.0, 0.725)];
    spoke.lathe(&profile, 12);
    let outwards = DQuat::from_rotation_x(TAU / 4.0);
    for index in 0..8 {
        let turned = DQuat::from_rotation_y(TAU * f64::from(index) / 8.0) * outwards;
        mesh.append(&spoke, &DAffine3::from_quat(turned));
    }
    let mesh = stage.mesh("wheel", mesh, wood);
    let place = DVec3::new(1.75, sand(1.75, -0.3) + 0.62, -0.3);
    // It leans back against nothing, half sunk into the sand.
    let rotation = DQuat::from_rotation_y(-0.45) * DQuat::from_rotation_x(TAU / 4.0 - 0.3);
    let stand = node(stage, "stand".into(), None, Placement { translation: place, rotation, scale: DVec3::ONE });
    let own = node(stage, "wheel".into(), Some(stand), Placement::default());
    stage.place(mesh, wood, DAffine3::IDENTITY);
    stage.hang(own, None);
    // Rotations go the shorter way between keys, so that a turn has more than two of them.
    let times: Vec<f64> = (0..=4).map(|quarter| TURN * f64::from(quarter) / 4.0).collect();
    let turn = |time: &f64| DQuat::from_rotation_y(TAU * time / TURN).to_array();
    let values = times.iter().flat_map(turn).collect();
    let channel = Channel { target: ChannelTarget::Rotation(own), times, values, interpolation: Interpolation::Linear };
    stage.scene.motion.clips.push(Clip { name: "turn".into(), channels: vec![channel] });
}

#[cfg(test)]
mod tests {
    use crate::{ClipChoice, Playing, builtin};

    #[test]
    fn all_of_it_moves_loops_without_a_jump_and_stays_a_scene() {
        let scene = builtin::open("seaweed?count=5&joints=12").unwrap();
        scene.check().unwrap();
        let names: Vec<_> = scene.motion.clips.iter().map(|clip| clip.name.as_str()).collect();
        assert_eq!(names, ["sway", "swim", "turn"]);
        assert_eq!((scene.motion.skins.len(), scene.motion.duration(&ClipChoice::All)), (5, 12.0));
        let still = scene.at(&Playing { clips: ClipChoice::None, ..Playing::default() });
        for (object, rest) in scene.objects.iter().zip(&still.objects) {
            assert!(object.transform.abs_diff_eq(rest.transform, 1e-12), "{}", object.name);
        }
        for clip in &scene.motion.clips {
            let clips = scene.motion.choose(std::slice::from_ref(&clip.name)).unwrap();
            let at =
                |time| scene.at(&Playing { clips: clips.clone(), looped: false, ..Playing::at(time) }).into_owned();
            let (first, half, last) = (at(0.0), at(0.4 * clip.duration()), at(clip.duration()));
            half.check().unwrap();
            let all = |scene: &crate::Scene| {
                let corners = scene.objects.iter().map(|object| object.bounds(&scene.meshes));
                corners.map(|own| own.min.to_array().map(|edge| (edge * 1e5).round())).collect::<Vec<_>>()
            };
            assert_ne!(all(&first), all(&half), "{}", clip.name);
            assert_eq!(all(&first), all(&last), "{}", clip.name);
        }
    }
}
