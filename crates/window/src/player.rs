//! Clips in a window: the choice that plays, the picture's moment in it, and the frames' pose of that moment.

use std::time::Instant;

use egui::{ComboBox, Slider, SliderClamping, Ui};

use afterlight::frame::{self, Presenter};
use afterlight::scene::{ClipChoice, Motion, Playing, Pose, Scene};

/// Seconds that a key goes forward or back.
const NUDGE: f64 = 1.0 / 30.0;
/// The longest that a frame goes forward, in seconds: a longer interval was no motion but a pause.
const LONGEST: f64 = 0.25;

/// The playback of a scene's clips.
#[derive(Debug, Clone, Default)]
pub struct Player {
    pub playing: Playing,
    runs: bool,
    /// The scene has particles, which go on without end.
    emits: bool,
    /// The moment up to which it has played, unless it has rested since.
    advanced: Option<Instant>,
    /// The frames do not show this moment yet.
    is_new: bool,
    /// It is another moment, or of other clips, than before.
    has_moved: bool,
    pose: Pose,
}

impl Player {
    /// Runs at once where anything moves, unless it is to rest at its moment.
    pub fn new(motion: &Motion, playing: Playing, rests: bool) -> Self {
        let runs = !rests && motion.duration(&playing.clips) > 0.0;
        Self { playing, runs, is_new: !motion.is_empty(), ..Self::default() }
    }

    /// Sets whether the scene has particles, which go on where nothing else moves.
    pub fn emitting(self, emits: bool, rests: bool) -> Self {
        Self { emits, runs: self.runs || emits && !rests, is_new: self.is_new || emits, ..self }
    }

    /// Returns the player for the scene as it was read again; its clips may be others.
    pub fn renewed(&self, motion: &Motion) -> Self {
        let fits = match &self.playing.clips {
            ClipChoice::Only(clips) => clips.iter().all(|&clip| clip < motion.clips.len()),
            ClipChoice::All | ClipChoice::None => true,
        };
        let clips = if fits { self.playing.clips.clone() } else { motion.usual_clips() };
        let playing = Playing { clips, ..self.playing.clone() };
        let goes_on = self.emits || motion.duration(&playing.clips) > 0.0;
        Self { runs: self.runs && goes_on, ..Self::new(motion, playing, true).emitting(self.emits, true) }
    }

    /// Returns true if the picture changes by itself.
    pub fn runs(&self) -> bool {
        self.runs
    }

    /// Frames were made anew: they show the scene at rest.
    pub fn show_again(&mut self) {
        self.is_new = true;
    }

    /// Returns true once if the moment or the clips have changed.
    pub fn take_moved(&mut self) -> bool {
        std::mem::take(&mut self.has_moved)
    }

    /// No frame follows for now.
    pub fn rest(&mut self) {
        self.advanced = None;
    }

    /// Plays or pauses. Clips that have come to their end begin again.
    pub fn toggle(&mut self, motion: &Motion) {
        let duration = motion.duration(&self.playing.clips);
        self.runs = !self.runs && (self.emits || duration > 0.0);
        if self.runs && !self.playing.looped && !self.emits && self.playing.time >= duration {
            self.scrub(0.0);
        }
        self.advanced = None;
    }

    /// Pauses, a little before or after the moment.
    pub fn nudge(&mut self, motion: &Motion, back: bool) {
        let duration = motion.duration(&self.playing.clips);
        self.runs = false;
        if duration > 0.0 {
            let time = self.playing.time + if back { -NUDGE } else { NUDGE };
            self.scrub(time.rem_euclid(duration));
        } else if self.emits {
            self.scrub(self.playing.time + if back { -NUDGE } else { NUDGE });
        }
    }

    /// Goes to a moment.
    pub fn scrub(&mut self, time: f64) {
        self.has_moved |= time != self.playing.time;
        self.is_new |= self.has_moved;
        self.playing.time = time;
    }

    /// The next choice, or the one before: all clips, each of them, and none.
    pub fn turn(&mut self, motion: &Motion, back: bool) {
        let all = choices(motion);
        let now = all.iter().position(|(_, own)| *own == self.playing.clips).unwrap_or_default();
        let next = (now + if back { all.len() - 1 } else { 1 }) % all.len();
        self.choose(all[next].1.clone());
    }

    fn choose(&mut self, clips: ClipChoice) {
        self.has_moved |= clips != self.playing.clips;
        self.is_new |= self.has_moved;
        self.playing.clips = clips;
    }

