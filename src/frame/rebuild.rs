//! Renderers built in a background thread while the old frames go on: a driver may compile for seconds.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread::{Builder, JoinHandle};

use super::builder::RendererBuilder;
use super::{Error, Renderer};
use crate::gpu;
use crate::plan;
use crate::scene::{Light, Scene, Settings};

/// Called, from any thread, when there is something new to show.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// The state that may change without making frames anew, as it was when they were begun.
pub(super) struct Begun {
    /// The number of requests for other frames when these were begun.
    pub(super) changes: u64,
    lights: Vec<Light>,
    /// EV100.
    exposure: Option<f32>,
}

impl Begun {
    pub(super) fn new(changes: u64, scene: &Scene, settings: &Settings) -> Self {
        Self { changes, lights: scene.lights.clone(), exposure: settings.exposure }
    }

    /// Takes over the changes since then.
    ///
    /// # Errors
    /// When a changed light needs other pipelines or maps than these frames have.
    fn catch_up(&self, renderer: &mut Renderer, scene: &Scene, settings: &Settings) -> Result<(), Error> {
        for (index, (_, new)) in self.lights.iter().zip(&scene.lights).enumerate().filter(|(_, (old, new))| old != new)
        {
            if !renderer.world.set_light(index, new)? {
                return Err(plan::PlanError::Change(format!("light {index} needs other frames")).into());
            }
        }
        match settings.exposure.filter(|_| settings.exposure != self.exposure && renderer.plan.exposes) {
            Some(ev100) => renderer.set_exposure(ev100),
            None => Ok(()),
        }
    }
}

/// The result.
pub(super) struct Rebuilt {
    begun: Begun,
    /// Renderer of the window, if it was rebuilt.
    pub(super) own: Option<Result<Renderer, Error>>,
    /// Renderer of the view beside, if it was rebuilt.
    pub(super) beside: Option<Result<Renderer, Error>>,
}

impl Rebuilt {
    /// Returns the renderer `made`, if it fits the current scene and settings.
    pub(super) fn caught_up(&self, mut made: Renderer, scene: &Scene, settings: &Settings) -> Option<Renderer> {
        self.begun.catch_up(&mut made, scene, settings).is_ok().then_some(made)
    }
}

/// Renderers of the window and of the view beside, each if it was to be rebuilt.
type RebuiltRenderers = [Option<Result<Renderer, Error>>; 2];

/// Renderers under construction.
pub(super) struct Rebuild {
    pub(super) begun: Begun,
    told: Receiver<RebuiltRenderers>,
    made: Option<RebuiltRenderers>,
    _thread: Thread,
}

impl Rebuild {
    /// Starts building the renderers of the window and of the view beside, each if it is to be rebuilt. Returns none if the system starts no thread.
    pub(super) fn start(begun: Begun, builders: [Option<RendererBuilder>; 2], wake: &Wake) -> Option<Self> {
        let (tell, told) = channel();
        let woken = WakeAtEnd(Arc::clone(wake));
        let make = move || {
            // Dropped after the sender, so that the woken thread finds an answer, or that none will come.
            let (_woken, tell) = (woken, tell);
            // Swapchains come and go with the window: the thread that takes the frames over gives them its views.
            let _ = tell.send(builders.map(|builder| builder.map(|builder| builder.finish(&[]))));
        };
        let thread = Builder::new().name("frames".into()).spawn(make).ok()?;
        Some(Self { begun, told, made: None, _thread: Thread(Some(thread)) })
    }

    /// Returns true if they are made, or never will be.
    pub(super) fn is_done(&mut self) -> bool {
        match self.told.try_recv() {
            Ok(made) => self.made = Some(made),
            Err(TryRecvError::Empty) => return self.made.is_some(),
            Err(TryRecvError::Disconnected) => {}
        }
        true
    }

    /// Waits for them, and keeps them.
    pub(super) fn finish(&mut self) {
        self.made = self.made.take().or_else(|| self.told.recv().ok());
    }

    /// Waits for them.
    pub(super) fn wait(mut self) -> Rebuilt {
        self.finish();
        let made = self.made;
        let ended = || Error::from(gpu::Error::Misuse("the thread that makes frames has ended early".into()));
        let [own, beside] = made.unwrap_or_else(|| [Some(Err(ended())), None]);
        Rebuilt { begun: self.begun, own, beside }
    }
}

/// A thread that is waited for: when a window's session ends, nothing of its device may be left.
struct Thread(Option<JoinHandle<()>>);

impl Drop for Thread {
    fn drop(&mut self) {
        if let Some(thread) = self.0.take() {
            // A panic was printed where it happened.
            let _ = thread.join();
        }
    }
}

/// Wakes the waiting thread, however this one ends.
struct WakeAtEnd(Wake);

impl Drop for WakeAtEnd {
    fn drop(&mut self) {
        (self.0)();
    }
}
