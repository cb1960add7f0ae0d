//! Values of lights, cameras and materials that clips change, clamped to valid ranges: a cubic may swing beyond its keys.

use glam::{DVec2, Vec3};

use super::{CameraValue, ChannelTarget, LightValue, MaterialValue};
use crate::camera::{FOV_Y_DEGREES, HEIGHT};
use crate::{AlphaMode, Camera, Light, LightKind, Material, Projection, UvMap};

/// The number of values of a target that is not a node's; 0 for a node's.
pub(super) fn count(target: ChannelTarget) -> usize {
    match target {
        ChannelTarget::Translation(_)
        | ChannelTarget::Rotation(_)
        | ChannelTarget::Scale(_)
        | ChannelTarget::Weights(_) => 0,
        ChannelTarget::Light(_, LightValue::Color) => 3,
        ChannelTarget::Light(..) | ChannelTarget::Camera(..) | ChannelTarget::Cell(_) => 1,
        ChannelTarget::Material(_, value) => match value {
            MaterialValue::BaseColor => 4,
            MaterialValue::Emissive => 3,
            MaterialValue::UvOffset(_) | MaterialValue::UvScale(_) => 2,
            MaterialValue::Metallic
            | MaterialValue::Roughness
            | MaterialValue::EmissiveStrength
            | MaterialValue::NormalScale
            | MaterialValue::AlphaCutoff
            | MaterialValue::UvRotation(_) => 1,
        },
    }
}

/// Not negative, and finite as f32.
fn positive(value: f64) -> f32 {
    between(value, 0.0, f64::from(f32::MAX)) as f32
}

fn share(value: f64) -> f32 {
    between(value, 0.0, 1.0) as f32
}

/// Clamps a value; a NaN, such as the sum of two opposite infinities, becomes the lowest.
fn between(value: f64, low: f64, high: f64) -> f64 {
    value.max(low).min(high)
}

fn positive_color(value: &[f64; 4]) -> Vec3 {
    Vec3::new(positive(value[0]), positive(value[1]), positive(value[2]))
}

/// Changes a light; values that its kind does not have are dropped.
pub(super) fn set_light(light: &mut Light, kind: LightValue, value: &[f64; 4]) {
    let degrees = between(value[0].to_degrees(), 0.0, 180.0);
    match (kind, &mut light.kind) {
        (LightValue::Color, _) => light.color = positive_color(value),
        (LightValue::Intensity, _) => light.intensity = positive(value[0]),
        (LightValue::Range, LightKind::Point { range, .. })
        | (LightValue::Range, LightKind::Spot { range, .. })
        | (LightValue::Range, LightKind::Beam { range, .. }) => *range = Some(between(value[0], 0.0, f64::MAX)),
        (LightValue::InnerAngle, LightKind::Spot { inner_angle_degrees, .. }) => *inner_angle_degrees = degrees,
        (LightValue::OuterAngle, LightKind::Spot { outer_angle_degrees, .. }) => *outer_angle_degrees = degrees,
        (LightValue::Range | LightValue::InnerAngle | LightValue::OuterAngle, _) => {}
    }
}

/// Keeps the inner angle of a cone within the outer one, once both have changed.
pub(super) fn settle(light: &mut Light) {
    if let LightKind::Spot { inner_angle_degrees, outer_angle_degrees, .. } = &mut light.kind {
        *inner_angle_degrees = inner_angle_degrees.min(*outer_angle_degrees);
    }
}

/// Changes a camera; values that its projection does not have are dropped.
pub(super) fn set_camera(camera: &mut Camera, kind: CameraValue, value: &[f64; 4]) {
    match (kind, &mut camera.projection) {
        (CameraValue::FovY, Projection::Perspective { fov_y_degrees }) => {
            *fov_y_degrees = between(value[0].to_degrees(), *FOV_Y_DEGREES.start(), *FOV_Y_DEGREES.end());
        }
        (CameraValue::HalfHeight, Projection::Orthographic { height }) => {
            *height = between(2.0 * value[0], *HEIGHT.start(), *HEIGHT.end());
        }
        (CameraValue::Near, _) => camera.near = between(value[0], 1e-12, 1e15),
        (CameraValue::FovY | CameraValue::HalfHeight, _) => {}
    }
}

/// Returns a material with changed values, the last one of each kind. The emission is [`MaterialValue::Emissive`], or the material's own emission,
/// times [`MaterialValue::EmissiveStrength`], if given.
pub(super) fn changed_material<'a>(
    material: &Material,
    values: impl Iterator<Item = (MaterialValue, &'a [f64; 4])>,
) -> Material {
    let mut changed = material.clone();
    let (mut emissive, mut strength) = (None, None);
    for (kind, value) in values {
        match kind {
            MaterialValue::Emissive => emissive = Some(positive_color(value)),
            MaterialValue::EmissiveStrength => strength = Some(value[0]),
            _ => set_material(&mut changed, kind, value),
        }
    }
    changed.emissive = emissive.unwrap_or(material.emissive);
    if let Some(strength) = strength {
        changed.emissive = changed.emissive.to_array().map(|own| positive(f64::from(own) * strength)).into();
    }
    changed
}

fn set_material(material: &mut Material, kind: MaterialValue, value: &[f64; 4]) {
    let uv_map = |material: &mut Material, slot: u8, change: &dyn Fn(&mut UvMap)| {
        if let Some(map) = material.uv_maps.get_mut(usize::from(slot)) {
            change(map);
        }
    };
    let pair = DVec2::new(value[0], value[1]);
    match kind {
        MaterialValue::BaseColor => {
            material.base_color = Vec3::new(share(value[0]), share(value[1]), share(value[2]));
            material.alpha = share(value[3]);
        }
        MaterialValue::Metallic => material.metallic = share(value[0]),
        MaterialValue::Roughness => material.roughness = share(value[0]),
        MaterialValue::NormalScale => {
            material.normal_scale = between(value[0], f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
        }
        MaterialValue::AlphaCutoff => {
            if let AlphaMode::Mask { cutoff } = &mut material.alpha_mode {
                *cutoff = share(value[0]);
            }
        }
        MaterialValue::UvOffset(slot) => uv_map(material, slot, &|map| map.offset = pair),
        MaterialValue::UvRotation(slot) => uv_map(material, slot, &|map| map.rotation = value[0]),
        MaterialValue::UvScale(slot) => uv_map(material, slot, &|map| map.scale = pair),
        // Emission combines two values, so it is set elsewhere.
        MaterialValue::Emissive | MaterialValue::EmissiveStrength => {}
    }
}
