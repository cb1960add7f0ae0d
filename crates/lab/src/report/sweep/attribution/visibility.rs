//! The share of each light that a frame's shadow maps let through, measured: the light alone, with shadows and without.

use glam::DVec3;

use super::device::{PixelCapture, without_emission};
use afterlight::frame::{self, Renderer};
use afterlight::scene::{Environment, Light, Output, Scene, Settings, ShadowSettings};

/// So dark that nothing is seen of it, and yet a light: maps and pipelines stay as they are.
const DIMMED: f32 = 1e-30;

/// For each of `lights`, by index in the scene: its share at each chosen pixel, 0 to 1; `None` where it adds nothing.
///
/// # Errors
/// When the device fails.
pub fn measured(
    drawing: &PixelCapture,
    settings: &Settings,
    lights: &[usize],
) -> Result<Vec<Vec<Option<f64>>>, frame::Error> {
    if lights.is_empty() {
        return Ok(Vec::new());
    }
    let scene = Scene { environment: Environment::default(), ..without_emission(drawing.scene) };
    let drawing = PixelCapture { scene: &scene, ..*drawing };
    let renderer = |enabled| {
        let shadows = ShadowSettings { enabled, ..settings.shadows };
        // The cut-off is for all lights of a picture of 8 bits; a light alone would have another.
        let linear = Settings { output: Output::Nits, light_cutoff: false, shadows, ..settings.clone() };
        Renderer::new(drawing.device, &scene, &linear)
    };
    let (mut shadowed, mut whole) = (renderer(settings.shadows.enabled)?, renderer(false)?);
    let share = |(shadowed, whole): (DVec3, DVec3)| {
        let arrives = whole.element_sum();
        (arrives > 0.0).then(|| shadowed.element_sum() / arrives)
    };
    lights
        .iter()
        .map(|&light| {
            let with = alone(&drawing, &mut shadowed, light)?;
            let without = alone(&drawing, &mut whole, light)?;
            Ok(with.into_iter().zip(without).map(share).collect())
        })
        .collect()
}

/// A picture of one light. All others are dimmed.
fn alone(drawing: &PixelCapture, renderer: &mut Renderer, chosen: usize) -> Result<Vec<DVec3>, frame::Error> {
    let mut scene = drawing.scene.clone();
    for (index, light) in drawing.scene.lights.iter().enumerate() {
        if index != chosen && light.intensity > DIMMED {
            renderer.set_light(&mut scene, index, &Light { intensity: DIMMED, ..light.clone() })?;
        }
    }
    renderer.set_light(&mut scene, chosen, &drawing.scene.lights[chosen])?;
    drawing.read(renderer)
}
