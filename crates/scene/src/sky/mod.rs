//! The sky around a scene: an image, from a file or of an atmosphere, that is the background and lights the scene.

mod atmosphere;
#[cfg(feature = "readers")]
mod choice;
mod cube;
mod directions;
#[cfg(feature = "readers")]
mod read;
mod studio;

pub use atmosphere::Atmosphere;
#[cfg(feature = "readers")]
pub use choice::{SkyChoice, fit_to_light, put_atmosphere, put_sky};
pub use cube::{CubeLevel, FACES, SkyCube, face_direction};
pub use directions::{SkyDirection, SkyDistribution};
#[cfg(feature = "readers")]
pub use read::{read_faces, read_panorama};
pub use studio::Studio;

use std::f64::consts::{PI, TAU};
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};

use super::check::infinite;

/// The largest value of a texel. Beyond it a sun would leave no steps for the sky around it in half floats.
pub const MOST_LIGHT: f32 = 1e6;

/// The brightest texel as a half float: below 65504, so that sums of filters stay finite.
const BRIGHTEST_HALF: f32 = 60_000.0;

/// The sky of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Sky {
    /// Radiance from all directions.
    pub image: Arc<SkyImage>,
    /// Turns the sky about +Y, counter-clockwise as seen from above, in degrees.
    pub rotation_degrees: f64,
    /// Radiance of a texel of 1, in nits.
    pub nits: f32,
    /// True if it lights surfaces.
    pub lights: bool,
    /// True if it is drawn where no surface is; otherwise the environment's background is.
    pub shown: bool,
    /// The sun's disc, if the image does not contain the sun.
    pub sun: Option<SunDisc>,
}

/// A sun that is drawn into the sky. It lights nothing: a directional light of the scene does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunDisc {
    /// The direction towards the sun, of length 1. The sky's rotation does not turn it.
    pub direction: DVec3,
    /// The angular diameter in degrees.
    pub degrees: f64,
    /// The radiance in nits.
    pub radiance: Vec3,
}

/// Radiance from all directions as an equirectangular picture: its middle looks along -Z, its upper edge to +Y, and to its right lies +X.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyImage {
    /// The name in messages and reports.
    pub name: String,
    /// Width and height in texels; it is twice as wide as high.
    pub size: [u32; 2],
    /// Linear Rec. 709, rows from the top; finite, from 0 to [`MOST_LIGHT`].
    pub texels: Vec<[f32; 3]>,
    /// The source of the texels.
    pub origin: SkyOrigin,
}

/// The source of a sky, so that a scene file can name it.
#[derive(Debug, Clone, PartialEq)]
pub enum SkyOrigin {
    /// An equirectangular picture.
    Panorama(PathBuf),
    /// The faces of a cube: +X, -X, +Y, -Y, +Z, -Z.
    Faces(Box<[PathBuf; 6]>),
    /// A computed atmosphere.
    Atmosphere(Atmosphere),
    /// The soft areas of light of [`Studio`].
    Studio,
    /// An image that a program has made.
    Made,
}

impl Sky {
    /// Rotates a direction of the world to the sky's own space.
    pub fn turned(&self, direction: DVec3) -> DVec3 {
        let (sin, cos) = self.rotation_degrees.to_radians().sin_cos();
        DVec3::new(direction.x * cos - direction.z * sin, direction.y, direction.x * sin + direction.z * cos)
    }

    /// Radiance from a direction of length 1, in nits, without the sun's disc.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        self.image.look(self.turned(direction)) * f64::from(self.nits)
    }

    /// Radiance seen in a direction of length 1, in nits: the sun's within its disc.
    pub fn seen(&self, direction: DVec3) -> DVec3 {
        match self.sun {
            Some(sun) if direction.dot(sun.direction) >= sun.cosine() => sun.radiance.as_dvec3(),
            _ => self.radiance(direction),
        }
    }

    /// The mean radiance over all directions, in nits.
    pub fn mean(&self) -> Vec3 {
        (self.image.mean() * f64::from(self.nits)).as_vec3()
    }

    pub(super) fn fault(&self) -> Option<String> {
        let SkyImage { size: [width, height], texels, .. } = &*self.image;
        let count = u64::from(*width) * u64::from(*height);
        if *height == 0 || u64::from(*width) != 2 * u64::from(*height) || count != texels.len() as u64 {
            let texels = texels.len();
            return Some(format!(
                "its image is {width}x{height} with {texels} texels: it must be twice as wide as high"
            ));
        }
        let is_light = |value: &f32| (0.0..=MOST_LIGHT).contains(value);
        if let Some(at) = texels.iter().position(|texel| !texel.iter().all(is_light)) {
            return Some(format!("texel {at} of its image is not from 0 to {MOST_LIGHT}"));
        }
        if !self.rotation_degrees.is_finite() {
            return Some(infinite("its rotation"));
        }
        if !(self.nits >= 0.0 && self.nits <= 1e9) {
            return Some(format!("its strength is {}: expected 0 to 1e9 nits", self.nits));
        }
        let sun = self.sun?;
        let is_unit = (sun.direction.length() - 1.0).abs() < 1e-6;
        let is_disc = (0.0..=180.0).contains(&sun.degrees) && sun.radiance.min_element() >= 0.0;
        (!is_unit || !is_disc || !sun.radiance.is_finite())
            .then(|| "its sun needs a direction of length 1, 0 to 180 degrees and a finite radiance".into())
    }
}

