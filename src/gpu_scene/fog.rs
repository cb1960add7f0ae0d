//! The fog's parameters for shaders: computed in 64 bits where heights are far from the camera's.

use glam::Vec3;

use crate::plan::FramePlan;
use crate::visible::{Eye, World};

/// The fog's part of `Frame` of `shaders/shared/frame.wgsl`; zeros where there is none.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FogUniform {
    /// The camera's height above the base, in scale heights.
    pub rise: f32,
    /// Scale heights in a metre.
    pub rate: f32,
    /// Mean radiance of light from everywhere, times the albedo, in nits.
    pub light: Vec3,
    /// The logarithm of the density.
    pub density: f32,
    pub albedo: f32,
    pub anisotropy: f32,
    /// Slices of froxels begin at near (exp(span i / n) - 1) metres.
    pub near: f32,
    pub span: f32,
}

/// Froxels reach so many times as far as they are equally thick.
const EVEN_SHARE: f64 = 8.0;

impl FogUniform {
    pub(super) fn of(world: &World, plan: &FramePlan, eye: &Eye) -> Self {
        let Some(fog) = &plan.effects.fog else { return Self::default() };
        let (ambient, _) = world.environment.hemispheres();
        let sky = world.sky.filter(|_| plan.is_lit_by_sky()).map_or(Vec3::ZERO, |sky| sky.mean);
        let [height, base] = [fog.height, fog.base].map(f64::from);
        let end = plan.froxels().map_or(EVEN_SHARE, |own| world.end_of_froxels(own, eye));
        Self {
            // Fog begins at the camera that was asked for.
            rise: ((eye.camera.position.y - eye.ahead * eye.camera.forward().y - base) / height) as f32,
            rate: (1.0 / height) as f32,
            light: (ambient + sky) * fog.albedo,
            density: f64::from(fog.density).ln() as f32,
            albedo: fog.albedo,
            anisotropy: fog.anisotropy,
            near: (end / EVEN_SHARE) as f32,
            span: EVEN_SHARE.ln_1p() as f32,
        }
    }
}
