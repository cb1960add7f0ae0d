//! The table of effects. It lies above all of them: each declares itself in its own file, and whoever asks about effects goes through this list.

use super::effect::{Effect, Request};
use super::{Error, ao, bloom, fog, particles, reflections, sky, taa};
use crate::scene::{Scene, Settings};

/// Every effect that has a plan of its own, in the order in which `inspect` lists them. Effects on the finished picture have their rows in the settings' table
/// (`on_picture`).
pub(crate) const EFFECTS: &[&Effect] =
    &[&particles::EFFECT, &sky::EFFECT, &fog::EFFECT, &bloom::EFFECT, &taa::EFFECT, &ao::EFFECT, &reflections::EFFECT];

/// Refuses effects that do not go with the settings, the light path or the device.
pub(super) fn check(request: &Request) -> Result<(), Error> {
    EFFECTS.iter().try_for_each(|effect| (effect.check)(request))
}

/// The effects that settings or the scene ask for.
pub(super) fn asked_for(scene: &Scene, settings: &Settings) -> impl Iterator<Item = &'static Effect> {
    EFFECTS.iter().copied().filter(move |effect| (effect.is_asked_for)(scene, settings))
}
