//! Transparent surfaces against the operator `over` and the formula of weighted blending, both worked out in f64.

use crate::common::compare::{assert_identical, largest_code_difference, largest_relative_difference};
use crate::common::gpu::{code, nits, on_gpu, places};
use crate::common::stage::{
    EDGE, EYE, add, directional, display, exact, lambert, plane, point, rectangle, seen, srgb_code, stage, sun,
};
use crate::common::truth::radiance;
use afterlight::frame::Renderer;
use afterlight::plan::HDR;
use afterlight::scene::builtin::shapes::{MeshBuilder, WHOLE_IMAGE};
use afterlight::scene::{
    AlphaMode, Brdf, ColorSpace, Environment, Falloff, GbufferPreset, Light, LightPath, Material, Scene, Settings,
    ShadowSettings, Texture, Transparency, View,
};
use glam::{DAffine3, DVec2, DVec3, Vec3};

/// The relative error of single precision in a picture of a few layers.
const SINGLE: f64 = 1e-5;

fn pane(color: [f32; 3], alpha: f32) -> Material {
    Material { base_color: Vec3::from(color), alpha, alpha_mode: AlphaMode::Blend, ..lambert(1.0) }
}

fn oit(settings: Settings) -> Settings {
    Settings { transparency: Transparency::Oit, ..settings }
}

/// A rectangle before the plane z = 0: its corners, height and material.
struct Pane {
    low: [f64; 2],
    high: [f64; 2],
    z: f64,
    material: Material,
}

/// Panes of different sizes, so that every number of layers is seen, all centred on the axis.
fn panes() -> Vec<Pane> {
    let pane = |half: f64, z, color, alpha| Pane {
        low: [-half, -half * 0.7],
        high: [half, half * 0.7],
        z,
        material: pane(color, alpha),
    };
    vec![
        pane(0.8, 0.2, [0.9, 0.1, 0.2], 0.5),
        pane(0.35, 0.9, [0.1, 0.8, 0.3], 0.25),
        pane(0.6, 0.5, [0.2, 0.3, 1.0], 0.75),
        pane(0.2, 1.1, [1.0, 1.0, 0.4], 1.0),
    ]
}

const LIGHT: DVec3 = DVec3::new(0.4, 0.3, 1.0);
const LUX: f32 = 3.0;

/// The panes over a grey plane, in the order that is given.
fn overlapping(panes: &[Pane]) -> Scene {
    let mut scene = plane(lambert(0.5), vec![directional(LIGHT, LUX)]);
    for pane in panes {
        add(&mut scene, rectangle(pane.low, pane.high, pane.z), pane.material.clone(), DAffine3::IDENTITY);
    }
    scene
}

/// Returns the point, at a height, of the ray through a pixel's centre.
fn seen_at(x: u32, y: u32, z: f64) -> DVec3 {
    EYE.lerp(seen([EDGE, EDGE], x, y), (EYE.z - z) / EYE.z)
}

/// Returns the layers of a pixel from the nearest: colour, alpha, distance to the eye. Returns `None` if the pixel is too near to a pane's edge to
/// decide.
fn layers(panes: &[Pane], lights: &[Light], x: u32, y: u32) -> Option<Vec<(DVec3, f64, f64)>> {
    let mut found = Vec::new();
    for pane in panes {
        let place = seen_at(x, y, pane.z);
        let inside = [0, 1].map(|axis| (place[axis] - pane.low[axis]).min(pane.high[axis] - place[axis]));
        let inside = inside[0].min(inside[1]);
        if inside.abs() < 1e-6 {
            return None;
        }
        if inside > 0.0 {
            let color = radiance(&pane.material, lights, place, DVec3::Z, EYE);
            found.push((color, f64::from(pane.material.alpha), place.distance(EYE)));
        }
    }
    found.sort_by(|a, b| a.2.total_cmp(&b.2));
    Some(found)
}

/// Porter and Duff's `over`, from the farthest layer to the nearest.
fn over(layers: &[(DVec3, f64, f64)], behind: DVec3) -> DVec3 {
    layers.iter().rev().fold(behind, |behind, (color, alpha, _)| *color * *alpha + behind * (1.0 - alpha))
}

