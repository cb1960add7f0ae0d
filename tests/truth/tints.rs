//! Shadows of transparent surfaces on the device against the truth in 64 bits: the light that passes through them onto a wall, and the cases in which
//! none does.

use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::stage::{add, beam, exact, lambert, plane, point, rectangle, spot, sun};
use afterlight::scene::builtin::shapes::{self, MeshBuilder};
use afterlight::scene::{
    AlphaMode, CastsShadow, ColorSpace, Falloff, Light, LightPath, Material, Refraction, Sampler, Scene, Settings,
    ShadowFilter, ShadowSettings, Texture, TextureSlot, UvMap,
};
use afterlight_truth::reference::{CameraView, Effects, Mode, Reference, Smith, TruthOptions};
use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3};

const SIZE: [u32; 2] = [65, 65];
const POINT: TruthOptions = TruthOptions { mode: Mode::Point, smith: Smith::HeightCorrelated };
const TOWARDS_SUN: DVec3 = DVec3::new(0.25, 0.1, 1.0);

fn settings(light_path: LightPath, filter: ShadowFilter) -> Settings {
    let shadows = ShadowSettings { tinted: true, filter, size: 1024, cascades: 1, ..ShadowSettings::default() };
    Settings { light_path, shadows, ..exact(SIZE[0], SIZE[1]) }
}

/// The wall z = 0, and surfaces between it and a light, behind the eye.
fn wall(light: Light, veils: Vec<(MeshBuilder, Material, DAffine3)>) -> Scene {
    let mut scene = plane(lambert(0.5), vec![light]);
    veils.into_iter().for_each(|(mesh, material, transform)| add(&mut scene, mesh, material, transform));
    scene
}

/// Behind the eye, which looks at the middle of the shadow.
fn above() -> DVec3 {
    TOWARDS_SUN * 3.0
}

fn at(place: DVec3) -> DAffine3 {
    DAffine3::from_translation(place)
}

fn turned(place: DVec3, radians: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_y(radians), place)
}

fn sheet(half: f64) -> MeshBuilder {
    rectangle([-half; 2], [half; 2], 0.0)
}

fn thin(color: Vec3) -> Material {
    Material { base_color: color, ..Material::clear_glass(Refraction::THIN) }
}

fn veil(alpha: f32) -> Material {
    Material { alpha_mode: AlphaMode::Blend, alpha, ..lambert(0.8) }
}

fn body(thickness: f32) -> Material {
    let green = Refraction { thickness, color: Vec3::new(0.2, 0.8, 0.3), distance: 0.4, ..Refraction::THIN };
    Material::clear_glass(green)
}

/// Returns the distances from the truth of the pixels in a shadow, of the light that arrives without the veils, in order; and the share of such pixels. All others are as without veils.
fn differences(gpu: &Gpu, scene: &Scene, settings: &Settings) -> (Vec<f64>, f64) {
    let picture = gpu.draw(scene, settings);
    let view = CameraView { camera: scene.camera, size: picture.size };
    let truth = |tints| {
        let effects = Effects { tints, ..Effects::default() };
        let reference = Reference::new(scene).expect("a scene").with_effects(effects);
        reference.render(&view, &POINT, &|_, _| {}).radiance
    };
    let (shadowed, lit) = (truth(true), truth(false));
    let of = |all: &[[f64; 3]], (x, y): (u32, u32)| DVec3::from_array(all[(y * SIZE[0] + x) as usize]);
    let relative = |light: DVec3, place| ((light - of(&shadowed, place)) / of(&lit, place)).abs().max_element();
    let (shaded, open): (Vec<_>, Vec<_>) = places(&picture).partition(|&place| relative(of(&lit, place), place) > 0.01);
    let sorted = |places: &[(u32, u32)]| {
        let mut off: Vec<f64> = places.iter().map(|&(x, y)| relative(nits(&picture, x, y), (x, y))).collect();
        off.sort_by(f64::total_cmp);
        off
    };
    // But for edges.
    assert!(quantile(&sorted(&open), 0.75) < 1e-5, "light that no veil dims is dimmed");
    (sorted(&shaded), shaded.len() as f64 / f64::from(SIZE[0] * SIZE[1]))
}

/// 0 of nothing.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted.get((sorted.len().saturating_sub(1) as f64 * share) as usize).copied().unwrap_or(0.0)
}

