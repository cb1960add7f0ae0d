//! Stalks with leaves, each on a chain of joints that the current bends.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3};

use super::{node, sand};
use crate::builtin::shapes::MeshBuilder;
use crate::builtin::stage::{Random, SceneBuilder};
use crate::{Channel, ChannelTarget, Clip, Influences, Interpolation, Material, Mesh, Placement, Skin};

/// Metres of a stalk before it is scaled.
const HEIGHT: f64 = 2.2;
/// Seconds of a sway.
const SWAY: f64 = 6.0;
/// Keys of a sway, the last of which is the first again.
const KEYS: usize = 5;
/// Kinds of stalk.
const KINDS: u64 = 3;

/// The stalks of a garden.
pub struct Garden {
    pub count: usize,
    pub joints: usize,
}

impl Garden {
    /// Adds the stalks and the clip that sways them.
    pub fn plant(&self, stage: &mut SceneBuilder, random: &mut Random) {
        let greens = [Vec3::new(0.13, 0.3, 0.06), Vec3::new(0.3, 0.3, 0.05), Vec3::new(0.34, 0.13, 0.07)];
        let kinds: Vec<(usize, usize)> = (0..KINDS)
            .zip(greens)
            .map(|(kind, base_color)| {
                let material = stage.material(Material {
                    name: format!("seaweed {kind}"),
                    base_color,
                    roughness: 0.45,
                    two_sided: true,
                    ..Material::default()
                });
                stage.scene.meshes.push(self.stalk(kind));
                (stage.scene.meshes.len() - 1, material)
            })
            .collect();
        let mut channels = Vec::new();
        for index in 0..self.count {
            let (mesh, material) = kinds[index % kinds.len()];
            let name = format!("stalk {index}");
            let base = self.base(index, random);
            let stand = node(stage, name.clone(), None, base);
            let current = Current {
                axis: DQuat::from_rotation_y(random.between(-0.5, 0.5)) * DVec3::NEG_Z,
                bend: random.between(0.1, 0.35),
                swing: random.between(0.35, 0.6),
                // The wave runs through the garden.
                phase: 0.9 * base.translation.x + 0.5 * base.translation.z + random.between(0.0, 0.8),
            };
            let joints = self.chain(stage, stand, &current, &mut channels);
            let step = HEIGHT / self.joints as f64;
            let inverse_bind = (0..self.joints)
                .map(|joint| DAffine3::from_translation(DVec3::NEG_Y * (joint as f64 * step)))
                .collect();
            stage.scene.motion.skins.push(Skin { name, joints, inverse_bind });
            stage.place(mesh, material, DAffine3::IDENTITY);
            stage.hang(stand, Some(stage.scene.motion.skins.len() - 1));
        }
        stage.scene.motion.clips.push(Clip { name: "sway".into(), channels });
    }

    /// Places a stalk on a spiral that fills its disc evenly and leaves the middle to the jellyfish.
    fn base(&self, index: usize, random: &mut Random) -> Placement {
        let share = (index as f64 + 0.5) / self.count as f64;
        let radius = 0.7 + (0.25 * (self.count as f64).sqrt() + 0.9) * share.sqrt();
        let (sin, cos) = (2.399_963 * index as f64 + random.between(-0.2, 0.2)).sin_cos();
        let (x, z) = (1.35 * radius * cos, 0.9 * radius * sin - 0.7);
        Placement {
            translation: DVec3::new(x, sand(x, z) - 0.03, z),
            rotation: DQuat::IDENTITY,
            scale: DVec3::splat(random.between(0.55, 1.15)),
        }
    }

    /// Adds a chain of joints with a channel for each, and returns their numbers.
    fn chain(
        &self,
        stage: &mut SceneBuilder,
        stand: usize,
        current: &Current,
        channels: &mut Vec<Channel>,
    ) -> Vec<usize> {
        let step = HEIGHT / self.joints as f64;
        let mut parent = stand;
        (0..self.joints)
            .map(|joint| {
                let translation = if joint == 0 { DVec3::ZERO } else { DVec3::Y * step };
                let rotation = current.turn(0.0, joint, self.joints).0;
                let placement = Placement { translation, rotation, scale: DVec3::ONE };
                parent = node(stage, format!("joint {joint}"), Some(parent), placement);
                let times: Vec<f64> = (0..KEYS).map(|key| SWAY * key as f64 / (KEYS - 1) as f64).collect();
                let values = times.iter().flat_map(|&time| {
                    let (turn, slope) = current.turn(time, joint, self.joints);
                    [slope, turn, slope].into_iter().flat_map(|part| part.to_array())
                });
                let values = values.collect();
                let (target, interpolation) = (ChannelTarget::Rotation(parent), Interpolation::CubicSpline);
                channels.push(Channel { target, times, values, interpolation });
                parent
            })
            .collect()
    }

