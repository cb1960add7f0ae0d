//! Pictures whose pixels can be worked out by hand. All are exposed so that a radiance of 1 nit is 1 in the picture, without tone
//! mapping and without ambient light.

use glam::{DQuat, DVec3, Vec3};

use super::Builtin;
use super::params::{Kind, Parameter, Params};
use super::shapes::{MeshBuilder, WHOLE_IMAGE};
use super::stage::SceneBuilder;
use crate::{
    BlockFormat, Brdf, Camera, ColorSpace, Falloff, Light, LightKind, Material, Projection, Sampler, Scene,
    SettingsPatch, Texels, Texture, Tonemap,
};

/// The light on a plane: its radiance is illuminance * cos(angle) * albedo / pi.
const LIGHT: [Parameter; 3] = [
    Parameter::number("albedo", [0.0, 1.0], 0.5, "of the lambert surface, all channels"),
    Parameter::number("illuminance", [0.0, 1e9], std::f64::consts::PI, "lux of the directional light, head-on"),
    Parameter::number("angle", [0.0, 180.0], 0.0, "degrees between the surface's normal and the light"),
];

pub(super) const QUAD: Builtin = Builtin {
    name: "quad",
    about: "A lambert plane that fills the view under one directional light.",
    parameters: &LIGHT,
    build: |params| lit(params, "quad", |mesh| mesh.quad(facing(100.0, 0.0), WHOLE_IMAGE)),
};

pub(super) const TRIANGLE: Builtin = Builtin {
    name: "triangle",
    about: "One lambert triangle, a metre wide and high, under one directional light.",
    parameters: &LIGHT,
    build: |params| {
        lit(params, "triangle", |mesh| {
            let corners = [DVec3::new(-0.5, -0.5, 0.0), DVec3::new(0.5, -0.5, 0.0), DVec3::new(0.0, 0.5, 0.0)];
            let [a, b, c] =
                corners.map(|p| mesh.vertex(p, DVec3::Z, p.truncate() * DVec3::new(1.0, -1.0, 0.0).truncate() + 0.5));
            mesh.triangle([a, b, c]);
        })
    },
};

pub(super) const OVERLAP: Builtin = Builtin {
    name: "overlap",
    about: "A red and a green spot light that overlap on a white plane: yellow.",
    parameters: &[],
    build: overlap,
};

pub(super) const ORIENTATION: Builtin = Builtin {
    name: "orientation",
    about: "A picture that proves winding, handedness, depth order, texture origin and sRGB.",
    parameters: &[Parameter {
        name: "texels",
        about: "of the test card: as they are, or blocks of the nearest colour",
        kind: Kind::Choice { names: &["rgba8", "bc7", "etc2-rgb8", "etc2-rgb8a1", "etc2-rgba8"] },
    }],
    build: orientation,
};

/// A square of `edge` metres at `z` that faces +Z, from its lower left corner.
fn facing(edge: f64, z: f64) -> [DVec3; 4] {
    rectangle([-edge * 0.5, -edge * 0.5], [edge * 0.5, edge * 0.5], z)
}

fn rectangle(low: [f64; 2], high: [f64; 2], z: f64) -> [DVec3; 4] {
    [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]].map(|[x, y]| DVec3::new(x, y, z))
}

/// A stage where radiance comes out as it is, seen from two metres along -Z: at z = 0 the picture is two metres high.
fn plain_stage() -> SceneBuilder {
    let mut stage = SceneBuilder::default();
    stage.scene.camera = Camera {
        position: DVec3::new(0.0, 0.0, 2.0),
        rotation: DQuat::IDENTITY,
        projection: Projection::perspective(2.0 * 0.5f64.atan().to_degrees()),
        near: 0.1,
        ..Camera::default()
    };
    stage.scene.settings = SettingsPatch {
        // 1 / (1.2 * 2^EV100) = 1
        exposure: Some((1.0f32 / 1.2).log2()),
        tonemap: Some(Tonemap::None),
        ..SettingsPatch::default()
    };
    stage
}

fn lambert(name: &str, base_color: Vec3) -> Material {
    Material { name: name.into(), brdf: Brdf::Lambert, base_color, ..Material::default() }
}

fn lit(params: &Params, name: &str, shape: impl FnOnce(&mut MeshBuilder)) -> Scene {
    let mut stage = plain_stage();
    let material = stage.material(lambert("lambert", Vec3::splat(params.number("albedo") as f32)));
    let mut mesh = MeshBuilder::new();
    shape(&mut mesh);
    stage.add(name, mesh, material);
    let (sin, cos) = params.number("angle").to_radians().sin_cos();
    stage.sun(DVec3::new(-sin, 0.0, -cos), params.number("illuminance") as f32, Vec3::ONE, false);
    stage.scene
}

