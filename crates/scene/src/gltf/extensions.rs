//! The extensions that are drawn, and the warnings for the others.

use super::json::Document;

/// Extensions that are read and drawn; docs/SCENES.md says how.
pub(super) const DRAWN: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Extensions that change no picture.
const UNSEEN: &[&str] =
    &["KHR_xmp", "KHR_xmp_json_ld", "FB_ngon_encoding", "EXT_structural_metadata", "EXT_mesh_features"];

/// Refuses a file that cannot be shown without an extension that is not drawn.
pub(super) fn check_required(document: &Document) -> Result<(), String> {
    let unknown = |name: &&String| ![DRAWN, UNSEEN].iter().any(|list| list.contains(&name.as_str()));
    let lacking: Vec<String> =
        document.extensions_required.iter().filter(unknown).map(|name| name.escape_debug().to_string()).collect();
    match lacking.as_slice() {
        [] => Ok(()),
        [one] => Err(format!("requires the extension {one}, which is not supported")),
        more => Err(format!("requires the extensions {}, which are not supported", more.join(", "))),
    }
}

/// One line with all that the file uses and that is not drawn.
pub(super) fn not_drawn(document: &Document) -> Option<String> {
    let unknown = |name: &&String| !DRAWN.contains(&name.as_str()) && !UNSEEN.contains(&name.as_str());
    let mut names: Vec<String> =
        document.extensions_used.iter().filter(unknown).map(|name| name.escape_debug().to_string()).collect();
    names.sort_unstable();
    names.dedup();
    (!names.is_empty()).then(|| format!("extensions that are not drawn: {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_file_requires_and_nobody_draws_is_an_error_and_what_it_uses_a_warning() {
        let document = |json: &str| serde_json::from_str::<Document>(json).unwrap();
        let used = r#""extensionsUsed":["VENDOR_y","KHR_materials_ior","VENDOR_x","VENDOR_x"]"#;
        let used = document(&format!("{{{used}}}"));
        assert_eq!(check_required(&used), Ok(()));
        assert_eq!(not_drawn(&used).unwrap(), "extensions that are not drawn: VENDOR_x, VENDOR_y");
        let required = document(r#"{"extensionsRequired":["KHR_materials_ior","VENDOR_x"]}"#);
        assert!(check_required(&required).unwrap_err().contains("requires the extension VENDOR_x,"));
        let leaf = r#"["KHR_materials_diffuse_transmission"]"#;
        let drawn = document(&format!(r#"{{"extensionsUsed":{leaf},"extensionsRequired":{leaf}}}"#));
        assert_eq!((check_required(&drawn), not_drawn(&drawn)), (Ok(()), None));
        assert_eq!(not_drawn(&document("{}")), None);
    }
}
