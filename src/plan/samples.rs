//! Scenes, devices and plans of every structure, for tests.

mod plans;

pub use plans::{forward_plans, of_every_kind, plans, plans_of_effects, tiled_plans};

use glam::{DAffine3, DVec3, Vec3};

use super::{
    Capabilities, CostModel, FramePlan, PlanError, Refusal, RefusalReason, Variation, shows_effect, variations,
};
use crate::scene::{
    AlphaMode, Brdf, Channel, ChannelTarget, Clip, Culling, Falloff, GbufferChoice, GbufferPreset, Influences,
    Interpolation, Light, LightKind, LightPath, Local, Material, Mesh, Morph, Motion, Node, Object, OptionalPart,
    Output, Placement, Resolve, Scene, Settings, Skin, TargetChoice, Texture, TextureSlot, Transparency, UvMap, View,
    Wrap,
};

/// All views but the complexity, which needs several samples a pixel, and the views of effects, which are planned as the lit picture.
pub fn views() -> impl Iterator<Item = View> {
    View::NAMES.iter().map(|&(_, view)| view).filter(|&view| view != View::Complexity && !shows_effect(view))
}

/// The default settings, but with a G-buffer even for plain scenes, which `auto` would light as they are drawn.
pub fn deferred() -> Settings {
    Settings { light_path: LightPath::Loop, ..Settings::default() }
}

/// A device that can do everything, but has no tile memory.
pub fn device() -> Capabilities {
    Capabilities::ample()
}

/// A CPU that can do everything.
pub fn software() -> Capabilities {
    Capabilities { software: true, costs: CostModel::CPU, ..device() }
}

#[cfg(test)]
pub fn vector(range: f64) -> impl proptest::strategy::Strategy<Value = DVec3> {
    use proptest::strategy::Strategy;

    [-range..range, -range..range, -range..range].prop_map(DVec3::from)
}

/// Plans a scene for [`device`].
pub fn plan(scene: &Scene, settings: &Settings) -> FramePlan {
    FramePlan::of(scene, settings, &device()).expect("a plan")
}

pub fn keeping(parts: &[OptionalPart]) -> Settings {
    Settings { keep: parts.iter().copied().collect(), ..Settings::default() }
}

/// A unit square for each material, in a row along X.
pub fn scene(materials: Vec<Material>, lights: Vec<Light>) -> Scene {
    let mut mesh =
        Mesh::from_points("square", &[[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| DVec3::new(x, y, 0.0)));
    mesh.indices = vec![0, 1, 2, 0, 2, 3];
    mesh.uvs = vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    mesh.compute_normals();
    mesh.tangents = vec![[1.0, 0.0, 0.0, 1.0]; 4];
    let object = |material| {
        let place = DAffine3::from_translation(DVec3::X * material as f64);
        Object::new(format!("square {material}"), 0, material, place)
    };
    let mut scene = Scene {
        meshes: vec![mesh],
        objects: (0..materials.len()).map(object).collect(),
        materials,
        lights,
        ..Scene::default()
    };
    if scene.materials.iter().any(|material| material.textures().next().is_some()) {
        add_textures(&mut scene);
    }
    scene
}

pub fn material(brdf: Brdf) -> Material {
    Material { brdf, ..Material::default() }
}

pub fn emissive() -> Material {
    Material { emissive: Vec3::new(0.0, 10.0, 0.0), ..Material::default() }
}

/// A texture for each slot that differs from texel to texel, for [`textured`] and [`masked`].
pub fn add_textures(scene: &mut Scene) {
    scene.textures = TextureSlot::ALL
        .into_iter()
        .map(|slot| Texture {
            name: slot.form().key.into(),
            size: [2, 2],
            color_space: slot.form().color_space,
            sampler: Default::default(),
            texels: [[255, 90, 200, 0], [10, 128, 250, 255], [0, 20, 128, 60], [99, 30, 180, 255]].concat().into(),
        })
        .collect();
}

/// A material with a texture in every slot. The specular slot is for the Phong models.
pub fn textured(brdf: Brdf) -> Material {
    let mut material = Material { brdf, specular: Vec3::splat(0.5), ..Material::default() };
    TextureSlot::ALL.into_iter().for_each(|slot| *material.texture_mut(slot) = Some(slot as usize));
    material
}

/// A material whose texture cuts holes.
pub fn masked() -> Material {
    Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, base_color_texture: Some(0), ..Material::default() }
}

