//! Measures the figures that `auto` chooses by: each light path with few lights and with many, and both ways to cull, as frames of built-in scenes
//! that take turns.
//!
//! Only ratios of the figures matter, so that other work on the machine does no harm as long as it hits all contenders alike.

use std::sync::Arc;

use afterlight::frame::calibration::Calibration;
use afterlight::frame::{Error, FrameTimes, Renderer};
use afterlight::gpu::{Device, vk};
use afterlight::plan::{COMPARED, CullingCost, PathCost};
use afterlight::scene::{Camera, Culling, LightPath, OpenOptions, Scene, Settings, ShadowSettings, open};
use afterlight_truth::measure::{Distribution, WarmUp, settle};

/// Pixels of a measured frame: enough that a GPU's time is theirs, and few enough that a CPU is done in seconds.
const SIZE: [[u32; 2]; 2] = [[1920, 1080], [480, 270]];
/// Frames of each contender that count, on GPUs and on CPUs.
const ROUNDS: [usize; 2] = [25, 11];

/// Lights of the scenes for light paths: a few and many that reach everywhere, a few and many of limited reach.
const UNLIMITED: [u32; 2] = [1, 33];
const LIMITED: [u32; 2] = [4, 68];
/// The number of scenes that all light paths draw, and the index of the first with lights of limited reach.
const SCENES: usize = 5;
const FIRST_LIMITED: usize = 3;
/// Objects of the scenes for culling, half of which lie behind two walls.
const OBJECTS: [u32; 2] = [1024, 8192];

/// One scene that is drawn with one choice, and the times of its frames.
struct CalibrationRun {
    renderer: Renderer,
    camera: Camera,
    times: Vec<FrameTimes>,
}

impl CalibrationRun {
    fn new(device: &Arc<Device>, scene: &Scene, settings: &Settings) -> Result<Self, Error> {
        Ok(Self { renderer: Renderer::new(device, scene, settings)?, camera: scene.camera, times: Vec::new() })
    }

    fn draw(&mut self) -> Result<FrameTimes, Error> {
        self.renderer.render(&self.camera)?;
        self.renderer.wait()
    }

    fn median(&self, of: impl Fn(&FrameTimes) -> f64) -> f64 {
        Distribution::of(self.times.iter().map(of)).map_or(f64::NAN, |times| times.median)
    }

    /// The run's time over another run's in the same rounds.
    fn ratio(&self, other: &Self) -> f64 {
        let ratios = self.times.iter().zip(&other.times).map(|(own, other)| whole(own) / whole(other));
        Distribution::of(ratios).map_or(f64::NAN, |ratios| ratios.median)
    }
}

/// Measures the device, and returns the warm-up before its frames too: one of clocks that never settled, if there was one. `step` is told how much is
/// done of how much.
///
/// # Errors
/// When the device fails, or lacks the memory for five frames of 1920x1080.
pub fn measure(
    device: &Arc<Device>,
    asked: bool,
    step: &mut dyn FnMut(usize, usize),
) -> Result<(Calibration, Option<WarmUp>), Error> {
    let mut warm_up = None;
    let software = device.physical.kind == vk::PhysicalDeviceType::CPU;
    let size = SIZE[usize::from(software)];
    let rounds = ROUNDS[usize::from(software)];
    let all = SCENES + if software { 0 } else { OBJECTS.len() };
    let first = open(&scenes()[0], &OpenOptions::default())?;
    let mut anchor = CalibrationRun::new(device, &first, &settings(size, LightPath::Loop, Culling::Cpu))?;
    let mut anchored = Vec::new();
    let mut triangles = [0.0; SCENES];
    // Times over the anchor's in the same rounds, by scene and path.
    let mut ratios = [[f64::NAN; COMPARED.len()]; SCENES];
    for (index, spec) in scenes().iter().enumerate() {
        let scene = open(spec, &OpenOptions::default())?;
        triangles[index] = scene.triangle_count() as f64;
        let contender = |light_path| {
            // Without lights of limited reach, the clustered path is the loop, command by command.
            match light_path == LightPath::Clustered && index < FIRST_LIMITED {
                true => Ok(None),
                false => of_device(CalibrationRun::new(device, &scene, &settings(size, light_path, Culling::Cpu))),
            }
        };
        let mut own = COMPARED.into_iter().map(contender).collect::<Result<Vec<_>, _>>()?;
        take_turns(&mut anchor, &mut own, rounds, &mut warm_up)?;
        for (path, own) in own.iter().enumerate() {
            ratios[index][path] = own.as_ref().map_or(f64::NAN, |own| own.ratio(&anchor));
        }
        if index < FIRST_LIMITED {
            ratios[index][1] = ratios[index][0];
        }
        anchored.append(&mut anchor.times);
        step(index + 1, all);
    }
    let anchor_ms = Distribution::of(anchored.iter().map(whole)).map_or(f64::NAN, |times| times.median);
    let mut by_culling = Vec::new();
    for (index, count) in OBJECTS.into_iter().enumerate().filter(|_| !software) {
        let scene = open(&format!("builtin:field?objects={count}&lights=1&screens=2"), &OpenOptions::default())?;
        let contender =
            |culling| of_device(CalibrationRun::new(device, &scene, &settings(size, LightPath::Loop, culling)));
        let mut own = [Culling::Cpu, Culling::Gpu].into_iter().map(contender).collect::<Result<Vec<_>, _>>()?;
        take_turns(&mut anchor, &mut own, rounds, &mut warm_up)?;
        by_culling.append(&mut own);
        step(SCENES + index + 1, all);
    }
    let frames = FrameLoad { pixels: f64::from(size[0]) * f64::from(size[1]), triangles: [triangles[0], triangles[2]] };
    let times_of = |path: usize| ratios.map(|of_scene| of_scene[path] * anchor_ms * 1e9);
    let looped = times_of(0);
    let paths = std::array::from_fn(|path| frames.cost(times_of(path), looped));
    Ok((Calibration::new(asked, paths, culling_cost(&by_culling)), warm_up))
}

