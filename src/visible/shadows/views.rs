//! The view of each shadow map in a frame: cascades fitted to the camera's view, and the maps of lamps, kept while nothing in them changes.

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3, DVec4, Vec4};

use crate::plan::{MapProjection, ShadowPlan, Tile};
use crate::scene::{Aabb, Camera, CastsShadow, Projection, ShadowProjection};
use crate::visible::{World, WorldObject};

/// The part of a cascade's range over which the next one takes over.
const BLEND: f64 = 0.1;

/// Splits begin at this share of the farthest distance, however near the near plane is.
const NEAREST_SPLIT: f64 = 1e-3;

/// The share for purely logarithmic splits, with which four cascades reach over five decades. In a mixture with even splits it would only take texels
/// from the first cascade's far end, which the even part sets.
const NEAREST_LOGARITHMIC_SPLIT: f64 = 1e-5;

/// Near plane of perspective maps over the light's range or the scene's radius: depth is 1 there, and falls as 1 / distance. In f32 this depth is
/// precise for any near plane, so the plane is nearer than anything that could stand between it and the lamp.
const NEAR: f64 = 1e-7;

/// The share by which a beam's map extends beyond the scene's end, so that surfaces there are still inside the map.
const BEHIND: f64 = 1e-3;

/// Directions of the six maps of a point light, in the order of `shaders/shared/shadows.wgsl`.
pub(super) const FACES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

/// Returns false only if the box is wholly behind the plane. The slack keeps rounding from culling boxes that touch it.
fn is_before(plane: DVec4, bounds: &Aabb) -> bool {
    let (normal, offset) = (plane.truncate(), plane.w);
    let (at, reach) = (normal.dot(bounds.center()), normal.abs().dot(bounds.size() * 0.5));
    at + offset + reach >= -1e-9 * (at.abs() + offset.abs() + reach)
}

/// An object in a map, as it was when it was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Caster {
    /// Index into [`World::objects`].
    pub object: usize,
    /// Counts how often it has moved.
    pub revision: u32,
    /// The level of detail that it casts with: 0 is its mesh.
    pub level: u8,
}

/// How far from the light the middle and the far end of a box lie: metres along the view of a map with perspective, parts of the depth of another's.
#[derive(Debug, Clone, Copy)]
struct BoxDepths {
    middle: f64,
    end: f64,
}

/// Steps of depth by which casters are sorted, from the light to the middle of the farthest caster; casters that end beyond it have as many more. Finer steps make
/// more commands, and save less than 3% (docs/FIGURES.md).
const CASTER_STEPS: u32 = 16;

impl WorldObject {
    /// Returns the key by which pipelines of casters differ.
    fn caster_pipeline(&self) -> (bool, bool, CastsShadow, bool) {
        // Transparent casters come last: TINT draws them.
        (self.transparent, self.key.masked, self.casts, self.key.mirrored)
    }

    /// Returns the state shared by casters that follow each other in a map.
    pub(in crate::visible) fn caster_group(&self) -> (bool, CastsShadow, bool, Option<usize>, usize) {
        let material = self.cuts.any().then_some(self.material);
        (self.key.masked, self.casts, self.key.mirrored, material, self.mesh)
    }
}

/// One depth map: the view of a light. The depth is reversed, 1 near the light.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowView {
    /// Rows from world space to u and v in texels of the layer, depth, and w; the first three are to be divided by the last.
    pub(super) rows: [DVec4; 4],
    pub tile: Tile,
    /// Edge of a texel in metres, where w is 1.
    pub texel: f64,
    /// The tangent of half the angle under which a directional light is seen, or the radius of another one in metres.
    pub light_size: f64,
    /// Metres along the camera's view at which the cascade ends, and at which the next one begins to take over.
    pub end: f64,
    pub blend: f64,
    /// Metres along the camera's view from which on it is looked up.
    pub(super) begin: f64,
    /// Nothing farther from this place is lit at all.
    pub(super) reach: Option<(DVec3, f64)>,
    /// Casters before its near plane are pressed onto it, where the device can; not behind the disc of a beam, which stops nothing there.
    pub clamps: bool,
    pub casters: Vec<Caster>,
}

