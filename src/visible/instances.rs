//! Objects of one mesh and material are drawn by one command. Those of a frame stand in one list, near ones first, and each command takes a part
//! of it.

use std::ops::Range;

use glam::{DAffine3, DVec3, Vec4};

use super::{MapDraw, Visible, World, WorldObject};
use crate::plan::GeometryKey;
use crate::scene::{Aabb, Camera};

/// Steps of depth by which what is seen is sorted: near ones first, so that early depth tests save the most, and yet in few commands.
const STEPS: usize = 32;

/// A command: instances of one mesh with one material.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Draw {
    /// Index into [`World::objects`] of the first of them, and of any as far as the mesh and the material go.
    pub object: usize,
    /// Where they begin in [`Visible::instances`].
    pub first: u32,
    pub count: u32,
}

impl Draw {
    /// The place of its instances in [`Visible::instances`].
    pub fn instances(&self) -> Range<u32> {
        self.first..self.first + self.count
    }
}

impl WorldObject {
    /// What objects have in common that one command draws.
    fn batch(&self) -> (bool, GeometryKey, (usize, u32), usize, Option<usize>) {
        (self.transparent, self.key, (self.material, self.look.sheet), self.mesh, self.deform)
    }
}

/// All objects, by their indices: what is opaque before what is not, those that one command draws after each other.
pub(super) fn by_batch(objects: &[WorldObject]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..objects.len() as u32).collect();
    order.sort_by_key(|&index| (objects[index as usize].batch(), index));
    order
}

/// Sorts objects, which are in the order of [`by_batch`], by steps of their depth. Within a step they stay as they are.
pub(super) fn near_to_far(world: &World, camera: &Camera, seen: &[u32]) -> Vec<u32> {
    let steps = DepthSteps::of(&world.bounds, camera);
    let step: Vec<u8> =
        seen.iter().map(|&index| steps.of_place(world.objects[index as usize].bounds.center())).collect();
    let mut ends = [0; STEPS + 1];
    step.iter().for_each(|&step| ends[usize::from(step) + 1] += 1);
    for step in 0..STEPS {
        ends[step + 1] += ends[step];
    }
    let mut sorted = vec![0; seen.len()];
    for (&index, &step) in seen.iter().zip(&step) {
        let place = &mut ends[usize::from(step)];
        sorted[*place] = index;
        *place += 1;
    }
    sorted
}

/// The commands for instances that follow each other so.
pub(super) fn commands(world: &World, instances: &[u32]) -> Vec<Draw> {
    let mut draws: Vec<Draw> = Vec::new();
    for (place, &index) in (0..).zip(instances) {
        let object = index as usize;
        match draws.last_mut() {
            Some(last) if world.objects[last.object].batch() == world.objects[object].batch() => last.count += 1,
            _ => draws.push(Draw { object, first: place, count: 1 }),
        }
    }
    draws
}

/// Equal parts of the depth of the world before the camera.
struct DepthSteps {
    camera: DVec3,
    forward: DVec3,
    begin: f64,
    scale: f64,
}

impl DepthSteps {
    fn of(world: &Aabb, camera: &Camera) -> Self {
        let forward = camera.forward();
        let (at, half) = ((world.center() - camera.position).dot(forward), forward.abs().dot(world.size() * 0.5));
        let begin = (at - half).max(0.0);
        let depth = at + half - begin;
        let scale = if depth > 0.0 && depth.is_finite() { STEPS as f64 / depth } else { 0.0 };
        Self { camera: camera.position, forward, begin, scale }
    }

    fn of_place(&self, place: DVec3) -> u8 {
        // A cast takes what is below the first step for the first.
        (((place - self.camera).dot(self.forward) - self.begin) * self.scale).min((STEPS - 1) as f64) as u8
    }
}

impl Visible {
    /// Rows of the maps from meshes to the world around the camera, of each instance.
    pub fn rows(&self, world: &World, camera: &Camera) -> Vec<[Vec4; 3]> {
        let rows = |&index: &u32| camera_relative(&world.objects[index as usize].transform, camera.position);
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

/// Rows of a map from a mesh to the world around the camera. The difference of two large places is taken in f64.
fn camera_relative(transform: &DAffine3, camera: DVec3) -> [Vec4; 3] {
    let rows = transform.matrix3.transpose();
    let offset = transform.translation - camera;
    [
        rows.x_axis.extend(offset.x).as_vec4(),
        rows.y_axis.extend(offset.y).as_vec4(),
        rows.z_axis.extend(offset.z).as_vec4(),
    ]
}
