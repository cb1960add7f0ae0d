//! The air that a camera looks through: the end of froxels, and a box around all air that may be shadowed.

use super::{Eye, World};
use crate::plan::FroxelPlan;
use crate::scene::{Aabb, Camera};

/// Metres to the end of froxels where a scene has no extent.
const EMPTY_SCENE: f64 = 100.0;
/// The range of `fog-distance`, in metres.
const DISTANCES: (f64, f64) = (0.01, 1e6);

impl World {
    /// Metres along the view to the end of a plan's froxels: the distance that was asked for, or the far side of the sphere around the scene, as only
    /// sky lies behind it. It changes by no more than the camera moves.
    pub fn end_of_froxels(&self, plan: &FroxelPlan, eye: &Eye) -> f64 {
        let from = eye.camera.position - eye.camera.forward() * eye.ahead;
        let far_side = from.distance(self.extent.center()) + self.extent.radius();
        let usual = if self.extent.is_empty() { EMPTY_SCENE } else { far_side };
        plan.distance.map_or(usual, f64::from).clamp(DISTANCES.0, DISTANCES.1)
    }

    /// A box around all air that a camera sees and the scene may shadow.
    pub(super) fn air_around(&self, camera: &Camera) -> Aabb {
        let far = camera.position.distance(self.extent.center()) + 2.0 * self.extent.radius();
        Aabb { min: camera.position - far, max: camera.position + far }
    }
}
