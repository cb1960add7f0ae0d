//! Pictures of odd, tiny and very long sizes.

use glam::DVec3;

use super::super::{Bound, Case, Check, Subject, Values};
use super::stage::{lamp, sphere_on_floor};
use crate::scene::SettingsPatch;

pub const CASES: &[Case] = &[Case {
    name: "targets/width",
    extreme: "pictures of nine rows, from a single pixel wide to as wide as every device draws",
    unit: "px",
    values: Values::List(&[1.0, 2.0, 3.0, 7.0, 31.0, 33.0, 127.0, 1021.0, 4096.0, 16384.0]),
    claim: [1.0, 4096.0],
    bound: Bound { worst: 0.05, mean: 5e-3 },
    check: Check::Picture(width),
}];

fn width(pixels: f64) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 4000.0));
    let size = Some([pixels as u32, 9]);
    Subject { settings: SettingsPatch { size, ..SettingsPatch::default() }, ..Subject::new(stage.scene) }
}
