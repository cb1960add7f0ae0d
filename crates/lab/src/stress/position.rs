//! Holds the places that the G-buffer stores, or from which they are rebuilt, against the truth.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::comparison::ReferenceComparison;
use super::pixel_errors::{Errors, PicturePair, Subject};
use super::{StressError, grid};
use afterlight::gpu::Device;
use afterlight::scene::{Scene, View};
use afterlight_truth::reference::{ShadingPoint, TriangleId};

/// Draws the subject's places. Errors are distances between the place and the true one, over that one's distance from the camera.
///
/// # Errors
/// A lost device, and a subject that a plan refuses.
pub fn compare(device: &Arc<Device>, subject: &Subject, truth: &Scene) -> Result<(Errors, PicturePair), StressError> {
    let ReferenceComparison { pictures, drawn: places, reference, eye, .. } =
        ReferenceComparison::of(device, subject, truth, Some(View::Position))?;
    let [width, height] = eye.size;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)));
    let half_step = grid::half_step(device);
    let allowance = pixels.clone().map(|pixel| grid::place_allowance(half_step, &reference, &eye, pixel));
    let allowance: Vec<f64> = allowance.collect();
    let expected: Vec<_> = pixels.map(|pixel| reference.surface(&eye, pixel)).collect();
    let triangles: Vec<_> = expected.iter().map(|seen| seen.map(|(_, triangle, _)| triangle)).collect();
    let elsewhere = pictures.elsewhere(&triangles)?;
    let mut errors = Errors::default();
    let mut sum = 0.0;
    let pixels = places.as_chunks::<4>().0.iter().zip(&expected).zip(elsewhere).zip(allowance);
    for (((place, seen), elsewhere), allowance) in pixels {
        errors.not_finite += place.iter().filter(|value| !value.is_finite()).count();
        errors.elsewhere += usize::from(elsewhere);
        let Some((surface, _, _)) = seen.filter(|_| !elsewhere) else { continue };
        let place = DVec3::new(f64::from(place[0]), f64::from(place[1]), f64::from(place[2]));
        let error = (place.distance(surface.position) - allowance).max(0.0) / surface.position.length();
        errors.compared += 1;
        sum += error;
        errors.worst = errors.worst.max(error);
    }
    errors.mean = sum / errors.compared.max(1) as f64;
    let drawn = places.as_chunks::<4>().0.iter().map(|&[x, y, z, _]| [x, y, z]).collect();
    let place = |seen: &Option<(ShadingPoint, TriangleId, f64)>| {
        seen.map_or([0.0; 3], |(surface, ..)| surface.position.to_array())
    };
    let expected = expected.iter().map(place).collect();
    Ok((errors, PicturePair { size: eye.size, drawn, expected }))
}
