//! The actions of keys. Keys are told by their place on the keyboard, so that WASD lie together on any layout.

use winit::keyboard::KeyCode;

use super::camera::HeldKeys;

/// The action of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Action {
    Quit,
    Help,
    Reset,
    Orbit,
    Screenshot,
    /// Write the light of the picture.
    Light,
    /// Open the panels, or close them.
    Panels,
    /// Open the panel of dependencies, or close it.
    Dependencies,
    /// Show the next view, or the one before.
    View {
        back: bool,
    },
    /// Show the frame after its next pass or light, or the one before.
    Step {
        back: bool,
    },
    /// Show another view beside the picture, or none any more; the next one, if that is asked for.
    Split {
        next: bool,
    },
    /// Compare the picture with the truth, or end that.
    Compare,
    /// Play clips, or pause.
    Play,
    /// Pause, a little later or before.
    Nudge {
        back: bool,
    },
    /// Play the next clip, or the one before.
    Clip {
        back: bool,
    },
    /// Begin to record the camera's path, or end it.
    Record,
    /// Let the resolution follow the time that frames take, or draw all pixels again.
    Resolution,
    /// Write the scene and the settings as they are.
    Scene,
    /// Keep this place.
    Bookmark(usize),
    /// Go to the place that was kept.
    Recall(usize),
}

/// The keys as `afterlight view` prints them; docs/WINDOW.md has the same list.
pub const HELP: &[(&str, &str)] = &[
    ("W A S D", "move forward, left, back, right (orthographic: W, S zoom)"),
    ("E or Space, Q or C", "move up, down"),
    ("Shift", "move faster, while it is held down"),
    ("drag", "look around; in an orbit, go around"),
    ("wheel", "fly faster or slower; orbit nearer or farther; zoom"),
    ("O", "orbit around what is ahead, or fly again"),
    ("R or Home", "back to the first camera"),
    ("Ctrl+1 to Ctrl+9", "keep this camera"),
    ("1 to 9", "go to the camera that was kept"),
    ("P or F12", "write a screenshot"),
    ("Shift+P", "write the light of the picture, in nits, as an EXR"),
    ("G or F2, B", "panels: times, plan, settings; dependencies to switch off"),
    ("V, Shift+V", "the next view of the frame's buffers, the one before"),
    (". and ,", "step through the frame's passes and lights, on and back"),
    ("Enter", "play clips, or pause"),
    ("[ and ]", "pause, and go a thirtieth of a second back, or on"),
    ("N, Shift+N", "the next clip, the one before: all, each alone, none"),
    ("X, Shift+X", "split the window by another view, or not; the next view"),
    ("drag the divider", "move it; a double-click on it ends the split"),
    ("click", "select an object: its name, its material, its box"),
    ("T", "compare with the truth: where and how far pixels are off"),
    ("K", "record the camera's path, and write it"),
    ("F", "write a scene file, and print the command that draws it"),
    ("Z", "let the resolution follow frame times in motion, or not"),
    ("H or F1", "these keys"),
    ("Esc", "end steps, file messages, comparison, selection; quit"),
];

const DIGITS: [KeyCode; 9] = [
    KeyCode::Digit1,
    KeyCode::Digit2,
    KeyCode::Digit3,
    KeyCode::Digit4,
    KeyCode::Digit5,
    KeyCode::Digit6,
    KeyCode::Digit7,
    KeyCode::Digit8,
    KeyCode::Digit9,
];

