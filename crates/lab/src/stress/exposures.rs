//! Draws many frames of one renderer while its exposure changes, and holds them against the first.

use std::sync::Arc;

use super::StressError;
use super::pixel_errors::{Errors, FLOOR, PicturePair, Subject, saturation};
use afterlight::frame::{Pixels, Renderer};
use afterlight::gpu::Device;
use afterlight::scene::ev100_of;

/// Stops over the first exposure, in turn: light from 1e-6 to 1e6 times as bright. They are whole, so that each picture is the first one times a
/// power of two, to the last bit.
const STOPS: [i32; 7] = [20, -20, 1, -7, 13, -1, -13];

/// Frames from one read-back to the next; the frames between follow each other without a wait. Shares no factor with the number of [`STOPS`].
const LOOKED_AT: usize = 16;

/// Draws a picture, then `frames` frames of other exposures, and the picture again.
///
/// Errors are the differences of the frames that are read back, and of the last picture, from the first picture, which is scaled to their exposure
/// and cut off where the target ends. The evidence is the last picture and the first.
///
/// # Errors
/// A lost device, and a subject that a plan refuses.
pub fn compare(device: &Arc<Device>, subject: &Subject, frames: usize) -> Result<(Errors, PicturePair), StressError> {
    let settings = subject.decided();
    let (scene, camera) = (&subject.scene, &subject.scene.camera);
    let mut renderer = Renderer::new(device, scene, &settings)?;
    // Whole stops from a whole EV100 lose no digit.
    let ev100 = ev100_of(scene, &settings).round();
    let largest = saturation(renderer.plan());
    let mut errors = Errors::default();
    let first = drawn(&mut renderer, subject, ev100)?;
    for index in 0..frames {
        let stops = STOPS[index % STOPS.len()];
        renderer.set_exposure(ev100 - stops as f32)?;
        renderer.render(camera)?;
        if index % LOOKED_AT == LOOKED_AT - 1 {
            note(&mut errors, &read(&mut renderer)?, &scaled(&first, f64::from(stops).exp2(), largest));
        }
    }
    let last = drawn(&mut renderer, subject, ev100)?;
    let expected = scaled(&first, 1.0, f64::INFINITY);
    note(&mut errors, &last, &expected);
    errors.mean /= errors.compared.max(1) as f64;
    Ok((errors, PicturePair { size: settings.size, drawn: last, expected }))
}

fn drawn(renderer: &mut Renderer, subject: &Subject, ev100: f32) -> Result<Vec<[f32; 3]>, StressError> {
    renderer.set_exposure(ev100)?;
    renderer.render(&subject.scene.camera)?;
    read(renderer)
}

fn read(renderer: &mut Renderer) -> Result<Vec<[f32; 3]>, StressError> {
    Ok(match renderer.read_back()?.pixels {
        Pixels::LinearF32(rgba) => rgba.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        Pixels::Srgb8(_) => unreachable!("a subject's picture is exposed light"),
    })
}

fn scaled(light: &[[f32; 3]], factor: f64, largest: f64) -> Vec<[f64; 3]> {
    light.iter().map(|light| light.map(|channel| (f64::from(channel) * factor).min(largest))).collect()
}

/// Adds a picture's errors; `mean` becomes their sum.
fn note(errors: &mut Errors, drawn: &[[f32; 3]], expected: &[[f64; 3]]) {
    let brightest = expected.iter().flatten().fold(0.0f64, |most, &channel| most.max(channel));
    for (drawn, expected) in drawn.iter().zip(expected) {
        errors.compared += 1;
        errors.not_finite += drawn.iter().filter(|channel| !channel.is_finite()).count();
        errors.negative += drawn.iter().filter(|channel| **channel < 0.0).count();
        let own = expected.iter().fold(FLOOR * brightest, |most, &channel| most.max(channel));
        let apart = drawn.iter().zip(expected).map(|(drawn, expected)| (f64::from(*drawn) - expected).abs());
        let difference = apart.fold(0.0, f64::max);
        let error = if difference == 0.0 { 0.0 } else { difference / own };
        errors.mean += error;
        errors.worst = errors.worst.max(error);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_bit_is_an_error_and_what_is_cut_off_is_none() {
        let first = [[0.5, 1.0, 0.25], [0.0; 3]];
        let mut errors = Errors::default();
        note(&mut errors, &[[2.0, 3.0, 1.0], [0.0; 3]], &scaled(&first, 4.0, 3.0));
        assert_eq!((errors.worst, errors.mean, errors.compared), (0.0, 0.0, 2));
        note(&mut errors, &[[0.5, 1.0f32.next_up(), f32::NAN], [-1.0, 0.0, 0.0]], &scaled(&first, 1.0, 3.0));
        assert_eq!((errors.not_finite, errors.negative, errors.compared), (1, 1, 4));
        assert!(errors.worst > 0.0 && errors.mean > 0.0);
    }
}
