//! Materials in the form that glTF can express: metallic-roughness, with the extensions that the reader draws.

use std::collections::{BTreeSet, HashMap};

use glam::Vec3;

use super::expressible::tell;
use crate::{
    AlphaMode, Anisotropy, Brdf, DIELECTRIC, DiffuseTransmission, Material, Object, Refraction, Scene, Sheen,
    TextureSlot, ThinFilm,
};

pub(super) fn is_coat(material: &Material) -> bool {
    material.alpha_mode == AlphaMode::Coat
}

/// Changes each material to one that the writer can express.
pub(super) fn express(scene: &mut Scene, left_out: &mut Vec<String>) {
    let before = scene.objects.len();
    drop_lone_coats(scene);
    tell(left_out, before - scene.objects.len(), "coat", "lies on no other object and is left out");
    let worn: BTreeSet<usize> = scene.objects.iter().map(|object| object.material).collect();
    let (mut phong, mut atlases, mut glass, mut faded) = (0, 0, 0, 0);
    let textures = &mut scene.textures;
    for (_, material) in scene.materials.iter_mut().enumerate().filter(|(index, _)| worn.contains(index)) {
        // The reader merges a transmission texture into the colour's alpha, which glTF ignores for glass.
        let color = material.texture(TextureSlot::BaseColor).filter(|_| material.alpha_mode == AlphaMode::Glass);
        if color.is_some_and(|index| textures[index].rgba8_mut().chunks_exact(4).any(|texel| texel[3] < 255)) {
            material.alpha_mode = AlphaMode::Blend;
            glass += 1;
        }
        if material.alpha_mode == AlphaMode::Glass && material.refraction.is_none() && material.alpha < 1.0 {
            material.refraction = Some(Refraction::THIN);
            faded += 1;
        }
        if !material.unlit && !is_coat(material) {
            phong += usize::from(model(material));
        }
        (material.brdf, material.specular, material.shininess, material.ambient) =
            (Brdf::CookTorrance, Vec3::ZERO, 0.0, 1.0);
        *material.texture_mut(TextureSlot::Shininess) = None;
        atlases += usize::from(std::mem::replace(&mut material.atlas, [1, 1]) != [1, 1]);
        normal_form(material);
    }
    tell(left_out, phong, "material", "a Phong model is written as metallic-roughness with a highlight about as wide");
    tell(left_out, glass, "material", "glass whose texture says how much light it holds back is written as blended");
    tell(
        left_out,
        faded,
        "material",
        "glass that fades what is behind it is written as a thin wall, which tints it, too",
    );
    tell(left_out, atlases, "material", "the whole atlas is shown in place of a cell");
}

/// Replaces another reflection model by glTF's. Returns true if the result is only an approximation.
fn model(material: &mut Material) -> bool {
    // The other models have no additional lobes.
    if material.brdf != Brdf::CookTorrance {
        (material.sheen, material.film) = (Sheen::NONE, ThinFilm::NONE);
        (material.anisotropy, material.refraction) = (Anisotropy::NONE, None);
        material.diffuse_transmission = DiffuseTransmission::NONE;
    }
    match material.brdf {
        Brdf::CookTorrance => return false,
        // A dielectric that reflects nothing at any angle is a lambert surface, exactly (KHR_materials_specular).
        Brdf::Lambert => (material.metallic, material.reflectance, material.grazing) = (0.0, Vec3::ZERO, 0.0),
        Brdf::Phong | Brdf::BlinnPhong => {
            // Converts Ns of (N.H)^Ns to the alpha of a GGX lobe: alpha^2 = 2 / (Ns + 2) (B. Walter et al., "Microfacet Models for Refraction through
            // Rough Surfaces", 2007). (R.E)^n is about (N.H)^(4 n).
            let ns = if material.brdf == Brdf::Phong { 4.0 * material.shininess } else { material.shininess };
            let alpha = (2.0 / (f64::from(ns) + 2.0)).sqrt();
            material.roughness = alpha.sqrt() as f32;
            (material.metallic, material.reflectance) = (0.0, material.specular);
            material.grazing = material.specular.max_element();
        }
    }
    *material.texture_mut(TextureSlot::MetallicRoughness) = None;
    if material.brdf == Brdf::Lambert {
        *material.texture_mut(TextureSlot::Specular) = None;
        return false;
    }
    true
}

