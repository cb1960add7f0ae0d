//! Makes the checks of one case, in this process. Findings are written into the case's folder as soon as they are known, so that a process that
//! crashes leaves them behind.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::{self, Picture, Pixels, Renderer, capabilities, plan_with, rows};
use afterlight::gpu::{self, Device, DeviceChoice, MemoryReport};
use afterlight::plan::{self, Capabilities, FramePlan};
use afterlight::scene::{
    self, OpenOptions, Output, Playing, Pose, Scene, Settings, SettingsPatch, counted, file, metered_ev100,
};
use afterlight_lab::stress::{self, Subject};
use afterlight_truth::measure::{Distribution, flip, resident_memory_bytes};

use super::baseline::Baseline;
use super::evidence::EvidenceFolder;
use super::stage::{CaseStage, with_device};
use super::suite::{SceneSource, SuiteCase, TruthTolerance, ValidationMode};
use super::verdict::{CaseReport, CheckKind, Verdict};
use super::{resizes, soak, window};
use crate::compare::differing;
use crate::failure::with_causes;
use crate::table::bytes;

/// Frames of which the device's time is taken, after one that nobody times.
const TIMED_FRAMES: u32 = 5;
/// Frames after which memory must be steady.
const WARM_FRAMES: u32 = 100;
/// Growth of a process that counts as none: allocators keep memory that they have taken.
const SLACK_BYTES: u64 = 4 << 20;

/// The surroundings of a case: its device, its baseline, and other cases beside it.
pub struct CaseContext<'a> {
    pub device: &'a DeviceChoice,
    pub baseline: Option<&'a Baseline>,
    /// Other cases run on the device meanwhile, so that times mean less.
    pub is_shared: bool,
}

/// Why the rest of a case cannot be tried.
pub struct Abort {
    pub verdict: Verdict,
    pub why: String,
}

impl Abort {
    fn fail(why: impl Into<String>) -> Self {
        Self { verdict: Verdict::Fail, why: format!("drawing: {}", why.into()) }
    }
}

impl From<gpu::Error> for Abort {
    fn from(error: gpu::Error) -> Self {
        let why = with_causes(&error);
        match error {
            gpu::Error::DeviceLost { .. } => Self { verdict: Verdict::Lost, why },
            gpu::Error::OutOfMemory { .. } => Self { verdict: Verdict::OutOfMemory, why },
            gpu::Error::TooLarge { .. } | gpu::Error::Unsupported(_) | gpu::Error::MissingLayer { .. } => {
                Self { verdict: Verdict::Skip, why }
            }
            _ => Self::fail(why),
        }
    }
}

impl From<frame::Error> for Abort {
    fn from(error: frame::Error) -> Self {
        match error {
            frame::Error::Gpu(error) => error.into(),
            frame::Error::Plan(error) => Self::fail(error.to_string()),
        }
    }
}

impl From<scene::Error> for Abort {
    fn from(error: scene::Error) -> Self {
        Self::fail(with_causes(&error))
    }
}

/// A case's scene, moment and settings.
pub struct CaseSetup {
    pub scene: Scene,
    pub playing: Playing,
    pub settings: Settings,
}

impl CaseSetup {
    /// Opens the scene and decides the settings.
    pub fn open(case: &SuiteCase) -> Result<Self, Abort> {
        let patch: SettingsPatch =
            case.settings.parse().map_err(|error: scene::Error| Abort::fail(error.to_string()))?;
        let size = patch.size.unwrap_or(Subject::SIZE);
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let options = OpenOptions { aspect, ..OpenOptions::default() };
        let scene = match &case.scene {
            SceneSource::Named(name) => scene::open(name, &options)?,
            SceneSource::Text { text, folder } => {
                file::parse(text, &folder.join(format!("{}.toml", case.name)), &options)?
            }
        };
        scene.check()?;
        let sized = SettingsPatch { size: Some(size), ..SettingsPatch::default() };
        let mut settings = patch.or(&sized).or(&scene.settings).decide();
        let playing = Playing::at(case.time);
        if scene.moves() && settings.output != Output::Nits && settings.exposure.is_none() {
            settings.exposure = Some(metered_ev100(&scene.at(&playing)));
        }
        Ok(Self { scene, playing, settings })
    }

