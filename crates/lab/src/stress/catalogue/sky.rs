//! Skies of all strengths and contrasts, and the light that surfaces collect of them in the open: the truth is an integral over all of the sky.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::float32;
use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{Brdf, Camera, HdrFormat, LightPath, Material, SettingsPatch, Sky, SkyImage};

pub const CASES: &[Case] = &[
    case("sky/furnace", "a white metal of this roughness in an even sky, which it mirrors whole")
        .over(SweepValues::List(&[0.0, 0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0]), "")
        .claim([0.1, 1.0], Bound { worst: 0.01, mean: 0.005 })
        .check(Check::Picture(furnace)),
    case("sky/strength", "a matt ball in a sky with so many nits in a texel of 1, metered")
        .over(SweepValues::List(&[1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9]), "nits")
        .claim([1e-12, 1e9], Bound { worst: 0.005, mean: 0.002 })
        .check(Check::Picture(strength)),
    case("sky/contrast", "a matt ball under a patch of the sky that is so many times as bright as the rest")
        .over(SweepValues::Decades(0, 6), "")
        // Half floats keep 11 bits of each texel, and a cosine over a texel of 5.6 degrees bends by 0.1%. Beside the edge of the patch a truth that
        // adds up texels of 1.4 degrees, and a device's of 2.8, are apart.
        .claim([1.0, 1e6], Bound { worst: 0.02, mean: 0.01 })
        .check(Check::Picture(contrast)),
    case("sky/directions", "a rough metal under a bright patch, by so many directions a texel")
        .over(SweepValues::List(&[1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0]), "directions")
        // The split sum errs for a lobe at grazing angles: no number of directions mends it.
        .claim([64.0, 4096.0], Bound { worst: 0.35, mean: 0.01 })
        .check(Check::Picture(directions)),
    case("sky/drawn", "a matt ball under a patch so many times as bright as the rest, by 32 directions of the sky")
        .over(SweepValues::Decades(0, 6), "")
        .claim([1.0, 1e6], Bound { worst: 0.02, mean: 0.01 })
        .check(Check::Picture(drawn)),
    case("sky/one-texel", "the same where so much of a dark sky is lit as one of so many texels around")
        .over(SweepValues::List(&[2.0, 8.0, 32.0, 128.0, 512.0]), "texels")
        // The light that the base collects has texels of 5.6 degrees. The truth adds up the middles of texels, which is no integral over a few large ones.
        .claim([32.0, 512.0], Bound { worst: 0.08, mean: 0.02 })
        .check(Check::Picture(one_texel)),
    case("sky/indoors", "a card that shines with 1 nit in a closed room, in a sky of so many")
        .over(SweepValues::Decades(-2, 6), "nits")
        // Where walls meet, a lookup may pass between them by a part of a texel.
        .claim([0.01, 100.0], Bound { worst: 0.01, mean: 1e-3 })
        .check(Check::Picture(indoors)),
];

fn sky(radiance: impl Fn(DVec3) -> DVec3 + Sync) -> Sky {
    let image = Arc::new(SkyImage::of("test", 128, radiance));
    Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None }
}

/// A ball in a sky of which all arrives, by way of single floats.
fn ball(material: Material, sky: Sky, settings: SettingsPatch) -> Subject {
    let mut stage = SceneBuilder::default();
    let material = stage.material(Material { name: "ball".into(), ..material });
    let ball = stage.mesh("ball", shapes::sphere(0.9, 96), material);
    stage.place(ball, material, DAffine3::IDENTITY);
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 0.3, 2.6), DVec3::ZERO, DVec3::Y);
    stage.scene.sky = Some(sky);
    let path = SettingsPatch {
        light_path: Some(LightPath::Loop),
        hdr_format: Some(HdrFormat::Rgba32f),
        size: Some([32, 32]),
        ..settings
    };
    Subject { open_sky: true, floor: 1.0, ..Subject::with(stage.scene, path.or(&float32())) }
}

fn white(roughness: f64) -> Material {
    Material { base_color: Vec3::ONE, metallic: 1.0, roughness: roughness as f32, ..Material::default() }
}

fn matt() -> Material {
    Material { brdf: Brdf::Lambert, base_color: Vec3::splat(0.8), ..Material::default() }
}

/// Bright above +X, as wide as a hand.
fn patch(times: f64) -> Sky {
    sky(move |to| if to.x > 0.97 { DVec3::splat(times) } else { DVec3::ONE })
}

fn furnace(roughness: f64) -> Subject {
    ball(white(roughness), sky(|_| DVec3::ONE), SettingsPatch::default())
}

fn strength(nits: f64) -> Subject {
    let half = sky(|to| DVec3::splat(1.0 + to.x));
    ball(matt(), Sky { nits: nits as f32, ..half }, SettingsPatch::default())
}

fn contrast(times: f64) -> Subject {
    ball(matt(), patch(times), SettingsPatch::default())
}

fn directions(count: f64) -> Subject {
    let settings = SettingsPatch { sky_samples: Some(count as u32), ..SettingsPatch::default() };
    ball(white(0.5), patch(100.0), settings)
}

/// Lights one frame by the maximum number of shadowed directions. Several jittered frames would see other edges than the truth, which has one ray a pixel.
fn with_shadows() -> SettingsPatch {
    SettingsPatch { sky_shadows: Some(32), ..SettingsPatch::default() }
}

fn drawn(times: f64) -> Subject {
    ball(matt(), patch(times), with_shadows())
}

fn one_texel(width: f64) -> Subject {
    let dark = SkyImage::of("one texel", width as u32, |_| DVec3::ZERO);
    let (middle, last) = (dark.texels.len() / 2, dark.texels.len() - 1);
    let mut texels = dark.texels.clone();
    // At half the height, where its picture starts again: the edge lies in the texel.
    texels[middle.min(last)] = [1e6; 3];
    let sky = Sky { image: Arc::new(SkyImage { texels, ..dark }), ..sky(|_| DVec3::ZERO) };
    ball(matt(), sky, with_shadows())
}

fn indoors(nits: f64) -> Subject {
    let mut stage = SceneBuilder::default();
    let wall = stage.material(matt());
    // Walls are 20 cm thick. A wall without thickness would let light along its plane through.
    for axis in DVec3::AXES {
        for side in [-1.0, 1.0] {
            let size = DVec3::splat(4.2) - axis * 4.0;
            let mesh = stage.mesh("wall", shapes::cuboid(size.to_array()), wall);
            stage.place(mesh, wall, DAffine3::from_translation(axis * (2.0 * side)));
        }
    }
    let glow = Material { brdf: Brdf::Lambert, base_color: Vec3::ZERO, emissive: Vec3::ONE, ..Material::default() };
    let shining = stage.material(glow);
    let card = stage.mesh("card", shapes::cuboid([0.5, 0.5, 0.1]), shining);
    stage.place(card, shining, DAffine3::from_translation(DVec3::Z * -1.0));
    stage.scene.camera = Camera::looking_at(DVec3::new(0.3, 0.5, 1.6), DVec3::new(0.0, 0.0, -1.0), DVec3::Y);
    stage.scene.sky = Some(Sky { nits: nits as f32, ..sky(|_| DVec3::ONE) });
    let settings = SettingsPatch { exposure: Some(0.0), hdr_format: Some(HdrFormat::Rgba32f), ..with_shadows() };
    Subject { floor: 1.0, ..Subject::with(stage.scene, settings.or(&float32())) }
}
