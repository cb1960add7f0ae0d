//! Values of pixels: exposed light, values of buffers, and the number of the triangle that is seen. Measured errors rest on these figures.

use crate::common::gpu::{Gpu, bytes, floats, nits, on_gpu, places};
use crate::common::scenes::with_transparent;
use crate::common::some_of;
use crate::common::stage::{EYE, add, exact, gbuffer, lambert, open, own, rectangle, seen, stage};
use afterlight::passes::curves::{encode_srgb, tone_map};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, HdrFormat, LightPath, Material, Output, Resolve, Scene, Settings, Tonemap, Transparency, View,
    exposure_scale, metered_ev100,
};
use glam::{DAffine3, DMat3, DVec3, Vec3};

const SIZE: [u32; 2] = [64, 36];

/// A deferred frame of a scene's own settings, at this exposure.
fn small(scene: &Scene, ev100: f32) -> Settings {
    Settings { exposure: Some(ev100), light_path: LightPath::Loop, ..own(scene, SIZE[0], SIZE[1]) }
}

fn floats_of(gpu: &Gpu, scene: &Scene, settings: &Settings, output: Output) -> Vec<f32> {
    floats(&gpu.draw(scene, &Settings { output, ..settings.clone() })).to_vec()
}

#[test]
#[ignore = "test-all: one more light path, output or camera"]
fn exposed_light_is_nits_times_the_exposure_where_nothing_keeps_it_in_between() {
    on_gpu(|gpu| {
        for (spec, msaa) in [("builtin:spheres", 1), ("builtin:spheres", 4), ("builtin:field?objects=30&lights=40", 1)]
        {
            let scene = open(spec);
            let ev100 = metered_ev100(&scene);
            for light_path in [LightPath::Loop, LightPath::Clustered, LightPath::Compute, LightPath::Forward] {
                let settings = Settings { light_path, msaa, ..small(&scene, ev100) };
                assert_eq!(gpu.renderer(&scene, &settings).plan().hdr, None, "{spec} {light_path}");
                let light = floats_of(gpu, &scene, &settings, Output::Nits);
                let exposed = floats_of(gpu, &scene, &settings, Output::Exposed);
                let scale = f64::from(exposure_scale(ev100));
                for (light, exposed) in light.chunks_exact(4).zip(exposed.chunks_exact(4)) {
                    for channel in 0..3 {
                        let expected = f64::from(light[channel]) * scale;
                        let error = (f64::from(exposed[channel]) - expected).abs();
                        // Rounded once; the mean of samples a few times.
                        assert!(error <= expected * 4e-7, "{spec} {light_path}: {} for {expected}", exposed[channel]);
                    }
                }
                assert!(exposed.iter().any(|value| *value > 0.01 && *value < 1.0), "{spec} {light_path}: no light");
            }
        }
    });
}

/// Returns true if a format with `mantissa` bits of mantissa and five bits of exponent can hold the float.
fn is_of_few_bits(value: f32, mantissa: u32) -> bool {
    // Subnormal numbers, below 2^-14, have the same spacing as the smallest normal ones.
    let step = 2f32.powi(value.log2().floor().max(-14.0) as i32 - mantissa as i32);
    value == 0.0 || (value / step).fract() == 0.0
}

#[test]
fn exposed_light_has_the_bits_of_the_format_that_the_frame_keeps_it_in() {
    on_gpu(|gpu| {
        let scene = open("builtin:cornell");
        for light_path in [LightPath::Loop, LightPath::Clustered] {
            let of = |hdr_format| {
                let settings = Settings { hdr_format, light_path, ..small(&scene, 4.0) };
                let plan = gpu.renderer(&scene, &Settings { output: Output::Exposed, ..settings.clone() });
                assert!(plan.plan().hdr.is_some() && plan.plan().emissive);
                floats_of(gpu, &scene, &settings, Output::Exposed)
            };
            let on_the_grid = |values: &[f32], bits: [u32; 3]| {
                let pixels = values.chunks_exact(4);
                pixels.filter(|pixel| (0..3).all(|channel| is_of_few_bits(pixel[channel], bits[channel]))).count()
            };
            let all = (SIZE[0] * SIZE[1]) as usize;
            let packed = of(HdrFormat::B10g11r11);
            assert!(packed.iter().filter(|value| **value > 0.0).count() > all, "all is dark");
            assert_eq!(on_the_grid(&packed, [6, 6, 5]), all);
            let half = of(HdrFormat::Rgba16f);
            assert_eq!(on_the_grid(&half, [10; 3]), all);
            assert!(on_the_grid(&half, [6, 6, 5]) < all / 2);
            assert!(on_the_grid(&of(HdrFormat::Rgba32f), [10; 3]) < all / 2);
        }
    });
}

