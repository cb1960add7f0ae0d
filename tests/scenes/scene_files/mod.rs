//! Scene files: they are read as docs/SCENES.md says, and a mistake ends in one line that names file, line and key.

mod builtin;
mod clips;
mod document;
mod emitters;
mod lobes;
mod path;
mod refused;
mod sky;

use std::fs;
use std::path::Path;

use afterlight::plan::FramePlan;
use afterlight::scene::file::{self, schema};
use afterlight::scene::{
    Brdf, Camera, CastsShadow, Falloff, Filter, LightKind, Look, OpenOptions, Projection, Refraction, Resolve, Sampler,
    Scene, ShadowFilter, TextureSlot, UvMap, Wrap, open,
};
use glam::{DVec3, Vec3};
use tempfile::TempDir;

use crate::common::capabilities;

/// Every key of every table, with a value that is right.
const EVERYTHING: &str = include_str!("everything.toml");

/// The keys that go in place of others.
const HALVES: &str = "[environment]\nsky = [1, 2, 3]\nsky_strength = 10\nground = [0.5, 0, 1]\nground_strength = 4\n";

/// The other way to project: a camera has the one or the other.
const PARALLEL: &str = "[camera]\northographic_height = 2.5\n";

/// A camera path.
const PATH: &str = "\
[[keys]]
time = 1
position = [0, 1, 5]
target = [0, 1, 0]
up = [1, 0, 0]
fov_y_degrees = 40

[[keys]]
time = 3.5
position = [2, 1, 5]
rotation = [0, 90, 0]
";

/// A settings file.
const TUNED: &str = "\
[settings]
samples = 2
exposure = 11
shadows = { size = 1024, filter = '5x5' }

[evidence]
error = 0.008
anything = [1, { else = 'goes' }]
";

/// A folder with the files that the examples name.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write(
        "crate.obj",
        "mtllib crate.mtl\nusemtl planks\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n",
    );
    write("crate.mtl", "newmtl planks\nKd 0.5 0.4 0.3\n");
    write("everything.toml", EVERYTHING);
    write("tuned.toml", TUNED);
    image::RgbaImage::from_pixel(2, 2, image::Rgba([128, 128, 255, 255]))
        .save(folder.path().join("planks.png"))
        .unwrap();
    image::RgbaImage::from_fn(8, 4, |x, y| image::Rgba([x as u8 * 30, y as u8 * 60, 90, 255 - x as u8]))
        .save(folder.path().join("fire.png"))
        .unwrap();
    folder
}

fn read(folder: &TempDir, text: &str) -> Result<Scene, String> {
    file::parse(text, &folder.path().join("scene.toml"), &OpenOptions::default()).map_err(|error| error.to_string())
}

/// The error of a text, without the folder: `scene.toml:3: camera.near = 0: must be ...`.
fn refusal(text: &str) -> String {
    let folder = folder();
    let Err(error) = read(&folder, text) else { panic!("{text:?} is read") };
    assert_eq!(error.lines().count(), 1, "{error:?}");
    error.replace(&format!("{}/", folder.path().display()), "")
}