    /// Returns its state, in a line.
    pub fn line(&self, motion: &Motion) -> String {
        if motion.clips.is_empty() {
            return "clips: the scene has none".into();
        }
        let all = choices(motion);
        let name = all.iter().find(|(_, own)| *own == self.playing.clips).map_or("several", |(name, _)| name);
        let state = if self.runs { "plays" } else { "rests" };
        format!("clips: {name} {state} at {:.3} s", self.playing.time)
    }

    /// Goes on, up to now. True where the moment is another than the frames show.
    pub fn advance(&mut self, now: Instant, motion: &Motion) -> bool {
        if self.runs {
            let since = self.advanced.replace(now).map_or(0.0, |last| now.duration_since(last).as_secs_f64());
            self.scrub(self.playing.time + since.min(LONGEST));
            let duration = motion.duration(&self.playing.clips);
            if !self.playing.looped && !self.emits && self.playing.time >= duration {
                // All clips stay at their ends: further frames would show the same.
                self.scrub(duration);
                self.runs = false;
            }
        }
        if self.is_new {
            motion.pose_into(&self.playing, &mut self.pose);
        }
        self.is_new
    }

    /// Has the frames show the moment, if they do not yet. The scene's objects are where the pose puts them then.
    ///
    /// # Errors
    /// As of [`Presenter::pose`].
    pub fn show(&mut self, presenter: &mut Presenter, scene: &mut Scene) -> Result<(), frame::Error> {
        if !std::mem::take(&mut self.is_new) {
            return Ok(());
        }
        for object in &mut scene.objects {
            object.transform = self.pose.object_transform(object);
        }
        presenter.pose(scene, &self.pose)
    }

    /// Builds the part of the panels that shows and changes the playback.
    pub fn panel(&mut self, ui: &mut Ui, motion: &Motion) {
        ui.horizontal(|ui| {
            let text = if self.runs { "pause (Enter)" } else { "play (Enter)" };
            if ui.button(text).clicked() {
                self.toggle(motion);
            }
            ui.checkbox(&mut self.playing.looped, "loop").on_hover_text("Begin each clip again when it is over");
        });
        let all = choices(motion);
        let mut clips = self.playing.clips.clone();
        let name = all.iter().find(|(_, own)| *own == clips).map_or("several", |(name, _)| name);
        ComboBox::from_label("clip (N)").selected_text(name).show_ui(ui, |ui| {
            for (name, own) in &all {
                ui.selectable_value(&mut clips, own.clone(), name);
            }
        });
        self.choose(clips);
        let duration = motion.duration(&self.playing.clips);
        if duration > 0.0 {
            let mut time = if self.playing.looped { self.playing.time.rem_euclid(duration) } else { self.playing.time };
            let before = time;
            ui.add(moment(&mut time, duration).text("s ([ and ])"));
            if time != before {
                self.runs = false;
                self.scrub(time);
            }
        }
    }
}

/// A slider for a moment of a clip that shows milliseconds. A slider of fixed decimals would write the rounded moment back in each frame, as if the
/// user had moved it, and one that clamps a moment beyond the clip's end.
fn moment(time: &mut f64, duration: f64) -> Slider<'_> {
    let slider = Slider::new(time, 0.0..=duration).clamping(SliderClamping::Edits);
    slider.custom_formatter(|seconds, _| format!("{seconds:.3}"))
}

