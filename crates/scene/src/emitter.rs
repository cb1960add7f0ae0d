//! Emitters of particles. A particle has no state: its position, size and colour are a closed form of its number, its emitter's seed and the time, so
//! that a moment looks the same whichever moments were drawn before.

use glam::{DVec2, DVec3, Vec3};

use super::{Aabb, Scene};

/// The values that a quantity takes over a particle's life: equally far apart in time, and linear between them.
pub const MOST_KEYS: usize = 4;
/// Emitters of a scene: each particle looks for its own among them.
pub const MOST_EMITTERS: usize = 64;
/// Particles of a scene that are alive at once: 48 bytes each for their looks, and 8 for their order.
pub const MOST_PARTICLES: u64 = 1 << 21;
/// Different textures of a scene's emitters: particles of all of them are drawn at once.
pub const MOST_TEXTURES: usize = 4;
/// Cells of a texture along each edge: all of them are the layers of an image, of which every device has 256.
pub const MOST_FRAMES: u32 = 16;

/// A source of particles. Metres, seconds, nits.
#[derive(Debug, Clone, PartialEq)]
pub struct Emitter {
    /// The emitter's name, for messages.
    pub name: String,
    /// Middle of the box in which particles are born.
    pub position: DVec3,
    /// Half the edges of that box.
    pub extent: DVec3,
    /// Particles a second.
    pub rate: f64,
    /// Seconds that each lives.
    pub life: f64,
    /// The moment, in seconds, at which the first one is born; none where there have always been some.
    pub start: Option<f64>,
    /// The moment, in seconds, from which on no more are born.
    pub end: Option<f64>,
    /// The velocity of a new particle.
    pub velocity: DVec3,
    /// The most by which it differs along each axis.
    pub spread: DVec3,
    /// Acceleration of each particle.
    pub gravity: DVec3,
    /// The share of its velocity that air takes away a second.
    pub drag: f64,
    /// Edge of the square that it is drawn in, over its life.
    pub size: Vec<f32>,
    /// Linear RGB and alpha over its life.
    pub color: Vec<[f32; 4]>,
    /// Radiance that it sends out by itself, over its life.
    pub emission: Vec<Vec3>,
    /// True if it scatters the light that meets it.
    pub lit: bool,
    /// The most by which it is turned at first, either way.
    pub turn_degrees: f64,
    /// The most by which it turns in a second, either way.
    pub spin_degrees: f64,
    /// Distance in metres over which it fades before a surface, and behind the near plane.
    pub softness: f64,
    /// Index into [`Scene::textures`]; `None` draws a soft disc.
    pub texture: Option<usize>,
    /// Columns and rows of the texture's cells.
    pub frames: [u32; 2],
    /// True if each particle keeps one cell, and does not show one after the other.
    pub picks_frame: bool,
    /// Seed of all that is random.
    pub seed: u32,
}

impl Default for Emitter {
    fn default() -> Self {
        Self {
            name: String::new(),
            position: DVec3::ZERO,
            extent: DVec3::ZERO,
            rate: 100.0,
            life: 1.0,
            start: None,
            end: None,
            velocity: DVec3::Y,
            spread: DVec3::ZERO,
            gravity: DVec3::ZERO,
            drag: 0.0,
            size: vec![0.1],
            color: vec![[1.0; 4]],
            emission: Vec::new(),
            lit: true,
            turn_degrees: 0.0,
            spin_degrees: 0.0,
            softness: 0.1,
            texture: None,
            frames: [1, 1],
            picks_frame: false,
            seed: 0,
        }
    }
}

/// The particles of an emitter that are alive at a moment: their numbers follow each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AliveParticles {
    /// The number of the oldest: particle `n` is born `n / rate` seconds after the start.
    pub first: i64,
    /// Number of particles that are alive.
    pub count: u32,
    /// Age of the oldest, in seconds.
    pub age: f64,
}