/// Scenes and settings whose light goes every way that there is.
fn ways() -> Vec<(String, Scene, Settings)> {
    let mut all = Vec::new();
    let mut way = |name: &str, scene: &Scene, change: &dyn Fn(&mut Settings)| {
        let mut settings = small(scene, metered_ev100(scene));
        change(&mut settings);
        all.push((name.to_owned(), scene.clone(), settings));
    };
    let (spheres, cornell) = (open("builtin:spheres"), open("builtin:cornell"));
    for &(name, tonemap) in Tonemap::NAMES {
        way(name, &spheres, &|settings| settings.tonemap = tonemap);
        way(&format!("{name}, glowing"), &cornell, &|settings| settings.tonemap = tonemap);
    }
    for &(name, light_path) in LightPath::NAMES {
        way(name, &spheres, &|settings| settings.light_path = light_path);
        way(&format!("{name}, glowing"), &cornell, &|settings| settings.light_path = light_path);
    }
    for (name, transparency) in [("sorted", Transparency::Sorted), ("oit", Transparency::Oit)] {
        way(name, &with_transparent(spheres.clone()), &|settings| settings.transparency = transparency);
    }
    way("packed floats", &cornell, &|settings| settings.hdr_format = HdrFormat::B10g11r11);
    way("samples averaged as light", &spheres, &|settings| (settings.msaa, settings.resolve) = (4, Resolve::Linear));
    way("light alone", &spheres, &|settings| settings.view = View::Lighting);
    all
}

#[test]
#[ignore = "test-all: one more light path, output or camera"]
fn tone_mapped_on_the_cpu_exposed_light_is_the_picture() {
    on_gpu(|gpu| {
        for (name, scene, settings) in some_of(ways(), 7) {
            let shown = gpu.draw(&scene, &settings);
            let exposed = floats_of(gpu, &scene, &settings, Output::Exposed);
            for (codes, light) in bytes(&shown).chunks_exact(4).zip(exposed.chunks_exact(4)) {
                let mapped = tone_map(Vec3::new(light[0], light[1], light[2]), settings.tonemap);
                for channel in 0..3 {
                    let expected = encode_srgb(f64::from(mapped[channel])) * 255.0;
                    let error = (f64::from(codes[channel]) - expected).abs();
                    assert!(error <= 1.0, "{name}: {} for {expected}", codes[channel]);
                }
            }
        }
    });
}

#[test]
fn several_frames_are_averaged_as_exposed_light() {
    on_gpu(|gpu| {
        let scene = open("builtin:spheres");
        let picture = |output| {
            let settings = Settings { samples: 3, output, ..small(&scene, 5.0) };
            let picture = gpu.renderer(&scene, &settings).picture(&scene.camera, || ()).expect("a picture");
            floats(&picture).to_vec()
        };
        let scale = exposure_scale(5.0);
        for (light, exposed) in
            picture(Output::Nits).iter().zip(picture(Output::Exposed)).filter(|(_, one)| *one != 1.0)
        {
            assert!((light * scale - exposed).abs() <= exposed * 1e-6, "{exposed} for {light} nits");
        }
    });
}

