//! Choices of the scene that shaders get as numbers. The scene's crate has no shaders, so each number stands there as well: the build fails where they
//! differ.

use crate::scene::{Brdf, Falloff, NO_FALLOFF, STROKE_VERTICES, ShadowFilter, TRAITS, TextureSlot, Tonemap};
use crate::shaders::shared::{brdf, lights, material, seen, shadows, strokes, tonemap};

/// Asserts the number of each variant. One that is missing does not compile.
macro_rules! codes {
    ($choice:ident: $($variant:ident = $code:expr),+ $(,)?) => {
        const _: () = {
            const fn code(of: $choice) -> u32 {
                match of {
                    $($choice::$variant => $code),+
                }
            }
            $(assert!(code($choice::$variant) == $choice::$variant as u32);)+
        };
    };
}

codes! {
    Brdf: CookTorrance = brdf::COOK_TORRANCE, Phong = brdf::PHONG, BlinnPhong = brdf::BLINN_PHONG, Lambert = brdf::LAMBERT
}
codes! {
    ShadowFilter: None = shadows::NO_FILTER, Box2 = shadows::BOX_TWO, Box3 = shadows::BOX_THREE, Box5 = shadows::BOX_FIVE,
    Poisson = shadows::POISSON, Pcss = shadows::PCSS
}
// A number beyond all curves clamps.
codes! {
    Tonemap: Neutral = tonemap::NEUTRAL, Agx = tonemap::AGX, Aces = tonemap::ACES, None = tonemap::ACES + 1
}
codes! {
    TextureSlot: BaseColor = material::BASE_COLOR_SLOT, Normal = material::NORMAL_SLOT,
    MetallicRoughness = material::METALLIC_ROUGHNESS_SLOT, Occlusion = material::OCCLUSION_SLOT,
    Emissive = material::EMISSIVE_SLOT, Specular = material::SPECULAR_SLOT, Shininess = material::SHININESS_SLOT,
    Sheen = material::SHEEN_SLOT, Film = material::FILM_SLOT, Anisotropy = material::ANISOTROPY_SLOT,
    DiffuseTransmission = material::DIFFUSE_TRANSMISSION_SLOT
}

const _: () = {
    assert!(Falloff::InverseSquare.index() == lights::INVERSE_SQUARE);
    assert!(Falloff::Quadratic.index() == lights::QUADRATIC);
    assert!(Falloff::Polynomial { constant: 1.0, linear: 0.0, quadratic: 0.0 }.index() == lights::POLYNOMIAL);
    assert!(NO_FALLOFF == lights::NO_FALLOFF);
    assert!(STROKE_VERTICES == strokes::STROKE_VERTICES as usize);
    // `TRAITS` lists them in the order of reports.
    let [cones, beams, ranges] = TRAITS else { panic!("a trait of lights that shaders do not know") };
    assert!(cones.bit == lights::CONES && beams.bit == lights::BEAMS && ranges.bit == lights::RANGES);
};

// Bits of `TextureMask`, and of the traits that TILED looks up.
const _: () = {
    // A normal map is a variant of material.wgsl, without a bit.
    assert!(material::BASE_COLOR == 1 << material::BASE_COLOR_SLOT && seen::BASE_COLOR == material::BASE_COLOR);
    assert!(seen::NORMAL == 1 << material::NORMAL_SLOT);
    assert!(material::METALLIC_ROUGHNESS == 1 << material::METALLIC_ROUGHNESS_SLOT);
    assert!(seen::METALLIC_ROUGHNESS == material::METALLIC_ROUGHNESS);
    assert!(material::OCCLUSION == 1 << material::OCCLUSION_SLOT && seen::OCCLUSION == material::OCCLUSION);
    assert!(material::EMISSIVE == 1 << material::EMISSIVE_SLOT && seen::EMISSIVE == material::EMISSIVE);
    assert!(material::SPECULAR == 1 << material::SPECULAR_SLOT && seen::SPECULAR == material::SPECULAR);
    assert!(material::SHININESS == 1 << material::SHININESS_SLOT && seen::SHININESS == material::SHININESS);
    assert!(material::SHEEN == 1 << material::SHEEN_SLOT && material::FILM == 1 << material::FILM_SLOT);
    assert!(material::ANISOTROPY == 1 << material::ANISOTROPY_SLOT);
    assert!(material::DIFFUSE_TRANSMISSION == 1 << material::DIFFUSE_TRANSMISSION_SLOT);
};
