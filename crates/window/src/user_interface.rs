//! The user's interface: panels over the picture, and the consequences of changes that are made there.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use glam::DVec2;
use winit::event::WindowEvent;
use winit::window::Window;

use super::clock::Clock;
use super::controls::{Controls, Facts, PanelValues, Selected, has_keys_alone};
use super::dependencies::Dependencies;
use super::faults::ReloadErrors;
use super::live_scene::LiveScene;
use super::marks::{HeatMap, draw_box};
use super::messages::Notes;
use super::oracle::{Answer, ErrorMap, Oracle, Question, RenderedFrame};
use super::overlay::{Overlay, PanelResponse};
use super::split::{Divider, views_after};
use super::steps::Stepper;
use crate::WindowOptions;
use afterlight::frame::{self, Picture, Pixels, Presenter, plan_for};
use afterlight::gpu::{self, Device, vk};
use afterlight::passes::overlay::Panels;
use afterlight::scene::{Camera, Light, Scene, Settings, View};
#[cfg(feature = "hot-reload")]
use afterlight::shaders::exchange::{Replacements, exchange};
use afterlight_truth::reference;

fn selected_of(scene: &Scene, (object, distance): (usize, f64)) -> Option<Selected> {
    let object = scene.objects.get(object)?;
    let material = scene.materials.get(object.material).map_or_else(String::new, |material| material.name.clone());
    let triangles = scene.meshes.get(object.mesh)?.indices.len() / 3;
    let bounds = object.bounds(&scene.meshes);
    Some(Selected { object: object.name.clone(), material, triangles, distance, bounds })
}

/// The panels of a window.
pub struct UserInterface {
    device: Arc<Device>,
    overlay: Overlay,
    pub controls: Controls,
    pub divider: Divider,
    /// Why the last change was not made.
    refused: Option<String>,
    /// Made with the first question, and given up when the scene changes.
    oracle: Option<Oracle>,
    wake: Arc<dyn Fn() + Send + Sync>,
    /// The object that was clicked at, and its distance.
    selected: Option<(usize, f64)>,
    /// Since the picture from this camera is compared.
    compared: Option<Camera>,
    error: Option<ErrorMap>,
    heat: HeatMap,
    /// The values and the lights that frames were last made for.
    fitted: Option<(PanelValues, Vec<Light>)>,
    /// The state that frames were last made of, if it has changed since.
    before: Before,
    /// The errors in changed files.
    pub faults: ReloadErrors,
    stepper: Stepper,
    dependencies: Dependencies,
    /// The book's chapter about them.
    chapter: Option<PathBuf>,
    /// An object was asked for, and no answer has come.
    is_picking: bool,
    /// Lights or the exposure have changed from one frame to the next, as under a slider.
    has_moved: bool,
}

/// The state to go back to.
#[derive(Default)]
struct Before {
    subject: Option<LiveScene>,
    #[cfg(feature = "hot-reload")]
    shaders: Option<Replacements>,
}

impl UserInterface {
    /// `wake` is called, from any thread, when there is something new to show.
    pub fn new(
        device: &Arc<Device>,
        window: &Window,
        options: &WindowOptions,
        wake: Arc<dyn Fn() + Send + Sync>,
    ) -> Self {
        let is_cpu = device.physical.kind == vk::PhysicalDeviceType::CPU;
        let overlay = Overlay::new(window, device.physical.limits.max_image_dimension2_d);
        Self {
            device: Arc::clone(device),
            overlay,
            controls: Controls { dependencies: !options.without.is_empty(), ..Controls::default() },
            divider: Divider::default(),
            refused: None,
            oracle: None,
            wake,
            selected: None,
            compared: None,
            error: None,
            heat: HeatMap::default(),
            fitted: None,
            before: Before::default(),
            faults: ReloadErrors::default(),
            stepper: Stepper::default(),
            dependencies: Dependencies::new(is_cpu, &options.without, options.hazard),
            chapter: options.chapter.clone(),
            is_picking: false,
            has_moved: false,
        }
    }

    /// Hands an event of the window on. Nothing is consumed while no panel is open.
    pub fn event(&mut self, window: &Window, event: &WindowEvent) -> PanelResponse {
        let shown = self.is_shown();
        self.overlay.event(window, event, shown)
    }

