//! The instanced drawing of objects that share a mesh and a material by one command. All objects are in a list in which the objects of one command
//! are contiguous. Each frame takes the visible objects from it, near ones first, and each command draws a part of them. A frame does not touch
//! objects that have not moved: the list keeps their places, and a tree of boxes finds the objects in view.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3, Vec4};

use super::frustum::Frustum;
use super::levels::squared_scale;
use super::{MapDraw, Visible, World, WorldObject};
use crate::plan::box_tree::BoxTree;
use crate::plan::{GeometryKey, Reach};
use crate::scene::{Aabb, Camera};
use crate::shaders::shared::culling;

/// Depth steps by which visible objects are sorted, by the far ends of their boxes. Near objects come first, so that early depth tests save the most;
/// few steps keep the number of commands low.
pub const STEPS: usize = culling::STEPS as usize;

/// A command: instances of one level of a mesh with one material.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Draw {
    /// Index into [`World::objects`] of the first instance; all instances share its mesh and material.
    pub object: usize,
    /// The level of detail of the mesh; 0 is the mesh itself.
    pub level: u8,
    /// The place of the first instance in [`Visible::instances`].
    pub first: u32,
    pub count: u32,
}

impl Draw {
    /// The place of its instances in [`Visible::instances`].
    pub fn instances(&self) -> Range<u32> {
        self.first..self.first + self.count
    }
}

/// The transform of an instance, in f32 but exact anywhere in the world: relative to an anchor, with the offset in two parts.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct InstanceTransform {
    /// Rows of the map from the mesh, with the larger part of the offset.
    rows: [Vec4; 3],
    /// The smaller part of the offset: the rounding error of the larger one.
    rest: Vec3,
    /// The square of the largest factor by which a length grows.
    scale: f32,
}

/// A position relative to the world's anchor, in two parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplitPosition {
    pub large: Vec3,
    pub rest: Vec3,
}

impl SplitPosition {
    fn of(place: DVec3) -> Self {
        let large = place.as_vec3();
        Self { large, rest: (place - large.as_dvec3()).as_vec3() }
    }
}

impl InstanceTransform {
    fn of(object: &WorldObject, anchor: DVec3) -> Self {
        let rows = object.transform.matrix3.transpose();
        let at = SplitPosition::of(object.transform.translation - anchor);
        let row = |axis: DVec3, offset: f32| axis.as_vec3().extend(offset);
        let rows = [row(rows.x_axis, at.large.x), row(rows.y_axis, at.large.y), row(rows.z_axis, at.large.z)];
        Self { rows, rest: at.rest, scale: squared_scale(&object.transform) }
    }

    /// Rows of the map from the mesh to the world around a place. The rounding error of the larger parts' difference is added again (Knuth's
    /// TwoSum; The Art of Computer Programming 2, 4.2.2): the offset is as good as one that is rounded once.
    fn around(&self, place: &SplitPosition) -> [Vec4; 3] {
        let [x, y, z] = self.rows;
        let large = Vec3::new(x.w, y.w, z.w);
        let difference = large - place.large;
        let back = difference - large;
        let lost = (large - (difference - back)) - (place.large + back);
        let offset = difference + (lost + (self.rest - place.rest));
        [x.truncate().extend(offset.x), y.truncate().extend(offset.y), z.truncate().extend(offset.z)]
    }
}

/// The objects of a world as instances.
#[derive(Debug, Clone, Default)]
pub struct InstanceList {
    /// Indices into [`World::objects`], by place. Opaque objects come first.
    objects: Vec<u32>,
    /// The place of each object.
    places: Vec<u32>,
    /// The transforms of the objects, by place.
    transforms: Vec<InstanceTransform>,
    /// The number of the command that can draw an object, by place.
    batches: Vec<u32>,
    /// The places of each opaque command's objects.
    opaque_batches: Vec<Range<usize>>,
    /// The number of opaque objects.
    opaque: usize,
    /// The tree of the objects' boxes, by place.
    tree: BoxTree,
    /// The origin of [`InstanceTransform`]s.
    anchor: DVec3,
    /// Counts the changes of objects' places in the list.
    arranged: u64,
    /// The places of objects that have moved since `arranged` last changed, in the order of moves.
    moves: Vec<u32>,
}

