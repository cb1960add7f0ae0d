//! Multisampling: edges and surfaces against the samples that lie there, computed in f64.

use super::antialiasing::{BRIGHT, DARK, coverage, coverage_is_whole, edge};
use crate::common::compare::assert_identical;
use crate::common::gpu::{code, nits, on_gpu, places};
use crate::common::stage::{
    EDGE, EYE, add, directional, display, exact, gbuffer, lambert, open, own, point, rectangle, srgb_code, stage,
};
use crate::common::truth::radiance;
use crate::common::{one_of, some_in_turn};
use afterlight::frame::Complexity;
use afterlight::scene::{
    AlphaMode, ColorSpace, Falloff, LightPath, Material, Resolve, Scene, Settings, Texture, Transparency, View,
};
use glam::{DAffine3, DVec3, Vec3};

/// Samples of a pixel with 4, from its centre, to the right and down: "Standard sample locations" of the Vulkan specification.
const FOUR: [[f64; 2]; 4] = [[-0.125, -0.375], [0.375, -0.125], [-0.375, 0.125], [0.125, 0.375]];

/// Returns how many of a pixel's samples the half-plane covers; none where a sample lies too near the edge to say.
fn covered_samples(degrees: f64, x: u32, y: u32) -> Option<usize> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let middle = f64::from(EDGE) / 2.0;
    let inside = FOUR
        .map(|[right, down]| (f64::from(x) + 0.5 + right - middle) * cos + (middle - f64::from(y) - 0.5 - down) * sin);
    // Vertices have 8 bits below the pixel.
    inside.iter().all(|d| d.abs() > 1.0 / 128.0).then(|| inside.iter().filter(|d| **d > 0.0).count())
}

/// The half-plane of [`edge`] as a pane that lets half of the light from behind it through.
fn pane_edge(degrees: f64) -> Scene {
    let mut scene = edge(degrees);
    let pane = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..scene.materials[0].clone() };
    scene.materials[0] = pane;
    // A surface behind the pane, in place of a clear colour: depth of all samples is tested.
    let behind = (DARK / (BRIGHT / 0.5)) as f32;
    add(&mut scene, rectangle([-8.0, -8.0], [8.0, 8.0], -1.0), lambert(behind), DAffine3::IDENTITY);
    scene.environment.background = Vec3::ZERO;
    scene
}

/// Every way to light the multisampled surfaces of a scene.
fn multisampled(scene: &Scene, base: &Settings) -> Vec<(String, Settings)> {
    let ways = [
        (LightPath::Loop, None),
        (LightPath::Clustered, None),
        (LightPath::Forward, Some(true)),
        (LightPath::Forward, Some(false)),
        (LightPath::ForwardNaive, None),
        (LightPath::Compute, None),
        (LightPath::Visibility, None),
    ];
    let is_transparent = scene.materials.iter().any(Material::is_transparent);
    let by_compute = |path| matches!(path, LightPath::Compute | LightPath::Visibility);
    let ways = ways.into_iter().filter(|&(light_path, _)| !is_transparent || !by_compute(light_path));
    let mut all = Vec::new();
    for (light_path, depth_prepass) in ways {
        for transparency in [Transparency::Sorted, Transparency::Oit] {
            let settings = Settings { msaa: 4, light_path, depth_prepass, transparency, ..base.clone() };
            all.push((format!("{light_path}, pre-pass {depth_prepass:?}, {transparency}"), settings));
        }
    }
    all
}

#[test]
fn multisampled_edges_have_as_much_of_each_side_as_samples_lie_there() {
    on_gpu(|gpu| {
        for degrees in [5.0, 17.0, 45.5, 78.0] {
            for (scene, full) in [(edge(degrees), BRIGHT), (pane_edge(degrees), (BRIGHT + DARK) / 2.0)] {
                for (way, settings) in multisampled(&scene, &exact(EDGE, EDGE)) {
                    let what = format!("{degrees} degrees, {way}");
                    let linear = gpu.draw(&scene, &settings);
                    let mut levels = [0; 5];
                    for (x, y) in places(&linear) {
                        let Some(covered) = covered_samples(degrees, x, y) else { continue };
                        levels[covered] += 1;
                        let shown = nits(&linear, x, y).y;
                        let error = (shown - (DARK + (full - DARK) * covered as f64 / 4.0)).abs();
                        assert!(error < 1e-5, "{what}, ({x}, {y}): {covered} of 4 covered, off by {error}");
                        // Four samples, no two in a row or column, miss the covered area by at most a quarter of the pixel.
                        let missed = (shown - DARK) / (full - DARK) - coverage(degrees, x, y);
                        assert!(missed.abs() < 0.25, "{what}, ({x}, {y}): coverage off by {missed}");
                    }
                    assert!(levels.iter().all(|count| *count > 0), "{what}: {levels:?}");
                }
            }
        }
    });
}

