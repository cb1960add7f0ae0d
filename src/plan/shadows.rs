//! Shadow maps: which lights have some, and where in the atlas, is decided once from the scene alone; what each of them sees is
//! worked out for a frame. A cascade's size depends on its part of the view and on the scene, not on what is seen, and it moves by whole
//! texels: shadows do not swim, whether the camera walks or turns.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, DVec4, Vec4};

use super::{Capabilities, Draw, World};
use crate::scene::{
    Aabb, Camera, CastsShadow, Light, LightKind, Scene, Settings, ShadowFilter, ShadowSettings, luminance,
};

/// Maps that all lights may have together; `shaders/shared/shadows.wgsl` has the same number.
pub const MAX_SHADOW_VIEWS: usize = 128;

/// A cone that is wider than this, measured from its axis in degrees, gets the six faces of a point light: one perspective map
/// would spend most of its texels on its rim.
const WIDEST_SPOT: f64 = 60.0;

/// Directions of the six maps of a point light, in the order of `shaders/shared/shadows.wgsl`.
const FACES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

/// The part of a cascade's range over which the next one takes over.
const BLEND: f64 = 0.1;

/// Splits begin at this share of the farthest distance, however near the near plane is.
const NEAREST_SPLIT: f64 = 1e-3;

/// Near plane of perspective maps over the light's range or the scene's radius: depth is 1 there, and falls as 1 / distance. In f32 that
/// keeps its precision however near the plane is, so it is nearer than anything that could stand between it and the lamp.
const NEAR: f64 = 1e-7;

/// A square of the atlas, in texels of its layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tile {
    pub layer: u32,
    pub x: u32,
    pub y: u32,
    pub edge: u32,
}

/// How a light looks at the scene; the numbers are those of `shaders/shared/shadows.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// Orthographic maps, one behind the other along the camera's view.
    Cascades(u32),
    Perspective,
    /// Six perspective maps.
    Cube,
}

impl Projection {
    pub(super) fn of(light: &Light, cascades: u32) -> Self {
        match light.kind {
            LightKind::Directional { .. } => Self::Cascades(cascades),
            LightKind::Spot { outer_angle_degrees, .. } if outer_angle_degrees <= WIDEST_SPOT => Self::Perspective,
            LightKind::Spot { .. } | LightKind::Point { .. } => Self::Cube,
        }
    }

    /// How many maps that takes.
    pub fn views(self) -> usize {
        match self {
            Self::Cascades(count) => count as usize,
            Self::Perspective => 1,
            Self::Cube => FACES.len(),
        }
    }
}

/// A light with maps.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowLight {
    /// Index into [`World::lights`].
    pub light: usize,
    pub name: String,
    pub first_view: usize,
    pub projection: Projection,
}

/// The maps of all frames: a layered image, and who has which part of it.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowPlan {
    /// Edge of a layer in texels.
    pub size: u32,
    pub layers: u32,
    pub filter: ShadowFilter,
    /// Casters before a map's near plane are pressed onto it: where the device can.
    pub clamp: bool,
    /// The most important first.
    pub lights: Vec<ShadowLight>,
    /// Of each map.
    pub tiles: Vec<Tile>,
}

impl ShadowPlan {
    /// Gives maps to the lights that ask for one, the most important first, until the budget is spent. The second part names
    /// those that go without, or with fewer cascades than they should have, and says why.
    pub(super) fn of(scene: &Scene, settings: &Settings, device: &Capabilities) -> (Option<Self>, Vec<String>) {
        let shadows = &settings.shadows;
        let layer_bytes = u64::from(shadows.size) * u64::from(shadows.size) * 4;
        let within_budget = (u64::from(shadows.budget) << 20) / layer_bytes;
        let most = u32::try_from(within_budget).unwrap_or(u32::MAX).min(device.max_layers);
        let mut plan = Self {
            size: shadows.size,
            layers: 0,
            filter: shadows.filter,
            clamp: device.depth_clamp,
            lights: Vec::new(),
            tiles: Vec::new(),
        };
        let mut free = Vec::new();
        let mut unserved = Vec::new();
        let reason = |short: Short| match short {
            Short::Views => format!("{MAX_SHADOW_VIEWS} maps are the most"),
            Short::Layers if within_budget > u64::from(most) => {
                format!("the device has no more than {} an image", layers_text(most))
            }
            Short::Layers => format!(
                "the budget of {} MiB for maps has room for {} of {} texels",
                shadows.budget,
                layers_text(most),
                shadows.size
            ),
        };
        for (light, source) in by_importance(scene, settings) {
            let wanted = Projection::of(source, shadows.cascades);
            let tries: Vec<Projection> = match wanted {
                Projection::Cascades(count) => (1..=count).rev().map(Projection::Cascades).collect(),
                Projection::Perspective | Projection::Cube => vec![wanted],
            };
            // The reason for the first try that fails: what keeps it from being whole.
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
                unserved.push((source.name.as_str(), reason(short), found.is_some()));
            }
            if let Some((projection, tiles)) = found {
                let first_view = plan.tiles.len();
                plan.tiles.extend(tiles);
                plan.lights.push(ShadowLight { light, name: source.name.clone(), first_view, projection });
            }
        }
        let warnings = warnings(&unserved);
        ((!plan.lights.is_empty()).then_some(plan), warnings)
    }

    /// Places for all maps of a light: whole layers for cascades, quarters for the others. When they do not all fit, why.
    fn room(&mut self, projection: Projection, free: &mut Vec<Tile>, most: u32) -> Result<Vec<Tile>, Short> {
        let count = projection.views();
        if self.tiles.len() + count > MAX_SHADOW_VIEWS {
            return Err(Short::Views);
        }
        let (whole, missing) = match projection {
            Projection::Cascades(count) => (true, count),
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

    /// Device memory of all layers.
    pub fn bytes(&self) -> u64 {
        u64::from(self.layers) * u64::from(self.size) * u64::from(self.size) * 4
    }

    /// What a light's record tells the shader of its maps, above the two bits of the fall-off (`shaders/shared/shadows.wgsl`): 0 for
    /// a light without one.
    pub fn code(&self, light: usize) -> u32 {
        self.lights.iter().find(|own| own.light == light).map_or(0, |own| {
            let (kind, count) = match own.projection {
                Projection::Cascades(count) => (1, count),
                Projection::Perspective => (2, 1),
                Projection::Cube => (3, 6),
            };
            (kind << 2) | ((own.first_view as u32) << 4) | (count << 12)
        })
    }

    /// Whether the near plane of a cascade lies before all casters. The distance of a blocker that is pressed onto it would be lost, and
    /// with it the penumbra's width.
    fn reaches_back(&self) -> bool {
        !self.clamp || self.filter == ShadowFilter::Pcss
    }

    /// How far from the point that is looked up texels are compared without their own depth being worked out, in texels along an
    /// axis. Biases grow with it.
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
    fn margin(&self, edge: u32, settings: &ShadowSettings) -> f64 {
        let offset = f64::from(settings.normal_offset) * self.reach() / FULL_REACH;
        (self.reach().max(self.disc(edge) + 1.0) + offset).ceil()
    }

    /// The factor of both biases.
    pub fn bias_scale(&self) -> f32 {
        (self.reach() / FULL_REACH) as f32
    }
}

/// What keeps a light from its maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Short {
    /// No layer is left that the budget has room for, or the device.
    Layers,
    /// There are as many maps as there can be.
    Views,
}

fn layers_text(count: u32) -> String {
    match count {
        0 => "no layer".into(),
        1 => "1 layer".into(),
        count => format!("{count} layers"),
    }
}

