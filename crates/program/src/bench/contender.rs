//! One variant of the settings, with its renderer and its measurements.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::rows::Rows;
use afterlight::frame::{Error, FrameTimes, Renderer};
use afterlight::gpu::{Device, MemoryKind};
use afterlight::scene::{Camera, Pose, Scene, Settings};
use afterlight_truth::measure::{WarmUp, settle};

use crate::failure::Failure;
use crate::workload::{Workload, milliseconds_since};

/// A renderer that takes its turns.
pub struct Contender {
    pub name: String,
    pub settings: Settings,
    /// Time from a scene in memory to its first picture: uploads, pipelines and the frame.
    pub first_frame_ms: f64,
    /// Memory that this renderer allocated on the device, by kind, in bytes.
    pub memory: BTreeMap<MemoryKind, u64>,
    pub renderer: Renderer,
    /// Times of each measured frame.
    pub times: Vec<FrameTimes>,
}

impl Contender {
    /// Makes the renderer and draws its first frame.
    pub fn new(name: &str, device: &Arc<Device>, workload: &Workload, settings: Settings) -> Result<Self, Failure> {
        Self::of(name, device, workload, settings, |settings| Renderer::new(device, &workload.scene, settings))
    }

    /// As [`Contender::new`], with other dependencies than the plan's.
    ///
    /// # Safety
    /// As of [`Renderer::with_rows`].
    pub unsafe fn with_rows(
        name: &str,
        device: &Arc<Device>,
        workload: &Workload,
        settings: Settings,
        rows: Rows,
    ) -> Result<Self, Failure> {
        // SAFETY: the caller's promise.
        let make = |settings: &Settings| unsafe { Renderer::with_rows(device, &workload.scene, settings, rows) };
        Self::of(name, device, workload, settings, make)
    }

    fn of(
        name: &str,
        device: &Arc<Device>,
        workload: &Workload,
        settings: Settings,
        make: impl FnOnce(&Settings) -> Result<Renderer, Error>,
    ) -> Result<Self, Failure> {
        let before = memory_by_kind(device);
        let start = Instant::now();
        let renderer = make(&settings);
        let mut renderer = renderer.map_err(|error| workload.blame(error, &device.physical, &settings))?;
        workload.warn(renderer.plan())?;
        renderer.render(&workload.scene.camera)?;
        renderer.wait()?;
        let first_frame_ms = milliseconds_since(start);
        let mut memory = memory_by_kind(device);
        for (kind, bytes) in &mut memory {
            *bytes = bytes.saturating_sub(before.get(kind).copied().unwrap_or(0));
        }
        memory.retain(|_, bytes| *bytes > 0);
        Ok(Self { name: name.to_owned(), settings, first_frame_ms, memory, renderer, times: Vec::new() })
    }

    /// Has the next frames show a moment of the scene's clips.
    pub fn pose(&mut self, scene: &Scene, pose: &Pose) -> Result<(), Failure> {
        self.renderer.pose(scene, pose)?;
        Ok(())
    }

    /// Draws one frame and waits for it, so that no frame of another contender runs beside it. Returns its time by the clock that counts, in
    /// milliseconds.
    pub fn draw(&mut self, camera: &Camera, measured: bool) -> Result<f64, Failure> {
        self.renderer.render(camera)?;
        let times = self.renderer.wait()?;
        let own = decisive(&times, self.renderer.plan().software);
        if measured {
            self.times.push(times);
        }
        Ok(own)
    }
}

impl Contender {
    /// Draws frames one after the other, as many in flight as there may be, and waits for the last. Returns milliseconds of the clock on the wall a frame.
    pub fn draw_in_a_row(&mut self, camera: &Camera, frames: u32) -> Result<f64, Failure> {
        let start = Instant::now();
        for _ in 0..frames {
            self.renderer.render(camera)?;
        }
        self.renderer.wait()?;
        Ok(milliseconds_since(start) / f64::from(frames))
    }
}

/// The device's own time, where it means something.
pub fn decisive(times: &FrameTimes, software: bool) -> f64 {
    times.gpu_ms.filter(|_| !software).unwrap_or(times.wall_ms)
}

/// Draws frames of all in turn until their times have settled.
pub fn settled(contenders: &mut [&mut Contender], camera: &Camera) -> Result<WarmUp, Failure> {
    let software = contenders.first().is_none_or(|first| first.renderer.plan().software);
    settle(software, 1, || {
        contenders.iter_mut().map(|contender| contender.draw(camera, false)).sum::<Result<f64, Failure>>()
    })
}

/// Draws frames of all in turn before they are measured: as many as `--warmup` has, or until their times have settled. Stores this warm-up in `before`,
/// unless clocks moved in an earlier one.
pub fn warm_up(
    contenders: &mut [&mut Contender],
    camera: &Camera,
    frames: Option<u32>,
    before: &mut Option<WarmUp>,
) -> Result<(), Failure> {
    for _ in 0..frames.unwrap_or(0) {
        contenders.iter_mut().try_for_each(|contender| contender.draw(camera, false).map(drop))?;
    }
    if frames.is_none() {
        let settled = settled(contenders, camera)?;
        if before.is_none_or(|before| before.settled) {
            *before = Some(settled);
        }
    }
    Ok(())
}

fn memory_by_kind(device: &Device) -> BTreeMap<MemoryKind, u64> {
    // Retired objects that are not yet destroyed would count for the next contender.
    device.collect();
    device.memory_report().kinds.into_iter().map(|(kind, report)| (kind, report.bytes)).collect()
}