/// Returns the choices of clips, by name.
fn choices(motion: &Motion) -> Vec<(String, ClipChoice)> {
    let each = motion.clips.iter().enumerate();
    let each = each.map(|(index, clip)| (format!("{index} {}", clip.name), ClipChoice::Only(vec![index])));
    let all = std::iter::once(("all".to_owned(), ClipChoice::All)).chain(each);
    all.chain(std::iter::once(("none".to_owned(), ClipChoice::None))).collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use afterlight::scene::builtin;

    #[test]
    fn it_plays_by_the_clock_pauses_and_goes_on_from_there() {
        let motion = builtin::open("seaweed?count=2").expect("built in").motion;
        let mut player = Player::new(&motion, Playing::default(), false);
        let begin = Instant::now();
        let at = |ms| begin + Duration::from_millis(ms);
        assert!(player.advance(at(0), &motion) && player.advance(at(100), &motion));
        assert!((player.playing.time - 0.1).abs() < 1e-9 && player.runs());
        player.toggle(&motion);
        assert!(!player.runs());
        player.is_new = false;
        assert!(!player.advance(at(5000), &motion), "a pause changes nothing");
        player.toggle(&motion);
        player.advance(at(9000), &motion);
        player.advance(at(9050), &motion);
        assert!((player.playing.time - 0.15).abs() < 1e-9, "{}", player.playing.time);
        // A frame that took long is no leap.
        player.advance(at(99_000), &motion);
        assert!((player.playing.time - 0.15 - LONGEST).abs() < 1e-9);
    }

    /// Shows the panel of clips once, in a window, at a mouse that does this.
    fn show(context: &egui::Context, player: &mut Player, motion: &Motion, events: Vec<egui::Event>) {
        let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::Vec2::new(400.0, 300.0));
        let input = egui::RawInput { screen_rect: Some(screen), events, ..Default::default() };
        let _ = context.run(input, |context| {
            egui::CentralPanel::default().show(context, |ui| player.panel(ui, motion));
        });
    }

    #[test]
    fn a_panel_that_nobody_touches_changes_no_moment_and_a_dragged_slider_does() {
        let motion = builtin::open("seaweed?count=2").expect("built in").motion;
        let context = crate::overlay::context();
        // A moment between milliseconds, one that wraps, and one beyond the end of clips that do not.
        for (time, looped) in [(1.234_567_891, true), (12.0 * 7.0 + 0.000_123, true), (99.000_07, false)] {
            let playing = Playing { looped, ..Playing::at(time) };
            let mut player = Player { playing, runs: true, ..Player::default() };
            for _ in 0..3 {
                show(&context, &mut player, &motion, Vec::new());
            }
            assert_eq!((player.playing.time, player.runs()), (time, true), "looped: {looped}");
        }
        // The slider is the last line of the panel: a drag across each line from below meets it first.
        let mut player = Player { playing: Playing::at(1.234_567_891), runs: true, ..Player::default() };
        for line in (0..30).rev() {
            let place = |x: f32| egui::pos2(x, line as f32 * 4.0);
            let button = |pos, pressed| egui::Event::PointerButton {
                pos,
                button: egui::PointerButton::Primary,
                pressed,
                modifiers: egui::Modifiers::NONE,
            };
            let moved = |x| egui::Event::PointerMoved(place(x));
            for events in [
                vec![moved(70.0)],
                vec![button(place(70.0), true)],
                vec![moved(80.0)],
                vec![button(place(80.0), false)],
            ] {
                show(&context, &mut player, &motion, events);
            }
            if player.playing.time != 1.234_567_891 {
                break;
            }
            player.runs = true;
        }
        assert!(player.playing.time > 2.0 && !player.runs(), "at {} s", player.playing.time);
    }

    #[test]
    fn clips_that_are_not_looped_end_rest_and_begin_again() {
        let motion = builtin::open("seaweed?count=2").expect("built in").motion;
        let duration = motion.duration(&ClipChoice::All);
        let playing = Playing { looped: false, ..Playing::at(duration - 0.05) };
        let mut player = Player::new(&motion, playing, false);
        let begin = Instant::now();
        player.advance(begin, &motion);
        assert!(player.runs());
        player.advance(begin + Duration::from_millis(100), &motion);
        assert_eq!((player.playing.time, player.runs()), (duration, false), "the last moment is shown");
        player.toggle(&motion);
        assert_eq!((player.playing.time, player.runs()), (0.0, true));
        // Particles go on without end.
        let mut player =
            Player::new(&motion, Playing { looped: false, ..Playing::at(duration) }, false).emitting(true, false);
        player.advance(begin, &motion);
        player.advance(begin + Duration::from_millis(100), &motion);
        assert!(player.runs() && player.playing.time > duration);
    }

    #[test]
    fn keys_go_around_in_the_clips_and_in_time() {
        let motion = builtin::open("seaweed?count=2").expect("built in").motion;
        let mut player = Player::new(&motion, Playing::default(), true);
        player.nudge(&motion, true);
        assert!((player.playing.time - (12.0 - NUDGE)).abs() < 1e-9);
        let mut seen = Vec::new();
        for _ in 0..5 {
            player.turn(&motion, false);
            seen.push(player.playing.clips.clone());
        }
        let only = |clip| ClipChoice::Only(vec![clip]);
        assert_eq!(seen, [only(0), only(1), only(2), ClipChoice::None, ClipChoice::All]);
        player.turn(&motion, true);
        assert_eq!(player.playing.clips, ClipChoice::None);
        player.toggle(&motion);
        assert!(!player.runs(), "nothing plays where no clip is chosen");
        assert!(player.line(&motion).starts_with("clips: none rests"));
        assert!(Player::default().line(&Motion::default()).contains("none"));
        // A scene that is read again without its clips.
        player.choose(only(2));
        assert_eq!(player.renewed(&Motion::default()).playing.clips, ClipChoice::All);
    }
}