#[test]
fn a_light_through_sheets_and_bodies_has_their_color_as_by_rays() {
    on_gpu(|gpu| {
        let red = || thin(Vec3::new(0.9, 0.2, 0.1));
        let blue = || thin(Vec3::new(0.1, 0.3, 0.9));
        let sunlight = || sun(TOWARDS_SUN, 4.0);
        let near = |along: f64| TOWARDS_SUN * along;
        let of_many_alphas = || {
            let mut scene = wall(sunlight(), vec![(sheet(0.7), veil(1.0), at(above()))]);
            let colors = [[1.0, 0.2, 0.1, 0.2], [0.2, 1.0, 0.3, 0.4], [0.1, 0.3, 1.0, 0.6], [0.8, 0.8, 0.2, 0.8]];
            scene.meshes[1].colors = colors.to_vec();
            scene
        };
        let through = |veils| wall(sunlight(), veils);
        // A texture that is smooth from texel to texel in colour and alpha, mapped straight or turned.
        let painted = |map: UvMap| {
            let mut scene = wall(sunlight(), vec![(sheet(0.7), red(), at(above()))]);
            let texel = |index: u32| [(index % 8 * 30) as u8, (index / 8 * 30) as u8, 200, (index % 8 * 20) as u8];
            let (size, texels) = ([8, 8], (0..64).flat_map(texel).collect::<Vec<u8>>());
            let color_space = ColorSpace::Srgb;
            let paint =
                Texture { name: "paint".into(), size, color_space, sampler: Sampler::default(), texels: texels.into() };
            scene.textures.push(paint);
            let material = &mut scene.materials[1];
            (material.base_color, material.base_color_texture, material.alpha) = (Vec3::ONE, Some(0), 1.0);
            material.uv_maps[TextureSlot::BaseColor as usize] = map;
            scene
        };
        let turned_map = UvMap { rotation: 0.6, scale: DVec2::splat(0.8), ..UvMap::IDENTITY };
        let cases = [
            ("a sheet", through(vec![(sheet(0.7), red(), at(above()))]), [1e-3, 2e-3]),
            ("a tilted sheet", through(vec![(sheet(0.7), red(), turned(above(), 1.0))]), [1e-3, 2e-3]),
            (
                "two sheets",
                through(vec![(sheet(0.6), red(), at(above())), (sheet(0.6), blue(), at(near(4.0) + DVec3::X * 0.4))]),
                [1e-3, 2e-3],
            ),
            ("a veil", through(vec![(sheet(0.7), veil(0.6), at(above()))]), [1e-3, 2e-3]),
            ("a veil of many alphas", of_many_alphas(), [1e-3, 2e-3]),
            ("a painted sheet", painted(UvMap::IDENTITY), [4e-3, 1e-2]),
            ("a painted sheet, turned", painted(turned_map), [4e-3, 1e-2]),
            ("a ball", through(vec![(shapes::sphere(0.7, 128), body(1.4), at(above()))]), [5e-3, 4e-2]),
            ("a pane", through(vec![(shapes::cuboid([3.0, 3.0, 0.4]), body(0.4), turned(above(), 0.5))]), [1e-3, 2e-3]),
        ];
        for (turn, (name, scene, [half, most])) in cases.into_iter().enumerate() {
            for path in [LightPath::Loop, LightPath::Forward, LightPath::Clustered, LightPath::PerLight]
                .into_iter()
                .skip(turn % 2)
                .step_by(2)
            {
                let (off, changed) = differences(gpu, &scene, &settings(path, ShadowFilter::Box2));
                println!(
                    "{name}, {path}: median {:.1e}, 0.9 {:.1e}, changed {changed:.2}",
                    quantile(&off, 0.5),
                    quantile(&off, 0.9)
                );
                assert!(quantile(&off, 0.5) <= half && quantile(&off, 0.9) <= most, "{name}, {path}");
                assert!(changed > 0.1, "{name}: {changed}");
            }
        }
    });
}

#[test]
fn lamps_and_beams_of_every_filter_are_tinted() {
    on_gpu(|gpu| {
        let lights = [
            ("a point light", point(DVec3::new(0.3, 0.2, 5.0), 50.0, None, Falloff::InverseSquare)),
            ("a spot light", spot(DVec3::new(0.3, 0.2, 5.0), 50.0, 20.0, 25.0)),
            ("a beam", beam(DVec3::new(0.1, 0.1, 6.0), DVec3::NEG_Z, 4.0, [2.0, 0.1], None)),
        ];
        let filters =
            [ShadowFilter::None, ShadowFilter::Box3, ShadowFilter::Box5, ShadowFilter::Poisson, ShadowFilter::Pcss];
        for (name, light) in lights {
            let red = || thin(Vec3::new(0.9, 0.2, 0.1));
            let sheets = || vec![(sheet(0.25), red(), turned(DVec3::new(0.15, 0.1, 3.0), 0.4))];
            // The light has a size, so that the last filter searches for the surfaces that cause its penumbra.
            let scene = wall(Light { casts_shadow: true, size: 0.05, ..light.clone() }, sheets());
            let (off, changed) = differences(gpu, &scene, &settings(LightPath::Loop, ShadowFilter::Pcss));
            println!("{name} of a size: median {:.1e}, changed {changed:.2}", quantile(&off, 0.5));
            assert!(quantile(&off, 0.5) <= 0.02 && changed > 0.05, "{name} of a size");
            let scene = wall(Light { casts_shadow: true, ..light }, sheets());
            for filter in filters {
                let (off, changed) = differences(gpu, &scene, &settings(LightPath::Loop, filter));
                // Wide filters blur the edges.
                println!("{name}, {filter}: median {:.1e}, changed {changed:.2}", quantile(&off, 0.5));
                assert!(quantile(&off, 0.5) <= 1e-3 && changed > 0.05, "{name}, {filter}");
            }
        }
    });
}