/// McGuire and Bavoil 2013, equation 2, with the weight of `shaders/forward.wgsl`.
fn weighted(layers: &[(DVec3, f64, f64)], behind: DVec3, radius: f64) -> DVec3 {
    let (mut sum, mut cover, mut revealed) = (DVec3::ZERO, 0.0, 1.0);
    for (color, alpha, distance) in layers {
        let weight = alpha * (radius / (radius + distance)).powi(6).max(1.0 / 4096.0);
        (sum, cover, revealed) = (sum + *color * weight, cover + weight, revealed * (1.0 - alpha));
    }
    if cover == 0.0 { behind } else { sum / cover * (1.0 - revealed) + behind * revealed }
}

fn floor(scene: &Scene, x: u32, y: u32) -> DVec3 {
    radiance(&scene.materials[0], &scene.lights, seen([EDGE, EDGE], x, y), DVec3::Z, EYE)
}

fn assert_near(actual: DVec3, expected: DVec3, relative: f64, what: &str) {
    let error = (actual - expected).abs().max_element();
    assert!(error <= relative * expected.max_element(), "{what}: {actual} instead of {expected}");
}

#[test]
fn overlapping_panes_are_laid_over_each_other_from_back_to_front() {
    on_gpu(|gpu| {
        let panes = panes();
        let scene = overlapping(&panes);
        let picture = gpu.draw(&scene, &exact(EDGE, EDGE));
        let shown = gpu.draw(&scene, &display(EDGE, EDGE));
        let mut counts = [0; 5];
        for (x, y) in places(&picture) {
            let Some(layers) = layers(&panes, &scene.lights, x, y) else { continue };
            let expected = over(&layers, floor(&scene, x, y));
            assert_near(nits(&picture, x, y), expected, SINGLE, &format!("({x}, {y}), {} layers", layers.len()));
            // Each of five values in the target of half floats loses at most a step of 2^-10, which is less than a third of a code,
            // and the encoding six tenths of one.
            let codes = expected.to_array().map(srgb_code);
            let differs = code(&shown, x, y).iter().zip(codes).any(|(code, expected)| code.abs_diff(expected) > 1);
            assert!(!differs, "({x}, {y}): {:?} instead of {codes:?}", code(&shown, x, y));
            counts[layers.len()] += 1;
        }
        assert!(counts.iter().all(|&count| count > 10), "{counts:?}");
    });
}

#[test]
fn the_order_in_the_scene_does_not_matter() {
    on_gpu(|gpu| {
        let first = gpu.draw(&overlapping(&panes()), &exact(EDGE, EDGE));
        let mut panes = panes();
        for _ in 1..panes.len() {
            panes.rotate_left(1);
            assert_identical(&gpu.draw(&overlapping(&panes), &exact(EDGE, EDGE)), &first, "rotated");
        }
    });
}

/// Two panes that cross on the axis.
fn crossing() -> Scene {
    let mut scene = plane(lambert(0.5), vec![directional(DVec3::Z, LUX)]);
    for (slope, color) in CROSSING {
        let mut mesh = MeshBuilder::new();
        strips(&mut mesh, slope, 1, WHOLE_IMAGE);
        add(&mut scene, mesh, pane(color, 0.5), DAffine3::IDENTITY);
    }
    scene
}

/// Adds one of the crossing panes as `count` strips side by side.
fn strips(mesh: &mut MeshBuilder, slope: f64, count: u32, uvs: [DVec2; 4]) {
    for strip in 0..count {
        let [left, right] = [strip, strip + 1].map(|edge| f64::from(edge) / f64::from(count) * 1.2 - 0.6);
        let corner = |x: f64, y: f64| DVec3::new(x, y, 0.6 + slope * x);
        mesh.quad([corner(left, -0.5), corner(right, -0.5), corner(right, 0.5), corner(left, 0.5)], uvs);
    }
}

const RED: [f32; 3] = [1.0, 0.0, 0.0];
const BLUE: [f32; 3] = [0.0, 0.0, 1.0];
const SLOPE: f64 = 0.5;

/// Slope and colour: the red one is nearer on the right, the blue one on the left.
const CROSSING: [(f64, [f32; 3]); 2] = [(SLOPE, RED), (-SLOPE, BLUE)];

/// The layers of crossing panes at a pixel of the middle row, from the nearest.
fn crossing_layers(scene: &Scene, x: u32) -> Vec<(DVec3, f64, f64)> {
    let ray = seen([EDGE, EDGE], x, EDGE / 2) - EYE;
    let mut layers = CROSSING
        .map(|(slope, color)| {
            // EYE + t ray lies in z = 0.6 + slope x.
            let t = (0.6 - EYE.z) / (ray.z - slope * ray.x);
            let place = EYE + ray * t;
            let normal = DVec3::new(-slope, 0.0, 1.0).normalize();
            (radiance(&pane(color, 0.5), &scene.lights, place, normal, EYE), 0.5, place.distance(EYE))
        })
        .to_vec();
    layers.sort_by(|a, b| a.2.total_cmp(&b.2));
    layers
}

