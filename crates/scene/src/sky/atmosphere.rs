//! A clear sky by day or at dusk: light of the sun that air and haze scatter to the eye, computed in f64 once, as a picture.
//!
//! The model is S. Hillaire's ("A Scalable and Production Ready Sky and Atmosphere Rendering Technique", EGSR 2020): single scattering along the ray,
//! and all further scattering by a table that takes it for even in all directions. Unlike Hosek and Wilkie's fit it needs no data but the air's
//! own, and holds for a sun below the horizon and for the ground seen from above.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{SkyImage, SkyOrigin, SunDisc};

/// Radii of the ground and of the top of the air, in metres from the centre of the earth.
const GROUND: f64 = 6_360e3;
const TOP: f64 = 6_460e3;
/// Coefficients at sea level, per metre (Bruneton and Neyret 2008; ozone by Hillaire 2020, table 1).
const RAYLEIGH: DVec3 = DVec3::new(5.802e-6, 13.558e-6, 33.1e-6);
const MIE_SCATTERING: f64 = 3.996e-6;
const MIE_ABSORPTION: f64 = 4.4e-6;
const OZONE: DVec3 = DVec3::new(0.650e-6, 1.881e-6, 0.085e-6);
/// Heights over which air and haze thin out to 1/e, in metres.
const RAYLEIGH_HEIGHT: f64 = 8e3;
const MIE_HEIGHT: f64 = 1.2e3;
/// The anisotropy of haze (Henyey and Greenstein's g).
const MIE_AHEAD: f64 = 0.8;
/// The sun's illuminance above the air, in lux: 1361 W/m^2 at 98 lm/W.
const SUN_LUX: f64 = 133e3;
/// The sun's angular diameter in degrees.
const SUN_DEGREES: f64 = 0.53;
/// The width of the sky's image, in texels.
const WIDTH: u32 = 512;
/// Steps of a ray, and of the rays of tables.
const STEPS: usize = 40;

/// An atmosphere and the ground below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Atmosphere {
    /// The direction towards the sun, of length 1.
    pub sun: DVec3,
    /// The amount of haze: 1 on a clear day, 0 for none.
    pub haze: f64,
    /// Reflectance of the ground, 0 to 1.
    pub ground: f64,
    /// The eye's height above the sea, in metres.
    pub altitude: f64,
}

impl Default for Atmosphere {
    /// An afternoon by the sea.
    fn default() -> Self {
        Self { sun: Self::sun_at(35.0, 140.0), haze: 1.0, ground: 0.3, altitude: 2.0 }
    }
}

/// Coefficients of the air at a place, per metre.
struct AirCoefficients {
    rayleigh: DVec3,
    mie: f64,
    extinction: DVec3,
}

impl Atmosphere {
    /// The direction towards a sun at `elevation` above the horizon and `azimuth` from -Z over +X, in degrees.
    pub fn sun_at(elevation: f64, azimuth: f64) -> DVec3 {
        let ((up, level), (across, ahead)) = (elevation.to_radians().sin_cos(), azimuth.to_radians().sin_cos());
        DVec3::new(level * across, up, -level * ahead)
    }

    /// Returns its sun's elevation above the horizon, and its azimuth from -Z over +X, in degrees: [`Atmosphere::sun_at`] reversed.
    pub fn sun_angles(&self) -> [f64; 2] {
        [self.sun.y.clamp(-1.0, 1.0).asin(), self.sun.x.atan2(-self.sun.z)].map(f64::to_degrees)
    }

    /// The sky without the sun's disc; texels are in nits times `scale`, the second.
    pub fn image(&self) -> (SkyImage, f32) {
        let tables = Tables::of(self);
        // A bright sky has 10,000 nits; texels of about 1 leave half floats most room.
        const NITS: f64 = 10e3;
        let image = SkyImage::of("atmosphere", WIDTH, |to| self.scattered(&tables, to, STEPS) / NITS);
        (SkyImage { origin: SkyOrigin::Atmosphere(*self), ..image }, NITS as f32)
    }

    /// Returns the sun's light that reaches the eye, in lux on a surface that faces it: the colour of a directional light.
    pub fn sunlight(&self) -> Vec3 {
        let eye = DVec3::Y * (GROUND + self.altitude.max(1.0));
        if meets_ground(eye, self.sun) {
            return Vec3::ZERO;
        }
        (self.transmittance(eye, self.sun, 4 * STEPS) * SUN_LUX).as_vec3()
    }

