//! Events of the window.

use std::time::Instant;

use winit::application::ApplicationHandler;
use winit::dpi::PhysicalPosition;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::PhysicalKey;
use winit::window::WindowId;

use super::{App, Opened};
use crate::Error;
use crate::keys::hold;

/// Pixels that a wheel which tells its way in pixels goes for a notch.
const PIXELS_A_NOTCH: f64 = 40.0;
/// Pixels that the mouse may go while a button is held down for a click.
const CLICK: f64 = 4.0;

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        events.set_control_flow(ControlFlow::Wait);
        if self.opened.is_some() {
            return;
        }
        if let Err(error) = self.open(events) {
            self.failure = Some(error);
            events.exit();
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if self.is_for_panels(&event) {
            return;
        }
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::Destroyed => {
                // Not by us: our window lives until the loop has ended.
                self.failure.get_or_insert_with(|| Error::System("the window was destroyed".into()));
                events.exit();
            }
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                (self.misfit, self.content, self.hidden) = (true, false, false);
                if let Some(opened) = &mut self.opened {
                    opened.interface.end_comparison();
                }
                self.ask_for_frame();
            }
            WindowEvent::Occluded(occluded) => {
                (self.hidden, self.again) = (occluded, None);
                if !occluded {
                    self.ask_for_frame();
                }
            }
            WindowEvent::RedrawRequested => self.redraw(events),
            WindowEvent::Focused(false) => {
                (self.held, self.dragging) = Default::default();
                self.let_go_of_divider();
                (self.with_control, self.with_shift) = (false, false);
            }
            WindowEvent::ModifiersChanged(modifiers) => {
                (self.with_control, self.with_shift) = (modifiers.state().control_key(), modifiers.state().shift_key());
            }
            WindowEvent::KeyboardInput { event, is_synthetic, .. } => {
                let PhysicalKey::Code(key) = event.physical_key else { return };
                let pressed = event.state == ElementState::Pressed;
                if hold(&mut self.held, key, pressed) {
                    self.ask_for_frame();
                } else if pressed && !event.repeat && !is_synthetic {
                    // Synthetic ones were pressed in another window.
                    self.press(events, key);
                }
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } if self.grip(state) => {}
            WindowEvent::MouseInput { state, button: button @ (MouseButton::Left | MouseButton::Right), .. } => {
                self.press_button(state == ElementState::Pressed, button);
            }
            WindowEvent::CursorMoved { position, .. } => self.drag(position),
            WindowEvent::MouseWheel { delta, .. } => {
                self.control.wheel(match delta {
                    MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                    MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_A_NOTCH,
                });
                if let Some(speed) = self.control.flying_speed() {
                    self.teller.show(&format!("speed: {speed:.3} m a second"));
                }
                self.ask_for_frame();
            }
            _ => {}
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, (): ()) {
        // An answer has come.
        if let Some(opened) = &mut self.opened {
            opened.interface.listen(self.control.camera());
        }
        self.apply_reloads();
        self.ask_for_frame();
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // While the connection to the window system is open.
        self.opened = None;
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let now = Instant::now();
        // Motion does not wait for the moment of the next redraw.
        let is_due = self.again.is_some_and(|again| again <= now);
        let flow = if is_due || self.goes_on() {
            self.again = None;
            self.ask_for_frame();
            ControlFlow::Wait
        } else {
            self.clock.pause();
            self.advanced = None;
            self.live.player.rest();
            self.again.map_or(ControlFlow::Wait, ControlFlow::WaitUntil)
        };
        events.set_control_flow(flow);
    }
}

impl App<'_> {
    /// Hands an event to the panels. True if it is not for the picture.
    fn is_for_panels(&mut self, event: &WindowEvent) -> bool {
        let Some(Opened { interface, window, .. }) = &mut self.opened else { return false };
        let taken = interface.event(window, event);
        if taken.changes {
            window.request_redraw();
        }
        // A button or key that was pressed over the picture may be let go over a panel.
        let lets_go = match event {
            WindowEvent::MouseInput { state, .. } => *state == ElementState::Released,
            WindowEvent::KeyboardInput { event, .. } => event.state == ElementState::Released,
            _ => false,
        };
        taken.consumed && !lets_go
    }

    fn press_button(&mut self, pressed: bool, button: MouseButton) {
        // A button that is let go where it was pressed is a click.
        if !pressed && self.dragging && button == MouseButton::Left && self.way < CLICK {
            self.pick();
        }
        let place = PhysicalPosition::new(self.mouse.x, self.mouse.y);
        (self.dragging, self.dragged, self.way) = (pressed, pressed.then_some(place), 0.0);
    }
}