/// Returns the state shared by objects that one command draws.
fn batch(object: &WorldObject) -> (bool, GeometryKey, (usize, u32), usize, Option<usize>) {
    (object.transparent, object.key, object.material_set(), object.mesh, object.deform)
}

impl InstanceList {
    /// `arranged` must differ from the previous list's number.
    pub(super) fn of(objects: &[WorldObject], arranged: u64) -> Self {
        let mut order: Vec<u32> = (0..objects.len() as u32).collect();
        let object_at = |index: u32| &objects[index as usize];
        order.sort_by_cached_key(|&index| (batch(object_at(index)), index));
        let mut places = vec![0; objects.len()];
        (0..).zip(&order).for_each(|(place, &index)| places[index as usize] = place);
        let mut batches: Vec<u32> = Vec::with_capacity(order.len());
        let opaque = order.partition_point(|&index| !object_at(index).transparent);
        let mut opaque_batches = Vec::new();
        for pair in order.chunk_by(|&a, &b| batch(object_at(a)) == batch(object_at(b))) {
            let next = batches.last().map_or(0, |last| last + 1);
            if batches.len() < opaque {
                opaque_batches.push(batches.len()..batches.len() + pair.len());
            }
            batches.extend(std::iter::repeat_n(next, pair.len()));
        }
        let tree = BoxTree::of(order.iter().map(|&index| object_at(index).bounds));
        let anchor = tree.bounds().center();
        Self {
            places,
            transforms: order.iter().map(|&index| InstanceTransform::of(object_at(index), anchor)).collect(),
            batches,
            opaque_batches,
            opaque,
            tree,
            objects: order,
            anchor,
            arranged,
            moves: Vec::new(),
        }
    }

    /// Updates the transforms of moved objects, by their indices.
    pub(super) fn refresh(&mut self, objects: &[WorldObject], moved: &[u32]) {
        for &index in moved {
            let place = self.places[index as usize];
            self.transforms[place as usize] = InstanceTransform::of(&objects[index as usize], self.anchor);
            self.moves.push(place);
        }
        // The new number makes a reader that has not kept up copy the whole list, so the moves need not be kept.
        if self.moves.len() > 4 * self.objects.len() {
            (self.arranged, self.moves) = (self.arranged + 1, Vec::new());
        }
        let bounds = |place: usize| objects[self.objects[place] as usize].bounds;
        self.tree.refit(moved.iter().map(|&index| self.places[index as usize] as usize), bounds);
    }

    /// The box around all objects.
    pub(super) fn bounds(&self) -> Aabb {
        self.tree.bounds()
    }

    /// Returns the places that are in view.
    pub(super) fn in_view(&self, frustum: &Frustum) -> Vec<bool> {
        let mut seen = vec![false; self.objects.len()];
        self.tree.sort_out(|bounds| frustum.side(bounds), |place| seen[place] = true);
        seen
    }

    /// Returns true if the box of any `seen` instance meets a sphere.
    pub(super) fn touches(&self, seen: impl Fn(usize) -> bool, sphere: &Reach) -> bool {
        self.tree.each(|bounds| sphere.touches(bounds)).any(seen)
    }

    /// As [`BoxTree::largest_first`], by place.
    pub(super) fn largest_first(&self, size: impl Fn(&Aabb, f64) -> Option<f64>) -> impl Iterator<Item = usize> {
        self.tree.largest_first(size)
    }

    /// A number that changes when objects come to other places of the list, or too many have moved for [`Self::moves()`] to list.
    pub fn arranged(&self) -> u64 {
        self.arranged
    }