    /// Builds the panels, under these notes, and makes the changes that are made there. Returns the panels to draw, and the time after which to draw
    /// them anew; none while nothing lies over the picture. The third value is true if the presenter must be fitted again, as it was told of a change.
    pub fn show(
        &mut self,
        window: &Window,
        (presenter, clock): (&mut Presenter, &Clock),
        (subject, camera): (&mut LiveScene, &Camera),
        notes: &Notes,
    ) -> Option<(Panels, Duration, bool)> {
        match (self.is_shown(), notes.is_any()) {
            (false, false) => {
                self.overlay.rest(window);
                return None;
            }
            (false, true) => {
                let (panels, delay) = self.overlay.run(window, |context| notes.draw(context));
                return Some((panels, delay, false));
            }
            (true, _) => {}
        }
        let before = subject.values();
        let mut after = before.clone();
        let facts = Facts {
            device: &self.device.physical.name,
            intervals: clock.graph(),
            times: presenter.times(),
            plan: presenter.plan(),
            parts: presenter.parts(true),
            lights: &subject.scene.lights,
            motion: &subject.scene.motion,
            memory: self.device.memory_report(),
            refused: self.refused.as_deref(),
            is_pending: presenter.is_pending(),
            error: self.error.as_ref(),
            is_comparing: self.compared.is_some(),
            selected: self.selected.and_then(|selected| selected_of(&subject.scene, selected)),
            is_stepping: self.stepper.is_open(),
            camera: camera.to_string(),
            bounds: subject.bounds(),
        };
        let (selected, error, heat) = (self.selected, self.error.as_ref(), &self.heat);
        let (scene, player) = (&subject.scene, &mut subject.player);
        let (divider, view, beside) = (self.divider, subject.settings.view, self.controls.beside);
        let (controls, faults) = (&mut self.controls, &mut self.faults);
        let (dependencies, book) = (&mut self.dependencies, (&*self.device.instance, self.chapter.as_deref()));
        let (stepper, drawn) = (&mut self.stepper, presenter.drawn());
        let (panels, mut delay) = self.overlay.run(window, |context| {
            if let Some(error) = error {
                heat.draw(context, error);
            }
            if let Some((object, _)) = selected {
                draw_box(context, scene, camera, object);
            }
            if let Some(beside) = beside {
                divider.draw(context, [view, beside]);
            }
            controls.show(context, &facts, (&mut after, &mut *player));
            faults.show(context);
            if !(controls.keys && has_keys_alone(context)) {
                stepper.panel(context, scene, &drawn);
                dependencies.show(context, &mut controls.dependencies, book);
            }
            notes.draw(context);
        });
        drop(facts);
        if self.stepper.take_new() || self.dependencies.has_change() {
            delay = Duration::ZERO;
        }
        if after != before {
            // Moving lights that were changed go on from there.
            subject.player.show_again();
        }
        let has_changed = after != before;
        let mut unfit = has_changed && self.change(presenter, subject, &before, after);
        self.has_moved = has_changed && !unfit;
        unfit |= self.stepper.obey(presenter, &subject.settings);
        unfit |= self.obey_dependencies(presenter);
        if self.controls.beside != beside {
            self.show_beside(presenter, self.controls.beside);
            unfit = true;
        }
        Some((panels, delay, unfit))
    }

    /// The frames are made for the subject as it is now. Why the window is not split any more, if it cannot be.
    pub fn fitted(&mut self, presenter: &mut Presenter, live: &LiveScene) -> Option<String> {
        self.fitted = Some((live.values(), live.scene.lights.clone()));
        self.before = Before::default();
        if let Some(plan) = presenter.plan() {
            self.dependencies.follow(plan);
        }
        let why = format!("the window cannot be split so: {}", presenter.refusal()?);
        (self.controls.beside, self.divider) = (None, Divider::default());
        (self.refused, self.controls.shown) = (Some(why.clone()), true);
        Some(why)
    }

    /// What was asked for and the frames cannot be without, in sentences, once.
    pub fn take_lacking(&mut self) -> Vec<String> {
        let lacking = self.dependencies.take_lacking().into_iter();
        lacking.map(|name| format!("--without {name}: the frames of this window have no such dependency")).collect()
    }