impl ShadowView {
    fn of(rows: [DVec4; 4], tile: Tile, texel: f64) -> Self {
        let ([end, blend], begin) = ([f64::MAX; 2], f64::MIN);
        let (light_size, reach, clamps, casters) = (0.0, None, true, Vec::new());
        Self { rows, tile, texel, light_size, end, blend, begin, reach, clamps, casters }
    }

    fn orthographic(axes: &DMat3, tile: Tile, corner: DVec3, texel: f64, depth: f64) -> Self {
        let axes = axes.transpose();
        let row = |axis: DVec3, corner: f64, unit: f64| (axis / unit).extend(-corner / unit);
        let rows = [
            row(axes.x_axis, corner.x, texel) + DVec4::W * f64::from(tile.x),
            row(axes.y_axis, corner.y, texel) + DVec4::W * f64::from(tile.y),
            DVec4::W - row(axes.z_axis, corner.z, depth),
            DVec4::W,
        ];
        Self::of(rows, tile, texel)
    }

    /// The cylinder of a beam: to its range, or to the end of the scene.
    fn beam(
        world: &World,
        (place, direction, radius): (DVec3, DVec3, f64),
        range: Option<f64>,
        tile: Tile,
        margin: f64,
    ) -> Self {
        let axes = light_axes(direction);
        let at = axes * place;
        let end = world.extent.transformed(&DAffine3::from_mat3(axes)).max.z - at.z;
        let depth = range.unwrap_or(f64::INFINITY).min(end * (1.0 + BEHIND)).max(1e-6 * radius);
        let edge = f64::from(tile.edge);
        let texel = 2.0 * radius / (edge - 2.0 * margin).max(0.25 * edge);
        let corner = (at.truncate() - 0.5 * edge * texel).extend(at.z);
        Self { clamps: false, ..Self::orthographic(&axes, tile, corner, texel, depth) }
    }

    /// `tangent` belongs to half the angle of the map without its margin.
    fn perspective(place: DVec3, direction: DVec3, tangent: f64, near: f64, tile: Tile, margin: f64) -> Self {
        let axes = light_axes(direction).transpose();
        let edge = f64::from(tile.edge);
        let texel = 2.0 * tangent / (edge - 2.0 * margin).max(0.25 * edge);
        let row = |axis: DVec3| axis.extend(-axis.dot(place));
        let w = row(axes.z_axis);
        let centre = |corner: u32| w * (f64::from(corner) + 0.5 * edge);
        let rows =
            [row(axes.x_axis) / texel + centre(tile.x), row(axes.y_axis) / texel + centre(tile.y), DVec4::W * near, w];
        Self::of(rows, tile, texel)
    }

    /// Returns true if the box can stand between the light and anything in the map.
    fn may_shadow(&self, bounds: &Aabb) -> bool {
        // Nothing behind the map's end.
        self.may_hold(bounds, 0.0) && is_before(self.rows[2], bounds)
    }

    /// Returns true if any point of the box is within the light's reach and in the map, with `around` texels around it.
    pub(super) fn may_hold(&self, bounds: &Aabb, around: f64) -> bool {
        if let Some((place, range)) = self.reach
            && place.distance(place.clamp(bounds.min, bounds.max)) > range
        {
            return false;
        }
        let [u, v, _, w] = self.rows;
        let (x, y) = (f64::from(self.tile.x) - around, f64::from(self.tile.y) - around);
        let edge = f64::from(self.tile.edge) + 2.0 * around;
        let planes = [u - w * x, w * (x + edge) - u, v - w * y, w * (y + edge) - v, w];
        planes.into_iter().all(|plane| is_before(plane, bounds))
    }