/// Returns a material through which surfaces behind it are seen.
pub fn glass() -> Material {
    Material { alpha_mode: AlphaMode::Glass, alpha: 0.25, ..Material::default() }
}

/// A scene with vertex colours and second texture coordinates, whose textures have different samplers; one of them cuts holes.
pub fn painted() -> Scene {
    let mut worn = textured(Brdf::CookTorrance);
    worn.uv_maps[TextureSlot::Normal as usize] = UvMap { set: 1, rotation: 0.5, ..UvMap::IDENTITY };
    let mut cut = masked();
    cut.uv_maps[TextureSlot::BaseColor as usize].offset.x = 0.25;
    let mut scene = scene(vec![worn, cut, Material::default()], vec![sun(), sky()]);
    let mesh = &mut scene.meshes[0];
    mesh.colors = vec![[1.0, 0.5, 0.25, 0.75]; mesh.positions.len()];
    mesh.uvs_1 = mesh.uvs.clone();
    scene.textures[1].sampler.wrap = [Wrap::Clamp; 2];
    scene
}

/// A scene with a dielectric of unusual reflectance under a coat, and an unlit surface.
pub fn lacquered() -> Scene {
    let dielectric = Material { reflectance: Vec3::splat(0.1), ..textured(Brdf::CookTorrance) };
    let coat = Material { alpha_mode: AlphaMode::Coat, roughness: 0.1, ..Material::default() };
    let sign = Material { unlit: true, base_color_texture: Some(0), ..Material::default() };
    let mut scene = scene(vec![dielectric, coat, sign], vec![sun(), point(Falloff::Quadratic)]);
    scene.objects[1].transform = scene.objects[0].transform;
    scene
}

/// A textured cover that also glows.
pub fn gauze() -> Material {
    Material {
        alpha_mode: AlphaMode::Blend,
        alpha: 0.5,
        two_sided: true,
        ..Material { emissive: Vec3::ONE, ..textured(Brdf::Phong) }
    }
}

fn light(name: &str, kind: LightKind, casts_shadow: bool) -> Light {
    Light { name: name.into(), intensity: 100.0, casts_shadow, ..Light::of(kind) }
}

pub fn sun() -> Light {
    light("sun", LightKind::Directional { direction: DVec3::new(0.3, -1.0, -0.5).normalize() }, true)
}

/// Directional, without a shadow.
pub fn sky() -> Light {
    Light { casts_shadow: false, ..sun() }
}

pub fn point(falloff: Falloff) -> Light {
    light("lamp", LightKind::Point { position: DVec3::Z, range: Some(5.0), falloff }, false)
}

/// A point light with inverse-square fall-off, limited only by its range.
pub fn lamp(position: DVec3, range: Option<f64>) -> Light {
    let kind = LightKind::Point { position, range, falloff: Falloff::InverseSquare };
    Light { kind, ..point(Falloff::InverseSquare) }
}

pub fn spot(falloff: Falloff) -> Light {
    let kind = LightKind::Spot {
        position: DVec3::Z,
        direction: DVec3::NEG_Z,
        inner_angle_degrees: 20.0,
        outer_angle_degrees: 35.0,
        range: (falloff == Falloff::Quadratic).then_some(5.0),
        falloff,
    };
    light("spot", kind, false)
}

pub fn beam(range: Option<f64>) -> Light {
    let (position, direction) = (DVec3::Z, DVec3::NEG_Z);
    light("beam", LightKind::Beam { position, direction, radius: 0.5, edge: 0.2, range }, false)
}

/// Every kind of light, each with a shadow.
pub fn shadowed_lamps() -> Vec<Light> {
    let lights = [sun(), point(Falloff::Quadratic), spot(Falloff::InverseSquare), beam(None)];
    lights.into_iter().map(|light| Light { casts_shadow: true, ..light }).collect()
}

