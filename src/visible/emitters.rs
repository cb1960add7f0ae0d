//! The particles of a frame: which are alive, as SIMULATE is told. All that depends on how late it is, is worked out here in f64, so that hours
//! cost no digits.

use bytemuck::{Pod, Zeroable};
use glam::{UVec4, Vec3, Vec4};

use super::{Visible, World};
use crate::plan::FramePlan;
use crate::scene::emitter::MOST_KEYS;
use crate::scene::{Aabb, Camera, Emitter};

/// `Emitter` of `shaders/simulate.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct EmitterRecord {
    /// Relative to the camera.
    pub position: Vec3,
    pub life: f32,
    pub velocity: Vec3,
    pub drag: f32,
    pub spread: Vec3,
    /// Seconds from one birth to the next.
    pub step: f32,
    pub extent: Vec3,
    /// Age of the oldest particle, in seconds.
    pub age: f32,
    pub gravity: Vec3,
    pub softness: f32,
    /// Ambient radiance that it scatters, in nits.
    pub ambient: Vec3,
    /// 1 if it scatters light, else 0.
    pub lit: f32,
    pub sizes: Vec4,
    pub colors: [Vec4; MOST_KEYS],
    pub emissions: [Vec4; MOST_KEYS],
    /// The numbers of sizes, colours and emissions, and the seed.
    pub keys: UVec4,
    /// The first of its particles in the list, their count, the number of the oldest, and the frames of its texture.
    pub place: UVec4,
    /// The most that it is turned at first and in a second, in radians; 1 where each particle picks a frame; the texture, from 1, or 0.
    pub turns: Vec4,
}

/// The emitters of a frame, as SIMULATE is told.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Emitters {
    pub records: Vec<EmitterRecord>,
    /// Number of particles of all emitters together.
    pub count: u32,
}

impl Emitters {
    /// With the particles that are alive at the world's moment; none where the frame is halted before anything transparent.
    pub(super) fn of(world: &World, camera: &Camera, plan: &FramePlan) -> Self {
        let mut emitters = Self::default();
        let Some(planned) = plan.effects.particles.as_ref().filter(|_| !world.is_halted()) else { return emitters };
        for (emitter, texture) in world.emitters.iter().zip(&planned.texture_of) {
            let record = record(emitter, world, camera, (emitters.count, planned.capacity, *texture));
            emitters.count += record.place.y;
            emitters.records.push(record);
        }
        emitters
    }
}

/// `capacity`: of all emitters together. `texture`: its place in the plan.
fn record(
    own: &Emitter,
    world: &World,
    camera: &Camera,
    (first, capacity, texture): (u32, u32, Option<u32>),
) -> EmitterRecord {
    let alive = own.alive(world.moment);
    let fill = |keys: Vec<Vec4>| -> [Vec4; MOST_KEYS] {
        std::array::from_fn(|key| keys.get(key).copied().unwrap_or(Vec4::ZERO))
    };
    let sizes: [f32; MOST_KEYS] = std::array::from_fn(|key| own.size.get(key).copied().unwrap_or(0.0));
    let (even, _) = world.environment.hemispheres();
    let picks = if own.picks_frame { 1.0 } else { 0.0 };
    let angles = [own.turn_degrees, own.spin_degrees].map(|degrees| degrees.to_radians() as f32);
    EmitterRecord {
        position: (own.position - camera.position).as_vec3(),
        life: own.life as f32,
        velocity: own.velocity.as_vec3(),
        drag: own.drag as f32,
        spread: own.spread.as_vec3(),
        step: (1.0 / own.rate) as f32,
        extent: own.extent.as_vec3(),
        age: alive.age as f32,
        gravity: own.gravity.as_vec3(),
        softness: own.softness as f32,
        ambient: even + world.sky_mean,
        lit: if own.lit { 1.0 } else { 0.0 },
        sizes: sizes.into(),
        colors: fill(own.color.iter().map(|&color| color.into()).collect()),
        emissions: fill(own.emission.iter().map(|color| color.extend(0.0)).collect()),
        keys: UVec4::new(own.size.len() as u32, own.color.len() as u32, own.emission.len() as u32, own.seed),
        // The lower 32 bits of a particle's number seed its random values.
        place: UVec4::new(first, alive.count.min(capacity - first), alive.first as u32, own.frames[0] * own.frames[1]),
        turns: Vec4::new(angles[0], angles[1], picks, texture.map_or(0.0, |place| place as f32 + 1.0)),
    }
}

impl Visible {
    /// The state of everything that changes by itself over time, to be compared with another frame's.
    pub fn changing(&self) -> Vec<u8> {
        bytemuck::cast_slice(&self.emitters.records).to_vec()
    }
}

impl World {
    /// Boxes that the particles of a plan never leave.
    pub(super) fn emitter_boxes(&self, plan: &FramePlan) -> Vec<Aabb> {
        match plan.effects.particles {
            Some(_) => self.emitters.iter().map(Emitter::bounds).collect(),
            None => Vec::new(),
        }
    }

    /// The box around all that is drawn: objects and particles.
    pub fn drawn_bounds(&self, plan: &FramePlan) -> Aabb {
        self.emitter_boxes(plan).iter().fold(self.bounds, |all, own| all.union(own))
    }
}