    /// A mesh of the unit stalk: a tapering stem, and leaves on two sides of it.
    fn stalk(&self, kind: u64) -> Mesh {
        let mut mesh = MeshBuilder::new();
        mesh.grid_smooth([8, 40], |u, v| {
            let (sin, cos) = (u * TAU).sin_cos();
            let radius = 0.028 * (1.0 - v).sqrt() + 0.004;
            (DVec3::new(radius * cos, v * HEIGHT, -radius * sin), DVec2::new(u, -v))
        });
        let mut random = Random(kind + 7);
        let leaves = 11 + 3 * kind;
        for leaf in 0..leaves {
            let at = 0.12 + 0.86 * leaf as f64 / leaves as f64;
            let length = (0.62 - 0.3 * at) * random.between(0.8, 1.2) * (1.0 - 0.2 * kind as f64);
            let turn = DQuat::from_rotation_y(PI * leaf as f64 + random.between(-0.7, 0.7));
            leaf_on(&mut mesh, at * HEIGHT, length, turn);
        }
        let mut mesh = mesh.finish(&format!("seaweed {kind}"));
        mesh.influences = Some(self.influences(&mesh));
        mesh
    }

    /// Each vertex hangs on the two joints around it, by its height.
    fn influences(&self, mesh: &Mesh) -> Influences {
        let last = self.joints - 1;
        let (mut joints, mut weights) = (Vec::new(), Vec::new());
        for position in &mesh.positions {
            let height = (mesh.origin.y + f64::from(position[1])) / HEIGHT * self.joints as f64 - 0.5;
            let height = height.clamp(0.0, last as f64);
            let below = height.floor();
            let share = (height - below) as f32;
            joints.extend([below as u16, (below as usize + 1).min(last) as u16, 0, 0]);
            weights.extend([1.0 - share, share, 0.0, 0.0]);
        }
        Influences { per_vertex: 4, joints, weights }
    }
}

/// The bend of a stalk, and its swing in the current.
struct Current {
    /// Across the current, of length 1.
    axis: DVec3,
    /// Radians of the whole stalk at rest, and of its swing.
    bend: f64,
    swing: f64,
    /// Radians by which it is behind the others.
    phase: f64,
}

impl Current {
    /// The turn of a joint at a time, and its change a second.
    fn turn(&self, time: f64, joint: usize, joints: usize) -> (DQuat, DQuat) {
        // Tips bend more and later.
        let share = joint as f64 / joints as f64;
        let (grows, phase) = ((0.4 + 1.2 * share) / joints as f64, self.phase + 2.2 * share);
        let (sin, cos) = (TAU * time / SWAY - phase).sin_cos();
        let half = 0.5 * grows * (self.bend + self.swing * sin);
        let slope = 0.5 * grows * self.swing * cos * TAU / SWAY;
        let (sin, cos) = half.sin_cos();
        let turn = DQuat::from_vec4((self.axis * sin).extend(cos));
        (turn, DQuat::from_vec4((self.axis * cos).extend(-sin) * slope))
    }
}

/// A pointed leaf that grows upwards from the stem, bent outwards and along its middle.
fn leaf_on(mesh: &mut MeshBuilder, height: f64, length: f64, turn: DQuat) {
    mesh.grid_smooth([4, 8], |u, v| {
        let width = 0.085 * length.sqrt() * (v * PI * 0.97 + 0.05).sin().max(0.0).powf(0.7);
        let across = (u - 0.5) * 2.0 * width;
        let (out, up) = (length * (0.75 * v - 0.2 * v * v), length * (0.9 * v - 0.25 * v * v));
        let wave = 0.03 * (9.0 * v).sin() + 1.2 * across * across / width.max(1e-3);
        let place = DVec3::new(out + 0.012, up + wave, across);
        (turn * place + DVec3::Y * height, DVec2::new(u, -v))
    });
}