/// Returns the action of a key, alone, with Ctrl or with Shift.
pub(super) fn action(key: KeyCode, control: bool, shift: bool) -> Option<Action> {
    let number = DIGITS.iter().position(|&digit| digit == key);
    match key {
        KeyCode::Escape => Some(Action::Quit),
        KeyCode::KeyH | KeyCode::F1 => Some(Action::Help),
        KeyCode::KeyR | KeyCode::Home => Some(Action::Reset),
        KeyCode::KeyO => Some(Action::Orbit),
        KeyCode::KeyG | KeyCode::F2 => Some(Action::Panels),
        KeyCode::KeyB => Some(Action::Dependencies),
        KeyCode::KeyV => Some(Action::View { back: shift }),
        KeyCode::Period => Some(Action::Step { back: false }),
        KeyCode::Comma => Some(Action::Step { back: true }),
        KeyCode::Enter | KeyCode::NumpadEnter => Some(Action::Play),
        KeyCode::BracketLeft => Some(Action::Nudge { back: true }),
        KeyCode::BracketRight => Some(Action::Nudge { back: false }),
        KeyCode::KeyN => Some(Action::Clip { back: shift }),
        KeyCode::KeyT => Some(Action::Compare),
        KeyCode::KeyK => Some(Action::Record),
        KeyCode::KeyF => Some(Action::Scene),
        KeyCode::KeyZ => Some(Action::Resolution),
        KeyCode::KeyX => Some(Action::Split { next: shift }),
        KeyCode::KeyP | KeyCode::F12 if shift => Some(Action::Light),
        KeyCode::KeyP | KeyCode::F12 => Some(Action::Screenshot),
        _ if control => number.map(Action::Bookmark),
        _ => number.map(Action::Recall),
    }
}

/// Takes note of a key that moves the camera while it is held down. False for other keys.
pub(super) fn hold(held: &mut HeldKeys, key: KeyCode, pressed: bool) -> bool {
    let state = match key {
        KeyCode::KeyW | KeyCode::ArrowUp => &mut held.forward,
        KeyCode::KeyS | KeyCode::ArrowDown => &mut held.back,
        KeyCode::KeyA | KeyCode::ArrowLeft => &mut held.left,
        KeyCode::KeyD | KeyCode::ArrowRight => &mut held.right,
        KeyCode::KeyE | KeyCode::Space => &mut held.up,
        KeyCode::KeyQ | KeyCode::KeyC => &mut held.down,
        KeyCode::ShiftLeft | KeyCode::ShiftRight => &mut held.hurry,
        _ => return false,
    };
    *state = pressed;
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_keep_places_with_ctrl_and_go_there_without() {
        assert_eq!(action(KeyCode::Digit1, true, false), Some(Action::Bookmark(0)));
        assert_eq!(action(KeyCode::Digit9, false, false), Some(Action::Recall(8)));
        assert_eq!(action(KeyCode::Digit0, false, false), None);
    }

    #[test]
    fn clips_play_go_on_and_change() {
        assert_eq!(action(KeyCode::Enter, false, false), Some(Action::Play));
        assert_eq!(action(KeyCode::BracketLeft, false, false), Some(Action::Nudge { back: true }));
        assert_eq!(action(KeyCode::KeyN, false, true), Some(Action::Clip { back: true }));
    }

    #[test]
    fn period_and_comma_step_on_and_back() {
        assert_eq!(action(KeyCode::Period, false, false), Some(Action::Step { back: false }));
        assert_eq!(action(KeyCode::Comma, false, false), Some(Action::Step { back: true }));
    }

    #[test]
    fn no_key_both_moves_and_acts() {
        for key in DIGITS.into_iter().chain([
            KeyCode::Escape,
            KeyCode::KeyH,
            KeyCode::KeyR,
            KeyCode::KeyO,
            KeyCode::KeyP,
            KeyCode::KeyX,
            KeyCode::KeyF,
            KeyCode::KeyZ,
            KeyCode::KeyB,
        ]) {
            assert!(action(key, false, false).is_some() && !hold(&mut HeldKeys::default(), key, true), "{key:?}");
        }
        let mut held = HeldKeys::default();
        assert!(hold(&mut held, KeyCode::KeyW, true) && held.forward && action(KeyCode::KeyW, false, false).is_none());
        assert!(hold(&mut held, KeyCode::KeyW, false) && !held.forward);
    }
}
