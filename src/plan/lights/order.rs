//! The ordered lights of a plan, without lights that can reach nothing of the scene. Beyond its range every fall-off is exactly zero
//! (`shaders/shared/lights.wgsl`), so a light that is left out would have added zero to each pixel. Only ranges count: the certified cut-off of a
//! light without range is not exact.

use std::collections::BTreeMap;

use glam::DVec3;

use super::box_tree::BoxTree;
use super::reach::{Reach, bounded, range_of, sphere_of};
use crate::plan::effects;
use crate::scene::{Aabb, Emitter, GbufferPreset, Light, OptionalPart, Scene, Settings, TargetChoice, View};

/// The distance between a surface and the place at which it may be lit, as a share of the scene's radius, for a plan, which knows no camera: right
/// for cameras within 100 radii.
const PLANNED_ROUNDING: f64 = 0.01;

/// Returns true if surfaces are lit so far from their own place that a plan, which knows no camera, leaves no light out: half floats are as coarse as
/// the camera is far away, and several samples of a pixel are lit at their mean.
pub(crate) fn is_misplaced(settings: &Settings) -> bool {
    let choice = &settings.gbuffer;
    let preset = (choice.preset == GbufferPreset::Fat).then_some(TargetChoice::Rgba16f);
    settings.msaa > 1 || choice.position.or(preset) == Some(TargetChoice::Rgba16f)
}

/// Returns true if a view is about all lights: one says how many of them reach a pixel, the other shows all maps.
pub(crate) fn shows_all(view: View) -> bool {
    matches!(view, View::LightsPerPixel | View::ShadowMap)
}

/// The lights of a plan, by the scene's numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LightOrder {
    /// The lights of frames in their order: directional, unbounded, then bounded lights.
    pub order: Vec<usize>,
    /// The lights that reach nothing, and so are not in `order`.
    pub idle: IdleLights,
    /// The number of lights at the end of `order` that reach nothing and stay on request. They decide nothing else.
    needless: usize,
}

impl LightOrder {
    pub(crate) fn of(scene: &Scene, settings: &Settings) -> Self {
        // Ambient light comes from no light.
        if settings.view == View::Ambient {
            return Self { order: Vec::new(), idle: IdleLights::default(), needless: 0 };
        }
        let lights = &scene.lights;
        let mut idle = IdleLights::of(scene, settings);
        let moved = scene.motion.moved_lights();
        let mut order: Vec<usize> =
            (0..lights.len()).filter(|&index| lights[index].shines() || moved.contains(&index)).collect();
        let mut needless = 0;
        if settings.keep.has(OptionalPart::IdleLights) {
            needless = idle.count();
        } else {
            order.retain(|&index| !idle.has(index));
        }
        // Stable: lights of a kind keep the scene's order, and with it their sum its rounding. Lights that reach nothing add zero, and come last.
        order.sort_by_key(|&index| match &lights[index] {
            light if light.kind.is_directional() => 0,
            light if !bounded(light, settings) => 1,
            _ if !idle.has(index) => 2,
            _ => 3,
        });
        if needless > 0 {
            idle = IdleLights::default();
        }
        Self { order, idle, needless }
    }

    /// The number of lights that reach nothing and stay on request.
    pub(crate) fn needless(&self) -> usize {
        self.needless
    }

    /// The lights that decide on the plan's parts.
    pub(crate) fn needed(&self) -> &[usize] {
        &self.order[..self.order.len() - self.needless]
    }
}

/// The lights that a plan leaves out: they shine, but reach no object of the scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct IdleLights {
    /// The reach of each, by its number in the scene.
    reaches: BTreeMap<usize, Reach>,
    /// Metres that are added to each light's reach.
    metres: f64,
    /// Something of the scene moves, so that no light is left out.
    pub moves: bool,
}

impl IdleLights {
    pub(crate) fn of(scene: &Scene, settings: &Settings) -> Self {
        // A moving object may come into reach of any light, and a moving light may reach any object.
        let moves = !scene.motion.is_empty() || scene.objects.iter().any(|object| object.movable);
        if moves || effects::reach_all_lights(settings).is_some() || shows_all(settings.view) || is_misplaced(settings)
        {
            return Self { moves, ..Self::default() };
        }
        let metres = PLANNED_ROUNDING * scene.bounds().radius();
        let mut idle = Self { reaches: BTreeMap::new(), metres, moves };
        let ranged = scene.lights.iter().enumerate().filter(|(_, light)| light.shines());
        idle.reaches = ranged.filter_map(|(index, light)| Some((index, idle.reach_of(light)?))).collect();
        if !idle.reaches.is_empty() {
            let emitters = scene.emitters.iter().map(Emitter::bounds);
            let objects = scene.objects.iter().map(|object| object.bounds(&scene.meshes));
            let objects = BoxTree::of(objects.chain(emitters));
            idle.reaches.retain(|_, reach| !objects.touches(reach));
        }
        idle
    }

    fn reach_of(&self, light: &Light) -> Option<Reach> {
        let reach = sphere_of(light, range_of(light)?);
        Some(Reach { radius: reach.radius * (1.0 + PLANNED_ROUNDING) + self.metres, ..reach })
    }

    pub(crate) fn has(&self, light: usize) -> bool {
        self.reaches.contains_key(&light)
    }

    pub(crate) fn count(&self) -> usize {
        self.reaches.len()
    }

    /// A light that would reach into this box.
    pub(crate) fn reaching(&self, bounds: &Aabb) -> Option<usize> {
        self.reaches.iter().find(|(_, reach)| reach.touches(bounds)).map(|(&light, _)| light)
    }

    /// Changes one of these lights. False where the changed one would reach one of the objects, and so stays as it was.
    pub(crate) fn set(&mut self, light: usize, to: &Light, mut objects: impl Iterator<Item = Aabb>) -> bool {
        let nothing = Reach { center: DVec3::ZERO, radius: f64::NEG_INFINITY };
        let reach = if to.shines() { self.reach_of(to) } else { Some(nothing) };
        let Some(reach) = reach.filter(|reach| !objects.any(|bounds| reach.touches(&bounds))) else { return false };
        self.reaches.insert(light, reach);
        true
    }
}