    /// Returns the plan, or the reason for having none: the device lacks something, or the case's settings do not go together.
    fn plan(&self, device: &Device) -> Result<FramePlan, Abort> {
        let of = |device: &Capabilities| plan_with(device, &self.scene, &self.settings);
        of(&capabilities(&device.physical)).map_err(|error: plan::PlanError| match of(&Capabilities::ample()) {
            Ok(_) => Abort { verdict: Verdict::Skip, why: error.to_string() },
            Err(_) => Abort::fail(error.to_string()),
        })
    }

    pub fn renderer(&self, device: &Arc<Device>) -> Result<Renderer, Abort> {
        Ok(Renderer::new(device, &self.scene, &self.settings)?)
    }

    pub fn picture(&self, renderer: &mut Renderer) -> Result<Picture, Abort> {
        let mut pose = Pose::default();
        let show = |renderer: &mut Renderer, seconds: f64| -> Result<_, frame::Error> {
            if !self.scene.moves() {
                return Ok(self.scene.camera);
            }
            self.scene.motion.pose_into(&self.playing.with_time(self.playing.time + seconds), &mut pose);
            renderer.pose(&self.scene, &pose)?;
            Ok(self.scene.looks_through.map_or(self.scene.camera, |index| pose.camera(&self.scene, index)))
        };
        Ok(renderer.picture_while(show, || {})?)
    }
}

/// Makes all checks of the case.
pub fn examine(case: &SuiteCase, context: &CaseContext, evidence: &EvidenceFolder) -> CaseReport {
    let begun = Instant::now();
    let mut report = CaseReport::new(&case.name);
    if let Err(Abort { verdict, why }) = try_all(case, context, evidence, &mut report)
        && (report.verdict == Verdict::Pass || verdict == Verdict::Lost)
    {
        report.verdict = verdict;
        report.reason = Some(why);
    }
    report.seconds = begun.elapsed().as_secs_f64();
    report
}

fn try_all(
    case: &SuiteCase,
    context: &CaseContext,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) -> Result<(), Abort> {
    evidence.write(super::evidence::SUITE, super::suite::alone(case, None).as_bytes());
    evidence.write("environment.txt", super::evidence::environment().as_bytes());
    if let Some(baseline) = context.baseline {
        evidence.baseline(baseline, &case.name);
    }
    let drawing = CaseSetup::open(case).inspect_err(|_| evidence.scene_files(&case.scene.named_file()))?;
    evidence.scene_files(&drawing.scene.files);
    let first = unobserved(case, context, &drawing, evidence, report)?;
    for &mode in &case.holds.validate {
        observed(mode, context, &drawing, &first, evidence, report)?;
    }
    window::show(case, context, &drawing, &first, evidence, report)?;
    if case.holds.resizes > 0 {
        resizes::storm(case.holds.resizes, context, &drawing, evidence, report)?;
    }
    Ok(())
}

