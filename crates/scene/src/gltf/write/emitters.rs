//! Emitters, for which glTF has no words.

use super::expressible::tell;
use crate::Scene;

/// Takes them out of the scene.
pub(super) fn leave_out(scene: &mut Scene, left_out: &mut Vec<String>) {
    tell(left_out, scene.emitters.len(), "source", "particles are left out");
    scene.moment = None;
    scene.emitters.clear();
}
