//! Directions that are drawn from a sky in proportion to its brightness, so that lights along them represent all of it.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};

use super::{Sky, SkyImage};

/// The largest width of the image that directions are drawn from, if its sides can be halved: a texel is 1.4 degrees.
const DRAWN_WIDTH: u32 = 256;
/// Steps of a sequence of points of which any part in a row covers the unit square evenly (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences",
/// 2018).
const STEPS: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);

/// A directional light that stands for a part of a sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyDirection {
    /// The direction towards the light, of length 1.
    pub to_light: DVec3,
    /// Illuminance of a surface that faces it, in lux: the sky's radiance divided by the density of directions.
    pub lux: Vec3,
}

/// The distribution of a sky's light over directions. Constant within a texel of its image.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyDistribution {
    sky: Sky,
    width: usize,
    /// The sums of the weights up to and including each row, and each texel within its row.
    rows: Vec<f64>,
    texels: Vec<f64>,
}

impl SkyDistribution {
    /// The distribution of a sky's light; `None` for a black sky.
    pub fn of(sky: &Sky) -> Option<Self> {
        let mut image = Arc::clone(&sky.image);
        // A side of an odd number of texels has no half.
        while image.size[0] > DRAWN_WIDTH && image.size[1].is_multiple_of(2) {
            image = Arc::new(image.halved());
        }
        if image.size[0] < DRAWN_WIDTH / 2 {
            // The light of large texels is interpolated.
            image = Arc::new(SkyImage::of(&image.name, DRAWN_WIDTH, |direction| image.look(direction)));
        }
        let width = image.size[0] as usize;
        let weights = image.directions().map(|(_, steradians, value)| steradians * value.element_sum());
        let mut texels: Vec<f64> = weights.collect();
        let mut rows = Vec::with_capacity(width / 2);
        for row in texels.chunks_mut(width) {
            let sum = row.iter_mut().fold(0.0, |sum, own| {
                *own += sum;
                *own
            });
            rows.push(rows.last().copied().unwrap_or(0.0) + sum);
        }
        let all = rows.last().copied().unwrap_or(0.0);
        (all > 0.0 && sky.nits > 0.0).then(|| Self { sky: Sky { image, ..sky.clone() }, width, rows, texels })
    }

    /// The lights of frame `index` of a picture. The mean over the frames from 0 on comes to the sky.
    pub fn of_frame(&self, index: u32, lights: u32) -> Vec<SkyDirection> {
        let share = 1.0 / f64::from(lights.max(1));
        let number = |light: u32| f64::from(index) * f64::from(lights) + f64::from(light);
        let points = (0..lights).map(|light| (DVec2::splat(0.5) + STEPS * number(light)).fract());
        points.map(|point| self.at(point, share)).collect()
    }

    /// The light at a point of the unit square, with this share of the sky's light.
    fn at(&self, point: DVec2, share: f64) -> SkyDirection {
        let (row, down) = place(&self.rows, point.y);
        let own = &self.texels[row * self.width..][..self.width];
        let (column, across) = place(own, point.x);
        let height = self.rows.len() as f64;
        // Down a texel, evenly over its solid angle.
        let [upper, lower] = [0.0, 1.0].map(|edge| ((row as f64 + edge) / height * PI).cos());
        let up = upper + (lower - upper) * down;
        let angle = ((column as f64 + across) / self.width as f64 - 0.5) * TAU;
        let level = (1.0 - up * up).max(0.0).sqrt();
        let back = Sky { rotation_degrees: -self.sky.rotation_degrees, ..self.sky.clone() };
        let value = Vec3::from(self.sky.image.texels[row * self.width + column]).as_dvec3();
        // Texels are weighted by the sum of their channels. So each direction gets the same sum of light, in the colour of its texel.
        let all = self.rows.last().copied().unwrap_or(0.0);
        let lux = value * (all / value.element_sum() * share * f64::from(self.sky.nits));
        SkyDirection {
            to_light: back.turned(DVec3::new(level * angle.sin(), up, -level * angle.cos())),
            lux: lux.as_vec3().min(Vec3::splat(f32::MAX)),
        }
    }
}

