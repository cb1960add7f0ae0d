//! The reader reads a written scene back to the last bit, and the writer lists the parts that it cannot write.

use std::path::Path;

use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3};
use serde_json::Value;

use super::*;
use crate::builtin::shapes;
use crate::gltf::{GltfOptions, parse};
use crate::{
    AlphaMode, Anisotropy, Brdf, Camera, CastsShadow, ColorSpace, DiffuseTransmission, Emitter, Falloff, Filter,
    Imported, Light, LightKind, Look, Material, Mesh, NamedCamera, Object, Projection, Refraction, Sampler, Sheen,
    Texture, TextureSlot, ThinFilm, UvMap, Wrap,
};

fn shot() -> ExportedView {
    ExportedView { size: [16, 9], exposure: 7.3, settings: SettingsPatch::default(), copyright: None }
}

fn exported(scene: Scene) -> Exported {
    write(scene, &shot()).unwrap_or_else(|error| panic!("{error}"))
}

fn read(exported: &Exported) -> Imported {
    let read = parse(exported.bytes.clone(), Path::new("a.glb"), &GltfOptions::default());
    let read = read.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(read.warnings, Vec::<String>::new());
    read
}

/// The JSON of a file.
fn json(exported: &Exported) -> Value {
    let bytes = &exported.bytes;
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).expect("JSON")
}

fn texture(name: &str, color_space: ColorSpace, sampler: Sampler, alpha: u8) -> Texture {
    let texels = (0..16u8).flat_map(|index| [index * 16, 255 - index, index, alpha.saturating_add(index)]).collect();
    Texture { name: name.into(), size: [4, 4], color_space, sampler, texels }
}

/// A row of balls, one for each material.
fn row(materials: Vec<Material>) -> Scene {
    let mut ball = shapes::sphere(0.4, 8).finish("ball");
    ball.uvs_1 = ball.uvs.iter().map(|&[u, v]| [v, u]).collect();
    ball.compute_tangents();
    let place = |index: usize| DAffine3::from_translation(DVec3::X * index as f64);
    let objects = (0..materials.len()).map(|index| Object::new(format!("ball {index}"), 0, index, place(index)));
    Scene {
        name: "row".into(),
        objects: objects.collect(),
        meshes: vec![ball],
        materials,
        lights: vec![Light::of(LightKind::Directional { direction: DVec3::NEG_Z })],
        ..Scene::default()
    }
}

fn plain(name: &str) -> Material {
    Material { name: name.into(), base_color: Vec3::new(0.1, 0.7, 1.0), roughness: 0.3, ..Material::default() }
}