/// A triangle in the second of two scenes, with a second look.
const GLTF: &str = r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_materials_variants"],
"extensions":{"KHR_materials_variants":{"variants":[{"name":"red"}]}},
"scenes":[{"name":"first","nodes":[]},{"name":"second","nodes":[0]}],"nodes":[{"mesh":0}],
"materials":[{"name":"plain"},{"name":"paint"}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0,
"extensions":{"KHR_materials_variants":{"mappings":[{"material":1,"variants":[0]}]}}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

const GLTF_MODEL: &str = "[[models]]\npath = 'two.gltf'\nscene = 'second'\nvariant = 'red'";

#[test]
fn a_scene_and_a_variant_of_a_gltf_file_are_chosen() {
    let folder = folder();
    fs::write(folder.path().join("two.gltf"), GLTF).unwrap();
    let scene = read(&folder, GLTF_MODEL).unwrap();
    let worn: Vec<&str> = scene.model_objects().map(|own| scene.materials[own.material].name.as_str()).collect();
    assert_eq!((worn, scene.triangle_count()), (vec!["paint"], 1));
    let error = read(&folder, "[[models]]\npath = 'two.gltf'\nscene = 'third'").unwrap_err();
    assert!(error.contains("third"), "{error}");
}

/// Lights that reach nothing where a movable object stands stay in its plan, also where the file is the base of one that the window has written.
#[test]
fn a_movable_object_keeps_the_lights_that_it_may_come_to() {
    let folder = folder();
    let lamp = "[[lights]]\nkind = 'point'\nposition = [0, 0, 900]\nrange = 2\nintensity = 5\n";
    let text = |movable: &str| format!("[[models]]\nshape = {{ kind = 'box' }}\n{movable}\n{lamp}");
    let lights = |scene: &Scene| {
        let settings = scene.settings.decide();
        let plan = FramePlan::of(scene, &settings, &capabilities()).unwrap_or_else(|error| panic!("{error}"));
        plan.light_numbers().len()
    };
    for (movable, kept) in [("", 0), ("movable = false", 0), ("movable = true", 1)] {
        let scene = read(&folder, &text(movable)).unwrap();
        assert_eq!((lights(&scene), scene.objects[0].movable), (kept, kept == 1), "{movable:?}");
        let path = folder.path().join("base.toml");
        fs::write(&path, text(movable)).unwrap();
        let written = file::to_toml(file::Origin::File(&path), &scene, &scene.camera, &scene.settings);
        let again = read(&folder, &written).unwrap_or_else(|error| panic!("{error}: {written}"));
        assert_eq!((lights(&again), again.objects[0].movable), (kept, kept == 1), "{written}");
    }
}

#[test]
fn every_key_does_what_it_says() {
    let scene = read(&folder(), EVERYTHING).unwrap();
    // Any settings are read as they were written: a test beside their table tries them.
    for table in schema::TABLES.iter().filter(|table| !table.table.starts_with("settings")) {
        for key in table.keys {
            let tried = [EVERYTHING, HALVES, PARALLEL, PATH, clips::CLIPS, GLTF_MODEL, sky::SKIES, emitters::EMITTERS]
                .iter()
                .any(|text| text.contains(key));
            assert!(tried, "{}.{key} is not tried", table.table);
        }
    }
    let material = |name: &str| scene.materials.iter().position(|material| material.name == name).unwrap();
    let worn = |name: &str| {
        let objects = scene.objects.iter().filter(|object| object.name == name);
        objects.map(|object| object.material).collect::<Vec<_>>()
    };
    assert_eq!(worn("crates"), vec![material("paint"); 4]);
    assert_eq!(worn("ball"), vec![material("paint")]);
    let paint = &scene.materials[material("paint")];
    assert_eq!(
        (paint.brdf, paint.emissive, paint.two_sided),
        (Brdf::BlinnPhong, Vec3::new(1.0, 2.0, 3.0) * 10.0, true)
    );
    assert_eq!(paint.textures().count(), TextureSlot::ALL.len());
    assert_eq!((paint.sheen.color, paint.sheen.roughness), (Vec3::new(0.5, 0.25, 1.0), 0.25));
    assert_eq!((paint.film.strength, paint.film.ior, paint.film.nanometres), (0.5, 1.25, [200.0, 500.0]));
    assert_eq!((paint.anisotropy.strength, paint.anisotropy.rotation), (0.75, std::f32::consts::PI));
    let through = paint.diffuse_transmission;
    assert_eq!((through.strength, through.color), (0.5, Vec3::new(0.25, 0.5, 1.0)));
    // One file used as colour and as numbers is two textures, not eleven; with another sampler it is a third.
    assert_eq!(scene.textures.len(), 3);
    let body =
        Refraction { ior: 1.25, thickness: 0.5, color: Vec3::new(0.25, 0.5, 1.0), distance: 2.0, dispersion: 0.75 };
    assert_eq!(scene.materials[material("bottle")].refraction, Some(body));
    let poster = &scene.materials[material("poster")];
    let third = 1.0f32 / 9.0;
    assert!((poster.reflectance - Vec3::new(third * 0.5, third * 0.25, 0.5)).abs().max_element() < 1e-6, "{poster:?}");
    assert_eq!((poster.unlit, poster.grazing), (true, 0.5));
    let near = Filter::Nearest;
    let sampler = Sampler { wrap: [Wrap::Clamp, Wrap::Mirror], magnify: near, minify: near, levels: Some(near) };
    assert_eq!(scene.textures[poster.base_color_texture.unwrap()].sampler, sampler);
    let [.., shown] = poster.uv_maps[TextureSlot::Emissive as usize].rows().map(|row| row.as_vec3());
    // Scaled, then turned a quarter: the image's rows go against the first coordinate.
    assert!((shown - Vec3::new(-2.0, 0.0, -2.0)).length() < 1e-6, "{shown}");
    assert_eq!((poster.uv_maps[0], poster.uv_maps[4].set), (UvMap::IDENTITY, 1));
    let crates = &scene.meshes[scene.objects.iter().find(|object| object.name == "crates").unwrap().mesh];
    assert_eq!(crates.tangents.len(), crates.positions.len());
    let [.., sun, point, spot, beam, first, second, _] = scene.lights.as_slice() else { panic!("{:?}", scene.lights) };
    assert!(first.name == "garland 0" && matches!(first.kind, LightKind::Point { range: Some(2.0), .. }), "{first:?}");
    assert!(second.color.min_element() == 0.0 && second.intensity == 5.0, "{second:?}");
    assert_eq!(sun.color, afterlight::scene::black_body_color(4000.0));
    assert!(matches!(point.kind, LightKind::Point { falloff: Falloff::Polynomial { quadratic: 3.0, .. }, .. }));
    let LightKind::Spot { direction, .. } = spot.kind else { panic!("{spot:?}") };
    assert!((direction - DVec3::NEG_Y).length() < 1e-12);
    let (position, direction) = (DVec3::Y * 3.0, DVec3::X);
    assert_eq!(beam.kind, LightKind::Beam { position, direction, radius: 0.5, edge: 0.25, range: Some(6.0) });
    assert_eq!((beam.intensity, beam.casts_shadow, beam.size), (500.0, false, 1.0));
    let ball = scene.objects.iter().find(|object| object.name == "ball").unwrap();
    assert_eq!((ball.casts_shadow, ball.receives_shadow, ball.movable), (CastsShadow::Front, false, true));
    let other = scene.objects.iter().find(|object| object.name == "crates").unwrap();
    assert_eq!((other.casts_shadow, other.receives_shadow, other.movable), (CastsShadow::Yes, true, false));
    assert_eq!((sun.size, point.size, spot.size), (0.53, 0.25, 0.0));
    let looks: Vec<Option<Look>> =
        scene.objects.iter().filter(|object| object.name == "crates").map(|object| object.look).collect();
    let (first, second) = (
        Look { cell: 1, tint: Vec3::new(1.0, 0.5, 0.0), selected: true },
        Look { cell: 3, tint: Vec3::ONE, selected: false },
    );
    assert_eq!(looks, [first, second, first, second].map(Some));
    assert_eq!((paint.atlas, ball.look, poster.atlas), ([2, 2], None, [1, 1]));
    let settings = scene.settings.decide();
    let shadows = settings.shadows;
    assert_eq!((shadows.filter, shadows.cascades, shadows.lambda), (ShadowFilter::Pcss, 4, 0.25));
    assert_eq!((shadows.budget, shadows.cache), (100, false));
    assert_eq!((settings.size, settings.exposure, settings.shadows.size), ([640, 360], Some(3.0), 512));
    assert_eq!((settings.samples, settings.resolve, settings.fxaa), (16, Resolve::Linear, true));
    assert_eq!((settings.msaa, settings.anisotropy), (4, 5));
    assert_eq!(settings.keep.to_string(), "tangents");
    assert_eq!((scene.camera.projection, scene.camera.near), (Projection::perspective(50.0), 0.02));
    assert_eq!(scene.environment.background, Vec3::new(4.0, 5.0, 6.0));
}

#[test]
fn the_scenes_that_ship_are_whole() {
    let assets = Path::new(env!("AFTERLIGHT_ROOT")).join("assets");
    let paths = fs::read_dir(assets).unwrap().map(|entry| entry.unwrap().path());
    let scenes: Vec<_> = paths.filter(|path| path.extension().is_some_and(|extension| extension == "toml")).collect();
    assert!(!scenes.is_empty());
    for path in scenes {
        builtin::check(&open(path.to_str().unwrap(), &OpenOptions::default()).unwrap());
    }
}

#[test]
fn the_camera_paths_that_ship_are_some() {
    for name in ["hall", "harbour"] {
        let file = Path::new(env!("AFTERLIGHT_ROOT")).join(format!("assets/paths/{name}.toml"));
        assert!(file::load_path(&file, &Camera::default()).unwrap().seconds() > 1.0);
    }
}

#[test]
fn a_file_that_only_names_a_model_shows_it_as_if_it_were_bare() {
    let folder = folder();
    let bare = open(folder.path().join("crate.obj").to_str().unwrap(), &OpenOptions::default()).unwrap();
    let named = read(&folder, "[[models]]\npath = 'crate.obj'").unwrap();
    assert_eq!((named.camera, &named.lights, named.environment), (bare.camera, &bare.lights, bare.environment));
    assert_eq!(named.settings, bare.settings);
    let own_lens = read(&folder, "[[models]]\npath = 'crate.obj'\n[camera]\nfov_y_degrees = 20").unwrap();
    assert_eq!(
        (own_lens.camera.position, own_lens.camera.projection),
        (bare.camera.position, Projection::perspective(20.0))
    );
}

#[test]
fn copies_stand_where_grid_instances_and_the_models_own_transform_put_them() {
    let text = "[[models]]\nshape = { kind = 'sphere' }\ntranslation = [0, 10, 0]\nrotation = [0, 90, 0]\nscale = 2\n\
                grid = { count = [2, 1, 1], spacing = [4, 0, 0] }\ninstances = [{}, { translation = [0, 0, 1] }]\n";
    let scene = read(&folder(), text).unwrap();
    let places: Vec<DVec3> = scene.model_objects().map(|object| object.transform.translation).collect();
    // A quarter turn about +Y takes +X to -Z and +Z to +X.
    let expected = [[0., 10., 4.], [2., 10., 4.], [0., 10., -4.], [2., 10., -4.]];
    assert_eq!(places.len(), expected.len());
    for (place, expected) in places.iter().zip(expected) {
        assert!((*place - DVec3::from(expected)).length() < 1e-12, "{places:?}");
    }
}

fn write(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).unwrap();
}

