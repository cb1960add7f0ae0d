//! Two pictures and how far they are apart.

use afterlight::scene::{Tonemap, exposure_scale};
use afterlight_truth::measure::{Difference, LinearImage, Mismatch, errors, shown_errors};
#[cfg(feature = "report")]
use afterlight_truth::measure::{FlipMap, flip};

use super::Args;
use super::image_file::ImageFile;
use crate::failure::{Exit, Failure};

/// The mean luminance that the expected picture is exposed to where `--exposure` is not given: the reflectance of a photographer's grey card.
const MID_TONE: f64 = 0.18;

pub struct ImagePair {
    actual: ImageFile,
    expected: ImageFile,
    ev100: f32,
    tonemap: Tonemap,
}

/// The difference by all metrics.
pub struct Comparison {
    /// The difference of exposed light, if both pictures are light.
    pub light: Option<Difference>,
    /// The difference as shown, in sRGB from 0 to 1.
    pub shown: Difference,
    #[cfg(feature = "report")]
    pub flip: FlipMap,
    pub actual_not_finite: usize,
    pub expected_not_finite: usize,
}

impl Comparison {
    /// Pixels of either picture that are not finite.
    pub fn not_finite(&self) -> usize {
        self.actual_not_finite + self.expected_not_finite
    }
}

impl ImagePair {
    /// Reads both pictures and decides how light is shown.
    pub fn open(args: &Args) -> Result<Self, Failure> {
        let (actual, expected) = (ImageFile::open(&args.actual)?, ImageFile::open(&args.expected)?);
        if actual.size() != expected.size() {
            let mismatch = Mismatch { actual: actual.size(), expected: expected.size() };
            let names = format!("{} with {}", args.actual.display(), args.expected.display());
            return Err(Failure::new(Exit::BadInput, format!("cannot compare {names}: {mismatch}")));
        }
        let ev100 = match (&actual, &expected) {
            (ImageFile::Shown(_), ImageFile::Shown(_)) if args.exposure.is_some() || args.tonemap.is_some() => {
                let why = "both pictures are shown already: --exposure and --tonemap are for linear light (.exr)";
                return Err(Failure::usage(why));
            }
            (ImageFile::Shown(_), ImageFile::Shown(_)) => 0.0,
            (ImageFile::Light(_), ImageFile::Light(expected)) => args.exposure.unwrap_or_else(|| metered(expected)),
            _ => args.exposure.ok_or_else(|| {
                let why = "one picture is linear light and one is shown: --exposure must say how that was exposed";
                Failure::usage(why).with_hint("and --tonemap which tone mapper it has, unless that is neutral")
            })?,
        };
        Ok(Self { actual, expected, ev100, tonemap: args.tonemap.unwrap_or_default() })
    }

    pub fn size(&self) -> [u32; 2] {
        self.expected.size()
    }

    /// Returns true if both pictures are linear light.
    pub fn is_light(&self) -> bool {
        matches!((&self.actual, &self.expected), (ImageFile::Light(_), ImageFile::Light(_)))
    }

    /// The EV100 at which light is exposed; `None` if both pictures are as shown.
    pub fn exposure(&self) -> Option<f32> {
        let shown = matches!((&self.actual, &self.expected), (ImageFile::Shown(_), ImageFile::Shown(_)));
        (!shown).then_some(self.ev100)
    }

    pub fn tonemap(&self) -> Tonemap {
        self.tonemap
    }

    /// Both pictures in exposed light, where both are light.
    fn exposed(&self) -> Option<[LinearImage; 2]> {
        let (ImageFile::Light(actual), ImageFile::Light(expected)) = (&self.actual, &self.expected) else {
            return None;
        };
        let scale = f64::from(exposure_scale(self.ev100));
        Some([actual, expected].map(|image| image.scaled(scale)))
    }

    pub fn compare(&self) -> Result<Comparison, Failure> {
        let failed = |error: Mismatch| Failure::new(Exit::BadInput, error.to_string());
        let light = self.exposed().map(|[actual, expected]| errors(&actual, &expected)).transpose().map_err(failed)?;
        let [actual, expected] = [&self.actual, &self.expected].map(|image| image.shown(self.ev100, self.tonemap));
        Ok(Comparison {
            light,
            shown: shown_errors(&actual, &expected).map_err(failed)?,
            #[cfg(feature = "report")]
            flip: flip(&actual, &expected).map_err(failed)?,
            actual_not_finite: not_finite(&self.actual),
            expected_not_finite: not_finite(&self.expected),
        })
    }

    /// Each channel's difference about a middle grey, up to full at the 99.9th percentile of its absolute value, or at the largest where
    /// that is 0; in exposed light where both pictures are light, else as shown. Pixels that are not finite are magenta.
    pub fn signed_difference(&self, comparison: &Comparison) -> Vec<[u8; 3]> {
        let difference = comparison.light.as_ref().unwrap_or(&comparison.shown);
        let full = [difference.p99_9, difference.max, 1.0].into_iter().find(|full| *full > 0.0).unwrap_or(1.0);
        let code = |a: f64, b: f64| (128.0 + 127.0 * ((a - b) / full).clamp(-1.0, 1.0)).round() as u8;
        let colored = |(a, b): ([f64; 3], [f64; 3])| match a.iter().chain(&b).all(|sample| sample.is_finite()) {
            true => std::array::from_fn(|channel| code(a[channel], b[channel])),
            false => [255, 0, 255],
        };
        match self.exposed() {
            Some([actual, expected]) => actual.pixels.into_iter().zip(expected.pixels).map(colored).collect(),
            None => {
                let [actual, expected] =
                    [&self.actual, &self.expected].map(|image| image.shown(self.ev100, self.tonemap).pixels);
                let unit = |pixel: [u8; 3]| pixel.map(|code| f64::from(code) / 255.0);
                actual.into_iter().map(unit).zip(expected.into_iter().map(unit)).map(colored).collect()
            }
        }
    }
}

fn not_finite(picture: &ImageFile) -> usize {
    let ImageFile::Light(image) = picture else { return 0 };
    image.pixels.iter().filter(|pixel| pixel.iter().any(|sample| !sample.is_finite())).count()
}

/// The EV100 at which the mean luminance is [`MID_TONE`] of the luminance that saturates the sensor; 0 for a picture without light.
fn metered(expected: &LinearImage) -> f32 {
    let ev100 = (expected.mean_luminance() / (1.2 * MID_TONE)).log2();
    if ev100.is_finite() { ev100.clamp(-100.0, 100.0) as f32 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_exposure_makes_the_mean_a_mid_tone_whatever_the_unit() {
        for nits in [1e-6, 0.3, 5000.0, 1e20] {
            let image = LinearImage { size: [2, 1], pixels: vec![[nits; 3], [3.0 * nits; 3]] };
            let exposed = image.scaled(f64::from(exposure_scale(metered(&image)))).mean_luminance();
            assert!((exposed / MID_TONE - 1.0).abs() < 1e-4, "{nits}: {exposed}");
        }
        for dark in [0.0, -1.0, f64::NAN] {
            assert_eq!(metered(&LinearImage { size: [1, 1], pixels: vec![[dark; 3]] }), 0.0);
        }
    }
}
