//! Files that have changed while the window is open.

use std::sync::Arc;
use std::time::Instant;

use super::{App, Opened};
use crate::watch::{Reload, Watch};
use afterlight::scene::counted;

/// Warnings of a scene that are told.
pub(super) const WARNINGS: usize = 5;

impl App<'_> {
    /// Watches the files that the window's frames come from.
    pub(super) fn watch_files(&mut self) {
        let Some(read) = self.options.read_again.take() else { return };
        let wake = Arc::clone(&self.wake);
        let watch = Watch::new(&self.live.scene.files, read, self.options.shaders.take(), move || wake());
        match watch {
            Ok(watch) => self.watch = Some(watch),
            Err(error) => self.teller.tell(&format!("warning: files are not watched: {error}")),
        }
    }

    /// Adopts scenes and shaders that were read and compiled anew. Faulty ones are reported, and the old ones stay.
    pub(super) fn apply_reloads(&mut self) {
        while let Some(reload) = self.watch.as_ref().and_then(|watch| watch.next_reload()) {
            let Some(Opened { interface, presenter, .. }) = &mut self.opened else { return };
            match reload {
                Reload::Scene(Ok(read)) => {
                    let (scene, settings) = *read;
                    for warning in scene.warnings.iter().take(WARNINGS) {
                        self.teller.tell(&format!("warning: {warning}"));
                    }
                    self.teller.tell(&format!("scene: read again, {}", counted(scene.objects.len(), "object")));
                    if interface.renew(presenter, &mut self.live, (scene, settings)) {
                        // Records the camera's place until now: it jumps from there.
                        if let Some(recording) = &mut self.recording {
                            recording.take(Instant::now(), *self.control.camera());
                        }
                        let new = self.control.begin_again(&self.live.scene);
                        self.control_before.get_or_insert(std::mem::replace(&mut self.control, new));
                    }
                    self.unfit = true;
                }
                Reload::Scene(Err(fault)) => {
                    // A panel has the fault, too.
                    self.teller.print(&format!("warning: {fault}"));
                    interface.faults.scene = Some(fault);
                }
                #[cfg(feature = "hot-reload")]
                Reload::Shaders(Ok(new)) => {
                    let changes = new.changes();
                    interface.faults.shaders = None;
                    if !changes.is_empty() {
                        interface.exchange_shaders(presenter, new);
                        self.unfit = true;
                    }
                    let changes = if changes.is_empty() { "none differs".to_owned() } else { changes.join(", ") };
                    self.teller.tell(&format!("shaders: compiled, {changes}"));
                }
                #[cfg(feature = "hot-reload")]
                Reload::Shaders(Err(fault)) => {
                    self.teller.print(&format!("warning: shaders: {fault}"));
                    interface.faults.shaders = Some(fault);
                }
            }
        }
    }
}
