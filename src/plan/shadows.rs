//! Shadow maps: the lights that have some, and the maps' places in the atlas. Both depend on the scene alone; the view of each map is worked out for
//! a frame (`src/visible/shadows/views.rs`).

use std::ops::Range;

use super::lights::LightOrder;
use super::{Capabilities, PlanError, Shading, effects};
use crate::scene::{CastsShadow, Light, Scene, Settings, ShadowFilter, ShadowProjection, ShadowSettings, luminance};
use crate::shaders::shared::shadows as wgsl;

/// Maps that all lights may have together.
pub const MAX_SHADOW_VIEWS: usize = wgsl::SHADOW_VIEWS as usize;

/// A square of the atlas, in texels of its layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tile {
    /// The layer of the atlas, from 0.
    pub layer: u32,
    /// The left edge.
    pub x: u32,
    /// The upper edge.
    pub y: u32,
    /// A whole layer for a cascade, half of its width for other maps.
    pub edge: u32,
}

/// A light's view of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapProjection {
    /// Orthographic maps, one behind the other along the camera's view.
    Cascades(u32),
    /// One map from the light's place along its direction.
    Single,
    /// Six perspective maps.
    Cube,
}

impl MapProjection {
    pub(crate) fn of(light: &Light, cascades: u32) -> Self {
        match light.kind.form().shadow_projection() {
            ShadowProjection::Far => Self::Cascades(cascades),
            ShadowProjection::Ahead(_) => Self::Single,
            ShadowProjection::Around => Self::Cube,
        }
    }

    /// The number of maps that it takes.
    pub fn views(self) -> usize {
        match self {
            Self::Cascades(count) => count as usize,
            Self::Single => 1,
            Self::Cube => 6,
        }
    }
}

/// A light with maps.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowLight {
    /// The light's index among the plan's lights.
    pub light: usize,
    /// As [`Light::name`] has it.
    pub name: String,
    /// The light's first map: an index into [`ShadowPlan::tiles`].
    pub first_view: usize,
    /// The number of maps that follow the first, and the view of each.
    pub projection: MapProjection,
}

/// The maps of a sky's light: one for each direction that a frame draws from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SkyShadows {
    /// The first map: an index into [`ShadowPlan::tiles`].
    pub first_view: usize,
    /// The number of directions, and of maps.
    pub count: u32,
}

/// The maps of all frames: a layered image, and the lights' parts of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowPlan {
    /// Edge of a layer in texels.
    pub size: u32,
    /// Layers of the image.
    pub layers: u32,
    /// The filter by which lookups compare texels; it decides how far biases reach.
    pub filter: ShadowFilter,
    /// Casters in front of a map's near plane are clamped to it, if the device can.
    pub clamp: bool,
    /// Each map has a tint map, which stores the light that transparent surfaces let through.
    pub tinted: bool,
    /// The most important first.
    pub lights: Vec<ShadowLight>,
    /// The maps of sky directions, if the sky lights with shadows.
    pub sky: Option<SkyShadows>,
    /// The tile of each map.
    pub tiles: Vec<Tile>,
}

impl ShadowPlan {
    /// The maps that a frame reads, if any, and warnings about lights without maps.
    pub(super) fn wanted(
        scene: &Scene,
        settings: &Settings,
        device: &Capabilities,
        shading: Shading,
        lights: &LightOrder,
    ) -> Result<(Option<Self>, Vec<String>), PlanError> {
        let is_shown = shading == Shading::ShowShadowMap;
        let directions = match shading {
            Shading::Light { .. } => effects::sky_directions(scene, settings),
            _ => 0,
        };
        match shadow_reason(scene, settings, &lights.order) {
            Err(why) if is_shown => return Err(PlanError::NoShadowMap(why)),
            Ok(()) if is_shown || shading.is_lit() => {}
            _ if directions > 0 => {}
            _ => return Ok((None, Vec::new())),
        }
        let size = settings.shadows.size;
        if size == 0 || size > device.max_extent {
            return Err(PlanError::ShadowSize(size, device.max_extent));
        }
        // Other views draw nothing transparent.
        let tinted = shading == Shading::Light { light_only: false } && effects::tints_are_asked_for(scene, settings);
        let (plan, warnings) = Self::of(scene, settings, (lights, directions, tinted), device);
        if plan.is_none() && is_shown {
            return Err(PlanError::NoShadowMap(warnings.join("; ")));
        }
        Ok((plan, warnings))
    }

