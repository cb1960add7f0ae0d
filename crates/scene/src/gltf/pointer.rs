//! The target of an animation channel: a node's path, or the value that a JSON pointer leads to (KHR_animation_pointer).

use super::json::{Document, Whole, entry};
use crate::{CameraValue, LightValue, MaterialValue, TextureSlot};

/// The part of the file that a channel moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Aim {
    /// The translation of a node.
    Translation(usize),
    /// The rotation of a node.
    Rotation(usize),
    /// The scale of a node.
    Scale(usize),
    /// The morph weights of a node.
    Weights(usize),
    /// A value of a KHR_lights_punctual light.
    Light(usize, LightValue),
    /// A value of one of the file's cameras.
    Camera(usize, CameraValue),
    /// A value of one of the file's materials.
    Material(usize, MaterialValue),
}

impl Aim {
    /// The accessor type of its values.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Translation(_) | Self::Scale(_) => "VEC3",
            Self::Rotation(_) => "VEC4",
            Self::Light(_, LightValue::Color) | Self::Material(_, MaterialValue::Emissive) => "VEC3",
            Self::Material(_, MaterialValue::BaseColor) => "VEC4",
            Self::Material(_, MaterialValue::UvOffset(_) | MaterialValue::UvScale(_)) => "VEC2",
            Self::Weights(_) | Self::Light(..) | Self::Camera(..) | Self::Material(..) => "SCALAR",
        }
    }

    /// The number of components of a value.
    pub fn width(self, document: &Document) -> usize {
        match (self, self.kind()) {
            (Self::Weights(node), _) => shapes(document, node),
            (_, "VEC2") => 2,
            (_, "VEC3") => 3,
            (_, "VEC4") => 4,
            _ => 1,
        }
    }

    pub fn is_rotation(self) -> bool {
        matches!(self, Self::Rotation(_))
    }
}

/// Returns the number of morph targets of a node's mesh.
pub(super) fn shapes(document: &Document, node: usize) -> usize {
    let mesh = document.nodes.get(node).and_then(|node| document.meshes.get(node.mesh?.0));
    mesh.and_then(|mesh| mesh.primitives.iter().map(|primitive| primitive.targets.len()).max()).unwrap_or(0)
}

/// Returns the value that a pointer leads to.
///
/// # Errors
/// The fault, as a predicate whose subject is the pointer.
pub(super) fn aim(document: &Document, pointer: &str) -> Result<Aim, String> {
    let not_drawn = || "leads to nothing that is drawn and moves".to_owned();
    let parts: Vec<&str> = pointer.strip_prefix('/').ok_or_else(not_drawn)?.split('/').collect();
    let (list, number, rest) = match parts.as_slice() {
        ["extensions", "KHR_lights_punctual", "lights", number, rest @ ..] => ("lights", *number, rest),
        [list, number, rest @ ..] => (*list, *number, rest),
        _ => return Err(not_drawn()),
    };
    let number: usize = number.parse().map_err(|_| not_drawn())?;
    let index = Whole(number);
    let found = match list {
        "nodes" => entry("node", &document.nodes, index).map(|_| node(number, rest)),
        "cameras" => entry("camera", &document.cameras, index).map(|_| camera(number, rest)),
        "materials" => entry("material", &document.materials, index).map(|_| material(number, rest)),
        "lights" => {
            let lights = document.extensions.lights.as_ref().map_or(&[][..], |own| &own.lights);
            entry("light", lights, index).map(|_| light(number, rest))
        }
        _ => Ok(None),
    };
    found.map_err(|what| format!("leads nowhere: {what}"))?.ok_or_else(not_drawn)
}

fn node(number: usize, rest: &[&str]) -> Option<Aim> {
    Some(match rest {
        ["translation"] => Aim::Translation(number),
        ["rotation"] => Aim::Rotation(number),
        ["scale"] => Aim::Scale(number),
        ["weights"] => Aim::Weights(number),
        _ => return None,
    })
}

fn camera(number: usize, rest: &[&str]) -> Option<Aim> {
    let value = match rest {
        ["perspective", "yfov"] => CameraValue::FovY,
        ["orthographic", "ymag"] => CameraValue::HalfHeight,
        ["perspective" | "orthographic", "znear"] => CameraValue::Near,
        _ => return None,
    };
    Some(Aim::Camera(number, value))
}

