//! Frames averaged over time: light far beyond white beside none, things that are elsewhere in each frame, and tiny pictures. The light of the whole picture is
//! compared, for a pixel's own is a mean of places that the truth of one place does not have.

use glam::{DAffine3, DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{
    Channel, ChannelTarget, Clip, HdrFormat, Interpolation, Local, Material, Motion, Node, Placement, Playing,
    SettingsPatch, metered_ev100,
};

const LIGHT: Bound = Bound { worst: 0.03, mean: 0.03 };

pub const CASES: &[Case] = &[
    case("taa/emission", "a sign that emits so much times white, before the dark: 16 frames averaged over time")
        .over(SweepValues::List(&[1e-3, 1.0, 1e3, 1e4, 1e6, 1e20]), "")
        // Beyond 65,000 times white a sign is as bright as that.
        .claim([1e-3, 1e4], LIGHT)
        .check(Check::Whole(emission)),
    case("taa/speed", "a box that glows comes to its place so fast, in metres a second: 16 frames averaged over time")
        .over(SweepValues::List(&[0.0, 0.01, 0.1, 1.0, 10.0, 100.0, 1e4, 1e6]), "m/s")
        // A surface without history starts from one frame, whose edges have one sample a pixel.
        .claim([0.0, 1e6], Bound { worst: 0.06, mean: 0.06 })
        .check(Check::Whole(speed)),
    case("taa/size", "squares of so many pixels: 16 frames averaged over time")
        .over(SweepValues::List(&[1.0, 2.0, 3.0, 7.0, 17.0, 65.0]), "px")
        // A single pixel is the mean over 16 sample positions, and its truth the mean over 64 others.
        .claim([1.0, 65.0], Bound { worst: 0.15, mean: 0.15 })
        .check(Check::Whole(|edge| size([edge as u32; 2]))),
];

fn settings() -> SettingsPatch {
    let single = SettingsPatch { hdr_format: Some(HdrFormat::Rgba32f), ..float32() };
    SettingsPatch { taa: Some(true), taa_frames: Some(16), sharpness: Some(0.5), ..single }
}

fn lit() -> SceneBuilder {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 4000.0));
    stage
}

/// A box at this place that emits this many times white.
fn glowing(stage: &mut SceneBuilder, times_white: f64, place: DVec3) {
    let glow =
        Material { name: "sign".into(), emissive: Vec3::splat((1.2 * times_white) as f32), ..Material::default() };
    let glow = stage.material(glow);
    let sign = stage.mesh("sign", shapes::cuboid([0.5, 0.5, 0.2]), glow);
    stage.place(sign, glow, DAffine3::from_translation(place));
}

fn emission(times_white: f64) -> Subject {
    let mut stage = sphere_on_floor();
    glowing(&mut stage, times_white, DVec3::new(-0.9, 0.7, 0.5));
    Subject::with(stage.scene, SettingsPatch { exposure: Some(0.0), ..settings() })
}

fn size(size: [u32; 2]) -> Subject {
    Subject::with(lit().scene, SettingsPatch { size: Some(size), ..settings() })
}

fn speed(metres: f64) -> Subject {
    let place = DVec3::new(-0.9, 0.7, 0.5);
    let mut still = lit();
    glowing(&mut still, 1000.0, place);
    let mut stage = lit();
    glowing(&mut stage, 1000.0, place);
    let end = place + DVec3::X * metres;
    let begin = place - DVec3::X * metres;
    let channel = Channel {
        target: ChannelTarget::Translation(0),
        times: vec![0.0, 1.0, 2.0],
        values: [begin, place, end].iter().flat_map(|place| place.to_array()).collect(),
        interpolation: Interpolation::Linear,
    };
    let local = Local::Parts(Placement { translation: place, ..Placement::default() });
    stage.scene.motion = Motion {
        nodes: vec![Node { name: "carrier".into(), parent: None, local, weights: Vec::new() }],
        clips: vec![Clip { name: "come".into(), channels: vec![channel] }],
        ..Motion::default()
    };
    if let Some(object) = stage.scene.objects.last_mut() {
        object.node = Some(0);
    }
    let patch = SettingsPatch { exposure: Some(metered_ev100(&still.scene)), ..settings() };
    let playing = Playing { looped: false, ..Playing::at(1.0) };
    Subject { playing: Some(playing), truth: Some(still.scene), ..Subject::with(stage.scene, patch) }
}