impl SunDisc {
    /// Returns the cosine of its angular radius.
    pub fn cosine(&self) -> f64 {
        (self.degrees / 2.0).to_radians().cos()
    }
}

impl SkyImage {
    /// Makes a sky by computing each texel from its direction.
    pub fn of(name: &str, width: u32, radiance: impl Fn(DVec3) -> DVec3 + Sync) -> Self {
        use rayon::prelude::*;
        let size = [width, width / 2];
        let texel = |index: u32| {
            let at = DVec2::new(f64::from(index % width) + 0.5, f64::from(index / width) + 0.5);
            let light = radiance(direction_at(at / DVec2::new(f64::from(width), f64::from(size[1]))));
            light.as_vec3().clamp(Vec3::ZERO, Vec3::splat(MOST_LIGHT)).to_array()
        };
        let texels = (0..width * size[1]).into_par_iter().map(texel).collect();
        Self { name: name.into(), size, texels, origin: SkyOrigin::Made }
    }

    /// The value in a direction of length 1, bilinear between the texels.
    pub fn look(&self, direction: DVec3) -> DVec3 {
        let [width, height] = self.size.map(f64::from);
        let across = (0.5 + direction.x.atan2(-direction.z) / TAU) * width - 0.5;
        let down = (direction.y.clamp(-1.0, 1.0).acos() / PI * height - 0.5).clamp(0.0, height - 1.0);
        let (left, top) = (across.floor(), down.floor());
        let row = |row: f64| {
            let [from, to] = [left, left + 1.0].map(|column| self.texel(column, row));
            from.lerp(to, across - left)
        };
        row(top).lerp(row((top + 1.0).min(height - 1.0)), down - top)
    }

    fn texel(&self, column: f64, row: f64) -> DVec3 {
        let width = i64::from(self.size[0]);
        let column = (column as i64).rem_euclid(width);
        Vec3::from(self.texels[(row as i64 * width + column) as usize]).as_dvec3()
    }

    /// Each texel's direction, solid angle in steradians, and value.
    pub fn directions(&self) -> impl Iterator<Item = (DVec3, f64, DVec3)> {
        let [width, height] = self.size;
        let size = DVec2::new(f64::from(width), f64::from(height));
        self.texels.iter().zip(0..).map(move |(texel, index): (_, u32)| {
            let at = DVec2::new(f64::from(index % width) + 0.5, f64::from(index / width) + 0.5);
            let [upper, lower] = [0.0, 1.0].map(|edge| ((f64::from(index / width) + edge) / size.y * PI).cos());
            (direction_at(at / size), (upper - lower) * TAU / size.x, Vec3::from(*texel).as_dvec3())
        })
    }

    /// The mean over all directions.
    pub fn mean(&self) -> DVec3 {
        self.directions().map(|(_, share, value)| value * share).sum::<DVec3>() / (4.0 * PI)
    }

    /// The largest value of any channel.
    pub fn brightest(&self) -> f32 {
        self.texels.iter().flatten().fold(0.0, |most, &value| most.max(value))
    }

    /// Returns the factor that texels are multiplied by before they become half floats, so that the brightest is [`BRIGHTEST_HALF`].
    pub fn half_scale(&self) -> f32 {
        let brightest = self.brightest();
        if brightest > 0.0 { BRIGHTEST_HALF / brightest } else { 1.0 }
    }

