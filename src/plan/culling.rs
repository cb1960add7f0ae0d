//! Who finds out which opaque objects are in view: the CPU, or the device by CULL, ARRANGE and FILL. The picture is the same to the last bit.

use std::collections::BTreeSet;

use super::{Capabilities, Shading, SurfaceRules};
use crate::scene::{Culling, OptionalPart, Scene, Settings};

/// Objects from which on a device does it by itself: below, the CPU is done sooner than three dispatches are.
pub(crate) const MANY_INSTANCES: usize = 4096;
/// And so many objects share a mesh and a material: each such pair is a command in every step of depth, drawn or not.
const SHARED_BY: usize = 16;

/// Ok with the reason if the device does.
pub(super) fn choose(
    scene: &Scene,
    settings: &Settings,
    device: &Capabilities,
    rules: &SurfaceRules,
    shading: Shading,
    depth_prepass: bool,
) -> Result<String, String> {
    let asked = settings.culling == Culling::Gpu;
    match shading {
        _ if settings.culling == Culling::Cpu => return Err("the CPU does, as asked for".into()),
        _ if !device.indirect_draws => return Err("the CPU does: the device draws by no commands of its own".into()),
        _ if settings.keep.has(OptionalPart::OffscreenObjects) => {
            return Err("nobody does: all objects are drawn".into());
        }
        _ if depth_prepass => return Err("the CPU does: after a depth pre-pass the order is another one".into()),
        Shading::ShowTriangle => return Err("the CPU does: the view needs each object's number".into()),
        Shading::ShowShadowMap => return Err("no object is drawn".into()),
        _ => {}
    }
    let drawn = || {
        let objects = scene.objects.iter().filter(|object| rules.draws(scene, object));
        objects.filter(|object| !rules.material(object).is_transparent())
    };
    let count = drawn().count();
    let pairs = || drawn().map(|object| (object.mesh, object.material)).collect::<BTreeSet<_>>().len();
    match count {
        0 => Err("no opaque object is drawn".into()),
        _ if asked => Ok("the device does, as asked for".into()),
        _ if device.software => Err("the CPU does: it is the device, and finds hidden objects as well".into()),
        _ if count < MANY_INSTANCES => {
            Err(format!("the CPU does: there are fewer than {MANY_INSTANCES} opaque objects"))
        }
        _ if pairs() * SHARED_BY > count => {
            Err(format!("the CPU does: fewer than {SHARED_BY} objects share a mesh and a material"))
        }
        _ => Ok("the device does: many objects share few meshes and materials".into()),
    }
}
