//! Progress of long work on standard error: a bar on a terminal, from half a second on. Elsewhere nothing, or lines for work of minutes and more.

use std::cell::Cell;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use afterlight::scene;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Least time between two lines of one [`shares`] or [`Spaced`].
const LINE_EVERY: Duration = Duration::from_secs(10);

/// Work that is over sooner shows no bar: it would flicker.
const SHOWN_AFTER: Duration = Duration::from_millis(500);

/// A spinner beside the name of the thing that is being loaded.
pub fn loading(what: &str, quiet: bool) -> ProgressDisplay {
    let bar = shown_late(None, target(quiet)).with_message(format!("loading {what}"));
    bar.enable_steady_tick(Duration::from_millis(100));
    ProgressDisplay { bar, lines: None }
}

/// A bar that [`ProgressDisplay::step`] fills in `steps` steps.
pub fn bar(what: String, steps: u64, quiet: bool) -> ProgressDisplay {
    let bar = shown_late(Some(steps), target(quiet)).with_message(what);
    // A template that does not parse leaves indicatif's own.
    if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    ProgressDisplay { bar, lines: None }
}

/// A bar of very many small steps. Off a terminal it is lines that say how much is done, one every ten seconds at most.
pub fn shares(what: String, steps: u64, quiet: bool) -> ProgressDisplay {
    let lines = is_told_in_lines(quiet).then(|| ProgressLog { what: what.clone(), steps, told: Mutex::new(None) });
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

/// Lines off a terminal about many short steps. Some are always printed, the others at most every [`LINE_EVERY`].
pub struct Spaced {
    quiet: bool,
    /// The moment at which the last line was printed.
    told: Cell<Option<Instant>>,
}

impl Spaced {
    pub fn new(quiet: bool) -> Self {
        Self { quiet, told: Cell::new(None) }
    }

    /// Prints a line if it is wanted in any case, or if none was printed for some time.
    pub fn line(&self, is_wanted: bool, text: impl FnOnce() -> String) {
        if is_wanted || self.told.get().is_none_or(|told| told.elapsed() >= LINE_EVERY) {
            self.told.set(Some(Instant::now()));
            line(&text(), self.quiet);
        }
    }
}

fn is_told_in_lines(quiet: bool) -> bool {
    !quiet && ProgressDrawTarget::stderr().is_hidden()
}

/// indicatif draws nothing on a stream that is no terminal.
fn target(quiet: bool) -> ProgressDrawTarget {
    if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
}

/// A bar that appears when [`SHOWN_AFTER`] has passed.
fn shown_late(length: Option<u64>, target: ProgressDrawTarget) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(length, ProgressDrawTarget::hidden());
    if !target.is_hidden() {
        let late = bar.clone();
        let show = move || {
            std::thread::sleep(SHOWN_AFTER);
            late.set_draw_target(target);
        };
        // Nothing depends on the bar: if the thread cannot start, the bar stays hidden.
        let _ = std::thread::Builder::new().name("progress".into()).spawn(show);
    }
    bar
}

/// Progress that is being shown, and erased when dropped.
pub struct ProgressDisplay {
    bar: ProgressBar,
    lines: Option<ProgressLog>,
}

/// The lines that report work with very many steps if there is no terminal.
struct ProgressLog {
    what: String,
    steps: u64,
    /// The moment at which the last line was printed.
    told: Mutex<Option<Instant>>,
}

impl ProgressLog {
    fn at(&self, done: u64) {
        // Another thread that holds it prints, or has died: neither is a reason to wait.
        let Ok(mut told) = self.told.try_lock() else { return };
        if told.is_none_or(|told| told.elapsed() >= LINE_EVERY) {
            *told = Some(Instant::now());
            eprintln!("{}: {}%", self.what, 100 * done / self.steps.max(1));
        }
    }
}

impl ProgressDisplay {
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

impl Drop for ProgressDisplay {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use indicatif::TermLike;

    use super::*;

    /// A terminal that knows whether something was written on it.
    #[derive(Debug, Default, Clone)]
    struct Paper(Arc<AtomicBool>);

    impl TermLike for Paper {
        fn width(&self) -> u16 {
            80
        }

        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn write_line(&self, text: &str) -> io::Result<()> {
            self.write_str(text)
        }

        fn write_str(&self, text: &str) -> io::Result<()> {
            self.0.fetch_or(!text.trim().is_empty(), Ordering::Relaxed);
            Ok(())
        }

        fn clear_line(&self) -> io::Result<()> {
            Ok(())
        }

        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_bar_is_shown_from_half_a_second_on() {
        let paper = Paper::default();
        let target = ProgressDrawTarget::term_like(Box::new(paper.clone()));
        let (bar, start) = (shown_late(Some(1000), target).with_message("loading"), Instant::now());
        while !paper.0.load(Ordering::Relaxed) {
            assert!(start.elapsed() < Duration::from_secs(20), "nothing is shown");
            bar.inc(1);
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(start.elapsed() >= SHOWN_AFTER, "shown after {:?}", start.elapsed());
        let soon = Paper::default();
        let bar = shown_late(None, ProgressDrawTarget::term_like(Box::new(soon.clone())));
        bar.tick();
        bar.finish_and_clear();
        std::thread::sleep(SHOWN_AFTER * 2);
        assert!(!soon.0.load(Ordering::Relaxed), "what was over is shown");
    }
}