/// Materials that cover everything the writer can express.
fn materials() -> Vec<Material> {
    let of = |name: &str, change: &dyn Fn(&mut Material)| {
        let mut material = plain(name);
        change(&mut material);
        material
    };
    let moved = UvMap { set: 1, offset: DVec2::new(0.25, -3.0), rotation: 0.7, scale: DVec2::new(2.0, 0.1) };
    vec![
        of("metal", &|own| (own.metallic, own.two_sided) = (0.9, true)),
        of("mask", &|own| {
            (own.alpha, own.alpha_mode, own.base_color_texture) = (0.8, AlphaMode::Mask { cutoff: 0.3 }, Some(0));
        }),
        of("gauze", &|own| (own.alpha, own.alpha_mode) = (0.35, AlphaMode::Blend)),
        of("glass", &|own| {
            (own.alpha, own.alpha_mode, own.refraction) = (0.15, AlphaMode::Glass, Some(Refraction::THIN));
        }),
        of("bottle", &|own| {
            let body = Refraction {
                ior: 1.75,
                thickness: 0.25,
                color: Vec3::new(0.2, 0.9, 0.4),
                distance: 0.3,
                dispersion: 0.7,
            };
            (own.alpha, own.alpha_mode, own.refraction) = (0.15, AlphaMode::Glass, Some(body));
            own.reflectance = Vec3::splat((0.75f32 / 2.75).powi(2));
        }),
        of("lamp", &|own| (own.emissive, own.emissive_texture) = (Vec3::new(1465.2, 1.0, 0.3), Some(0))),
        of("glow", &|own| own.emissive = Vec3::new(0.9, 1.0, 0.3)),
        of("flat", &|own| own.unlit = true),
        of("mirror", &|own| own.reflectance = Vec3::ONE),
        of("water", &|own| own.reflectance = Vec3::splat(0.02)),
        of("tinted", &|own| own.reflectance = Vec3::new(0.1, 0.05, 0.9)),
        of("black", &|own| (own.reflectance, own.grazing) = (Vec3::ZERO, 0.0)),
        of("dull", &|own| (own.reflectance, own.grazing) = (Vec3::splat(0.04) * 0.5, 0.5)),
        of("bumpy", &|own| {
            (own.normal_texture, own.normal_scale, own.metallic_roughness_texture) = (Some(1), 0.7, Some(1));
            own.uv_maps[TextureSlot::MetallicRoughness as usize] = moved;
        }),
        of("velvet", &|own| {
            (own.sheen, own.sheen_texture) = (Sheen { color: Vec3::new(0.9, 0.1, 0.3), roughness: 0.4 }, Some(2));
        }),
        of("oily", &|own| own.film = ThinFilm { strength: 0.5, ior: 1.4, nanometres: [350.0; 2] }),
        of("brushed", &|own| {
            (own.anisotropy, own.anisotropy_texture) = (Anisotropy { strength: 0.75, rotation: 0.3 }, Some(1));
        }),
        of("leaf", &|own| {
            own.diffuse_transmission = DiffuseTransmission { strength: 0.6, color: Vec3::new(0.7, 0.9, 0.1) };
            (own.diffuse_transmission_texture, own.two_sided) = (Some(2), true);
        }),
        of("shaded", &|own| (own.occlusion_texture, own.specular_texture) = (Some(1), Some(2))),
    ]
}

fn textures() -> Vec<Texture> {
    let nearest = Sampler {
        wrap: [Wrap::Clamp, Wrap::Mirror],
        magnify: Filter::Nearest,
        minify: Filter::Linear,
        levels: Some(Filter::Nearest),
    };
    vec![
        texture("colour", ColorSpace::Srgb, Sampler::DEFAULT, 9),
        texture("numbers", ColorSpace::Linear, nearest, 255),
        texture("shine", ColorSpace::Srgb, Sampler { levels: None, ..Sampler::DEFAULT }, 100),
    ]
}

#[test]
fn materials_and_textures_are_read_as_they_were_to_the_last_bit() {
    let scene = Scene { textures: textures(), ..row(materials()) };
    let exported = exported(scene.clone());
    assert_eq!(exported.left_out, Vec::<String>::new());
    assert_eq!(exported.scene.materials, scene.materials);
    let read = read(&exported);
    for (read, own) in read.materials.iter().zip(&exported.scene.materials) {
        assert_eq!(read, own);
    }
    assert_eq!(read.materials.len(), scene.materials.len());
    // Textures are in the order in which materials ask for them.
    for (read, own) in read.textures.iter().zip(&exported.scene.textures) {
        assert_eq!((&read.name, read.size, read.sampler), (&own.name, own.size, own.sampler));
        assert_eq!((read.color_space, read.rgba8(0)), (own.color_space, own.rgba8(0)));
    }
    assert_eq!(read.textures.len(), 3);
}

