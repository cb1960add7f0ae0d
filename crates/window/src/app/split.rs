//! Input to a split window, and pictures of light, which ignore the split.

use std::time::Instant;

use winit::event::ElementState;

use super::{App, Opened};
use crate::WindowOptions;
use crate::live_scene::LiveScene;
use crate::messages::Teller;
use crate::split::Grip;
use crate::user_interface::UserInterface;
use afterlight::frame::Presenter;
use afterlight::scene::{Camera, Settings};

impl App<'_> {
    /// Splits the window, turns to the next view beside the picture, or shows the picture alone.
    pub(super) fn split(&mut self, next: bool) {
        if let Some(Opened { interface, presenter, .. }) = &mut self.opened {
            self.unfit |= interface.split(presenter, &self.live, next);
            let own = self.live.settings.view;
            self.teller.tell(&match interface.controls.beside {
                Some(beside) => format!("split: {own} | {beside}"),
                None => "split: none".to_owned(),
            });
        }
    }

    /// The left button goes down or up. True if that was for the divider.
    pub(super) fn grip(&mut self, state: ElementState) -> bool {
        let (x, width) = (self.mouse.x, self.width());
        let Some(Opened { interface, presenter, .. }) = &mut self.opened else { return false };
        if interface.controls.beside.is_none() {
            return false;
        }
        if state == ElementState::Released {
            return interface.divider.release();
        }
        match interface.divider.press(x, width, Instant::now()) {
            Grip::Missed => return false,
            Grip::Held => {}
            Grip::Ended => {
                self.unfit |= interface.unsplit(presenter);
                self.teller.tell("split: none");
            }
        }
        self.ask_for_frame();
        true
    }

    /// The mouse has moved. True if it takes the divider with it.
    pub(super) fn drag_divider(&mut self) -> bool {
        let (x, width) = (self.mouse.x, self.width());
        let drags = self.opened.as_mut().is_some_and(|opened| opened.interface.divider.drag(x, width));
        if drags {
            self.ask_for_frame();
        }
        drags
    }

    pub(super) fn let_go_of_divider(&mut self) {
        if let Some(opened) = &mut self.opened {
            opened.interface.divider.release();
        }
    }

    /// Width of the window in pixels.
    fn width(&self) -> u32 {
        self.opened.as_ref().map_or(1, |opened| opened.window.inner_size().width)
    }
}

/// Compares, where the window shows more than white, a picture that ends there: the truth knows of nothing brighter.
pub(super) fn compare_up_to_white(
    presenter: &Presenter,
    interface: &mut UserInterface,
    (subject, camera): (&LiveScene, &Camera),
    teller: &Teller,
) {
    if interface.refuses_comparison(subject) {
        return;
    }
    let size = presenter.window_size().unwrap_or(subject.settings.size);
    let settings = Settings { size, ..subject.settings.clone() };
    match presenter.picture_apart(&subject.scene, &settings, camera) {
        Ok(picture) => interface.compare(subject, *camera, &picture),
        Err(error) => teller.tell(&format!("warning: no picture: {error}")),
    }
}

/// Keeps the light that the window's picture from this camera is made of.
pub(super) fn keep_light(
    presenter: &Presenter,
    live: &LiveScene,
    camera: &Camera,
    (options, teller): (&WindowOptions, &Teller),
) {
    let size = presenter.window_size().unwrap_or(live.settings.size);
    let picture = presenter.picture_apart(&live.scene, &live.in_nits(size), camera);
    let told = picture.map_err(|error| error.to_string()).and_then(|picture| (options.keep)(&picture));
    teller.tell(&told.unwrap_or_else(|error| format!("warning: no screenshot: {error}")));
}