    fn with_casters(mut self, world: &World) -> Arc<Self> {
        let casts = |index: &usize| {
            let object = &world.objects[*index];
            object.casts != CastsShadow::No && self.may_shadow(&object.bounds)
        };
        let casters = (0..world.objects.len()).filter(casts);
        let mut casters: Vec<(usize, BoxDepths)> =
            casters.map(|index| (index, self.reach_of(&world.objects[index].bounds))).collect();
        // The farthest end would not do: a wide ground reaches far beyond the objects on it, which would then all share a step.
        let farthest = casters.iter().fold(0.0, |far: f64, (_, reach)| far.max(reach.middle));
        // Twice the middle clamps boxes around the light alone: one that is all on one side of it ends nearer than that.
        let step = |reach: BoxDepths| ((reach.end / farthest).min(2.0) * f64::from(CASTER_STEPS - 1)).round() as u32;
        // Casters are sorted by pipeline, then from near to far, so that early depth tests save the most: the time of a map goes into written texels.
        // Within a depth step, casters that share a material and a mesh are contiguous.
        casters.sort_by_cached_key(|&(index, reach)| {
            let object = &world.objects[index];
            (object.caster_pipeline(), step(reach), object.caster_group(), index)
        });
        let caster = |(object, _)| Caster { object, revision: world.objects[object].revision, level: 0 };
        self.casters = casters.into_iter().map(caster).collect();
        Arc::new(self)
    }

    fn reach_of(&self, bounds: &Aabb) -> BoxDepths {
        let [.., depth, w] = self.rows;
        // Depth falls away from the light.
        let along = if self.is_perspective() { w } else { (DVec4::W * w.w - depth) / w.w };
        let middle = along.truncate().dot(bounds.center()) + along.w;
        BoxDepths { middle, end: middle + along.truncate().abs().dot(bounds.size() * 0.5) }
    }

    /// Metres from the middle of the map to its edge, of a perspective map at a distance of 1 metre; and metres from its near to its far end, 0 of a perspective one.
    pub fn metres(&self) -> [f64; 2] {
        let depth = self.rows[2].truncate().length();
        let along = if self.is_perspective() || depth == 0.0 { 0.0 } else { 1.0 / depth };
        [0.5 * self.texel * f64::from(self.tile.edge), along]
    }

    /// Returns true if it sees the same part of the world in the same texels.
    pub(super) fn lies_as(&self, other: &Self) -> bool {
        (self.rows, self.tile) == (other.rows, other.tile)
    }