/// Changes a material to the form that the reader makes from its glTF.
fn normal_form(material: &mut Material) {
    match material.alpha_mode {
        AlphaMode::Opaque => material.alpha = 1.0,
        AlphaMode::Glass if material.alpha == 1.0 && material.base_color_texture.is_none() => {
            material.alpha_mode = AlphaMode::Opaque;
        }
        _ => {}
    }
    if is_coat(material) {
        *material = lacquer(material);
    }
    if material.unlit {
        // An unlit material reflects nothing: these values do not matter.
        (material.reflectance, material.grazing, material.specular_texture) = (Vec3::splat(DIELECTRIC), 1.0, None);
    }
    if material.unlit || !material.sheen.is_seen() {
        (material.sheen, material.sheen_texture) = (Sheen::NONE, None);
    }
    if material.unlit || !material.anisotropy.is_seen() {
        (material.anisotropy, material.anisotropy_texture) = (Anisotropy::NONE, None);
    }
    if material.unlit || !material.diffuse_transmission.is_seen() {
        (material.diffuse_transmission, material.diffuse_transmission_texture) = (DiffuseTransmission::NONE, None);
    }
    if material.unlit || material.alpha_mode != AlphaMode::Glass {
        material.refraction = None;
    }
    if material.unlit || !material.film.is_seen() {
        material.film = ThinFilm::NONE;
    }
    if !material.film.is_seen() && material.refraction.is_none_or(|own| own.thickness == 0.0) {
        material.film_texture = None;
    }
    // An untextured film has its greatest thickness.
    if material.film_texture.is_none() && material.film.is_seen() {
        material.film.nanometres[0] = material.film.nanometres[1];
    }
    if !material.is_emissive() {
        material.emissive_texture = None;
    }
    if material.reflectance_texture().is_none() {
        material.specular_texture = None;
    }
}

/// Returns a coat in the form that KHR_materials_clearcoat can express.
fn lacquer(material: &Material) -> Material {
    let Material { alpha, alpha_mode, roughness, normal_scale, two_sided, uv_maps, .. } = *material;
    let Material { base_color_texture, normal_texture, metallic_roughness_texture, .. } = *material;
    Material {
        name: material.name.clone(),
        base_color: Vec3::ONE,
        alpha,
        alpha_mode,
        roughness,
        normal_scale,
        two_sided,
        uv_maps,
        base_color_texture,
        normal_texture,
        metallic_roughness_texture,
        ..Material::default()
    }
}

/// Leaves out coats without an object under them: a coat is written as a property of that object.
fn drop_lone_coats(scene: &mut Scene) {
    let objects = std::mem::take(&mut scene.objects);
    let coated = |object: &Object| scene.materials.get(object.material).is_some_and(is_coat);
    let mut kept: Vec<Object> = Vec::with_capacity(objects.len());
    let (coats, others): (Vec<_>, Vec<_>) = objects.into_iter().partition(coated);
    let mut places: HashMap<(usize, [u64; 12]), Vec<Object>> = HashMap::new();
    for coat in coats {
        places.entry(place(&coat)).or_default().push(coat);
    }
    for object in others {
        let coat = places.get_mut(&place(&object)).and_then(Vec::pop);
        kept.push(object);
        // A coat follows its object, as the reader lists them.
        kept.extend(coat);
    }
    scene.objects = kept;
}

/// Returns the mesh and the transform, which an object and its coat share.
fn place(object: &Object) -> (usize, [u64; 12]) {
    (object.mesh, object.transform.to_cols_array().map(f64::to_bits))
}
