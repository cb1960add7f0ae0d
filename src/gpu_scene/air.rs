//! Fog data for shaders, computed in 64 bits where heights are far from the camera's, and the binding of the scattered light.

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::gpu::{Buffer, SetLayoutBinding, SetWriter, binding};
use crate::plan::FramePlan;
use crate::visible::{Eye, World};

/// `Air` of `shaders/shared/air.wgsl`; zeros without fog.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub struct AirRecord {
    light: Vec3,
    density: f32,
    albedo: f32,
    anisotropy: f32,
    near: f32,
    span: f32,
    rise: f32,
    rate: f32,
    _padding: [f32; 2],
}

const _: () = {
    use crate::shaders::fog::structs::air as wgsl;
    use std::mem::offset_of;
    assert!(size_of::<AirRecord>() == wgsl::SIZE);
    assert!(offset_of!(AirRecord, light) == wgsl::LIGHT && offset_of!(AirRecord, density) == wgsl::DENSITY);
    assert!(offset_of!(AirRecord, albedo) == wgsl::ALBEDO && offset_of!(AirRecord, anisotropy) == wgsl::ANISOTROPY);
    assert!(offset_of!(AirRecord, near) == wgsl::NEAR && offset_of!(AirRecord, span) == wgsl::SPAN);
    assert!(offset_of!(AirRecord, rise) == wgsl::RISE && offset_of!(AirRecord, rate) == wgsl::RATE);
};

/// Ratio of the far end of the froxels to the distance up to which their slices are about equally thick.
const EVEN_SHARE: f64 = 8.0;

impl AirRecord {
    pub(super) fn of(world: &World, plan: &FramePlan, eye: &Eye) -> Self {
        let Some(fog) = &plan.effects.fog else { return Self::default() };
        let (ambient, _) = world.environment.hemispheres();
        let sky = world.sky.filter(|_| plan.is_lit_by_sky()).map_or(Vec3::ZERO, |sky| sky.mean);
        let [height, base] = [fog.height, fog.base].map(f64::from);
        let end = plan.froxels().map_or(EVEN_SHARE, |own| world.end_of_froxels(own, eye));
        Self {
            light: (ambient + sky) * fog.albedo,
            density: f64::from(fog.density).ln() as f32,
            albedo: fog.albedo,
            anisotropy: fog.anisotropy,
            near: (end / EVEN_SHARE) as f32,
            span: EVEN_SHARE.ln_1p() as f32,
            // Fog begins at the camera that was asked for.
            rise: ((eye.camera.position.y - eye.ahead * eye.camera.forward().y - base) / height) as f32,
            rate: (1.0 / height) as f32,
            _padding: [0.0; 2],
        }
    }
}

/// The light in the air, as `shaders/shared/froxels.wgsl` declares it.
const LIGHT: u32 = 14;

/// The binding of set 0.
pub(super) fn bindings(plan: &FramePlan) -> Option<SetLayoutBinding> {
    let stages = vk::ShaderStageFlags::FRAGMENT | vk::ShaderStageFlags::COMPUTE;
    plan.names_froxels().then(|| binding(LIGHT, vk::DescriptorType::STORAGE_BUFFER, stages))
}

/// Names the light in the air, where the layout has its binding. Without froxels `instead` takes its place, a buffer that nobody reads there.
pub(super) fn write(
    plan: &FramePlan,
    light: Option<&Buffer>,
    instead: Option<&Buffer>,
    writer: SetWriter,
) -> SetWriter {
    match light.or(instead).filter(|_| plan.names_froxels()) {
        Some(buffer) => writer.storage_buffer(LIGHT, buffer, buffer.size),
        None => writer,
    }
}
