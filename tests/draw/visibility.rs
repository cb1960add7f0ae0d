//! Surfaces that are looked up by triangle number equal the surfaces of a G-buffer of 32-bit floats: each kind of surface on the light path
//! `visibility` compared with `compute`.

use afterlight::frame::Picture;
use afterlight::plan::FramePlan;
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Brdf, Camera, Falloff, LightPath, Look, Material, Output, Projection, Scene, Settings,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use crate::common::gpu::{Gpu, nits, on_gpu, places};
use crate::common::some_of;
use crate::common::stage::{add, gbuffer, lambert, open, own, plane, point, sun};

const SIZE: [u32; 2] = [163, 91];

fn drawn(gpu: &Gpu, scene: &Scene, light_path: LightPath, settings: &Settings) -> Picture {
    gpu.draw(scene, &Settings { light_path, gbuffer: gbuffer("float32"), ..settings.clone() })
}

/// The share of the pixels that differ by more than `bound` of the brighter one.
fn differing(one: &Picture, other: &Picture, bound: f64) -> f64 {
    let differs = |&(x, y): &(u32, u32)| {
        let (a, b) = (nits(one, x, y), nits(other, x, y));
        (a - b).abs().max_element() > bound * a.max(b).max_element().max(1e-3)
    };
    places(one).filter(differs).count() as f64 / f64::from(one.size[0] * one.size[1])
}

/// Look-ups of textures have exact derivatives here, and rasterizers take differences over 2x2 pixels: levels differ a little wherever a texture has
/// several.
#[test]
fn pictures_are_those_of_a_gbuffer_of_single_floats() {
    on_gpu(|gpu| {
        for name in ["hall", "cornell", "spheres", "field?objects=60&lights=30", "triangle"] {
            let scene = open(&format!("builtin:{name}"));
            if !gpu.takes(LightPath::Visibility, &scene) {
                eprintln!("{name}: this device looks no textures up by their numbers");
                continue;
            }
            let has_textures = scene.materials.iter().any(|own| own.textures().next().is_some());
            let settings =
                Settings { output: Output::Nits, samples: 1, anisotropy: 1, ..own(&scene, SIZE[0], SIZE[1]) };
            let [looked_up, stored] =
                [LightPath::Visibility, LightPath::Compute].map(|path| drawn(gpu, &scene, path, &settings));
            assert!(places(&stored).any(|(x, y)| nits(&stored, x, y).max_element() > 0.0), "{name} is black");
            let (bound, most) = if has_textures { (0.05, 0.05) } else { (1e-4, 5e-3) };
            let share = differing(&looked_up, &stored, bound);
            eprintln!("{name}: {share:.4} of the pixels differ by more than {bound}");
            assert!(share <= most, "{name}: {share}");
        }
    });
}

/// The samples of one triangle are shaded once. `compute` also shades samples of several triangles once if they belong to one smooth surface.
#[test]
#[ignore = "test-all: the comparison with rays, or with the frame that leaves nothing out, stays"]
fn several_samples_are_as_near_to_many_frames_as_those_of_a_gbuffer() {
    on_gpu(|gpu| {
        for name in some_of(vec!["cornell", "hall", "spheres", "field?objects=60&lights=30"], 2) {
            let scene = open(&format!("builtin:{name}"));
            if !gpu.takes(LightPath::Visibility, &scene) {
                eprintln!("{name}: this device looks no textures up by their numbers");
                continue;
            }
            let base = Settings { output: Output::Nits, anisotropy: 1, ..own(&scene, SIZE[0], SIZE[1]) };
            let many = Settings { samples: 32, light_path: LightPath::Loop, ..base.clone() };
            let many = gpu.renderer(&scene, &many).picture(&scene.camera, || ()).expect("a picture");
            let off = |light_path, msaa| {
                differing(&drawn(gpu, &scene, light_path, &Settings { msaa, ..base.clone() }), &many, 0.05)
            };
            let [looked_up, stored] = [LightPath::Visibility, LightPath::Compute].map(|path| off(path, 4));
            let single = off(LightPath::Visibility, 1);
            eprintln!(
                "{name}: of the pixels {looked_up:.4} are off, by a G-buffer {stored:.4}, of one sample {single:.4}"
            );
            assert!(looked_up <= 1.02 * stored + 1e-3 && stored < single, "{name}: {looked_up}, {stored}, {single}");
        }
    });
}