/// Draws frames of all in turn, so that a slow moment of the machine slows all of them. Stores the warm-up of these frames in `warm_up`, unless clocks
/// moved in an earlier one.
fn take_turns(
    anchor: &mut CalibrationRun,
    own: &mut [Option<CalibrationRun>],
    rounds: usize,
    warm_up: &mut Option<WarmUp>,
) -> Result<(), Error> {
    anchor.times.clear();
    let mut all: Vec<&mut CalibrationRun> = std::iter::once(&mut *anchor).chain(own.iter_mut().flatten()).collect();
    let software = all[0].renderer.plan().software;
    let settled = settle(software, 1, || {
        all.iter_mut().map(|contender| contender.draw().map(|times| whole(&times))).sum::<Result<f64, Error>>()
    })?;
    if warm_up.is_none_or(|before| before.settled) {
        *warm_up = Some(settled);
    }
    for _ in 0..rounds {
        for contender in &mut all {
            let times = contender.draw()?;
            contender.times.push(times);
        }
    }
    Ok(())
}

/// Pixels and triangles of the frames of [`scenes`].
struct FrameLoad {
    pixels: f64,
    /// The triangle counts of the first scene and of the detailed one.
    triangles: [f64; 2],
}

impl FrameLoad {
    /// Solves for a path's figures from the times of the scenes, in picoseconds. The scenes with limited lights also differ otherwise; the loop's times in both
    /// tell that difference apart from the cost of lists. `None` where nothing was measured.
    fn cost(&self, times: [f64; SCENES], looped: [f64; SCENES]) -> Option<PathCost> {
        let each = |[few, many]: [u32; 2], less: f64, more: f64| ((more - less) / f64::from(many - few)).max(0.0);
        let figures = |times: [f64; SCENES]| {
            let [one, many, detailed, few_limited, many_limited] = times.map(|time| time / self.pixels);
            let (unlimited, limited) = (each(UNLIMITED, one, many), each(LIMITED, few_limited, many_limited));
            let without = one - f64::from(UNLIMITED[0]) * unlimited;
            let triangle = ((detailed - one) * self.pixels / (self.triangles[1] - self.triangles[0])).max(0.0);
            (without, triangle, unlimited, limited, few_limited - f64::from(LIMITED[0]) * limited)
        };
        let (without, triangle, unlimited, limited, with_lists) = figures(times);
        let (loop_without, .., loop_with_lists) = figures(looped);
        let lists = (with_lists - loop_with_lists - (without - loop_without)).max(0.0);
        let base = (without - triangle * self.triangles[0] / self.pixels).max(0.0);
        let all = [base, triangle, lists, unlimited, limited];
        // A base of the largest number means that there is no such path.
        let is_measured = all.iter().all(|value| value.is_finite() && *value < 4e9) && without > 0.0;
        is_measured.then(|| {
            let [base, triangle, lists, unlimited, limited] = all.map(|value| value.round() as u32);
            PathCost { base, triangle, lists, unlimited, limited }
        })
    }
}

/// A frame's time in milliseconds, by the device's clock if it has one.
fn whole(times: &FrameTimes) -> f64 {
    times.gpu_ms.unwrap_or(times.wall_ms)
}

