//! Lights that are very near, very far, very weak or very strong.

use glam::DVec3;

use super::super::{Bound, Case, Check, Subject, Values};
use super::stage::{lamp, sphere_on_floor};
use crate::scene::{GbufferChoice, GbufferPreset, SettingsPatch};

pub const CASES: &[Case] = &[Case {
    name: "lights/distance",
    extreme: "a lamp above the floor, from inside of it to a thousand kilometres up",
    unit: "m",
    values: Values::Decades(-6, 6),
    claim: [1e-2, 1e6],
    bound: Bound { worst: 1e-3, mean: 1e-4 },
    check: Check::Picture(distance),
}];

/// As strong as far, so that the floor below is always lit alike.
fn distance(metres: f64) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, metres, 1.0), (1000.0 * metres * metres).max(10.0) as f32));
    let gbuffer = GbufferChoice { preset: GbufferPreset::Float32, ..GbufferChoice::default() };
    Subject {
        settings: SettingsPatch { gbuffer: Some(gbuffer), ..SettingsPatch::default() },
        ..Subject::new(stage.scene)
    }
}
