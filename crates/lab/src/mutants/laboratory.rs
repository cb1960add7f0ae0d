//! A device under each mode of the validation layer, and the layer's messages about frames on it.

use std::collections::BTreeSet;
use std::ffi::CStr;
use std::sync::Arc;
use std::thread;
use std::time::Instant;

use super::{Case, Mutant};
use afterlight::frame::rows::{self, Rows};
use afterlight::frame::{self, experiment};
use afterlight::gpu::{self, Device, DeviceChoice, Instance, InstanceOptions, Message, Validation};
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

/// One mode of the layer.
struct Mode {
    instance: Arc<Instance>,
    device: Arc<Device>,
}

/// A device for each mode of the layer: neither mode notices all that the other does.
pub struct Laboratory {
    modes: Vec<Mode>,
    presents: bool,
}

/// The extensions of instance and device that presented frames need.
#[cfg(feature = "present")]
const PRESENTING: (&[&CStr], &[&CStr]) = (&gpu::HEADLESS, &[ash::khr::swapchain::NAME]);

impl Laboratory {
    /// A device for each mode. Frames are presented where there are surfaces without a display.
    ///
    /// # Errors
    /// Without a driver or the layer.
    pub fn open(choice: &DeviceChoice) -> Result<Self, gpu::Error> {
        #[cfg(feature = "present")]
        match Self::with_extensions(choice, PRESENTING) {
            Ok(modes) => return Ok(Self { modes, presents: true }),
            Err(gpu::Error::Unsupported(_)) => {}
            Err(error) => return Err(error),
        }
        Ok(Self { modes: Self::with_extensions(choice, (&[], &[]))?, presents: false })
    }

    fn with_extensions(
        choice: &DeviceChoice,
        (of_instance, of_device): (&[&'static CStr], &[&'static CStr]),
    ) -> Result<Vec<Mode>, gpu::Error> {
        let mut modes = Vec::new();
        for sync_shader_heuristic in [false, true] {
            let options = InstanceOptions {
                validation: Validation::Synchronization,
                sync_shader_heuristic,
                ..InstanceOptions::default()
            };
            let instance = Instance::with_extensions(&options, of_instance)?;
            if instance.sync_shader_heuristic() == sync_shader_heuristic {
                let device = Device::with_extensions(&instance, choice, of_device)?;
                modes.push(Mode { instance, device });
            }
        }
        Ok(modes)
    }

    /// The layer's version, packed as Vulkan packs it.
    pub fn layer(&self) -> u32 {
        self.modes[0].instance.validation_layer().unwrap_or_default()
    }

    /// The device that frames are drawn on.
    pub fn device(&self) -> &Device {
        &self.modes[0].device
    }

    /// Returns true if cases that are presented can be drawn.
    pub fn presents(&self) -> bool {
        self.presents
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
        // SAFETY: the caller's promise.
        let judge = |mode: &Mode| unsafe { mode.judge(cases, mutants, step) };
        let heard: Result<Vec<_>, Error> = thread::scope(|scope| {
            let threads: Vec<_> = self.modes.iter().map(|mode| scope.spawn(|| judge(mode))).collect();
            let join = |thread: thread::ScopedJoinHandle<'_, _>| {
                thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            threads.into_iter().map(join).collect()
        });
        let mut modes = heard?.into_iter();
        let plain = modes.next().unwrap_or_default();
        let heuristic = modes.next();
        let together = plain.into_iter().enumerate().map(|(index, (plain, seconds))| {
            let other = heuristic.as_ref().map(|heuristic| &heuristic[index]);
            let seconds = seconds + other.map_or(0.0, |other| other.1);
            Heard { plain, heuristic: other.map(|other| other.0.clone()), seconds }
        });
        Ok(together.collect())
    }

    /// The number of the layer's modes. Each draws in its own thread, on its own device.
    pub fn modes(&self) -> usize {
        self.modes.len()
    }

    /// Returns the number of times that [`Laboratory::judge`] calls its `step`.
    pub fn steps(&self, mutants: usize) -> usize {
        mutants * self.modes.len()
    }
}

impl Mode {
    /// # Safety
    /// As of [`Laboratory::judge`].
    unsafe fn judge(
        &self,
        cases: &[(&Case, &FramePlan)],
        mutants: &[Mutant],
        step: &dyn Fn(),
    ) -> Result<Vec<(BTreeSet<String>, f64)>, Error> {
        for &(case, plan) in cases {
            // SAFETY: nothing is missing.
            let rules = unsafe { self.says(case, rows::table(plan)) }?;
            if !rules.is_empty() {
                return Err(Error::Noise { case: case.name.clone(), rules });
            }
        }
        let judged = mutants.iter().map(|mutant| {
            let begun = Instant::now();
            // SAFETY: the caller's promise.
            let rules = unsafe { self.says(mutant.case, mutant.edges.clone()) }?;
            step();
            Ok((rules, begun.elapsed().as_secs_f64()))
        });
        judged.collect()
    }

    /// The rules that the layer finds broken.
    ///
    /// # Safety
    /// As of [`Laboratory::judge`].
    unsafe fn says(&self, case: &Case, edges: Rows) -> Result<BTreeSet<String>, Error> {
        self.instance.take_messages();
        // SAFETY: the caller's promise.
        let drawn = unsafe { self.draw(case, edges) };
        drawn.map_err(|source| Error::Drawing { case: case.name.clone(), source })?;
        let ours = self.instance.take_messages().into_iter().filter(Message::is_about_this_program);
        Ok(ours.map(|message| message.id_name).collect())
    }

    /// # Safety
    /// As of [`Laboratory::judge`].
    unsafe fn draw(&self, case: &Case, edges: Rows) -> Result<(), frame::Error> {
        // SAFETY: the caller's promise.
        unsafe {
            #[cfg(feature = "present")]
            if let Some(way) = case.presented {
                return experiment::present(&self.device, &case.scene, &case.settings, edges, way);
            }
            experiment::draw(&self.device, &case.scene, &case.settings, edges).map(drop)
        }
    }
}
