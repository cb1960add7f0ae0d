//! Assets of a scene on the device: as many bytes as the plan says, and the same picture as with all that the plan leaves out.

use afterlight::gpu::MemoryKind;
use afterlight::scene::{
    AlphaMode, Anisotropy, Brdf, Camera, ColorSpace, DiffuseTransmission, Environment, Keep, Light, LightKind,
    LightPath, Material, Mesh, Object, OptionalPart, Scene, Settings, Sheen, Texture, TextureSlot, ThinFilm,
    Transparency, View,
};
use glam::{DAffine3, DVec3, Vec3};

use crate::common::gpu::{Gpu, bytes, on_gpu, on_gpu_in_both_modes};
use crate::common::some_of;

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
    if !gpu.takes_turn() {
        return;
    }
    let picture = gpu.draw(scene, lean);
    assert!(bytes(&picture).chunks(4).any(|texel| texel[..3] != [0, 0, 0]), "{}: a black picture", scene.name);
    let each = parts.iter().map(|&part| Keep::NONE.with(part));
    for keep in each.chain([parts.iter().copied().collect()]) {
        let kept = gpu.draw(scene, &Settings { keep, ..lean.clone() });
        assert!(bytes(&kept) == bytes(&picture), "{}: another picture with {keep}", scene.name);
    }
}

const MESH_PARTS: [OptionalPart; 7] = [
    OptionalPart::WideIndices,
    OptionalPart::UnusedMeshes,
    OptionalPart::Normals,
    OptionalPart::Uvs,
    OptionalPart::Tangents,
    OptionalPart::SecondUvs,
    OptionalPart::VertexColors,
];

#[test]
#[ignore = "test-all: all parts of the plan together stay"]
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

const TEXTURE_PARTS: [OptionalPart; 9] = [
    OptionalPart::BaseColorTextures,
    OptionalPart::NormalMaps,
    OptionalPart::MetallicRoughnessTextures,
    OptionalPart::OcclusionTextures,
    OptionalPart::EmissiveTextures,
    OptionalPart::SpecularTextures,
    OptionalPart::UnusedTextures,
    OptionalPart::AlphaMasks,
    OptionalPart::OpaqueMasks,
];

fn texture(name: &str, color_space: ColorSpace, edge: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let texels = (0..edge * edge).flat_map(|i| texel(i % edge, i / edge)).collect();
    Texture { name: name.into(), size: [edge, edge], color_space, sampler: Default::default(), texels }
}

/// One in each slot that differs from texel to texel, and behind them a spare one.
fn varied() -> Vec<Texture> {
    let mix = |x: u32, y: u32, salt: u32| ((x * 37 + y * 91 + salt * 53) % 256) as u8;
    let varied = |name: &str, space| {
        let salt = name.len() as u32;
        texture(name, space, 8, move |x, y| {
            [mix(x, y, salt), mix(y, x, salt + 1), mix(x, x + y, salt + 2), mix(x, y, 7)]
        })
    };
    let flat = |x: u32, y: u32| [100 + (x * 7) as u8, 100 + (y * 7) as u8, 250, 255];
    vec![
        varied("colour", ColorSpace::Srgb),
        texture("bumps", ColorSpace::Linear, 8, flat),
        varied("metal", ColorSpace::Linear),
        varied("occlusion", ColorSpace::Linear),
        varied("glow", ColorSpace::Srgb),
        varied("highlights", ColorSpace::Srgb),
        varied("spare", ColorSpace::Srgb),
        varied("cloth", ColorSpace::Srgb),
        varied("film", ColorSpace::Linear),
        varied("grooves", ColorSpace::Linear),
        varied("leaf", ColorSpace::Srgb),
    ]
}

fn with_all_textures(brdf: Brdf) -> Material {
    let mut material = Material {
        brdf,
        metallic: 1.0,
        roughness: 1.0,
        specular: Vec3::splat(0.5),
        shininess: 20.0,
        emissive: Vec3::splat(20.0),
        sheen: Sheen { color: Vec3::splat(0.5), roughness: 0.4 },
        film: ThinFilm { strength: 0.5, ..ThinFilm::NONE },
        anisotropy: Anisotropy { strength: 0.5, rotation: 1.0 },
        diffuse_transmission: DiffuseTransmission { strength: 0.5, color: Vec3::ONE },
        ..plain()
    };
    TextureSlot::ALL.into_iter().for_each(|slot| *material.texture_mut(slot) = Some(slot as usize));
    material
}

/// Materials with all textures, some and none; with holes; and glass.
fn textured_scene() -> Scene {
    let masked = Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        base_color_texture: Some(0),
        normal_texture: Some(1),
        two_sided: true,
        ..plain()
    };
    let materials = vec![
        with_all_textures(Brdf::CookTorrance),
        masked,
        plain(),
        with_all_textures(Brdf::BlinnPhong),
        Material { brdf: Brdf::Lambert, normal_texture: Some(1), ..plain() },
        Material { base_color_texture: Some(0), ..pane() },
    ];
    let mut scene = scene(materials, &[3]);
    scene.textures = varied();
    scene.camera.position.z += 2.0;
    scene
}

