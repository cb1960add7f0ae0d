//! Goes through the steps of a frame: which one the window shows, and the panel that lists them.

use egui::style::ScrollAnimation;
use egui::{Align2, Context, RichText, ScrollArea, Ui, pos2};

use super::super::controls::is_small;
use super::{FrameStep, turned};
use afterlight::frame::{DrawCounts, Presenter};
use afterlight::plan::{self, FramePlan};
use afterlight::scene::{Scene, Settings, View};

/// A request on the panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StepRequest {
    Turn { back: bool },
    Show(usize),
    End,
}

/// The frame whose steps are shown.
struct Stepped {
    /// Plan of the whole frame.
    plan: FramePlan,
    settings: Settings,
    steps: Vec<FrameStep>,
    /// The step that is shown.
    now: usize,
}

impl Stepped {
    fn step(&self) -> FrameStep {
        self.steps[self.now]
    }

    fn drawn_settings(&self) -> Settings {
        self.step().settings(&self.settings, &self.plan)
    }
}

/// The window's place among the steps of a frame.
#[derive(Default)]
pub struct Stepper {
    /// `None` while the window shows whole frames.
    shown: Option<Stepped>,
    wish: Option<StepRequest>,
    /// The frame is new to the panel, which then lists its draws and scrolls to its line.
    is_new: bool,
}

impl Stepper {
    /// Returns true if the window shows a step and not the whole frame.
    pub fn is_open(&self) -> bool {
        self.shown.is_some()
    }

    /// The settings of the step that is to be drawn, where `whole` are the user's.
    pub fn drawn_settings(&self, whole: &Settings) -> Settings {
        let drawn = self.shown.as_ref().map_or_else(|| whole.clone(), Stepped::drawn_settings);
        // It changes without another plan.
        Settings { exposure: whole.exposure, ..drawn }
    }

    /// Goes one step forward or back; from the whole frame to its first or last step, and from there back to the whole frame. `planned` plans frames
    /// of these settings. Returns true if the presenter must be fitted again.
    ///
    /// # Errors
    /// When the whole frame cannot be planned.
    pub fn turn(
        &mut self,
        presenter: &mut Presenter,
        whole: &Settings,
        back: bool,
        planned: impl Fn(&Settings) -> Result<FramePlan, plan::PlanError>,
    ) -> Result<bool, plan::PlanError> {
        let before = self.drawn_settings(whole);
        match &mut self.shown {
            Some(shown) => match turned(Some(shown.now), shown.steps.len(), back) {
                Some(now) => shown.now = now,
                None => self.shown = None,
            },
            None => {
                let mut shown = stepped(whole, planned)?;
                if let Some(now) = turned(None, shown.steps.len(), back) {
                    shown.now = now;
                    self.shown = Some(shown);
                }
            }
        }
        Ok(self.show(presenter, whole, &before))
    }

    /// Shows whole frames again. True if the presenter must be fitted again.
    pub fn end(&mut self, presenter: &mut Presenter, whole: &Settings) -> bool {
        let before = self.drawn_settings(whole);
        self.shown = None;
        self.show(presenter, whole, &before)
    }

    /// Stays at the same step of a frame that has changed, if it still has that step. True if the presenter must be fitted again.
    pub fn follow(
        &mut self,
        presenter: &mut Presenter,
        whole: &Settings,
        planned: impl Fn(&Settings) -> Result<FramePlan, plan::PlanError>,
    ) -> bool {
        let before = self.drawn_settings(whole);
        let Some(old) = &self.shown else { return false };
        let found = stepped(whole, planned).ok().and_then(|mut shown| {
            shown.now = shown.steps.iter().position(|&step| step == old.step())?;
            Some(shown)
        });
        self.shown = found;
        self.show(presenter, whole, &before)
    }

    /// Makes the changes that were asked for on the panel. True if the presenter must be fitted again.
    pub fn obey(&mut self, presenter: &mut Presenter, whole: &Settings) -> bool {
        let before = self.drawn_settings(whole);
        let (Some(wish), Some(shown)) = (self.wish.take(), &mut self.shown) else { return false };
        let now = match wish {
            StepRequest::Turn { back } => turned(Some(shown.now), shown.steps.len(), back),
            StepRequest::Show(place) => Some(place).filter(|&place| place < shown.steps.len()),
            StepRequest::End => None,
        };
        match now {
            Some(now) => shown.now = now,
            None => self.shown = None,
        }
        self.show(presenter, whole, &before)
    }