    /// Leaves rows out of the frames, or draws their hazards, as the panel was told. True if the presenter must be fitted again.
    fn obey_dependencies(&mut self, presenter: &mut Presenter) -> bool {
        if self.dependencies.has_change() {
            // The picture will be another one.
            self.end_comparison();
        }
        // A device that is lost ends the program with the next frame.
        self.dependencies.obey(presenter).unwrap_or(true)
    }

    /// Lines about new messages of the validation layer, for the user. They come while frames are recorded and submitted.
    pub fn hear(&mut self) -> Vec<String> {
        self.dependencies.listen(&self.device.instance)
    }

    /// Takes the scene as it was read again. True if the camera that it names is another one than before.
    pub fn renew(&mut self, presenter: &mut Presenter, live: &mut LiveScene, read: (Scene, Settings)) -> bool {
        // The steps belong to a frame of the old scene.
        self.stepper.end(presenter, &live.settings);
        let new = live.renewed(read.0, read.1);
        let old = std::mem::replace(live, new);
        let is_moved = live.own_camera() != old.own_camera();
        // If several scenes are read in a row, keeps the first old one: the frames were made of it.
        self.before.subject.get_or_insert(old);
        self.faults.scene = None;
        self.forget_scene(presenter);
        is_moved
    }

    /// Makes the frames with other shaders.
    #[cfg(feature = "hot-reload")]
    pub fn exchange_shaders(&mut self, presenter: &mut Presenter, new: Replacements) {
        let old = exchange(new);
        self.before.shaders.get_or_insert(old);
        self.end_comparison();
        presenter.change(false);
    }

    /// Drops all knowledge of a scene.
    fn forget_scene(&mut self, presenter: &mut Presenter) {
        presenter.change(true);
        self.end_comparison();
        (self.oracle, self.selected) = (None, None);
    }

    /// Takes back the changes since frames could last be made, if there are any and the device is not to blame. Tells why on the panels.
    pub fn take_back(&mut self, presenter: &mut Presenter, live: &mut LiveScene, error: &frame::Error) -> bool {
        use gpu::Error::{DeviceLost, Vulkan};
        if let frame::Error::Gpu(DeviceLost { .. } | Vulkan { result: vk::Result::ERROR_SURFACE_LOST_KHR, .. }) = error
        {
            return false;
        }
        let told = Some(error.to_string());
        let was_step = self.stepper.is_open();
        self.stepper.end(presenter, &live.settings);
        let scene = self.before.subject.take();
        #[cfg(feature = "hot-reload")]
        let exchanged = self.before.shaders.take().map(exchange).is_some();
        #[cfg(not(feature = "hot-reload"))]
        let exchanged = false;
        if exchanged {
            self.faults.shaders.clone_from(&told);
        }
        let Some((values, lights)) = self.fitted.clone() else { return false };
        if let Some(old) = scene {
            *live = old;
            self.faults.scene = told;
            self.forget_scene(presenter);
        } else if (&values, &lights) != (&live.values(), &live.scene.lights) || was_step && !exchanged {
            (self.refused, self.controls.shown) = (told, true);
        } else if !exchanged {
            return false;
        }
        live.set(values, lights);
        self.end_comparison();
        // The truth has other lights again.
        self.oracle = None;
        presenter.change(false);
        true
    }

    /// The picture is of another moment than before.
    pub fn forget_moment(&mut self) {
        self.end_comparison();
        self.oracle = None;
    }

    /// Notes that the panels were drawn.
    pub fn drawn(&mut self) {
        self.overlay.drawn();
    }

    /// Returns true if anything lies over the picture.
    fn is_shown(&self) -> bool {
        self.controls.is_any_shown()
            || self.selected.is_some()
            || self.compared.is_some()
            || self.faults.is_any()
            || self.stepper.is_open()
            || self.dependencies.is_simulated()
            || self.dependencies.has_change()
    }