#[test]
#[ignore = "test-all: all parts of the plan together stay"]
fn textures_that_are_left_out_change_no_bit() {
    on_gpu_in_both_modes(|gpu| {
        let scene = textured_scene();
        for light_path in [LightPath::Loop, LightPath::Forward] {
            assert_same(gpu, &scene, &Settings { light_path, ..settings() }, &TEXTURE_PARTS);
        }
    });
}

#[test]
#[ignore = "test-all: all parts of the plan together stay"]
fn every_view_is_the_same_without_what_it_does_not_sample() {
    on_gpu(|gpu| {
        let scene = textured_scene();
        for view in [View::Albedo, View::Normal, View::Roughness, View::Overdraw, View::ShadowMap, View::Lighting] {
            let parts: Keep = TEXTURE_PARTS.into_iter().chain(MESH_PARTS).collect();
            let settings = Settings { view, ..settings() };
            let (lean, kept) = (gpu.draw(&scene, &settings), gpu.draw(&scene, &Settings { keep: parts, ..settings }));
            assert!(bytes(&lean) == bytes(&kept), "{view}");
        }
    });
}

/// A material with textures of one colour in each slot, and masks that cut nothing, or all.
fn constant_scene(code: u8) -> Scene {
    let constant = |material: Material, brdf| Material { brdf, ..material };
    let all = with_all_textures(Brdf::CookTorrance);
    let masked = |texture| Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        base_color_texture: Some(texture),
        ..plain()
    };
    let materials = vec![
        all.clone(),
        constant(all.clone(), Brdf::Phong),
        constant(all, Brdf::Lambert),
        Material { base_color_texture: Some(0), ..pane() },
        masked(TextureSlot::ALL.len()),
        masked(TextureSlot::ALL.len() + 1),
    ];
    let mut scene = scene(materials, &[3]);
    let of_slot = |slot: TextureSlot| match slot {
        TextureSlot::Normal => texture("flat", ColorSpace::Linear, 4, |x, _| [128, 128, 200 + x as u8, 255]),
        _ => texture(slot.form().key, slot.form().color_space, 4, |_, _| [code; 4]),
    };
    scene.textures = TextureSlot::ALL.into_iter().map(of_slot).collect();
    scene.textures.extend([
        texture("passes", ColorSpace::Srgb, 4, |x, y| [90, (x * 20) as u8, (y * 20) as u8, 130 + (x + y) as u8]),
        texture("fails", ColorSpace::Srgb, 4, |x, y| [90, 90, 90, (x + y) as u8]),
    ]);
    scene.camera.position.z += 2.0;
    scene
}

#[test]
#[ignore = "test-all: all parts of the plan together stay"]
fn textures_of_one_colour_are_factors_and_idle_masks_are_none() {
    on_gpu_in_both_modes(|gpu| {
        for code in some_of([0, 77, 128, 255], 2) {
            let scene = constant_scene(code);
            for (light_path, anisotropy) in [(LightPath::Loop, 1), (LightPath::Forward, 1), (LightPath::Loop, 8)] {
                if !gpu.takes_turn() {
                    continue;
                }
                let lean = Settings { light_path, anisotropy, ..settings() };
                let renderer = gpu.renderer(&scene, &lean);
                // One texture is left: the mask that cuts nothing differs from texel to texel. Grooves also have a flat normal map; codes of 0 and
                // 128 leave no grooves.
                let grooves = usize::from(!matches!(code, 0 | 128));
                assert_eq!(renderer.plan().textures.images.len(), 1 + grooves, "{code}");
                drop(renderer);
                let picture = gpu.draw(&scene, &lean);
                for part in [OptionalPart::ConstantTextures, OptionalPart::OpaqueMasks] {
                    let kept = gpu.draw(&scene, &Settings { keep: Keep::NONE.with(part), ..lean.clone() });
                    let worst = bytes(&kept).iter().zip(bytes(&picture)).map(|(a, b)| a.abs_diff(*b)).max();
                    // 0 and 1 are exact; other colours are rounded by the device, and the product once more. The weights of an anisotropic
                    // filter add up to 1 but for their own rounding.
                    let exact = anisotropy == 1 && matches!(code, 0 | 255);
                    let bound = u8::from(part == OptionalPart::ConstantTextures && !exact);
                    assert!(worst <= Some(bound), "{part} {code} {light_path} {anisotropy}: {worst:?}");
                }
            }
        }
    });
}

#[test]
fn textures_take_as_many_bytes_as_the_plan_says() {
    on_gpu(|gpu| {
        let scene = textured_scene();
        for keep in [Keep::NONE, TEXTURE_PARTS.into_iter().collect()] {
            let renderer = gpu.renderer(&scene, &Settings { keep, ..settings() });
            let planned = &renderer.plan().textures;
            let report = gpu.device.memory_report().kinds[&MemoryKind::Texture];
            assert_eq!(report.objects, planned.images.len(), "{keep}");
            // The driver aligns rows and levels: small levels take more than their texels.
            let most: u64 = planned.images.iter().map(|image| image.bytes() + 4096 * u64::from(image.levels)).sum();
            assert!(
                (planned.bytes()..=most).contains(&report.bytes),
                "{keep}: {} planned, {report:?}",
                planned.bytes()
            );
            drop(renderer);
            gpu.device.wait_idle().unwrap_or_else(|error| panic!("{error}"));
        }
    });
}