/// Makes all checks that need no layer, and returns the first picture.
fn unobserved(
    case: &SuiteCase,
    context: &CaseContext,
    setup: &CaseSetup,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) -> Result<Picture, Abort> {
    let picture = with_device(CaseStage { mode: None, shows: None }, context, evidence, report, |device, report| {
        evidence.of_device(device);
        let plan = setup.plan(device)?;
        evidence.of_plan(&plan, setup, device);
        device.keep_shaders();
        let mut renderer = setup.renderer(device)?;
        evidence.shaders(device.take_shaders());
        let picture = setup.picture(&mut renderer)?;
        evidence.picture("picture.png", &picture);
        report.picture = Some(hash(&picture));
        report.gpu_ms = gpu_ms(setup, &mut renderer)?;
        drop(renderer);
        identical(case, setup, device, &picture, evidence, report)?;
        against_baseline(case, context, &picture, evidence, report);
        if let Some(bound) = case.holds.slower {
            time(bound, case, context, report);
        }
        if case.holds.steady_frames > 0 {
            steady(case.holds.steady_frames, setup, device, report)?;
        }
        if let Some(own) = &case.holds.soak {
            soak::soak(own, context, setup, device, (evidence, report))?;
        }
        if let Some(truth) = &case.holds.truth {
            against_truth(truth, setup, device, evidence, report)?;
        }
        Ok(picture)
    })?;
    // A stage without the layer is never skipped.
    picture.ok_or_else(|| Abort::fail("there is no device"))
}

/// One picture while the layer checks.
fn observed(
    mode: ValidationMode,
    context: &CaseContext,
    setup: &CaseSetup,
    first: &Picture,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) -> Result<(), Abort> {
    let picture = with_device(CaseStage { mode: Some(mode), shows: None }, context, evidence, report, |device, _| {
        let mut renderer = setup.renderer(device)?;
        // The second picture finds the first one's data in targets and buffers.
        setup.picture(&mut renderer)?;
        setup.picture(&mut renderer)
    })?;
    let Some(picture) = picture else { return Ok(()) };
    // GPU-assisted validation adds code to shaders, which may change their rounding.
    if mode != ValidationMode::GpuAssisted && setup.settings.frames_over_time().is_none() {
        let differ = differing(first, &picture);
        if differ > 0 {
            evidence.picture(&format!("picture-{}.png", mode.name()), &picture);
            let detail =
                format!("the picture differs in {} while the layer checks ({})", counted(differ, "pixel"), mode.name());
            report.hold(CheckKind::Determinism, false, detail);
        }
    }
    Ok(())
}

fn identical(
    case: &SuiteCase,
    setup: &CaseSetup,
    device: &Arc<Device>,
    first: &Picture,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) -> Result<(), Abort> {
    let count = case.holds.identical;
    for index in 1..count {
        let picture = setup.picture(&mut setup.renderer(device)?)?;
        let differ = differing(first, &picture);
        if differ > 0 {
            evidence.picture("picture-again.png", &picture);
            let detail =
                format!("picture {} of {count} differs from the first in {}", index + 1, counted(differ, "pixel"));
            report.hold(CheckKind::Determinism, false, detail);
            return Ok(());
        }
    }
    if count > 1 {
        report.hold(CheckKind::Determinism, true, format!("{count} pictures are equal to the byte"));
    }
    let Some(other) = &case.holds.alike else { return Ok(()) };
    let patch: SettingsPatch = other.parse().map_err(|error: scene::Error| Abort::fail(error.to_string()))?;
    let settings = patch.or(&setup.settings.patch()).decide();
    let picture = setup.picture(&mut Renderer::new(device, &setup.scene, &settings)?)?;
    let differ = differing(first, &picture);
    if differ > 0 {
        evidence.picture("picture-alike.png", &picture);
    }
    let detail = match differ {
        0 => format!("the picture of {other} is equal to the byte"),
        _ => format!("the picture of {other} differs in {}", counted(differ, "pixel")),
    };
    report.hold(CheckKind::Determinism, differ == 0, detail);
    Ok(())
}