    /// The sun as it is seen: its light from its disc.
    pub fn disc(&self) -> SunDisc {
        let solid_angle = TAU * (1.0 - (SUN_DEGREES / 2.0).to_radians().cos());
        SunDisc { direction: self.sun, degrees: SUN_DEGREES, radiance: self.sunlight() / solid_angle as f32 }
    }

    fn coefficients(&self, height: f64) -> AirCoefficients {
        let rayleigh = RAYLEIGH * (-height / RAYLEIGH_HEIGHT).exp();
        let haze = self.haze * (-height / MIE_HEIGHT).exp();
        // Ozone lies around 25 km, up to 15 km above and below.
        let ozone = OZONE * (1.0 - (height - 25e3).abs() / 15e3).max(0.0);
        let mie = MIE_SCATTERING * haze;
        AirCoefficients { rayleigh, mie, extinction: rayleigh + DVec3::splat(mie + MIE_ABSORPTION * haze) + ozone }
    }

    /// The share of light that passes from a place to the top of the air, for rays that miss the ground.
    fn transmittance(&self, from: DVec3, to: DVec3, steps: usize) -> DVec3 {
        let length = distance(from, to, TOP).unwrap_or(0.0);
        let depth = midpoints(length, steps)
            .map(|(at, width)| self.coefficients((from + to * at).length() - GROUND).extinction * width)
            .sum::<DVec3>();
        (-depth).exp()
    }

    /// Radiance that air, haze and ground send to the eye from a direction, in nits.
    fn scattered(&self, tables: &Tables, to: DVec3, steps: usize) -> DVec3 {
        let eye = DVec3::Y * (GROUND + self.altitude.max(1.0));
        let cosine = to.dot(self.sun);
        let phases = [3.0 / (16.0 * PI) * (1.0 + cosine * cosine), henyey_greenstein(cosine)];
        self.along(eye, to, steps, |place, medium| {
            let arriving = tables.sunlight(place, self.sun);
            let single = (medium.rayleigh * phases[0] + medium.mie * phases[1]) * arriving;
            single + (medium.rayleigh + medium.mie) * tables.rescattered(place, self.sun)
        }) * SUN_LUX
            + self.of_ground(eye, to, steps, |place| tables.sunlight(place, self.sun)) * SUN_LUX
    }

    /// Adds up the light that is scattered along a ray; within a step the air is even, and dims the light that it scatters itself (Hillaire 2015).
    fn along(&self, from: DVec3, to: DVec3, steps: usize, sent: impl Fn(DVec3, &AirCoefficients) -> DVec3) -> DVec3 {
        let (mut light, mut passed) = (DVec3::ZERO, DVec3::ONE);
        for (at, width) in midpoints(end_of(from, to), steps) {
            let place = from + to * at;
            let medium = self.coefficients(place.length() - GROUND);
            let through = (-medium.extinction * width).exp();
            light += passed * sent(place, &medium) * (1.0 - through) / medium.extinction.max(DVec3::splat(1e-30));
            passed *= through;
        }
        light
    }

    /// Returns the light that the ground at the end of a ray reflects.
    fn of_ground(&self, from: DVec3, to: DVec3, steps: usize, arriving: impl Fn(DVec3) -> DVec3) -> DVec3 {
        if !meets_ground(from, to) {
            return DVec3::ZERO;
        }
        let length = end_of(from, to);
        let depth: DVec3 = midpoints(length, steps)
            .map(|(at, width)| self.coefficients((from + to * at).length() - GROUND).extinction * width)
            .sum();
        let place = from + to * length;
        let facing = place.normalize().dot(self.sun).max(0.0);
        (-depth).exp() * arriving(place) * (self.ground / PI * facing)
    }
}