/// Solves for the figures of culling from few objects culled by the CPU and by the device, and from many.
fn culling_cost(contenders: &[Option<CalibrationRun>]) -> Option<CullingCost> {
    let [Some(few_cpu), Some(few_device), Some(many_cpu), Some(many_device)] = contenders else { return None };
    // Wall clocks have the recording in them.
    few_cpu.times.first()?.gpu_ms?;
    // The costs are in nanoseconds. The device's longer frame counts as its cost of culling; objects that only the device finds hidden shorten the
    // frame, and so reduce that cost.
    let on_cpu = |contender: &CalibrationRun| 1e6 * contender.median(|times| times.record_ms);
    let on_device = |cpu: &CalibrationRun, device: &CalibrationRun| {
        let more = device.median(whole) - cpu.median(whole);
        on_cpu(device) + 1e6 * more
    };
    let [few, many] = OBJECTS.map(f64::from);
    let line = |less: f64, more: f64| {
        let each = ((more - less) / (many - few)).max(0.0);
        (less - few * each, each)
    };
    let (cpu_frame, cpu_object) = line(on_cpu(few_cpu), on_cpu(many_cpu));
    let (device_frame, device_object) = line(on_device(few_cpu, few_device), on_device(many_cpu, many_device));
    let whole = |value: f64| value.is_finite().then(|| value.max(0.0).round() as u32);
    Some(CullingCost {
        cpu_object: whole(cpu_object)?,
        device_frame: whole(device_frame - cpu_frame)?,
        device_object: whole(device_object)?,
    })
}

/// 290 objects before walls that fill the picture: one light, many, one with nine times as many triangles, few and many of limited reach.
fn scenes() -> [String; SCENES] {
    let lamps = |count: u32, range: f64, detail: u32| {
        format!("builtin:field?objects=290&lights={count}&range={range}&detail={detail}")
    };
    let [few, many] = LIMITED.map(|count| lamps(count, reach(count), 1));
    [lamps(UNLIMITED[0], 0.0, 1), lamps(UNLIMITED[1], 0.0, 1), lamps(UNLIMITED[0], 0.0, 3), few, many]
}

/// The range with which a place is in reach of 1.8 lights of the field, however many there are.
fn reach(count: u32) -> f64 {
    4.0 * (256.0 / f64::from(count)).cbrt()
}

fn settings(size: [u32; 2], light_path: LightPath, culling: Culling) -> Settings {
    let shadows = ShadowSettings { enabled: false, ..ShadowSettings::default() };
    Settings { size, light_path, culling, shadows, samples: 1, ..Settings::default() }
}

/// Turns a refused plan into an absent contender.
fn of_device<T>(made: Result<T, Error>) -> Result<Option<T>, Error> {
    match made {
        Ok(made) => Ok(Some(made)),
        Err(Error::Plan(_)) => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_come_back_from_the_times_that_they_make() {
        let frames = FrameLoad { pixels: 1000.0, triangles: [500.0, 4500.0] };
        // The scenes of limited lights take longer by `scene`, whatever their light path.
        let times = |known: PathCost, scene: f64| {
            let time = |triangles: f64, unlimited: u32, limited: u32| {
                let lists = if limited > 0 { f64::from(known.lists) + scene } else { 0.0 };
                let lights = f64::from(unlimited * known.unlimited + limited * known.limited);
                (f64::from(known.base) + lights + lists) * frames.pixels + triangles * f64::from(known.triangle)
            };
            let [few, many] = frames.triangles;
            let unlimited = UNLIMITED.map(|count| time(few, count, 0));
            let limited = LIMITED.map(|count| time(few, 0, count));
            [unlimited[0], unlimited[1], time(many, UNLIMITED[0], 0), limited[0], limited[1]]
        };
        let looped = PathCost { base: 5000, triangle: 80, lists: 0, unlimited: 70, limited: 20 };
        let known = PathCost { base: 9000, triangle: 300, lists: 300, unlimited: 7, limited: 2 };
        for scene in [0.0, 1234.0] {
            let of_loop = times(looped, scene);
            assert_eq!(frames.cost(times(known, scene), of_loop), Some(known));
            assert_eq!(frames.cost(of_loop, of_loop), Some(looped));
        }
        // Noise gives no negative figures, and a missing measurement gives none at all.
        let noisy = frames.cost([5e6, 4.9e6, 4.8e6, 4.7e6, 4.6e6], [5e6; SCENES]).expect("measured");
        assert_eq!((noisy.triangle, noisy.unlimited, noisy.limited, noisy.lists), (0, 0, 0, 0));
        assert_eq!(frames.cost([f64::NAN, 1.0, 1.0, 1.0, 1.0], [1.0; SCENES]), None);
    }
}