/// Sorting whole objects is right on one side of where they cross and wrong on the other; weighted blending errs on both, and by
/// less, as it takes the mean colour of both with nearly even weights.
#[test]
fn panes_that_cross_are_right_on_one_side_if_sorted_and_near_on_both_if_weighted() {
    on_gpu(|gpu| {
        let scene = crossing();
        let radius = scene.bounds().radius();
        let sorted = gpu.draw(&scene, &exact(EDGE, EDGE));
        let weights = gpu.draw(&scene, &oit(exact(EDGE, EDGE)));
        let middle = EDGE / 2;
        let (mut right, mut wrong) = (0, 0);
        for x in (middle - 8..=middle + 8).filter(|&x| x != middle) {
            let layers = crossing_layers(&scene, x);
            let behind = floor(&scene, x, middle);
            let truth = over(&layers, behind);
            let turned = over(&[layers[1], layers[0]], behind);
            let seen = nits(&sorted, x, middle);
            if (seen - truth).abs().max_element() < SINGLE * truth.max_element() {
                right += 1;
            } else {
                assert_near(seen, turned, SINGLE, &format!("sorted {x}"));
                wrong += 1;
            }
            let expected = weighted(&layers, behind, radius);
            assert_near(nits(&weights, x, middle), expected, SINGLE, &format!("weighted {x}"));
            let error = (expected - truth).abs().max_element();
            assert!(error > 0.0 && error < 0.6 * (turned - truth).abs().max_element(), "{x}: {expected} {truth}");
        }
        assert_eq!((right, wrong), (8, 8), "one order for the whole object");
    });
}

/// Triangles of one mesh are sorted individually, so only triangles that cross others are wrong.
#[test]
fn triangles_of_one_mesh_are_sorted() {
    on_gpu(|gpu| {
        let mut scene = plane(lambert(0.5), vec![directional(DVec3::Z, LUX)]);
        let parts = crossing();
        // Both panes are one object, and each takes its colour from its own texel.
        let mut merged = MeshBuilder::new();
        for (slope, u) in [(SLOPE, 0.25), (-SLOPE, 0.75)] {
            strips(&mut merged, slope, 24, [DVec2::new(u, 0.5); 4]);
        }
        scene.textures = vec![Texture {
            name: "red and blue".into(),
            size: [2, 1],
            color_space: ColorSpace::Srgb,
            sampler: Default::default(),
            texels: vec![255, 0, 0, 255, 0, 0, 255, 255].into(),
        }];
        let material = Material { base_color_texture: Some(0), ..pane([1.0; 3], 0.5) };
        add(&mut scene, merged, material, DAffine3::IDENTITY);
        // Lavapipe's anisotropic filter looks beyond the four nearest texels.
        let picture = gpu.draw(&scene, &Settings { anisotropy: 1, ..exact(EDGE, EDGE) });
        let middle = EDGE / 2;
        for x in (middle - 8..=middle + 8).filter(|&x| x.abs_diff(middle) > 1) {
            let layers = crossing_layers(&parts, x);
            assert_near(nits(&picture, x, middle), over(&layers, floor(&scene, x, middle)), SINGLE, &format!("{x}"));
        }
    });
}

/// Several layers in one mesh, listed in this order.
fn merged(order: &[usize]) -> Scene {
    let mut scene = plane(lambert(0.5), vec![directional(LIGHT, LUX)]);
    let panes = panes();
    let mut mesh = MeshBuilder::new();
    for &index in order {
        let (pane, half) = (&panes[index], 0.5 - 0.1 * index as f64);
        let corner = |x, y| DVec3::new(x, y, pane.z);
        mesh.quad([corner(-half, -half), corner(half, -half), corner(half, half), corner(-half, half)], WHOLE_IMAGE);
    }
    add(&mut scene, mesh, pane([0.9, 0.4, 0.2], 0.3), DAffine3::IDENTITY);
    scene
}

