//! Built-in scenes: each opens over the whole range of its parameters, and its parts fit together.

use crate::common::some_in_turn;
use afterlight::scene::builtin::{self, Builtin, CATALOGUE, Kind, Parameter};
use afterlight::scene::{Brdf, LightKind, Mesh, Scene, metered_ev100};
use glam::Vec3;
use proptest::prelude::*;

/// Asserts all that renderers may take for granted.
pub(super) fn check(scene: &Scene) {
    let name = &scene.name;
    for mesh in &scene.meshes {
        check_mesh(mesh, name);
    }
    for object in &scene.objects {
        assert!(object.mesh < scene.meshes.len() && object.material < scene.materials.len(), "{name}: {}", object.name);
        assert!(
            object.transform.is_finite() && object.transform.matrix3.determinant() != 0.0,
            "{name}: {}",
            object.name
        );
        let mesh = &scene.meshes[object.mesh];
        let has_normal_map = scene.materials[object.material].normal_texture.is_some();
        assert!(
            !has_normal_map || mesh.tangents.len() == mesh.positions.len(),
            "{name}: {} needs tangents",
            object.name
        );
    }
    for material in &scene.materials {
        assert!(material.textures().all(|(_, texture)| texture < scene.textures.len()), "{name}: {}", material.name);
        let shares = [material.alpha, material.metallic, material.roughness, material.ambient];
        let shares = shares.into_iter().chain(material.base_color.to_array()).chain(material.specular.to_array());
        assert!(shares.into_iter().all(|share| (0.0..=1.0).contains(&share)), "{name}: {material:?}");
        assert!(material.emissive.min_element() >= 0.0 && material.emissive.is_finite(), "{name}: {}", material.name);
    }
    for texture in &scene.textures {
        assert_eq!(
            texture.rgba8(0).len(),
            (texture.size[0] * texture.size[1] * 4) as usize,
            "{name}: {}",
            texture.name
        );
    }
    check_light(scene);
    assert!(scene.warnings.is_empty(), "{name}: {:?}", scene.warnings);
    let ev100 = metered_ev100(scene);
    assert!((-20.0..=40.0).contains(&ev100) || scene.lights.is_empty(), "{name}: {ev100}");
}

fn check_mesh(mesh: &Mesh, scene: &str) {
    let name = format!("{scene}: {}", mesh.name);
    assert!(!mesh.indices.is_empty() && mesh.indices.len().is_multiple_of(3), "{name}");
    assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.positions.len()), "{name}");
    assert!(mesh.origin.is_finite() && mesh.positions.iter().flatten().all(|x| x.is_finite()), "{name}");
    // A file's meshes may do without texture coordinates.
    let uvs = if mesh.uvs.is_empty() && !scene.starts_with("builtin:") { 0 } else { mesh.positions.len() };
    assert_eq!((mesh.normals.len(), mesh.uvs.len()), (mesh.positions.len(), uvs), "{name}");
    assert!(mesh.normals.iter().all(|&normal| Vec3::from(normal).is_normalized()), "{name}");
    assert!(mesh.uvs.iter().flatten().all(|x| x.is_finite()), "{name}");
    assert!(mesh.tangents.iter().flatten().all(|x| x.is_finite()), "{name}");
    assert_eq!(mesh.bounds, mesh.compute_bounds(), "{name}");
    let is_against = |triangle: &&[u32]| {
        let [a, b, c] = [0, 1, 2].map(|corner| Vec3::from(mesh.positions[triangle[corner] as usize]));
        let normal: Vec3 = triangle.iter().map(|&index| Vec3::from(mesh.normals[index as usize])).sum();
        (b - a).cross(c - a).dot(normal) <= 0.0
    };
    // Where a gathered curtain bends faster than its grid follows, single triangles of it (drawn from both sides) turn away.
    let allowed = if mesh.name == "curtain" { mesh.indices.len() / 300 } else { 0 };
    let against = mesh.indices.chunks_exact(3).filter(is_against).count();
    assert!(against <= allowed, "{name}: {against} triangles are wound against their normals");
}

fn check_light(scene: &Scene) {
    for light in &scene.lights {
        assert!(light.color.min_element() >= 0.0 && light.color.is_finite() && light.intensity >= 0.0, "{light:?}");
        let form = light.kind.form();
        assert!(form.direction.is_none_or(|direction| direction.is_normalized()), "{light:?}");
        assert!(
            form.place.is_none_or(|place| place.is_finite()) && form.range.is_none_or(|range| range > 0.0),
            "{light:?}"
        );
    }
    let camera = &scene.camera;
    assert!(camera.position.is_finite() && camera.rotation.is_normalized() && camera.near > 0.0, "{camera:?}");
    assert!(scene.environment.ambient.min_element() >= 0.0 && scene.environment.background.min_element() >= 0.0);
}

