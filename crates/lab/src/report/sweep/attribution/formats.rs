//! A model of the effect of a frame's formats on light: the rounding by a float of few bits, and the loss by a picture of 8 bits.
//!
//! The model rounds to the nearest and once. A driver may truncate, and rounds each time that a light is added: its effect on the frame's own
//! light is measured, and the model only gives the effect's dependence on the light.

use glam::DVec3;

use afterlight::scene::{HdrFormat, Tonemap};
use afterlight_truth::reference::tonemap::{decode_srgb, encode_srgb, input_referred, tone_map};

/// Exponents of small floats end here: from there on down steps stay as they are.
const LEAST_EXPONENT: i32 = -14;

/// The formats of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Formats {
    /// The format of light until it is tone-mapped; `None` where it rounds nothing.
    pub hdr: Option<HdrFormat>,
    /// The curve by which light is shown; `None` where nothing is.
    pub output: Option<Tonemap>,
}

impl Formats {
    /// Exposed light as its target holds it.
    pub fn kept(&self, light: DVec3) -> DVec3 {
        let mantissa = match self.hdr {
            None | Some(HdrFormat::Rgba32f) => return light,
            Some(HdrFormat::Rgba16f) => [10, 10, 10],
            Some(HdrFormat::B10g11r11) => [6, 6, 5],
        };
        DVec3::from_array([0, 1, 2].map(|channel| rounded(light[channel], mantissa[channel])))
    }

    /// Exposed light as it is shown in 8 bits, referred back.
    pub fn shown(&self, light: DVec3) -> DVec3 {
        let Some(curve) = self.output else { return light };
        // The correction of the model's light to the device's may take it below 0 by a rounding.
        let exposed = light.max(DVec3::ZERO);
        let codes = tone_map::<f64>(exposed, curve).to_array().map(|shown| (encode_srgb(shown) * 255.0).round());
        light + input_referred(exposed, DVec3::from_array(codes.map(|code| decode_srgb(code / 255.0))), curve)
    }
}

/// Rounds to the nearest number with `mantissa` bits after the leading one.
fn rounded(value: f64, mantissa: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let exponent = (value.abs().log2().floor() as i32).max(LEAST_EXPONENT);
    let step = f64::from(exponent - mantissa).exp2();
    (value / step).round_ties_even() * step
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_floats_have_their_steps() {
        let half = Formats { hdr: Some(HdrFormat::Rgba16f), output: None };
        for (light, kept) in [
            (1.0004, 1.0),
            (1.0006, 1.0 + 1.0 / 1024.0),
            (1.9999, 2.0),
            (0.1, 0.099975585937),
            (2.9e-8, 0.0),
            (4e-8, 2f64.powi(-24)),
        ] {
            let found = half.kept(DVec3::splat(light)).x;
            assert!((found - kept).abs() < 1e-12, "{light}: {found}, not {kept}");
        }
        let packed = Formats { hdr: Some(HdrFormat::B10g11r11), output: None };
        assert_eq!(packed.kept(DVec3::splat(1.02)), DVec3::new(1.0 + 1.0 / 64.0, 1.0 + 1.0 / 64.0, 1.0 + 1.0 / 32.0));
        let single = Formats { hdr: Some(HdrFormat::Rgba32f), output: None };
        assert_eq!(single.kept(DVec3::splat(0.1)), DVec3::splat(0.1));
    }

    #[test]
    fn a_picture_leaves_light_to_half_a_code() {
        let shown = Formats { hdr: None, output: Some(Tonemap::None) };
        for light in [0.0, 0.001, 0.2, 0.5, 0.9] {
            let found = shown.shown(DVec3::splat(light)).x;
            let code = |light: f64| encode_srgb(light) * 255.0;
            assert!((code(found) - code(light).round()).abs() < 1e-3, "{light}: {found}");
        }
        assert_eq!(Formats { hdr: None, output: None }.shown(DVec3::ONE), DVec3::ONE);
        // Too bright to be told, and shown so.
        assert_eq!(shown.shown(DVec3::splat(5.0)), DVec3::splat(5.0));
    }
}
