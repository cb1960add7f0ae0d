//! Lenses as wide as a pinhole or a city, sharp at a millimetre or never, and shutters that stay open for a week.

use glam::DVec3;

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::{
    Aperture, Channel, ChannelTarget, Clip, Interpolation, Local, Motion, Node, Placement, Playing, Scene,
    SettingsPatch,
};

/// Frames of a picture.
const SAMPLES: u32 = 16;

pub const CASES: &[Case] = &[
    case("lens/aperture", "a lens so wide, sharp at the sphere: the light of the picture in the mean")
        .over(SweepValues::Decades(-6, 6), "m")
        // Through a lens wider than the view, 16 points are too few for the share that is seen past the floor's edge.
        .claim([1e-6, 0.1], Bound { worst: 5e-3, mean: 5e-3 })
        .check(Check::Whole(|metres| lens(Aperture::Diameter(metres as f32), 4.0))),
    case("lens/f-number", "a lens of such an f-number, sharp at the sphere: the light of the picture in the mean")
        .over(SweepValues::List(&[0.01, 0.1, 0.5, 1.4, 8.0, 64.0, 1e6]), "")
        .claim([0.1, 1e6], Bound { worst: 5e-3, mean: 5e-3 })
        .check(Check::Whole(|number| lens(Aperture::FNumber(number as f32), 4.0))),
    case("lens/focus", "a lens of ten centimetres that is sharp so far away: the light of the picture in the mean")
        .over(SweepValues::Decades(-3, 6), "m")
        // Nearer, all that is left of the sphere is a glow as large as the picture.
        .claim([1.0, 1e6], Bound { worst: 5e-3, mean: 5e-3 })
        .check(Check::Whole(|metres| lens(Aperture::Diameter(0.1), metres as f32))),
    case(
        "lens/shutter",
        "a shutter that is open for so long, before a sphere that goes round and round: what is drawn is finite",
    )
    .over(SweepValues::Decades(-6, 6), "s")
    .claim([1e-6, 1e6], Bound { worst: 0.0, mean: 0.0 })
    .check(Check::Sane(shutter)),
];

fn lit() -> Scene {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.25, 2.0, 1.0), 1000.0));
    stage.scene
}

fn lens(aperture: Aperture, focus: f32) -> Subject {
    let lens = SettingsPatch { aperture: Some(aperture), focus: Some(focus), samples: Some(SAMPLES), ..float32() };
    Subject::with(lit(), lens)
}

fn shutter(seconds: f64) -> Subject {
    let mut scene = lit();
    let local = Local::Parts(Placement { translation: DVec3::new(0.0, 0.5, 0.0), ..Placement::default() });
    let node = Node { name: "sphere".into(), parent: None, local, weights: Vec::new() };
    let values = vec![-1.0, 0.5, 0.0, 1.0, 0.5, 0.0, -1.0, 0.5, 0.0];
    let there_and_back = Channel {
        target: ChannelTarget::Translation(0),
        times: vec![0.0, 0.5, 1.0],
        values,
        interpolation: Interpolation::Linear,
    };
    scene.motion = Motion {
        nodes: vec![node],
        clips: vec![Clip { name: "to and fro".into(), channels: vec![there_and_back] }],
        ..Motion::default()
    };
    scene.objects[1].node = Some(0);
    let settings = SettingsPatch { shutter: Some(seconds as f32), samples: Some(SAMPLES), ..float32() };
    Subject { playing: Some(Playing::at(0.0)), ..Subject::with(scene, settings) }
}
