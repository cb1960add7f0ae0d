//! The effect of fog on the light of a ray, in f64: in fog of the kind `height` by closed forms, and in fog with lamps and shadows in it by a march with rays to
//! each light.
//!
//! The march handles one light at a time. Probes along the ray find the intervals in which the light is visible, and bisection finds their ends to a
//! millionth of the step. Within an interval a directional light has a closed form. A lamp is integrated by five-point Gauss-Legendre quadrature on
//! panels of equal angle as seen from the lamp, split where the optical depth doubles: neither a lamp beside the ray nor dense fog takes more panels.
//! An interval shorter than a step may be missed: [`Reference::with_air_steps`] sets the number of steps, and
//! `fog_with_lamps_is_known_to_a_ten_thousandth` bounds the change that twice as many make.

use glam::{DVec2, DVec3};

use super::fog::{Medium, Passage};
use super::intersect::Ray;
use super::light;
use super::render::{Points, Reference};
use super::sampling;
use super::shadow::Receiver;
use afterlight_scene::{Fog, Light};

/// Probes along a ray that is a pixel's only one.
pub(super) const STEPS: u32 = 64;
/// Probes along each ray of a pixel that has many samples.
const STEPS_OF_A_SAMPLE: u32 = 4;
/// A deeper optical depth lets through less than 2e-22, which nobody sees.
const DEEPEST: f64 = 50.0;
/// Panels of a lamp's half-circle of directions.
const PANELS: u32 = 16;
/// Radii of the scene from its middle, beyond which a ray meets no shadow.
const BEYOND: f64 = 8.0;
/// The five points of Gauss and Legendre, and their weights.
const POINTS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// A part of a ray through fog.
struct RaySegment<'a> {
    fog: &'a Medium,
    origin: DVec3,
    /// Unit vector.
    direction: DVec3,
    /// May be infinite.
    metres: f64,
}

impl RaySegment<'_> {
    fn at(&self, metres: f64) -> DVec3 {
        self.origin + self.direction * metres
    }

    /// Returns the optical depth between two distances.
    fn depth(&self, from: f64, to: f64) -> f64 {
        let height = self.origin.y + self.direction.y * from;
        self.fog.optical_depth(height, self.direction.y, to - from)
    }

    /// The share of light that is lost between two distances and would have arrived.
    fn lost(&self, from: f64, to: f64) -> f64 {
        (-self.depth(0.0, from)).exp() * -(-self.depth(from, to)).exp_m1()
    }

    /// Returns the metres after which the optical depth from its beginning is `depth`; `limit` where it stays less.
    fn where_depth_is(&self, depth: f64, limit: f64) -> f64 {
        if self.depth(0.0, limit) <= depth {
            return limit;
        }
        // Until the lower bound is above 0, the upper one shrinks by factors of 1000: fog may reach this depth in less than the size of an atom.
        let (mut low, mut high) = (0.0, limit);
        for _ in 0..150 {
            let middle = if low == 0.0 { high * 1e-3 } else { 0.5 * (low + high) };
            if self.depth(0.0, middle) <= depth {
                low = middle
            } else {
                high = middle
            }
            if high - low <= 1e-12 * high {
                break;
            }
        }
        high
    }

    /// The light that a lamp scatters to the eye between two distances, as a share of its intensity for each unit of albedo.
    fn of_lamp(&self, lamp: &Light, place: DVec3, (from, to): (f64, f64), depths: &[f64]) -> f64 {
        let along = (place - self.origin).dot(self.direction);
        let beside = (self.origin + self.direction * along).distance(place).max(light::MIN_DISTANCE);
        let [first, last] = [from, to].map(|metres| ((metres - along) / beside).atan());
        let count = (f64::from(PANELS) * (last - first) / std::f64::consts::PI).ceil().max(1.0);
        let inner =
            (1..count as u32).map(|panel| along + beside * (first + (last - first) * f64::from(panel) / count).tan());
        let mut ends: Vec<f64> = inner.chain(depths.iter().copied()).filter(|own| (from..to).contains(own)).collect();
        ends.extend([from, to]);
        ends.sort_by(f64::total_cmp);
        let panel = |pair: &[f64]| {
            let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
            let at = |&(place, weight): &(f64, f64)| {
                let metres = middle + place * half;
                let point = self.at(metres);
                let (direction, strength) = light::arriving(lamp, point);
                let each_metre = self.fog.extinction(point.y) * (-self.depth(0.0, metres)).exp();
                weight * half * each_metre * strength * self.fog.phase(self.direction.dot(direction))
            };
            POINTS.iter().map(at).sum::<f64>()
        };
        ends.windows(2).map(panel).sum()
    }
}

