//! Choices of the scene that shaders get as numbers. The scene's crate has no shaders, so each number stands there as well: the build fails where they
//! differ.

use crate::scene::{Brdf, Falloff, NO_FALLOFF, ShadowFilter, TRAITS, TextureSlot, Tonemap};
use crate::shaders::shared::{brdf, lights, material, seen, shadows, tonemap};

const _: () = {
    assert!(Brdf::CookTorrance as u32 == brdf::COOK_TORRANCE);
    assert!(Brdf::Phong as u32 == brdf::PHONG);
    assert!(Brdf::BlinnPhong as u32 == brdf::BLINN_PHONG);
    assert!(Brdf::Lambert as u32 == brdf::LAMBERT);
};

const _: () = {
    assert!(Falloff::InverseSquare.index() == lights::INVERSE_SQUARE);
    assert!(Falloff::Quadratic.index() == lights::QUADRATIC);
    assert!(Falloff::Polynomial { constant: 1.0, linear: 0.0, quadratic: 0.0 }.index() == lights::POLYNOMIAL);
    assert!(NO_FALLOFF == lights::NO_FALLOFF);
    // In the order of reports.
    let [cones, beams, ranges] = TRAITS else { panic!("a trait of lights that shaders do not know") };
    assert!(cones.bit == lights::CONES && beams.bit == lights::BEAMS && ranges.bit == lights::RANGES);
};

const _: () = {
    assert!(ShadowFilter::None as u32 == shadows::NO_FILTER);
    assert!(ShadowFilter::Box2 as u32 == shadows::BOX_TWO);
    assert!(ShadowFilter::Box3 as u32 == shadows::BOX_THREE);
    assert!(ShadowFilter::Box5 as u32 == shadows::BOX_FIVE);
    assert!(ShadowFilter::Poisson as u32 == shadows::POISSON);
    assert!(ShadowFilter::Pcss as u32 == shadows::PCSS);
};

// Every other number clamps.
const _: () = {
    assert!(Tonemap::Neutral as u32 == tonemap::NEUTRAL);
    assert!(Tonemap::Agx as u32 == tonemap::AGX);
    assert!(Tonemap::Aces as u32 == tonemap::ACES);
    assert!(Tonemap::None as u32 > tonemap::ACES);
};

// Bits of `TextureMask`, and of the traits that TILED looks up.
const _: () = {
    assert!(TextureSlot::BaseColor as u32 == material::BASE_COLOR_SLOT);
    assert!(TextureSlot::Normal as u32 == material::NORMAL_SLOT);
    assert!(TextureSlot::MetallicRoughness as u32 == material::METALLIC_ROUGHNESS_SLOT);
    assert!(TextureSlot::Occlusion as u32 == material::OCCLUSION_SLOT);
    assert!(TextureSlot::Emissive as u32 == material::EMISSIVE_SLOT);
    assert!(TextureSlot::Specular as u32 == material::SPECULAR_SLOT);
    assert!(TextureSlot::Shininess as u32 == material::SHININESS_SLOT);
    // A normal map is a variant of material.wgsl, without a bit.
    assert!(material::BASE_COLOR == 1 << material::BASE_COLOR_SLOT && seen::BASE_COLOR == material::BASE_COLOR);
    assert!(seen::NORMAL == 1 << material::NORMAL_SLOT);
    assert!(material::METALLIC_ROUGHNESS == 1 << material::METALLIC_ROUGHNESS_SLOT);
    assert!(seen::METALLIC_ROUGHNESS == material::METALLIC_ROUGHNESS);
    assert!(material::OCCLUSION == 1 << material::OCCLUSION_SLOT && seen::OCCLUSION == material::OCCLUSION);
    assert!(material::EMISSIVE == 1 << material::EMISSIVE_SLOT && seen::EMISSIVE == material::EMISSIVE);
    assert!(material::SPECULAR == 1 << material::SPECULAR_SLOT && seen::SPECULAR == material::SPECULAR);
    assert!(material::SHININESS == 1 << material::SHININESS_SLOT && seen::SHININESS == material::SHININESS);
};
