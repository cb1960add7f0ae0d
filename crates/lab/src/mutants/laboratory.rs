//! A device under each mode of the validation layer, and the layer's messages about frames on it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use super::watched::{Extensions, NO_EXTENSIONS, Watched};
use super::{Case, Mutant};
use afterlight::frame;
use afterlight::frame::edges::{self, Edges};
use afterlight::gpu::{self, Device, DeviceChoice};
use afterlight::plan::FramePlan;

/// Frames that could not be drawn, or a layer that says something of frames that lack nothing.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A device under the layer could not be had.
    #[error(transparent)]
    Gpu(#[from] gpu::Error),
    /// Frames could not be drawn.
    #[error("cannot draw \"{case}\"")]
    Drawing {
        /// The case's name.
        case: String,
        /// The reason.
        source: frame::Error,
    },
    /// The layer's messages about mutants would say nothing.
    #[error("with all its dependencies \"{case}\" already breaks {}", rules.iter().cloned().collect::<Vec<_>>().join(", "))]
    Noise {
        /// The case's name.
        case: String,
        /// The rules that the layer finds broken.
        rules: BTreeSet<String>,
    },
}

/// The rules that the layer finds broken in a mutant's frames.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Heard {
    /// Without the heuristic of accesses by shaders.
    pub plain: BTreeSet<String>,
    /// With it; `None` where the layer has none.
    pub heuristic: Option<BTreeSet<String>>,
    /// The time that drawing the mutant took, in both modes.
    pub seconds: f64,
}

impl Heard {
    /// Returns true if the layer says anything, in any mode.
    pub fn anything(&self) -> bool {
        !self.plain.is_empty() || self.heuristic.as_ref().is_some_and(|rules| !rules.is_empty())
    }

    /// The rules of both modes.
    pub fn rules(&self) -> BTreeSet<&str> {
        self.plain.iter().chain(self.heuristic.iter().flatten()).map(String::as_str).collect()
    }
}

/// A device for each mode of the layer: neither mode notices all that the other does.
pub struct Laboratory {
    choice: DeviceChoice,
    extensions: Extensions,
    /// Without the heuristic of accesses by shaders, and with it where the layer has it.
    modes: Vec<Watched>,
    jobs: usize,
}

/// The extensions that presented frames need.
#[cfg(feature = "present")]
const PRESENTING: Extensions = (&gpu::HEADLESS, &[ash::khr::swapchain::NAME]);

/// Mutants that a device draws before it takes others. They are in the order of their cases, each of which is drawn whole before its mutants.
const AT_A_TIME: usize = 24;

/// The rules that one mode finds broken in a mutant's frames, and the seconds that drawing them took.
type Judged = (BTreeSet<String>, f64);

impl Laboratory {
    /// A device for each mode. Frames are presented where there are surfaces without a display.
    ///
    /// # Errors
    /// Without a driver or the layer.
    pub fn open(choice: &DeviceChoice) -> Result<Self, gpu::Error> {
        #[cfg(feature = "present")]
        match Self::with_extensions(choice, PRESENTING) {
            Err(gpu::Error::Unsupported(_)) => {}
            opened => return opened,
        }
        Self::with_extensions(choice, NO_EXTENSIONS)
    }