#[test]
fn a_base_is_changed_key_by_key() {
    let folder = folder();
    fs::create_dir(folder.path().join("sub")).unwrap();
    write(
        folder.path(),
        "sub/first.toml",
        "base='../everything.toml'\n[settings]\nexposure = 7\n[camera]\nfov_y_degrees = 20\n",
    );
    let first = read(&folder, EVERYTHING).unwrap();
    let text = "base = 'sub/first.toml'\nbase_lights = false\n[settings]\nsize = '10x20'\n[environment]\nambient_strength = 2\n";
    let scene = read(&folder, text).unwrap();
    let settings = scene.settings.decide();
    assert_eq!((settings.size, settings.exposure, settings.shadows.size), ([10, 20], Some(7.0), 512));
    let camera = scene.camera;
    assert_eq!((camera.projection, camera.near, scene.lights.len()), (Projection::perspective(20.0), 0.02, 0));
    let parallel = read(&folder, &format!("base='everything.toml'\n{PARALLEL}")).unwrap().camera;
    assert_eq!(parallel, Camera { projection: Projection::orthographic(2.5), ..first.camera });
    assert_eq!(scene.camera.position, first.camera.position);
    assert_eq!(scene.environment.ambient, first.environment.ambient * 2.0);
    assert_eq!(scene.objects.len(), first.objects.len());
    let on_a_model = read(&folder, "base = 'crate.obj'").unwrap();
    // The second is the ground of the studio that the model stands in.
    assert_eq!((on_a_model.lights.len(), on_a_model.objects.len()), (1, 2));
}

