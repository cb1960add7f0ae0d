//! `afterlight render --transparent`: a picture without its background. It is drawn before black and before white; the share of the white that shows
//! is the transmittance of the surfaces.

use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::{Picture, Pixels, Renderer};
use afterlight::gpu::Device;
use afterlight::scene::{Output, Pose, View, ev100_of, exposure_scale, remove_ground};
use afterlight_truth::reference::tonemap::{decode_srgb, encode_srgb, tone_map};
use glam::{DVec3, Vec3};

use super::path::go_to;
use super::{Args, RenderOutput, costs, heading, settings};
use crate::failure::Failure;
use crate::progress;
use crate::table::{TextTable, milliseconds};
use crate::workload::{Workload, milliseconds_since};

/// Draws and writes the picture with its opacity.
pub fn draw(
    (args, scene): (&Args, &str),
    mut workload: Workload,
    device: &Arc<Device>,
    view: Option<View>,
    is_verbose: bool,
) -> Result<RenderOutput, Failure> {
    let mut settings = settings(args, &workload, device, view)?;
    let exposure = ev100_of(&workload.scene.at(&workload.playing), &settings);
    let is_linear = settings.output == Output::Nits;
    settings.exposure = settings.exposure.or((!is_linear).then_some(exposure));
    remove_ground(&mut workload.scene);
    if let Some(sky) = &mut workload.scene.sky {
        sky.shown = false;
    }
    let text = heading(&workload, &settings, device, &args.output.sink.to_string());
    let start = Instant::now();
    let bar = progress::bar("drawing".into(), 2, args.quiet);
    // As bright as white in the picture, so that an 8-bit difference has all steps.
    let white = 1.0 / exposure_scale(exposure);
    let mut pictures = Vec::new();
    let mut told = None;
    for nits in [0.0, white] {
        workload.scene.environment.background = Vec3::splat(nits);
        let renderer = Renderer::new(device, &workload.scene, &settings);
        let mut renderer = renderer.map_err(|error| workload.blame(error, &device.physical, &settings))?;
        if let Some(what) = renderer.plan().shines_beyond_surfaces() {
            let why = format!("--transparent does not go with {what}, which is seen where no surface is");
            return Err(Failure::usage(why));
        }
        workload.warn(renderer.plan())?;
        let mut pose = Pose::default();
        pictures
            .push(renderer.picture_while(|renderer, seconds| go_to(seconds, renderer, &workload, &mut pose), || {})?);
        bar.step();
        told = Some(renderer);
    }
    drop(bar);
    let [Picture { size, pixels: Pixels::Srgb8(_) | Pixels::LinearF32(_) }, _] = pictures.as_slice() else {
        return Err(Failure::usage("--transparent drew no picture"));
    };
    let pixels = match (&pictures[0].pixels, &pictures[1].pixels) {
        (Pixels::Srgb8(black), Pixels::Srgb8(before_white)) => {
            let shown = tone_map::<f64>(DVec3::ONE, settings.tonemap);
            Pixels::Srgb8(codes(black, before_white, shown))
        }
        (Pixels::LinearF32(black), Pixels::LinearF32(before_white)) => {
            Pixels::LinearF32(light(black, before_white, white))
        }
        _ => return Err(Failure::usage("--transparent drew pictures of two kinds")),
    };
    args.output.write_with_alpha(&Picture { size: *size, pixels })?;
    let mut times = TextTable::with_figures_from(1);
    times.row(["load".to_owned(), milliseconds(workload.load_ms)]);
    times.row(["two pictures, with set-up".to_owned(), milliseconds(milliseconds_since(start))]);
    let costs = told.map_or_else(String::new, |own| costs((args, scene), own.plan(), &times, device, is_verbose));
    Ok(RenderOutput { text: text + &costs, hazards: Vec::new(), files: Vec::new() })
}

/// The opacity of a pixel, from its colours before black and before a background of the given light.
fn opacity(black: DVec3, before_white: DVec3, white: DVec3) -> f64 {
    (1.0 - ((before_white - black) / white).element_sum() / 3.0).clamp(0.0, 1.0)
}

/// Returns pixels with the colour of the surface alone, not times alpha, as PNG has it.
fn codes(black: &[u8], before_white: &[u8], white: DVec3) -> Vec<u8> {
    let decoded = |[r, g, b, _]: [u8; 4]| DVec3::from([r, g, b].map(|code| decode_srgb(f64::from(code) / 255.0)));
    let code = |value: f64| (encode_srgb(value.clamp(0.0, 1.0)) * 255.0).round() as u8;
    // White is compared as it is shown: as a code.
    let white = DVec3::from(white.to_array().map(|value| decode_srgb(f64::from(code(value)) / 255.0)));
    let pairs = black.as_chunks::<4>().0.iter().zip(before_white.as_chunks::<4>().0);
    let pixel = |(&black, &before_white): (&[u8; 4], &[u8; 4])| {
        let [r, g, b, _] = black;
        if black == before_white {
            return [r, g, b, 255];
        }
        let own = decoded(black);
        let alpha = opacity(own, decoded(before_white), white);
        let [r, g, b] = if alpha > 0.0 { (own / alpha).to_array().map(code) } else { [0; 3] };
        [r, g, b, (alpha * 255.0).round() as u8]
    };
    pairs.flat_map(pixel).collect()
}

/// Returns pixels whose light is multiplied by the opacity, as OpenEXR has it.
fn light(black: &[f32], before_white: &[f32], white: f32) -> Vec<f32> {
    let wide = |[r, g, b, _]: [f32; 4]| Vec3::new(r, g, b).as_dvec3();
    let white = DVec3::splat(f64::from(white));
    let pairs = black.as_chunks::<4>().0.iter().zip(before_white.as_chunks::<4>().0);
    let pixel = |(&black, &before_white): (&[f32; 4], &[f32; 4])| {
        let [r, g, b, _] = black;
        [r, g, b, opacity(wide(black), wide(before_white), white) as f32]
    };
    pairs.flat_map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_half_covered_keeps_the_colour_of_its_surface() {
        let code = |value: f64| (encode_srgb(value) * 255.0).round() as u8;
        let [surface, white] = [0.6, 0.9];
        let (black, shown) = (code(0.5 * surface), code(0.5 * surface + 0.5 * white));
        let own = codes(&[black, black, black, 255], &[shown, shown, shown, 255], DVec3::splat(white));
        assert!(own[3].abs_diff(128) <= 2 && own[0].abs_diff(code(surface)) <= 2, "{own:?}");
    }

    #[test]
    fn a_covered_pixel_keeps_its_code_and_an_empty_one_is_clear() {
        let white = code_of_white();
        let own =
            codes(&[9, 200, 31, 255, 0, 0, 0, 255], &[9, 200, 31, 255, white, white, white, 255], DVec3::splat(0.9));
        assert_eq!(own, [9, 200, 31, 255, 0, 0, 0, 0]);
        let linear = light(&[2.0, 3.0, 4.0, 1.0, 0.0, 0.0, 0.0, 1.0], &[2.0, 3.0, 4.0, 1.0, 7.0, 7.0, 7.0, 1.0], 7.0);
        assert_eq!(linear, [2.0, 3.0, 4.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    }

    fn code_of_white() -> u8 {
        (encode_srgb(0.9) * 255.0).round() as u8
    }
}
