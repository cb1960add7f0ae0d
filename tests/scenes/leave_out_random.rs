//! What a plan keeps without need changes no bit of scenes that nobody chose: smooth models in random poses, under lights whose shadows graze them.

use crate::common::compare::{assert_identical, largest_code_difference};
use crate::common::gpu::on_gpu;
use crate::common::stage::{add, gbuffer, own, plane, point, sun};
use crate::common::{one_of, tries_all};
use crate::leave_out::bumps;
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    Falloff, HdrFormat, Keep, Light, LightPath, Material, OptionalPart, Scene, Settings, ShadowFilter, ShadowSettings,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

const SIZE: [u32; 2] = [96, 54];

/// Random numbers from 0 up to 1.
struct UnitRandom(fastrand::Rng);

impl UnitRandom {
    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * self.0.f64()
    }

    fn turn(&mut self) -> DQuat {
        let axis = DVec3::from_array([0; 3].map(|_| self.between(-1.0, 1.0)));
        DQuat::from_axis_angle(axis.normalize_or(DVec3::Z), self.between(0.0, 6.0))
    }

    fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.0.usize(..values.len())]
    }
}

/// A ring and a ball whose normals differ in every pixel, over a floor, with a sun and a lamp. Shadow maps are coarse, so that many pixels lie beside
/// an edge of a texel.
fn smooth(seed: u64) -> (Scene, Settings) {
    let mut random = UnitRandom(fastrand::Rng::with_seed(seed));
    let slanted = DVec3::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(0.3, 1.0));
    let place = DVec3::new(random.between(-1.0, 1.0), random.between(-0.6, 0.6), random.between(0.8, 1.6));
    let lamp = Light { casts_shadow: true, ..point(place, 2.0, Some(6.0), Falloff::InverseSquare) };
    let mut scene = plane(Material::default(), vec![sun(slanted, 3.0), lamp]);
    scene.name = format!("smooth {seed}");
    let tinted = Material { base_color: Vec3::new(0.7, 0.6, 0.4), ..Material::default() };
    let at = |x: f64, turn| DAffine3::from_rotation_translation(turn, DVec3::new(x, 0.05, 0.4));
    add(&mut scene, shapes::torus(0.35, 0.13, 32), tinted.clone(), at(-0.4, random.turn()));
    add(&mut scene, shapes::sphere(0.3, 24), tinted, at(0.5, random.turn()));
    let path = random.pick(&[
        LightPath::Clustered,
        LightPath::Loop,
        LightPath::PerLight,
        LightPath::Compute,
        LightPath::Forward,
    ]);
    let shadows = ShadowSettings {
        filter: random.pick(&[ShadowFilter::None, ShadowFilter::Box2, ShadowFilter::Box5, ShadowFilter::Poisson]),
        size: random.pick(&[128, 256]),
        ..own(&scene, SIZE[0], SIZE[1]).shadows
    };
    let msaa = if path == LightPath::PerLight { 1 } else { random.pick(&[1, 1, 4]) };
    let layout = gbuffer(random.pick(&["lean", "lean", "fat", "lean,normal=oct8"]));
    let hdr_format = HdrFormat::Rgba32f;
    let settings =
        Settings { light_path: path, shadows, msaa, gbuffer: layout, hdr_format, ..own(&scene, SIZE[0], SIZE[1]) };
    (scene, settings)
}

/// `make test` takes a few seeds, because the driver compiles two new plans for each.
fn seeds(few: u64, all: u64) -> std::ops::Range<u64> {
    0..if tries_all() { all } else { few }
}

#[test]
fn smooth_models_have_the_same_bits_in_the_full_plan() {
    on_gpu(|gpu| {
        for seed in seeds(2, 60) {
            let (scene, settings) = smooth(seed);
            let lean = gpu.draw(&scene, &settings);
            // An HDR target has samples averaged before they are rounded to 8 bits, and not after: one code. The test below has these.
            let is_rounded = settings.msaa > 1 && settings.light_path != LightPath::Compute;
            let all = if is_rounded { without_hdr() } else { Keep::ALL };
            let alone = Keep::NONE.with(OptionalPart::GeometricNormalChannels);
            for &keep in one_of(&[all, alone], seed as usize) {
                let kept = gpu.draw(&scene, &Settings { keep, ..settings.clone() });
                assert_identical(&lean, &kept, &format!("{} with {keep}", scene.name));
            }
        }
    });
}

/// Keeps every part that does not need an HDR target.
fn without_hdr() -> Keep {
    let hdr = [OptionalPart::HdrTarget, OptionalPart::Transparent, OptionalPart::Emissive];
    hdr.iter().fold(Keep::ALL, |keep, &part| keep.without(part))
}

/// The lean plan rounds each sample's shown value to 8 bits, and the hardware averages them as light. Rounding errs by half a code of a sample at most, which is
/// half the slope of light by code there. Above sRGB's linear toe that slope is concave in the light, so its mean over the samples is at most the slope at
/// their mean (Jensen): the mean errs by half a code at most. If samples lie on both sides of the toe's end, it errs by two thirds of a code at most. Half floats add a sixteenth.
/// Values that differ by less than a code are rounded to codes that differ by one at most.
#[test]
fn edges_of_several_samples_differ_by_one_code_at_most_in_the_full_plan() {
    on_gpu(|gpu| {
        for seed in seeds(2, 40) {
            let (scene, settings) = smooth(1000 + seed);
            let paths = [LightPath::Loop, LightPath::Forward, LightPath::Clustered];
            for &light_path in one_of(&paths, seed as usize) {
                for hdr_format in [HdrFormat::Rgba32f, HdrFormat::Rgba16f] {
                    let settings = Settings { msaa: 4, light_path, hdr_format, ..settings.clone() };
                    let lean = gpu.draw(&scene, &settings);
                    let full = gpu.draw(&scene, &Settings { keep: Keep::ALL, ..settings });
                    let (codes, place) = largest_code_difference(&lean, &full);
                    assert!(codes <= 1, "{}, {light_path}, {hdr_format:?}: {codes} codes at {place:?}", scene.name);
                }
            }
        }
    });
}

/// A normal map on one surface leaves the shadows on the others as they are, to the last bit.
#[test]
fn a_bumpy_neighbour_moves_no_shadow_of_smooth_models() {
    on_gpu(|gpu| {
        for seed in seeds(1, 30) {
            let (mut scene, settings) = smooth(seed);
            // It lies below the floor, where neither the camera nor a light sees it.
            let hidden = DAffine3::from_translation(DVec3::new(0.0, 0.0, -1.0));
            add(&mut scene, shapes::cuboid([0.2; 3]), Material::default(), hidden);
            scene.meshes.last_mut().expect("the box").compute_tangents();
            let plain = gpu.draw(&scene, &settings);
            scene.textures.push(bumps());
            scene.materials.last_mut().expect("the box's").normal_texture = Some(scene.textures.len() - 1);
            let bumpy = gpu.draw(&scene, &settings);
            assert_identical(&plain, &bumpy, &scene.name);
        }
    });
}
