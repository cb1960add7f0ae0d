//! A soak: one renderer draws for long while settings, lights, objects and the camera change at random. Now and then it comes home, to the case's own
//! scene and settings, where memory, handles and time are compared: there nothing but the renderer's past differs.
//!
//! The run has several laps of the same changes. Heaps keep the size of their greatest load, and drivers keep compiled code, so only the first lap
//! meets anything new and may grow.

mod changes;
pub mod curve;

use std::sync::Arc;
use std::time::{Duration, Instant};

use afterlight::frame::{Picture, Renderer};
use afterlight::gpu::Device;
use afterlight::scene::counted;

use super::evidence::EvidenceFolder;
use super::examine::{Abort, CaseContext, CaseSetup};
use super::suite::Soak;
use super::verdict::{CaseReport, CheckKind};
use crate::compare::differing;
use changes::SoakScene;
use curve::{LAPS, SoakSample};

/// The curve's file.
pub const CURVE: &str = "soak.csv";
/// Samples of a long soak.
const SAMPLES: u32 = 200;
/// Frames between samples at least.
const LEAST_FRAMES: u32 = 25;
/// Frames of each sample; the fastest of them gives the time of a frame.
const TIMED_FRAMES: u32 = 8;

/// Frames in a row that must each take longer than `SLOW` until everything goes home: a CPU may need seconds for a frame that a GPU draws at once.
const SLOW_FRAMES: u32 = 3;
const SLOW: Duration = Duration::from_millis(200);

/// Draws the frames of the soak, and judges the curve.
pub fn soak(
    soak: &Soak,
    context: &CaseContext,
    setup: &CaseSetup,
    device: &Arc<Device>,
    (evidence, report): (&EvidenceFolder, &mut CaseReport),
) -> Result<(), Abort> {
    let mut renderer = setup.renderer(device)?;
    let mut changes = SoakScene::of(setup);
    let every = (soak.frames / SAMPLES).max(LEAST_FRAMES);
    let lap = (soak.frames / every / LAPS).max(1) as usize;
    let (mut samples, mut first, mut drawn) = (Vec::new(), None, 0);
    let mut alive = curve::ObjectCounts::default();
    loop {
        changes.go_home(&mut renderer)?;
        let picture = setup.picture(&mut renderer)?;
        drawn += TIMED_FRAMES;
        samples.push(sample(drawn, setup, device, &mut renderer)?);
        evidence.write(CURVE, curve::csv(&samples).as_bytes());
        alive.look(drawn, device, evidence);
        if !is_first(&picture, first.get_or_insert_with(|| picture.clone()), drawn, evidence, report) {
            return Ok(());
        }
        if drawn >= soak.frames {
            break;
        }
        // Seeded at each home, so that laps stay alike even if some frames were too slow on the way.
        let mut random = fastrand::Rng::with_seed(soak.seed.wrapping_add(((samples.len() - 1) % lap) as u64));
        let mut slow = 0;
        for _ in TIMED_FRAMES..every {
            if random.u32(0..soak.changes_every) == 0 {
                changes.change(&mut renderer, &mut random)?;
            }
            let begun = Instant::now();
            renderer.render(&changes.camera)?;
            drawn += 1;
            slow = if begun.elapsed() > SLOW { slow + 1 } else { 0 };
            if slow == SLOW_FRAMES {
                changes.leave(&mut renderer)?;
                slow = 0;
            }
        }
    }
    let told = format!(
        "{}, {}: at home all {} are equal",
        counted(drawn, "frame"),
        changes.summary_line(),
        counted(samples.len(), "picture")
    );
    report.hold(CheckKind::Determinism, true, told);
    curve::report_on(&samples, context.is_shared, report);
    Ok(())
}

/// Draws some frames at home, and takes a sample of the process and the device.
fn sample(frame: u32, setup: &CaseSetup, device: &Device, renderer: &mut Renderer) -> Result<SoakSample, Abort> {
    let mut fastest = f64::MAX;
    for _ in 0..TIMED_FRAMES {
        let begun = Instant::now();
        renderer.render(&setup.scene.camera)?;
        renderer.wait()?;
        fastest = fastest.min(begun.elapsed().as_secs_f64() * 1e6);
    }
    Ok(SoakSample::take(frame, fastest, device)?)
}

/// Returns true if a picture at home is the first one; if not, both are kept.
fn is_first(
    picture: &Picture,
    first: &Picture,
    drawn: u32,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) -> bool {
    let differ = differing(first, picture);
    if differ > 0 {
        evidence.picture("picture-first.png", first);
        evidence.picture("picture-again.png", picture);
        let detail = format!(
            "back at the first scene and settings, the picture differs in {} after {}",
            counted(differ, "pixel"),
            counted(drawn, "frame")
        );
        report.hold(CheckKind::Determinism, false, detail);
    }
    differ == 0
}
