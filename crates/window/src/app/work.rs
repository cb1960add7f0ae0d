//! Signs of work: over the picture before a frame that takes long, and while something is computed in the background.

use std::time::{Duration, Instant};

use winit::dpi::PhysicalSize;

use super::{App, CopyPurposes, Opened};
use crate::Error;
use crate::resolution::PictureMotion;

/// A frame that takes longer is announced by a sign over the picture before.
const LONG: Duration = Duration::from_millis(500);

impl App<'_> {
    /// The motion of the picture that the next frame shows.
    pub(super) fn motion(&self, copies: CopyPurposes) -> PictureMotion {
        let Some(Opened { interface, .. }) = &self.opened else { return PictureMotion::Rests };
        let whole = copies.kept || copies.compared || interface.is_comparing() || interface.stepper().is_open();
        match self.live.player.runs() || self.control.is_moving(self.held) || self.has_changed {
            _ if whole => PictureMotion::Kept,
            true => PictureMotion::Moves,
            false => PictureMotion::Rests,
        }
    }

    /// Shows the last picture with a sign over it, where the frame to come takes long: that frame is drawn next. False where nothing is to be
    /// announced.
    pub(super) fn announce(&mut self, now: Instant) -> Result<bool, Error> {
        if std::mem::take(&mut self.is_announced) {
            return Ok(false);
        }
        let Some(sign) = self.long_work(now) else { return Ok(false) };
        let panels = self.show_panels(now, Some(&sign));
        let Some(Opened { window, presenter, interface, .. }) = &mut self.opened else { return Ok(false) };
        let mut panels = panels.unwrap_or_default();
        interface.send_textures(&mut panels, presenter);
        window.pre_present_notify();
        presenter.divide_at(interface.divider.at());
        presenter.show_again(false, Some(&panels))?;
        interface.drawn();
        self.teller.shown();
        self.is_announced = true;
        self.ask_for_frame();
        Ok(true)
    }

    /// A sign for the frame to come, if that takes long.
    fn long_work(&mut self, now: Instant) -> Option<String> {
        let Some(Opened { window, presenter, .. }) = &self.opened else { return None };
        let is_measured = self.options.frames.is_some();
        if is_measured || !self.teller.shows || self.unfit || self.misfit || self.hidden {
            return None;
        }
        // Frames that are averaged over time follow each other: a sign before each would double them.
        if !presenter.has_picture() || presenter.converges() {
            return None;
        }
        let (camera, copies) = (self.control.camera(), CopyPurposes { kept: self.screenshot, compared: self.compare });
        let PhysicalSize { width, height } = window.inner_size();
        let size = presenter.plan()?.size;
        let pixels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
        let (took, whole) = (presenter.last_took(), pixels([width, height]));
        if let Some(took) = took.filter(|_| size == [width, height]) {
            self.whole_took = Some((took, whole));
        }
        let is_drawn = size == [width, height] && presenter.keeps(camera);
        // Pictures that move are coarse, or follow each other.
        let is_whole = self.resolution.is_whole(now, camera, self.motion(copies)) && !self.control.is_moving(self.held);
        let what = match (self.light, is_whole && !is_drawn) {
            (true, _) => "the light of the picture is drawn",
            (false, true) => "the picture is drawn",
            (false, false) => return None,
        };
        // A frame that is not done yet has taken long already.
        let Some(took) = took else { return Some(format!("{what}...")) };
        let (took, before) = self.whole_took.unwrap_or((took, pixels(size)));
        let expected = took.mul_f64(whole / before);
        // A coarse picture says little about a whole one: each of its pixels costs more, and the first frame of all waits for the driver's compiler.
        let seconds = expected.as_secs_f64().round();
        (expected >= LONG).then(|| match self.whole_took {
            Some(_) if seconds >= 1.0 => format!("{what}, about {seconds} s..."),
            _ => format!("{what}..."),
        })
    }

    /// The sign of work in the background, and the moment at which it is due if it is not yet.
    pub(super) fn background_work(&mut self, now: Instant) -> (Option<&'static str>, Option<Instant>) {
        if !self.teller.shows {
            return (None, None);
        }
        let Some(Opened { presenter, interface, .. }) = &self.opened else { return (None, None) };
        let is_reading = self.watch.as_ref().is_some_and(|watch| watch.is_reading());
        let work = match (presenter.is_pending(), interface.is_picking()) {
            (true, _) => Some("frames of other settings are made..."),
            (false, true) => Some("the object at that place is looked for..."),
            // A comparison has a panel, which says so.
            (false, false) => is_reading.then_some("changed files are read..."),
        };
        self.busy.sign(work, now)
    }
}