#[test]
fn a_scene_takes_settings_from_another_file_and_its_own_keys_win() {
    let folder = folder();
    fs::create_dir(folder.path().join("sub")).unwrap();
    let settings = |text: &str| read(&folder, text).unwrap().settings.decide();
    let taken = settings("[settings]\nfrom = 'tuned.toml'");
    assert_eq!((taken.samples, taken.exposure, taken.shadows.size), (2, Some(11.0), 1024));
    assert_eq!(taken.shadows.filter, ShadowFilter::Box5);
    let own = settings("[settings]\nfrom = 'tuned.toml'\nsamples = 3\n[settings.shadows]\nsize = 64\n");
    assert_eq!((own.samples, own.shadows.size, own.shadows.filter), (3, 64, ShadowFilter::Box5));
    assert_eq!(settings("settings.from = 'tuned.toml'\ncamera.exposure = 4").exposure, Some(4.0));
    // This file's settings override its base's, and a base resolves paths from its own folder.
    write(folder.path(), "sub/base.toml", "[settings]\nfrom = '../tuned.toml'\ntonemap = 'agx'\nsamples = 9");
    let based = settings("base = 'sub/base.toml'\nsettings.from = 'tuned.toml'");
    assert_eq!((based.samples, based.tonemap.name()), (2, "agx"));
    assert_eq!(settings("base = 'sub/base.toml'").samples, 9);
}