/// The reach of the 3x3 filter, for which the biases are said.
const FULL_REACH: f64 = 1.5;

/// Lights that ask for a shadow and can have one, with their index in [`World::lights`]. Directional ones first, then by how much
/// light they bring to where the scene's own camera stands: the order must not depend on where a camera is, or maps would come and go.
fn by_importance<'a>(scene: &'a Scene, settings: &Settings) -> Vec<(usize, &'a Light)> {
    let radius = scene.bounds().radius();
    let importance = |light: &Light| {
        let strength = f64::from(luminance(light.color)) * f64::from(light.intensity);
        match light.kind {
            LightKind::Directional { .. } => (0, strength),
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
                let distance_squared = position.distance_squared(scene.camera.position);
                (1, strength / (distance_squared + 0.01 * radius * radius).max(f64::MIN_POSITIVE))
            }
        }
    };
    let sorted = World::sorted(&scene.lights, settings).into_iter().map(|index| &scene.lights[index]);
    let mut asking: Vec<_> = sorted.enumerate().filter(|(_, light)| light.casts_shadow).collect();
    asking.sort_by(|(_, a), (_, b)| {
        let (a, b) = (importance(a), importance(b));
        a.0.cmp(&b.0).then_with(|| b.1.total_cmp(&a.1))
    });
    asking
}

/// A line for each reason, which names the lights: name, reason, and whether it has at least some of its cascades.
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

/// An object in a map, as it was when it was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Caster {
    pub draw: Draw,
    /// Counts how often it has moved.
    pub revision: u32,
}

/// One depth map: what a light sees. The depth is reversed, 1 near the light.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowView {
    /// Rows from world space to u and v in texels of the layer, depth, and w; the first three are to be divided by the last.
    rows: [DVec4; 4],
    pub tile: Tile,
    /// Edge of a texel in metres, where w is 1.
    pub texel: f64,
    /// The tangent of half the angle under which a directional light is seen, or the radius of another one in metres.
    pub light_size: f64,
    /// Where along the camera's view, in metres, the cascade ends, and where the next one begins to take over.
    pub end: f64,
    pub blend: f64,
    /// Nothing farther from this place is lit at all.
    reach: Option<(DVec3, f64)>,
    pub casters: Vec<Caster>,
}

impl ShadowView {
    fn orthographic(axes: &DMat3, tile: Tile, corner: DVec3, texel: f64, depth: f64) -> Self {
        let axes = axes.transpose();
        let row = |axis: DVec3, corner: f64, unit: f64| (axis / unit).extend(-corner / unit);
        let rows = [
            row(axes.x_axis, corner.x, texel) + DVec4::W * f64::from(tile.x),
            row(axes.y_axis, corner.y, texel) + DVec4::W * f64::from(tile.y),
            DVec4::W - row(axes.z_axis, corner.z, depth),
            DVec4::W,
        ];
        let [end, blend] = [f64::MAX; 2];
        Self { rows, tile, texel, light_size: 0.0, end, blend, reach: None, casters: Vec::new() }
    }

    /// `tangent` is that of half the angle that the map without its margin sees.
    fn perspective(place: DVec3, direction: DVec3, tangent: f64, near: f64, tile: Tile, margin: f64) -> Self {
        let axes = light_axes(direction).transpose();
        let edge = f64::from(tile.edge);
        let texel = 2.0 * tangent / (edge - 2.0 * margin).max(0.25 * edge);
        let row = |axis: DVec3| axis.extend(-axis.dot(place));
        let w = row(axes.z_axis);
        let centre = |corner: u32| w * (f64::from(corner) + 0.5 * edge);
        let rows =
            [row(axes.x_axis) / texel + centre(tile.x), row(axes.y_axis) / texel + centre(tile.y), DVec4::W * near, w];
        let [end, blend] = [f64::MAX; 2];
        Self { rows, tile, texel, light_size: 0.0, end, blend, reach: None, casters: Vec::new() }
    }

    /// Whether the box can stand between the light and anything in the map.
    fn may_shadow(&self, bounds: &Aabb) -> bool {
        if let Some((place, range)) = self.reach
            && place.distance(place.clamp(bounds.min, bounds.max)) > range
        {
            return false;
        }
        let [u, v, depth, w] = self.rows;
        let (x, y, edge) = (f64::from(self.tile.x), f64::from(self.tile.y), f64::from(self.tile.edge));
        let planes = [u - w * x, w * (x + edge) - u, v - w * y, w * (y + edge) - v, depth, w];
        let (center, half) = (bounds.center(), bounds.size() * 0.5);
        planes.into_iter().all(|plane| {
            let (normal, offset) = (plane.truncate(), plane.w);
            let (at, reach) = (normal.dot(center), normal.abs().dot(half));
            // The slack keeps rounding from cutting what touches a plane.
            at + offset + reach >= -1e-9 * (at.abs() + offset.abs() + reach)
        })
    }

    fn with_casters(mut self, world: &World) -> Arc<Self> {
        let casts = |index: &usize| {
            let object = &world.objects[*index];
            object.casts != CastsShadow::No && self.may_shadow(&object.bounds)
        };
        let mut casters: Vec<usize> = (0..world.objects.len()).filter(casts).collect();
        // Casters that share a pipeline and a material follow each other.
        casters.sort_by_key(|&index| {
            let object = &world.objects[index];
            (object.key.masked, object.casts, object.key.mirrored, object.material, index)
        });
        self.casters = casters
            .into_iter()
            .map(|object| Caster { draw: Draw { object }, revision: world.objects[object].revision })
            .collect();
        Arc::new(self)
    }

    /// Whether the same texels come of drawing it.
    fn draws_as(&self, other: &Self) -> bool {
        (self.rows, self.tile) == (other.rows, other.tile) && self.casters == other.casters
    }

    /// Rows of the map from camera-relative world space to u and v in texels of the layer, depth and w.
    pub fn texel_rows(&self, camera: &Camera) -> [Vec4; 4] {
        self.rows.map(|row| {
            let axis = row.truncate();
            axis.extend(row.w + axis.dot(camera.position)).as_vec4()
        })
    }

    /// Rows of the map from a mesh to the light's clip space, of which the tile is the viewport.
    pub fn clip_rows(&self, transform: &DAffine3) -> [Vec4; 4] {
        let [u, v, depth, w] = self.rows;
        let edge = f64::from(self.tile.edge);
        let to_clip = |row: DVec4, corner: u32| (row - w * f64::from(corner)) * (2.0 / edge) - w;
        [to_clip(u, self.tile.x), to_clip(v, self.tile.y), depth, w].map(|row| {
            let axis = row.truncate();
            let linear = transform.matrix3.transpose() * axis;
            linear.extend(row.w + axis.dot(transform.translation)).as_vec4()
        })
    }
}

/// Which maps hold what they should, so that only the others are drawn.
#[derive(Debug, Default)]
pub struct ShadowCache {
    drawn: Vec<Option<Arc<ShadowView>>>,
}

impl ShadowCache {
    /// The maps that would come out otherwise than they are.
    pub fn stale(&self, views: &[Option<Arc<ShadowView>>]) -> Vec<usize> {
        let is_stale = |index: &usize| match (&views[*index], self.drawn.get(*index)) {
            (None, _) => false,
            (Some(view), Some(Some(drawn))) => !Arc::ptr_eq(view, drawn) && !view.draws_as(drawn),
            (Some(_), _) => true,
        };
        (0..views.len()).filter(is_stale).collect()
    }

