//! Whether frames look for objects that lie wholly behind others (`src/visible/occlusion.rs`).

use super::{FramePlan, Shading};
use crate::scene::{OptionalPart, Scene};

/// Objects from which on hiding them is tried. The picture takes 1 to 2 ms of a CPU core, in which hundreds of objects are recorded: Sponza (394
/// objects) and `builtin:hall` (427) hide one object at most, `builtin:field?objects=2000&screens=6` six in seven.
pub(crate) const MANY_OBJECTS: usize = 512;

impl FramePlan {
    /// Whether frames leave out objects that are hidden behind others, or why not.
    pub(crate) fn finds_hidden(&self, scene: &Scene) -> Result<String, String> {
        let rules = self.surface_rules();
        let drawn = scene.objects.iter().filter(|object| rules.draws(scene, object)).count();
        match self.shading {
            _ if self.keep.has(OptionalPart::OccludedObjects) => Err("asked to stay".into()),
            Shading::ShowOverdraw => Err("the view counts what is drawn and then hidden".into()),
            Shading::ShowShadowMap => Err("no object is drawn".into()),
            _ if self.culls_on_device() => {
                Err("the device finds out what is in view, and nobody what is hidden".into())
            }
            _ if !self.software => {
                Err("a GPU draws objects faster than a CPU finds out which of them are hidden".into())
            }
            _ if drawn < MANY_OBJECTS => Err(format!(
                "below {MANY_OBJECTS} objects, here {drawn}, drawing all is faster than finding out which of them are hidden"
            )),
            _ => Ok(format!("{drawn} objects, each drawn unless larger ones hide its box")),
        }
    }
}
