//! The picture of each step.

use afterlight_scene::{Brdf, Light, builtin};
use glam::DVec3;
use image::RgbaImage;

use crate::program::{FIRST_OF_NEWER, layer, start, whole, whole_if_possible};
use crate::truth::{at_frame, codes, flip_of, positions, radiance, scene, shown, sun};

/// The rows of step 11.
const ROWS: [&str; 8] = [
    "shadow-reuse",
    "shadow-to-lighting",
    "gbuffer-reuse",
    "gbuffer-to-lighting",
    "hdr-reuse",
    "hdr-to-tonemap",
    "reuse",
    "read-back",
];

/// The largest difference of a channel for each pixel, in codes, rows from the top.
fn differences(picture: &RgbaImage, expected: &[[u8; 3]]) -> Vec<u8> {
    assert_eq!(picture.pixels().len(), expected.len());
    let largest = |pixel: &image::Rgba<u8>, expected: &[u8; 3]| {
        (0..3).map(|channel| pixel[channel].abs_diff(expected[channel])).max().unwrap_or(0)
    };
    picture.pixels().zip(expected).map(|(pixel, expected)| largest(pixel, expected)).collect()
}

#[test]
fn step_00_fills_the_picture_with_one_colour() {
    let picture = whole("step-00-clear").picture;
    let expected = codes(glam::dvec3(0.05, 0.2, 0.5));
    assert_eq!(picture.dimensions(), (320, 180));
    assert!(picture.pixels().all(|pixel| pixel.0[..3] == expected && pixel[3] == 255), "expected {expected:?}");
}

#[test]
fn step_01_is_the_built_in_triangle_to_a_code() {
    let picture = whole("step-01-triangle").picture;
    let scene = builtin::open("triangle").expect("a built-in scene");
    let expected: Vec<_> = radiance(&scene, [320, 180]).into_iter().map(codes).collect();
    let most = differences(&picture, &expected).into_iter().max();
    assert!(most <= Some(1), "{most:?}");
}

/// Rasterization rounds corners to 1/256 pixel. Near the horizon a pixel is more than a metre of floor long, so the place on it moves by millimetres.
/// Measured: at most 2.8 mm, 0.003 mm in 99 of 100 pixels, and no pixel on an edge that falls to the other side.
#[test]
fn step_02_writes_positions_as_rays_find_them() {
    let path = whole("step-02-mesh").path.with_extension("f32");
    let bytes = std::fs::read(path).expect("positions");
    let floats: Vec<_> = bytes.as_chunks().0.iter().map(|bytes| f32::from_ne_bytes(*bytes)).collect();
    let (mut errors, mut elsewhere) = (Vec::new(), 0);
    for (drawn, expected) in std::iter::zip(floats.as_chunks::<4>().0, positions([320, 180])) {
        let [x, y, z, seen] = drawn.map(f64::from);
        let error = expected.map(|place| place.distance(DVec3::new(x, y, z)));
        match error {
            Some(error) if seen == 1.0 && error < 0.01 => errors.push(error),
            None if seen == 0.0 => {}
            _ => elsewhere += 1,
        }
    }
    errors.sort_by(f64::total_cmp);
    let (largest, most) = (errors[errors.len() - 1], errors[errors.len() * 99 / 100]);
    println!("measured: {largest:.1e} m, {most:.1e} m in 99%, {elsewhere} pixels elsewhere");
    assert!(largest < 4e-3 && most < 1e-5 && elsewhere <= 3);
}

/// Shapes are drawn from far to near: half of the fragments that are lit are hidden in the end. Measured: no pixel differs by more than a code.
#[test]
fn step_03_is_the_reference_and_lights_what_nobody_sees() {
    let step = whole("step-03-forward");
    let lit = lit(&step.stdout);
    let scene = scene(Brdf::Lambert);
    let radiance = radiance(&scene, [320, 180]);
    let seen = radiance.iter().filter(|radiance| **radiance != scene.environment.background.as_dvec3()).count() as u32;
    let expected: Vec<_> = radiance.into_iter().map(codes).collect();
    let differences = differences(&step.picture, &expected);
    let elsewhere = differences.iter().filter(|difference| **difference > 1).count();
    println!("measured: {elsewhere} pixels differ by more than a code, {lit} fragments lit for {seen} seen");
    assert!(elsewhere <= 3);
    assert!(lit > seen * 3 / 2);
}

/// The number of lit fragments that a step prints.
fn lit(stdout: &str) -> u32 {
    let line = stdout.lines().find(|line| line.contains("lit by 64 lights")).expect("a count");
    line.split(' ').next().and_then(|word| word.parse().ok()).expect("a number")
}

#[test]
fn step_04_draws_the_bytes_of_step_03_and_lights_what_is_seen() {
    let (forward, deferred) = (whole("step-03-forward"), whole("step-04-gbuffer"));
    assert!(forward.picture == deferred.picture);
    let sky = forward.picture.get_pixel(0, 0);
    let seen = forward.picture.pixels().filter(|pixel| *pixel != sky).count() as u32;
    assert_eq!(lit(&deferred.stdout), seen);
}

#[test]
fn step_05_draws_the_bytes_of_step_04_and_stores_nothing_else() {
    let (stored, dropped) = (whole("step-04-gbuffer"), whole("step-05-subpasses"));
    assert!(stored.picture == dropped.picture);
    assert!(dropped.stdout.contains("4 bytes stored a pixel"), "{}", dropped.stdout);
}

