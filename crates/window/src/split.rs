//! The divider of a window that is split: left of it is the picture, right of it another view of the same camera. Both are drawn by
//! [`afterlight::frame::Presenter`].

use std::time::{Duration, Instant};

use egui::{Align2, Color32, Context, CursorIcon, FontId, LayerId, Rect, Stroke, pos2, vec2};

use afterlight::scene::{Settings, View};

/// Pixels from the divider within which the mouse takes hold of it.
const REACH: f64 = 5.0;
/// Two clicks within this time are one.
const DOUBLE_CLICK: Duration = Duration::from_millis(400);
/// Points between the divider and the names beside it.
const GAP: f32 = 8.0;

/// The mouse's action on the divider.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grip {
    /// Nothing: it is elsewhere.
    Missed,
    Held,
    /// A double-click ends the split.
    Ended,
}

/// The line that divides the window.
#[derive(Debug, Clone, Copy)]
pub struct Divider {
    /// The part of the width that is left of it, 0 to 1.
    at: f64,
    held: bool,
    /// The moment and the place, in pixels, at which it was last taken hold of.
    pressed: Option<(Instant, f64)>,
}

impl Default for Divider {
    fn default() -> Self {
        Self { at: 0.5, held: false, pressed: None }
    }
}

impl Divider {
    /// The part of the width that is left of it, 0 to 1.
    pub fn at(&self) -> f64 {
        self.at
    }

    /// Returns true if the mouse holds it, or could take hold of it, `x` pixels from the left of a window `width` pixels wide.
    pub fn is_near(&self, x: f64, width: u32) -> bool {
        self.held || (x - self.at * f64::from(width)).abs() <= REACH
    }

    /// A button of the mouse goes down there.
    pub fn press(&mut self, x: f64, width: u32, now: Instant) -> Grip {
        if !self.is_near(x, width) {
            self.pressed = None;
            return Grip::Missed;
        }
        let again =
            |(last, place): (Instant, f64)| now.duration_since(last) < DOUBLE_CLICK && (x - place).abs() <= REACH;
        if self.pressed.replace((now, x)).is_some_and(again) {
            return Grip::Ended;
        }
        self.held = true;
        Grip::Held
    }

    /// The button is let go. True if that was of the divider.
    pub fn release(&mut self) -> bool {
        std::mem::take(&mut self.held)
    }

    /// The mouse is there. True if it takes the divider with it.
    pub fn drag(&mut self, x: f64, width: u32) -> bool {
        if self.held {
            // Not out of the window, where nobody could take hold of it again.
            self.at = (x / f64::from(width.max(1))).clamp(0.0, 1.0);
        }
        self.held
    }

    /// Draws it over the picture, with the names of the two views beside it.
    pub fn draw(&self, context: &Context, [left, right]: [View; 2]) {
        let screen = context.content_rect();
        let scale = context.pixels_per_point();
        // The line is at the border of two pixels, as the pictures are.
        let x = screen.left() + (self.at * f64::from(screen.width() * scale)).round() as f32 / scale;
        let painter = context.layer_painter(LayerId::background());
        painter.vline(x, screen.y_range(), Stroke::new(3.0_f32, Color32::from_black_alpha(140)));
        painter.vline(x, screen.y_range(), Stroke::new(1.0_f32, Color32::WHITE));
        let names = [(left, Align2::RIGHT_TOP, -GAP), (right, Align2::LEFT_TOP, GAP)];
        for (view, anchor, gap) in names {
            let place = pos2(x + gap, screen.top() + GAP);
            let text = painter.layout_no_wrap(view.to_string(), FontId::proportional(14.0), Color32::WHITE);
            let rect: Rect = anchor.anchor_size(place, text.size());
            painter.rect_filled(rect.expand2(vec2(4.0, 2.0)), 3.0, Color32::from_black_alpha(160));
            painter.galley(rect.min, text, Color32::WHITE);
        }
        let pointer = context.pointer_latest_pos();
        let over = pointer.is_some_and(|pointer| {
            self.is_near(f64::from((pointer.x - screen.left()) * scale), (screen.width() * scale).round() as u32)
        });
        let covered = pointer
            .and_then(|pointer| context.layer_id_at(pointer))
            .is_some_and(|layer| layer.order != egui::Order::Background);
        if self.held || over && !covered {
            context.set_cursor_icon(CursorIcon::ResizeColumn);
        }
    }
}