    /// Gives maps to the lights that ask for one, the most important first, until the budget is spent. The warnings name lights without maps or with
    /// fewer cascades than asked for, and the reason. Directions of the sky share the rest.
    fn of(
        scene: &Scene,
        settings: &Settings,
        (order, directions, tinted): (&LightOrder, u32, bool),
        device: &Capabilities,
    ) -> (Option<Self>, Vec<String>) {
        let shadows = &settings.shadows;
        let layer_bytes = u64::from(shadows.size) * u64::from(shadows.size) * texel_bytes(tinted);
        let within_budget = u32::try_from((u64::from(shadows.budget) << 20) / layer_bytes).unwrap_or(u32::MAX);
        let most = within_budget.min(device.max_layers);
        let mut plan = Self {
            size: shadows.size,
            layers: 0,
            filter: shadows.filter,
            clamp: device.depth_clamp,
            tinted,
            lights: Vec::new(),
            sky: None,
            tiles: Vec::new(),
        };
        let mut free = Vec::new();
        let (mut unserved, mut remedy) = (Vec::new(), None);
        for (light, source) in by_importance(scene, order) {
            let wanted = MapProjection::of(source, shadows.cascades);
            let tries: Vec<MapProjection> = match wanted {
                MapProjection::Cascades(count) => (1..=count).rev().map(MapProjection::Cascades).collect(),
                MapProjection::Single | MapProjection::Cube => vec![wanted],
            };
            // `short` is the reason for the first try that fails.
            let (mut short, mut found) = (None, None);
            for projection in tries {
                match plan.room(projection, &mut free, most) {
                    Ok(tiles) => {
                        found = Some((projection, tiles));
                        break;
                    }
                    Err(why) => short = short.or(Some(why)),
                }
            }
            if let Some(short) = short {
                let by_device = within_budget > most;
                let mut why = short.reason(shadows, by_device, most);
                if short == Short::Layers && !by_device {
                    why += remedy.get_or_insert_with(|| Self::remedy(scene, settings, (order, tinted), device));
                }
                unserved.push((source.name.as_str(), why, found.is_some()));
            }
            if let Some((projection, tiles)) = found {
                let first_view = plan.tiles.len();
                plan.tiles.extend(tiles);
                plan.lights.push(ShadowLight { light, name: source.name.clone(), first_view, projection });
            }
        }
        let mut warnings = warnings(&unserved);
        let short = plan.add_sky(directions, &mut free, most);
        warnings.extend(short.map(|(count, why)| {
            let why = why.reason(shadows, within_budget > most, most);
            format!("{count} of {directions} directions of the sky have a shadow map: {why}")
        }));
        let is_empty = plan.lights.is_empty() && plan.sky.is_none();
        ((!is_empty).then_some(plan), warnings)
    }

    /// Gives a map to as many sky directions as there is room for. A quarter of a layer each is enough: a map covers the whole view, and its shadow
    /// is one of many. Returns the number and the reason if there is room for fewer maps than asked for.
    fn add_sky(&mut self, directions: u32, free: &mut Vec<Tile>, most: u32) -> Option<(u32, Short)> {
        let first_view = self.tiles.len();
        let mut why = None;
        for _ in 0..directions {
            match self.room(MapProjection::Single, free, most) {
                Ok(tiles) => self.tiles.extend(tiles),
                Err(short) => {
                    why = Some(short);
                    break;
                }
            }
        }
        let count = (self.tiles.len() - first_view) as u32;
        self.sky = (count > 0).then_some(SkyShadows { first_view, count });
        why.map(|why| (count, why))
    }

    /// Returns the change that would give all lights their maps: the budget that they need at this size, or the size at which they are within the budget.
    fn remedy(
        scene: &Scene,
        settings: &Settings,
        (order, tinted): (&LightOrder, bool),
        device: &Capabilities,
    ) -> String {
        let shadows = ShadowSettings { budget: u32::MAX, ..settings.shadows };
        let whole = Self::of(scene, &Settings { shadows, ..settings.clone() }, (order, 0, tinted), device).0;
        let ShadowSettings { budget, size, .. } = settings.shadows;
        let Some(needed) = whole.map(|plan| plan.bytes().div_ceil(1 << 20)) else { return String::new() };
        let smaller = (1..).map(|halved| size >> halved).find(|&smaller| {
            let share = f64::from(smaller) / f64::from(size);
            smaller < 32 || needed as f64 * share * share <= f64::from(budget)
        });
        match smaller.filter(|&smaller| smaller >= 32) {
            Some(smaller) => format!("; --shadow-budget {needed} or --shadow-size {smaller} has room for all"),
            None => format!("; --shadow-budget {needed} has room for all"),
        }
    }

    /// An atlas in which nobody looks anything up.
    pub(super) fn without_lights(settings: &Settings, device: &Capabilities) -> Self {
        let ShadowSettings { size, filter, .. } = settings.shadows;
        let (lights, tiles, clamp) = (Vec::new(), Vec::new(), device.depth_clamp);
        Self { size, layers: 1, filter, clamp, tinted: false, lights, sky: None, tiles }
    }

