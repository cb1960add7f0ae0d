//! The stage of most cases: a floor and a sphere on it, small enough that everything is seen from the camera.

use glam::{DVec3, Vec3};

use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{
    Camera, ColorSpace, Falloff, GbufferChoice, GbufferPreset, Light, LightKind, Material, SettingsPatch, Texture,
};

/// A matt floor of 8 x 8 m around the origin, and on it a sphere of half a metre that shines a little, seen from two metres up. Neither
/// light nor ambient light.
pub fn sphere_on_floor() -> SceneBuilder {
    let mut stage = SceneBuilder::default();
    let matt = stage.material(Material { name: "matt".into(), base_color: Vec3::splat(0.5), ..Material::default() });
    let shiny =
        Material { name: "shiny".into(), base_color: Vec3::new(0.8, 0.4, 0.2), roughness: 0.4, ..Material::default() };
    let shiny = stage.material(shiny);
    stage.add("floor", shapes::plane([8.0, 8.0]), matt);
    let sphere = stage.mesh("sphere", shapes::sphere(0.5, 48), shiny);
    stage.place(sphere, shiny, glam::DAffine3::from_translation(DVec3::new(0.0, 0.5, 0.0)));
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 2.0, 4.0), DVec3::new(0.0, 0.4, 0.0), DVec3::Y);
    stage
}

/// A white lamp that reaches everywhere.
pub fn lamp(position: DVec3, candela: f32) -> Light {
    Light {
        name: "lamp".into(),
        intensity: candela,
        ..Light::of(LightKind::Point { position, range: None, falloff: Falloff::InverseSquare })
    }
}

/// Settings with a G-buffer of 32-bit floats, which adds no error itself.
pub fn float32() -> SettingsPatch {
    kept_in(GbufferChoice { preset: GbufferPreset::Float32, ..GbufferChoice::default() })
}

/// Settings with a G-buffer, and nothing else.
pub fn kept_in(gbuffer: GbufferChoice) -> SettingsPatch {
    SettingsPatch { gbuffer: Some(gbuffer), ..SettingsPatch::default() }
}

/// A square texture of linear values; `texel` has the index of each, row by row.
pub fn texture(name: &str, edge: u32, texel: impl FnMut(u32) -> [u8; 4]) -> Texture {
    Texture {
        name: name.into(),
        size: [edge; 2],
        color_space: ColorSpace::Linear,
        sampler: Default::default(),
        texels: (0..edge * edge).flat_map(texel).collect(),
    }
}

/// A linear texture that is the same everywhere, but not so that a plan could put its colour into the material: its last texel differs by
/// a code of alpha.
pub fn even_texture([red, green, blue, alpha]: [u8; 4]) -> Texture {
    texture("even", 4, |index| [red, green, blue, if index == 15 { alpha ^ 1 } else { alpha }])
}

/// A texture of smooth waves that goes on without a seam where it repeats.
pub fn waves() -> Texture {
    const EDGE: u32 = 64;
    let wave = |at: u32, count: f64| {
        (127.5 + 60.0 * (f64::from(at) / f64::from(EDGE) * count * std::f64::consts::TAU).sin()).round() as u8
    };
    let texel =
        |index: u32| [wave(index % EDGE, 1.0), wave(index / EDGE, 2.0), wave(index % EDGE + index / EDGE, 1.0), 255];
    texture("waves", EDGE, texel)
}
