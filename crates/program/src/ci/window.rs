//! Frames as a window has them, on a surface without a display: with a view beside the picture, panels over it, and copies of it.

use afterlight::frame::{Picture, Pixels};
use afterlight_lab::mutants::experiment::{self, PresentPath};

use super::evidence::EvidenceFolder;
use super::examine::{Abort, CaseContext, CaseSetup};
use super::stage::{CaseStage, with_device};
use super::suite::{SuiteCase, ValidationMode};
use super::verdict::{CaseReport, CheckKind};
use crate::compare::differing;

/// Shows frames in each of the case's ways, without the layer and under each of its checks. Skipped where the instance or the device has no surface
/// without a display.
pub fn show(
    case: &SuiteCase,
    context: &CaseContext,
    setup: &CaseSetup,
    first: &Picture,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) -> Result<(), Abort> {
    let ways = &case.holds.window;
    if ways.is_empty() {
        return Ok(());
    }
    let scene = setup.scene.at(&setup.playing);
    for mode in [None].into_iter().chain(case.holds.validate.iter().copied().map(Some)) {
        let stage = CaseStage { mode, shows: Some(CheckKind::Window) };
        with_device(stage, context, evidence, report, |device, report| {
            for &way in ways {
                let picture = experiment::show(device, &scene, &setup.settings, way)?;
                if is_comparable(setup, mode, way) && differ(first, &picture, way) {
                    evidence.picture(&format!("picture-{}.png", name(way)), &picture);
                    let detail = format!("{}: the picture is another than without a window", name(way));
                    report.hold(CheckKind::Window, false, detail);
                    return Ok(());
                }
            }
            let shown: Vec<_> = ways.iter().copied().map(name).collect();
            report.hold(CheckKind::Window, true, format!("shown {}", shown.join(", ")));
            Ok(())
        })?;
    }
    Ok(())
}

fn name(path: PresentPath) -> &'static str {
    match path {
        PresentPath::Straight => "straight",
        PresentPath::Enlarged => "enlarged",
        PresentPath::Encoded => "encoded",
        PresentPath::EncodedKept => "encoded-kept",
    }
}

fn is_encoded(path: PresentPath) -> bool {
    matches!(path, PresentPath::Encoded | PresentPath::EncodedKept)
}

/// Returns true if the picture must be the one without a window. A window shows frames as they come, and not the average of many; GPU-assisted validation
/// adds code to shaders; FXAA and TAA find differences that 8 bits round away and ENCODE does not.
fn is_comparable(setup: &CaseSetup, mode: Option<ValidationMode>, path: PresentPath) -> bool {
    let settings = &setup.settings;
    let is_rounded = is_encoded(path) && settings.smooths_picture();
    mode != Some(ValidationMode::GpuAssisted)
        && settings.frames_over_time().is_none()
        && settings.samples == 1
        && !is_rounded
        && !setup.scene.moves()
}

/// ENCODE reads light that was never rounded to 8 bits: there values may differ by one.
fn differ(one: &Picture, other: &Picture, path: PresentPath) -> bool {
    match (&one.pixels, &other.pixels) {
        (Pixels::Srgb8(one), Pixels::Srgb8(other)) if is_encoded(path) && one.len() == other.len() => {
            one.iter().zip(other).any(|(one, other)| one.abs_diff(*other) > 1)
        }
        _ => differing(one, other) > 0,
    }
}