    pub(super) fn is_perspective(&self) -> bool {
        self.rows[3].truncate() != DVec3::ZERO
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

/// Rows: a map's u and v axis and the direction of its light, in world space. Right-handed with v downwards, as Vulkan's clip space,
/// and fixed in the world, so that edges of shadows do not turn with the camera.
pub(super) fn light_axes(direction: DVec3) -> DMat3 {
    let up = if direction.y.abs() < 0.99 { DVec3::Y } else { DVec3::Z };
    let right = direction.cross(up).normalize_or(DVec3::X);
    DMat3::from_cols(right, direction.cross(right), direction).transpose()
}

/// The changes since the maps of lamps were computed.
#[derive(Debug, Clone, Default)]
pub(in crate::visible) struct Changes {
    /// Indices into [`World::lights`].
    pub lights: BTreeSet<usize>,
    /// The old and the new boxes of moved casters.
    pub boxes: Vec<Aabb>,
    /// Indices into [`World::objects`] of objects that have moved or changed their looks.
    pub moved: Vec<u32>,
    /// Some objects are drawn by other commands than before: they are new, have been mirrored, or show a cell of another sheet.
    pub rearranged: bool,
}

/// Maps of the point and spot lights, which do not depend on a camera; other maps are `None`. Maps of `before` are kept if their light is unchanged
/// and nothing has moved in their volume.
pub(in crate::visible) fn lamp_views(
    world: &World,
    plan: &ShadowPlan,
    before: &[Option<Arc<ShadowView>>],
    changes: &Changes,
) -> Vec<Option<Arc<ShadowView>>> {
    let mut views = vec![None; plan.tiles.len()];
    for own in &plan.lights {
        let light = &world.lights[own.light];
        let form = light.kind.form();
        let (Some(place), range) = (form.place, form.range) else { continue };
        let near = NEAR * range.unwrap_or(f64::INFINITY).min(world.radius).max(f64::MIN_POSITIVE);
        for index in own.first_view..own.first_view + own.projection.views() {
            if let Some(Some(before)) = before.get(index)
                && !changes.lights.contains(&own.light)
                && !changes.boxes.iter().any(|bounds| before.may_shadow(bounds))
                && (range.is_some() || !form.is_parallel())
            {
                views[index] = Some(before.clone());
                continue;
            }
            let (direction, half_width) = match (form.shadow_projection(), form.direction) {
                (ShadowProjection::Ahead(half_width), Some(direction)) => (direction, half_width),
                _ => (FACES[index - own.first_view], 1.0),
            };
            let tile = plan.tiles[index];
            let margin = plan.margin(tile.edge, &world.shadows);
            let view = match form.is_parallel() {
                true => ShadowView::beam(world, (place, direction, half_width), range, tile, margin),
                // A cone of no angle still has a map.
                false => ShadowView::perspective(place, direction, half_width.max(1e-3), near, tile, margin),
            };
            let view = ShadowView {
                light_size: light.half_size(),
                reach: range.map(|range| (place, form.extent(range))),
                ..view
            };
            views[index] = Some(view.with_casters(world));
        }
    }
    views
}

/// Adds the cascades of the directional lights, each around its slice of the camera's view, and the maps of sky directions, which have one cascade
/// each. A slice without any `seen` box gets no cascade. A cascade that holds the whole scene is the last, as later ones would be the same.
pub(in crate::visible) fn add_cascades(
    views: &mut [Option<Arc<ShadowView>>],
    world: &World,
    plan: &ShadowPlan,
    camera: &Camera,
    aspect: f64,
    seen: &[Aabb],
) {
    let far = farthest(&world.extent, camera);
    let receivers = CascadeReceivers { camera, aspect, far, seen };
    for own in &plan.lights {
        let light = &world.lights[own.light];
        if let (MapProjection::Cascades(count), Some(direction)) = (own.projection, light.kind.form().direction) {
            let maps = own.first_view..own.first_view + count as usize;
            receivers.add(views, (world, plan), maps, (direction, light.half_size()));
        }
    }
    for (own, map) in world.sky_directions.iter().zip(plan.sky_views()) {
        receivers.add(views, (world, plan), map..map + 1, (-own.to_light, 0.0));
    }
}

/// The surfaces on which a camera sees shadows of directional lights.
struct CascadeReceivers<'a> {
    camera: &'a Camera,
    aspect: f64,
    /// The distance along the view at which cascades end.
    far: f64,
    seen: &'a [Aabb],
}

impl CascadeReceivers<'_> {
    /// Adds the cascades of a light, by its direction and half its size as [`ShadowView::light_size`].
    fn add(
        &self,
        views: &mut [Option<Arc<ShadowView>>],
        (world, plan): (&World, &ShadowPlan),
        maps: Range<usize>,
        (direction, light_size): (DVec3, f64),
    ) {
        let &Self { camera, aspect, far, seen } = self;
        let forward = camera.forward();
        let along = |bounds: &Aabb| {
            let (center, half) =
                ((bounds.center() - camera.position).dot(forward), forward.abs().dot(bounds.size() * 0.5));
            (center - half, center + half)
        };
        // An orthographic view shows everything at one scale, and so needs equally large texels everywhere.
        let lambda = if camera.is_orthographic() { 0.0 } else { world.shadows.lambda };
        let axes = light_axes(direction);
        let mut begin = camera.near;
        let count = maps.len() as u32;
        for (map, cascade) in maps.zip(1..) {
            let end = split(camera.near, far, lambda, cascade, count);
            let slice = Sphere::around(camera, aspect, begin, end);
            let fit = CascadeFit::of(world, plan, &axes, &slice);
            let is_last = cascade == count || fit.is_whole;
            // This cascade is also sampled in the last part of the previous one.
            let blend = if is_last { f64::MAX } else { end - BLEND * (end - begin) };
            let last_seen = if is_last { f64::MAX } else { end };
            let volume = view_corners(camera, aspect, begin, last_seen.min(far));
            let in_slice = seen.iter().filter(|bounds| along(bounds).0 <= last_seen && along(bounds).1 >= begin);
            if is_seen(&axes, &volume, in_slice) {
                let view = fit.view(world, plan, plan.tiles[map], &axes);
                let view = ShadowView { light_size, end: last_seen, blend, begin, ..view };
                views[map] = Some(view.with_casters(world));
            }
            if is_last {
                break;
            }
            begin = blend;
        }
    }
}