#[test]
fn scattered_lights_are_as_many_as_asked_for_and_where() {
    let folder = folder();
    let lights = |lines: &str| {
        let text = format!("[[scattered_lights]]\nmin=[-1,0,2]\nmax=[3,5,2]\nintensity=40\n{lines}");
        read(&folder, &text).unwrap().lights
    };
    let thousand = lights("count = 1000");
    assert_eq!(thousand.len(), 1000);
    let within = |light: &afterlight::scene::Light| match light.kind {
        LightKind::Point { position, range: None, falloff: Falloff::InverseSquare } => {
            position.cmpge(DVec3::new(-1.0, 0.0, 2.0)).all() && position.cmple(DVec3::new(3.0, 5.0, 2.0)).all()
        }
        _ => false,
    };
    assert!(thousand.iter().all(|light| within(light) && light.intensity == 40.0 && !light.casts_shadow));
    // The fewer are the first of the more, and the first hangs in the middle.
    assert_eq!(lights("count = 10"), thousand[..10]);
    assert!(matches!(thousand[0].kind, LightKind::Point { position, .. } if position == DVec3::new(1.0, 2.5, 2.0)));
    assert_ne!(lights("count = 10\nseed = 1")[0].kind, thousand[0].kind);
    assert!(lights("count = 5\nsaturation = 0").iter().all(|light| light.color == Vec3::ONE));
    assert!(lights("count = 5\nsaturation = 1").iter().all(|light| light.color.min_element() == 0.0));
    let ranged = lights("count = 2\nrange = 3\nfalloff = 'quadratic'");
    let is_ranged = |kind| matches!(kind, LightKind::Point { range: Some(3.0), falloff: Falloff::Quadratic, .. });
    assert!(ranged.iter().all(|light| is_ranged(light.kind)));
    // A file that scatters lights has light: no sun is added.
    let lit = read(
        &folder,
        "[[models]]\npath='crate.obj'\n[[scattered_lights]]\ncount=1\nmin=[0,0,0]\nmax=[0,0,0]\nintensity=1",
    );
    assert_eq!(lit.unwrap().lights.len(), 1);
}

/// The number of lights in the name of each, and the range that makes neighbours overlap a little: benches/README.md says which.
#[test]
fn the_benchmarks_have_as_many_lights_as_their_names_say() {
    let benches = Path::new(env!("AFTERLIGHT_ROOT")).join("benches");
    let folder = folder();
    write(folder.path(), "bare.toml", "[[lights]]\nkind='directional'\ndirection=[0,-1,0]\nintensity=1");
    let mut counts = Vec::new();
    for entry in fs::read_dir(benches).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let Some(count) = name.strip_prefix("sponza_").and_then(|name| name.strip_suffix("_ranged_lights.toml")) else {
            continue;
        };
        let count: usize = count.parse().unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let base = text.lines().find(|line| line.starts_with("base = ")).expect("a base");
        let scene = read(&folder, &text.replace(base, "base = 'bare.toml'")).unwrap();
        assert_eq!(scene.lights.len(), count, "{name}");
        let size = DVec3::new(24.0, 9.0, 11.0);
        let spacing = (size.element_product() / count as f64).cbrt();
        for light in &scene.lights {
            let LightKind::Point { position, range: Some(range), .. } = light.kind else { panic!("{name}: {light:?}") };
            assert!((range / (0.75 * spacing) - 1.0).abs() < 0.02, "{name}: {range} m at a spacing of {spacing} m");
            assert!((f64::from(light.intensity) / (40.0 * range * range) - 1.0).abs() < 0.02, "{name}: {light:?}");
            assert!((position - DVec3::new(0.0, 4.5, 0.0)).abs().cmple(size * 0.5).all(), "{name}: {position}");
        }
        counts.push(count);
    }
    counts.sort_unstable();
    assert_eq!(counts, [1, 16, 64, 256, 1024, 10_000]);
}