    fn with_extensions(choice: &DeviceChoice, extensions: Extensions) -> Result<Self, gpu::Error> {
        let modes = [false, true].into_iter().filter_map(|mode| Watched::open(choice, mode, extensions).transpose());
        let modes = modes.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { choice: choice.clone(), extensions, jobs: modes.len(), modes })
    }

    /// Draws so many mutants at a time, each on a device of its own, but in each mode at least one.
    pub fn with_jobs(self, jobs: usize) -> Self {
        Self { jobs, ..self }
    }

    /// The layer's version, packed as Vulkan packs it.
    pub fn layer(&self) -> u32 {
        self.modes[0].layer()
    }

    /// The device that frames are drawn on.
    pub fn device(&self) -> &Device {
        self.modes[0].device()
    }

    /// Returns true if cases that are presented can be drawn.
    pub fn presents(&self) -> bool {
        self.extensions != NO_EXTENSIONS
    }

    /// Returns the layer's messages about each mutant. The layer has none about the whole tables, so its messages are not noise. Calls `step` as each
    /// mutant is drawn in each mode ([`Laboratory::steps`]).
    ///
    /// # Safety
    /// As of [`afterlight::frame::Renderer::with_edges`].
    ///
    /// # Errors
    /// When a case cannot be drawn, or the layer says something of it as it is.
    pub unsafe fn judge(
        &self,
        cases: &[(&Case, &FramePlan)],
        mutants: &[Mutant],
        step: &(dyn Fn() + Sync),
    ) -> Result<Vec<Heard>, Error> {
        let work = Work::of(cases, mutants);
        let workers = (self.jobs / self.modes.len()).clamp(1, work.parts.len());
        let next: Vec<AtomicUsize> = self.modes.iter().map(|_| AtomicUsize::new(0)).collect();
        let judge = |mode: usize, worker: usize| -> Result<_, Error> {
            // Of each mode one device is open.
            let other = if worker == 0 { None } else { Watched::open(&self.choice, mode == 1, self.extensions)? };
            // SAFETY: the caller's promise.
            let parts = unsafe { work.judge(other.as_ref().unwrap_or(&self.modes[mode]), &next[mode], step) }?;
            Ok((mode, parts))
        };
        let judged: Result<Vec<_>, Error> = thread::scope(|scope| {
            let judge = &judge;
            let all = (0..next.len()).flat_map(|mode| (0..workers).map(move |worker| (mode, worker)));
            let threads: Vec<_> = all.map(|(mode, worker)| scope.spawn(move || judge(mode, worker))).collect();
            let join = |thread: thread::ScopedJoinHandle<'_, _>| {
                thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            threads.into_iter().map(join).collect()
        });
        // By part, and so in the order of the mutants.
        let mut modes = vec![BTreeMap::new(); self.modes.len()];
        judged?.into_iter().for_each(|(mode, parts)| modes[mode].extend(parts));
        let mut modes = modes.into_iter().map(|parts| parts.into_values().flatten().collect::<Vec<Judged>>());
        let plain = modes.next().unwrap_or_default();
        let heuristic = modes.next();
        let together = plain.into_iter().enumerate().map(|(index, (plain, seconds))| {
            let other = heuristic.as_ref().map(|heuristic| &heuristic[index]);
            let seconds = seconds + other.map_or(0.0, |other| other.1);
            Heard { plain, heuristic: other.map(|other| other.0.clone()), seconds }
        });
        Ok(together.collect())
    }

    /// Returns the number of times that [`Laboratory::judge`] calls its `step`.
    pub fn steps(&self, mutants: usize) -> usize {
        mutants * self.modes.len()
    }
}

/// The mutants to draw, in parts, and the cases that they are made of.
struct Work<'a> {
    parts: Vec<(Vec<(&'a Case, &'a FramePlan)>, &'a [Mutant<'a>])>,
}

impl<'a> Work<'a> {
    /// The first part has the cases without a mutant as well.
    fn of(cases: &[(&'a Case, &'a FramePlan)], mutants: &'a [Mutant<'a>]) -> Self {
        let is_of = |mutants: &[Mutant], case: &Case| mutants.iter().any(|mutant| std::ptr::eq(mutant.case, case));
        let (first, rest) = mutants.split_at(mutants.len().min(AT_A_TIME));
        let parts = std::iter::once(first).chain(rest.chunks(AT_A_TIME)).enumerate().map(|(index, part)| {
            let is_drawn = |case: &Case| is_of(part, case) || (index == 0 && !is_of(mutants, case));
            (cases.iter().copied().filter(|(case, _)| is_drawn(case)).collect(), part)
        });
        Self { parts: parts.collect() }
    }

    /// Judges parts until none is left, and returns them by their index.
    ///
    /// # Safety
    /// As of [`Laboratory::judge`].
    unsafe fn judge(
        &self,
        watched: &Watched,
        next: &AtomicUsize,
        step: &dyn Fn(),
    ) -> Result<BTreeMap<usize, Vec<Judged>>, Error> {
        let mut judged = BTreeMap::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some((cases, mutants)) = self.parts.get(index) else { return Ok(judged) };
            for (case, plan) in cases {
                // SAFETY: nothing is missing.
                let rules = unsafe { broken(watched, case, edges::table(plan)) }?;
                if !rules.is_empty() {
                    return Err(Error::Noise { case: case.name.clone(), rules });
                }
            }
            let of_mutant = |mutant: &Mutant| {
                let begun = Instant::now();
                // SAFETY: the caller's promise.
                let rules = unsafe { broken(watched, mutant.case, mutant.edges.clone()) }?;
                step();
                Ok((rules, begun.elapsed().as_secs_f64()))
            };
            judged.insert(index, mutants.iter().map(of_mutant).collect::<Result<_, Error>>()?);
        }
    }
}

/// The rules that the layer finds broken.
///
/// # Safety
/// As of [`Laboratory::judge`].
unsafe fn broken(watched: &Watched, case: &Case, edges: Edges) -> Result<BTreeSet<String>, Error> {
    // SAFETY: the caller's promise.
    let drawn = unsafe { watched.draw(&case.scene, &case.settings, edges, case.presented) };
    let drawn = drawn.map_err(|source| Error::Drawing { case: case.name.clone(), source })?;
    Ok(drawn.messages.into_iter().map(|message| message.id_name).collect())
}
