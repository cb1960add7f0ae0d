//! Compares the mean light of a whole picture with a truth of many samples: for detail that a single sample a pixel cannot resolve.

use std::sync::Arc;

use super::StressError;
use super::comparison::ReferenceComparison;
use super::pixel_errors::{Errors, PicturePair, Subject};
use afterlight::gpu::Device;
use afterlight::scene::Scene;
use afterlight_truth::reference::{Mode, TruthOptions};

/// Samples of the truth, in each pixel.
const SAMPLES: u32 = 64;

/// Draws the subject. Both errors are the error of the mean light, relative to the brightest channel of the true mean.
///
/// # Errors
/// A lost device, and a subject that a plan refuses.
pub fn compare(device: &Arc<Device>, subject: &Subject, truth: &Scene) -> Result<(Errors, PicturePair), StressError> {
    let ReferenceComparison { drawn: light, reference, eye, exposure, .. } =
        ReferenceComparison::of(device, subject, truth, None)?;
    let options = TruthOptions::of(Mode::Converged { samples: SAMPLES });
    let rays = reference.render(&eye, &options, &|_, _| {}).with_spread_light(&subject.decided());
    let pixels = light.as_chunks::<4>().0;
    let count = pixels.len() as f64;
    let drawn = [0, 1, 2].map(|channel| pixels.iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>() / count);
    let expected =
        [0, 1, 2].map(|channel| rays.radiance.iter().map(|pixel| pixel[channel]).sum::<f64>() * exposure / count);
    let brightest = expected.iter().fold(0.0f64, |most, &channel| most.max(channel));
    if !(brightest > 0.0 && brightest.is_finite()) {
        return Err(StressError::Refused("the truth shows no light".into()));
    }
    let differences = drawn.iter().zip(expected).map(|(drawn, expected)| (drawn - expected).abs());
    let error = differences.fold(0.0, f64::max) / brightest;
    let values = || pixels.iter().flat_map(|pixel| &pixel[..3]);
    let errors = Errors {
        worst: error,
        mean: error,
        compared: pixels.len(),
        not_finite: values().filter(|value| !value.is_finite()).count(),
        negative: values().filter(|value| **value < 0.0).count(),
        ..Errors::default()
    };
    let drawn = pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    let expected = rays.radiance.iter().map(|light| light.map(|channel| channel * exposure)).collect();
    Ok((errors, PicturePair { size: eye.size, drawn, expected }))
}