/// A particle at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Particle {
    /// Position in the world.
    pub position: DVec3,
    /// Edge of its square in metres.
    pub size: f64,
    /// Linear RGB, not times alpha.
    pub color: DVec3,
    /// The most that it hides, in its middle.
    pub alpha: f64,
    /// Nits, not times alpha.
    pub emission: DVec3,
    /// Angle by which its square is turned, in radians.
    pub angle: f64,
    /// Index of its cell of the texture.
    pub frame: u32,
}

/// Random numbers of a particle, the same as `shaders/simulate.wgsl` has, to the last bit (M. O'Neill's PCG as a hash: M. Jarzynski and M. Olano, "Hash
/// Functions for GPU Rendering", 2020).
struct PcgRandom(u32);

fn pcg(input: u32) -> u32 {
    let state = input.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

impl PcgRandom {
    fn of(seed: u32, number: i64) -> Self {
        // Numbers are reduced to 32 bits: beyond, the same values come again.
        Self(pcg(pcg(seed) ^ number as u32))
    }

    /// Returns a number from 0 to below 1, of 24 bits, which a single float holds.
    fn share(&mut self) -> f64 {
        self.0 = pcg(self.0);
        f64::from(self.0 >> 8) / f64::from(1 << 24)
    }

    fn both_ways(&mut self) -> f64 {
        self.share() * 2.0 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.both_ways(), self.both_ways(), self.both_ways())
    }
}

/// Returns the factors by which an initial velocity and a steady acceleration give the distance travelled in a time, if the velocity falls by the
/// share `drag` a second. They are t and t^2 / 2 without drag.
pub fn travel(drag: f64, time: f64) -> (f64, f64) {
    let a = drag * time;
    if a < 0.01 {
        // (1 - e^-a) / a and (a - 1 + e^-a) / a^2, of which little would be left.
        let first = 1.0 - a / 2.0 + a * a / 6.0 - a.powi(3) / 24.0 + a.powi(4) / 120.0 - a.powi(5) / 720.0;
        let second = 0.5 - a / 6.0 + a * a / 24.0 - a.powi(3) / 120.0 + a.powi(4) / 720.0 - a.powi(5) / 5040.0;
        return (time * first, time * time * second);
    }
    let first = -(-a).exp_m1() / a;
    (time * first, time * time * (1.0 - first) / a)
}

/// The value at a share of a life.
pub fn over_life<T: Copy>(keys: &[T], share: f64, mix: impl Fn(T, T, f64) -> T) -> Option<T> {
    let at = share.clamp(0.0, 1.0) * (keys.len().max(1) - 1) as f64;
    let index = (at as usize).min(keys.len().saturating_sub(2));
    let (&first, next) = (keys.get(index)?, keys.get(index + 1));
    Some(next.map_or(first, |&next| mix(first, next, at - index as f64)))
}

impl Emitter {
    /// Returns the particles that are alive at a time: born by then, and not `life` seconds ago.
    pub fn alive(&self, time: f64) -> AliveParticles {
        let since = time - self.start.unwrap_or(0.0);
        let mut last = (since * self.rate).floor();
        if let Some(end) = self.end {
            // No particle is born at the end itself.
            last = last.min(((end - self.start.unwrap_or(0.0)) * self.rate).ceil() - 1.0);
        }
        let mut first = ((since - self.life) * self.rate).floor() + 1.0;
        if self.start.is_some() {
            first = first.max(0.0);
        }
        let count = (last - first + 1.0).clamp(0.0, self.most_alive() as f64);
        AliveParticles {
            first: first as i64,
            count: count as u32,
            age: (since - first / self.rate).clamp(0.0, self.life),
        }
    }

    /// The most that are ever alive at once.
    pub fn most_alive(&self) -> u64 {
        (self.rate * self.life).floor() as u64 + 1
    }