    /// The places of objects that have moved since [`Self::arranged()`] last changed, in the order of moves.
    pub fn moves(&self) -> &[u32] {
        &self.moves
    }

    /// The transforms of the objects, by place.
    pub fn transforms(&self) -> &[InstanceTransform] {
        &self.transforms
    }

    /// The number of opaque objects; they have the first places.
    pub fn opaque_count(&self) -> usize {
        self.opaque
    }

    /// The places of each opaque command's objects.
    pub fn opaque_batches(&self) -> &[Range<usize>] {
        &self.opaque_batches
    }

    /// Middle and half the size of an object's box, relative to the origin of [`InstanceTransform`]s: widened by the rounding to f32, so that it is never too
    /// small.
    pub fn box_of(&self, bounds: &Aabb) -> (Vec3, Vec3) {
        let (center, half) = (bounds.center() - self.anchor, bounds.size() * 0.5);
        (center.as_vec3(), (half + F32_SLACK * (center.abs() + half)).as_vec3())
    }

    /// Returns a camera's view in CULL's form.
    pub(super) fn cull_view(&self, frustum: &Frustum, camera: &Camera, world: &World) -> CullView {
        let steps = DepthSteps::of(self.anchor, &world.bounds, camera);
        let (place, slack) = self.place_of(camera, world);
        CullView {
            planes: frustum.planes_around(camera.position),
            camera: place,
            slack,
            forward: steps.forward,
            begin: steps.begin,
            scale: steps.scale,
        }
    }

    /// A camera's position relative to the origin of [`InstanceTransform`]s, and the metres by which f32 may misplace a box.
    pub(super) fn place_of(&self, camera: &Camera, world: &World) -> (SplitPosition, f32) {
        let offset = camera.position - self.anchor;
        (SplitPosition::of(offset), (4.0 * F32_SLACK * (offset.length() + world.bounds.radius())) as f32)
    }

    /// The index into [`World::objects`] of the object at a place.
    pub fn object(&self, place: usize) -> usize {
        self.objects[place] as usize
    }

    /// Appends the opaque objects at some places of the list, in its order, and returns the commands for them.
    pub(super) fn draws_at(&self, places: &[usize], instances: &mut Vec<u32>) -> Vec<Draw> {
        let runs = places.chunk_by(|&a, &b| self.batches[a] == self.batches[b]);
        let draws = runs.map(|run| {
            let (object, first) = (self.object(run[0]), instances.len() as u32);
            let draw = Draw { object, level: 0, first, count: run.len() as u32 };
            instances.extend(run.iter().map(|&place| self.objects[place]));
            draw
        });
        draws.collect()
    }

    /// The opaque ones of the `seen`, near ones first, and the commands for them.
    pub(super) fn near_to_far(&self, world: &World, camera: &Camera, seen: &[bool]) -> (Vec<u32>, Vec<Draw>) {
        let steps = DepthSteps::of(self.anchor, &world.bounds, camera);
        let mut ends = [0; STEPS + 1];
        let mut stepped = Vec::with_capacity(self.opaque);
        for place in (0..self.opaque).filter(|&place| seen[place]) {
            let step = steps.of_box(self.box_of(&world.objects[self.object(place)].bounds));
            ends[step + 1] += 1;
            stepped.push((place as u32, step as u32));
        }
        for step in 0..STEPS {
            ends[step + 1] += ends[step];
        }
        let mut sorted = vec![0; stepped.len()];
        for (place, step) in stepped {
            let end = &mut ends[step as usize];
            sorted[*end] = place;
            *end += 1;
        }
        let mut draws: Vec<Draw> = Vec::new();
        let mut last = None;
        for (first, place) in (0..).zip(&mut sorted) {
            let (batch, object) = (self.batches[*place as usize], self.objects[*place as usize]);
            match draws.last_mut() {
                Some(draw) if last == Some(batch) => draw.count += 1,
                _ => draws.push(Draw { object: object as usize, level: 0, first, count: 1 }),
            }
            last = Some(batch);
            *place = object;
        }
        (sorted, draws)
    }