#[test]
fn views_of_buffers_hold_metres_and_unit_vectors_in_a_linear_picture() {
    on_gpu(|gpu| {
        let mut scene = stage();
        let tilted = DAffine3::from_rotation_x(0.5) * DAffine3::from_scale(DVec3::splat(0.7));
        let material =
            Material { metallic: 0.25, roughness: 0.75, base_color: Vec3::new(0.2, 0.4, 0.6), ..Material::default() };
        add(&mut scene, rectangle([-1.0, -1.0], [1.0, 1.0], 0.0), material, tilted);
        let normal = tilted.transform_vector3(DVec3::Z).normalize();
        for (layout, bound) in [("float32", 2e-6), ("lean", 2e-3)] {
            let shown =
                |view| gpu.draw(&scene, &Settings { view, gbuffer: gbuffer(layout), ..exact(SIZE[0], SIZE[1]) });
            let [position, normals, absolute, depth] =
                [View::Position, View::Normal, View::NormalAbsolute, View::Depth].map(shown);
            let [albedo, metallic, roughness] = [View::Albedo, View::Metallic, View::Roughness].map(shown);
            let mut covered = 0;
            for (x, y) in places(&position) {
                let ray = seen(SIZE, x, y) - EYE;
                // The plane through zero.
                let place = ray * (-EYE.dot(normal) / ray.dot(normal));
                let inside = tilted.inverse().transform_point3(EYE + place).abs().max_element();
                let what = format!("{layout} ({x}, {y})");
                if inside > 1.01 {
                    for view in [&position, &normals, &absolute, &depth, &albedo, &metallic, &roughness] {
                        assert_eq!(nits(view, x, y), DVec3::ZERO, "{what}");
                    }
                    continue;
                }
                if inside > 0.99 {
                    continue;
                }
                covered += 1;
                let close = |view, expected: DVec3, bound: f64| {
                    let found = nits(view, x, y);
                    assert!((found - expected).abs().max_element() <= bound, "{what}: {found} for {expected}");
                };
                close(&position, place, 2e-6 * place.length());
                close(&depth, DVec3::splat(-place.z), 2e-6 * place.length());
                close(&normals, normal, bound);
                close(&absolute, normal.abs(), bound);
                close(&albedo, DVec3::new(0.2, 0.4, 0.6), 4e-3);
                close(&metallic, DVec3::splat(0.25), 2e-3);
                close(&roughness, DVec3::splat(0.75), 2e-3);
            }
            assert!(covered > 300, "{covered}");
        }
    });
}

/// Objects that lie before, in and behind one another, some of them never seen.
fn crowd() -> Scene {
    let mut scene = stage();
    let place = |x: f64, y: f64, z: f64| DAffine3::from_translation(DVec3::new(x, y, z));
    add(&mut scene, rectangle([-9.0, -9.0], [9.0, 9.0], -3.0), lambert(0.5), DAffine3::IDENTITY);
    let glass = Material { alpha_mode: AlphaMode::Blend, alpha: 0.5, ..Material::default() };
    add(&mut scene, rectangle([-9.0, -9.0], [9.0, 9.0], 0.9), glass, DAffine3::IDENTITY);
    add(&mut scene, shapes::sphere(0.5, 24), lambert(0.5), place(-0.6, 0.2, 0.0));
    // Behind the camera.
    add(&mut scene, shapes::sphere(0.5, 12), lambert(0.5), place(0.0, 0.0, 9.0));
    add(&mut scene, shapes::torus(0.4, 0.15, 32), lambert(0.5), place(0.5, -0.1, 0.2) * DAffine3::from_rotation_x(0.7));
    add(
        &mut scene,
        shapes::cuboid([0.5, 0.7, 0.3]),
        lambert(0.5),
        place(0.2, 0.5, -0.3) * DAffine3::from_rotation_y(0.4),
    );
    // Turned away, so that it is not drawn, and the same again for both its sides.
    let mirrored = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)));
    add(&mut scene, shapes::cone(0.3, 0.6, 16), lambert(0.5), place(-0.3, -0.6, 0.1) * mirrored);
    add(
        &mut scene,
        rectangle([-0.2, -0.2], [0.2, 0.2], 0.0),
        lambert(0.5),
        place(-0.9, -0.7, 0.0) * DAffine3::from_rotation_y(3.0),
    );
    let both = Material { two_sided: true, ..lambert(0.5) };
    add(
        &mut scene,
        rectangle([-0.2, -0.2], [0.2, 0.2], 0.0),
        both,
        place(0.9, 0.7, 0.0) * DAffine3::from_rotation_y(3.0),
    );
    scene
}