fn light(number: usize, rest: &[&str]) -> Option<Aim> {
    let value = match rest {
        ["color"] => LightValue::Color,
        ["intensity"] => LightValue::Intensity,
        ["range"] => LightValue::Range,
        ["spot", "innerConeAngle"] => LightValue::InnerAngle,
        ["spot", "outerConeAngle"] => LightValue::OuterAngle,
        _ => return None,
    };
    Some(Aim::Light(number, value))
}

fn material(number: usize, rest: &[&str]) -> Option<Aim> {
    let value = match rest {
        ["pbrMetallicRoughness", "baseColorFactor"] => MaterialValue::BaseColor,
        ["pbrMetallicRoughness", "metallicFactor"] => MaterialValue::Metallic,
        ["pbrMetallicRoughness", "roughnessFactor"] => MaterialValue::Roughness,
        ["emissiveFactor"] => MaterialValue::Emissive,
        ["extensions", "KHR_materials_emissive_strength", "emissiveStrength"] => MaterialValue::EmissiveStrength,
        ["normalTexture", "scale"] => MaterialValue::NormalScale,
        ["alphaCutoff"] => MaterialValue::AlphaCutoff,
        [slot @ .., "extensions", "KHR_texture_transform", value] => {
            let slot = slot_called(slot)? as u8;
            match *value {
                "offset" => MaterialValue::UvOffset(slot),
                "rotation" => MaterialValue::UvRotation(slot),
                "scale" => MaterialValue::UvScale(slot),
                _ => return None,
            }
        }
        _ => return None,
    };
    Some(Aim::Material(number, value))
}

fn slot_called(path: &[&str]) -> Option<TextureSlot> {
    Some(match path {
        ["pbrMetallicRoughness", "baseColorTexture"] => TextureSlot::BaseColor,
        ["pbrMetallicRoughness", "metallicRoughnessTexture"] => TextureSlot::MetallicRoughness,
        ["normalTexture"] => TextureSlot::Normal,
        ["occlusionTexture"] => TextureSlot::Occlusion,
        ["emissiveTexture"] => TextureSlot::Emissive,
        ["extensions", "KHR_materials_specular", "specularColorTexture"] => TextureSlot::Specular,
        ["extensions", "KHR_materials_sheen", "sheenColorTexture"] => TextureSlot::Sheen,
        ["extensions", "KHR_materials_anisotropy", "anisotropyTexture"] => TextureSlot::Anisotropy,
        ["extensions", "KHR_materials_iridescence", "iridescenceThicknessTexture"] => TextureSlot::Film,
        ["extensions", "KHR_materials_volume", "thicknessTexture"] => TextureSlot::Film,
        ["extensions", "KHR_materials_diffuse_transmission", "diffuseTransmissionColorTexture"] => {
            TextureSlot::DiffuseTransmission
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_lead_to_what_moves_and_to_nothing_else() {
        let json = r#"{"nodes":[{}],"materials":[{}],"cameras":[{}],"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point"}]}}}"#;
        let document: Document = serde_json::from_str(json).unwrap();
        let of = |pointer: &str| aim(&document, pointer);
        let material = |value| Ok(Aim::Material(0, value));
        assert_eq!(of("/nodes/0/rotation"), Ok(Aim::Rotation(0)));
        assert_eq!(of("/cameras/0/orthographic/ymag"), Ok(Aim::Camera(0, CameraValue::HalfHeight)));
        let light = "/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle";
        assert_eq!(of(light), Ok(Aim::Light(0, LightValue::OuterAngle)));
        assert_eq!(of("/materials/0/pbrMetallicRoughness/baseColorFactor"), material(MaterialValue::BaseColor));
        let transform = "/materials/0/emissiveTexture/extensions/KHR_texture_transform/rotation";
        assert_eq!(of(transform), material(MaterialValue::UvRotation(TextureSlot::Emissive as u8)));
        for pointer in
            ["", "/", "nodes/0/scale", "/nodes/1/scale", "/nodes/x/scale", "/nodes/0/weights/0", "/materials/0/name"]
        {
            assert!(of(pointer).unwrap_err().starts_with("leads "), "{pointer}");
        }
    }
}