    /// Takes the answers that have come. A comparison ends when the picture is no longer the one that is compared.
    pub fn listen(&mut self, camera: &Camera) {
        if self.compared.is_some_and(|compared| compared != *camera) {
            self.end_comparison();
        }
        match self.oracle.as_ref().and_then(Oracle::answer) {
            Some(Answer::Picked(picked)) => (self.selected, self.is_picking) = (picked, false),
            Some(Answer::Error(map)) => {
                self.heat.set(self.overlay.context(), &map);
                self.error = Some(map);
            }
            None => {}
        }
    }

    /// Asks for the object at a place of the picture, in pixels from its upper left corner.
    pub fn pick(&mut self, live: &LiveScene, view: reference::CameraView, place: DVec2) {
        self.end_comparison();
        self.oracle(live).ask(Question::Pick(view, place));
        self.is_picking = true;
    }

    /// Returns true if the answer to [`UserInterface::pick`] has not come.
    pub fn is_picking(&self) -> bool {
        self.is_picking && self.oracle.is_some()
    }

    /// Returns true once if lights or the exposure are others than in the frame before.
    pub fn take_moved(&mut self) -> bool {
        std::mem::take(&mut self.has_moved)
    }

    /// Returns true if the picture that is shown is being compared.
    pub fn is_comparing(&self) -> bool {
        self.compared.is_some()
    }

    /// Asks for the difference of a picture from this camera from the truth; does nothing if the picture is not one of light.
    pub fn compare(&mut self, live: &LiveScene, camera: Camera, picture: &Picture) {
        let Pixels::Srgb8(rgba) = &picture.pixels else { return };
        if self.refuses_comparison(live) {
            return;
        }
        let drawn = RenderedFrame {
            view: reference::CameraView { camera, size: picture.size },
            settings: live.settings.clone(),
            exposure: live.exposure,
            picture: rgba.clone(),
        };
        self.oracle(live).ask(Question::Error(Box::new(drawn)));
        (self.compared, self.error) = (Some(camera), None);
    }

    /// Returns true if the shown picture cannot be compared, and tells so.
    pub fn refuses_comparison(&mut self, live: &LiveScene) -> bool {
        let is_whole = !self.stepper.is_open() && !self.dependencies.is_simulated();
        let refuses = live.settings.view != View::Final || !is_whole;
        if refuses {
            self.refused = Some("only the final picture of a whole frame can be compared with the truth".into());
            self.controls.shown = true;
        }
        refuses
    }

    /// No picture is compared any more.
    pub fn end_comparison(&mut self) {
        (self.compared, self.error, self.is_picking) = (None, None, false);
        self.heat.clear();
        if let Some(oracle) = &self.oracle {
            oracle.forget();
        }
    }

    /// Ends the comparison, and removes the selection and the faults of files. False if there was nothing.
    pub fn clear(&mut self) -> bool {
        let was = self.faults.clear() || self.compared.is_some() || self.selected.is_some();
        self.end_comparison();
        self.selected = None;
        was
    }

    fn oracle(&mut self, live: &LiveScene) -> &Oracle {
        let wake = Arc::clone(&self.wake);
        self.oracle.get_or_insert_with(|| Oracle::new(live.still(), move || wake()))
    }

    /// Adds to the panels the textures that the device has not yet.
    pub fn send_textures(&mut self, panels: &mut Panels, presenter: &Presenter) {
        panels.textures = self.overlay.textures(!presenter.has_overlay());
    }

    /// Shows the next view that the scene has, or the one before it. True if the presenter must be fitted again.
    pub fn turn_view(&mut self, presenter: &mut Presenter, live: &mut LiveScene, back: bool) -> bool {
        let ended = self.end_steps(presenter, live);
        let own = live.settings.view;
        for _ in 0..View::NAMES.len() {
            let settings = live.turned(back);
            if self.set(presenter, live, settings) {
                return true;
            }
            // Views that the scene does not have are passed over.
            live.settings.view = live.turned(back).view;
        }
        live.settings.view = own;
        ended
    }

    /// Shows the frame after its next step, or the one before. True if the presenter must be fitted again.
    pub fn step(&mut self, presenter: &mut Presenter, live: &LiveScene, back: bool) -> bool {
        self.end_comparison();
        // A step is of one picture.
        let ended = self.unsplit(presenter);
        let planned = |settings: &Settings| plan_for(&self.device, &live.scene, settings);
        match self.stepper.turn(presenter, &live.settings, back, planned) {
            Ok(unfit) => unfit || ended,
            Err(error) => {
                self.refused = Some(error.to_string());
                self.controls.shown = true;
                ended
            }
        }
    }