impl Reference<'_> {
    /// Sets the number of probes along a ray that find where lights are visible in fog, 1 or more.
    pub fn with_air_steps(self, air_steps: u32) -> Self {
        Self { air_steps: air_steps.max(1), ..self }
    }

    /// The effect of the air between two distances along a ray on light that comes to the eye.
    pub(super) fn passage(&self, ray: &Ray, [near, far]: [f64; 2], points: Points) -> Passage {
        let Some(fog) = &self.effects.fog else { return Passage::CLEAR };
        // Distances are along the view.
        let stretch = ray.direction.length();
        let direction = ray.direction / stretch;
        let sky = self.scene.sky.as_ref().filter(|_| self.sky_light && self.sky.is_some());
        let part = RaySegment { fog, origin: ray.at(near), direction, metres: (far - near) * stretch };
        let depth = part.depth(0.0, part.metres);
        if fog.kind != Fog::Froxels {
            return Medium::passage(depth, fog.light(direction, &self.scene.environment, sky, &self.lights));
        }
        let everywhere = Medium::passage(depth, fog.from_everywhere(&self.scene.environment, sky));
        Passage { gained: everywhere.gained + self.lights_in_air(&part, points) * fog.albedo, ..everywhere }
    }

    /// The light that all lights scatter to the eye along a part of a ray, for each unit of albedo.
    fn lights_in_air(&self, part: &RaySegment, points: Points) -> DVec3 {
        let (bounds, origin) = (self.scene.bounds(), part.origin);
        let far = origin.distance(bounds.center()) + BEYOND * bounds.radius().max(1.0);
        let limit = part.where_depth_is(DEEPEST, part.metres.min(far));
        let depths: Vec<f64> = match part.depth(0.0, limit) {
            whole if whole < 0.25 => Vec::new(),
            whole => {
                let doubled = (-2..6).map(|power| f64::from(power).exp2()).take_while(|&depth| depth < whole);
                doubled.map(|depth| part.where_depth_is(depth, limit)).collect()
            }
        };
        let each = |(index, own): (usize, &Light)| {
            let color = own.color.as_dvec3() * f64::from(own.intensity);
            if color == DVec3::ZERO {
                return DVec3::ZERO;
            }
            let (place, mut sum) = (own.kind.form().place, 0.0);
            let (towards, strength) = light::arriving(own, origin);
            let phase = part.fog.phase(part.direction.dot(towards));
            if part.fog.extinction(origin.y).is_infinite() {
                // All is lost, and scattered, where the ray begins.
                let casts = self.shadows && own.casts_shadow;
                let seen = !casts || Receiver::floating(origin).sees(&self.geometry, own, DVec2::ZERO);
                return if seen { color * (phase * strength) } else { DVec3::ZERO };
            }
            for interval in self.lit(part, limit, (index, own), points) {
                sum += match place {
                    None => part.lost(interval.0, interval.1) * phase,
                    Some(place) => part.of_lamp(own, place, interval, &depths),
                };
            }
            if place.is_none() && limit < part.metres {
                sum += part.lost(limit, part.metres) * phase;
            }
            color * sum
        };
        self.lights.iter().enumerate().map(each).sum()
    }

    /// Returns the intervals of a part of a ray in which a light arrives, in metres.
    fn lit(&self, part: &RaySegment, limit: f64, (index, own): (usize, &Light), points: Points) -> Vec<(f64, f64)> {
        let (on_disc, steps, jitter) = match points {
            Points::All => (DVec2::ZERO, self.air_steps, 0.5),
            Points::One { sample, pixel } => {
                let hashed = sampling::hash(sampling::hash(pixel ^ 0xa1e) ^ (u64::from(sample) << 32) ^ index as u64);
                let steps = (self.air_steps / STEPS_OF_A_SAMPLE).max(1);
                (sampling::on_disc(sample, pixel, index), steps, (hashed >> 11) as f64 / (1u64 << 53) as f64)
            }
        };
        let casts = self.shadows && own.casts_shadow;
        let arrives = |metres: f64| {
            let point = part.at(metres);
            light::arriving(own, point).1 > 0.0
                && (!casts || Receiver::floating(point).sees(&self.geometry, own, on_disc))
        };
        // In dense fog every other probe is placed by the share of lost light instead of the distance.
        let whole = part.lost(0.0, limit);
        let by_loss = part.depth(0.0, limit) > 0.5;
        let probe = |step: u32| {
            let share = (f64::from(step) + jitter) / f64::from(steps);
            match by_loss && step % 2 == 1 {
                true => part.where_depth_is(-(-share * whole).ln_1p(), limit),
                false => share * limit,
            }
        };
        let mut places: Vec<f64> = (0..steps).map(probe).chain([0.0, limit]).collect();
        places.sort_by(f64::total_cmp);
        let mut seen = arrives(0.0);
        let (mut from, mut found) = (0.0, Vec::new());
        for pair in places.windows(2) {
            let now = arrives(pair[1]);
            if now == seen {
                continue;
            }
            let (mut low, mut high) = (pair[0], pair[1]);
            for _ in 0..20 {
                let middle = 0.5 * (low + high);
                if arrives(middle) == seen { low = middle } else { high = middle }
            }
            if seen {
                found.push((from, high));
            }
            (from, seen) = (high, now);
        }
        if seen {
            found.push((from, limit));
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, Vec3};

    use super::*;
    use crate::reference::{CameraView, Effects, Mode, Smith, TruthOptions};
    use afterlight_scene::builtin::shapes;
    use afterlight_scene::builtin::stage::SceneBuilder;
    use afterlight_scene::{Camera, Falloff, LightKind, Material, Scene};

    fn medium(density: f64, height: f64) -> Medium {
        Medium { kind: Fog::Froxels, density, height, base: 0.0, albedo: 0.9, anisotropy: 0.6 }
    }

    /// Black balls on a black floor under a sun, a lamp among them and a spot light.
    fn balls(casts_shadow: bool) -> Scene {
        let mut stage = SceneBuilder::default();
        let black = stage.material(Material { base_color: Vec3::ZERO, ..Material::default() });
        stage.add("floor", shapes::plane([8.0, 8.0]), black);
        let ball = stage.mesh("ball", shapes::sphere(0.3, 16), black);
        for place in [DVec3::new(0.0, 0.6, 0.0), DVec3::new(0.8, 1.0, 0.5), DVec3::new(-0.7, 0.5, 0.9)] {
            stage.place(ball, black, glam::DAffine3::from_translation(place));
        }
        let inverse = Falloff::InverseSquare;
        let lights = [
            (LightKind::Directional { direction: DVec3::new(0.4, -1.0, -0.3) }, 3.0),
            (LightKind::Point { position: DVec3::new(0.4, 0.8, 0.9), range: None, falloff: inverse }, 1.0),
            (
                LightKind::Spot {
                    position: DVec3::new(-1.5, 2.0, 0.5),
                    direction: DVec3::new(1.0, -1.0, 0.1).normalize(),
                    inner_angle_degrees: 10.0,
                    outer_angle_degrees: 20.0,
                    range: Some(6.0),
                    falloff: inverse,
                },
                20.0,
            ),
        ];
        for (kind, intensity) in lights {
            stage.light(Light { intensity, casts_shadow, ..Light::of(kind) });
        }
        stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 1.2, 4.0), DVec3::new(0.0, 0.7, 0.0), DVec3::Y);
        stage.scene
    }

    fn picture(scene: &Scene, fog: Medium, steps: u32) -> Vec<DVec3> {
        let effects = Effects { fog: Some(fog), ..Effects::default() };
        let reference = Reference::new(scene).expect("a scene").with_effects(effects).with_air_steps(steps);
        let options = TruthOptions { mode: Mode::Point, smith: Smith::default() };
        let truth = reference.render(&CameraView { camera: scene.camera, size: [24, 14] }, &options, &|_, _| {});
        truth.radiance.into_iter().map(DVec3::from).collect()
    }

    fn apart(found: &[DVec3], wanted: &[DVec3]) -> f64 {
        let off: f64 = found.iter().zip(wanted).map(|(found, wanted)| (found.x - wanted.x).abs()).sum();
        off / wanted.iter().map(|own| own.x).sum::<f64>()
    }

    #[test]
    fn fog_with_lamps_is_known_to_a_ten_thousandth() {
        for (density, height) in [(0.05, 1e6), (2.0, 0.5), (1e3, 5.0)] {
            let scene = balls(true);
            let of = |steps| picture(&scene, medium(density, height), steps);
            let error = apart(&of(STEPS), &of(2 * STEPS));
            println!("{density} {height}: twice as many probes change {error:e}");
            assert!(error < 1e-4, "{density} {height}: {error:e}");
        }
    }

    /// Compares the march with a sum over many even steps, with a ray from each step to each light.
    #[test]
    fn the_march_is_what_many_plain_steps_come_to() {
        let (scene, fog) = (balls(true), medium(0.4, 1.0));
        let effects = Effects { fog: Some(fog), ..Effects::default() };
        let reference = Reference::new(&scene).expect("a scene").with_effects(effects);
        let rays = super::super::rays::CameraRays::of(&CameraView { camera: scene.camera, size: [24, 14] });
        let (mut off, mut all) = (0.0, 0.0);
        for pixel in [[3.5, 4.5], [8.5, 7.5], [12.5, 6.5], [15.5, 9.5], [17.5, 5.5]] {
            let ray = rays.ray(DVec2::from(pixel));
            let found = reference.passage(&ray, [0.0, 4.2], Points::All).gained.x;
            let (stretch, count) = (ray.direction.length(), 60_000);
            let (direction, step) = (ray.direction / stretch, 4.2 * stretch / f64::from(count));
            let at = |index: u32| {
                let metres = (f64::from(index) + 0.5) * step;
                let point = ray.origin + direction * metres;
                let scattered = fog.extinction(point.y) * (-fog.optical_depth(ray.origin.y, direction.y, metres)).exp();
                let each = reference.lights.iter().map(|own| {
                    let (towards, strength) = light::arriving(own, point);
                    let seen = strength > 0.0 && Receiver::floating(point).sees(&reference.geometry, own, DVec2::ZERO);
                    let phase = fog.phase(direction.dot(towards));
                    if seen { f64::from(own.intensity) * strength * phase } else { 0.0 }
                });
                scattered * each.sum::<f64>() * step
            };
            let wanted = (0..count).map(at).sum::<f64>() * fog.albedo;
            (off, all) = (off + (found - wanted).abs(), all + wanted);
        }
        println!("{:e}", off / all);
        assert!(off / all < 1e-4, "{}", off / all);
    }

    #[test]
    fn suns_without_shadow_are_the_closed_form_of_fog_by_height() {
        let mut scene = balls(false);
        scene.lights.truncate(1);
        scene.environment.ambient = Vec3::splat(0.2);
        for (density, height) in [(1e-6, 20.0), (0.3, 0.7), (1e5, 1e3)] {
            let fog = medium(density, height);
            let [march, closed] = [Fog::Froxels, Fog::Height].map(|kind| picture(&scene, Medium { kind, ..fog }, 8));
            let error = apart(&march, &closed);
            assert!(error < 1e-9, "{density} {height}: {error:e}");
        }
    }
}