    /// The particle with a number, which must be alive at the time.
    pub fn particle(&self, number: i64, time: f64) -> Particle {
        let age = (time - self.start.unwrap_or(0.0) - number as f64 / self.rate).clamp(0.0, self.life);
        let share = age / self.life;
        let mut random = PcgRandom::of(self.seed, number);
        let born = self.position + self.extent * random.vector();
        let velocity = self.velocity + self.spread * random.vector();
        let (turn, spin, pick) = (random.both_ways(), random.both_ways(), random.share());
        let (of_velocity, of_gravity) = travel(self.drag, age);
        let blend = |a: [f32; 4], b: [f32; 4], share: f64| {
            std::array::from_fn(|channel| {
                (f64::from(a[channel]) * (1.0 - share) + f64::from(b[channel]) * share) as f32
            })
        };
        let mix = |a: DVec3, b: DVec3, share: f64| a * (1.0 - share) + b * share;
        let color = over_life(&self.color, share, blend).unwrap_or([1.0; 4]);
        let emission: Vec<DVec3> = self.emission.iter().map(|own| own.as_dvec3()).collect();
        let sizes: Vec<f64> = self.size.iter().map(|&own| f64::from(own)).collect();
        let frames = self.frames[0] * self.frames[1];
        let frame = if self.picks_frame { pick } else { share } * f64::from(frames);
        Particle {
            position: born + velocity * of_velocity + self.gravity * of_gravity,
            size: over_life(&sizes, share, |a, b, share| a * (1.0 - share) + b * share).unwrap_or(0.0),
            color: DVec3::new(f64::from(color[0]), f64::from(color[1]), f64::from(color[2])),
            alpha: f64::from(color[3]),
            emission: over_life(&emission, share, mix).unwrap_or(DVec3::ZERO),
            angle: (turn * self.turn_degrees + spin * self.spin_degrees * age).to_radians(),
            frame: (frame as u32).min(frames - 1),
        }
    }

    /// A box that no particle ever leaves.
    pub fn bounds(&self) -> Aabb {
        let (of_velocity, of_gravity) = travel(self.drag, self.life);
        let half = f64::from(self.size.iter().copied().fold(0.0, f32::max)) * std::f64::consts::FRAC_1_SQRT_2;
        let edge = self.extent.abs() + DVec3::splat(half);
        let corner = |velocity: DVec3, gravity: DVec3, least: fn(DVec3, DVec3) -> DVec3| {
            least(DVec3::ZERO, velocity * of_velocity) + least(DVec3::ZERO, gravity * of_gravity)
        };
        let spread = self.spread.abs();
        Aabb {
            min: self.position - edge + corner(self.velocity - spread, self.gravity, DVec3::min),
            max: self.position + edge + corner(self.velocity + spread, self.gravity, DVec3::max),
        }
    }

    /// Returns which of its numbers is out of its range, if one is.
    pub(super) fn fault(&self, scene: &Scene) -> Option<String> {
        let within = |value: f64, from: f64, to: f64| (from..=to).contains(&value);
        let vector = |value: DVec3, most: f64| value.to_array().iter().all(|own| own.abs() <= most);
        let numbers = [
            ("rate", self.rate, 1e-6, 1e9),
            ("life", self.life, 1e-6, 1e6),
            ("drag", self.drag, 0.0, 1e6),
            ("softness", self.softness, 0.0, 1e6),
            ("turn_degrees", self.turn_degrees, 0.0, 360.0),
            ("spin_degrees", self.spin_degrees, 0.0, 36_000.0),
            ("start", self.start.unwrap_or(0.0), -1e9, 1e9),
            ("end", self.end.unwrap_or(0.0), -1e9, 1e9),
        ];
        if let Some((name, value, from, to)) =
            numbers.into_iter().find(|&(_, value, from, to)| !within(value, from, to))
        {
            return Some(format!("its {name} is {value}, not from {from} to {to}"));
        }
        let vectors = [
            ("position", self.position, 1e15),
            ("extent", self.extent, 1e9),
            ("velocity", self.velocity, 1e6),
            ("spread", self.spread, 1e6),
            ("gravity", self.gravity, 1e6),
        ];
        if let Some((name, _, most)) = vectors.into_iter().find(|&(_, value, most)| !vector(value, most)) {
            return Some(format!("its {name} is not from -{most} to {most}"));
        }
        let lists =
            [("size", self.size.len(), 1), ("color", self.color.len(), 1), ("emission", self.emission.len(), 0)];
        if let Some((name, count, least)) =
            lists.into_iter().find(|&(_, count, least)| !(least..=MOST_KEYS).contains(&count))
        {
            return Some(format!("its {name} has {count} values over life, not {least} to {MOST_KEYS}"));
        }
        if let Some(size) = self.size.iter().find(|&&own| !within(f64::from(own), 0.0, 1e9)) {
            return Some(format!("its size is {size}, not from 0 to 1e9"));
        }
        if self.color.as_flattened().iter().any(|own| !(0.0..=1.0).contains(own)) {
            return Some("its color is not from 0 to 1".into());
        }
        if self.emission.iter().flat_map(|own| own.to_array()).any(|own| !(0.0..=1e18).contains(&own)) {
            return Some("its emission is not from 0 to 1e18".into());
        }
        if self.frames.iter().any(|own| !(1..=MOST_FRAMES).contains(own)) {
            return Some(format!("its frames are {:?}, not 1 to {MOST_FRAMES} columns and rows", self.frames));
        }
        let Some(index) = self.texture else {
            return (self.frames != [1, 1]).then(|| "it has frames, but no texture that has them".into());
        };
        let Some(texture) = scene.textures.get(index) else {
            return super::check::dangling("texture", index, scene.textures.len());
        };
        let divides = (0..2).all(|axis| texture.size[axis].is_multiple_of(self.frames[axis]));
        let ([width, height], [columns, rows]) = (texture.size, self.frames);
        (!divides).then(|| format!("its texture of {width}x{height} texels cannot be cut into {columns}x{rows} frames"))
    }
}

