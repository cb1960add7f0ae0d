//! The parts of a frame's error by their causes: signed, in exposed linear light, pixel by pixel.
//!
//! The error of a pixel is the device's picture minus the converged truth. The parts add up to it.
//!
//! Seven of them are switched one by one, in all 128 combinations, and averaged over all orders by [`shapley`](fn@shapley):
//! - the surface as the device filters and interpolates it (*texture filtering*), as its G-buffer rounds it (*G-buffer quantization*),
//!   *position from depth*, and the shares of light that its shadow maps let through (*shadows*), each between the truth and the
//!   measurement on the device at hand;
//! - 32 bits in place of 64 (*BRDF arithmetic*): the reference's own formulas on the CPU, modelled and not measured;
//! - *HDR format*: the rounding of light by the frame's own light target, against one of 32 bits; and *tone mapping and 8-bit output*: the
//!   difference of the picture from the tone-mapped light, referred back through the curve
//!   ([`input_referred`](afterlight_truth::reference::tonemap::input_referred)). Both are measured for the light that the device has, and for
//!   all others modelled (`formats`); the driver's deviation from the model is added to these parts.
//!
//! The others are differences at the ends of the chain, of which there is one order:
//! - *sampling*: the point truth minus the converged one, which is the error of one sample a pixel;
//! - *light of the sky*: the surfaces' light of a sky that lights the scene, on the device against rays, and the sky that is seen;
//! - *light cut-off*: the light that lights would have added that are left out where they are weak, with everything else at work;
//! - *not explained*: the difference of the device's light from the model with everything at work. It should be small.
//!
//! If raster and truth see different triangles, or something transparent is before the surface, all of the pixel's error but sampling is a
//! part by itself.
//!
//! Limits: frames of one sample a pixel (samples, `msaa`, `taa`, `fxaa`, `bloom`, `fog` and `reflections` are set aside), whose textures are filtered for a whole pixel: the frames of a
//! picture of several samples filter for a part of it, so that they have less of that error. Ks of the Phong models is taken to be stored
//! exactly: its rounding is found under *not explained*.

mod decomposition;
mod device;
mod formats;
mod parts;
mod pixels;
mod shapley;
mod sky;
mod tally;
mod visibility;

pub use decomposition::{CUT_OFF, NOT_EXPLAINED, OTHER_TRIANGLE, SAMPLING, TRANSPARENT};
pub use device::Captured;
pub use parts::{HDR, OUTPUT, SWITCHES};
pub use shapley::shapley;
pub use tally::WHOLE;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::report::sweep::model::Attribution;
use afterlight::frame;
use afterlight::gpu::Device;
use afterlight::plan::effects;
use afterlight::scene::{Scene, Settings, ev100_of, exposure_scale};
use afterlight_truth::reference::light::{Illumination, radiance};
use afterlight_truth::reference::{CameraView, Reference, ShadingPoint, Smith, TriangleId, Truth};
use decomposition::Decomposition;
use device::PixelCapture;
use tally::Tally;

/// A frame that is to be taken apart.
#[derive(Clone, Copy)]
pub struct AttributedFrame<'a> {
    pub scene: &'a Scene,
    /// The reference for the same scene, with the BRDF that the settings ask for.
    pub reference: &'a Reference<'a>,
    pub settings: &'a Settings,
    pub view: &'a CameraView,
    /// The point's index in the report.
    pub point: usize,
}

/// The truths of the subject's view.
#[derive(Clone, Copy)]
pub struct TruthPair<'a> {
    pub point: &'a Truth,
    pub converged: &'a Truth,
}

/// Limits of the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttributionLimits {
    /// About how many pixels are taken apart, spread over the picture.
    pub pixels: usize,
    /// The number of lights whose shadows are measured. Lights that reach the most pixels come first.
    pub shadowed_lights: usize,
}