#[test]
fn weighted_blending_takes_any_order_and_sorting_undoes_it() {
    on_gpu(|gpu| {
        let orders = [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]];
        let drawn = |settings: &Settings| orders.map(|order| gpu.draw(&merged(&order), settings));
        let [first, others @ ..] = drawn(&exact(EDGE, EDGE));
        others.iter().for_each(|other| assert_identical(other, &first, "sorted"));
        let [first, others @ ..] = drawn(&oit(exact(EDGE, EDGE)));
        for other in &others {
            // Sums in another order round otherwise.
            let (most, at) = largest_relative_difference(other, &first, 1e-3);
            assert!(most < SINGLE, "{most} at {at:?}");
        }
        let [first, others @ ..] = drawn(&oit(display(EDGE, EDGE)));
        for other in &others {
            let (most, at) = largest_code_difference(other, &first);
            assert!(most <= 1, "{most} codes at {at:?}");
        }
    });
}

#[test]
fn one_weighted_layer_is_as_exact_as_a_sorted_one() {
    on_gpu(|gpu| {
        for alpha in [0.02, 0.25, 0.5, 1.0] {
            let panes = [Pane { material: pane([0.9, 0.1, 0.2], alpha), ..panes().remove(0) }];
            let scene = overlapping(&panes);
            let (sorted, weighted) = (gpu.draw(&scene, &exact(EDGE, EDGE)), gpu.draw(&scene, &oit(exact(EDGE, EDGE))));
            let (most, at) = largest_relative_difference(&sorted, &weighted, 0.1);
            assert!(most < SINGLE, "alpha {alpha}: {most} at {at:?}");
        }
    });
}

/// The weights of a far pane must not vanish because some other surface has many triangles.
#[test]
fn a_faint_pane_far_away_keeps_its_colour_beside_many_triangles() {
    on_gpu(|gpu| {
        let mut scene = stage();
        scene.environment = Environment { background: Vec3::splat(0.25), ..Environment::default() };
        let glow = Material { emissive: Vec3::new(5.0, 4.0, 0.5), ..pane([0.0; 3], 0.04) };
        add(&mut scene, rectangle([-0.3, -0.3], [0.3, 0.3], 0.0), glow, DAffine3::IDENTITY);
        let mut strip = MeshBuilder::new();
        strips(&mut strip, 0.0, 100_000, WHOLE_IMAGE);
        let beside =
            DAffine3::from_translation(DVec3::new(0.0, 0.35, 0.0)) * DAffine3::from_scale(DVec3::new(0.1, 0.02, 0.01));
        add(&mut scene, strip, pane([0.5; 3], 0.5), beside);
        assert!(EYE.z > 3.0 * scene.bounds().radius(), "the pane is not far away");
        let shown = gpu.draw(&scene, &oit(display(EDGE, EDGE)));
        let expected = (DVec3::new(5.0, 4.0, 0.5) * 0.04 + 0.25 * 0.96).to_array().map(srgb_code);
        let seen = code(&shown, EDGE / 2, EDGE / 2);
        assert!(
            seen.iter().zip(expected).all(|(code, expected)| code.abs_diff(expected) <= 1),
            "{seen:?} {expected:?}"
        );
    });
}

fn shiny(alpha_mode: AlphaMode, alpha: f32) -> Material {
    Material { base_color: Vec3::new(0.2, 0.5, 0.9), roughness: 0.3, alpha, alpha_mode, ..Material::default() }
}

#[test]
fn glass_keeps_its_highlights_and_a_blended_surface_does_not() {
    on_gpu(|gpu| {
        // The lamp stands beside the eye, so that its mirror image is in view.
        let lamp = vec![point(DVec3::new(0.3, 0.0, 2.0), 5.0, None, Falloff::InverseSquare)];
        for (mode, transparency, bound) in [
            (AlphaMode::Blend, Transparency::Sorted, 1e-4),
            (AlphaMode::Glass, Transparency::Sorted, 1e-4),
            (AlphaMode::Glass, Transparency::Oit, 1e-4),
        ] {
            let mut scene = stage();
            scene.environment = Environment { background: Vec3::splat(0.25), ..Environment::default() };
            let glass = shiny(mode, 0.1);
            add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.0), glass.clone(), DAffine3::IDENTITY);
            scene.lights = lamp.clone();
            let picture = gpu.draw(&scene, &Settings { transparency, ..exact(EDGE, EDGE) });
            let mut brightest = 0.0f64;
            for (x, y) in places(&picture) {
                let place = seen([EDGE, EDGE], x, y);
                let whole = radiance(&glass, &lamp, place, DVec3::Z, EYE);
                // A black albedo leaves only the lobe, since nothing is metal.
                let black = Material { base_color: Vec3::ZERO, ..glass.clone() };
                let lobe = radiance(&black, &lamp, place, DVec3::Z, EYE);
                let own = if mode == AlphaMode::Glass { (whole - lobe) * 0.1 + lobe } else { whole * 0.1 };
                assert_near(nits(&picture, x, y), own + 0.25 * 0.9, bound, &format!("{mode:?} ({x}, {y})"));
                brightest = brightest.max(own.max_element());
            }
            assert_eq!(brightest > 0.25, mode == AlphaMode::Glass, "{mode:?}: {brightest}");
        }
    });
}

