//! A frame with all that was found out about it, and each of its pixels taken apart.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::device::Captured;
use super::formats::Formats;
use super::parts::{LightVisibility, PixelMeasurements, PixelSurface, SWITCHES, Shades};
use super::{AttributedFrame, TruthPair, illumination, place, sky};
use afterlight::scene::{Settings, counted};
use afterlight_truth::reference::tonemap::input_referred;
use afterlight_truth::reference::{ShadingPoint, Smith, TriangleId, Truth};

pub const CUT_OFF: &str = "light cut-off";
pub const OTHER_TRIANGLE: &str = "other triangle";
pub const TRANSPARENT: &str = "transparent surfaces";
pub const SAMPLING: &str = "sampling";
pub const NOT_EXPLAINED: &str = "not explained";

/// The greatest relative difference of a surface's light from the truth's picture where nothing is before the surface: both are sums in f64.
const SAME: f64 = 1e-9;

pub(super) struct Decomposition<'a> {
    pub subject: &'a AttributedFrame<'a>,
    pub truths: &'a TruthPair<'a>,
    pub settings: &'a Settings,
    pub captured: &'a Captured,
    /// The measured share of each light that arrives at each chosen pixel, by light.
    pub measured: BTreeMap<usize, Vec<Option<f64>>>,
    pub exposure: f64,
}

/// The parts after the switches, in the order of [`notes`].
const CUT_OFF_PART: usize = SWITCHES.len();
const SKY_PART: usize = CUT_OFF_PART + 1;
const OTHER_TRIANGLE_PART: usize = CUT_OFF_PART + 2;
const TRANSPARENT_PART: usize = CUT_OFF_PART + 3;
const SAMPLING_PART: usize = CUT_OFF_PART + 4;
const NOT_EXPLAINED_PART: usize = CUT_OFF_PART + 5;
pub(super) const COUNT: usize = CUT_OFF_PART + 6;

/// The signed parts of a pixel, exposed, in the order of [`notes`].
type Parts = [DVec3; COUNT];

/// A pixel's error, exposed, and its parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct AttributedPixel {
    pub parts: Parts,
    /// The device's light minus the converged truth.
    pub light: DVec3,
    /// The difference that the picture makes to the light, referred back. Added to `light` it is the whole, found without the parts.
    pub output: DVec3,
}