    /// Shows the whole frame again. True if the presenter must be fitted again.
    pub fn end_steps(&mut self, presenter: &mut Presenter, live: &LiveScene) -> bool {
        self.end_comparison();
        self.stepper.end(presenter, &live.settings)
    }

    /// Returns the stepper.
    pub fn stepper(&self) -> &Stepper {
        &self.stepper
    }

    /// Splits the window, to show the next view that can be drawn beside the picture, or ends that if no `next` one is asked for. True if the
    /// presenter must be fitted again.
    pub fn split(&mut self, presenter: &mut Presenter, live: &LiveScene, next: bool) -> bool {
        if !next && self.controls.beside.is_some() {
            return self.unsplit(presenter);
        }
        let ended = self.end_steps(presenter, live);
        let last = self.controls.beside.unwrap_or(live.settings.view);
        let mut others = views_after(last, &live.settings);
        match others.find(|settings| plan_for(&self.device, &live.scene, settings).is_ok()) {
            Some(other) => self.show_beside(presenter, Some(other.view)),
            None => {
                self.refused = Some("no other view can be drawn with these settings".into());
                self.controls.shown = true;
            }
        }
        ended || self.controls.beside.is_some()
    }

    /// Shows the picture alone. True if the presenter must be fitted again.
    pub fn unsplit(&mut self, presenter: &mut Presenter) -> bool {
        let was = self.controls.beside.is_some();
        if was {
            self.show_beside(presenter, None);
        }
        was
    }

    fn show_beside(&mut self, presenter: &mut Presenter, view: Option<View>) {
        self.end_comparison();
        if view.is_none() {
            self.divider = Divider::default();
        }
        self.controls.beside = view;
        presenter.show_beside(view);
    }

    /// Makes a change. True if the presenter must be fitted again.
    fn change(
        &mut self,
        presenter: &mut Presenter,
        live: &mut LiveScene,
        before: &PanelValues,
        after: PanelValues,
    ) -> bool {
        let mut unfit = false;
        // The picture will be another one, and so will the truth.
        self.end_comparison();
        if !after.lights.is_empty() || after.roughness != before.roughness {
            self.oracle = None;
        }
        let mut taken = Vec::new();
        for (index, light) in after.lights {
            match presenter.set_light(index, &light) {
                Ok(true) => taken.push(index),
                // It needs other pipelines or maps than before.
                Ok(false) => unfit = true,
                // Panels offer no value that a light cannot have.
                Err(_) => continue,
            }
            live.scene.lights[index] = light;
        }
        if after.exposure != before.exposure {
            (live.exposure, live.settings.exposure) = (after.exposure, Some(after.exposure));
            // Refused only while light is in nits, which has none.
            let _ = presenter.set_exposure(after.exposure);
        }
        // The frames have these values already: going back to the fitted settings must not undo them.
        if let Some((values, lights)) = self.fitted.as_mut().filter(|_| self.before.subject.is_none()) {
            (values.exposure, values.settings.exposure) = (live.exposure, live.settings.exposure);
            for index in taken {
                lights[index] = live.scene.lights[index].clone();
            }
        }
        if after.roughness != before.roughness {
            live.set_roughness(after.roughness);
            // Factors are no part of the scene on the device.
            presenter.change(false);
            unfit = true;
        }
        if after.settings != before.settings {
            let settings = Settings { exposure: live.settings.exposure, ..after.settings };
            unfit |= self.set(presenter, live, settings);
        }
        if unfit {
            let planned = |settings: &Settings| plan_for(&self.device, &live.scene, settings);
            self.stepper.follow(presenter, &live.settings, planned);
        }
        unfit
    }

    /// Takes other settings, if they can be planned.
    fn set(&mut self, presenter: &mut Presenter, live: &mut LiveScene, settings: Settings) -> bool {
        match plan_for(&self.device, &live.scene, &settings) {
            Ok(_) => {
                live.settings = settings;
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