    /// Half as wide and high, texels weighted by their solid angles.
    #[must_use]
    pub fn halved(&self) -> Self {
        let [width, height] = self.size.map(|edge| edge as usize);
        let weight = |row: usize| ((row as f64 + 0.5) / height as f64 * PI).sin() as f32;
        let texel = |index: usize| {
            let (column, row) = (index % (width / 2) * 2, index / (width / 2) * 2);
            let pair = |row: usize| {
                let [a, b] = [0, 1].map(|beside| Vec3::from(self.texels[row * width + column + beside]));
                (a + b) * 0.5
            };
            let (upper, lower) = (weight(row), weight(row + 1));
            ((pair(row) * upper + pair(row + 1) * lower) / (upper + lower)).to_array()
        };
        let texels = (0..width / 2 * (height / 2)).map(texel).collect();
        Self {
            size: [width as u32 / 2, height as u32 / 2],
            texels,
            name: self.name.clone(),
            origin: self.origin.clone(),
        }
    }
}

/// The direction of a place of the picture, from 0, 0 at its upper left corner to 1, 1.
pub fn direction_at(place: DVec2) -> DVec3 {
    let (sin, cos) = (place.y * PI).sin_cos();
    let (across, ahead) = ((place.x - 0.5) * TAU).sin_cos();
    DVec3::new(sin * across, cos, -sin * ahead)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn smooth(direction: DVec3) -> DVec3 {
        DVec3::new(2.0 + direction.x, 2.0 + direction.y, 2.0 + direction.z * direction.x)
    }

    #[test]
    fn a_texel_is_found_where_its_direction_says() {
        let image = SkyImage::of("it", 64, smooth);
        for (direction, _, value) in image.directions() {
            assert!((image.look(direction) - value).length() < 1e-6, "{direction}");
        }
        // Between them, off by no more than the curvature of a sine over a texel: (2 pi / 64)^2 / 8.
        for direction in [DVec3::NEG_Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.48, 0.6, 0.64)] {
            assert!((image.look(direction) - smooth(direction)).abs().max_element() < 3e-3, "{direction}");
        }
    }

    #[test]
    fn the_middle_looks_along_minus_z_and_plus_x_lies_to_the_right() {
        for (place, direction) in [
            (DVec2::new(0.5, 0.5), DVec3::NEG_Z),
            (DVec2::new(0.75, 0.5), DVec3::X),
            (DVec2::new(0.0, 0.5), DVec3::Z),
            (DVec2::new(0.3, 0.0), DVec3::Y),
        ] {
            assert!((direction_at(place) - direction).length() < 1e-12, "{place}");
        }
    }

    #[test]
    fn solid_angles_are_those_of_the_sphere_and_halving_keeps_the_mean() {
        let image = SkyImage::of("it", 64, smooth);
        let all: f64 = image.directions().map(|(_, share, _)| share).sum();
        assert!((all - 4.0 * PI).abs() < 1e-9);
        assert!((image.mean() - DVec3::splat(2.0)).abs().max_element() < 1e-3, "{}", image.mean());
        assert!((image.halved().mean() - image.mean()).abs().max_element() < 1e-3);
    }

    #[test]
    fn a_sky_turns_counter_clockwise_seen_from_above() {
        let image = Arc::new(SkyImage::of("it", 128, |to| if to.x > 0.8 { DVec3::ONE } else { DVec3::ZERO }));
        let sky = |rotation_degrees| Sky {
            image: Arc::clone(&image),
            rotation_degrees,
            nits: 3.0,
            lights: true,
            shown: true,
            sun: None,
        };
        assert_eq!(sky(0.0).radiance(DVec3::X), DVec3::splat(3.0));
        // A quarter turn about +Y takes +X to -Z.
        assert_eq!(sky(90.0).radiance(DVec3::NEG_Z), DVec3::splat(3.0));
        assert_eq!(sky(90.0).radiance(DVec3::X), DVec3::ZERO);
    }

    #[test]
    fn faults_are_named() {
        let image = |width, texel: f32| {
            let texels = vec![[texel; 3]; 2 * width as usize];
            Arc::new(SkyImage { name: "it".into(), size: [width, 2], texels, origin: SkyOrigin::Made })
        };
        let sky = Sky { image: image(4, 1.0), rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None };
        assert_eq!(sky.fault(), None);
        let bad = [
            Sky { image: image(2, 1.0), ..sky.clone() },
            Sky { image: image(4, f32::NAN), ..sky.clone() },
            Sky { image: image(4, -1.0), ..sky.clone() },
            Sky { image: image(4, 1e38), ..sky.clone() },
            Sky { rotation_degrees: f64::INFINITY, ..sky.clone() },
            Sky { nits: f32::NAN, ..sky.clone() },
            Sky { sun: Some(SunDisc { direction: DVec3::ZERO, degrees: 0.5, radiance: Vec3::ONE }), ..sky },
        ];
        bad.iter().for_each(|sky| assert!(sky.fault().is_some(), "{sky:?}"));
    }
}