    /// Remembers what was drawn.
    pub fn keep(&mut self, views: &[Option<Arc<ShadowView>>], drawn: &[usize]) {
        self.drawn.resize(views.len(), None);
        for &index in drawn {
            self.drawn[index].clone_from(&views[index]);
        }
    }
}

/// Rows: a map's u and v axis and the direction of its light, in world space. Right-handed with v downwards, as Vulkan's clip space,
/// and fixed in the world, so that edges of shadows do not turn with the camera.
fn light_axes(direction: DVec3) -> DMat3 {
    let up = if direction.y.abs() < 0.99 { DVec3::Y } else { DVec3::Z };
    let right = direction.cross(up).normalize_or(DVec3::X);
    DMat3::from_cols(right, direction.cross(right), direction).transpose()
}

/// What has changed since the maps of lamps were worked out.
#[derive(Debug, Clone, Default)]
pub(super) struct Changes {
    /// Indices into [`World::lights`].
    pub lights: BTreeSet<usize>,
    /// Where objects that cast were, and where they are.
    pub boxes: Vec<Aabb>,
}

/// Maps of the point and spot lights, which no camera changes. The others are none. Those of `before` stay whose light is as it was
/// and in whose volume nothing has moved.
pub(super) fn lamp_views(
    world: &World,
    plan: &ShadowPlan,
    before: &[Option<Arc<ShadowView>>],
    changes: &Changes,
) -> Vec<Option<Arc<ShadowView>>> {
    let mut views = vec![None; plan.tiles.len()];
    for own in &plan.lights {
        let light = &world.lights[own.light];
        let (place, direction, tangent, range) = match light.kind {
            LightKind::Directional { .. } => continue,
            LightKind::Point { position, range, .. } => (position, DVec3::Z, 1.0, range),
            LightKind::Spot { position, direction, outer_angle_degrees, range, .. } => {
                (position, direction, outer_angle_degrees.to_radians().tan(), range)
            }
        };
        let near = NEAR * range.unwrap_or(f64::INFINITY).min(world.radius).max(f64::MIN_POSITIVE);
        for index in own.first_view..own.first_view + own.projection.views() {
            if let Some(Some(before)) = before.get(index)
                && !changes.lights.contains(&own.light)
                && !changes.boxes.iter().any(|bounds| before.may_shadow(bounds))
            {
                views[index] = Some(before.clone());
                continue;
            }
            let (direction, tangent) = match own.projection {
                Projection::Cube => (FACES[index - own.first_view], 1.0),
                // A cone of no angle still has a map.
                _ => (direction, tangent.max(1e-3)),
            };
            let tile = plan.tiles[index];
            let margin = plan.margin(tile.edge, &world.shadows);
            let view = ShadowView {
                light_size: light.size,
                reach: range.map(|range| (place, range)),
                ..ShadowView::perspective(place, direction, tangent, near, tile, margin)
            };
            views[index] = Some(view.with_casters(world));
        }
    }
    views
}

/// Adds the cascades of the directional lights, each around its slice of the camera's view. Where none of the `seen` boxes lies in it,
/// there is none. One that holds the whole scene is the last: those behind it would be the same.
pub(super) fn add_cascades(
    views: &mut [Option<Arc<ShadowView>>],
    world: &World,
    plan: &ShadowPlan,
    camera: &Camera,
    aspect: f64,
    seen: &[Aabb],
) {
    let forward = camera.forward();
    let along = |bounds: &Aabb| {
        let (center, half) = ((bounds.center() - camera.position).dot(forward), forward.abs().dot(bounds.size() * 0.5));
        (center - half, center + half)
    };
    let far = farthest(&world.extent, camera);
    for own in &plan.lights {
        let (Projection::Cascades(count), LightKind::Directional { direction }) =
            (own.projection, world.lights[own.light].kind)
        else {
            continue;
        };
        let axes = light_axes(direction);
        let mut begin = camera.near;
        for cascade in 0..count {
            let tile = plan.tiles[own.first_view + cascade as usize];
            let end = split(camera.near, far, world.shadows.lambda, cascade + 1, count);
            let slice = Sphere::around(camera, aspect, begin, end);
            let fit = Fit::of(world, plan, &axes, &slice);
            let is_last = cascade + 1 == count || fit.is_whole;
            // In the last part of the one before, this one is looked up too.
            let blend = if is_last { f64::MAX } else { end - BLEND * (end - begin) };
            let last_seen = if is_last { f64::MAX } else { end };
            let volume = view_corners(camera, aspect, begin, last_seen.min(far));
            let in_slice = seen.iter().filter(|bounds| along(bounds).0 <= last_seen && along(bounds).1 >= begin);
            if is_seen(&axes, &volume, in_slice) {
                let half_angle = (0.5 * world.lights[own.light].size).to_radians();
                let view = fit.view(world, plan, tile, &axes);
                let view = ShadowView { light_size: half_angle.tan(), end: last_seen, blend, ..view };
                views[own.first_view + cascade as usize] = Some(view.with_casters(world));
            }
            if is_last {
                break;
            }
            begin = blend;
        }
    }
}

/// The distance along the view at which cascades end, in metres. From inside the sphere around the scene it is always that sphere's
/// diameter. From outside it follows the camera in steps of a quarter of a power of two; how the camera is turned never matters.
fn farthest(extent: &Aabb, camera: &Camera) -> f64 {
    let radius = extent.radius();
    let distance = camera.position.distance(extent.center());
    if distance <= radius {
        return (2.0 * radius).max(camera.near);
    }
    quantized(distance + radius).max(camera.near)
}

/// The next larger quarter of a power of two.
fn quantized(length: f64) -> f64 {
    ((length.log2() * 4.0).ceil() * 0.25).exp2()
}

/// The box of a scene whose objects have moved: that of the scene as it was `at_first`, widened on all sides, in steps of a quarter of a
/// power of two of its radius, until it holds them. So maps of the whole scene stay as they are while something moves within it.
pub(super) fn widened(at_first: &Aabb, bounds: &Aabb) -> Aabb {
    if at_first.is_empty() || bounds.is_empty() {
        return *bounds;
    }
    let beyond = (at_first.min - bounds.min).max(bounds.max - at_first.max).max_element();
    if beyond <= 0.0 {
        return *at_first;
    }
    let radius = at_first.radius().max(f64::MIN_POSITIVE);
    // Never less than what is beyond, however that rounds.
    let by = (quantized(1.0 + beyond / radius) * radius - radius).max(beyond);
    Aabb { min: at_first.min - by, max: at_first.max + by }
}

/// Where the cascade ends, in metres along the view: the practical split scheme (Zhang et al. 2006, "Parallel-Split Shadow Maps for
/// Large-scale Virtual Environments"), a mixture of logarithmic and even splits.
fn split(near: f64, far: f64, lambda: f32, index: u32, count: u32) -> f64 {
    let near = near.max(NEAREST_SPLIT * far);
    let (share, lambda) = (f64::from(index) / f64::from(count), f64::from(lambda));
    lambda * near * (far / near).powf(share) + (1.0 - lambda) * (near + (far - near) * share)
}

struct Sphere {
    center: DVec3,
    radius: f64,
}

impl Sphere {
    /// The smallest one around the part of the camera's view between two distances along it. Its size is the same wherever the
    /// camera is and however it is turned.
    fn around(camera: &Camera, aspect: f64, begin: f64, end: f64) -> Self {
        let tan_y = (camera.fov_y_degrees.to_radians() * 0.5).tan();
        // A corner at distance d is d * slope beside the axis. The centre is as far from the near corners as from the far ones, but
        // not behind these.
        let slope_squared = tan_y * tan_y * (1.0 + aspect * aspect);
        let along = (0.5 * (begin + end) * (1.0 + slope_squared)).min(end);
        let radius = (end - along).hypot(end * slope_squared.sqrt());
        Self { center: camera.position + camera.forward() * along, radius }
    }
}