#[test]
fn what_lies_before_a_sheet_or_behind_an_opaque_wall_has_no_tint() {
    on_gpu(|gpu| {
        let red = || thin(Vec3::new(0.9, 0.2, 0.1));
        let behind = vec![(sheet(2.0), red(), at(DVec3::NEG_Z * 0.5))];
        let (off, changed) =
            differences(gpu, &wall(sun(TOWARDS_SUN, 4.0), behind), &settings(LightPath::Loop, ShadowFilter::Box2));
        assert!(quantile(&off, 1.0) < 1e-5 && changed == 0.0, "{:?}", off.last());
        // A sheet that casts no shadow, and one whose back alone is turned to the light.
        let mut none = wall(sun(TOWARDS_SUN, 4.0), vec![(sheet(0.7), red(), at(above()))]);
        none.objects[1].casts_shadow = CastsShadow::No;
        let back = wall(sun(TOWARDS_SUN, 4.0), vec![(sheet(0.7), veil(0.5), turned(above(), std::f64::consts::PI))]);
        for scene in [none, back] {
            let (off, changed) = differences(gpu, &scene, &settings(LightPath::Loop, ShadowFilter::Box2));
            assert!(quantile(&off, 1.0) < 1e-5 && changed == 0.0, "{:?}", off.last());
        }
    });
}

#[test]
fn what_stands_between_a_light_and_a_sheet_is_lit_whole() {
    on_gpu(|gpu| {
        let red = thin(Vec3::new(0.9, 0.2, 0.1));
        // The camera sees a sheet, and a card between it and the light.
        let mut scene = wall(sun(DVec3::Z, 4.0), vec![(sheet(0.8), red, at(DVec3::Z * 0.2))]);
        add(&mut scene, sheet(0.3), lambert(0.5), at(DVec3::Z * 0.4));
        scene.objects[2].casts_shadow = CastsShadow::No;
        let picture = gpu.draw(&scene, &settings(LightPath::Loop, ShadowFilter::Box2));
        // Lambert: 0.5 / pi of 4 lux.
        let middle = nits(&picture, SIZE[0] / 2, SIZE[1] / 2);
        assert!((middle - DVec3::splat(2.0 / std::f64::consts::PI)).abs().max_element() < 1e-5, "{middle}");
    });
}

#[test]
fn bodies_under_a_lamp_and_mirrored_ones_are_as_by_rays() {
    on_gpu(|gpu| {
        let lamp =
            || Light { casts_shadow: true, ..point(DVec3::new(0.3, 0.2, 6.0), 50.0, None, Falloff::InverseSquare) };
        let mirrored = at(above()) * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let front = {
            let mut scene = wall(lamp(), vec![(shapes::sphere(0.4, 128), body(0.8), at(DVec3::new(0.15, 0.1, 3.0)))]);
            scene.objects[1].casts_shadow = CastsShadow::Front;
            scene
        };
        let cases = [
            (
                "a ball under a lamp",
                wall(lamp(), vec![(shapes::sphere(0.4, 128), body(0.8), at(DVec3::new(0.15, 0.1, 3.0)))]),
            ),
            ("a ball whose front alone casts", front),
            (
                "a mirrored pane",
                wall(sun(TOWARDS_SUN, 4.0), vec![(shapes::cuboid([3.0, 3.0, 0.4]), body(0.4), mirrored)]),
            ),
            ("a mirrored veil", wall(sun(TOWARDS_SUN, 4.0), vec![(sheet(0.7), veil(0.5), mirrored)])),
        ];
        for (name, scene) in cases {
            let (off, changed) = differences(gpu, &scene, &settings(LightPath::Loop, ShadowFilter::Box2));
            println!(
                "{name}: median {:.1e}, 0.75 {:.1e}, changed {changed:.2}",
                quantile(&off, 0.5),
                quantile(&off, 0.75)
            );
            assert!(quantile(&off, 0.5) <= 5e-3 && quantile(&off, 0.75) <= 1e-2 && changed > 0.1, "{name}");
        }
    });
}
