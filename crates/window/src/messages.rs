//! Messages of the window: each is printed, and lies over the picture for some seconds. A sign lies there while something is computed.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::{Align2, Color32, Context, FontId, Galley, Id, LayerId, Order, Painter, Rect, pos2, vec2};

/// The time for which a message is shown.
const SHOWN: Duration = Duration::from_secs(4);
/// The time for which a warning is shown. It is longer, and nobody waited for it.
const SHOWN_WARNING: Duration = Duration::from_secs(8);
/// Messages that are shown at once: the oldest gives way.
const MOST: usize = 5;
/// Work that is done sooner has no sign, which would only flash.
pub const SOON: Duration = Duration::from_millis(300);
/// How every warning begins.
const WARNING: &str = "warning: ";
/// Points around the text of a message, and between two of them.
const MARGIN: f32 = 6.0;
/// The widest that a line gets, in points.
const WIDEST: f32 = 720.0;

/// A message over the picture.
#[derive(Debug)]
struct Toast {
    text: String,
    /// The moment at which a frame first showed it.
    since: Option<Instant>,
}

impl Toast {
    fn time(&self) -> Duration {
        if self.text.starts_with(WARNING) { SHOWN_WARNING } else { SHOWN }
    }

    /// Returns true if `other` says the same of another value, such as the view that is shown, and goes in this one's place.
    fn is_replaced_by(&self, other: &str) -> bool {
        let subject = |text: &str| text.split_once(": ").map(|(subject, _)| subject.to_owned());
        let is_of_same = subject(other).is_some_and(|own| subject(&self.text) == Some(own));
        self.text == other || !other.starts_with(WARNING) && is_of_same
    }
}

/// Messages that are shown over the picture.
#[derive(Debug, Default)]
pub struct Messages(Vec<Toast>);

impl Messages {
    fn add(&mut self, text: &str) {
        self.0.retain(|own| !own.is_replaced_by(text));
        self.0.push(Toast { text: text.to_owned(), since: None });
        let spare = self.0.len().saturating_sub(MOST);
        self.0.drain(..spare);
    }

    /// Removes messages whose time is over. Returns the time until the next one's is.
    fn expire(&mut self, now: Instant) -> Option<Duration> {
        let left = |own: &Toast| own.since.map_or(own.time(), |since| (since + own.time()).duration_since(now));
        self.0.retain(|own| !left(own).is_zero());
        self.0.iter().map(left).min()
    }

    /// A frame with the messages was shown.
    fn shown(&mut self, now: Instant) {
        for message in &mut self.0 {
            message.since.get_or_insert(now);
        }
    }
}

/// Prints messages to the user, and shows them on the picture.
pub struct Teller<'a> {
    print: &'a dyn Fn(&str),
    /// True if messages are shown on the picture as well as printed.
    pub shows: bool,
    messages: RefCell<Messages>,
}

impl<'a> Teller<'a> {
    pub fn new(print: &'a dyn Fn(&str), shows: bool) -> Self {
        Self { print, shows, messages: RefCell::default() }
    }

    /// Prints a line, and shows it over the picture.
    pub fn tell(&self, line: &str) {
        self.print(line);
        self.show(line);
    }

    /// Only prints it: the picture shows as much in another way.
    pub fn print(&self, text: &str) {
        (self.print)(text);
    }

    /// Only shows it: it was printed before there was a picture, or comes often.
    pub fn show(&self, line: &str) {
        if self.shows {
            self.messages.borrow_mut().add(line);
        }
    }

    /// A frame with the messages was shown.
    pub fn shown(&self) {
        self.messages.borrow_mut().shown(Instant::now());
    }

    /// The notes of a frame that is built now.
    pub fn notes<'s>(&self, now: Instant, sign: Option<&'s str>) -> Notes<'s> {
        let mut messages = self.messages.borrow_mut();
        let next = messages.expire(now);
        Notes { lines: messages.0.iter().map(|own| own.text.clone()).collect(), sign, next }
    }
}

/// The lines that lie over a frame.
pub struct Notes<'s> {
    lines: Vec<String>,
    /// What is computed.
    sign: Option<&'s str>,
    /// The time until a line goes.
    next: Option<Duration>,
}

impl Notes<'_> {
    pub fn is_any(&self) -> bool {
        !self.lines.is_empty() || self.sign.is_some()
    }

    /// Draws the lines over all else, from the lower edge upward, newest last. The mouse goes through them.
    pub fn draw(&self, context: &Context) {
        let painter = context.layer_painter(LayerId::new(Order::Tooltip, Id::new("messages")));
        let screen = context.content_rect();
        let mut bottom = screen.bottom() - 2.0 * MARGIN;
        let lines = self.lines.iter().map(|line| (line.as_str(), color(line)));
        let sign = self.sign.iter().map(|sign| (*sign, Color32::LIGHT_BLUE));
        for (text, color) in lines.chain(sign).rev() {
            let width = (screen.width() - 6.0 * MARGIN).clamp(1.0, WIDEST);
            let galley = painter.layout(text.to_owned(), FontId::proportional(14.0), color, width);
            bottom = line(&painter, pos2(screen.center().x, bottom), galley) - MARGIN;
        }
        if let Some(next) = self.next {
            context.request_repaint_after(next);
        }
    }
}

fn color(line: &str) -> Color32 {
    if line.starts_with(WARNING) { Color32::from_rgb(255, 190, 40) } else { Color32::WHITE }
}