#[test]
fn a_coat_is_read_as_the_object_that_it_was() {
    let coat = Material {
        alpha_mode: AlphaMode::Coat,
        alpha: 0.6,
        base_color: Vec3::ONE,
        roughness: 0.1,
        normal_texture: Some(1),
        ..plain("paint (coat)")
    };
    let mut scene = Scene { textures: textures(), ..row(vec![plain("paint"), plain("bare"), coat]) };
    scene.objects[2] =
        Object { material: 2, casts_shadow: CastsShadow::No, name: "ball 0".into(), ..scene.objects[0].clone() };
    let exported = exported(scene);
    assert_eq!(exported.left_out, Vec::<String>::new());
    let read = read(&exported);
    assert_eq!(read.materials, exported.scene.materials);
    let of = |objects: &[Object]| -> Vec<_> {
        objects.iter().map(|own| (own.name.clone(), own.material, own.transform, own.casts_shadow)).collect()
    };
    assert_eq!(of(&read.objects), of(&exported.scene.objects));
    assert_eq!(read.objects.len(), 3);
}

#[test]
fn meshes_keep_their_bits_and_share_their_vertices() {
    let mut scene = row(vec![plain("one"), plain("two")]);
    scene.meshes[0].colors =
        (0..scene.meshes[0].positions.len()).map(|index| [1.0, 0.1, 0.7, index as f32 / 1e4]).collect();
    scene.meshes[0].origin = DVec3::new(3e6, 0.1, -7.0);
    scene.meshes[0].bounds = scene.meshes[0].compute_bounds();
    let skew = DAffine3::from_scale(DVec3::new(1.0, 3.0, 1.0)) * DAffine3::from_rotation_z(0.4);
    scene.objects[1].transform = skew;
    // The reader reads tangents only for a normal map.
    (scene.textures, scene.materials[0].normal_texture) = (textures(), Some(1));
    let exported = exported(scene);
    let (own, read) = (&exported.scene, read(&exported));
    let (own_mesh, mesh) = (&own.meshes[0], &read.meshes[0]);
    assert_eq!((&mesh.positions, &mesh.normals), (&own_mesh.positions, &own_mesh.normals));
    assert_eq!((&mesh.tangents, &mesh.uvs), (&own_mesh.tangents, &own_mesh.uvs));
    assert_eq!((&mesh.colors, &mesh.indices), (&own_mesh.colors, &own_mesh.indices));
    for (read, own) in read.objects.iter().zip(&own.objects) {
        let place = own.transform * DAffine3::from_translation(own_mesh.origin);
        assert!(read.transform.abs_diff_eq(place, 1e-14 * place.translation.length()), "{} {place}", read.transform);
    }
    let json = json(&exported);
    let attributes = |mesh: usize| &json["meshes"][mesh]["primitives"][0]["attributes"];
    assert_eq!(attributes(0), attributes(1));
    assert_eq!(json["accessors"].as_array().map(Vec::len), Some(7));
}

#[test]
fn points_and_lines_keep_their_places_and_colours() {
    let mut scene = row(vec![Material { unlit: true, ..plain("ink") }]);
    let places: Vec<DVec3> = (0..4u32).map(|at| DVec3::new(f64::from(at), f64::from(at * at), 0.5)).collect();
    let lines = Mesh::of_strokes("lines", &[[places[0], places[1]], [places[2], places[2]], [places[3], places[0]]]);
    let mut points = Mesh::of_strokes("points", &[[places[1]; 2], [places[3]; 2]]);
    let share = |place: &[f32; 3]| [(place[0] / 4.0).abs(), 0.5, 0.25, 1.0];
    points.colors = points.positions.iter().map(share).collect();
    scene.meshes = vec![lines, points];
    scene.objects = (0..2)
        .map(|mesh| Object { casts_shadow: CastsShadow::No, ..Object::new("it", mesh, 0, DAffine3::IDENTITY) })
        .collect();
    let exported = exported(scene);
    assert_eq!(exported.left_out, Vec::<String>::new());
    let read = read(&exported);
    for (read, own) in read.meshes.iter().zip(&exported.scene.meshes) {
        assert!(read.is_strokes);
        assert_eq!((&read.positions, &read.normals, &read.colors), (&own.positions, &own.normals, &own.colors));
        assert_eq!((&read.name, &read.indices), (&own.name, &own.indices));
    }
    let modes: Vec<_> = (0..2).map(|mesh| json(&exported)["meshes"][mesh]["primitives"][0]["mode"].clone()).collect();
    assert_eq!(modes, [1, 0]);
    assert!(read.objects.iter().all(|own| own.casts_shadow == CastsShadow::No && read.materials[own.material].unlit));
}

