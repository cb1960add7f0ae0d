//! Progress of long work on standard error; nothing is drawn where that is no terminal.

use std::time::Duration;

use afterlight::scene;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A spinner beside the name of what is being loaded.
pub fn loading(what: &str, quiet: bool) -> Progress {
    let bar = ProgressBar::with_draw_target(None, target(quiet)).with_message(format!("loading {what}"));
    bar.enable_steady_tick(Duration::from_millis(100));
    Progress { bar }
}

/// A bar that [`Progress::step`] fills in `steps` steps.
pub fn bar(what: String, steps: u64, quiet: bool) -> Progress {
    let bar = ProgressBar::with_draw_target(Some(steps), target(quiet)).with_message(what);
    // A template that does not parse leaves indicatif's own.
    if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    Progress { bar }
}

/// indicatif draws nothing on a stream that is no terminal.
fn target(quiet: bool) -> ProgressDrawTarget {
    if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
}

/// Progress that is being shown, and erased when dropped.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Says how far the loading of a scene has come.
    pub fn tell(&self, step: scene::Progress) {
        self.bar.set_message(format!("loading {} {}/{}", step.what, step.done, step.total));
    }

    pub fn step(&self) {
        self.bar.inc(1);
    }

    /// So many steps are done. Threads may tell in any order: the bar never goes back.
    pub fn at(&self, done: u64) {
        let ahead = done.saturating_sub(self.bar.position());
        self.bar.inc(ahead);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