#[test]
fn what_a_surface_emits_is_times_alpha_unless_it_is_glass() {
    on_gpu(|gpu| {
        for (mode, share) in [(AlphaMode::Blend, 0.25), (AlphaMode::Glass, 1.0)] {
            for transparency in [Transparency::Sorted, Transparency::Oit] {
                let glow =
                    Material { emissive: Vec3::new(4.0, 2.0, 1.0), alpha: 0.25, alpha_mode: mode, ..lambert(0.5) };
                let mut scene = plane(Material { emissive: Vec3::splat(3.0), ..lambert(0.5) }, Vec::new());
                add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.5), glow, DAffine3::IDENTITY);
                let picture = gpu.draw(&scene, &Settings { transparency, ..exact(EDGE, EDGE) });
                let expected = DVec3::new(4.0, 2.0, 1.0) * share + 3.0 * 0.75;
                assert_near(nits(&picture, 5, 7), expected, SINGLE, &format!("{mode:?} {transparency}"));
            }
        }
    });
}

#[test]
fn what_is_opaque_hides_what_is_behind_it_and_the_background_shines_through() {
    on_gpu(|gpu| {
        for transparency in [Transparency::Sorted, Transparency::Oit] {
            let mut scene = stage();
            scene.environment = Environment { background: Vec3::new(0.1, 0.4, 0.2), ..Environment::default() };
            scene.lights = vec![directional(DVec3::Z, LUX)];
            add(&mut scene, rectangle([-4.0, -4.0], [4.0, 4.0], 0.0), pane([1.0, 0.5, 0.0], 0.5), DAffine3::IDENTITY);
            add(&mut scene, rectangle([0.1, -4.0], [4.0, 4.0], 0.1), lambert(0.5), DAffine3::IDENTITY);
            let settings = Settings { transparency, ..exact(EDGE, EDGE) };
            let picture = gpu.draw(&scene, &settings);
            let white = f64::from(LUX) / std::f64::consts::PI;
            let through = DVec3::new(1.0, 0.5, 0.0) * white * 0.5 + DVec3::new(0.1, 0.4, 0.2) * 0.5;
            assert_near(nits(&picture, 2, 16), through, SINGLE, "the background");
            assert_near(nits(&picture, EDGE - 2, 16), DVec3::splat(0.5 * white), SINGLE, "what is in front");
            // In 8 bits through the HDR target, whose clear colour shines through.
            let shown = gpu.draw(&scene, &Settings { transparency, ..display(EDGE, EDGE) });
            let codes = through.to_array().map(srgb_code);
            let near = code(&shown, 2, 16).iter().zip(codes).all(|(code, expected)| code.abs_diff(expected) <= 1);
            assert!(near, "{:?} instead of {codes:?}", code(&shown, 2, 16));
        }
    });
}

#[test]
fn transparent_surfaces_receive_shadows_and_cast_none() {
    on_gpu(|gpu| {
        let towards = DVec3::new(1.0, 0.0, 1.0);
        let with = |caster: bool, glass: bool| {
            let mut scene = plane(lambert(0.5), vec![sun(towards, LUX)]);
            if glass {
                add(&mut scene, rectangle([-0.9, -0.9], [0.9, 0.9], 0.5), pane([1.0; 3], 0.5), DAffine3::IDENTITY);
            }
            if caster {
                // Above the pane and out of sight: its shadow falls to the left.
                add(&mut scene, rectangle([0.9, -0.4], [1.5, 0.4], 1.6), lambert(0.5), DAffine3::IDENTITY);
            }
            scene
        };
        let settings = exact(EDGE, EDGE);
        let middle = EDGE / 2;
        let lit = nits(&gpu.draw(&with(false, true), &settings), middle, middle);
        let shadowed = nits(&gpu.draw(&with(true, true), &settings), middle, middle);
        let white = f64::from(LUX) * std::f64::consts::FRAC_1_SQRT_2 / std::f64::consts::PI;
        assert_near(lit, DVec3::splat(0.5 * white + 0.5 * 0.5 * white), 1e-3, "lit");
        // The pane's middle lies in the caster's shadow; the plane behind it does not, nor in the pane's.
        assert_near(shadowed, DVec3::splat(0.25 * white), 1e-3, "shadowed");
        let off = ShadowSettings { enabled: false, ..ShadowSettings::default() };
        let without = nits(&gpu.draw(&with(true, true), &Settings { shadows: off, ..settings }), middle, middle);
        assert_near(without, lit, 1e-3, "shadows switched off");
    });
}

