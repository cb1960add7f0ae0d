//! The cache of shadow maps: finds the maps that a frame draws anew, and their casters.

use std::sync::Arc;

use super::views::{Caster, ShadowView};
use crate::plan::ShadowPlan;
use crate::scene::Camera;
use crate::visible::{Visible, World};

/// A map to be drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapDraw {
    /// Index into [`Visible::shadows`].
    pub map: usize,
    /// The casters in draw order.
    pub casters: Vec<Caster>,
    /// Casters in the map's volume that are left out.
    pub idle: usize,
}

/// The maps that are up to date; the others are drawn.
///
/// A map stays valid while its view is unchanged, none of its casters has moved, and it has all casters that this frame needs. The longer a map is
/// likely to last, the more casters it is drawn with. A map that is drawn for the first time, or was also drawn by the previous frame, gets only the
/// casters needed now. A map that lasted, or that only lacks casters because the camera turned, gets all casters in its volume, so that the camera
/// may turn on.
#[derive(Debug, Default)]
pub struct ShadowCache {
    drawn: Vec<Option<DrawnMap>>,
    /// The camera and the world's state that the maps were last compared with.
    held_against: Option<(Camera, u64)>,
}

#[derive(Debug)]
struct DrawnMap {
    view: Arc<ShadowView>,
    casters: Vec<Caster>,
    /// A later frame than the one that drew it used it.
    lasted: bool,
}

impl ShadowCache {
    /// The maps that must be drawn again, with their casters; `visible` holds the lists of `camera` with a frame's `plan`.
    pub fn stale(&self, world: &World, plan: &ShadowPlan, camera: &Camera, visible: &Visible) -> Vec<MapDraw> {
        let is_same_frame = self.held_against == Some((*camera, world.generation()));
        let draw = |(map, view): (usize, &Option<Arc<ShadowView>>)| {
            let view = view.as_ref()?;
            let drawn = self.drawn.get(map).and_then(Option::as_ref);
            let all = || MapDraw { map, casters: visible.leveled(world, &view.casters).into_owned(), idle: 0 };
            let needed = || visible.leveled(world, &visible.needed(world, plan, view)).into_owned();
            let only_needed = || {
                let casters = needed();
                MapDraw { map, idle: view.casters.len() - casters.len(), casters }
            };
            match drawn {
                None => Some(only_needed()),
                Some(drawn) if !drawn.stands(world, visible, view) => {
                    Some(if drawn.lasted { all() } else { only_needed() })
                }
                Some(drawn) if is_same_frame || drawn.casters == *visible.leveled(world, &view.casters) => None,
                Some(drawn) => (!drawn.holds(&needed())).then(all),
            }
        };
        visible.shadows.iter().enumerate().filter_map(draw).collect()
    }

    /// Remembers the maps that a frame drew.
    pub fn keep(&mut self, world: &World, camera: &Camera, visible: &Visible, draws: &[MapDraw]) {
        self.drawn.resize_with(visible.shadows.len(), || None);
        for (own, view) in self.drawn.iter_mut().zip(&visible.shadows) {
            if let (Some(own), Some(_)) = (own, view) {
                own.lasted = true;
            }
        }
        for draw in draws {
            if let Some(view) = &visible.shadows[draw.map] {
                let drawn = DrawnMap { view: view.clone(), casters: draw.casters.clone(), lasted: false };
                self.drawn[draw.map] = Some(drawn);
            }
        }
        self.held_against = Some((*camera, world.generation()));
    }
}

impl DrawnMap {
    /// Returns true if the same texels would come of drawing the same casters again.
    // ANCHOR: stands
    fn stands(&self, world: &World, visible: &Visible, view: &Arc<ShadowView>) -> bool {
        let unmoved = |caster: &Caster| world.objects[caster.object].revision == caster.revision;
        let lies = Arc::ptr_eq(&self.view, view) || self.view.lies_as(view) && self.casters.iter().all(unmoved);
        lies && visible.has_levels_of(world, &self.casters)
    }
    // ANCHOR_END: stands

    fn holds(&self, needed: &[Caster]) -> bool {
        // In the same order: both are parts of the list of objects in the map's volume.
        let mut drawn = self.casters.iter();
        needed.iter().all(|caster| drawn.any(|own| own == caster))
    }
}
