//! A storm of resizes: one surface without a display is fitted to many sizes, and drawn into at each. A long one returns to the case's own
//! size now and then, where memory, handles and time are compared as in a soak.

use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::{self, Outcome, Presenter};
use afterlight::gpu::{Device, Surface, Vsync};
use afterlight::scene::{Settings, counted};

use super::evidence::EvidenceFolder;
use super::examine::{Abort, CaseContext, CaseSetup};
use super::soak::curve::{self, SoakSample};
use super::stage::{CaseStage, with_device};
use super::verdict::{CaseReport, CheckKind};

/// The curve's file.
const CURVE: &str = "resizes.csv";
/// Sizes are the same in each run, so that a failure comes again.
const SEED: u64 = 7;
/// The longest edge, in pixels.
const LONGEST: u32 = 256;
/// Sizes of a storm that is measured, at least: a shorter one ends before allocators have warmed up.
const LEAST_MEASURED: u32 = 500;
/// Samples of a storm that is measured, about.
const SAMPLES: u32 = 40;
/// Frames of each sample; the fastest of them gives the time of a frame.
const TIMED_FRAMES: u32 = 8;

/// Draws into `count` sizes at random. Skipped where the instance or the device has no surface without a display.
pub fn storm(
    count: u32,
    context: &CaseContext,
    setup: &CaseSetup,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) -> Result<(), Abort> {
    let stage = CaseStage { mode: None, shows: Some(CheckKind::Resizes) };
    with_device(stage, context, evidence, report, |device, report| {
        let surface = Surface::headless(device)?;
        match draw(count, device, surface, setup, evidence)? {
            Ok(samples) => {
                report.hold(CheckKind::Resizes, true, format!("drawn into {}", counted(count, "size")));
                if !samples.is_empty() {
                    curve::report_on(&samples, context.is_shared, report);
                }
            }
            Err(why) => report.hold(CheckKind::Resizes, false, why),
        }
        Ok(())
    })?;
    Ok(())
}

/// Draws into all sizes. Returns the measurements, of which a short storm has none, or the reason why a size was not drawn into.
fn draw(
    count: u32,
    device: &Arc<Device>,
    surface: Arc<Surface>,
    setup: &CaseSetup,
    evidence: &EvidenceFolder,
) -> Result<Result<Vec<SoakSample>, String>, Abort> {
    let mut presenter = Presenter::new(device, surface, &setup.scene, &setup.settings, Vsync::Off)?;
    let mut random = fastrand::Rng::with_seed(SEED);
    let every = if count < LEAST_MEASURED { u32::MAX } else { count.div_ceil(SAMPLES) };
    let (mut samples, mut alive) = (Vec::new(), curve::ObjectCounts::default());
    for index in 1..=count {
        // One-pixel edges find the most faults.
        let size = [(); 2].map(|()| if random.u32(..8) == 0 { 1 } else { random.u32(1..=LONGEST) });
        fit(size, &mut presenter, setup)?;
        if let Err(why) = draw_into(size, &mut presenter, setup)? {
            return Ok(Err(why));
        }
        // Not before the first size: a buffer of a frame in flight is made when its frame first needs it, which may be after a resize.
        if index % every == 0 {
            match sample(index, device, &mut presenter, setup)? {
                Ok(own) => samples.push(own),
                Err(why) => return Ok(Err(why)),
            }
            evidence.write(CURVE, curve::csv(&samples).as_bytes());
            alive.look(index, device, evidence);
        }
    }
    Ok(Ok(samples))
}

fn fit(size: [u32; 2], presenter: &mut Presenter, setup: &CaseSetup) -> Result<(), Abort> {
    let settings = Settings { size, ..setup.settings.clone() };
    presenter.fit(&setup.scene, &settings, size)?;
    presenter.refusal().map_or(Ok(()), |refused| Err(frame::Error::into(refused)))
}

/// Draws a frame and reads it back. The inner error says why nothing of that size was drawn.
fn draw_into(size: [u32; 2], presenter: &mut Presenter, setup: &CaseSetup) -> Result<Result<(), String>, Abort> {
    let [width, height] = size;
    match presenter.draw(&setup.scene.camera, true, None)? {
        Outcome::Shown(_) => {
            let picture = presenter.picture()?;
            let is_whole = picture.size == size;
            Ok(if is_whole { Ok(()) } else { Err(format!("the picture of {width}x{height} is {:?}", picture.size)) })
        }
        Outcome::Nothing(fit) => Ok(Err(format!("nothing was drawn at {width}x{height}: {fit:?}"))),
    }
}

/// Returns to the case's own size, draws some frames there, and takes a sample of the process and the device.
fn sample(
    drawn: u32,
    device: &Device,
    presenter: &mut Presenter,
    setup: &CaseSetup,
) -> Result<Result<SoakSample, String>, Abort> {
    let size = setup.settings.size;
    fit(size, presenter, setup)?;
    let mut fastest = f64::MAX;
    for _ in 0..TIMED_FRAMES {
        let begun = Instant::now();
        if let Err(why) = draw_into(size, presenter, setup)? {
            return Ok(Err(why));
        }
        fastest = fastest.min(begun.elapsed().as_secs_f64() * 1e6);
    }
    Ok(Ok(SoakSample::take(drawn, fastest, device)?))
}