#[test]
fn a_mesh_of_many_vertices_has_wide_indices() {
    let mut scene = row(vec![plain("one")]);
    scene.meshes[0] = shapes::sphere(0.4, 400).finish("ball");
    let exported = exported(scene);
    assert!(exported.scene.meshes[0].positions.len() > 65536);
    assert_eq!(read(&exported).meshes[0].indices, exported.scene.meshes[0].indices);
}

#[test]
fn lights_and_cameras_are_where_they_were() {
    let mut scene = row(vec![plain("one")]);
    let (position, direction) = (DVec3::new(1.0, -2.5, 1e-3), DVec3::new(0.6, -0.8, 0.0));
    let falloff = Falloff::InverseSquare;
    let lamp = |name: &str, kind| Light {
        name: name.into(),
        color: Vec3::new(1.0, 0.1, 3.5),
        intensity: 1e3,
        size: 0.25,
        ..Light::of(kind)
    };
    scene.lights = vec![
        lamp("sun", LightKind::Directional { direction }),
        Light { casts_shadow: true, ..lamp("down", LightKind::Directional { direction: DVec3::Z }) },
        lamp("lamp", LightKind::Point { position, range: Some(3.25), falloff }),
        lamp(
            "spot",
            LightKind::Spot {
                position,
                direction,
                inner_angle_degrees: 40.0,
                outer_angle_degrees: 40.0,
                range: None,
                falloff,
            },
        ),
    ];
    scene.camera = Camera { near: 0.07, ..Camera::looking_at(position, DVec3::new(1.0, 0.0, 7.0), DVec3::Y) };
    let flat = Camera { projection: Projection::orthographic(0.3), ..scene.camera };
    let named = |name: &str, camera| NamedCamera { name: name.into(), camera, node: None };
    scene.cameras = vec![named("flat", flat), named("own", scene.camera)];
    let exported = exported(scene.clone());
    assert_eq!(exported.left_out, Vec::<String>::new());
    let read = read(&exported);
    for (read, own) in read.lights.iter().zip(&scene.lights) {
        assert_eq!((&read.name, read.casts_shadow, read.size), (&own.name, own.casts_shadow, own.size));
        assert_eq!(read.color * read.intensity, own.color * own.intensity);
        let (read, own) = (read.kind.form(), own.kind.form());
        assert_eq!((read.place, read.range, read.number), (own.place, own.range, own.number));
        assert!(read.direction.zip(own.direction).is_none_or(|(a, b)| a.distance(b) < 1e-15));
        assert!(read.edge().iter().zip(own.edge()).all(|(a, b)| (a - b).abs() < 1e-11), "{read:?} {own:?}");
    }
    assert_eq!(read.lights.len(), scene.lights.len());
    assert_eq!(read.cameras.iter().map(|own| own.name.as_str()).collect::<Vec<_>>(), ["own", "flat"]);
    for (read, own) in read.cameras.iter().zip([scene.camera, flat]) {
        let (read, turned) = (read.camera, read.camera.rotation.angle_between(own.rotation));
        assert!(turned < 1e-7 && read.position == own.position && read.near == own.near, "{read:?}");
        assert!((read.half_height() - own.half_height()).abs() < 1e-15, "{read:?}");
    }
}