    /// Places for all maps of a light: whole layers for cascades, quarters for the others. When they do not all fit, why.
    fn room(&mut self, projection: MapProjection, free: &mut Vec<Tile>, most: u32) -> Result<Vec<Tile>, Short> {
        let count = projection.views();
        if self.tiles.len() + count > MAX_SHADOW_VIEWS {
            return Err(Short::Views);
        }
        let (whole, missing) = match projection {
            MapProjection::Cascades(count) => (true, count),
            _ => (false, count.saturating_sub(free.len()).div_ceil(4) as u32),
        };
        if missing > most - self.layers {
            return Err(Short::Layers);
        }
        let (size, edge) = (self.size, self.size / 2);
        let new = self.layers..self.layers + missing;
        self.layers += missing;
        if whole {
            return Ok(new.map(|layer| Tile { layer, x: 0, y: 0, edge: size }).collect());
        }
        for layer in new {
            free.extend([(0, 0), (edge, 0), (0, edge), (edge, edge)].map(|(x, y)| Tile { layer, x, y, edge }));
        }
        Ok(free.drain(..count).collect())
    }

    /// The maps of directions of the sky.
    pub(crate) fn sky_views(&self) -> Range<usize> {
        self.sky.map_or(0..0, |sky| sky.first_view..sky.first_view + sky.count as usize)
    }

    /// Device memory of all layers, with their tints.
    pub fn bytes(&self) -> u64 {
        self.texels() * texel_bytes(self.tinted)
    }

    /// Device memory of the tints alone.
    pub fn tint_bytes(&self) -> u64 {
        self.texels() * (texel_bytes(self.tinted) - texel_bytes(false))
    }

    /// Texels of all layers.
    pub fn texels(&self) -> u64 {
        u64::from(self.layers) * u64::from(self.size) * u64::from(self.size)
    }

    /// Returns the shaders' lookup code: the filter, and a bit for tints (`shaders/shared/shadows.wgsl`).
    pub(crate) fn filter_code(&self) -> u32 {
        self.code_of(self.filter)
    }

    /// Returns the lookup code of the sky's maps, whose filter is always 2x2.
    pub(crate) fn sky_filter_code(&self) -> u32 {
        self.code_of(ShadowFilter::Box2)
    }

    fn code_of(&self, filter: ShadowFilter) -> u32 {
        filter as u32 | if self.tinted { wgsl::TINTED } else { 0 }
    }

    /// Returns the code of a light's maps in its record, above the two bits of the fall-off (`shaders/shared/shadows.wgsl`): 0 for
    /// a light without one.
    pub fn code(&self, light: usize) -> u32 {
        self.lights.iter().find(|own| own.light == light).map_or(0, |own| {
            let (kind, count) = match own.projection {
                MapProjection::Cascades(count) => (wgsl::CASCADES, count),
                MapProjection::Single => (wgsl::SINGLE, 1),
                MapProjection::Cube => (wgsl::CUBE, 6),
            };
            (kind << 2) | ((own.first_view as u32) << 4) | (count << 12)
        })
    }

    /// Returns true if the near plane of a cascade lies before all casters. The distance of a blocker that is pressed onto it would be lost, and
    /// with it the penumbra's width.
    pub(crate) fn reaches_back(&self) -> bool {
        !self.clamp || self.filter == ShadowFilter::Pcss
    }

    /// The distance, in texels along an axis, from the looked-up point to which texels are compared without their own depth being worked out. Biases
    /// grow with it.
    pub fn reach(&self) -> f64 {
        match self.filter {
            ShadowFilter::None => 0.5,
            ShadowFilter::Box2 => 1.0,
            // The discs compare with the depth of the receiver's plane at each texel.
            ShadowFilter::Box3 | ShadowFilter::Poisson | ShadowFilter::Pcss => 1.5,
            ShadowFilter::Box5 => 2.5,
        }
    }

    /// Radius of the disc of texels, at most, in a map of `edge` texels.
    pub fn disc(&self, edge: u32) -> f64 {
        match self.filter {
            ShadowFilter::Poisson => 2.5,
            ShadowFilter::Pcss => (f64::from(edge) / 24.0).clamp(2.5, 64.0),
            _ => 0.0,
        }
    }

    /// Texels around the part of a map that is looked up: the filter's neighbours, and the offset along the normal.
    pub(crate) fn margin(&self, edge: u32, settings: &ShadowSettings) -> f64 {
        (self.reach().max(self.disc(edge) + 1.0) + self.normal_offset(settings)).ceil()
    }

    /// The distance by which a lookup is moved along the surface's normal, in texels.
    pub(crate) fn normal_offset(&self, settings: &ShadowSettings) -> f64 {
        f64::from(settings.normal_offset) * self.reach() / FULL_REACH
    }