/// The distance along the view at which cascades end, in metres. Inside the sphere around the scene it is always the sphere's diameter. Outside it
/// follows the camera in steps of a quarter of a power of two. The camera's rotation never matters.
pub(super) fn farthest(extent: &Aabb, camera: &Camera) -> f64 {
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

/// The box of a scene whose objects have moved: the box `at_first`, widened on all sides until it holds `bounds`, in steps of a quarter of a power of
/// two of its radius. So maps of the whole scene stay valid while objects move within it.
pub(in crate::visible) fn widened(at_first: &Aabb, bounds: &Aabb) -> Aabb {
    if at_first.is_empty() || bounds.is_empty() {
        return *bounds;
    }
    let beyond = (at_first.min - bounds.min).max(bounds.max - at_first.max).max_element();
    if beyond <= 0.0 {
        return *at_first;
    }
    let radius = at_first.radius().max(f64::MIN_POSITIVE);
    // Never less than the part beyond, however the product rounds.
    let by = (quantized(1.0 + beyond / radius) * radius - radius).max(beyond);
    Aabb { min: at_first.min - by, max: at_first.max + by }
}

/// Returns the end of the cascade, in metres along the view: the practical split scheme (Zhang et al. 2006, "Parallel-Split Shadow Maps for
/// Large-scale Virtual Environments"), a mixture of logarithmic and even splits.
// ANCHOR: split
pub(super) fn split(near: f64, far: f64, lambda: f32, index: u32, count: u32) -> f64 {
    let nearest = if lambda < 1.0 { NEAREST_SPLIT } else { NEAREST_LOGARITHMIC_SPLIT };
    let near = near.max(nearest * far);
    let (share, lambda) = (f64::from(index) / f64::from(count), f64::from(lambda));
    lambda * near * (far / near).powf(share) + (1.0 - lambda) * (near + (far - near) * share)
}
// ANCHOR_END: split

pub(super) struct Sphere {
    pub(super) center: DVec3,
    pub(super) radius: f64,
}

impl Sphere {
    /// The smallest sphere around the part of the camera's view between two distances along it. Its size does not depend on the camera's position and
    /// rotation.
    pub(super) fn around(camera: &Camera, aspect: f64, begin: f64, end: f64) -> Self {
        // The distance of a corner from the axis, over w.
        let diagonal = camera.half_height() * aspect.hypot(1.0);
        // The centre is as far from the near corners as from the far ones, but not behind these.
        let along = match camera.projection {
            Projection::Perspective { .. } => (0.5 * (begin + end) * (1.0 + diagonal * diagonal)).min(end),
            Projection::Orthographic { .. } => 0.5 * (begin + end),
        };
        let center = camera.position + camera.forward() * along;
        if camera.shift != DVec2::ZERO {
            let center = center + camera.aside() * along;
            let corners = view_corners(camera, aspect, begin, end);
            return Self { center, radius: corners.iter().map(|corner| corner.distance(center)).fold(0.0, f64::max) };
        }
        let radius = (end - along).hypot(camera.w(end) * diagonal);
        Self { center, radius }
    }
}

/// The extent of a cascade, in the axes of its light.
struct CascadeFit {
    /// It holds the whole scene, for any camera.
    is_whole: bool,
    /// Edge of the sampled square in metres, and its lowest corner before it is snapped.
    edge: f64,
    low: DVec3,
    /// The far end along the light.
    high: f64,
}

impl CascadeFit {
    /// Fits a cascade around a sphere, but never larger than a square that holds the scene. All sizes depend only on the sphere's size and the
    /// scene's.
    fn of(world: &World, plan: &ShadowPlan, axes: &DMat3, slice: &Sphere) -> Self {
        let scene = world.extent.transformed(&DAffine3::from_mat3(*axes));
        let whole = scene.size().truncate().max_element();
        let least = (1e-6 * world.radius).max(1e-30);
        if 2.0 * slice.radius >= whole {
            return Self { is_whole: true, edge: whole.max(least), low: scene.min, high: scene.max.z };
        }
        let edge = (2.0 * slice.radius).max(least);
        let low = *axes * slice.center - 0.5 * edge;
        // A slice needs no depth before or behind the scene.
        let first = if plan.reaches_back() { scene.min.z } else { low.z.max(scene.min.z) };
        let high = (low.z + edge).min(scene.max.z).max(first);
        Self { is_whole: false, edge, low: low.truncate().extend(first), high }
    }

    fn view(&self, world: &World, plan: &ShadowPlan, tile: Tile, axes: &DMat3) -> ShadowView {
        let margin = plan.margin(tile.edge, &world.shadows);
        let texels = f64::from(tile.edge);
        let texel = self.edge / (texels - 2.0 * margin - 1.0).max(0.25 * texels);
        let snap = |low: f64| (low / texel).floor() * texel - margin * texel;
        // Depth is snapped to steps as well, so that a small movement of the camera keeps the map. Room before and behind keeps objects that touch a
        // plane inside.
        let step = self.edge / 16.0;
        let near = ((self.low.z / step).floor() - 1.0) * step;
        let depth = ((self.high / step).ceil() + 1.0) * step - near;
        let corner = DVec3::new(snap(self.low.x), snap(self.low.y), near);
        ShadowView::orthographic(axes, tile, corner, texel, depth)
    }
}

/// Returns true if boxes around the `seen` boxes and around a part of the camera's view, in the light's axes, intersect.
fn is_seen<'a>(axes: &DMat3, volume: &[DVec3], seen: impl Iterator<Item = &'a Aabb>) -> bool {
    let to_light = DAffine3::from_mat3(*axes);
    let receivers = seen.fold(Aabb::EMPTY, |all, bounds| all.union(&bounds.transformed(&to_light)));
    !receivers.intersection(&Aabb::of_points(volume.iter().map(|&corner| *axes * corner))).is_empty()
}

/// Corners of the view volume between two distances along the view.
pub(super) fn view_corners(camera: &Camera, aspect: f64, begin: f64, end: f64) -> [DVec3; 8] {
    let half = camera.half_height();
    let (right, up) = (camera.right() * half * aspect, camera.up() * half);
    std::array::from_fn(|i| {
        let distance = if i & 1 == 0 { begin } else { end };
        let x = if i & 2 == 0 { -1.0 } else { 1.0 };
        let y = if i & 4 == 0 { -1.0 } else { 1.0 };
        camera.position + camera.forward() * distance + (right * x + up * y + camera.aside()) * camera.w(distance)
    })
}