/// Returns the object, numbered from 1, and the triangle, from 0, that a ray meets first, or zeros. Returns none near an edge or where another
/// triangle is as near: there rounding decides.
fn first_hit(scene: &Scene, direction: DVec3) -> Option<[u32; 2]> {
    let mut hits: Vec<(f64, [u32; 2])> = Vec::new();
    for (number, object) in (1..).zip(&scene.objects) {
        let material = &scene.materials[object.material];
        if material.alpha_mode != AlphaMode::Opaque {
            continue;
        }
        let mesh = &scene.meshes[object.mesh];
        let corner = |index: u32| {
            object.transform.transform_point3(mesh.origin + Vec3::from(mesh.positions[index as usize]).as_dvec3())
        };
        for (triangle, indices) in (0..).zip(mesh.indices.chunks_exact(3)) {
            let [a, b, c] = [corner(indices[0]), corner(indices[1]), corner(indices[2])];
            let turned = object.transform.matrix3.determinant().signum();
            let normal = (b - a).cross(c - a) * turned;
            let facing = -direction.dot(normal);
            if facing.abs() < 1e-12 || (facing < 0.0 && !material.two_sided) {
                continue;
            }
            let distance = (a - EYE).dot(normal) / direction.dot(normal);
            let point = EYE + direction * distance;
            // The distance inside of each edge, as a share of the triangle.
            let share =
                |from: DVec3, to: DVec3| (to - from).cross(point - from).dot(normal) * turned / normal.length_squared();
            let inside = share(a, b).min(share(b, c)).min(share(c, a));
            if distance <= 0.125 || inside < -1e-3 {
                continue;
            }
            if inside < 1e-3 {
                hits.push((distance, [u32::MAX; 2]));
            } else {
                hits.push((distance, [number, triangle]));
            }
        }
    }
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    match hits[..] {
        [] => Some([0, 0]),
        [(_, first), ..] if first == [u32::MAX; 2] => None,
        [(near, _), (next, _), ..] if next - near < 1e-4 => None,
        [(_, first), ..] => Some(first),
    }
}

#[test]
fn the_view_of_triangles_numbers_what_rays_meet() {
    on_gpu(|gpu| {
        if !gpu.shows(View::Triangle) {
            return eprintln!("NOT RUN: the device does not number triangles");
        }
        let scene = crowd();
        let size = [160, 96];
        let picture = gpu.draw(&scene, &Settings { view: View::Triangle, ..exact(size[0], size[1]) });
        let (mut sure, mut objects) = (0, std::collections::BTreeSet::new());
        for (x, y) in places(&picture) {
            let Some(expected) = first_hit(&scene, seen(size, x, y) - EYE) else { continue };
            let found = nits(&picture, x, y);
            assert_eq!(found, DVec3::new(f64::from(expected[0]), f64::from(expected[1]), 0.0), "({x}, {y})");
            sure += 1;
            objects.insert(expected[0]);
        }
        assert!(sure > 12_000, "only {sure} pixels could be compared");
        // Neither the glass, nor objects behind the camera or turned away.
        assert_eq!(objects.into_iter().collect::<Vec<_>>(), [1, 3, 5, 6, 7, 9]);
    });
}

#[test]
fn each_triangle_has_a_colour_of_its_own_and_the_sky_is_black() {
    on_gpu(|gpu| {
        if !gpu.shows(View::Triangle) {
            return eprintln!("NOT RUN: the device does not number triangles");
        }
        let mut scene = crowd();
        scene.objects.remove(0);
        let view = |output| Settings { view: View::Triangle, output, ..exact(160, 96) };
        let (shown, numbers) = (gpu.draw(&scene, &view(Output::Srgb8)), gpu.draw(&scene, &view(Output::Nits)));
        let mut colors = std::collections::BTreeMap::new();
        for (code, number) in bytes(&shown).chunks_exact(4).zip(floats(&numbers).chunks_exact(4)) {
            let number = [number[0] as u32, number[1] as u32];
            let before = *colors.entry(number).or_insert([code[0], code[1], code[2]]);
            assert_eq!(before, [code[0], code[1], code[2]], "{number:?}");
        }
        assert_eq!(colors.remove(&[0, 0]), Some([0; 3]));
        let different: std::collections::BTreeSet<_> = colors.values().collect();
        assert!(colors.len() > 100 && different.len() == colors.len(), "{} of {}", different.len(), colors.len());
        assert!(colors.values().all(|color| color.iter().all(|channel| *channel > 60)));
    });
}