/// Henyey and Greenstein's phase function of haze, a steradian.
fn henyey_greenstein(cosine: f64) -> f64 {
    let g = MIE_AHEAD;
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

/// Returns the distance at which a ray leaves a sphere around the centre of the earth.
fn distance(from: DVec3, to: DVec3, radius: f64) -> Option<f64> {
    let along = from.dot(to);
    let inside = radius * radius - from.length_squared() + along * along;
    (inside >= 0.0).then(|| inside.sqrt() - along).filter(|&own| own > 0.0)
}

fn meets_ground(from: DVec3, to: DVec3) -> bool {
    let along = from.dot(to);
    along < 0.0 && from.length_squared() - along * along < GROUND * GROUND
}

/// Returns the distance at which a ray ends: at the ground or at the top of the air.
fn end_of(from: DVec3, to: DVec3) -> f64 {
    if meets_ground(from, to) {
        let along = from.dot(to);
        return (-along - (GROUND * GROUND - from.length_squared() + along * along).max(0.0).sqrt()).max(0.0);
    }
    distance(from, to, TOP).unwrap_or(0.0)
}

/// The middles of steps and their widths, which grow along the ray, as the air thins out.
fn midpoints(length: f64, steps: usize) -> impl Iterator<Item = (f64, f64)> {
    let edge = move |index: usize| (index as f64 / steps as f64).powi(2) * length;
    (0..steps).map(move |index| ((edge(index) + edge(index + 1)) / 2.0, edge(index + 1) - edge(index)))
}

/// Tables by height and by the cosine of the sun's zenith angle: the arriving sunlight, and the light scattered twice or more, for a sun of 1.
struct Tables {
    arriving: Vec<DVec3>,
    rescattered: Vec<DVec3>,
}

/// Heights and cosines of the tables.
const HEIGHTS: usize = 64;
const COSINES: usize = 128;
const FEW_HEIGHTS: usize = 16;
const FEW_COSINES: usize = 32;

impl Tables {
    fn of(air: &Atmosphere) -> Self {
        let table = |rows: usize, columns: usize, value: &(dyn Fn(DVec3, DVec3) -> DVec3 + Sync)| -> Vec<DVec3> {
            let at = |index: usize| {
                let share = (index / columns) as f64 / (rows - 1) as f64;
                let place = DVec3::Y * (GROUND + 1.0 + share * share * (TOP - GROUND - 2.0));
                let cosine = cosine_of((index % columns) as f64 / (columns - 1) as f64);
                value(place, DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), cosine, 0.0))
            };
            (0..rows * columns).into_par_iter().map(at).collect()
        };
        let arriving = table(HEIGHTS, COSINES, &|place, sun| match meets_ground(place, sun) {
            true => DVec3::ZERO,
            false => air.transmittance(place, sun, STEPS),
        });
        let single = Self { arriving, rescattered: Vec::new() };
        let rescattered = table(FEW_HEIGHTS, FEW_COSINES, &|place, sun| single.all_orders(air, place, sun));
        Self { rescattered, ..single }
    }

    /// Light scattered twice, from all around, and with it all orders beyond: a share f of it is scattered again, so that there is
    /// 1 + f + f^2 + ... of it (Hillaire 2020, section 5.5).
    fn all_orders(&self, air: &Atmosphere, place: DVec3, sun: DVec3) -> DVec3 {
        const SIDES: usize = 8;
        let under = Atmosphere { sun, ..*air };
        let (mut twice, mut share) = (DVec3::ZERO, DVec3::ZERO);
        for index in 0..SIDES * SIDES {
            let height = 1.0 - 2.0 * ((index / SIDES) as f64 + 0.5) / SIDES as f64;
            let (sin, cos) = (((index % SIDES) as f64 + 0.5) / SIDES as f64 * TAU).sin_cos();
            let level = (1.0 - height * height).sqrt();
            let to = DVec3::new(level * cos, height, level * sin);
            let even = 1.0 / (4.0 * PI);
            let arriving = |place: DVec3| self.sunlight(place, sun);
            twice += under
                .along(place, to, STEPS / 2, |at, medium| (medium.rayleigh + medium.mie) * arriving(at) * even)
                + under.of_ground(place, to, STEPS / 2, arriving);
            share += under.along(place, to, STEPS / 2, |_, medium| medium.rayleigh + medium.mie);
        }
        let count = (SIDES * SIDES) as f64;
        (twice / count) / (DVec3::ONE - share / count)
    }

    /// The share of the sun's light that arrives at a place.
    fn sunlight(&self, place: DVec3, sun: DVec3) -> DVec3 {
        if meets_ground(place, sun) {
            return DVec3::ZERO;
        }
        lookup(&self.arriving, COSINES, place, sun)
    }

    fn rescattered(&self, place: DVec3, sun: DVec3) -> DVec3 {
        lookup(&self.rescattered, FEW_COSINES, place, sun)
    }
}