/// Where a cascade lies, in the axes of its light.
struct Fit {
    /// It holds the whole scene, wherever the camera is.
    is_whole: bool,
    /// Edge of the square that is looked up, in metres, and its least corner, before it is snapped.
    edge: f64,
    low: DVec3,
    /// How far it is seen along the light.
    high: f64,
}

impl Fit {
    /// Around a sphere, but never larger than what holds the scene. All sizes depend on the sphere's and the scene's alone.
    fn of(world: &World, plan: &ShadowPlan, axes: &DMat3, slice: &Sphere) -> Self {
        let scene = world.extent.transformed(&DAffine3::from_mat3(*axes));
        let whole = scene.size().truncate().max_element();
        let least = (1e-6 * world.radius).max(1e-30);
        if 2.0 * slice.radius >= whole {
            return Self { is_whole: true, edge: whole.max(least), low: scene.min, high: scene.max.z };
        }
        let edge = (2.0 * slice.radius).max(least);
        let low = *axes * slice.center - 0.5 * edge;
        // A slice that ends behind the scene needs no depth there, nor before it.
        let first = if plan.reaches_back() { scene.min.z } else { low.z.max(scene.min.z) };
        let high = (low.z + edge).min(scene.max.z).max(first);
        Self { is_whole: false, edge, low: low.truncate().extend(first), high }
    }

    fn view(&self, world: &World, plan: &ShadowPlan, tile: Tile, axes: &DMat3) -> ShadowView {
        let margin = plan.margin(tile.edge, &world.shadows);
        let texels = f64::from(tile.edge);
        let texel = self.edge / (texels - 2.0 * margin - 1.0).max(0.25 * texels);
        let snap = |low: f64| (low / texel).floor() * texel - margin * texel;
        // Steps in depth as well, so that a small step of the camera leaves the map as it is; and with room before and behind, so that
        // what touches a plane is inside.
        let step = self.edge / 16.0;
        let near = ((self.low.z / step).floor() - 1.0) * step;
        let depth = ((self.high / step).ceil() + 1.0) * step - near;
        let corner = DVec3::new(snap(self.low.x), snap(self.low.y), near);
        ShadowView::orthographic(axes, tile, corner, texel, depth)
    }
}

/// Whether any of the boxes lies in a part of the camera's view, as far as boxes around both in the light's axes tell.
fn is_seen<'a>(axes: &DMat3, volume: &[DVec3], seen: impl Iterator<Item = &'a Aabb>) -> bool {
    let to_light = DAffine3::from_mat3(*axes);
    let receivers = seen.fold(Aabb::EMPTY, |all, bounds| all.union(&bounds.transformed(&to_light)));
    !receivers.intersection(&Aabb::of_points(volume.iter().map(|&corner| *axes * corner))).is_empty()
}