impl Scene {
    /// The most particles that are ever alive at once.
    pub fn most_particles(&self) -> u64 {
        self.emitters.iter().fold(0, |sum: u64, own| sum.saturating_add(own.most_alive()))
    }

    /// The textures of its emitters with their columns and rows, each once.
    pub fn particle_textures(&self) -> Vec<(usize, [u32; 2])> {
        let mut all: Vec<_> = self.emitters.iter().filter_map(|own| Some((own.texture?, own.frames))).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Returns why a format that has no particles cannot hold the scene; `None` if nothing emits some.
    pub fn emitters_refusal(&self) -> Option<&'static str> {
        let why = "particles cannot be expressed: leave the scene's [[emitters]] out";
        (!self.emitters.is_empty()).then_some(why)
    }

    /// A fault of all emitters together.
    pub(super) fn emitters_fault(&self) -> Option<String> {
        let (count, alive) = (self.emitters.len(), self.most_particles());
        if count > MOST_EMITTERS {
            return Some(format!("it has {count} emitters, but at most {MOST_EMITTERS} are drawn"));
        }
        if alive > MOST_PARTICLES {
            let name = self.emitters.iter().max_by_key(|own| own.most_alive()).map_or("", |own| &own.name);
            return Some(format!(
                "its emitters have {alive} particles alive at once (rate times life; most are of `{name}`), but at most {MOST_PARTICLES} are drawn"
            ));
        }
        let textures = self.particle_textures().len();
        (textures > MOST_TEXTURES)
            .then(|| format!("its emitters have {textures} different textures or frames, but at most {MOST_TEXTURES} are drawn at once"))
    }
}