#[test]
fn a_direction_of_any_length_but_none_comes_out_as_a_unit_vector() {
    let folder = folder();
    for length in [1e-300, 1e-160, 1.0, 1e160, 1e300] {
        let lines = format!(
            "[[lights]]\nkind='directional'\nintensity=1\ndirection=[{:e}, {:e}, 0]",
            3.0 * length,
            -4.0 * length
        );
        match read(&folder, &lines).unwrap().lights[0].kind {
            LightKind::Directional { direction } => {
                assert!(direction.distance(DVec3::new(0.6, -0.8, 0.0)) < 1e-15, "{length}: {direction}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_cutoff_is_the_range_at_which_a_polynomial_light_is_that_bright() {
    let folder = folder();
    let range = |lines: &str| {
        let scene = read(&folder, &format!("[[lights]]\nposition=[0,0,0]\n{lines}")).unwrap();
        scene.lights[0].kind.form().range
    };
    // 10 / (d^2) = 0.1 at 10 m, whatever kind of light; half as far for a colour of a quarter of the luminance.
    let point = "kind='point'\nintensity=10\n";
    assert_eq!(range(&format!("{point}falloff={{quadratic=1, cutoff=0.1}}")), Some(10.0));
    assert_eq!(range("kind='spot'\ndirection=[0,-1,0]\nintensity=10\nfalloff={quadratic=1, cutoff=0.1}"), Some(10.0));
    let dim = range(&format!("{point}color=[0.25,0.25,0.25]\nfalloff={{quadratic=1, cutoff=0.1}}")).unwrap();
    assert!((dim - 5.0).abs() < 1e-6, "{dim}");
    assert_eq!(range(&format!("{point}falloff={{quadratic=1}}")), None);
    // Never as dark, never as bright, and no cut at all.
    assert_eq!(range(&format!("{point}falloff={{constant=1, cutoff=0.1}}")), None);
    assert_eq!(range(&format!("{point}falloff={{quadratic=1, cutoff=0}}")), None);
    assert_eq!(range(&format!("{point}falloff={{constant=1, quadratic=1, cutoff=11}}")), Some(1e-12));
}

#[test]
fn sky_and_ground_go_in_place_of_ambient_light() {
    let folder = folder();
    let environment = |text: &str| read(&folder, text).unwrap().environment;
    let halves = environment(HALVES);
    assert_eq!((halves.ambient, halves.ground), (Vec3::new(10.0, 20.0, 30.0), Some(Vec3::new(2.0, 0.0, 4.0))));
    write(folder.path(), "halves.toml", HALVES);
    let changed = |text: &str| environment(&format!("base = 'halves.toml'\n[environment]\n{text}"));
    let ground_alone = changed("ground = [1, 1, 1]");
    assert_eq!((ground_alone.ambient, ground_alone.ground), (halves.ambient, Some(Vec3::ONE)));
    let brighter = changed("ambient_strength = 2");
    assert_eq!((brighter.ambient, brighter.ground), (halves.ambient * 2.0, halves.ground.map(|ground| ground * 2.0)));
    let even = changed("ambient = [1, 0, 0]");
    assert_eq!((even.ambient, even.ground), (Vec3::X, None));
    assert_eq!(changed("background_strength = 3").ground, halves.ground);
    // On a base with even ambient light, the sky keeps that light where the file says nothing of it.
    let below = environment("base = 'everything.toml'\n[environment]\nground = [0, 0, 0]");
    assert_eq!((below.ambient, below.ground), (Vec3::splat(2.0), Some(Vec3::ZERO)));
}

#[test]
fn files_that_build_on_each_other_in_a_circle_are_refused() {
    let folder = folder();
    write(folder.path(), "a.toml", "# one\nbase = 'b.toml'");
    write(folder.path(), "b.toml", "base = 'a.toml'");
    for _ in 0..2 {
        let path = folder.path().join("a.toml");
        let error = open(path.to_str().unwrap(), &OpenOptions::default()).unwrap_err().to_string();
        assert!(error.contains("a.toml:2: base = 'b.toml': more than 8 files build on each other"), "{error}");
    }
    // The limit counts files that build on each other, not files that were read.
    write(folder.path(), "0.toml", "base = 'builtin:quad'");
    for index in 1..8 {
        write(folder.path(), &format!("{index}.toml"), &format!("base = '{}.toml'", index - 1));
    }
    assert!(read(&folder, "base = '6.toml'").is_ok());
    assert!(read(&folder, "base = '7.toml'").is_err());
}