    /// Returns the places of transparent ones that are in view.
    pub(super) fn transparent_in_view(&self, world: &World, frustum: &Frustum) -> Vec<bool> {
        let is_in_view = |place| place >= self.opaque && frustum.may_see(&world.objects[self.object(place)].bounds);
        (0..self.objects.len()).map(is_in_view).collect()
    }

    /// The transparent ones of the `seen`, by their indices.
    pub(super) fn transparent(&self, seen: &[bool]) -> Vec<u32> {
        (self.opaque..self.objects.len()).filter(|&place| seen[place]).map(|place| self.objects[place]).collect()
    }
}

/// Appends instances of which there are no others yet, and the commands for them, from the last to the first.
pub(super) fn reversed(instances: &mut Vec<u32>, draws: &[Draw]) -> Vec<Draw> {
    let count = instances.len() as u32;
    instances.extend_from_within(..);
    instances[count as usize..].reverse();
    draws.iter().rev().map(|draw| Draw { first: 2 * count - draw.first - draw.count, ..*draw }).collect()
}

/// The largest error of a length in f32, relative to the lengths that it is computed from.
const F32_SLACK: f64 = 1e-6;

/// A camera's view in CULL's form; its place is relative to the origin of [`InstanceTransform`]s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CullView {
    /// View planes relative to the camera; normals point inside.
    pub planes: [Vec4; 5],
    pub camera: SplitPosition,
    /// Metres by which f32 may misplace a box.
    pub slack: f32,
    pub forward: Vec3,
    /// The begin of the first depth step, and steps a metre.
    pub begin: f32,
    pub scale: f32,
}

/// Equal parts of the world's depth in front of the camera.
struct DepthSteps {
    camera: Vec3,
    forward: Vec3,
    begin: f32,
    scale: f32,
}

impl DepthSteps {
    fn of(anchor: DVec3, world: &Aabb, camera: &Camera) -> Self {
        let forward = camera.forward();
        let (at, half) = ((world.center() - camera.position).dot(forward), forward.abs().dot(world.size() * 0.5));
        let begin = (at - half).max(0.0);
        let depth = at + half - begin;
        let scale = if depth > 0.0 && depth.is_finite() { STEPS as f64 / depth } else { 0.0 };
        Self {
            camera: (camera.position - anchor).as_vec3(),
            forward: forward.as_vec3(),
            begin: begin as f32,
            scale: scale as f32,
        }
    }

    /// Returns the step of a box's far end. The walls of a hall are mostly behind the objects in it: their far ends are farther, though their middles
    /// are nearer.
    fn of_box(&self, (center, half): (Vec3, Vec3)) -> usize {
        let (offset, along) = (center - self.camera, self.forward.abs());
        let middle = offset.x * self.forward.x + offset.y * self.forward.y + offset.z * self.forward.z;
        let depth = middle + (half.x * along.x + half.y * along.y + half.z * along.z);
        // The cast clamps depths below the first step to it.
        ((depth - self.begin) * self.scale).min((STEPS - 1) as f32) as usize
    }
}

impl Visible {
    /// Rows of the maps from meshes to the world around the camera, of each instance.
    pub fn rows(&self, world: &World, camera: &Camera) -> Vec<[Vec4; 3]> {
        let list = &world.instances;
        let camera = SplitPosition::of(camera.position - list.anchor);
        let rows = |&index: &u32| list.transforms[list.places[index as usize] as usize].around(&camera);
        self.instances.iter().map(rows).collect()
    }

    /// Rows of the maps from meshes to a shadow map's clip space, of each of its casters.
    pub fn caster_rows(&self, world: &World, map: &MapDraw) -> impl Iterator<Item = [Vec4; 4]> {
        let view = self.shadows[map.map].as_ref();
        let casters =
            view.map(|view| map.casters.iter().map(|own| view.clip_rows(&world.objects[own.object].transform)));
        casters.into_iter().flatten()
    }
}
