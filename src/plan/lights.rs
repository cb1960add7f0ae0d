//! Which kinds of light the shaders have code for.

use std::collections::BTreeSet;

use super::{Shading, light_path};
use crate::scene::{Falloff, Keep, LightKind, LightPath, OptionalPart, Scene, Settings, View};

/// Lights that fit into the least uniform buffer that a device must have; `shaders/shared/lights.wgsl` has the same number.
pub const UNIFORM_LIGHTS: usize = 256;

/// The fall-off is each light's own (`shaders/shared/shading.wgsl`).
pub(super) const MIXED_FALLOFF: u32 = 3;

/// Kinds of light that LIGHTING has code for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlannedLights {
    pub directional: bool,
    pub punctual: bool,
    pub spot: bool,
    /// The index of the one fall-off that all have (`shaders/shared/lights.wgsl`), 3 where they differ.
    pub falloff: u32,
    /// Some light has a range.
    pub ranged: bool,
    /// Some light reaches only so far, by its range or the certified cut-off.
    pub bounded: bool,
    /// Some point or spot light reaches everywhere.
    pub unbounded: bool,
    pub ambient: bool,
    /// One directional light is all there is, so that no loop goes over lights.
    pub one_directional: bool,
    /// Few enough for a uniform buffer.
    pub uniform: bool,
}

impl PlannedLights {
    /// Whether there is a buffer of lights.
    pub fn any(&self) -> bool {
        self.directional || self.punctual
    }

    /// With code for kinds that stay although no light is of them. All inputs are neutral: no light is counted, a range is infinite
    /// and a cone a whole sphere.
    pub(super) fn kept(self, keep: Keep) -> Self {
        let punctual = keep.has(OptionalPart::PunctualLights);
        Self {
            ambient: self.ambient || keep.has(OptionalPart::AmbientLight),
            directional: self.directional || keep.has(OptionalPart::DirectionalLights),
            punctual: self.punctual || punctual,
            unbounded: self.unbounded || punctual,
            spot: self.spot || keep.has(OptionalPart::SpotCones),
            ranged: self.ranged || keep.has(OptionalPart::LightRanges),
            falloff: if keep.has(OptionalPart::Falloffs) { MIXED_FALLOFF } else { self.falloff },
            ..self
        }
    }
}

/// The number of a fall-off in `shaders/shared/lights.wgsl`.
pub fn falloff_index(falloff: Falloff) -> u32 {
    match falloff {
        Falloff::InverseSquare => 0,
        Falloff::Quadratic => 1,
        Falloff::Polynomial { .. } => 2,
    }
}

/// Full-screen or cut to what a light reaches: each is a draw of its own.
pub(super) fn adds_lights(path: LightPath, lights: &PlannedLights) -> bool {
    match path {
        LightPath::PerLight => lights.punctual,
        LightPath::Volumes => lights.bounded,
        _ => false,
    }
}

/// Of the lights with these numbers, as far as the frame shows them.
pub(super) fn planned_lights(scene: &Scene, settings: &Settings, shading: Shading, planned: &[usize]) -> PlannedLights {
    if shading == Shading::ShowGbuffer(View::Complexity) {
        // What is compared is what LIGHTING would read, and ambient light has occlusion stored.
        return PlannedLights { ambient: scene.environment.is_lit(), ..Default::default() };
    }
    if !matches!(shading, Shading::Light { .. } | Shading::ShowGbuffer(View::LightsPerPixel)) {
        return PlannedLights::default();
    }
    let mut lights = PlannedLights { ambient: scene.environment.is_lit(), ..Default::default() };
    let mut falloffs = BTreeSet::new();
    lights.uniform = planned.len() <= UNIFORM_LIGHTS;
    lights.one_directional =
        matches!(planned[..], [one] if matches!(scene.lights[one].kind, LightKind::Directional { .. }));
    for light in planned.iter().map(|&index| &scene.lights[index]) {
        let bounded = light_path::bounded(light, settings);
        lights.bounded |= bounded;
        lights.unbounded |= !bounded && !matches!(light.kind, LightKind::Directional { .. });
        match light.kind {
            LightKind::Directional { .. } => lights.directional = true,
            LightKind::Point { falloff, range, .. } => {
                lights.punctual = true;
                lights.ranged |= range.is_some();
                falloffs.insert(falloff_index(falloff));
            }
            LightKind::Spot { falloff, range, .. } => {
                (lights.punctual, lights.spot) = (true, true);
                lights.ranged |= range.is_some();
                falloffs.insert(falloff_index(falloff));
            }
        }
    }
    lights.falloff = if falloffs.len() == 1 { *falloffs.first().expect("there is one") } else { MIXED_FALLOFF };
    lights
}