/// A place of a particle's square, from its middle to its edges -1 to 1 to the right and up, by a place across the view in the same unit.
pub fn on_square(across: DVec2, angle: f64) -> DVec2 {
    let (sin, cos) = angle.sin_cos();
    DVec2::new(across.x * cos + across.y * sin, across.y * cos - across.x * sin)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Velocity and place of `travel` against many small steps of the equation of motion.
        #[test]
        fn particles_travel_as_many_small_steps_do(drag in 0.0..5.0f64, time in 0.01..3.0f64, velocity in -5.0..5.0f64, gravity in -10.0..10.0f64) {
            let steps = 20_000;
            let step = time / f64::from(steps);
            let (mut place, mut speed) = (0.0, velocity);
            for _ in 0..steps {
                let middle = speed + (gravity - drag * speed) * step / 2.0;
                place += middle * step;
                speed += (gravity - drag * middle) * step;
            }
            let (of_velocity, of_gravity) = travel(drag, time);
            let found = velocity * of_velocity + gravity * of_gravity;
            prop_assert!((found - place).abs() < 1e-6, "{found} {place}");
        }

        #[test]
        fn travel_is_smooth_and_finite_for_any_drag(log in -12.0..12.0f64, time in 1e-6..1e6f64) {
            let drag = 10f64.powf(log);
            let (first, second) = travel(drag, time);
            prop_assert!(first > 0.0 && first <= time && second > 0.0 && second <= time * time / 2.0 * 1.000_001, "{first} {second}");
            let (near, _) = travel(drag * (1.0 + 1e-9), time);
            prop_assert!((near / first - 1.0).abs() < 1e-7);
        }

        /// Each particle that is alive is born by then and not dead, and so is no other.
        #[test]
        fn those_alive_are_all_that_are_born_and_not_dead(
            rate in 0.1..1000.0f64, life in 0.001..5.0f64, time in -1e5..1e5f64, start in proptest::option::of(-10.0..10.0f64),
        ) {
            let emitter = Emitter { rate, life, start, ..Emitter::default() };
            let alive = emitter.alive(time);
            let age = |number: i64| time - start.unwrap_or(0.0) - number as f64 / rate;
            let last = alive.first + i64::from(alive.count) - 1;
            let slack = 1e-9 * time.abs().max(1.0);
            if alive.count > 0 {
                prop_assert!(age(last) >= -slack && age(alive.first) < life + slack);
                prop_assert!((alive.age - age(alive.first)).abs() < slack.max(1e-9));
                prop_assert!(age(last + 1) < slack);
                prop_assert!(start.is_some() && alive.first == 0 || age(alive.first - 1) >= life - slack);
            } else {
                prop_assert!(start.is_some_and(|start| time < start) || rate * life < 1.0 + 1e-6 || start.is_some());
            }
            prop_assert!(u64::from(alive.count) <= emitter.most_alive());
        }

        #[test]
        fn no_particle_leaves_its_emitters_bounds(
            velocity in -5.0..5.0f64, spread in 0.0..3.0f64, gravity in -10.0..10.0f64, drag in 0.0..10.0f64, time in 0.0..100.0f64, seed in 0..100u32,
        ) {
            let emitter = Emitter {
                velocity: DVec3::new(velocity, -velocity, 1.0), spread: DVec3::splat(spread), gravity: DVec3::Y * gravity, drag, seed,
                extent: DVec3::new(1.0, 0.5, 0.0), rate: 20.0, life: 2.0, ..Emitter::default()
            };
            let (alive, bounds) = (emitter.alive(time), emitter.bounds());
            for number in alive.first..alive.first + i64::from(alive.count) {
                let own = emitter.particle(number, time);
                prop_assert!(own.position.cmpge(bounds.min).all() && own.position.cmple(bounds.max).all(), "{own:?} {bounds:?}");
            }
        }
    }

    #[test]
    fn values_over_life_are_linear_between_their_keys() {
        let mix = |a: f64, b: f64, share: f64| a * (1.0 - share) + b * share;
        let at = |share| over_life(&[1.0, 3.0, 0.0], share, mix);
        assert_eq!(
            [at(0.0), at(0.25), at(0.5), at(1.0), at(2.0)],
            [Some(1.0), Some(2.0), Some(3.0), Some(0.0), Some(0.0)]
        );
        assert_eq!((over_life(&[5.0], 0.7, mix), over_life(&[], 0.7, mix)), (Some(5.0), None));
    }

    #[test]
    fn too_many_particles_are_refused_by_name() {
        let wild = Emitter { name: "wild".into(), rate: 1e9, ..Emitter::default() };
        let scene = Scene { emitters: vec![Emitter::default(), wild], ..Scene::default() };
        let told = scene.check().expect_err("too many").to_string();
        assert!(told.contains("1000000102") && told.contains("`wild`") && told.contains("2097152"), "{told}");
        let dead = Scene { emitters: vec![Emitter { life: 0.0, ..Emitter::default() }], ..Scene::default() };
        let told = dead.check().expect_err("no life").to_string();
        assert!(told.contains("its life is 0, not from 0.000001 to 1000000"), "{told}");
    }
}