#[test]
fn an_edge_that_is_lit_as_it_is_drawn_is_lit_where_the_surface_is() {
    on_gpu(|gpu| {
        let degrees = 17.0;
        let mut scene = edge(degrees);
        let (sin, cos) = degrees.to_radians().sin_cos();
        // The lamp is so near that its light varies strongly within a pixel, away from the edge.
        let lamp = DVec3::new(0.08 * cos, 0.08 * sin, 0.04);
        scene.lights = vec![point(lamp, 0.01, None, Falloff::InverseSquare)];
        let ways = multisampled(&scene, &exact(EDGE, EDGE));
        for (way, settings) in ways.into_iter().filter(|(way, _)| way.contains("forward")) {
            let picture = gpu.draw(&scene, &settings);
            let mut cut = 0;
            for (x, y) in places(&picture) {
                let Some(covered @ 1..4) = covered_samples(degrees, x, y) else { continue };
                cut += 1;
                // The one place is the driver's choice, but on the part that is covered.
                let (mut least, mut most) = (f64::INFINITY, 0f64);
                for (right, down) in (0..=16).flat_map(|right| (0..=16).map(move |down| (right, down))) {
                    let place = in_plane(f64::from(x) + f64::from(right) / 16.0, f64::from(y) + f64::from(down) / 16.0);
                    // Vertices have 8 bits below the pixel.
                    if place.x * cos + place.y * sin > -1.0 / 128.0 * 2.0 / f64::from(EDGE) {
                        let light = radiance(&scene.materials[0], &scene.lights, place, DVec3::Z, EYE).y;
                        (least, most) = (least.min(light), most.max(light));
                    }
                }
                let share = covered as f64 / 4.0;
                let lit = (nits(&picture, x, y).y - DARK * (1.0 - share)) / share;
                let (low, high) = (least * 0.995, most * 1.005);
                assert!((low..=high).contains(&lit), "{way} ({x}, {y}): {lit} is not in {low} to {high}");
            }
            assert!(cut > 20, "{cut}");
        }
    });
}

#[test]
#[ignore = "test-all: the comparison with rays, or with the frame that leaves nothing out, stays"]
fn lists_of_lights_change_no_sample() {
    on_gpu(|gpu| {
        // A floor that ends 6.9 m away, within a pixel whose centre lies 8.25 m away on its plane: behind the froxel, from 5.7 m to 8 m,
        // that has the light.
        let mut floor = stage();
        let flat = DAffine3::from_rotation_x(-90f64.to_radians());
        add(&mut floor, rectangle([-8.0, -1.5], [8.0, 4.9], -0.5), lambert(0.5), flat);
        floor.lights = vec![point(DVec3::new(0.0, -0.3, -4.6), 1.0, Some(0.8), Falloff::InverseSquare)];
        let scenes = [floor, open("builtin:field?objects=60&lights=30"), open("builtin:hall")];
        for (turn, scene) in scenes.into_iter().enumerate() {
            let spec = &scene.name;
            for base in one_of(&[exact(EDGE, EDGE), display(EDGE, EDGE)], turn).iter().cloned() {
                let settings = Settings { msaa: 4, exposure: own(&scene, 1, 1).exposure, ..base };
                let draw = |light_path, depth_prepass| {
                    gpu.draw(&scene, &Settings { light_path, depth_prepass, ..settings.clone() })
                };
                let naive = draw(LightPath::ForwardNaive, None);
                assert_identical(&draw(LightPath::Forward, Some(false)), &naive, spec);
            }
        }
    });
}

/// Returns the point of the plane z = 0 at a place of the picture, in pixels from its upper left corner.
fn in_plane(right: f64, down: f64) -> DVec3 {
    let middle = f64::from(EDGE) / 2.0;
    DVec3::new(right - middle, middle - down, 0.0) / middle
}