/// Returns the settings of the views after `last`, around to it, without the picture's own view.
pub fn views_after(last: View, settings: &Settings) -> impl Iterator<Item = Settings> {
    let views = View::NAMES;
    let first = views.iter().position(|&(_, view)| view == last).map_or(0, |index| index + 1);
    let around = (0..views.len()).map(move |step| views[(first + step) % views.len()].1);
    let others = around.filter(|&view| view != settings.view);
    others.map(|view| Settings { view, ..settings.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_divider_is_held_within_a_few_pixels_and_goes_with_the_mouse_but_not_out_of_the_window() {
        let (mut divider, now) = (Divider::default(), Instant::now());
        assert_eq!(divider.press(60.0, 100, now), Grip::Missed);
        assert!(!divider.drag(70.0, 100) && !divider.release());
        assert_eq!(divider.press(54.0, 100, now), Grip::Held);
        assert!(divider.drag(20.0, 100) && (divider.at() - 0.2).abs() < 1e-12);
        assert!(divider.drag(-7.0, 100) && divider.at() == 0.0 && divider.is_near(300.0, 100));
        assert!(divider.drag(107.0, 100) && divider.at() == 1.0 && divider.release());
        assert!(divider.is_near(99.0, 100) && !divider.is_near(90.0, 100));
        // A window without a width.
        assert_eq!(divider.press(0.0, 0, now + 2 * DOUBLE_CLICK), Grip::Held);
        assert!(divider.drag(3.0, 0) && divider.at() == 1.0);
    }

    #[test]
    fn two_clicks_end_the_split_if_they_are_quick_and_both_on_the_divider() {
        let (mut divider, now) = (Divider::default(), Instant::now());
        let click = |divider: &mut Divider, x: f64, after: Duration| {
            let grip = divider.press(x, 100, now + after);
            divider.release();
            grip
        };
        assert_eq!(click(&mut divider, 50.0, Duration::ZERO), Grip::Held);
        assert_eq!(click(&mut divider, 50.0, DOUBLE_CLICK), Grip::Held);
        assert_eq!(click(&mut divider, 10.0, DOUBLE_CLICK * 3 / 2), Grip::Missed);
        assert_eq!(click(&mut divider, 51.0, DOUBLE_CLICK * 7 / 4), Grip::Held);
        assert_eq!(click(&mut divider, 51.0, 2 * DOUBLE_CLICK), Grip::Ended);
        // A drag in between is no click.
        let (mut divider, soon) = (Divider::default(), now + DOUBLE_CLICK / 2);
        assert_eq!(divider.press(50.0, 100, now), Grip::Held);
        assert!(divider.drag(80.0, 100) && divider.release());
        assert_eq!(divider.press(80.0, 100, soon), Grip::Held);
    }

    #[test]
    fn every_view_but_that_of_the_picture_comes_once() {
        let settings = Settings { view: View::Albedo, ..Settings::default() };
        let views: Vec<View> = views_after(View::Albedo, &settings).map(|settings| settings.view).collect();
        assert_eq!(views.len(), View::NAMES.len() - 1);
        assert_eq!((views[0], views.contains(&View::Albedo)), (View::Metallic, false));
        assert_eq!(views_after(views[0], &settings).next().map(|settings| settings.view), Some(views[1]));
        let last = View::NAMES[View::NAMES.len() - 1].1;
        assert_eq!(views_after(last, &settings).next().map(|settings| settings.view), Some(View::NAMES[0].1));
    }
}