/// Mirrored and turned objects, both sides of a sheet, colours of vertices, looks, every model, unlit and glowing surfaces, in parallel rays, too.
#[test]
fn each_kind_of_surface_is_looked_up() {
    on_gpu(|gpu| {
        let lamp = point(DVec3::new(0.4, 0.6, 1.4), 3.0, Some(5.0), Falloff::InverseSquare);
        let mut scene = plane(lambert(0.5), vec![sun(DVec3::new(0.3, 0.5, 1.0), 2.0), lamp]);
        scene.name = "surfaces".into();
        let shiny = |brdf| Material {
            brdf,
            specular: Vec3::splat(0.3),
            shininess: 20.0,
            roughness: 0.4,
            ..Material::default()
        };
        let kinds = [
            shiny(Brdf::CookTorrance),
            shiny(Brdf::Phong),
            shiny(Brdf::BlinnPhong),
            Material { metallic: 1.0, ..shiny(Brdf::CookTorrance) },
            Material { reflectance: Vec3::splat(0.3), grazing: 0.8, ..shiny(Brdf::CookTorrance) },
            Material { unlit: true, ..lambert(0.7) },
            Material { emissive: Vec3::new(0.5, 0.2, 0.0), ..lambert(0.2) },
            Material { two_sided: true, ..lambert(0.8) },
            Material { two_sided: true, alpha_mode: AlphaMode::Mask { cutoff: 0.4 }, ..lambert(0.9) },
        ];
        for (index, material) in kinds.into_iter().enumerate() {
            let (column, row) = ((index % 3) as f64, (index / 3) as f64);
            let shape = if index >= 7 { shapes::plane([0.5; 2]) } else { shapes::torus(0.18, 0.07, 24) };
            let mirror = DVec3::new(if index % 3 == 1 { -1.3 } else { 0.8 }, 1.1, 0.7);
            let turn = DQuat::from_rotation_x(if index == 7 { 2.2 } else { 0.9 });
            let place = DVec3::new(column * 0.6 - 0.6, row * 0.5 - 0.5, 0.4);
            add(&mut scene, shape, material, DAffine3::from_scale_rotation_translation(mirror, turn, place));
            let object = scene.objects.last_mut().expect("was added");
            object.receives_shadow = index != 2;
            object.look = Some(Look { tint: Vec3::new(1.0, 0.7, 0.4), selected: index == 3, ..Look::default() });
            let mesh = &mut scene.meshes[object.mesh];
            if index % 2 == 0 {
                let shade = |at: &[f32; 3]| [0.5 + at[0], 0.8, 0.4, 0.5 + 2.0 * at[2]];
                mesh.colors = mesh.positions.iter().map(shade).collect();
            }
        }
        let parallel = Camera { projection: Projection::orthographic(2.4), ..scene.camera };
        for (name, camera) in [("perspective", scene.camera), ("parallel", parallel)] {
            let scene = Scene { camera, ..scene.clone() };
            for depth_prepass in [Some(false), Some(true)] {
                let settings = Settings { output: Output::Nits, depth_prepass, ..own(&scene, SIZE[0], SIZE[1]) };
                let [looked_up, stored] =
                    [LightPath::Visibility, LightPath::Compute].map(|path| drawn(gpu, &scene, path, &settings));
                let share = differing(&looked_up, &stored, 1e-4);
                // Edges of shadows and the slopes of highlights.
                assert!(share < 5e-3, "{name} {depth_prepass:?}: {share}");
            }
        }
    });
}

