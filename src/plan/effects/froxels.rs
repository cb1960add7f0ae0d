//! Froxels of fog: the decision whether frames find the light in the air in a grid, and the grid.

use std::fmt;

use super::fog::FogPlan;
use crate::plan::parts::{Part, part};
use crate::plan::{BufferName, FramePlan};
use crate::scene::{Fog, Settings};

/// Light in the froxels, and the light scattered before them.
pub const FROXELS: BufferName = BufferName("froxels of fog");

/// The grid that SCATTER and INTEGRATE fill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FroxelPlan {
    /// Across the picture, down, and one behind the other.
    pub grid: [u32; 3],
    /// Places in each where its light is found.
    pub samples: u32,
    /// Metres along the view at which it ends; none for the far end of the scene.
    pub distance: Option<f32>,
}

/// In `inspect`: `160x90x64 froxels to the scene's far end, light found in 2 places of each`.
impl fmt::Display for FroxelPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [columns, rows, slices] = self.grid;
        write!(f, "{columns}x{rows}x{slices} froxels ")?;
        match self.distance {
            Some(metres) => write!(f, "up to {metres} m along the view")?,
            None => f.write_str("to the scene's far end")?,
        }
        match self.samples {
            1 => f.write_str(", light found in the middle of each"),
            samples => write!(f, ", light found in {samples} places of each"),
        }
    }
}

impl FroxelPlan {
    /// Plans the grid of fog that lights shine into. Returns `None` if the scene has no lights: the air then has ambient light alone, for which the
    /// closed form is exact.
    pub(super) fn of(settings: &Settings, kind: Fog, any_light: bool) -> Option<Self> {
        let &Settings { fog_froxels: grid, fog_samples: samples, fog_distance: distance, .. } = settings;
        (kind == Fog::Froxels && any_light).then_some(Self { grid, samples, distance })
    }

    /// Bytes of the buffer. Each froxel has 8 for its light, and 8 for the light that the fog in front of it scatters to the eye; one extra slice has
    /// the light that all slices scatter.
    pub fn bytes(&self) -> u64 {
        let [columns, rows, slices] = self.grid.map(u64::from);
        16 * columns * rows * (slices + 1)
    }
}

impl FogPlan {
    /// The froxels of the fog's light, if it has any.
    pub fn froxels(&self) -> Option<&FroxelPlan> {
        self.froxels.as_ref()
    }
}

impl FramePlan {
    /// The froxels in which frames find the light in the air.
    pub fn froxels(&self) -> Option<&FroxelPlan> {
        self.effects.fog.as_ref()?.froxels.as_ref()
    }

    /// Returns true if shaders name the fog's froxels: so do all that light surfaces as they draw them, whose code for froxels a constant leaves out.
    pub(crate) fn names_froxels(&self) -> bool {
        self.froxels().is_some() || self.lights_as_drawn() && self.lights.any() && !self.lights.uniform
    }

    /// Returns the reason why frames have none.
    pub(crate) fn lack_of_froxels(&self) -> &'static str {
        match &self.effects.fog {
            None => "no fog",
            Some(fog) if fog.kind == Fog::Froxels => "no lamp shines into the fog: its closed form is exact",
            Some(_) => "fog by height has no froxels",
        }
    }
}

/// Returns their line of `inspect`.
pub(super) fn part_of(plan: &FramePlan) -> Part {
    match plan.froxels() {
        Some(own) => part("froxels of fog", true, own.to_string(), own.bytes()),
        None => part("froxels of fog", false, plan.lack_of_froxels(), 0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::samples;
    use crate::scene::{Brdf, Scene};
    use glam::Vec3;

    #[test]
    fn froxels_are_there_where_a_light_is_and_leave_no_trace_of_their_numbers_elsewhere() {
        let mut scene = samples::scene(vec![samples::textured(Brdf::Lambert)], vec![samples::sun()]);
        let numbers = Settings { fog_froxels: [3, 4, 5], fog_samples: 8, ..samples::deferred() };
        let plan = |scene: &Scene, fog| samples::plan(scene, &Settings { fog, ..numbers.clone() });
        let usual = Settings { fog: Fog::Height, ..samples::deferred() };
        assert!(samples::plan(&scene, &usual).has_structure_of(&plan(&scene, Fog::Height)));
        let on = plan(&scene, Fog::Froxels);
        assert_eq!(on.froxels().map(|own| (own.grid, own.bytes())), Some(([3, 4, 5], 16 * 3 * 4 * 6)));
        scene.lights.clear();
        scene.environment.ambient = Vec3::ONE;
        let dark = plan(&scene, Fog::Froxels);
        assert!(dark.has_fog() && dark.froxels().is_none());
    }
}
