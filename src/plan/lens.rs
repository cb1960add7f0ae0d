//! The lens and the shutter, which only pictures of several frames have.

use super::{Part, PlanError, parts::part};
use crate::scene::{Scene, Settings, ThinLens};

/// Refuses a lens that no camera of the kind has, and one that is sharp nowhere.
pub(super) fn check(scene: &Scene, settings: &Settings) -> Result<(), PlanError> {
    let aperture = settings.aperture;
    if aperture.is_pinhole() {
        return Ok(());
    }
    let refuse = |why| Err(PlanError::Lens(format!("an aperture of {aperture}: {why}")));
    if scene.camera.is_orthographic() {
        return refuse("an orthographic camera has no lens, for its rays are parallel: leave the aperture out");
    }
    if settings.focus.is_none() {
        return Err(PlanError::Lens(format!("--aperture {aperture} needs a focus distance: add --focus METRES")));
    }
    Ok(())
}

/// Returns a warning if a picture of one frame cannot show the lens or the shutter that was asked for.
pub(super) fn warning(settings: &Settings) -> Option<String> {
    let asked = match (settings.aperture.is_pinhole(), settings.shutter > 0.0) {
        _ if settings.samples > 1 => return None,
        (true, false) => return None,
        (false, false) => "no lens",
        (true, true) => "no open shutter",
        (false, true) => "neither lens nor open shutter",
    };
    Some(format!("a picture of 1 sample has {asked}: several have, as --samples 64"))
}

/// The lens and the shutter, as `inspect` lists them.
pub(super) fn parts(scene: &Scene, settings: &Settings) -> [Part; 2] {
    let samples = settings.samples;
    let lens = ThinLens::of(settings, &scene.camera);
    let in_lens = match lens {
        None => "no aperture: everything is sharp".to_owned(),
        Some(_) if samples == 1 => "one frame looks through its middle: everything is sharp".to_owned(),
        Some(ThinLens { radius, focus }) => format!(
            "{samples} frames look through as many points of {} m of glass, sharp at {focus} m",
            crate::scene::decimal(2.0 * radius, 6)
        ),
    };
    let seconds = settings.shutter;
    let in_time = match samples {
        _ if seconds == 0.0 => "shutter 0: no motion blur".to_owned(),
        1 => "one frame shows the moment at which it opens".to_owned(),
        samples => format!("{samples} frames show as many moments of {seconds} s"),
    };
    [
        part("lens", lens.is_some() && samples > 1, in_lens, 0),
        part("open shutter", seconds > 0.0 && samples > 1, in_time, 0),
    ]
}
