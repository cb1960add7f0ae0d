//! The level of detail of an object: the one of fewest triangles whose error in pixels the settings allow.
//!
//! A level's error counts as if it lay at the point of the object's box that is nearest to the camera, across the view, in the middle of the
//! picture. So the choice does not depend on how the camera is turned: in a corner of the picture an angle takes more pixels than in the middle,
//! with 60 degrees from top to bottom up to 2.4 times as many. Casters have the level that the camera chooses, in whichever map: a surface that
//! differs from its caster lies in its own shadow, which made 4.3 times as much of it with levels of half a pixel under whole casters. A map is
//! drawn again when one of its casters changes its level.

use std::borrow::Cow;

use glam::{DAffine3, DVec3, Vec3};

use super::{Caster, Draw, Visible, World, WorldObject};
use crate::plan::{FramePlan, PlannedLevel};
use crate::scene::Camera;

/// The parameters of a frame's choice. In f32, as `shaders/cull.wgsl` has it, to the bit: CPU and device choose the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelChoice {
    /// Relative to the origin of [`super::InstanceTransform`]s.
    camera: Vec3,
    /// Metres by which f32 may misplace a box.
    slack: f32,
    /// The square of the allowed error in metres, at a distance of one metre or, with an orthographic camera, at any distance.
    pub allowed: f32,
    pub is_orthographic: bool,
}

impl LevelChoice {
    /// Returns `None` if the plan has no levels of detail.
    pub(super) fn of(world: &World, camera: &Camera, plan: &FramePlan) -> Option<Self> {
        if plan.lod <= 0.0 {
            return None;
        }
        let (place, slack) = world.instances.place_of(camera, world);
        let pixel = 2.0 * camera.half_height() / f64::from(plan.size[1]);
        let allowed = (f64::from(plan.lod) * pixel).powi(2) as f32;
        Some(Self { camera: place.large, slack, allowed, is_orthographic: camera.is_orthographic() })
    }

    /// The level of an object: 0 is its mesh.
    pub fn level(&self, world: &World, object: &WorldObject) -> u8 {
        let levels = world.levels_of(object);
        if levels.is_empty() {
            return 0;
        }
        let (center, half) = world.instances.box_of(&object.bounds);
        // The vector from the camera to the nearest point of the box.
        let beside = ((center - self.camera).abs() - half - self.slack).max(Vec3::ZERO);
        let squared = beside.x * beside.x + beside.y * beside.y + beside.z * beside.z;
        let allowed = self.allowed * if self.is_orthographic { 1.0 } else { squared };
        let scale = squared_scale(&object.transform);
        levels.partition_point(|level| squared_error(level) * scale <= allowed) as u8
    }
}

/// The square of [`PlannedLevel::error`].
pub fn squared_error(level: &PlannedLevel) -> f32 {
    (level.error * level.error) as f32
}

/// The square of the largest factor by which a length grows.
pub(super) fn squared_scale(transform: &DAffine3) -> f32 {
    largest_scale(transform).powi(2) as f32
}

/// No length grows by more: exact for maps without shear, an upper bound for others (Gershgorin's circles around the squares of the columns).
fn largest_scale(transform: &DAffine3) -> f64 {
    let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
    let [xy, xz, yz] = [x.dot(y), x.dot(z), y.dot(z)].map(f64::abs);
    let squares = DVec3::new(x.length_squared() + xy + xz, y.length_squared() + xy + yz, z.length_squared() + xz + yz);
    squares.max_element().sqrt()
}

impl World {
    /// The levels of detail of an object, the finest first; none of one that is always drawn whole.
    pub fn levels_of(&self, object: &WorldObject) -> &[PlannedLevel] {
        match object.transparent || object.deform.is_some() {
            true => &[],
            false => self.levels.get(object.mesh).map_or(&[], Vec::as_slice),
        }
    }

    /// Triangles of a command's instances.
    pub fn triangles_of(&self, draw: &Draw) -> usize {
        let object = &self.objects[draw.object];
        let level = usize::from(draw.level).checked_sub(1).and_then(|level| self.levels_of(object).get(level));
        draw.count as usize * level.map_or(object.triangles, |level| level.index_count as usize / 3)
    }
}

impl Visible {
    /// Casters of a map with the levels that the camera chooses. Within a group that one command can draw, casters are sorted by level.
    pub fn leveled<'a>(&self, world: &World, casters: &'a [Caster]) -> Cow<'a, [Caster]> {
        let Some(levels) = &self.levels else { return casters.into() };
        let object = |caster: &Caster| &world.objects[caster.object];
        let mut own: Vec<Caster> =
            casters.iter().map(|caster| Caster { level: levels.level(world, object(caster)), ..*caster }).collect();
        own.chunk_by_mut(|a, b| object(a).caster_group() == object(b).caster_group())
            .for_each(|group| group.sort_by_key(|caster| caster.level));
        own.into()
    }

    /// Returns true if casters have the levels that the camera chooses.
    pub fn has_levels_of(&self, world: &World, casters: &[Caster]) -> bool {
        let is_chosen =
            |levels: &LevelChoice, caster: &Caster| levels.level(world, &world.objects[caster.object]) == caster.level;
        self.levels.as_ref().is_none_or(|levels| casters.iter().all(|caster| is_chosen(levels, caster)))
    }
}

/// Commands for one level each. Instances of a command are put in the order of their levels.
pub(super) fn split(levels: &LevelChoice, world: &World, instances: &mut [u32], draws: &[Draw]) -> Vec<Draw> {
    let mut split = Vec::with_capacity(draws.len());
    let mut own = Vec::new();
    for draw in draws {
        if world.levels_of(&world.objects[draw.object]).is_empty() {
            split.push(*draw);
            continue;
        }
        let places = &mut instances[draw.first as usize..][..draw.count as usize];
        own.clear();
        own.extend(places.iter().map(|&index| (levels.level(world, &world.objects[index as usize]), index)));
        own.sort_by_key(|&(level, _)| level);
        let mut first = draw.first;
        for group in own.chunk_by(|a, b| a.0 == b.0) {
            split.push(Draw { object: group[0].1 as usize, level: group[0].0, first, count: group.len() as u32 });
            first += group.len() as u32;
        }
        places.iter_mut().zip(&own).for_each(|(place, &(_, index))| *place = index);
    }
    split
}

#[cfg(test)]
mod tests;