/// Objects that move and look otherwise, meshes in levels of detail, and a view of another size are looked up anew.
#[test]
fn what_changes_is_looked_up_anew() {
    on_gpu(|gpu| {
        let scene = open("builtin:field?objects=40&lights=6&detail=3");
        let settings = Settings {
            light_path: LightPath::Visibility,
            output: Output::Nits,
            lod: 2.0,
            ..own(&scene, SIZE[0], SIZE[1])
        };
        let mut renderer = gpu.renderer(&scene, &settings);
        assert!(renderer.plan().meshes.has_levels());
        let mut moved = scene.clone();
        for frame in 0..3 {
            renderer.render(&scene.camera).unwrap_or_else(|error| panic!("frame {frame}: {error}"));
        }
        for (index, shift) in [(3, 1.0), (7, -2.0), (20, 0.5)] {
            let transform = DAffine3::from_translation(DVec3::Y * shift) * moved.objects[index].transform;
            renderer.move_object(&mut moved, index, &transform).unwrap_or_else(|error| panic!("{error}"));
        }
        renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{error}"));
        let followed = renderer.read_back().unwrap_or_else(|error| panic!("{error}"));
        let anew = gpu.draw(&moved, &settings);
        assert!(differing(&followed, &anew, 1e-5) == 0.0, "{}", differing(&followed, &anew, 1e-5));
        assert!(differing(&followed, &gpu.draw(&scene, &settings), 1e-2) > 1e-3, "nothing moved");
    });
}

/// A scene that was uploaded for a path without look-ups cannot be looked up, so this change uploads it anew.
#[test]
#[ignore = "test-all: the comparison with rays, or with the frame that leaves nothing out, stays"]
fn a_renderer_changes_to_the_path_and_from_it() {
    on_gpu(|gpu| {
        for name in ["spheres", "hall"] {
            let scene = open(&format!("builtin:{name}"));
            if !gpu.takes(LightPath::Visibility, &scene) {
                continue;
            }
            let on = |light_path| Settings { light_path, output: Output::Nits, ..own(&scene, SIZE[0], SIZE[1]) };
            let mut renderer = gpu.renderer(&scene, &on(LightPath::Compute));
            for path in [LightPath::Visibility, LightPath::Loop, LightPath::Visibility] {
                renderer.change_settings(&scene, &on(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
                renderer.render(&scene.camera).unwrap_or_else(|error| panic!("{path}: {error}"));
            }
            let changed = renderer.read_back().unwrap_or_else(|error| panic!("{error}"));
            assert!(changed == gpu.draw(&scene, &on(LightPath::Visibility)), "{name}");
        }
    });
}

#[test]
fn what_cannot_be_looked_up_is_refused_in_a_sentence() {
    let refused = |scene: &Scene, change: &dyn Fn(&mut afterlight::plan::Capabilities)| {
        let mut device = crate::common::capabilities();
        change(&mut device);
        let settings = Settings { light_path: LightPath::Visibility, ..own(scene, 64, 36) };
        FramePlan::of(scene, &settings, &device).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let hall = open("builtin:hall");
    assert_eq!(refused(&hall, &|_| {}), "");
    let told =
        |text: &str, needs: &str| assert!(text.contains(needs) && text.contains("the light path visibility"), "{text}");
    told(&refused(&hall, &|device| device.non_uniform_textures = 16), "it can index 13");
    told(&refused(&hall, &|device| device.storage_buffers = 8), "at most 8");
    told(&refused(&hall, &|device| device.storage_range = 4096), "sees at most 4096");
    let mut seaweed = open("builtin:seaweed");
    seaweed.materials.iter_mut().for_each(|own| own.alpha_mode = AlphaMode::Opaque);
    (seaweed.sky, seaweed.emitters) = (None, Vec::new());
    told(&refused(&seaweed, &|_| {}), "deformed");
}
