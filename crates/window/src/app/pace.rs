//! The resolution of a window's frames, and the times in its title.

use std::time::{Duration, Instant};

use winit::dpi::PhysicalSize;

use super::{App, CopyPurposes, Opened};
use crate::Error;
use afterlight::scene::Scene;

impl Opened {
    /// Size of the picture, if it is smaller than the window.
    fn coarse_size(&self) -> Option<[u32; 2]> {
        let PhysicalSize { width, height } = self.window.inner_size();
        self.presenter.plan().map(|plan| plan.size).filter(|size| size[0] < width || size[1] < height)
    }
}

impl App<'_> {
    /// Chooses the resolution of the next picture. Pictures that are kept or compared are not reduced, nor are the pictures of a frame in steps.
    pub(super) fn choose_resolution(&mut self, now: Instant, copies: CopyPurposes) -> Result<(), Error> {
        let motion = self.motion(copies);
        let Some(Opened { presenter, .. }) = &mut self.opened else { return Ok(()) };
        let times = presenter.times();
        let took = Duration::from_secs_f64((times.record_ms + times.gpu_ms.unwrap_or(0.0)) * 1e-3);
        let (share, rests) = self.resolution.choose(now, self.control.camera(), motion, took);
        match presenter.set_resolution(share)? {
            true => self.again = [self.again, rests].into_iter().flatten().min(),
            false => self.resolution.forget_times(),
        }
        Ok(())
    }

    pub(super) fn switch_resolution(&mut self) {
        let told = match (self.options.dynamic_resolution, self.resolution.follows) {
            (false, _) => "resolution: always the window's; --dynamic-resolution on lets it follow the time of frames",
            (true, true) => "resolution: always the window's",
            (true, false) => "resolution: follows the time of frames while something moves",
        };
        if self.options.dynamic_resolution {
            self.resolution.switch();
        }
        self.teller.tell(told);
    }

    /// Tells the times now and then, and at once when the picture is coarser or finer than before.
    pub(super) fn write_title(&mut self) {
        let Some(opened) = &self.opened else { return };
        let (interval, coarse) = (self.clock.tells(Instant::now()), opened.coarse_size());
        if let Some(interval) = interval {
            let times = opened.presenter.times();
            let gpu = times.gpu_ms.map(|ms| format!(", GPU {ms:.2}")).unwrap_or_default();
            self.told_times = Some(format!("{interval:.2} ms a frame, CPU {:.2}{gpu}", times.record_ms));
        }
        let is_first = self.is_opening && self.clock.frames() > 0;
        if interval.is_some() || coarse != self.told_coarse || is_first {
            (self.told_coarse, self.is_opening) = (coarse, false);
            let coarse = coarse.map(|[width, height]| format!("{width}x{height} pixels"));
            let told: Vec<&str> = [&self.told_times, &coarse].into_iter().filter_map(Option::as_deref).collect();
            opened.window.set_title(&title(&self.live.scene, (!told.is_empty()).then(|| told.join(", ")).as_deref()));
        }
    }
}

pub(super) fn title(scene: &Scene, times: Option<&str>) -> String {
    let times = times.map(|times| format!(" - {times}")).unwrap_or_default();
    format!("{} - Afterlight{times}", scene.name)
}
