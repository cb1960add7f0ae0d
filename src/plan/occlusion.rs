//! The decision on occlusion culling: whether frames have it, and on which processor. The CPU does it in `src/visible/occlusion.rs`; the device, if
//! it culls, in OCCLUDERS, PYRAMID and CULL.

use std::collections::BTreeSet;

use super::{FramePlan, GeometryKey, Shading, SurfaceRules};
use crate::scene::{Culling, OptionalPart, Scene, Settings, counted};

/// Objects from which on hiding them is tried. The picture takes 1 to 2 ms of a CPU core, in which hundreds of objects are recorded: Sponza (394
/// objects) and `builtin:hall` (427) hide one object at most, `builtin:field?objects=2000&screens=6` six in seven.
pub(crate) const MANY_OBJECTS: usize = 512;

const KEPT: &str = "kept on request: hidden objects are drawn";
const COUNTED: &str = "the view counts hidden fragments too";

/// Ok with the reason if the device does.
pub(super) fn choose(
    scene: &Scene,
    settings: &Settings,
    culling: &Result<String, String>,
    (rules, geometry): (&SurfaceRules, &BTreeSet<GeometryKey>),
    shading: Shading,
) -> Result<String, String> {
    let asked = settings.culling == Culling::Gpu;
    let drawn = || rules.drawn(scene).count();
    match shading {
        _ if culling.is_err() => Err("the device does not cull".into()),
        _ if settings.keep.has(OptionalPart::OccludedObjects) => Err(KEPT.into()),
        Shading::ShowOverdraw => Err(COUNTED.into()),
        _ if geometry.iter().all(|key| key.masked) => Err("no object is opaque all over".into()),
        _ if !asked && drawn() < MANY_OBJECTS => Err(too_few(drawn())),
        _ => Ok("the device tests boxes against the depth of the largest objects in view".into()),
    }
}

fn too_few(drawn: usize) -> String {
    let objects = counted(drawn, "object");
    format!("{objects}: below {MANY_OBJECTS}, drawing all is faster than occlusion culling")
}

impl FramePlan {
    /// Tells if frames leave out objects that are hidden behind others, and why or why not.
    pub(crate) fn finds_hidden(&self, scene: &Scene) -> Result<String, String> {
        let rules = self.surface_rules();
        let drawn = scene.objects.iter().filter(|object| rules.draws(scene, object)).count();
        match self.shading {
            _ if self.hides_on_device => Ok(self.reasons.hiding.clone()),
            _ if self.culls_on_device => Err(self.reasons.hiding.clone()),
            _ if self.keep.has(OptionalPart::OccludedObjects) => Err(KEPT.into()),
            Shading::ShowOverdraw => Err(COUNTED.into()),
            Shading::ShowShadowMap => Err("no object is drawn".into()),
            _ if !self.software => Err("a GPU draws hidden objects faster than the CPU finds them".into()),
            _ if drawn < MANY_OBJECTS => Err(too_few(drawn)),
            _ => Ok(format!("{drawn} objects, occlusion-culled by their boxes")),
        }
    }
}