/// Compares with the baseline's picture, which is kept with the difference: a case that fails in another check can be looked at beside it.
fn against_baseline(
    case: &SuiteCase,
    context: &CaseContext,
    picture: &Picture,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) {
    let Some(baseline) = context.baseline else { return };
    let compared = baseline.picture(&case.name).and_then(|expected| {
        let pair = expected.zip(super::evidence::shown(picture));
        let Some((expected, actual)) = pair else { return Ok(None) };
        evidence.shown("baseline.png", &expected);
        let map = flip(&actual, &expected).map_err(|mismatch| mismatch.to_string())?;
        evidence.shown("difference.png", &map.heat());
        Ok(Some(map.mean()))
    });
    let Some(bound) = case.holds.flip else { return };
    match compared {
        Ok(Some(mean)) => {
            report.hold(
                CheckKind::Picture,
                mean <= bound,
                format!("FLIP {mean:.4} against the baseline, at most {bound}"),
            );
        }
        Ok(None) if super::evidence::shown(picture).is_none() => {
            report.skip(CheckKind::Picture, "the picture holds linear light");
        }
        Ok(None) => {
            report.skip(CheckKind::Picture, baseline.missing().unwrap_or("the baseline has no picture of this case"));
        }
        Err(why) => report.hold(CheckKind::Picture, false, why),
    }
}

/// Median of the device's time for a frame.
fn gpu_ms(setup: &CaseSetup, renderer: &mut Renderer) -> Result<Option<f64>, Abort> {
    let mut times = Vec::new();
    for _ in 0..TIMED_FRAMES {
        renderer.render(&setup.scene.camera)?;
        times.extend(renderer.wait()?.gpu_ms);
    }
    Ok(Distribution::of(times).map(|times| times.median))
}

fn time(bound: f64, case: &SuiteCase, context: &CaseContext, report: &mut CaseReport) {
    if context.is_shared {
        return report
            .skip(CheckKind::Time, "other cases use the device meanwhile: --jobs 1 gives times that mean something");
    }
    let before = context.baseline.and_then(|baseline| baseline.gpu_ms(&case.name));
    let (Some(before), Some(now)) = (before, report.gpu_ms) else {
        return report.skip(CheckKind::Time, "the baseline or the device has no time");
    };
    let detail =
        format!("{now:.3} ms a frame on the device, {:.2} times the baseline's; at most {bound}", now / before);
    report.hold(CheckKind::Time, now <= before * bound, detail);
}

/// Memory that is held at some frame.
struct MemorySample {
    bytes: u64,
    objects: BTreeMap<String, usize>,
    /// The resident memory of the process; `None` where the system does not tell.
    resident: Option<u64>,
}

impl MemorySample {
    fn by(device: &Device) -> Self {
        let MemoryReport { bytes, objects, .. } = device.memory_report();
        Self { bytes, objects, resident: resident_memory_bytes() }
    }

    /// Judges the memory that is held `frames` later, when nothing but allocators of the process may have kept a little more.
    fn hold_until(&self, later: &Self, frames: u32, report: &mut CaseReport) {
        let grown = self.resident.zip(later.resident).map_or(0, |(before, now)| now.saturating_sub(before));
        let is_same = self.bytes == later.bytes && self.objects == later.objects;
        let detail = format!(
            "over {} the device's memory went from {} to {}, its objects from {} to {}, the process's grew by {}",
            counted(frames, "frame"),
            bytes(self.bytes),
            bytes(later.bytes),
            self.objects.values().sum::<usize>(),
            later.objects.values().sum::<usize>(),
            bytes(grown)
        );
        report.hold(CheckKind::Memory, is_same && grown <= SLACK_BYTES, detail);
    }
}

fn steady(frames: u32, setup: &CaseSetup, device: &Arc<Device>, report: &mut CaseReport) -> Result<(), Abort> {
    let mut renderer = setup.renderer(device)?;
    let warm = WARM_FRAMES.min(frames / 2);
    let mut before = None;
    for frame in 0..frames {
        if frame == warm {
            renderer.wait()?;
            before = Some(MemorySample::by(device));
        }
        renderer.render(&setup.scene.camera)?;
    }
    renderer.wait()?;
    if let Some(before) = before {
        before.hold_until(&MemorySample::by(device), frames - warm, report);
    }
    Ok(())
}