/// A line with its middle above this place. Returns where its box begins.
fn line(painter: &Painter, below: egui::Pos2, galley: Arc<Galley>) -> f32 {
    let size = galley.size();
    let rect: Rect = Align2::CENTER_BOTTOM.anchor_size(below - vec2(0.0, 0.5 * MARGIN), size);
    let around = rect.expand2(vec2(MARGIN, 0.5 * MARGIN));
    painter.rect_filled(around, 3.0, Color32::from_black_alpha(190));
    painter.galley(rect.min, galley, Color32::WHITE);
    around.top()
}

/// Work in the background, and since when.
#[derive(Debug, Default)]
pub struct Busy(Option<(&'static str, Instant)>);

impl Busy {
    /// Takes note of the work that goes on now. Returns its sign if it is due, and otherwise the moment at which it will be.
    pub fn sign(&mut self, work: Option<&'static str>, now: Instant) -> (Option<&'static str>, Option<Instant>) {
        let Some(work) = work else {
            self.0 = None;
            return (None, None);
        };
        let (_, since) = *self.0.get_or_insert((work, now));
        match now.duration_since(since) >= SOON {
            true => (Some(work), None),
            false => (None, Some(since + SOON)),
        }
    }
}

#[cfg(test)]
mod tests {
    use egui::{Pos2, Shape, Vec2};

    use super::*;
    use crate::overlay::context;

    fn texts(messages: &Messages) -> Vec<&str> {
        messages.0.iter().map(|own| own.text.as_str()).collect()
    }

    #[test]
    fn a_message_is_printed_at_once_and_shown_for_its_time_from_its_first_frame_on() {
        let printed = RefCell::new(Vec::new());
        let print = |line: &str| printed.borrow_mut().push(line.to_owned());
        let teller = Teller::new(&print, true);
        teller.tell("view: depth");
        teller.tell("warning: no screenshot: the disk is full");
        assert_eq!(printed.borrow().len(), 2);
        let begin = Instant::now();
        // A frame that takes long takes nothing from it.
        let late = begin + Duration::from_secs(60);
        assert_eq!(teller.notes(late, None).lines.len(), 2);
        teller.shown();
        let shown = Instant::now();
        let notes = teller.notes(shown + SHOWN / 2, None);
        assert!(notes.is_any() && notes.next.is_some_and(|next| next <= SHOWN / 2));
        let notes = teller.notes(shown + SHOWN, None);
        assert_eq!(notes.lines, ["warning: no screenshot: the disk is full"]);
        assert!(!teller.notes(shown + SHOWN_WARNING, None).is_any());
        teller.print("a list of keys");
        assert!(!teller.notes(begin, None).is_any() && teller.notes(begin, Some("drawing...")).is_any());
        let silent = Teller::new(&print, false);
        silent.tell("view: normal");
        assert!(!silent.notes(begin, None).is_any());
        assert_eq!(printed.borrow().len(), 4);
    }

    #[test]
    fn a_message_of_the_same_subject_takes_the_place_of_the_one_before_and_few_are_shown() {
        let mut messages = Messages::default();
        for text in
            ["view: depth", "clips: all plays at 0.1 s", "view: normal", "warning: a", "warning: b", "warning: a"]
        {
            messages.add(text);
        }
        assert_eq!(texts(&messages), ["clips: all plays at 0.1 s", "view: normal", "warning: b", "warning: a"]);
        for number in 0..9 {
            messages.add(&format!("no camera is kept as {number}"));
        }
        assert_eq!(messages.0.len(), MOST);
        assert_eq!(texts(&messages)[MOST - 1], "no camera is kept as 8");
    }

    #[test]
    fn lines_stay_in_the_window_one_above_the_other() {
        let long = "warning: not all of it moves: a sentence that is far longer than the window is wide, so that it has many lines";
        for size in [Vec2::new(240.0, 200.0), Vec2::new(1280.0, 800.0)] {
            let context = context();
            let notes = Notes { lines: vec!["view: depth".into(), long.into()], sign: Some("drawing..."), next: None };
            let screen = Rect::from_min_size(Pos2::ZERO, size);
            let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
            let output = context.run(input, |context| notes.draw(context));
            let boxes: Vec<Rect> = output
                .shapes
                .iter()
                .filter_map(|own| match &own.shape {
                    Shape::Rect(own) => Some(own.rect),
                    _ => None,
                })
                .collect();
            assert_eq!(boxes.len(), 3);
            assert!(boxes.iter().all(|own| screen.contains_rect(*own)), "{boxes:?}");
            assert!(boxes[0].top() >= boxes[1].bottom() && boxes[1].top() >= boxes[2].bottom(), "the sign is lowest");
            let under = context.layer_id_at(boxes[1].center());
            assert!(under.is_none_or(|layer| layer.order == Order::Background), "the mouse goes through");
        }
    }

    #[test]
    fn work_that_is_soon_done_has_no_sign() {
        let (mut busy, begin) = (Busy::default(), Instant::now());
        assert_eq!(busy.sign(Some("reading"), begin), (None, Some(begin + SOON)));
        assert_eq!(busy.sign(None, begin + SOON / 2), (None, None));
        assert_eq!(busy.sign(Some("reading"), begin + SOON), (None, Some(begin + 2 * SOON)));
        assert_eq!(busy.sign(Some("reading"), begin + 2 * SOON), (Some("reading"), None));
    }
}
