//! The materials of points and lines that have no normals.

use glam::Vec3;

use crate::{AlphaMode, Brdf, Material};

/// The material that shows the sum of base colour and emission in any light (glTF 2.0, "Point and Line Materials"), as far as materials here can: see
/// [`lost_of_unlit`].
pub(super) fn unlit(material: &Material) -> Material {
    let mut own = material.clone();
    // Light that passes through a surface is the surface's: KHR_materials_unlit rules it out as well.
    if own.alpha_mode == AlphaMode::Glass {
        (own.alpha_mode, own.alpha) = (AlphaMode::Opaque, 1.0);
    }
    if !own.is_emissive() || own.unlit || !is_summable(&own) {
        own.unlit = true;
        return own;
    }
    // Black and without a highlight, it shows its emission alone.
    own.emissive += own.base_color;
    (own.base_color, own.metallic, own.brdf, own.ambient) = (Vec3::ZERO, 0.0, Brdf::Lambert, 0.0);
    own
}

/// The part of the sum that is not drawn, in words.
pub(super) fn lost_of_unlit(material: &Material) -> Option<String> {
    let is_lost = material.is_emissive() && !material.unlit && !is_summable(material);
    is_lost.then(|| {
        let name = &material.name;
        format!("material `{name}` of points or lines without normals: both its base colour and its emission are textured, drawn without the emission")
    })
}

/// One texture cannot hold the sum of two.
fn is_summable(material: &Material) -> bool {
    let is_black = material.base_color == Vec3::ZERO;
    is_black || material.base_color_texture.is_none() && material.emissive_texture.is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_and_lines_without_normals_show_base_colour_and_emission() {
        let base = Vec3::new(0.5, 0.25, 0.0);
        let plain = Material { base_color: base, ..Material::default() };
        let own = unlit(&plain);
        assert!(own.unlit && own.base_color == base);
        let emissive = Material { emissive: Vec3::new(0.0, 2.0, 1.0), ..plain.clone() };
        let own = unlit(&emissive);
        assert_eq!((own.unlit, own.base_color, own.emissive), (false, Vec3::ZERO, Vec3::new(0.5, 2.25, 1.0)));
        assert_eq!((own.brdf, lost_of_unlit(&emissive)), (Brdf::Lambert, None));
        let textured = Material { base_color_texture: Some(0), ..emissive.clone() };
        assert!(unlit(&textured).unlit && lost_of_unlit(&textured).unwrap().contains("without the emission"));
        let lamp = Material { base_color: Vec3::ZERO, emissive_texture: Some(0), ..emissive };
        assert!(!unlit(&lamp).unlit && lost_of_unlit(&lamp).is_none());
        let glass = Material { alpha_mode: AlphaMode::Glass, alpha: 0.1, ..plain };
        assert_eq!((unlit(&glass).alpha_mode, unlit(&glass).alpha), (AlphaMode::Opaque, 1.0));
    }
}