#[test]
fn each_sample_of_an_edge_is_lit_at_its_own_place() {
    on_gpu(|gpu| {
        let degrees = 17.0;
        let mut scene = edge(degrees);
        // The lamp is so near that its light varies strongly within a pixel.
        scene.lights = vec![point(DVec3::new(0.02, 0.03, 0.04), 0.01, None, Falloff::InverseSquare)];
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Rebuilt from depth: a position target has one place for all samples that a triangle covers, and not where they are. The albedo
        // of `lean` has 8 bits.
        let layouts = [("lean", 0.01), ("lean,albedo=rgba32f,normal=rgba32f", 0.001)];
        let paths = [LightPath::Loop, LightPath::Compute, LightPath::Visibility];
        for ((layout, bound), light_path) in layouts.into_iter().flat_map(|own| paths.map(|path| (own, path))) {
            let settings = Settings { msaa: 4, light_path, gbuffer: gbuffer(layout), ..exact(EDGE, EDGE) };
            let picture = gpu.draw(&scene, &settings);
            for (x, y) in places(&picture) {
                let Some(covered) = covered_samples(degrees, x, y) else { continue };
                let lit = |[right, down]: [f64; 2]| {
                    let place = in_plane(f64::from(x) + 0.5 + right, f64::from(y) + 0.5 + down);
                    radiance(&scene.materials[0], &scene.lights, place, DVec3::Z, EYE).y
                };
                let inside = |[right, down]: [f64; 2]| {
                    let place = in_plane(f64::from(x) + 0.5 + right, f64::from(y) + 0.5 + down);
                    place.x * cos + place.y * sin > 0.0
                };
                let expected = match covered {
                    // Samples that agree are lit as one, in the pixel's middle.
                    4 => lit([0.0, 0.0]),
                    _ => FOUR.into_iter().map(|at| if inside(at) { lit(at) } else { DARK }).sum::<f64>() / 4.0,
                };
                let error = (nits(&picture, x, y).y - expected).abs() / expected;
                assert!(error < bound, "{light_path} {layout} ({x}, {y}), {covered} covered: off by {error}");
            }
        }
    });
}

#[test]
#[ignore = "test-all: the comparison with rays, or with the frame that leaves nothing out, stays"]
fn samples_are_resolved_as_light_or_as_shown() {
    on_gpu(|gpu| {
        let degrees = 17.0;
        let mut scene = edge(degrees);
        // Four times white on a quarter of white, with the clamp as the tone mapper; glowing or lit.
        scene.environment.background = Vec3::splat(0.25);
        let lit = scene.clone();
        scene.lights.clear();
        scene.materials[0].emissive = Vec3::splat(4.0);
        let glowing = scene;
        let mut lit = lit;
        lit.lights[0].intensity *= (4.0 / BRIGHT) as f32;
        // A pane over a quarter of white that shows the same brightness.
        let mut pane = lit.clone();
        pane.materials[0] = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..lambert(0.5) };
        pane.lights[0].intensity *= (4.0 - 0.5 * 0.25) / (0.5 * 4.0);
        let pictures = [(&lit, "lit"), (&glowing, "glowing"), (&pane, "a pane")];
        for ((scene, name), resolve) in pictures
            .into_iter()
            .flat_map(|scene| [Resolve::Linear, Resolve::ToneMapped].map(|resolve| (scene, resolve)))
        {
            for (way, settings) in multisampled(scene, &Settings { resolve, ..display(EDGE, EDGE) }) {
                let picture = gpu.draw(scene, &settings);
                for (x, y) in places(&picture) {
                    let Some(covered) = covered_samples(degrees, x, y) else { continue };
                    let share = covered as f64 / 4.0;
                    let expected = match resolve {
                        Resolve::Linear => 0.25 + (4.0 - 0.25) * share,
                        Resolve::ToneMapped => 0.25 + (1.0 - 0.25) * share,
                    };
                    let (code, expected) = (code(&picture, x, y)[1], srgb_code(expected));
                    // A resolve of 8 bits may round once more.
                    assert!(code.abs_diff(expected) <= 1, "{name} {way} {resolve} ({x}, {y}): {code}, not {expected}");
                }
            }
        }
    });
}