fn against_truth(
    bound: &TruthTolerance,
    setup: &CaseSetup,
    device: &Arc<Device>,
    evidence: &EvidenceFolder,
    report: &mut CaseReport,
) -> Result<(), Abort> {
    let mut subject = Subject::with(setup.scene.clone(), setup.settings.patch());
    let truth = if setup.scene.moves() {
        subject.playing = Some(setup.playing.clone());
        setup.scene.at(&setup.playing).into_owned()
    } else {
        setup.scene.clone()
    };
    let (errors, seen) = match stress::compare(device, &subject, &truth) {
        Ok(compared) => compared,
        Err(stress::StressError::Refused(why)) => {
            report.hold(CheckKind::Truth, false, format!("there is none: {why}"));
            return Ok(());
        }
        Err(stress::StressError::Frame(error)) => return Err(error.into()),
    };
    let elsewhere = errors.elsewhere_share();
    // ANCHOR: truth
    let is_sane = errors.not_finite == 0 && errors.negative == 0;
    let holds = is_sane
        && errors.mean <= bound.mean
        && errors.worst <= bound.worst.unwrap_or(f64::MAX)
        && elsewhere <= bound.elsewhere;
    // ANCHOR_END: truth
    let at_most = |bound: Option<f64>| bound.map_or_else(String::new, |bound| format!(" (at most {bound})"));
    let detail = format!(
        "mean error {:.4}{}, worst {:.3}{}, {:.1}% elsewhere{}{}",
        errors.mean,
        at_most(Some(bound.mean)),
        errors.worst,
        at_most(bound.worst),
        100.0 * elsewhere,
        at_most(Some(bound.elsewhere)),
        if is_sane { "" } else { ", and values that are negative or no number" }
    );
    report.hold(CheckKind::Truth, holds, detail);
    evidence.compared(&seen);
    Ok(())
}

fn hash(picture: &Picture) -> String {
    let bytes: &[u8] = match &picture.pixels {
        Pixels::Srgb8(bytes) => bytes,
        Pixels::LinearF32(light) => bytemuck::cast_slice(light),
    };
    blake3::hash(bytes).to_hex().to_string()
}

/// The names of a plan's dependencies, for a bundle.
pub fn dependencies(plan: &FramePlan) -> String {
    rows::table(plan).iter().map(|edge| format!("  {}: {} -> {}\n", edge.name, edge.from, edge.to)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_grows_fails_the_case_and_what_an_allocator_keeps_does_not() {
        let held = |bytes, images, resident| MemorySample {
            bytes,
            objects: [("IMAGE".to_owned(), images), ("BUFFER".to_owned(), 2)].into(),
            resident,
        };
        let judged = |later: MemorySample| {
            let mut report = CaseReport::new("a.b");
            held(4096, 7, Some(1 << 30)).hold_until(&later, 900, &mut report);
            report
        };
        for steady in [held(4096, 7, Some((1 << 30) + SLACK_BYTES)), held(4096, 7, Some(1 << 20)), held(4096, 7, None)]
        {
            assert_eq!(judged(steady).verdict, Verdict::Pass);
        }
        for (grown, told) in [
            (held(8192, 7, Some(1 << 30)), "memory went from 4.0 KiB to 8.0 KiB"),
            (held(4096, 8, Some(1 << 30)), "its objects from 9 to 10"),
            (held(4096, 6, Some(1 << 30)), "its objects from 9 to 8"),
            (held(4096, 7, Some((1 << 30) + 2 * SLACK_BYTES)), "the process's grew by 8.0 MiB"),
        ] {
            let report = judged(grown);
            let reason = report.reason.unwrap_or_default();
            assert_eq!(report.verdict, Verdict::Fail, "{told}");
            assert!(reason.starts_with("memory: over 900 frames ") && reason.contains(told), "{reason}");
        }
    }
}