fn overlap(_: &Params) -> Scene {
    let mut stage = plain_stage();
    let white = stage.material(lambert("white", Vec3::ONE));
    let mut mesh = MeshBuilder::new();
    mesh.quad(facing(100.0, 0.0), WHOLE_IMAGE);
    stage.add("screen", mesh, white);
    // Discs of 0.56 m around (-0.3, 0) and (0.3, 0): both shine on the middle, where they are equally far.
    for (name, x, color) in [("red", -0.3, Vec3::X), ("green", 0.3, Vec3::Y)] {
        stage.light(Light {
            name: name.into(),
            color,
            intensity: 4.0 * std::f32::consts::PI,
            ..Light::of(LightKind::Spot {
                position: DVec3::new(x, 0.0, 2.0),
                direction: DVec3::NEG_Z,
                inner_angle_degrees: 15.0,
                outer_angle_degrees: 15.7,
                range: None,
                falloff: Falloff::InverseSquare,
            })
        });
    }
    stage.scene
}

/// The test card fills the middle two metres; under pi lux a white lambert surface has a radiance of 1, so that the picture shows
/// the card's own bytes. Beside it, left: a clockwise magenta square that must not be seen, in front of a grey one that must.
/// Right: a near cyan square listed before, and a far yellow one listed after, then the same the other way about below.
fn orientation(params: &Params) -> Scene {
    let mut stage = plain_stage();
    let card = stage.texture(test_card(match params.choice("texels") {
        "bc7" => Some(BlockFormat::Bc7),
        "etc2-rgb8" => Some(BlockFormat::Etc2Rgb8),
        "etc2-rgb8a1" => Some(BlockFormat::Etc2Rgb8A1),
        "etc2-rgba8" => Some(BlockFormat::Etc2Rgba8),
        _ => None,
    }));
    let card = stage.material(Material { base_color_texture: card, ..lambert("card", Vec3::ONE) });
    let mut mesh = MeshBuilder::new();
    mesh.quad(facing(1.8, 0.0), WHOLE_IMAGE);
    stage.add("card", mesh, card);
    let [grey, magenta, cyan, yellow] = [
        ("grey", Vec3::splat(0.5)),
        ("magenta", Vec3::new(1.0, 0.0, 1.0)),
        ("cyan", Vec3::new(0.0, 1.0, 1.0)),
        ("yellow", Vec3::new(1.0, 1.0, 0.0)),
    ]
    .map(|(name, color)| stage.material(lambert(name, color)));
    let mut square = |name: &str, corners: [DVec3; 4], material: usize| {
        let mut mesh = MeshBuilder::new();
        mesh.quad(corners, WHOLE_IMAGE);
        stage.add(name, mesh, material);
    };
    square("behind the clockwise square", rectangle([-1.6, -0.4], [-1.0, 0.4], 0.0), grey);
    let mut clockwise = rectangle([-1.5, -0.3], [-1.1, 0.3], 0.05);
    clockwise.reverse();
    square("clockwise square", clockwise, magenta);
    square("near, listed first", rectangle([1.1, 0.1], [1.4, 0.6], 0.05), cyan);
    square("far, listed second", rectangle([1.0, 0.0], [1.6, 0.7], 0.0), yellow);
    square("far, listed first", rectangle([1.0, -0.7], [1.6, -0.05], 0.0), yellow);
    square("near, listed second", rectangle([1.1, -0.6], [1.4, -0.1], 0.05), cyan);
    stage.sun(DVec3::NEG_Z, std::f32::consts::PI, Vec3::ONE, false);
    stage.scene
}

/// Edge of the test card in texels; corners are 64 texels wide. Each block of 4x4 texels has one colour.
const CARD: u32 = 256;

/// Upper left red, upper right green, lower left blue, lower right white; an F in the middle on grey 188 (0.5 in linear light); below it a
/// ramp of sixteen greys, 17 apart.
fn test_card(blocks: Option<BlockFormat>) -> Texture {
    let step = if blocks.is_some() { 4 } else { 1 };
    let places = (0..CARD).step_by(step).flat_map(|y| (0..CARD).step_by(step).map(move |x| (x, y)));
    let colors = places.map(|(x, y)| {
        let [r, g, b] = card_color(x, y);
        [r, g, b, 255]
    });
    // Blocks have one level.
    let sampler = Sampler { levels: blocks.map_or(Sampler::DEFAULT.levels, |_| None), ..Sampler::DEFAULT };
    let texels = match blocks {
        Some(format) => Texels::Blocks { format, levels: vec![colors.flat_map(|color| format.solid(color)).collect()] },
        None => colors.flatten().collect(),
    };
    Texture { name: "test card".into(), size: [CARD; 2], color_space: ColorSpace::Srgb, sampler, texels }
}

fn card_color(x: u32, y: u32) -> [u8; 3] {
    let (left, right, top, bottom) = (x < 64, x >= 192, y < 64, y >= 192);
    match (left, right, top, bottom) {
        (true, _, true, _) => [255, 0, 0],
        (_, true, true, _) => [0, 255, 0],
        (true, _, _, true) => [0, 0, 255],
        (_, true, _, true) => [255, 255, 255],
        (false, false, _, true) => [((x - 64) / 8 * 17) as u8; 3],
        _ if is_in_f(x, y) => [0, 0, 0],
        _ => [188, 188, 188],
    }
}

fn is_in_f(x: u32, y: u32) -> bool {
    let stem = (96..112).contains(&x) && (72..184).contains(&y);
    let upper_bar = (96..160).contains(&x) && (72..88).contains(&y);
    let lower_bar = (96..144).contains(&x) && (116..132).contains(&y);
    stem || upper_bar || lower_bar
}