#[test]
fn nothing_transparent_costs_nothing() {
    on_gpu(|gpu| {
        let plan = |scene: &Scene, settings: &Settings| gpu.renderer(scene, settings).plan().clone();
        let opaque = plan(&plane(lambert(0.5), vec![directional(LIGHT, LUX)]), &display(EDGE, EDGE));
        assert_eq!((opaque.transparency, opaque.hdr, opaque.transparent.len()), (None, None, 0));
        let scene = overlapping(&panes());
        let sorted = plan(&scene, &display(EDGE, EDGE));
        assert_eq!((sorted.transparency, sorted.hdr), (Some(Transparency::Sorted), Some(HDR)));
        // Views of the G-buffer show its content, which no transparent surface is in.
        for view in [View::Albedo, View::Overdraw, View::Lighting] {
            let plan = plan(&scene, &Settings { view, ..display(EDGE, EDGE) });
            assert_eq!((plan.transparency, plan.hdr), (None, None), "{view}");
        }
    });
}

#[test]
fn a_surface_of_every_model_is_lit_as_where_it_is_opaque() {
    on_gpu(|gpu| {
        let lamp = point(DVec3::new(0.5, 0.25, 1.5), 5.0, Some(6.0), Falloff::InverseSquare);
        for (_, brdf) in Brdf::NAMES {
            let opaque = Material {
                brdf: *brdf,
                specular: Vec3::splat(0.3),
                shininess: 20.0,
                ambient: 0.5,
                metallic: 0.25,
                ..Material::default()
            };
            let lights = vec![directional(LIGHT, LUX), lamp.clone()];
            let mut scene = plane(opaque.clone(), lights);
            scene.environment.ambient = Vec3::splat(0.2);
            let settings = exact(EDGE, EDGE);
            assert_eq!(settings.gbuffer.preset, GbufferPreset::Float32);
            let expected = gpu.draw(&scene, &settings);
            for mode in [AlphaMode::Blend, AlphaMode::Glass] {
                // Wholly there: both modes are then opaque.
                scene.materials[0] = Material { alpha_mode: mode, ..opaque.clone() };
                let (most, at) = largest_relative_difference(&gpu.draw(&scene, &settings), &expected, 1e-3);
                eprintln!("{brdf} {mode:?}: {most:e}");
                assert!(most < SINGLE, "{brdf} {mode:?}: {most} at {at:?}");
            }
        }
    });
}

#[test]
fn transparent_surfaces_meet_the_same_lights_on_every_light_path() {
    on_gpu(|gpu| {
        let mut scene = overlapping(&panes());
        let ranges = [Some(0.9), Some(1.5), None, Some(2.0), Some(0.6), Some(1.2)];
        scene.lights.extend(ranges.into_iter().enumerate().map(|(index, range)| {
            let turn = index as f64;
            point(DVec3::new(turn.cos() * 0.6, turn.sin() * 0.5, 0.4 + 0.2 * turn), 0.5, range, Falloff::InverseSquare)
        }));
        let on = |light_path, transparency| Settings { light_path, transparency, ..exact(EDGE, EDGE) };
        for (_, transparency) in Transparency::NAMES {
            let expected = gpu.draw(&scene, &on(LightPath::Loop, *transparency));
            let clustered = gpu.draw(&scene, &on(LightPath::Clustered, *transparency));
            assert_identical(
                &clustered,
                &expected,
                "clustered sums in the same order, but for the lights without a range",
            );
            for path in [LightPath::PerLight, LightPath::Volumes, LightPath::Auto] {
                let (most, at) =
                    largest_relative_difference(&gpu.draw(&scene, &on(path, *transparency)), &expected, 0.1);
                assert!(most < SINGLE, "{path}: {most} at {at:?}");
            }
            let refused = Renderer::new(&gpu.device, &scene, &on(LightPath::Compute, *transparency)).err();
            let sentence = refused.map(|error| error.to_string()).unwrap_or_default();
            assert!(sentence.contains("--light-path compute") && sentence.contains("clustered"), "{sentence}");
        }
    });
}
