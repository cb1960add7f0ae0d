//! What of a scene lies on the device: as many bytes as the plan says, and the same picture as with what the plan leaves out.

mod common;

use afterlight::gpu::MemoryKind;
use afterlight::scene::{
    AlphaMode, Camera, Environment, Keep, Light, LightKind, Material, Mesh, Object, OptionalPart, Scene, Settings,
    Transparency, View,
};
use glam::{DAffine3, DVec3, Vec3};

use common::gpu::{Gpu, bytes, on_gpu, on_gpu_in_both_modes};

fn settings() -> Settings {
    Settings { size: [64, 48], exposure: Some(7.0), ..Settings::default() }
}

fn keeping(parts: &[OptionalPart]) -> Settings {
    Settings { keep: parts.iter().copied().collect(), ..settings() }
}

fn sun() -> Light {
    Light {
        name: "sun".into(),
        kind: LightKind::Directional { direction: DVec3::new(0.4, -1.0, -0.6).normalize() },
        color: Vec3::ONE,
        intensity: 200.0,
        casts_shadow: true,
        size: 0.0,
    }
}

/// A square of 1 m in the plane z = 0, of `edge` by `edge` vertices, with normals, UVs and tangents.
fn grid(edge: usize) -> Mesh {
    let last = (edge - 1) as f64;
    let places = || (0..edge * edge).map(|i| ((i % edge) as f64 / last, (i / edge) as f64 / last));
    let points: Vec<_> = places().map(|(x, y)| DVec3::new(x, y, 0.0)).collect();
    let mut mesh = Mesh::from_points(format!("grid of {edge}"), &points);
    mesh.uvs = places().map(|(x, y)| [x as f32, 1.0 - y as f32]).collect();
    for y in 0..edge - 1 {
        for x in 0..edge - 1 {
            let corner = (y * edge + x) as u32;
            let above = corner + edge as u32;
            mesh.indices.extend([corner, corner + 1, above + 1, corner, above + 1, above]);
        }
    }
    mesh.compute_normals();
    mesh.compute_tangents();
    mesh
}

/// A grid for each material, side by side and a little behind one another, so that they shade each other.
fn scene(materials: Vec<Material>, edges: &[usize]) -> Scene {
    let object = |index: usize| {
        let place = DVec3::new(index as f64 * 0.9, 0.0, index as f64 * -0.2);
        Object::new(format!("grid {index}"), index % edges.len(), index, DAffine3::from_translation(place))
    };
    let middle = DVec3::new(materials.len() as f64 * 0.45, 0.5, 0.0);
    Scene {
        name: "grids".into(),
        meshes: edges.iter().map(|&edge| grid(edge)).collect(),
        objects: (0..materials.len()).map(object).collect(),
        materials,
        lights: vec![sun()],
        environment: Environment { ambient: Vec3::splat(4.0), ground: None, background: Vec3::ZERO },
        camera: Camera::looking_at(middle + DVec3::new(0.2, 0.3, 2.0), middle, DVec3::Y),
        ..Scene::default()
    }
}

fn plain() -> Material {
    Material { base_color: Vec3::new(0.8, 0.5, 0.3), ..Material::default() }
}

fn pane() -> Material {
    Material { alpha_mode: AlphaMode::Glass, alpha: 0.4, two_sided: true, ..plain() }
}

/// Draws a scene lean and with all of `parts`, each alone and together, and expects the same bits.
fn assert_same(gpu: &Gpu, scene: &Scene, lean: &Settings, parts: &[OptionalPart]) {
    let picture = gpu.draw(scene, lean);
    assert!(bytes(&picture).chunks(4).any(|texel| texel[..3] != [0, 0, 0]), "{}: a black picture", scene.name);
    let each = parts.iter().map(|&part| Keep::NONE.with(part));
    for keep in each.chain([parts.iter().copied().collect()]) {
        let kept = gpu.draw(scene, &Settings { keep, ..lean.clone() });
        assert!(bytes(&kept) == bytes(&picture), "{}: another picture with {keep}", scene.name);
    }
}

const MESH_PARTS: [OptionalPart; 5] = [
    OptionalPart::WideIndices,
    OptionalPart::UnusedMeshes,
    OptionalPart::Normals,
    OptionalPart::Uvs,
    OptionalPart::Tangents,
];

#[test]
fn meshes_of_any_width_and_order_draw_the_same_picture() {
    on_gpu_in_both_modes(|gpu| {
        // 66049 vertices need 32 bits; the meshes in between do not, so that the index buffer changes twice.
        let mut scene = scene(vec![plain(), plain(), plain()], &[3, 257, 5, 4]);
        for settings in [settings(), Settings { depth_prepass: Some(true), ..settings() }] {
            assert_same(gpu, &scene, &settings, &MESH_PARTS);
        }
        scene.materials[0] = pane();
        scene.materials[2] = pane();
        for transparency in [Transparency::Sorted, Transparency::Oit] {
            assert_same(gpu, &scene, &Settings { transparency, ..settings() }, &MESH_PARTS);
        }
        scene.materials[1] = pane();
        assert_same(gpu, &scene, &settings(), &MESH_PARTS);
    });
}

#[test]
fn geometry_takes_as_many_bytes_as_the_plan_says() {
    on_gpu(|gpu| {
        let scene = scene(vec![plain(), plain(), pane()], &[3, 257, 5, 4]);
        let shown = [settings(), keeping(&MESH_PARTS), Settings { view: View::Overdraw, ..settings() }];
        for settings in shown.into_iter().chain(MESH_PARTS.map(|part| keeping(&[part]))) {
            let renderer = gpu.renderer(&scene, &settings);
            let plan = renderer.plan();
            let planned = plan.meshes.bytes() + 2 * plan.sorted_index_bytes();
            let report = gpu.device.memory_report();
            let geometry = report.kinds[&MemoryKind::Geometry];
            // The driver rounds each buffer up.
            let most = planned + 256 * geometry.objects as u64;
            assert!((planned..most).contains(&geometry.bytes), "{}: {planned} planned, {geometry:?}", settings.keep);
            drop(renderer);
            gpu.device.wait_idle().unwrap_or_else(|error| panic!("{error}"));
        }
    });
}
