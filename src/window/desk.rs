//! The user's desk: panels over the picture, and what follows from a change that is made there.

use std::sync::Arc;
use std::time::Duration;

use winit::event::WindowEvent;
use winit::window::Window;

use super::clock::Clock;
use super::controls::{Controls, Facts, Values};
use super::overlay::{Overlay, Taken};
use crate::frame::{Presenter, plan_for};
use crate::gpu::Device;
use crate::passes::overlay::Panels;
use crate::scene::{Scene, Settings, View, metered_ev100};

/// What is drawn, of which a user may change more than the camera.
pub struct Subject {
    pub scene: Scene,
    pub settings: Settings,
    /// Of each material, as it came.
    own_roughness: Vec<f32>,
    roughness: Option<f32>,
}

impl Subject {
    pub fn new(scene: Scene, settings: Settings) -> Self {
        let own_roughness = scene.materials.iter().map(|material| material.roughness).collect();
        Self { scene, settings, own_roughness, roughness: None }
    }

    fn values(&self) -> Values {
        Values {
            settings: self.settings.clone(),
            exposure: self.settings.exposure.unwrap_or_else(|| metered_ev100(&self.scene)),
            lights: self.scene.lights.clone(),
            roughness: self.roughness,
        }
    }

    /// The same settings with the next view, or the one before it.
    fn turned(&self, back: bool) -> Settings {
        let views = View::NAMES;
        let now = views.iter().position(|&(_, view)| view == self.settings.view).unwrap_or(0);
        let next = (now + if back { views.len() - 1 } else { 1 }) % views.len();
        Settings { view: views[next].1, ..self.settings.clone() }
    }
}

/// The panels of a window.
pub struct Desk {
    device: Arc<Device>,
    overlay: Overlay,
    pub controls: Controls,
    /// Why the last change was not made.
    refused: Option<String>,
}

impl Desk {
    pub fn new(device: &Arc<Device>, window: &Window) -> Self {
        let overlay = Overlay::new(window, device.physical.limits.max_image_dimension2_d);
        Self { device: Arc::clone(device), overlay, controls: Controls::default(), refused: None }
    }

    /// Hands an event of the window on. Nothing is consumed while no panel is open.
    pub fn event(&mut self, window: &Window, event: &WindowEvent) -> Taken {
        let Taken { consumed, changes } = self.overlay.event(window, event);
        let shown = self.controls.is_any_shown();
        Taken { consumed: consumed && shown, changes: changes && shown }
    }

    /// Builds the panels and makes the changes that are made there. What is to be drawn, and after which time anew; none while no panel is open.
    /// The presenter must be fitted again if it was told of a change: the third value.
    pub fn show(
        &mut self,
        window: &Window,
        (presenter, clock): (&mut Presenter, &Clock),
        subject: &mut Subject,
    ) -> Option<(Panels, Duration, bool)> {
        if !self.controls.is_any_shown() {
            return None;
        }
        let before = subject.values();
        let mut after = before.clone();
        let facts = Facts {
            device: &self.device.physical.name,
            intervals: clock.graph(),
            times: presenter.times(),
            plan: presenter.plan(),
            memory: self.device.memory_report(),
            refused: self.refused.as_deref(),
        };
        let controls = &mut self.controls;
        let (panels, delay) = self.overlay.run(window, |ui| controls.show(ui, &facts, &mut after));
        drop(facts);
        let unfit = after != before && self.change(presenter, subject, &before, after);
        Some((panels, delay, unfit))
    }

    /// Adds to the panels the textures that the device has not yet.
    pub fn send_textures(&mut self, panels: &mut Panels, presenter: &Presenter) {
        panels.textures = self.overlay.textures(!presenter.has_overlay());
    }

    /// Shows the next view that the scene has, or the one before it. True if the presenter must be fitted again.
    pub fn turn_view(&mut self, presenter: &mut Presenter, subject: &mut Subject, back: bool) -> bool {
        let own = subject.settings.view;
        for _ in 0..View::NAMES.len() {
            let settings = subject.turned(back);
            if self.set(presenter, subject, settings) {
                return true;
            }
            // What the scene does not have is passed over.
            subject.settings.view = subject.turned(back).view;
        }
        subject.settings.view = own;
        false
    }

    /// Makes a change. True if the presenter must be fitted again.
    fn change(&mut self, presenter: &mut Presenter, subject: &mut Subject, before: &Values, after: Values) -> bool {
        let mut unfit = false;
        for (index, (light, old)) in after.lights.iter().zip(&before.lights).enumerate() {
            if light != old {
                subject.scene.lights[index] = light.clone();
                // One that needs other pipelines or maps than before.
                if presenter.set_light(index, light).is_err() {
                    presenter.change(false);
                    unfit = true;
                }
            }
        }
        if after.exposure != before.exposure {
            subject.settings.exposure = Some(after.exposure);
            // Refused only while light is in nits, which has none.
            let _ = presenter.set_exposure(after.exposure);
        }
        if after.roughness != before.roughness {
            subject.roughness = after.roughness;
            for (material, own) in subject.scene.materials.iter_mut().zip(&subject.own_roughness) {
                material.roughness = after.roughness.unwrap_or(*own);
            }
            presenter.change(true);
            unfit = true;
        }
        if after.settings != before.settings {
            let settings = Settings { exposure: subject.settings.exposure, ..after.settings };
            unfit |= self.set(presenter, subject, settings);
        }
        unfit
    }

    /// Takes other settings, if they can be planned.
    fn set(&mut self, presenter: &mut Presenter, subject: &mut Subject, settings: Settings) -> bool {
        match plan_for(&self.device, &subject.scene, &settings) {
            Ok(_) => {
                subject.settings = settings;
                self.refused = None;
                presenter.change(false);
                true
            }
            Err(error) => {
                self.refused = Some(error.to_string());
                false
            }
        }
    }
}
