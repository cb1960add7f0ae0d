//! Lobes of materials that a scene file gives and that are drawn otherwise than it says: named in warnings, as of glTF files.

use super::node::Table;
use super::schema;
use crate::{AlphaMode, Brdf, Error, MIN_SHEEN_ROUGHNESS, Material, Scene};

/// A key that asks for a lobe, and the lobe's name.
const LOBES: [(&str, &str); 4] = [
    ("sheen_color", "sheen"),
    ("film", "film"),
    ("anisotropy", "anisotropy"),
    ("diffuse_transmission", "diffuse transmission"),
];

/// Adds the warnings of the materials of a file, once all of its models wear them.
pub(super) fn warn(root: &Table, scene: &mut Scene) -> Result<(), Error> {
    for node in root.list("materials")? {
        let table = node.table(schema::MATERIAL)?;
        let name = table.get("name").map(|name| name.string()).transpose()?.unwrap_or_default();
        let numbers: Vec<usize> = (0..scene.materials.len()).filter(|&own| scene.materials[own].name == name).collect();
        for number in numbers {
            let told: Vec<String> = LOBES
                .into_iter()
                .filter_map(|(key, lobe)| Some((table.get(key)?, key, lobe)))
                .filter_map(|(node, key, lobe)| {
                    let what = fault(scene, number, key)?;
                    Some(node.wrong(format!("its {lobe} {what}")).to_string())
                })
                .collect();
            scene.warnings.extend(told);
        }
    }
    Ok(())
}

/// What is drawn in place of the lobe that a key asks for; `None` where that is the lobe.
fn fault(scene: &Scene, number: usize, key: &str) -> Option<String> {
    let material = &scene.materials[number];
    let is_asked_for = match key {
        "sheen_color" => material.sheen.is_seen(),
        "film" => material.film.strength > 0.0,
        "anisotropy" => material.anisotropy.is_seen(),
        _ => material.diffuse_transmission.is_seen(),
    };
    if !is_asked_for {
        return None;
    }
    if let Some(why) = has_none(material) {
        return Some(format!("is not drawn: {why} has none"));
    }
    match key {
        "sheen_color" if material.sheen.roughness < MIN_SHEEN_ROUGHNESS => {
            let own = material.sheen.roughness;
            Some(format!(
                "has a sheen_roughness of {own}, below the least of the model: taken for {MIN_SHEEN_ROUGHNESS}"
            ))
        }
        "film" if !material.film.is_seen() => Some("is 0 nm thick: drawn without it".into()),
        "anisotropy" => {
            let bare = |mesh: usize| scene.meshes[mesh].tangents.is_empty().then(|| scene.meshes[mesh].name.clone());
            let mut worn = scene.objects.iter().filter(|object| object.material == number);
            let mesh = worn.find_map(|object| bare(object.mesh))?;
            Some(format!(
                "is worn by mesh \"{mesh}\", which has neither tangents nor texture coordinates to make them of: drawn as rough in each direction"
            ))
        }
        _ => None,
    }
}

/// The reason why a material has no lobes, as a subject.
fn has_none(material: &Material) -> Option<&'static str> {
    match material.brdf {
        _ if material.unlit => Some("an unlit material"),
        _ if material.alpha_mode == AlphaMode::Coat => Some("a coat"),
        Brdf::CookTorrance => None,
        Brdf::Phong => Some("phong"),
        Brdf::BlinnPhong => Some("blinn-phong"),
        Brdf::Lambert => Some("lambert"),
    }
}