/// Returns the name and a description of each part.
pub(super) fn notes(captured: &Captured, lights_left_out: usize) -> [(&'static str, String); COUNT] {
    let [textures, gbuffer, position, shadows, arithmetic, hdr, output] = SWITCHES;
    let shadow_note = match lights_left_out {
        0 => "shares of light by shadow maps in place of rays".into(),
        count => format!(
            "shares of light by shadow maps in place of rays; {} with a shadow not measured and not explained",
            counted(count, "more light")
        ),
    };
    let triangle_note = match captured.triangles {
        Some(_) => "all error where raster and truth see different triangles",
        None => "all error where raster and truth see different places: this device does not number triangles",
    };
    [
        (textures, "textures filtered and values interpolated by the device".into()),
        (gbuffer, "normal, albedo, metallic, roughness and occlusion as the G-buffer rounds them".into()),
        (position, "place of the surface as it is rebuilt or stored".into()),
        (shadows, shadow_note),
        (arithmetic, "the light model in 32 bits on the CPU; how the device differs from that is not explained".into()),
        (hdr, "light as its target rounds it, at each step that is added".into()),
        (output, "the picture against the tone-mapped light, referred back to light".into()),
        (CUT_OFF, "lights that are left out from where they bring less than half a step of the output".into()),
        (sky::NAME, sky::NOTE.into()),
        (OTHER_TRIANGLE, triangle_note.into()),
        (TRANSPARENT, "all error where something transparent is before the surface".into()),
        (SAMPLING, "one sample in the middle of the pixel in place of all of it".into()),
        (NOT_EXPLAINED, "what is left: the device against the model of all parts together".into()),
    ]
}

pub(super) fn whole_note(not_finite: usize) -> String {
    match not_finite {
        0 => "the device's picture against the converged truth".into(),
        count => {
            format!("the device's picture against the converged truth; without {}, not finite", counted(count, "pixel"))
        }
    }
}

impl Decomposition<'_> {
    /// The error of chosen pixel number `at`.
    pub fn pixel(&self, at: usize, pixel: usize, surface: Option<&(ShadingPoint, TriangleId)>) -> AttributedPixel {
        let truth = |truth: &Truth| DVec3::from(truth.radiance[pixel]) * self.exposure;
        let (point, converged) = (truth(self.truths.point), truth(self.truths.converged));
        let exposed = self.captured.exposed[at];
        let output = input_referred(exposed, self.captured.shown[at], self.settings.tonemap);
        let mut parts = self.apart(at, pixel, surface, point);
        parts[SAMPLING_PART] = point - converged;
        AttributedPixel { parts, light: exposed - converged, output }
    }

    /// Takes apart the difference between the point truth and the picture.
    fn apart(&self, at: usize, pixel: usize, surface: Option<&(ShadingPoint, TriangleId)>, point: DVec3) -> Parts {
        let mut parts = [DVec3::ZERO; COUNT];
        let exposed = self.captured.exposed[at];
        let output = input_referred(exposed, self.captured.shown[at], self.settings.tonemap);
        if !self.sees_the_same(at, surface) {
            parts[OTHER_TRIANGLE_PART] = exposed + output - point;
            return parts;
        }
        let of_sky = self.light_of_sky(pixel);
        let shades = self.shades(at, pixel, surface.map(|(surface, _)| surface), of_sky);
        // A transparent surface before it is in the truth's picture, but not in the surface's light.
        let apart = (shades.truth() - point).abs().max_element();
        if apart > SAME * point.abs().max_element() {
            parts[TRANSPARENT_PART] = exposed + output - point;
            return parts;
        }
        let unrounded = self.captured.unrounded.as_ref().map_or(exposed, |unrounded| unrounded[at]);
        let uncut = self.captured.uncut.as_ref().map_or(unrounded, |uncut| uncut[at]);
        let formats = Formats {
            hdr: self.captured.unrounded.is_some().then_some(self.settings.hdr_format),
            output: Some(self.settings.tonemap),
        };
        let measured = PixelMeasurements { unrounded, hdr: exposed - unrounded, output };
        parts[..CUT_OFF_PART].copy_from_slice(&shades.apart(&formats, &measured));
        parts[CUT_OFF_PART] = unrounded - uncut;
        // The sky's own light is all that differs from a frame without it.
        if let Some(without) = &self.captured.without_sky {
            let on_device = if surface.is_some() { uncut - without[at] } else { uncut - shades.all() };
            parts[SKY_PART] = on_device - of_sky;
        }
        parts[NOT_EXPLAINED_PART] = uncut - shades.all() - parts[SKY_PART];
        parts
    }

    /// The surface's light by the parts at work, exposed.
    fn shades(&self, at: usize, pixel: usize, surface: Option<&ShadingPoint>, of_sky: DVec3) -> Shades {
        let AttributedFrame { reference, view, .. } = self.subject;
        let Some(truth) = surface else {
            let background =
                DVec3::from(reference.light(view, Smith::default(), place(view, pixel), place(view, pixel)));
            return Shades([background * self.exposure; _]);
        };
        let mut shares =
            Shares { decomposition: self, at, place: place(self.subject.view, pixel), exact: BTreeMap::new() };
        let seen = PixelSurface { truth, own: &self.captured.own[at], unquantized: &self.captured.unquantized[at] };
        let nits = seen.shades(&illumination(self.subject), &mut shares);
        Shades(nits.0.map(|nits| nits * self.exposure + of_sky))
    }

    fn sees_the_same(&self, at: usize, surface: Option<&(ShadingPoint, TriangleId)>) -> bool {
        let device = self.captured.unquantized[at].position;
        match (&self.captured.triangles, surface) {
            (Some(triangles), surface) => triangles[at] == surface.map(|&(_, triangle)| triangle),
            (None, None) => device == DVec3::ZERO,
            // A thousandth of the distance.
            (None, Some((surface, _))) => device.distance(surface.position) < 1e-3 * surface.position.length(),
        }
    }
}

/// The shares of lights in a pixel: exact shares by rays, each cast once, and the measured shares.
struct Shares<'a> {
    decomposition: &'a Decomposition<'a>,
    at: usize,
    place: DVec2,
    exact: BTreeMap<usize, f64>,
}

impl LightVisibility for Shares<'_> {
    fn exact(&mut self, light: usize) -> f64 {
        let AttributedFrame { reference, view, .. } = self.decomposition.subject;
        *self.exact.entry(light).or_insert_with(|| reference.visibility(view, self.place, light))
    }

    fn measured(&mut self, light: usize) -> f64 {
        let measured = self.decomposition.measured.get(&light).and_then(|shares| shares[self.at]);
        measured.unwrap_or_else(|| self.exact(light))
    }
}