/// Values to try, and not more than a test has time for.
fn ends(parameter: &Parameter) -> Vec<String> {
    match parameter.kind {
        Kind::Integer { least, most, .. } if parameter.name == "seed" => vec![least.to_string(), most.to_string()],
        Kind::Integer { least, most, .. } => vec![least.to_string(), most.min(10_000).to_string()],
        Kind::Number { least, most, .. } => vec![least.to_string(), most.to_string(), "1e-300".into()],
        Kind::Brdf { .. } => Brdf::NAMES.iter().map(|(name, _)| (*name).to_owned()).collect(),
        Kind::Choice { names } => names.iter().map(|name| (*name).to_owned()).collect(),
    }
}

fn opened(builtin: &Builtin, query: &str) -> Result<Scene, String> {
    builtin::open(&format!("builtin:{}{query}", builtin.name)).map_err(|error| error.to_string())
}

#[test]
fn every_scene_is_whole_with_its_defaults_and_at_the_ends_of_each_range() {
    for builtin in CATALOGUE {
        check(&opened(builtin, "").unwrap());
        for (index, parameter) in builtin.parameters.iter().enumerate() {
            for value in some_in_turn(&ends(parameter).iter().collect::<Vec<_>>(), index, 2) {
                check(&opened(builtin, &format!("?{}={value}", parameter.name)).unwrap());
            }
        }
    }
}

#[test]
fn a_value_beyond_its_range_is_refused_by_name() {
    for builtin in CATALOGUE {
        for parameter in builtin.parameters {
            let beyond = match parameter.kind {
                Kind::Integer { most, .. } => vec!["-1".into(), (u128::from(most) + 1).to_string(), "1.5".into()],
                Kind::Number { least, most, .. } => vec![format!("{}", least - 1.0), format!("{}", most * 1.01)],
                Kind::Brdf { .. } => vec!["lambertian".into()],
                Kind::Choice { names } => vec![format!("{}x", names[0])],
            };
            for value in beyond.iter().map(String::as_str).chain(["nan", "inf", "", "1 0", "0x1", "\n"]) {
                let error = opened(builtin, &format!("?{}={value}", parameter.name)).unwrap_err();
                let is_named =
                    error.contains(parameter.name) && error.starts_with(&format!("builtin:{}: ", builtin.name));
                assert!(is_named && error.lines().count() == 1, "{error}");
            }
        }
    }
}

#[test]
fn a_misspelt_scene_or_parameter_is_answered_with_the_right_one() {
    for builtin in CATALOGUE {
        let misspelt = &builtin.name[..builtin.name.len() - 1];
        let error = builtin::open(&format!("builtin:{misspelt}")).err().unwrap().to_string();
        assert!(error.contains(&format!("did you mean \"{}\"", builtin.name)), "{error}");
        for parameter in builtin.parameters {
            let error = opened(builtin, &format!("?{}x=1", parameter.name)).unwrap_err();
            assert!(error.contains(&format!("did you mean \"{}\"", parameter.name)), "{error}");
        }
    }
    let list = builtin::list();
    assert!(CATALOGUE.iter().all(|builtin| list.contains(&format!("builtin:{}  ", builtin.name))));
}

#[test]
fn the_field_has_what_was_asked_for() {
    let scene = builtin::open("builtin:field?objects=17&lights=5&overdraw=3&range=0").unwrap();
    // The walls are one object: two triangles each.
    assert_eq!((scene.objects.len(), scene.lights.len()), (17 + 1, 5));
    let walls = scene.objects.iter().find(|object| object.name == "walls").expect("the walls");
    assert_eq!(scene.meshes[walls.mesh].indices.len(), 3 * 2 * 3);
    assert!(scene.lights.iter().all(|light| matches!(light.kind, LightKind::Point { range: None, .. })));
    let places = |seed: u32| format!("{:?}", builtin::open(&format!("field?objects=9&seed={seed}")).unwrap().objects);
    assert_ne!(places(1), places(2));
}

/// Keys and values that are right, nearly right and not at all; few enough objects to build hundreds of scenes.
fn query() -> impl Strategy<Value = String> {
    let names = CATALOGUE.iter().flat_map(|builtin| builtin.parameters).map(|parameter| parameter.name.to_owned());
    let key = prop_oneof![8 => prop::sample::select(names.collect::<Vec<_>>()), 1 => "[a-z?&=é\n]{0,6}"];
    let value = prop_oneof![
        4 => (0..40u32).prop_map(|value| value.to_string()),
        2 => any::<f64>().prop_map(|value| value.to_string()),
        1 => prop::sample::select(vec!["", "nan", "-0", "+3", "1e999", "phong", "=", "1=1", "\0"]).prop_map(str::to_owned),
    ];
    prop::collection::vec((key, value), 0..4)
        .prop_map(|pairs| pairs.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join("&"))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_parameters_make_a_scene_or_one_line(
        name in prop_oneof![8 => prop::sample::select(vec!["spheres", "field", "cornell", "quad", "overlap"]).prop_map(str::to_owned),
                            1 => "[a-z:?]{0,8}".prop_map(|name| if name == "hall" { String::new() } else { name })],
        query in query(),
    ) {
        match builtin::open(&format!("builtin:{name}?{query}")) {
            Ok(scene) => check(&scene),
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1, "{:?}", error),
        }
    }
}