#[test]
#[ignore = "test-all: the comparison with rays, or with the frame that leaves nothing out, stays"]
fn what_lies_inside_a_surface_is_the_same_with_one_sample_as_with_four() {
    on_gpu(|gpu| {
        let plain = edge(30.0);
        let inside_plain = |x, y| coverage_is_whole(30.0, x, y);
        // A square whose colours change from pixel to pixel, as interpolation at a wrong place would show.
        let mut noisy = stage();
        add(&mut noisy, rectangle([-0.75, -0.75], [0.75, 0.75], 0.0), lambert(1.0), DAffine3::IDENTITY);
        noisy.lights = vec![directional(DVec3::Z, 3.0)];
        let texels = (0..64 * 64u32).flat_map(|i| [i * 37 % 251, i * 91 % 241, i * 13 % 239, 255].map(|v| v as u8));
        let (name, size) = ("noise".into(), [64, 64]);
        noisy.textures.push(Texture {
            name,
            size,
            color_space: ColorSpace::Srgb,
            sampler: Default::default(),
            texels: texels.collect(),
        });
        noisy.materials[0].base_color_texture = Some(0);
        // Away from its border, and from where its two triangles meet.
        let inside_noisy = |x: u32, y: u32| {
            let (x, y) = (x.abs_diff(EDGE / 2), y.abs_diff(EDGE / 2));
            x.max(y) < 11 && x.abs_diff(y) > 2
        };
        let glassy = |scene: &Scene| {
            let mut scene = scene.clone();
            (scene.materials[0].alpha, scene.materials[0].alpha_mode) = (0.5, AlphaMode::Blend);
            scene
        };
        for (turn, scene) in [&plain, &noisy, &glassy(&plain), &glassy(&noisy)].into_iter().enumerate() {
            let inside = |x, y| if scene.textures.is_empty() { inside_plain(x, y) } else { inside_noisy(x, y) };
            // An anisotropic filter makes more of how places are rounded.
            for base in [exact(EDGE, EDGE), display(EDGE, EDGE)].map(|base| Settings { anisotropy: 1, ..base }) {
                let ways = multisampled(scene, &base);
                let ways: Vec<_> = ways.iter().filter(|(_, own)| gpu.takes(own.light_path, scene)).collect();
                for (way, settings) in some_in_turn(&ways, turn, 2) {
                    let one = gpu.draw(scene, &Settings { msaa: 1, ..settings.clone() });
                    let four = gpu.draw(scene, settings);
                    // Bit for bit, but for one difference: lavapipe rounds values otherwise where it interpolates to a centroid than where to a
                    // centre, which moves where a texture is sampled, and a layer's weight.
                    let weighted = scene.materials[0].alpha < 1.0 && settings.transparency == Transparency::Oit;
                    let rounded = weighted || !scene.textures.is_empty();
                    for (x, y) in places(&one).filter(|&(x, y)| inside(x, y)) {
                        let what = format!("{way}, linear {} ({x}, {y})", base.output.is_linear());
                        if base.output.is_linear() {
                            let (one, four) = (nits(&one, x, y), nits(&four, x, y));
                            let bound = if rounded { one.max_element() / f64::from(1 << 18) } else { 0.0 };
                            assert!((one - four).abs().max_element() <= bound, "{what}: {one} and {four}");
                        } else {
                            let (one, four) = (code(&one, x, y), code(&four, x, y));
                            let most = one.into_iter().zip(four).map(|(one, four)| one.abs_diff(four)).max();
                            assert!(most <= Some(u8::from(weighted)), "{what}: {one:?} and {four:?}");
                        }
                    }
                }
            }
            for layout in ["lean", "fat", "float32"] {
                // Both cases use a G-buffer. Otherwise a surface this plain would be lit as it is drawn in the case of one sample.
                let light_path = LightPath::Loop;
                let settings = Settings { gbuffer: gbuffer(layout), light_path, anisotropy: 1, ..display(EDGE, EDGE) };
                let one = gpu.draw(scene, &settings);
                let four = gpu.draw(scene, &Settings { msaa: 4, ..settings });
                for (x, y) in places(&one).filter(|&(x, y)| inside(x, y)) {
                    assert_eq!(code(&one, x, y), code(&four, x, y), "{layout} ({x}, {y})");
                }
            }
        }
    });
}

#[test]
fn the_view_of_complexity_marks_the_pixels_whose_samples_differ() {
    on_gpu(|gpu| {
        for degrees in [5.0, 45.5, 78.0] {
            for layout in ["lean", "fat", "float32"] {
                let scene = edge(degrees);
                let gbuffer = gbuffer(layout);
                let settings = Settings { msaa: 4, gbuffer, view: View::Complexity, ..display(EDGE, EDGE) };
                let picture = gpu.draw(&scene, &settings);
                let mut counted = Complexity { covered: 0, complex: 0 };
                for (x, y) in places(&picture) {
                    let shown = code(&picture, x, y);
                    let (complex, covered) = (shown[0] > 127, shown[2] > 0);
                    counted.covered += usize::from(covered);
                    counted.complex += usize::from(complex);
                    if let Some(samples) = covered_samples(degrees, x, y) {
                        let expected = (!matches!(samples, 0 | 4), samples > 0);
                        assert_eq!((complex, covered), expected, "{layout}, {degrees} degrees, ({x}, {y})");
                    }
                }
                assert_eq!(Complexity::of(&picture), counted);
                assert!(counted.share() > 0.02 && counted.share() < 0.2, "{}", counted.share());
            }
        }
    });
}

#[test]
fn a_depth_pre_pass_meets_the_same_samples() {
    on_gpu(|gpu| {
        // Without textures: the driver chooses where in a partly covered pixel a texture is sampled, and may go by the samples that pass the depth
        // test.
        for spec in ["builtin:spheres?rows=2&columns=2", "builtin:cornell"] {
            let scene = open(spec);
            let settings = Settings { msaa: 4, light_path: LightPath::Loop, ..own(&scene, 64, 48) };
            let without = gpu.draw(&scene, &Settings { depth_prepass: Some(false), ..settings.clone() });
            assert_eq!(without, gpu.draw(&scene, &Settings { depth_prepass: Some(true), ..settings }), "{spec}");
        }
    });
}