impl Default for AttributionLimits {
    fn default() -> Self {
        Self { pixels: 20_000, shadowed_lights: 8 }
    }
}

/// Takes a frame apart. Draws it some 15 times, with other outputs, and each shadowed light twice.
///
/// # Errors
/// When the frame cannot be planned on the device, or it fails.
pub fn attribute(
    device: &Arc<Device>,
    subject: &AttributedFrame,
    truths: &TruthPair,
    limits: &AttributionLimits,
) -> Result<Attribution, frame::Error> {
    let settings = one_sample(subject);
    let pixels = pixels::spread(subject.view.size, limits.pixels);
    let drawing = PixelCapture { device, scene: subject.scene, view: subject.view, pixels: &pixels };
    let captured = drawing.capture(&settings)?;
    let surfaces: Vec<_> = pixels.par_iter().map(|&pixel| seen(subject, pixel)).collect();
    let lights = shadowed_lights(subject, &surfaces);
    let (chosen, rest) = lights.split_at(lights.len().min(limits.shadowed_lights));
    let shares = visibility::measured(&drawing, &settings, chosen)?;
    let decomposition = Decomposition {
        subject,
        truths,
        settings: &settings,
        captured: &captured,
        measured: chosen.iter().copied().zip(shares).collect(),
        exposure: f64::from(exposure_scale(ev100_of(subject.scene, &settings))),
    };
    let apart = |(at, surface)| decomposition.pixel(at, pixels[at], surface);
    let rows: Vec<_> = surfaces.par_iter().map(Option::as_ref).enumerate().map(apart).collect();
    let mut tally = Tally::default();
    rows.iter().for_each(|pixel| tally.add(pixel));
    let notes = decomposition::notes(&captured, rest.len());
    let mut rows = tally.rows(&notes, decomposition::whole_note(rows.len() - tally.pixels));
    if captured.without_sky.is_none() {
        rows.retain(|row| row.name != sky::NAME);
    }
    let of_pixels = subject.view.size.map(|edge| edge as usize).iter().product();
    let light_rms = tally.light_rms();
    Ok(Attribution { point: subject.point, parts: rows, light_rms, pixels: tally.pixels, of_pixels })
}

/// The frame that is taken apart.
fn one_sample(subject: &AttributedFrame) -> Settings {
    Settings { samples: 1, msaa: 1, size: subject.view.size, ..effects::set_aside(subject.settings) }
}

fn place(view: &CameraView, pixel: usize) -> DVec2 {
    let width = view.size[0] as usize;
    DVec2::new((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5)
}

fn seen(subject: &AttributedFrame, pixel: usize) -> Option<(ShadingPoint, TriangleId)> {
    let (surface, triangle, _) = subject.reference.surface(subject.view, place(subject.view, pixel))?;
    Some((surface, triangle))
}

fn illumination<'a>(subject: &AttributedFrame<'a>) -> Illumination<'a> {
    let Scene { lights, environment, .. } = subject.scene;
    Illumination {
        lights,
        environment,
        eye: subject.view.camera.position,
        open: 1.0,
        open_behind: 1.0,
        sky: None,
        smith: Smith::default(),
    }
}

/// Lights with shadows that add something to a chosen pixel. Lights that add something to the most pixels come first.
fn shadowed_lights(subject: &AttributedFrame, surfaces: &[Option<(ShadingPoint, TriangleId)>]) -> Vec<usize> {
    let mut reached: BTreeMap<usize, usize> = BTreeMap::new();
    for (surface, _) in surfaces.iter().flatten() {
        radiance::<f64>(surface, &illumination(subject), &mut |light| {
            *reached.entry(light).or_default() += 1;
            DVec3::ONE
        });
    }
    let mut lights: Vec<(usize, usize)> = reached.into_iter().collect();
    lights.sort_by_key(|&(light, pixels)| (std::cmp::Reverse(pixels), light));
    lights.into_iter().map(|(light, _)| light).collect()
}
