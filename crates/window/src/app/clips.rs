//! Clips that play while the window is open.

use std::time::Instant;

use super::{App, Opened};
use crate::keys::Action;
use crate::live_scene::LiveScene;

impl App<'_> {
    /// Has the next frame show the moment that clips have come to.
    pub(super) fn play(&mut self, now: Instant) {
        let Some(Opened { presenter, interface, .. }) = &mut self.opened else { return };
        let LiveScene { scene, player, .. } = &mut self.live;
        if !player.advance(now, &scene.motion) {
            return;
        }
        interface.forget_moment();
        if let Err(error) = player.show(presenter, scene) {
            // The frame goes on as it is; told once, and not with every frame.
            if !std::mem::replace(&mut self.told_motion, true) {
                self.teller.tell(&format!("warning: not all of it moves: {error}"));
            }
        }
    }

    /// Applies a key's action to clips.
    pub(super) fn change_clips(&mut self, action: Action) {
        let LiveScene { scene, player, .. } = &mut self.live;
        match action {
            Action::Nudge { back } => player.nudge(&scene.motion, back),
            Action::Clip { back } => player.turn(&scene.motion, back),
            _ => player.toggle(&scene.motion),
        }
        self.teller.tell(&player.line(&scene.motion));
    }
}