/// The cosine at a share of the table's axis: cosines are densest at the horizon.
fn cosine_of(share: f64) -> f64 {
    let side = 2.0 * share - 1.0;
    side * side.abs()
}

fn lookup(table: &[DVec3], columns: usize, place: DVec3, sun: DVec3) -> DVec3 {
    let rows = table.len() / columns;
    let height = ((place.length() - GROUND - 1.0) / (TOP - GROUND - 2.0)).clamp(0.0, 1.0).sqrt();
    let cosine = place.normalize().dot(sun);
    let across = (cosine.abs().sqrt().copysign(cosine) + 1.0) / 2.0;
    let (y, x) = (height * (rows - 1) as f64, across.clamp(0.0, 1.0) * (columns - 1) as f64);
    let (top, left) = (y.floor().min((rows - 2) as f64), x.floor().min((columns - 2) as f64));
    let at = |row: f64, column: f64| table[row as usize * columns + column as usize];
    let row = |row: f64| at(row, left).lerp(at(row, left + 1.0), x - left);
    row(top).lerp(row(top + 1.0), y - top)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_through_clear_air_is_dimmed_by_the_closed_form() {
        // Straight up through air that thins out by 1/e: depth = scattering times height, up to the last 1e-5; ozone is a triangle of 15 km.
        let air = Atmosphere { haze: 0.0, altitude: 0.0, ..Atmosphere::default() };
        let found = air.transmittance(DVec3::Y * GROUND, DVec3::Y, 2000);
        let expected = (-(RAYLEIGH * RAYLEIGH_HEIGHT + OZONE * 15e3)).exp();
        assert!((found - expected).abs().max_element() < 1e-4, "{found} {expected}");
    }

    #[test]
    fn forty_steps_are_as_good_as_many() {
        for elevation in [60.0, 20.0, 2.0, -3.0] {
            let air = Atmosphere { sun: Atmosphere::sun_at(elevation, 0.0), ..Atmosphere::default() };
            let tables = Tables::of(&air);
            let brightest =
                air.scattered(&tables, Atmosphere::sun_at(elevation.max(1.0) + 2.0, 0.0), 2000).max_element();
            for (up, around) in [(90.0, 0.0), (30.0, 90.0), (10.0, 170.0), (3.0, 20.0), (-20.0, 0.0)] {
                let to = Atmosphere::sun_at(up, around);
                let (few, many) = (air.scattered(&tables, to, STEPS), air.scattered(&tables, to, 2000));
                let off = (few - many).abs().max_element() / many.max_element().max(0.02 * brightest);
                assert!(off < 0.02, "sun {elevation}, {up} {around}: {few} {many}");
            }
        }
    }

    #[test]
    fn the_sky_is_blue_by_day_red_at_the_horizon_at_dusk_and_dark_at_night() {
        let look = |elevation: f64, up: f64| {
            let air = Atmosphere { sun: Atmosphere::sun_at(elevation, 0.0), ..Atmosphere::default() };
            air.scattered(&Tables::of(&air), Atmosphere::sun_at(up, 0.0), STEPS)
        };
        let zenith = look(40.0, 90.0);
        assert!(zenith.z > 2.0 * zenith.x && (500.0..20e3).contains(&zenith.y), "{zenith}");
        let dusk = look(0.5, 1.5);
        assert!(dusk.x > 2.0 * dusk.z, "{dusk}");
        assert!(look(-20.0, 30.0).max_element() < 0.01 * look(40.0, 30.0).max_element());
    }

    #[test]
    fn a_high_sun_lights_a_surface_with_about_a_hundred_thousand_lux() {
        let high = Atmosphere { sun: Atmosphere::sun_at(70.0, 0.0), ..Atmosphere::default() };
        let lux = crate::luminance(high.sunlight());
        assert!((80e3..125e3).contains(&lux), "{lux}");
        let set = Atmosphere { sun: Atmosphere::sun_at(-1.0, 0.0), ..high };
        assert_eq!(set.sunlight(), Vec3::ZERO);
        // The disc holds the same light.
        let disc = high.disc();
        let all = disc.radiance * (TAU * (1.0 - disc.cosine())) as f32;
        assert!((all - high.sunlight()).abs().max_element() < 1.0, "{all}");
    }
}
