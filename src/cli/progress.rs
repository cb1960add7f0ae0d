//! Progress of long work on standard error: a bar on a terminal. Elsewhere nothing, or lines for what takes minutes and more.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use afterlight::scene;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Between two lines of one [`shares`], at least.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// A spinner beside the name of what is being loaded.
pub fn loading(what: &str, quiet: bool) -> Progress {
    let bar = ProgressBar::with_draw_target(None, target(quiet)).with_message(format!("loading {what}"));
    bar.enable_steady_tick(Duration::from_millis(100));
    Progress { bar, lines: None }
}

/// A bar that [`Progress::step`] fills in `steps` steps.
pub fn bar(what: String, steps: u64, quiet: bool) -> Progress {
    let bar = ProgressBar::with_draw_target(Some(steps), target(quiet)).with_message(what);
    // A template that does not parse leaves indicatif's own.
    if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    Progress { bar, lines: None }
}

/// A bar of very many small steps. Off a terminal it is lines that say how much is done, one every ten seconds at most.
pub fn shares(what: String, steps: u64, quiet: bool) -> Progress {
    let lines = is_told_in_lines(quiet).then(|| Lines { what: what.clone(), steps, told: Mutex::new(None) });
    let mut progress = bar(what, steps, quiet);
    progress.lines = lines;
    progress
}

/// A line off a terminal, where a bar would be on one.
pub fn line(text: &str, quiet: bool) {
    if is_told_in_lines(quiet) {
        eprintln!("{text}");
    }
}

fn is_told_in_lines(quiet: bool) -> bool {
    !quiet && ProgressDrawTarget::stderr().is_hidden()
}

/// indicatif draws nothing on a stream that is no terminal.
fn target(quiet: bool) -> ProgressDrawTarget {
    if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
}

/// Progress that is being shown, and erased when dropped.
pub struct Progress {
    bar: ProgressBar,
    lines: Option<Lines>,
}

/// What is told off a terminal of work that has very many steps.
struct Lines {
    what: String,
    steps: u64,
    /// When the last line was printed.
    told: Mutex<Option<Instant>>,
}

impl Lines {
    fn at(&self, done: u64) {
        // Another thread that holds it prints, or has died: neither is a reason to wait.
        let Ok(mut told) = self.told.try_lock() else { return };
        if told.is_none_or(|told| told.elapsed() >= LINE_EVERY) {
            *told = Some(Instant::now());
            eprintln!("{}: {}%", self.what, 100 * done / self.steps.max(1));
        }
    }
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
        if let Some(lines) = &self.lines {
            lines.at(done);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