/// Corners of the view volume between two distances along the view.
fn view_corners(camera: &Camera, aspect: f64, begin: f64, end: f64) -> [DVec3; 8] {
    let tan_y = (camera.fov_y_degrees.to_radians() * 0.5).tan();
    let (right, up) = (camera.right() * tan_y * aspect, camera.up() * tan_y);
    std::array::from_fn(|i| {
        let distance = if i & 1 == 0 { begin } else { end };
        let x = if i & 2 == 0 { -1.0 } else { 1.0 };
        let y = if i & 4 == 0 { -1.0 } else { 1.0 };
        camera.position + (camera.forward() + right * x + up * y) * distance
    })
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use proptest::prelude::*;

    use super::*;
    use crate::plan::{FramePlan, Visible, samples};
    use crate::scene::{Falloff, Material, Object};

    const ASPECT: f64 = 16.0 / 9.0;

    /// A scene of boxes under some lights.
    fn scene(boxes: &[(DVec3, DVec3)], lights: Vec<Light>) -> Scene {
        let mut scene: Scene = samples::scene(vec![Material::default(); boxes.len()], lights);
        // The mesh of the samples is the unit square; here it stands for the unit cube that its box says.
        scene.meshes[0].bounds = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
        let place = |object: &mut Object, (center, size): &(DVec3, DVec3)| {
            object.transform = DAffine3::from_scale_rotation_translation(*size, DQuat::IDENTITY, *center - *size * 0.5);
        };
        scene.objects.iter_mut().zip(boxes).for_each(|(object, at)| place(object, at));
        scene
    }

    fn settings(shadows: ShadowSettings) -> Settings {
        Settings { size: [1600, 900], shadows, ..Settings::default() }
    }

    fn planned(scene: &Scene, shadows: ShadowSettings, device: &Capabilities) -> (World, FramePlan) {
        let settings = settings(shadows);
        let plan = FramePlan::of(scene, &settings, device).expect("a plan");
        (World::of(scene, &settings, &plan, 1.0), plan)
    }

    fn sun(direction: DVec3) -> Light {
        Light { kind: LightKind::Directional { direction }, ..samples::sun() }
    }

    fn lamp(position: DVec3, range: Option<f64>) -> Light {
        let kind = LightKind::Point { position, range, falloff: Falloff::InverseSquare };
        Light { kind, casts_shadow: true, ..samples::sun() }
    }

    fn spot(position: DVec3, direction: DVec3, outer_angle_degrees: f64) -> Light {
        let falloff = Falloff::InverseSquare;
        let kind = LightKind::Spot {
            position,
            direction,
            inner_angle_degrees: 0.0,
            outer_angle_degrees,
            range: None,
            falloff,
        };
        Light { kind, casts_shadow: true, ..samples::sun() }
    }

    /// As a plan's world sees it, on a device that can or cannot clamp depth.
    fn world(boxes: &[(DVec3, DVec3)], direction: DVec3, depth_clamp: bool) -> (World, FramePlan) {
        let device = Capabilities { depth_clamp, ..samples::device() };
        planned(&scene(boxes, vec![sun(direction)]), ShadowSettings::default(), &device)
    }

    fn vector(range: f64) -> impl Strategy<Value = DVec3> {
        [-range..range, -range..range, -range..range].prop_map(DVec3::from)
    }

    fn direction() -> impl Strategy<Value = DVec3> {
        vector(1.0).prop_filter_map("too short", |v| (v.length() > 0.1).then(|| v.normalize()))
    }

    fn boxes() -> impl Strategy<Value = Vec<(DVec3, DVec3)>> {
        let size = [0.0..8.0, 0.0..8.0, 0.01..8.0].prop_map(DVec3::from);
        proptest::collection::vec((vector(30.0), size), 1..6)
    }

    fn camera() -> impl Strategy<Value = Camera> {
        (vector(40.0), vector(10.0), 20.0..100.0f64).prop_map(|(position, target, fov_y_degrees)| Camera {
            fov_y_degrees,
            ..Camera::looking_at(position, target, DVec3::Y)
        })
    }

    /// u, v in texels of the layer and depth, and w.
    fn map(view: &ShadowView, point: DVec3) -> (DVec3, f64) {
        let [u, v, depth, w] = view.rows.map(|row| row.truncate().dot(point) + row.w);
        (DVec3::new(u, v, depth) / w, w)
    }

    /// Texels between a point and the nearest edge of the map; negative outside.
    fn room(view: &ShadowView, at: DVec3) -> f64 {
        let low = at.truncate() - DVec3::new(f64::from(view.tile.x), f64::from(view.tile.y), 0.0).truncate();
        low.min(f64::from(view.tile.edge) - low).min_element()
    }

    /// The distance along the view, of a point that the camera sees.
    fn seen_at(camera: &Camera, point: DVec3) -> Option<f64> {
        let offset = point - camera.position;
        let distance = offset.dot(camera.forward());
        let tan_y = (camera.fov_y_degrees.to_radians() * 0.5).tan();
        let inside = distance >= camera.near
            && offset.dot(camera.up()).abs() <= distance * tan_y
            && offset.dot(camera.right()).abs() <= distance * tan_y * ASPECT;
        inside.then_some(distance)
    }

    /// The cascades that the shader looks up for what is so far away: one, or two where they blend.
    fn cascades_at(views: &[Option<Arc<ShadowView>>], distance: f64) -> Vec<Option<Arc<ShadowView>>> {
        let end = |view: &Option<Arc<ShadowView>>| view.as_ref().map_or(0.0, |view| view.end);
        let blend = |view: &Option<Arc<ShadowView>>| view.as_ref().map_or(0.0, |view| view.blend);
        let last = views.len() - 1;
        let index = (0..last).find(|&index| distance <= end(&views[index])).unwrap_or(last);
        let mut found = vec![views[index].clone()];
        if index < last && distance > blend(&views[index]) {
            found.push(views[index + 1].clone());
        }
        found
    }

    proptest! {
        #[test]
        fn all_that_the_camera_sees_lies_in_its_cascade_with_room_for_the_filter(
            boxes in boxes(), sun in direction(), camera in camera(), clamp: bool,
            inside in proptest::collection::vec([0.0..1.0, 0.0..1.0, 0.0..1.0f64], 32),
        ) {
            let (world, plan) = world(&boxes, sun, clamp);
            let views = Visible::of(&world, &camera, &plan).shadows;
            for object in &world.objects {
                for point in inside.iter().map(|&t| object.bounds.min + DVec3::from(t) * object.bounds.size()) {
                    let Some(distance) = seen_at(&camera, point) else { continue };
                    for view in cascades_at(&views, distance) {
                        let view = view.expect("something is seen in this cascade");
                        let (at, w) = map(&view, point);
                        prop_assert!(w == 1.0 && (0.0..=1.0).contains(&at.z), "{at}");
                        // 3x3 texels around it, and the offset along the normal.
                        prop_assert!(room(&view, at) >= 2.0, "{at}");
                    }
                }
            }
        }

        #[test]
        fn without_clamping_nothing_lies_before_the_near_plane(
            boxes in boxes(), sun in direction(), camera in camera(),
        ) {
            let (world, plan) = world(&boxes, sun, false);
            for view in Visible::of(&world, &camera, &plan).shadows.iter().flatten() {
                for corner in world.objects.iter().flat_map(|object| object.bounds.corners()) {
                    prop_assert!(map(view, corner).0.z <= 1.0);
                }
            }
        }

        #[test]
        fn what_stands_between_a_light_and_its_map_is_a_caster(
            boxes in boxes(), to in direction(), camera in camera(), lamp_at in vector(20.0), angle in 1.0..60.0f64,
            inside in [0.0..1.0, 0.0..1.0, 0.0..1.0f64], clamp: bool,
        ) {
            let device = Capabilities { depth_clamp: clamp, ..samples::device() };
            let lights = vec![sun(to), lamp(lamp_at, Some(30.0)), spot(lamp_at, to, angle)];
            let (world, plan) = planned(&scene(&boxes, lights), ShadowSettings::default(), &device);
            for view in Visible::of(&world, &camera, &plan).shadows.iter().flatten() {
                for (index, object) in world.objects.iter().enumerate() {
                    let point = object.bounds.min + DVec3::from(inside) * object.bounds.size();
                    let (at, w) = map(view, point);
                    let in_range = view.reach.is_none_or(|(place, range)| place.distance(point) <= range);
                    let reaches = w > 0.0 && room(view, at) > 0.0 && at.z > 0.0 && in_range;
                    let is_caster = view.casters.iter().any(|caster| caster.draw.object == index);
                    prop_assert!(is_caster || !reaches, "{at}");
                }
            }
        }

        #[test]
        fn a_point_light_sees_every_direction_in_one_face_and_a_spot_its_whole_cone(
            lamp_at in vector(20.0), to in direction(), ray in direction(), angle in 0.1..60.0f64, far in 0.1..50.0f64,
        ) {
            let point = lamp_at + ray * far;
            let lights = vec![lamp(lamp_at, None), spot(lamp_at, to, angle)];
            let (world, plan) = planned(&scene(&[(DVec3::ZERO, DVec3::ONE)], lights), ShadowSettings::default(), &samples::device());
            let shadow = plan.shadow.as_ref().expect("maps");
            let views = &Visible::of(&world, &Camera::default(), &plan).shadows;
            for light in &shadow.lights {
                let own = &views[light.first_view..light.first_view + light.projection.views()];
                // `cube_face` of the shader: the longest axis.
                let axis = (0..3).max_by(|&a, &b| ray[a].abs().total_cmp(&ray[b].abs())).unwrap();
                let (face, lit) = match light.projection {
                    Projection::Cube => (2 * axis + usize::from(ray[axis] < 0.0), true),
                    _ => (0, to.angle_between(ray).to_degrees() <= angle),
                };
                if lit {
                    let view = own[face].as_ref().expect("a map");
                    let (at, w) = map(view, point);
                    prop_assert!(w > 0.0 && at.z > 0.0 && at.z < 1.0, "{at} {w}");
                    prop_assert!(room(view, at) >= 2.9, "{at} of {:?}", view.tile);
                    // Similar triangles: a texel's edge grows with the distance along the axis.
                    let (next, _) = map(view, point + view.rows[0].truncate().reject_from(view.rows[3].truncate()).normalize() * view.texel * w);
                    prop_assert!(((next - at).x - 1.0).abs() < 1e-6, "{at} {next}");
                }
            }
        }

        #[test]
        fn a_walking_and_turning_camera_does_not_move_texels_over_the_world(
            boxes in boxes(), sun in direction(), camera in camera(), step in vector(0.5), turn in vector(0.4), point in vector(30.0),
            walks: bool, turns: bool, cascades in 1..=4u32, clamp: bool,
        ) {
            let device = Capabilities { depth_clamp: clamp, ..samples::device() };
            let shadows = ShadowSettings { cascades, ..ShadowSettings::default() };
            let (world, plan) = planned(&scene(&boxes, vec![self::sun(sun)]), shadows, &device);
            let sphere = |camera: &Camera| camera.position.distance(world.bounds.center()) <= world.bounds.radius();
            for cascade in 0..cascades as usize {
                let mut before: Option<(Arc<ShadowView>, Camera)> = None;
                for i in 0..24 {
                    let (walked, turned) = (f64::from(i) * f64::from(u8::from(walks)), f64::from(i) * f64::from(u8::from(turns)));
                    let ahead = DQuat::from_scaled_axis(turn * turned) * camera.forward();
                    let place = camera.position + step * walked;
                    let moved = Camera { fov_y_degrees: camera.fov_y_degrees, ..Camera::looking_at(place, place + ahead, DVec3::Y) };
                    let Some(view) = Visible::of(&world, &moved, &plan).shadows[cascade].clone() else { continue };
                    let (origin, _) = map(&view, DVec3::ZERO);
                    let corner = origin.truncate();
                    prop_assert!((corner - corner.round()).abs().max_element() < 1e-6, "{corner}");
                    if let Some((before, place)) = &before {
                        // The size is the same while the camera only turns, and while it walks inside the sphere around the scene.
                        if !walks || (sphere(&moved) && sphere(place)) {
                            prop_assert_eq!((view.texel, view.end, view.blend), (before.texel, before.end, before.blend));
                        }
                        if view.texel == before.texel {
                            let slid = (map(&view, point).0 - map(before, point).0).truncate();
                            prop_assert!((slid - slid.round()).abs().max_element() < 1e-5, "{slid}");
                        }
                    }
                    before = Some((view, moved));
                }
            }
        }

        #[test]
        fn a_map_of_the_whole_scene_stays_wherever_the_camera_is(
            boxes in boxes(), sun in direction(), a in camera(), b in camera(), clamp: bool,
        ) {
            let device = Capabilities { depth_clamp: clamp, ..samples::device() };
            let shadows = ShadowSettings { cascades: 1, ..ShadowSettings::default() };
            let (world, plan) = planned(&scene(&boxes, vec![self::sun(sun)]), shadows, &device);
            let views = [a, b].map(|camera| Visible::of(&world, &camera, &plan).shadows);
            // A slice as long as the scene is as wide as it; a narrow view from inside may need less.
            if let [Some(a), Some(b)] = [&views[0][0], &views[1][0]] {
                let whole = world.bounds.transformed(&DAffine3::from_mat3(light_axes(sun))).size().truncate().max_element();
                let usable = f64::from(a.tile.edge) - 2.0 * plan.shadow.as_ref().map_or(0.0, |shadow| shadow.margin(a.tile.edge, &world.shadows)) - 1.0;
                for view in [a, b] {
                    prop_assert!(view.texel * usable <= whole.max(1e-6 * world.radius) * (1.0 + 1e-9), "{} {whole}", view.texel * usable);
                }
                let is_whole = |view: &ShadowView| view.texel * usable >= whole * (1.0 - 1e-9);
                if is_whole(a) && is_whole(b) {
                    prop_assert!(a.draws_as(b));
                }
            }
        }

        #[test]
        fn the_sphere_around_a_slice_holds_its_corners_and_touches_them(
            camera in camera(), begin in 0.01..20.0f64, long in 0.01..50.0f64,
        ) {
            let end = begin + long;
            let sphere = Sphere::around(&camera, ASPECT, begin, end);
            let distances = view_corners(&camera, ASPECT, begin, end).map(|corner| corner.distance(sphere.center));
            let farthest = distances.into_iter().fold(0.0, f64::max);
            prop_assert!((farthest / sphere.radius - 1.0).abs() < 1e-9, "{distances:?} {}", sphere.radius);
        }

        #[test]
        fn a_widened_box_holds_what_moved_and_grows_in_steps(boxes in boxes(), to in vector(200.0)) {
            let all = |boxes: &[(DVec3, DVec3)]| Aabb::of_points(boxes.iter().flat_map(|(c, s)| [*c - *s * 0.5, *c + *s * 0.5]));
            let at_first = all(&boxes);
            let mut moved = boxes.clone();
            moved[0].0 = to;
            let (bounds, wide) = (all(&moved), widened(&at_first, &all(&moved)));
            prop_assert!(wide.union(&bounds) == wide && wide.union(&at_first) == wide, "{wide:?}");
            let by = (at_first.min.x - wide.min.x) / at_first.radius();
            prop_assert!(((1.0 + by).log2() * 4.0 - ((1.0 + by).log2() * 4.0).round()).abs() < 1e-6, "{by}");
            prop_assert_eq!(widened(&at_first, &boxes[..1].iter().fold(at_first, |all, _| all)), at_first);
        }

        #[test]
        fn lookups_and_the_map_agree_on_every_point(
            boxes in boxes(), to in direction(), camera in camera(), lamp_at in vector(20.0),
            turn in vector(3.0), scale in [0.1..3.0, 0.1..3.0, -3.0..-0.1f64], shift in vector(20.0), vertex in vector(3.0),
        ) {
            let lights = vec![sun(to), lamp(lamp_at, None), spot(lamp_at, to, 30.0)];
            let (world, plan) = planned(&scene(&boxes, lights), ShadowSettings::default(), &samples::device());
            let rotation = DQuat::from_scaled_axis(turn);
            let transform = DAffine3::from_scale_rotation_translation(scale.into(), rotation, shift);
            let point = transform.transform_point3(vertex);
            // The value of a row, and what its rounding to f32 amounts to: 2^-24 of each term.
            let value = |row: Vec4, p: DVec3| {
                let row = row.as_dvec4();
                let terms = row.truncate() * p;
                (terms.element_sum() + row.w, 6e-8 * (terms.abs().element_sum() + row.w.abs()))
            };
            for view in Visible::of(&world, &camera, &plan).shadows.iter().flatten() {
                let exact = view.rows.map(|row| row.truncate().dot(point) + row.w);
                let (texel_rows, clip_rows) = (view.texel_rows(&camera), view.clip_rows(&transform));
                let edge = f64::from(view.tile.edge);
                let corner = [view.tile.x, view.tile.y].map(f64::from);
                for axis in 0..4 {
                    let (texel, rounding) = value(texel_rows[axis], point - camera.position);
                    prop_assert!((texel - exact[axis]).abs() <= rounding + 1e-9, "row {axis}: {texel} {exact:?}");
                    let (clip, rounding) = value(clip_rows[axis], vertex);
                    let mapped = match axis {
                        0 | 1 => (exact[axis] - corner[axis] * exact[3]) * 2.0 / edge - exact[3],
                        _ => exact[axis],
                    };
                    prop_assert!((clip - mapped).abs() <= rounding + 1e-9, "row {axis}: {clip} {mapped}");
                }
            }
        }

        #[test]
        fn splits_ascend_from_near_to_far(
            near in 1e-3..10.0f64, factor in 1.0..1e6f64, lambda in 0.0..=1.0f32, count in 1..=4u32,
        ) {
            let far = near * factor;
            let ends: Vec<f64> = (1..=count).map(|index| split(near, far, lambda, index, count)).collect();
            prop_assert!(ends.windows(2).all(|pair| pair[0] <= pair[1]) && ends[0] > 0.0, "{ends:?}");
            prop_assert!((ends[ends.len() - 1] / far - 1.0).abs() < 1e-9, "{ends:?} {far}");
        }
    }

    #[test]
    fn maps_are_right_handed_and_deeper_away_from_the_light() {
        let lights = vec![sun(DVec3::NEG_Y), lamp(DVec3::Y * 3.0, None), spot(DVec3::Y * 3.0, DVec3::NEG_Y, 30.0)];
        let scene = scene(&[(DVec3::ZERO, DVec3::ONE)], lights);
        let (world, plan) = planned(&scene, ShadowSettings::default(), &samples::device());
        let camera = Camera::looking_at(DVec3::new(0.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
        let views = Visible::of(&world, &camera, &plan).shadows;
        let down =
            |view: &&Arc<ShadowView>| map(view, DVec3::Y).1 > 0.0 && view.rows[1].y.abs() < view.rows[0].length();
        assert!(views.iter().flatten().filter(down).count() >= 3);
        for view in views.iter().flatten() {
            // An orthographic map has no axis in its w; there the depth falls along it.
            let axis = match view.rows[3].truncate() {
                DVec3::ZERO => -view.rows[2].truncate(),
                axis => axis,
            };
            let axes = DMat3::from_cols(view.rows[0].truncate(), view.rows[1].truncate(), axis);
            assert!(axes.determinant() > 0.0, "{:?}", view.rows);
            let along = axis.normalize();
            let start = camera.position.reject_from(along) + along * 50.0;
            let (near, far) = (map(view, start).0.z, map(view, start + along).0.z);
            assert!(far < near, "{near} {far}");
        }
    }

    #[test]
    fn where_nothing_is_seen_there_is_no_cascade() {
        let (world, plan) = world(&[(DVec3::ZERO, DVec3::ONE)], DVec3::NEG_Y, true);
        let away = Camera::looking_at(DVec3::Z * 5.0, DVec3::Z * 10.0, DVec3::Y);
        let visible = Visible::of(&world, &away, &plan);
        assert!(visible.shadows.len() == 3 && visible.shadows.iter().all(Option::is_none) && visible.draws.is_empty());
        assert_eq!(visible.culled, 1);
    }

    fn tiles_of(lights: Vec<Light>, shadows: ShadowSettings) -> (Option<ShadowPlan>, Vec<String>) {
        let scene = scene(&[(DVec3::ZERO, DVec3::ONE)], lights);
        ShadowPlan::of(&scene, &settings(shadows), &samples::device())
    }

    #[test]
    fn maps_do_not_overlap_and_fill_layers_before_new_ones_are_taken() {
        let lights =
            vec![lamp(DVec3::X, None), spot(DVec3::X, DVec3::Y, 20.0), sun(DVec3::NEG_Y), lamp(DVec3::Z, None)];
        let (plan, warnings) = tiles_of(lights, ShadowSettings::default());
        let plan = plan.expect("maps");
        assert!(warnings.is_empty(), "{warnings:?}");
        // Three cascades, then 13 quarters.
        assert_eq!((plan.tiles.len(), plan.layers), (16, 3 + 4));
        let mut taken = std::collections::BTreeSet::new();
        for tile in &plan.tiles {
            assert!(tile.layer < plan.layers && tile.x.max(tile.y) + tile.edge <= plan.size, "{tile:?}");
            let edge = plan.size / 2;
            let quarters = (0..tile.edge / edge).flat_map(|x| (0..tile.edge / edge).map(move |y| (x, y)));
            for (x, y) in quarters {
                assert!(taken.insert((tile.layer, tile.x / edge + x, tile.y / edge + y)), "{tile:?}");
            }
        }
    }

    #[test]
    fn when_the_budget_is_spent_the_most_important_lights_have_maps_and_the_others_are_named() {
        let named = |name: &str, light: Light, intensity: f32| Light { name: name.into(), intensity, ..light };
        let lights = vec![
            named("dim", lamp(DVec3::X, None), 1.0),
            named("bright", lamp(DVec3::X, None), 100.0),
            named("sun", sun(DVec3::NEG_Y), 0.1),
            named("tiny", spot(DVec3::X, DVec3::Y, 20.0), 0.01),
            named("dark", lamp(DVec3::X, None), 0.0),
            Light { casts_shadow: false, ..named("bare", lamp(DVec3::X, None), 1e9) },
        ];
        // Layers of 4 MiB: three cascades, then two layers for six faces, of which two tiles are left.
        let budget = |budget| ShadowSettings { size: 1024, budget, ..ShadowSettings::default() };
        let names = |plan: &Option<ShadowPlan>| -> Vec<String> {
            plan.iter().flat_map(|plan| plan.lights.iter().map(|light| light.name.clone())).collect()
        };
        let (plan, warnings) = tiles_of(lights.clone(), budget(20));
        assert_eq!(names(&plan), ["sun", "bright", "tiny"]);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].starts_with("the light dim is without the shadow"), "{warnings:?}");
        assert!(warnings[0].contains("20 MiB") && warnings[0].contains("5 layers of 1024"), "{warnings:?}");
        assert!(plan.is_some_and(|plan| plan.bytes() == 20 << 20));
        // Not even all cascades.
        let (plan, warnings) = tiles_of(lights.clone(), budget(8));
        assert_eq!(
            plan.as_ref().map(|plan| (plan.lights[0].projection, plan.layers)),
            Some((Projection::Cascades(2), 2))
        );
        assert!(warnings.iter().any(|line| line.contains("sun is with fewer cascades")), "{warnings:?}");
        assert!(warnings.iter().any(|line| line.starts_with("each of the 3 lights bright, dim, tiny")), "{warnings:?}");
        let (plan, warnings) = tiles_of(lights, budget(1));
        assert!(plan.is_none() && warnings.len() == 1 && warnings[0].contains("no layer"), "{warnings:?}");
    }

    #[test]
    fn there_are_no_more_maps_than_the_shader_has_room_for() {
        let lights: Vec<Light> = (0..40).map(|i| lamp(DVec3::X * f64::from(i), None)).collect();
        let (plan, warnings) = tiles_of(lights, ShadowSettings { size: 32, ..ShadowSettings::default() });
        assert_eq!(plan.map(|plan| plan.lights.len()), Some(MAX_SHADOW_VIEWS / 6));
        assert!(warnings[0].contains("and 14 more is without") && warnings[0].contains("128 maps"), "{warnings:?}");
    }

    #[test]
    fn what_a_light_is_short_of_is_named() {
        let shadows = |budget| ShadowSettings { size: 32, budget, ..ShadowSettings::default() };
        let suns = |count| (0..count).map(|_| sun(DVec3::NEG_Y)).collect::<Vec<_>>();
        // Three cascades each, of which the last sun has fewer: there is budget for thousands.
        let count = MAX_SHADOW_VIEWS / 3 + 1;
        let (plan, warnings) = tiles_of(suns(count), shadows(256));
        let last = plan.and_then(|plan| plan.lights.last().map(|light| light.projection));
        assert_eq!(last, Some(Projection::Cascades((MAX_SHADOW_VIEWS % 3) as u32)));
        assert!(warnings.len() == 1 && warnings[0].contains("fewer cascades"), "{warnings:?}");
        assert!(warnings[0].contains("maps are the most") && !warnings[0].contains("budget"), "{warnings:?}");
        // The device's layers, of which there are fewer than the budget would pay.
        let scene = scene(&[(DVec3::ZERO, DVec3::ONE)], suns(2));
        let device = Capabilities { max_layers: 4, ..samples::device() };
        let (plan, warnings) = ShadowPlan::of(&scene, &settings(shadows(256)), &device);
        assert_eq!(plan.map(|plan| plan.layers), Some(4));
        assert!(
            warnings.len() == 1 && warnings[0].contains("device") && warnings[0].contains("4 layers"),
            "{warnings:?}"
        );
        assert!(!warnings[0].contains("budget"), "{warnings:?}");
    }

    #[test]
    fn what_stands_close_to_a_lamp_in_a_huge_scene_is_behind_its_near_plane() {
        for (radius, range) in [(1e5, None), (1e5, Some(5e4)), (1e-3, None)] {
            let boxes =
                [(DVec3::ZERO, DVec3::splat(radius)), (DVec3::splat(radius * 0.1), DVec3::splat(radius * 0.01))];
            for depth_clamp in [true, false] {
                let lights = vec![lamp(DVec3::ZERO, range), spot(DVec3::ZERO, DVec3::Y, 40.0)];
                let device = Capabilities { depth_clamp, ..samples::device() };
                let (world, plan) = planned(&scene(&boxes, lights), ShadowSettings::default(), &device);
                let views = Visible::of(&world, &Camera::default(), &plan).shadows;
                // Over each lamp, by a hundred-thousandth of the scene's extent and by a part that is larger.
                for above in [1e-5, 5e-6, 1e-6].map(|share| DVec3::Y * share * radius) {
                    let over = views.iter().flatten().filter(|view| map(view, above).1 > 0.99 * above.y);
                    assert_eq!(over.clone().count(), 2);
                    for view in over {
                        let depth = map(view, above).0.z;
                        assert!(depth > 0.0 && depth < 1.0, "{depth} {} m above the lamp", above.y);
                    }
                }
            }
        }
    }

    #[test]
    fn which_lights_have_maps_does_not_depend_on_where_a_frame_is_drawn_from() {
        let scene = scene(&[(DVec3::ZERO, DVec3::ONE)], samples::shadowed_lamps());
        let (world, plan) = planned(&scene, ShadowSettings::default(), &samples::device());
        let views = |x: f64| {
            let camera = Camera::looking_at(DVec3::new(x, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
            Visible::of(&world, &camera, &plan).shadows
        };
        // Of lamps not even their content changes.
        assert!(views(1.0)[3..].iter().zip(&views(-9.0)[3..]).all(|(a, b)| a == b && a.is_some()));
    }

    #[test]
    fn only_maps_in_which_something_moved_are_drawn_again() {
        let boxes = [(DVec3::ZERO, DVec3::ONE), (DVec3::X * 4.0, DVec3::ONE), (DVec3::X * -9.0, DVec3::ONE)];
        let lights = vec![sun(DVec3::NEG_Y), lamp(DVec3::X * 2.0, Some(3.0))];
        let scene = scene(&boxes, lights.clone());
        let (mut world, plan) = planned(&scene, ShadowSettings::default(), &samples::device());
        let camera = Camera::looking_at(DVec3::new(0.0, 8.0, 20.0), DVec3::ZERO, DVec3::Y);
        let mut cache = ShadowCache::default();
        let mut redrawn = |world: &mut World, camera: &Camera| {
            world.refresh(&plan);
            let views = Visible::of(world, camera, &plan).shadows;
            let stale = cache.stale(&views);
            cache.keep(&views, &stale);
            let cascades = stale.iter().filter(|&&map| map < 3).count();
            (cascades, stale.len() - cascades, views[..3].iter().flatten().count())
        };
        let (first, faces, seen) = redrawn(&mut world, &camera);
        assert_eq!((first, faces), (seen, 6), "at first there is nothing");
        assert_eq!(redrawn(&mut world, &camera), (0, 0, seen), "a still frame");
        // Out of the lamp's range.
        let moved = |index: usize, by: DVec3| DAffine3::from_translation(by) * scene.objects[index].transform;
        world.move_object(2, &moved(2, DVec3::X * 0.01)).expect("an object");
        let (cascades, faces, _) = redrawn(&mut world, &camera);
        assert!(cascades >= 1 && faces == 0, "{cascades} {faces}");
        // In the lamp's face towards -X, and beside that.
        world.move_object(0, &moved(0, DVec3::X * 0.01)).expect("an object");
        let (_, faces, _) = redrawn(&mut world, &camera);
        assert!((1..6).contains(&faces), "{faces}");
        // A light that moves takes all its faces along; one that only changes its strength none.
        world.set_light(1, &lamp(DVec3::X * 2.1, Some(3.0))).expect("a light");
        assert_eq!(redrawn(&mut world, &camera).1, 6);
        world.set_light(1, &Light { intensity: 5.0, ..lamp(DVec3::X * 2.1, Some(3.0)) }).expect("a light");
        assert_eq!(redrawn(&mut world, &camera), (0, 0, seen));
    }

    #[test]
    fn maps_in_which_nothing_moved_are_kept_and_the_others_are_as_if_all_were_made_anew() {
        let boxes: Vec<(DVec3, DVec3)> =
            (0..6).map(|i| (DVec3::new(f64::from(i) * 3.0 - 8.0, 0.0, 1.0), DVec3::ONE)).collect();
        let lights =
            vec![lamp(DVec3::X * -6.0, Some(3.0)), lamp(DVec3::X * 6.0, None), spot(DVec3::Y * 4.0, DVec3::X, 20.0)];
        let scene = scene(&boxes, lights);
        let (mut world, plan) = planned(&scene, ShadowSettings::default(), &samples::device());
        let shadow = plan.shadow.as_ref().expect("maps");
        let camera = Camera::default();
        let mut before = Visible::of(&world, &camera, &plan).shadows;
        let mut kept_by_moves = Vec::new();
        for (object, to) in [(0, DVec3::X * -9.0), (5, DVec3::Y * 5.0), (2, DVec3::Z * -2.0), (3, DVec3::splat(40.0))] {
            let transform = DAffine3::from_translation(to) * scene.objects[object].transform;
            world.move_object(object, &transform).expect("an object");
            world.refresh(&plan);
            let after = Visible::of(&world, &camera, &plan).shadows;
            assert_eq!(after, lamp_views(&world, shadow, &[], &Changes::default()));
            let kept = before.iter().zip(&after).filter(|pair| match pair {
                (Some(a), Some(b)) => Arc::ptr_eq(a, b),
                _ => false,
            });
            kept_by_moves.push(kept.count());
            before = after;
        }
        assert!(kept_by_moves.iter().all(|&kept| (3..13).contains(&kept)), "{kept_by_moves:?}");
        // A light that changes has its own made anew; that nothing is asked for keeps all.
        world.set_light(0, &lamp(DVec3::X * -5.0, Some(3.0))).expect("a light");
        world.refresh(&plan);
        let after = Visible::of(&world, &camera, &plan).shadows;
        assert_eq!(after, lamp_views(&world, shadow, &[], &Changes::default()));
        let anew = before.iter().zip(&after).filter(|(a, b)| !Arc::ptr_eq(a.as_ref().unwrap(), b.as_ref().unwrap()));
        assert_eq!(anew.count(), 6);
    }

    #[test]
    fn a_change_that_would_need_another_plan_is_refused() {
        let scene = scene(&[(DVec3::ZERO, DVec3::ONE)], vec![lamp(DVec3::X, None)]);
        let (mut world, _) = planned(&scene, ShadowSettings::default(), &samples::device());
        assert!(world.move_object(1, &DAffine3::IDENTITY).is_err());
        assert!(world.move_object(0, &DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))).is_err());
        for light in [
            lamp(DVec3::X, Some(1.0)),
            sun(DVec3::X),
            Light { casts_shadow: false, ..lamp(DVec3::X, None) },
            Light { intensity: 0.0, ..lamp(DVec3::X, None) },
        ] {
            assert!(world.set_light(0, &light).is_err(), "{light:?}");
        }
        assert!(world.set_light(1, &lamp(DVec3::X, None)).is_err());
        assert!(world.set_light(0, &lamp(DVec3::Y, None)).is_ok());
    }

    #[test]
    fn an_object_that_casts_none_is_in_no_map() {
        let mut scene = scene(&[(DVec3::ZERO, DVec3::ONE), (DVec3::Y, DVec3::ONE)], samples::shadowed_lamps());
        scene.objects[1].casts_shadow = CastsShadow::No;
        let (world, plan) = planned(&scene, ShadowSettings::default(), &samples::device());
        let camera = Camera::looking_at(DVec3::new(0.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y);
        let views = Visible::of(&world, &camera, &plan).shadows;
        let casters: Vec<usize> =
            views.iter().flatten().flat_map(|view| view.casters.iter().map(|caster| caster.draw.object)).collect();
        assert!(!casters.is_empty() && !casters.contains(&1), "{casters:?}");
    }
}