    /// Has the presenter draw the step that is shown now, where frames were drawn with `before`.
    fn show(&mut self, presenter: &mut Presenter, whole: &Settings, before: &Settings) -> bool {
        let halt = self.shown.as_ref().and_then(|shown| shown.step().halt(&shown.plan));
        self.is_new = self.shown.is_some();
        let is_other = self.drawn_settings(whole) != *before;
        if is_other {
            presenter.change(false);
        }
        presenter.halt_after(halt);
        is_other
    }

    /// The step that is shown, in a line.
    pub fn line(&self, scene: &Scene) -> String {
        match &self.shown {
            None => "step: the whole frame".into(),
            Some(Stepped { plan, steps, now, .. }) => {
                let step = steps[*now];
                format!("step {} of {}: {}, {}", now + 1, steps.len(), step.pass(plan), step.name(plan, scene))
            }
        }
    }

    /// Builds the panel; `drawn` has the figures of the last frame.
    pub fn panel(&mut self, context: &Context, scene: &Scene, drawn: &DrawCounts) {
        let Some(shown) = &self.shown else { return };
        let screen = context.content_rect();
        // The panel opens below the panel of the selection, if there is room for both, and beside the main panel.
        let right_top = pos2(screen.right() - 12.0, if is_small(context) { 12.0 } else { 190.0 });
        let width = (screen.width() - 400.0).clamp(120.0, 300.0);
        let window = egui::Window::new("Frame steps").pivot(Align2::RIGHT_TOP).default_pos(right_top);
        let (mut open, mut wish) = (true, self.wish);
        window.default_width(width).open(&mut open).show(context, |ui| {
            // In a low window all of it goes up and down, and not the list alone.
            let whole = ScrollArea::vertical().id_salt("panel").max_height(screen.height() - 80.0);
            whole.auto_shrink([false, true]).show(ui, |ui| {
                present(ui, shown, scene, drawn);
                ui.horizontal_wrapped(|ui| {
                    for (text, own) in [
                        ("back (,)", StepRequest::Turn { back: true }),
                        ("on (.)", StepRequest::Turn { back: false }),
                        ("whole frame (Esc)", StepRequest::End),
                    ] {
                        if ui.button(text).clicked() {
                            wish = Some(own);
                        }
                    }
                });
                ui.separator();
                let height = (screen.height() - 320.0).max(60.0);
                ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
                    if let Some(place) = list(ui, shown, scene, self.is_new) {
                        wish = Some(StepRequest::Show(place));
                    }
                });
            });
        });
        self.wish = if open { wish } else { Some(StepRequest::End) };
    }

    /// Returns true if the panel should be built once more at once: only then does it have the figures of the present step's frame.
    pub fn take_new(&mut self) -> bool {
        std::mem::take(&mut self.is_new)
    }
}

/// Returns the steps of the whole frame of these settings, at the first step. Settings that show a view have the steps of the picture.
fn stepped(
    whole: &Settings,
    planned: impl Fn(&Settings) -> Result<FramePlan, plan::PlanError>,
) -> Result<Stepped, plan::PlanError> {
    let view = if whole.view == View::Lighting { View::Lighting } else { View::Final };
    let settings = Settings { view, ..whole.clone() };
    let plan = planned(&settings)?;
    let mut steps = FrameStep::all(&plan);
    steps.retain(|step| planned(&step.settings(&settings, &plan)).is_ok());
    Ok(Stepped { plan, settings, steps, now: 0 })
}

/// Shows the present step.
fn present(ui: &mut Ui, shown: &Stepped, scene: &Scene, drawn: &DrawCounts) {
    let (step, plan) = (shown.step(), &shown.plan);
    ui.label(RichText::new(format!("{} of {}", shown.now + 1, shown.steps.len())).weak());
    ui.strong(format!("{}: {}", step.pass(plan), step.name(plan, scene)));
    ui.label(step.sentence(plan, scene));
    ui.label(RichText::new(step.counts(drawn)).weak());
}

/// All steps below the names of their passes. The one that is clicked at.
fn list(ui: &mut Ui, shown: &Stepped, scene: &Scene, scrolls: bool) -> Option<usize> {
    let (mut clicked, mut pass) = (None, "");
    for (place, step) in shown.steps.iter().enumerate() {
        let own = step.pass(&shown.plan);
        if own != pass {
            ui.strong(own);
            pass = own;
        }
        let is_now = place == shown.now;
        let name = match *step {
            // Names may be the same.
            FrameStep::Lights { first, end } if end == first + 1 => {
                format!("  {end}. {}", step.name(&shown.plan, scene))
            }
            _ => format!("  {}", step.name(&shown.plan, scene)),
        };
        let line = ui.selectable_label(is_now, name);
        if is_now && scrolls {
            line.scroll_to_me_animation(None, ScrollAnimation::none());
        }
        if line.clicked() {
            clicked = Some(place);
        }
    }
    clicked
}
