//! A device under each mode of the validation layer, and the layer's messages about frames on it.

use std::collections::BTreeSet;
use std::panic::resume_unwind;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use super::watched::{LayerDevice, NO_EXTENSIONS, WatchedExtensions};
use super::{Mutant, MutantCase};
use afterlight::frame;
use afterlight::frame::rows::{self, Rows};
use afterlight::gpu::{self, Device, DeviceChoice};
use afterlight::plan::FramePlan;

/// Frames that could not be drawn, or a layer that says something of frames that lack nothing.
#[derive(Debug, thiserror::Error)]
pub enum MutantError {
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
pub struct BrokenRules {
    /// The rules broken without the layer's shader-access heuristic.
    pub plain: BTreeSet<String>,
    /// The rules broken with the heuristic; `None` if the layer does not have it.
    pub heuristic: Option<BTreeSet<String>>,
    /// The time that drawing the mutant took, in both modes.
    pub seconds: f64,
}

impl BrokenRules {
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
    extensions: WatchedExtensions,
    /// Without the heuristic of accesses by shaders, and with it where the layer has it.
    modes: Vec<LayerDevice>,
    jobs: usize,
}

/// The extensions that presented frames need.
#[cfg(feature = "present")]
const PRESENTING: WatchedExtensions = (&gpu::HEADLESS, &[ash::khr::swapchain::NAME]);

/// Mutants that a device draws before it takes others. They are in the order of their cases, each of which is drawn whole before its mutants.
const AT_A_TIME: usize = 24;

/// The rules that one mode finds broken in a mutant's frames, and the seconds that drawing them took.
type Judged = (BTreeSet<String>, f64);

impl Laboratory {
    /// Opens a device for each mode. Frames are presented if surfaces without a display are supported.
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

    fn with_extensions(choice: &DeviceChoice, extensions: WatchedExtensions) -> Result<Self, gpu::Error> {
        let modes =
            [false, true].into_iter().filter_map(|mode| LayerDevice::open(choice, mode, extensions).transpose());
        let modes = modes.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { choice: choice.clone(), extensions, jobs: modes.len(), modes })
    }

    /// Sets how many mutants are drawn at a time, each on another device. Every mode draws at least one.
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
    /// As of [`afterlight::frame::Renderer::with_rows`].
    ///
    /// # Errors
    /// When a case cannot be drawn, or the layer says something of it as it is.
    pub unsafe fn judge(
        &self,
        cases: &[(&MutantCase, &FramePlan)],
        mutants: &[Mutant],
        step: &(dyn Fn() + Sync),
    ) -> Result<Vec<BrokenRules>, MutantError> {
        let is_of =
            |mutants: &[Mutant], case: &MutantCase| mutants.iter().any(|mutant| std::ptr::eq(mutant.case, case));
        let found: Vec<[OnceLock<Judged>; 2]> = mutants.iter().map(|_| Default::default()).collect();
        let next: [AtomicUsize; 2] = Default::default();
        let work = |mode: usize, watched: &LayerDevice| -> Result<(), MutantError> {
            loop {
                let begin = next[mode].fetch_add(AT_A_TIME, Ordering::Relaxed);
                // The first part has the cases without a mutant as well.
                if begin > 0 && begin >= mutants.len() {
                    return Ok(());
                }
                let part = begin..mutants.len().min(begin + AT_A_TIME);
                let is_drawn =
                    |case: &MutantCase| is_of(&mutants[part.clone()], case) || (begin == 0 && !is_of(mutants, case));
                for (case, plan) in cases.iter().filter(|(case, _)| is_drawn(case)) {
                    // SAFETY: nothing is missing.
                    let rules = unsafe { broken(watched, case, rows::table(plan)) }?;
                    if !rules.is_empty() {
                        return Err(MutantError::Noise { case: case.name.clone(), rules });
                    }
                }
                for (mutant, found) in mutants[part.clone()].iter().zip(&found[part]) {
                    let begun = Instant::now();
                    // SAFETY: the caller's promise.
                    let rules = unsafe { broken(watched, mutant.case, mutant.rows.clone()) }?;
                    let _ = found[mode].set((rules, begun.elapsed().as_secs_f64()));
                    step();
                }
            }
        };
        self.on_all_devices(mutants.len().div_ceil(AT_A_TIME), &work)?;
        let heard = found.into_iter().map(|modes| {
            let [plain, heuristic] = modes.map(OnceLock::into_inner);
            let seconds = plain.iter().chain(&heuristic).map(|(_, seconds)| seconds).sum();
            let rules = |judged: Option<Judged>| judged.map(|(rules, _)| rules);
            BrokenRules {
                plain: rules(plain).expect("it is drawn in every mode"),
                heuristic: rules(heuristic),
                seconds,
            }
        });
        Ok(heard.collect())
    }

    /// Works on the device of each mode, and on more of them if there are more jobs, but on no more of a mode than `most`.
    fn on_all_devices(
        &self,
        most: usize,
        work: &(dyn Fn(usize, &LayerDevice) -> Result<(), MutantError> + Sync),
    ) -> Result<(), MutantError> {
        let devices = (self.jobs / self.modes.len()).clamp(1, most.max(1));
        let on_another = move |mode: usize| match LayerDevice::open(&self.choice, mode == 1, self.extensions)? {
            Some(other) => work(mode, &other),
            None => Ok(()),
        };
        thread::scope(|scope| {
            let mut threads = Vec::new();
            for (mode, watched) in self.modes.iter().enumerate() {
                threads.push(scope.spawn(move || work(mode, watched)));
                threads.extend((1..devices).map(|_| scope.spawn(move || on_another(mode))));
            }
            threads.into_iter().try_for_each(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)))
        })
    }

    /// Returns the number of times that [`Laboratory::judge`] calls its `step`.
    pub fn steps(&self, mutants: usize) -> usize {
        mutants * self.modes.len()
    }
}

/// The rules that the layer finds broken.
///
/// # Safety
/// As of [`Laboratory::judge`].
unsafe fn broken(watched: &LayerDevice, case: &MutantCase, rows: Rows) -> Result<BTreeSet<String>, MutantError> {
    // SAFETY: the caller's promise.
    let drawn = unsafe { watched.draw(&case.scene, &case.settings, rows, case.presented) };
    let drawn = drawn.map_err(|source| MutantError::Drawing { case: case.name.clone(), source })?;
    Ok(drawn.messages.into_iter().map(|message| message.id_name).collect())
}
