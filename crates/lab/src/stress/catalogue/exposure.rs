//! Exposures far from a meter's, and brightness of many decades in one picture.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{
    AlphaMode, Camera, Environment, HdrFormat, Light, LightPath, Material, SettingsPatch, metered_ev100,
};

pub const CASES: &[Case] = &[
    case("exposure/stops", "exposures so many stops over what the meter says, without a target for light")
        .over(STOPS, "stops")
        .claim([-40.0, 60.0], Bound { worst: 1e-4, mean: 1e-6 })
        .check(Check::Picture(|over| stops(over, false, SettingsPatch::default()))),
    case("exposure/stops-rgba16f", "the same by way of half floats")
        .over(STOPS, "stops")
        // Half floats have fewer bits below 6e-5, and end at 65,504; half of that where a pane may add to it.
        .claim([-8.0, 16.0], Bound { worst: 5e-3, mean: 5e-4 })
        .check(Check::Picture(|over| stops(over, true, kept_in(HdrFormat::Rgba16f)))),
    case("exposure/stops-b10g11r11", "the same by way of packed floats of 5 and 6 bits")
        .over(STOPS, "stops")
        .claim([-8.0, 16.0], Bound { worst: 0.1, mean: 0.02 })
        .check(Check::Picture(|over| stops(over, true, kept_in(HdrFormat::B10g11r11)))),
    case("exposure/stops-per-light", "the same, each lamp added by blending")
        .over(STOPS, "stops")
        .claim([-40.0, 20.0], Bound { worst: 1e-3, mean: 1e-6 })
        .check(Check::Picture(|over| {
            let path = SettingsPatch { light_path: Some(LightPath::PerLight), ..SettingsPatch::default() };
            stops(over, false, path)
        })),
    case("exposure/decades", "decades of light in one picture, by way of half floats")
        .over(DECADES, "decades")
        // The light goes from 65,000 times white down to where half floats have fewer bits.
        .claim([0.0, 9.0], Bound { worst: 5e-3, mean: 5e-4 })
        .check(Check::Picture(|decades| decades_of(decades, HdrFormat::Rgba16f))),
    case("exposure/decades-b10g11r11", "the same by way of packed floats")
        .over(DECADES, "decades")
        .claim([0.0, 9.0], Bound { worst: 0.06, mean: 0.01 })
        .check(Check::Picture(|decades| decades_of(decades, HdrFormat::B10g11r11))),
    case("exposure/decades-rgba32f", "the same by way of single floats")
        .over(DECADES, "decades")
        .claim([0.0, 12.0], Bound { worst: 1e-6, mean: 1e-7 })
        .check(Check::Picture(|decades| decades_of(decades, HdrFormat::Rgba32f))),
    case("exposure/intensity", "a lamp so strong, metered, by way of half floats")
        .over(SweepValues::List(&[1e-20, 1e-12, 1e-8, 1e-4, 1.0, 1e4, 1e8, 1e12, 1e20, 1e30, 1e38]), "cd")
        .claim([1e-20, 1e30], Bound { worst: 5e-3, mean: 5e-4 })
        .check(Check::Picture(intensity)),
    case(
        "exposure/frames",
        "so many frames of one renderer at exposures from 1e-6 to 1e6 times the first, and the \
         first again, to the last bit",
    )
    .over(SweepValues::List(&[1.0, 10.0, 100.0, 1000.0, 4096.0]), "frames")
    .claim([1.0, 4096.0], Bound { worst: 0.0, mean: 0.0 })
    .check(Check::Exposures(|_| frames())),
];

const STOPS: SweepValues = SweepValues::List(&[
    -40.0, -30.0, -24.0, -20.0, -16.0, -12.0, -8.0, -4.0, 0.0, 4.0, 8.0, 12.0, 16.0, 20.0, 24.0, 30.0, 40.0, 60.0,
]);

const DECADES: SweepValues = SweepValues::List(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0]);