/// The element of ascending sums in which a share of them all lies, and the place within it from 0 to 1.
fn place(sums: &[f64], share: f64) -> (usize, f64) {
    let target = share * sums.last().copied().unwrap_or(0.0);
    // Elements of no weight are never found.
    let index = sums.partition_point(|&sum| sum <= target).min(sums.partition_point(|&sum| sum < sums[sums.len() - 1]));
    let before = if index == 0 { 0.0 } else { sums[index - 1] };
    (index, ((target - before) / (sums[index] - before)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(radiance: impl Fn(DVec3) -> DVec3 + Sync) -> Sky {
        let image = Arc::new(SkyImage::of("it", 64, radiance));
        Sky { image, rotation_degrees: 30.0, nits: 3.0, lights: true, shown: true, sun: None }
    }

    /// The worst error of the light on surfaces of some normals, as a share of the light on the brightest of them.
    fn error(sky: &Sky, frames: u32, lights: u32) -> f64 {
        let distribution = SkyDistribution::of(sky).expect("a sky with light");
        let drawn: Vec<_> = (0..frames).flat_map(|frame| distribution.of_frame(frame, lights)).collect();
        let back = Sky { rotation_degrees: -sky.rotation_degrees, ..sky.clone() };
        let normals = [DVec3::X, DVec3::Y, DVec3::NEG_Z, DVec3::ONE.normalize(), DVec3::new(-0.6, 0.0, 0.8)];
        let lights = |normal: DVec3| {
            let texels = sky.image.directions().map(|(direction, steradians, value)| {
                value * (normal.dot(back.turned(direction)).max(0.0) * steradians * f64::from(sky.nits))
            });
            let of = |own: &SkyDirection| own.lux.as_dvec3() * normal.dot(own.to_light).max(0.0);
            (texels.sum::<DVec3>(), drawn.iter().map(of).sum::<DVec3>() / f64::from(frames))
        };
        let most = normals.map(|normal| lights(normal).0.max_element()).into_iter().fold(0.0, f64::max);
        let errors = normals.map(lights).map(|(exact, sum)| (sum - exact).abs().max_element() / most);
        errors.into_iter().fold(0.0, f64::max)
    }

    /// The error falls nearly as one over the number of directions, since their points cover a square evenly; random ones would err by four times as much.
    #[test]
    fn the_mean_over_all_frames_is_the_sky() {
        let skies = [
            sky(|_| DVec3::ONE),
            sky(|to| DVec3::new(1.0 + to.y, 1.0, 2.0 + to.x)),
            sky(|to| if to.dot(DVec3::new(0.6, 0.8, 0.0)) > 0.95 { DVec3::splat(50.0) } else { DVec3::splat(0.1) }),
        ];
        for sky in &skies {
            for (frames, lights, most) in [(1, 8, 0.2), (8, 8, 0.08), (64, 8, 0.006), (512, 1, 0.006)] {
                let error = error(sky, frames, lights);
                assert!(error < most, "{frames} frames of {lights}: {error}");
            }
        }
    }

    #[test]
    fn one_bright_texel_among_dark_ones_is_found_by_every_direction() {
        let one = SkyImage::of("it", 64, |to| if to.x > 0.997 { DVec3::new(0.0, 0.0, 1e6) } else { DVec3::ZERO });
        assert!(one.texels.iter().filter(|texel| texel[2] > 0.0).count() <= 4);
        let sky = Sky { image: Arc::new(one), ..sky(|_| DVec3::ONE) };
        let drawn = SkyDistribution::of(&sky).expect("light").of_frame(0, 32);
        let toward = Sky { rotation_degrees: -30.0, ..sky.clone() }.turned(DVec3::X);
        let sum: Vec3 = drawn.iter().map(|own| own.lux).sum();
        let exact = sky.image.directions().map(|(_, steradians, value)| value.z * steradians * 3.0).sum::<f64>();
        assert!(drawn.iter().all(|own| own.to_light.dot(toward) > 0.97 && own.lux.x == 0.0));
        assert!((f64::from(sum.z) / exact - 1.0).abs() < 0.01, "{sum} {exact}");
    }

    #[test]
    fn a_dark_sky_has_no_directions() {
        assert_eq!(SkyDistribution::of(&sky(|_| DVec3::ZERO)), None);
        assert_eq!(SkyDistribution::of(&Sky { nits: 0.0, ..sky(|_| DVec3::ONE) }), None);
    }
}
