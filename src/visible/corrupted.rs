//! Scenes that code put together wrongly: each is refused in a sentence or planned, and nothing panics.

use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::{Eye, Visible, World};
use crate::plan::samples::{self, device, emissive, masked, point, scene, sky, spot, sun, textured};
use crate::plan::{FramePlan, PlanError};
use crate::scene::{AlphaMode, Brdf, Falloff, Light, LightKind, LightPath, Projection, Scene, Settings, TextureSlot};

/// Values that arithmetic on a scene may trip over.
const VALUES: [f64; 12] = [f64::NAN, f64::INFINITY, 0.0, -0.0, -1.0, 0.5, 1.0, 1e-320, 1e30, 1e39, -1e200, f64::MAX];
const NUMBERS: [usize; 6] = [0, 1, 2, 7, u32::MAX as usize, usize::MAX];

/// Changes the place of the scene that `kind` picks, one of 33.
fn corrupt(scene: &mut Scene, kind: u8, at: usize, value: f64, number: usize) {
    let single = value as f32;
    let mesh = &mut scene.meshes[0];
    let vertex = at % 4;
    let object = at % scene.objects.len();
    let material = at % scene.materials.len();
    let texture = at % scene.textures.len();
    let light = at % scene.lights.len();
    match kind {
        0 => mesh.indices[at % 6] = number as u32,
        1 => mesh.indices.truncate(at % 7),
        2 => mesh.positions.truncate(vertex),
        3 => mesh.normals.truncate(vertex),
        4 => mesh.uvs.truncate(vertex),
        5 => mesh.tangents.truncate(vertex),
        6 => mesh.positions[vertex][at % 3] = single,
        7 => {
            mesh.positions.iter_mut().for_each(|position| position[at % 3] *= single);
            mesh.bounds = mesh.compute_bounds();
        }
        8 => mesh.origin[at % 3] = value,
        9 => mesh.bounds.min[at % 3] = value,
        10 => scene.objects[object].mesh = number,
        11 => scene.objects[object].material = number,
        12 => scene.objects[object].transform.matrix3 *= value,
        13 => scene.objects[object].transform.translation[at % 3] = value,
        14 => *scene.materials[material].texture_mut(TextureSlot::ALL[at % TextureSlot::ALL.len()]) = Some(number),
        15 => scene.materials[material].roughness = single,
        16 => scene.materials[material].emissive = Vec3::splat(single),
        17 => scene.materials[material].alpha_mode = AlphaMode::Mask { cutoff: single },
        18 => scene.textures[texture].size[at % 2] = number as u32,
        19 => scene.textures[texture].rgba8_mut().truncate(number % 64),
        20 => scene.lights[light].intensity = single,
        21 => scene.lights[light].size = value,
        22 => {
            let falloff = Falloff::Polynomial { constant: single, linear: 0.0, quadratic: single };
            scene.lights[light].kind = LightKind::Point { position: DVec3::splat(value), range: Some(value), falloff };
        }
        23 => scene.lights[light].kind = LightKind::Directional { direction: DVec3::splat(value) },
        24 => scene.environment.ambient = Vec3::splat(single),
        25 => scene.camera.position[at % 3] = value,
        26 => scene.camera.rotation.w = value,
        27 => scene.camera.near = value,
        28 => scene.camera.projection = Projection::perspective(value),
        29 => scene.camera.projection = Projection::orthographic(value),
        30 => scene.materials.clear(),
        31 => scene.meshes.clear(),
        _ => scene.textures.clear(),
    }
}

fn is_whole(scene: &Scene) -> bool {
    let mesh = scene.meshes.first().is_some_and(|mesh| mesh.positions.len() == 4 && mesh.indices.len() == 6);
    mesh && !scene.materials.is_empty() && !scene.textures.is_empty()
}

proptest! {
    #[test]
    fn a_corrupted_scene_is_refused_or_planned_and_never_panics(
        changes in proptest::collection::vec((0..33u8, 0..12usize, 0..VALUES.len(), 0..NUMBERS.len()), 1..3), path in 0..4usize, cut: bool,
    ) {
        let materials = vec![textured(Brdf::CookTorrance), masked(), samples::glass(), emissive()];
        let spot = Light { casts_shadow: true, ..spot(Falloff::Quadratic) };
        let mut scene = scene(materials, vec![sun(), point(Falloff::InverseSquare), spot, sky()]);
        for (kind, at, value, number) in changes {
            if is_whole(&scene) {
                corrupt(&mut scene, kind, at, VALUES[value], NUMBERS[number]);
            }
        }
        let light_path = [LightPath::Loop, LightPath::Clustered, LightPath::Volumes, LightPath::Forward][path];
        let settings = Settings { light_path, light_cutoff: cut, ..Settings::default() };
        let refused = scene.check().is_err();
        for device in [device(), samples::software()] {
            let plan = FramePlan::of(&scene, &settings, &device);
            prop_assert_eq!(matches!(plan, Err(PlanError::Scene(_))), refused);
            let Ok(plan) = plan else { continue };
            let world = World::of(&scene, &settings, &plan, 1.0);
            let eye = Eye::of(&scene.camera, &world.bounds);
            let visible = Visible::of(&world, &eye.camera, &plan);
            prop_assert!(visible.active_lights.lights.len() <= scene.lights.len());
        }
    }
}
