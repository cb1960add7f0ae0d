//! The truth as a display shows it: exposed light through the tone curve, with chromatic aberration, vignette and grain, as codes of 8 bits.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::Truth;
use super::aberration;
use super::tonemap::{encode_srgb, tone_map};
use afterlight_scene::Settings;

/// A pixel's place in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pixel {
    /// Column and row, from the top left.
    pub place: [u32; 2],
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
}

impl Pixel {
    /// The pixel with this number, row by row from the top left.
    pub fn numbered(index: usize, size: [u32; 2]) -> Self {
        let index = index as u32;
        Self { place: [index % size[0], index / size[0]], size }
    }
}

/// The sRGB codes of a pixel. `exposed` has the light of each place of the picture, in pixels from its top left: 1 is where the sensor saturates.
pub fn shown_at(exposed: impl Fn(DVec2) -> DVec3, settings: &Settings, pixel: Pixel) -> [u8; 3] {
    let toned = |place| tone_map::<f64>(exposed(place), settings.tonemap);
    let middle = DVec2::from(pixel.place.map(f64::from)) + 0.5;
    let light = aberration::seen(toned, middle, pixel.size, f64::from(settings.aberration));
    finished(light, settings, pixel)
}

impl Truth {
    /// The sRGB codes of the picture. `exposure` is the light of a nit: 1 is where the sensor saturates.
    pub fn shown(&self, exposure: f64, settings: &Settings) -> Vec<[u8; 3]> {
        let exposed = self.radiance.par_iter().map(|light| DVec3::from_array(*light) * exposure);
        let toned: Vec<DVec3> = exposed.map(|light| tone_map::<f64>(light, settings.tonemap)).collect();
        let apart = aberration::apart(&toned, self.size, f64::from(settings.aberration));
        let pixels = apart.par_iter().enumerate();
        pixels.map(|(index, light)| finished(*light, settings, Pixel::numbered(index, self.size))).collect()
    }
}

/// The sRGB codes of exposed light that lies around a pixel, too.
pub fn shown(exposed: DVec3, settings: &Settings, pixel: Pixel) -> [u8; 3] {
    finished(tone_map::<f64>(exposed, settings.tonemap), settings, pixel)
}

/// Returns the codes of light that vignette and grain weaken.
fn finished(toned: DVec3, settings: &Settings, pixel: Pixel) -> [u8; 3] {
    let light = toned * lens(settings, pixel) * film(settings, pixel);
    light.to_array().map(|linear| (encode_srgb(linear) * 255.0).round() as u8)
}

/// The share of light that vignetting leaves. A lens lets through the fourth power of the cosine of the angle to its axis; here half the
/// picture's diagonal is seen at 45 degrees.
fn lens(settings: &Settings, Pixel { place, size }: Pixel) -> f64 {
    let half = DVec2::from(size.map(f64::from)) / 2.0;
    let tangent = (DVec2::from(place.map(f64::from)) + 0.5 - half).length() / half.length();
    let cosine = tangent.atan().cos();
    1.0 - f64::from(settings.vignette) * (1.0 - cosine.powi(4))
}

/// The share that grain leaves.
fn film(settings: &Settings, pixel: Pixel) -> f64 {
    1.0 - f64::from(settings.grain) * noise(pixel)
}

/// 0 to 1, in steps of 2^-24: PCG (O'Neill 2014) as a hash of the column and the row (Jarzynski and Olano, "Hash Functions for GPU Rendering",
/// 2020).
fn noise(Pixel { place: [x, y], .. }: Pixel) -> f64 {
    let hash = |value: u32| {
        let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    };
    f64::from(hash(x.wrapping_add(hash(y))) >> 8) / f64::from(1 << 24)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lens_leaves_all_in_the_middle_and_a_quarter_in_the_corners() {
        let settings = Settings { vignette: 1.0, ..Settings::default() };
        let at = |place| lens(&settings, Pixel { place, size: [1001, 601] });
        assert!((at([500, 300]) - 1.0).abs() < 1e-12);
        // Half a pixel from the corner.
        assert!((at([0, 0]) - 0.25).abs() < 1e-3 && (at([1000, 600]) - at([0, 0])).abs() < 1e-12);
        let half = Settings { vignette: 0.5, ..settings };
        assert!((lens(&half, Pixel { place: [0, 0], size: [1001, 601] }) - 0.625).abs() < 1e-3);
        assert_eq!(lens(&Settings::default(), Pixel { place: [0, 0], size: [4, 4] }), 1.0);
    }

    #[test]
    fn grain_is_evenly_spread_and_differs_from_pixel_to_pixel() {
        let size = [256, 256];
        let values: Vec<f64> = (0..256 * 256).map(|index| noise(Pixel::numbered(index, size))).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64;
        // Of 65,536 independent ones the mean errs by 0.0011, the variance by 0.0003 (one standard deviation).
        assert!((mean - 0.5).abs() < 0.005 && (variance - 1.0 / 12.0).abs() < 0.0015, "{mean} {variance}");
        let neighbours = values.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert!(neighbours < 3, "{neighbours}");
    }
}
