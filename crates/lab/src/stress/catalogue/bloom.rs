//! Bloom of next to nothing and of all light, near and far, of tiny pictures, and of lamps far beyond white.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{lamp, sphere_on_floor};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{HdrFormat, Material, SettingsPatch};

/// The bound on errors over the picture's peak. A level is the mean of texels on a grid, so the level's light depends on the place of a small light
/// on that grid: with six taps by 3.7% of a level's kernel along each axis (`crates/truth/src/reference/bloom.rs`). Smooth light has far less of this
/// error.
const SPREAD: Bound = Bound { worst: 0.02, mean: 5e-3 };

pub const CASES: &[Case] = &[
    case("bloom/strength", "such a share of all light is spread")
        .over(SweepValues::List(&[0.0, 1e-6, 1e-3, 0.1, 0.5, 1.0]), "")
        .claim([0.0, 1.0], SPREAD)
        .check(Check::Picture(|strength| spread(Some(strength as f32), None, Subject::SIZE))),
    case("bloom/radius", "light is spread so far, in heights of the picture")
        .over(SweepValues::List(&[1e-3, 0.01, 0.05, 0.2, 0.5, 1.0]), "")
        .claim([1e-3, 1.0], SPREAD)
        .check(Check::Picture(|radius| spread(Some(0.5), Some(radius as f32), Subject::SIZE))),
    case("bloom/size", "squares of so many pixels, which no level divides")
        .over(SweepValues::List(&[1.0, 2.0, 3.0, 7.0, 17.0, 65.0, 257.0]), "px")
        // The last texel of a level stands for the rest of the picture, where the truth has its mirror image.
        .claim([1.0, 257.0], SPREAD)
        .check(Check::Picture(|edge| spread(Some(0.5), Some(0.2), [edge as u32; 2]))),
    case("bloom/emission", "a sign that emits so much times white spreads a tenth of it, by way of single floats")
        .over(SweepValues::List(&[1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9, 1e20, 1e30]), "")
        // Beyond 65,000 times white a sign is as bright as that.
        .claim([1e-6, 1e30], SPREAD)
        .check(Check::Picture(sign)),
];

fn spread(bloom: Option<f32>, bloom_radius: Option<f32>, size: [u32; 2]) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 4000.0));
    let single = SettingsPatch { hdr_format: Some(HdrFormat::Rgba32f), ..super::stage::float32() };
    let settings = SettingsPatch { bloom, bloom_radius, size: Some(size), ..single };
    Subject { floor: 1.0, ..Subject::with(stage.scene, settings) }
}

fn sign(times_white: f64) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 4000.0));
    let glow = Material { emissive: Vec3::splat((1.2 * times_white) as f32), ..Material::default() };
    let glow = stage.material(Material { name: "sign".into(), ..glow });
    let sign = stage.mesh("sign", shapes::cuboid([0.4, 0.4, 0.02]), glow);
    stage.place(sign, glow, glam::DAffine3::from_translation(DVec3::new(-1.0, 0.7, 0.5)));
    let single = SettingsPatch { hdr_format: Some(HdrFormat::Rgba32f), ..super::stage::float32() };
    let exposure = Some(0.0);
    Subject { floor: 1.0, ..Subject::with(stage.scene, SettingsPatch { bloom: Some(0.1), exposure, ..single }) }
}