fn kept_in(format: HdrFormat) -> SettingsPatch {
    SettingsPatch { hdr_format: Some(format), ..SettingsPatch::default() }
}

/// A pane that is mostly clear: its blending needs a target for light.
fn add_pane(stage: &mut SceneBuilder) {
    let glass = Material { alpha: 0.25, alpha_mode: AlphaMode::Blend, ..Material::default() };
    let glass = stage.material(Material { name: "glass".into(), two_sided: true, ..glass });
    let pane = stage.mesh("pane", shapes::cuboid([0.6, 0.6, 0.02]), glass);
    stage.place(pane, glass, glam::DAffine3::from_translation(DVec3::new(-1.0, 0.5, 1.0)));
}

/// With a G-buffer in single floats, so that only the targets of light err. Light darker than a hundredth of the brightest pixel
/// counts as that bright: below 6e-5 of white, half floats have ever fewer bits.
fn of_light(settings: SettingsPatch, stage: SceneBuilder) -> Subject {
    Subject { floor: 0.01, ..Subject::with(stage.scene, settings.or(&float32())) }
}

fn stops(over: f64, pane: bool, settings: SettingsPatch) -> Subject {
    let mut stage = sphere_on_floor();
    if pane {
        add_pane(&mut stage);
    }
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 1000.0));
    let exposure = Some(metered_ev100(&stage.scene) - over as f32);
    of_light(SettingsPatch { exposure, ..settings }, stage)
}

/// Self-luminous squares, two to a decade, from the brightest down to `decades` decades less. The brightest is as bright as half floats hold.
fn decades_of(decades: f64, format: HdrFormat) -> Subject {
    let mut stage = SceneBuilder::default();
    let last = (decades * 2.0) as usize;
    for index in 0..=last {
        let nits = 7e4 * 10f64.powf(-0.5 * index as f64);
        let material = Material { base_color: Vec3::ZERO, emissive: Vec3::splat(nits as f32), ..Material::default() };
        let material = stage.material(Material { name: format!("lamp {index}"), ..material });
        let square = stage.mesh(&format!("square {index}"), shapes::cuboid([0.9, 0.9, 0.1]), material);
        let place = DVec3::new((index % 7) as f64 - 3.0, 1.5 - (index / 7) as f64, 0.0);
        stage.place(square, material, glam::DAffine3::from_translation(place));
    }
    stage.scene.camera = Camera { position: DVec3::new(0.0, 0.0, 4.5), ..Camera::default() };
    // By way of the G-buffer, whose pass writes emitted light to the target.
    let settings = SettingsPatch { exposure: Some(0.0), light_path: Some(LightPath::Loop), ..kept_in(format) };
    // Every decade counts.
    Subject { floor: 0.0, ..Subject::with(stage.scene, settings) }
}

/// With everything that is exposed by itself: lamps and a sun with shadows, a pane, a surface that shines, ambient light and a background.
fn frames() -> Subject {
    let mut stage = sphere_on_floor();
    add_pane(&mut stage);
    stage.light(Light { casts_shadow: true, ..lamp(DVec3::new(1.2, 2.0, 1.0), 1000.0) });
    stage.sun(DVec3::new(0.3, -1.0, -0.2), 500.0, Vec3::ONE, true);
    stage.scene.materials[1].emissive = Vec3::new(0.0, 20.0, 80.0);
    stage.scene.environment =
        Environment { ambient: Vec3::splat(30.0), background: Vec3::new(20.0, 60.0, 90.0), ..Environment::default() };
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 1.0, 4.0), DVec3::new(0.0, 0.8, 0.0), DVec3::Y);
    let settings = SettingsPatch { size: Some([32, 18]), shadow_size: Some(256), ..kept_in(HdrFormat::Rgba32f) };
    Subject::with(stage.scene, settings)
}

fn intensity(candela: f64) -> Subject {
    let mut stage = sphere_on_floor();
    add_pane(&mut stage);
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), candela as f32));
    of_light(kept_in(HdrFormat::Rgba16f), stage)
}