#[test]
fn what_gltf_cannot_say_is_told_once_for_each_kind() {
    let mut scene = row(vec![plain("one"), Material { brdf: Brdf::Phong, shininess: 20.0, ..plain("two") }]);
    let spot = LightKind::Spot {
        position: DVec3::ZERO,
        direction: DVec3::X,
        inner_angle_degrees: 100.0,
        outer_angle_degrees: 120.0,
        range: Some(9.0),
        falloff: Falloff::Quadratic,
    };
    let (position, direction) = (DVec3::ZERO, DVec3::X);
    let beam = LightKind::Beam { position, direction, radius: 1.0, edge: 0.1, range: None };
    scene.lights = vec![Light::of(spot), Light::of(beam), Light::of(beam)];
    scene.environment.ambient = Vec3::new(0.5, 1.0, 2.0);
    scene.environment.background = Vec3::ONE;
    scene.objects[0].look = Some(Look { tint: Vec3::new(0.5, 1.0, 1.0), selected: true, cell: 0 });
    scene.objects[1].receives_shadow = false;
    scene.emitters = vec![Emitter::default()];
    let exported = exported(scene);
    let told = exported.left_out.join("\n");
    for words in [
        "ambient light of 0.5, 1, 2 nits",
        "the background of 1, 1, 1 nits",
        "1 source: particles",
        "1 object: that some or all shadows leave out",
        "1 object: cells of atlases",
        "1 material: a Phong model",
        "2 beams:",
        "1 light: a fall-off other",
        "1 spot light: cones wider",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    assert_eq!(exported.left_out.len(), 9, "{told}");
    let read = read(&exported);
    assert_eq!(read.materials[0].base_color, Vec3::new(0.05, 0.7, 1.0));
    let json = json(&exported);
    let extras = &json["scenes"][0]["extras"]["afterlight"];
    assert_eq!((&extras["ambient_nits"], &extras["exposure_ev100"]), (&json!([0.5, 1.0, 2.0]), &json!(7.3)));
    assert_eq!(json["cameras"][0]["extras"]["afterlight"]["exposure_ev100"], json!(7.3));
}

#[test]
fn every_built_in_scene_is_read_with_its_light_background_and_exposure() {
    let folder = tempfile::tempdir().expect("a folder");
    for builtin in crate::builtin::CATALOGUE {
        let spec = match builtin.name {
            // The hall's textures take seconds: tests/scenes/export.rs draws it.
            "hall" => continue,
            "spheres" => "builtin:spheres?rows=2&columns=3".to_owned(),
            "field" => "builtin:field?objects=100&lights=8".into(),
            name => format!("builtin:{name}"),
        };
        let scene = crate::builtin::open(&spec).unwrap_or_else(|error| panic!("{error}"));
        let exposure = scene.settings.exposure.unwrap_or_else(|| crate::metered_ev100(&scene));
        let exported =
            write(scene.clone(), &ExportedView { exposure, ..shot() }).unwrap_or_else(|error| panic!("{error}"));
        let file = folder.path().join("scene.glb");
        std::fs::write(&file, &exported.bytes).expect("written");
        let options = crate::OpenOptions::default();
        let read = crate::open(&file.to_string_lossy(), &options).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(read.warnings, Vec::<String>::new(), "{spec}");
        assert_eq!((read.environment, read.settings.exposure), (scene.environment, Some(exposure)), "{spec}");
        assert_eq!(
            (read.environment, &read.settings),
            (exported.scene.environment, &exported.scene.settings),
            "{spec}"
        );
        assert!(!read.fitted.camera && !read.fitted.light && !read.fitted.exposure, "{spec}");
        assert_eq!((read.lights.len(), read.triangle_count()), (scene.lights.len(), scene.triangle_count()), "{spec}");
        assert_eq!(read.materials, exported.scene.materials, "{spec}");
    }
}

#[test]
fn settings_that_were_said_are_read_and_a_dark_scene_stays_dark() {
    let open = |scene: Scene, settings: &str| {
        let shot = ExportedView { settings: settings.parse().expect("settings"), ..shot() };
        let exported = write(scene, &shot).unwrap_or_else(|error| panic!("{error}"));
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("scene.glb");
        std::fs::write(&file, &exported.bytes).expect("written");
        crate::open(&file.to_string_lossy(), &crate::OpenOptions::default()).expect("a scene")
    };
    let read = open(row(vec![plain("one")]), "size=32x16 tonemap=aces bloom=0.1");
    assert_eq!(read.settings, "size=32x16 exposure=7.3 tonemap=aces bloom=0.1".parse().expect("settings"));
    let lamp = Material { emissive: Vec3::ONE, ..plain("lamp") };
    let dark = open(Scene { lights: Vec::new(), ..row(vec![lamp.clone()]) }, "");
    assert!(dark.lights.is_empty() && !dark.environment.is_lit() && !dark.fitted.light);
    // Scenes whose light glTF lacks are lit by fitted light.
    let beam = LightKind::Beam { position: DVec3::ZERO, direction: DVec3::X, radius: 1.0, edge: 0.1, range: None };
    let lit = open(Scene { lights: vec![Light::of(beam)], ..row(vec![lamp]) }, "");
    assert!(lit.lights.len() == 1 && lit.fitted.light && lit.fitted.exposure);
}

#[test]
fn fitted_light_and_its_ground_are_left_out_and_fitted_again() {
    let mut scene = Scene { lights: Vec::new(), ..row(vec![plain("one")]) };
    let objects = scene.objects.len();
    crate::add_studio(&mut scene);
    assert_eq!((scene.objects.len(), scene.lights.len()), (objects + 1, 1));
    let exported = write(scene, &shot()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((exported.scene.objects.len(), exported.scene.lights.len()), (objects, 0));
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("scene.glb");
    std::fs::write(&file, &exported.bytes).expect("written");
    let read = crate::open(&file.to_string_lossy(), &crate::OpenOptions::default()).expect("a scene");
    assert!(read.fitted.light && read.fitted.ground.is_some() && read.sky.is_some());
    assert_eq!((read.model_objects().count(), read.lights.len()), (objects, 1));
}

#[test]
fn a_lambert_surface_is_a_dielectric_that_reflects_nothing() {
    let exported = exported(row(vec![Material { brdf: Brdf::Lambert, metallic: 0.5, ..plain("chalk") }]));
    assert_eq!(exported.left_out, Vec::<String>::new());
    let own = &read(&exported).materials[0];
    assert_eq!((own.metallic, own.reflectance, own.grazing), (0.0, Vec3::ZERO, 0.0));
}

#[test]
fn a_scene_without_a_triangle_is_refused() {
    let mut scene = row(vec![plain("one")]);
    scene.meshes[0].positions.iter_mut().for_each(|position| *position = [0.0; 3]);
    let error = write(scene, &shot()).expect_err("nothing to draw").to_string();
    assert_eq!(error, "row: has no triangle to export");
}

#[test]
fn a_scene_of_many_objects_turned_anyhow_is_where_it_was() {
    let mut scene = row((0..40).map(|index| plain(&format!("{index}"))).collect());
    for (index, object) in scene.objects.iter_mut().enumerate() {
        let turn = DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 0.3 * index as f64);
        let scale = DVec3::new(1.0, 1.0 + 0.1 * index as f64, -1.0);
        object.transform = DAffine3::from_scale_rotation_translation(scale, turn, DVec3::splat(index as f64 / 3.0));
    }
    let exported = exported(scene);
    for (read, own) in read(&exported).objects.iter().zip(&exported.scene.objects) {
        let origin = DAffine3::from_translation(exported.scene.meshes[0].origin);
        assert_eq!(read.transform, own.transform * origin, "{}", own.name);
    }
}

#[test]
fn floats_are_written_short_and_read_as_they_were() {
    let mut bits = 0x1234_5678u32;
    for _ in 0..20_000 {
        bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let value = f32::from_bits(bits);
        if value.is_finite() {
            let text = number(value).to_string();
            assert_eq!(text.parse::<f64>().expect("a number") as f32, value, "{text}");
        }
    }
    assert_eq!(number(0.1).to_string(), "0.1");
}