    /// The factor of both biases.
    pub fn bias_scale(&self) -> f32 {
        (self.reach() / FULL_REACH) as f32
    }
}

/// Why there are no shadow maps.
pub(super) fn shadow_reason(scene: &Scene, settings: &Settings, lights: &[usize]) -> Result<(), String> {
    if !settings.shadows.enabled {
        return Err("shadows are switched off".into());
    }
    let mut planned = lights.iter().map(|&index| &scene.lights[index]);
    let asking = planned.find(|light| light.casts_shadow);
    match asking {
        None => Err("no light casts a shadow".into()),
        Some(light) if scene.objects.iter().all(|object| object.casts_shadow == CastsShadow::No) => {
            Err(format!("nothing can stand between {} and anything", light.name))
        }
        Some(_) => Ok(()),
    }
}

/// Depth, and a tint in half floats.
const fn texel_bytes(tinted: bool) -> u64 {
    if tinted { 12 } else { 4 }
}

/// The reason why a light has no maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Short {
    /// No layer is left within the budget or the device's limit.
    Layers,
    /// The maximum number of maps is reached.
    Views,
}

impl Short {
    /// Formats the reason. `most` is the number of layers within the budget, or the device's limit if that is lower.
    fn reason(self, shadows: &ShadowSettings, by_device: bool, most: u32) -> String {
        let (layers, ShadowSettings { budget, size, .. }) = (layers_text(most), shadows);
        match self {
            Self::Views => format!("{MAX_SHADOW_VIEWS} maps are the most"),
            Self::Layers if by_device => format!("the device has no more than {layers} an image"),
            Self::Layers => format!("the budget of {budget} MiB for maps has room for {layers} of {size} texels"),
        }
    }
}

fn layers_text(count: u32) -> String {
    match count {
        0 => "no layer".into(),
        1 => "1 layer".into(),
        count => format!("{count} layers"),
    }
}

/// The reach of the 3x3 filter, to which the biases refer.
const FULL_REACH: f64 = 1.5;

/// Lights that ask for a shadow and can have one, with their indices among the plan's lights. Directional lights come first, then lights by their
/// illuminance at the scene's own camera: if the order depended on a frame's camera, maps would come and go.
fn by_importance<'a>(scene: &'a Scene, lights: &LightOrder) -> Vec<(usize, &'a Light)> {
    let radius = scene.bounds().radius();
    let importance = |light: &Light| {
        let strength = f64::from(luminance(light.color)) * f64::from(light.intensity);
        let form = light.kind.form();
        match form.place {
            None => (0, strength),
            Some(place) if form.falloff.is_some() => {
                let distance_squared = place.distance_squared(scene.camera.position);
                (1, strength / (distance_squared + 0.01 * radius * radius).max(f64::MIN_POSITIVE))
            }
            Some(_) => (1, strength),
        }
    };
    let sorted = lights.order.iter().map(|&index| &scene.lights[index]);
    // Lights that reach nothing get the maps that are left.
    let needless = |place: usize| place >= lights.needed().len();
    let mut asking: Vec<_> = sorted.enumerate().filter(|(_, light)| light.casts_shadow).collect();
    asking.sort_by(|(place_a, a), (place_b, b)| {
        let (a, b) = (importance(a), importance(b));
        let last = needless(*place_a).cmp(&needless(*place_b));
        last.then(a.0.cmp(&b.0)).then_with(|| b.1.total_cmp(&a.1))
    });
    asking
}

/// A line for each reason, which names the lights: name, reason, and true if it has at least some of its cascades.
fn warnings(unserved: &[(&str, String, bool)]) -> Vec<String> {
    let mut kinds: Vec<(&str, bool)> = unserved.iter().map(|(_, why, some)| (why.as_str(), *some)).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let line = |(why, some): (&str, bool)| {
        let own = unserved.iter().filter(|(_, own, own_some)| (own.as_str(), *own_some) == (why, some));
        let text = named(&own.map(|(name, ..)| *name).collect::<Vec<_>>())?;
        let what = if some { "with fewer cascades than it should have" } else { "without the shadow that it asks for" };
        Some(format!("{text} {what}: {why}"))
    };
    kinds.into_iter().filter_map(line).collect()
}

/// The first few of many names.
fn named(names: &[&str]) -> Option<String> {
    const MOST: usize = 5;
    let listed = names.iter().take(MOST).copied().collect::<Vec<_>>().join(", ");
    match names.len() {
        0 => None,
        1 => Some(format!("the light {listed} is")),
        count if count <= MOST => Some(format!("each of the {count} lights {listed} is")),
        count => Some(format!("each of the {count} lights {listed} and {} more is", count - MOST)),
    }
}

#[cfg(test)]
mod tests;
