//! Keys and the mouse in a window: each calls up an action of the [`App`].

use std::time::Instant;

use glam::DVec2;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event_loop::ActiveEventLoop;
use winit::keyboard::KeyCode;

use super::{App, Opened};
use crate::camera::NavigationMode;
use crate::controls::Controls;
use crate::keys::{Action, HELP, action};
use crate::recorder::Recorder;
use afterlight::scene::SettingsPatch;
use afterlight_truth::reference::CameraView;

impl App<'_> {
    pub(super) fn press(&mut self, events: &ActiveEventLoop, key: KeyCode) {
        // Records the camera's place until now: the key may make it jump.
        if let Some(recording) = &mut self.recording {
            recording.take(Instant::now(), *self.control.camera());
        }
        match action(key, self.with_control, self.with_shift) {
            Some(Action::Quit) => {
                if !self.end_steps_or_marks() {
                    events.exit();
                }
            }
            Some(Action::Help) => {
                // The picture has them as a panel.
                self.teller.print(&help());
                self.open_panels(|controls| controls.keys = !controls.keys);
            }
            Some(Action::Panels) => self.open_panels(|controls| controls.shown = !controls.shown),
            Some(Action::Dependencies) => {
                self.open_panels(|controls| controls.dependencies = !controls.dependencies);
            }
            Some(Action::View { back }) => {
                if let Some(Opened { interface, presenter, .. }) = &mut self.opened {
                    self.unfit |= interface.turn_view(presenter, &mut self.live, back);
                    self.teller.tell(&format!("view: {}", self.live.settings.view));
                }
            }
            Some(Action::Step { back }) => {
                if let Some(Opened { interface, presenter, .. }) = &mut self.opened {
                    self.unfit |= interface.step(presenter, &self.live, back);
                    let line = interface.stepper().line(&self.live.scene);
                    // A panel shows the steps while there are any.
                    match interface.stepper().is_open() {
                        true => self.teller.print(&line),
                        false => self.teller.tell(&line),
                    }
                }
            }
            Some(action @ (Action::Play | Action::Nudge { .. } | Action::Clip { .. })) => self.change_clips(action),
            Some(Action::Record) => self.record(),
            Some(Action::Scene) => self.keep_scene(),
            Some(Action::Resolution) => self.switch_resolution(),
            Some(Action::Compare) => self.open_panels(|controls| controls.asks_truth = true),
            Some(Action::Reset) => self.control.reset(),
            Some(Action::Orbit) => {
                self.control.toggle_orbit();
                let mode = match self.control.mode() {
                    NavigationMode::Fly => "fly",
                    NavigationMode::Orbit => "orbit",
                };
                self.teller.tell(&format!("camera: {mode}"));
            }
            Some(Action::Screenshot) => self.screenshot = true,
            Some(Action::Light) => self.light = true,
            Some(Action::Split { next }) => self.split(next),
            Some(Action::Bookmark(number)) => {
                self.control.bookmark(number);
                self.teller.tell(&format!("camera {} is kept: --camera \"{}\"", number + 1, self.control.camera()));
            }
            Some(Action::Recall(number)) => {
                if !self.control.recall(number) {
                    self.teller.tell(&format!("no camera is kept as {0}: Ctrl+{0} keeps one", number + 1));
                }
            }
            None => return,
        }
        self.ask_for_frame();
    }

    /// False if there was nothing to be ended.
    fn end_steps_or_marks(&mut self) -> bool {
        match &mut self.opened {
            Some(Opened { interface, presenter, .. }) if interface.stepper().is_open() => {
                self.unfit |= interface.end_steps(presenter, &self.live);
                true
            }
            opened => opened.as_mut().is_some_and(|opened| opened.interface.clear()),
        }
    }

    fn open_panels(&mut self, change: impl FnOnce(&mut Controls)) {
        if let Some(opened) = &mut self.opened {
            change(&mut opened.interface.controls);
        }
    }

    /// Begins to record the camera's path, or ends it and writes it.
    fn record(&mut self) {
        let Some(recorder) = self.recording.take() else {
            self.recording = Some(Recorder::new(Instant::now(), *self.control.camera()));
            return self.teller.tell("path: recording, until K is pressed again");
        };
        let path = recorder.end(Instant::now(), *self.control.camera());
        let told = path.map_err(|error| error.to_string()).and_then(|path| (self.options.keep_path)(&path));
        self.teller.tell(&told.unwrap_or_else(|error| format!("warning: no path: {error}")));
    }

    /// Writes the present view as a scene file, of the window's size.
    fn keep_scene(&mut self) {
        let Some(Opened { window, .. }) = &self.opened else { return };
        let PhysicalSize { width, height } = window.inner_size();
        let settings = SettingsPatch { size: Some([width, height]), ..self.live.settings.patch() };
        let told = (self.options.keep_scene)(&self.live.scene, self.control.camera(), &settings);
        self.teller.tell(&told.unwrap_or_else(|error| format!("warning: no scene file: {error}")));
        if self.live.has_other_roughness() {
            self.teller.tell("warning: a scene file cannot say that all materials are as rough");
        }
    }

    /// Asks for the object under the mouse.
    pub(super) fn pick(&mut self) {
        if let Some(Opened { interface, window, .. }) = &mut self.opened {
            let PhysicalSize { width, height } = window.inner_size();
            let view = CameraView { camera: *self.control.camera(), size: [width, height] };
            interface.pick(&self.live, view, self.mouse);
        }
    }

    pub(super) fn drag(&mut self, position: PhysicalPosition<f64>) {
        self.mouse = DVec2::new(position.x, position.y);
        if self.drag_divider() || !self.dragging {
            return;
        }
        let height = self.opened.as_ref().map_or(1, |opened| opened.window.inner_size().height.max(1));
        if let Some(last) = self.dragged.replace(position) {
            let part = |pixels: f64| pixels / f64::from(height);
            self.way += (position.x - last.x).abs() + (position.y - last.y).abs();
            self.control.drag(part(position.x - last.x), part(position.y - last.y));
            self.ask_for_frame();
        }
    }
}

/// The keys, one a line.
pub fn help() -> String {
    let widest = HELP.iter().map(|(keys, _)| keys.len()).max().unwrap_or(0);
    let line = |(keys, what): &(&str, &str)| format!("  {keys:widest$}  {what}");
    let lines: Vec<String> = HELP.iter().map(line).collect();
    format!("Keys\n{}", lines.join("\n"))
}