/// The first square hangs on a joint and blends to a shape, the second casts a shadow on it.
pub fn deformed() -> Scene {
    let mut scene = scene(vec![textured(Brdf::CookTorrance), masked()], vec![sun()]);
    let mut mesh = scene.meshes[0].clone();
    mesh.influences = Some(Influences { per_vertex: 4, joints: vec![0; 16], weights: [1.0, 0.0, 0.0, 0.0].repeat(4) });
    mesh.morphs = vec![Morph { positions: vec![[0.0, 0.0, 0.1]; 4], ..Morph::default() }];
    scene.meshes.push(mesh);
    let at = |name: &str, weights| Node {
        name: name.into(),
        parent: None,
        local: Local::Parts(Placement::default()),
        weights,
    };
    let skin = Skin { name: "skin".into(), joints: vec![0], inverse_bind: vec![DAffine3::IDENTITY] };
    let turn = Channel {
        target: ChannelTarget::Rotation(0),
        times: vec![0.0, 1.0],
        values: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.6, 0.8],
        interpolation: Interpolation::Linear,
    };
    scene.motion = Motion {
        nodes: vec![at("joint", vec![]), at("square", vec![0.5])],
        skins: vec![skin],
        clips: vec![Clip { name: "turn".into(), channels: vec![turn] }],
        light_nodes: Vec::new(),
    };
    let object = &mut scene.objects[0];
    (object.mesh, object.node, object.skin) = (1, Some(1), Some(0));
    scene
}

/// Adds to a scene whatever a variation of an effect needs.
pub fn with(name: &str, mut scene: Scene) -> Scene {
    let variation = variations().find(|variation| variation.name == name).expect("a variation of an effect");
    (variation.scene)(&mut scene);
    scene
}

/// Scenes that differ in the needs of a frame.
pub fn scenes() -> Vec<(&'static str, Scene)> {
    let mut mirrored = scene(vec![masked()], vec![sun(), sky()]);
    mirrored.objects[0].transform = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    vec![
        ("nothing", Scene::default()),
        ("unlit", scene(vec![material(Brdf::CookTorrance)], vec![])),
        ("lambert", scene(vec![material(Brdf::Lambert)], vec![sky()])),
        ("sunlit", scene(vec![material(Brdf::CookTorrance)], vec![sun()])),
        ("sunlit-lambert", scene(vec![material(Brdf::Lambert)], vec![sun()])),
        ("lamps", scene(vec![material(Brdf::Phong)], vec![point(Falloff::Quadratic), spot(Falloff::InverseSquare)])),
        (
            "mixed",
            scene(vec![material(Brdf::Lambert), textured(Brdf::BlinnPhong)], vec![sun(), point(Falloff::Quadratic)]),
        ),
        ("shadowed-lamps", scene(vec![textured(Brdf::CookTorrance)], shadowed_lamps())),
        ("emissive", scene(vec![emissive(), textured(Brdf::CookTorrance)], vec![sun()])),
        ("glow", scene(vec![emissive()], vec![])),
        ("mirrored", mirrored),
        ("glass", scene(vec![material(Brdf::CookTorrance), glass()], vec![sun(), point(Falloff::Quadratic)])),
        ("glowing gauze", scene(vec![emissive(), gauze(), masked()], vec![sky()])),
        ("nothing but glass", scene(vec![glass()], vec![])),
        ("deformed", deformed()),
        ("painted", painted()),
        ("lacquered", lacquered()),
        (
            "under a sky",
            with("under a sky", scene(vec![textured(Brdf::CookTorrance), material(Brdf::Phong), glass()], vec![sun()])),
        ),
        ("under a sky alone", with("under a sky", scene(vec![material(Brdf::CookTorrance)], vec![]))),
    ]
}

/// Layouts of the G-buffer: the presets, and overrides that change which targets there are.
pub fn gbuffers() -> Vec<(&'static str, GbufferChoice)> {
    let preset = |preset| GbufferChoice { preset, ..GbufferChoice::default() };
    let lean = GbufferChoice::default();
    vec![
        ("lean", lean),
        ("fat", preset(GbufferPreset::Fat)),
        ("float32", preset(GbufferPreset::Float32)),
        ("lean,position=rgba32f", GbufferChoice { position: Some(TargetChoice::Rgba32f), ..lean }),
        ("lean,normal=rgb10a2", GbufferChoice { normal: Some(TargetChoice::Rgb10a2), ..lean }),
        (
            "fat,position=depth,normal=oct16uint",
            GbufferChoice {
                position: Some(TargetChoice::Depth),
                normal: Some(TargetChoice::Oct16Uint),
                ..preset(GbufferPreset::Fat)
            },
        ),
    ]
}