#[test]
fn step_05b_draws_the_bytes_of_step_04() {
    if let Some(local_read) = whole_if_possible("step-05b-local-read") {
        assert!(local_read.picture == whole("step-04-gbuffer").picture);
    }
}

/// The albedo has 8 bits a channel, as the picture has. Measured: no pixel differs by more than a code, FLIP 0.0103.
#[test]
fn step_06_draws_the_picture_of_step_05_in_a_third_of_the_bytes() {
    let (fat, lean) = (whole("step-05-subpasses").picture, whole("step-06-lean"));
    let expected: Vec<_> = fat.pixels().map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let most = differences(&lean.picture, &expected).into_iter().max().unwrap_or(0);
    let flip = flip_of(&lean.picture, expected);
    println!("measured: {most} codes, FLIP {flip:.5}");
    assert!(most <= 2 && flip < 0.02);
    assert!(lean.stdout.contains("4 bytes stored a pixel of 16"), "{}", lean.stdout);
}

/// Errors of the lean G-buffer. A normal of 2 x 16 bits is off by at most 0.0037 degrees.
#[test]
fn step_06b_measures_the_errors_of_step_06() {
    let measured = whole("step-06b-errors");
    assert!(measured.picture == whole("step-06-lean").picture);
    let error = |of: &str| {
        let line = measured.stdout.lines().find(|line| line.trim().starts_with(of)).expect("a line of the table");
        line.split_whitespace().last().and_then(|word| word.parse::<f64>().ok()).expect("a number")
    };
    println!("measured: {}", measured.stdout);
    assert!((1e-3..=3.7e-3).contains(&error("normal")));
    assert!((1e-8..=1e-5).contains(&error("distance")));
    assert!((1e-7..=1e-4).contains(&error("position")));
}

/// The highlights differ most, by the 7 bits of roughness. Measured: no pixel differs by more than 6 codes, FLIP 0.0247.
#[test]
fn step_07_is_the_reference_by_flip() {
    let picture = whole("step-07-hdr").picture;
    let expected = shown(&scene(Brdf::CookTorrance), [320, 180]);
    let most = differences(&picture, &expected).into_iter().max().unwrap_or(0);
    let flip = flip_of(&picture, expected);
    println!("measured: {most} codes, FLIP {flip:.5}");
    assert!(most <= 8 && flip < 0.035);
}

/// The filter softens the edges of shadows, which the reference has sharp. Measured: FLIP 0.0292, and 506 of 57,600 pixels differ by more than 8 codes.
#[test]
fn step_08_is_the_reference_by_flip_but_for_the_edges_of_shadows() {
    let picture = whole("step-08-shadow").picture;
    let mut scene = scene(Brdf::CookTorrance);
    scene.lights.push(sun());
    let expected = shown(&scene, [320, 180]);
    let edges = differences(&picture, &expected).into_iter().filter(|difference| *difference > 8).count();
    let flip = flip_of(&picture, expected.clone());
    println!("measured: FLIP {flip:.5}, {edges} pixels on edges");
    assert!(flip < 0.04 && edges < 700);
    // A shadow map that lay elsewhere, or nowhere, is farther off.
    scene.lights.pop();
    scene.lights.push(Light { casts_shadow: false, ..sun() });
    let without = flip_of(&picture, shown(&scene, [320, 180]));
    println!("measured: FLIP {without:.5} without shadows");
    assert!(without > 3.0 * flip);
}

/// Asserts that a picture is the reference's of a frame, by FLIP. Measured: 0.0301.
fn assert_frame(picture: &RgbaImage, number: usize) {
    let flip = flip_of(picture, shown(&at_frame(number), [160, 90]));
    println!("measured: FLIP {flip:.5} of frame {number}");
    assert!(flip < 0.04);
}

/// The program itself compares the frames, and fails if one differs.
#[test]
fn step_09_draws_the_same_100_frames_with_two_in_flight_as_one_at_a_time() {
    let step = whole("step-09-in-flight");
    assert!(step.stdout.contains("100 frames: "), "{}", step.stdout);
    assert_frame(&step.picture, 99);
}

#[test]
fn step_10_draws_the_picture_of_step_09_in_a_window_that_becomes_larger() {
    let Some(step) = whole_if_possible("step-10-window") else { return };
    assert!(step.stdout.contains("100 frames in a window, at last of 480 x 270"), "{}", step.stdout);
    assert!(step.picture == whole("step-09-in-flight").picture);
}

#[test]
fn step_11_draws_the_frames_of_step_09_from_a_table() {
    assert_frame(&whole("step-11-rows").picture, 9);
}

/// Each row is needed. Of the bits those idle that another use of the same subpass makes superfluous.
#[test]
fn step_11b_proves_the_rows_and_finds_each_deletion() {
    let proof = whole("step-11b-proof").stdout;
    println!("measured: {proof}");
    let found = proof.lines().filter(|line| line.starts_with("without ") && line.contains(", then ")).count();
    assert_eq!(found, ROWS.len());
    let idle = "gbuffer-reuse after: FRAGMENT_SHADER, gbuffer-reuse after: EARLY_FRAGMENT_TESTS";
    assert!(proof.contains("44 bits are needed") && proof.contains(idle), "{proof}");
    for row in ROWS {
        let messages = start("step-11b-proof", Some(row)).messages;
        assert!(messages.contains("no row orders this: "), "without {row}: {messages}");
        // Older layers (1.3.239) do not look from one submission to the next.
        let is_seen = layer() >= FIRST_OF_NEWER || !row.ends_with("reuse");
        assert_eq!(messages.contains("SYNC-HAZARD"), is_seen, "without {row}: {messages}");
    }
}
