//! LOBES: opaque surfaces with lobes that the G-buffer has no room for, lit as they are drawn, in place of what LIGHTING and AMBIENT have made of their base and highlight.
//!
//! GEOMETRY draws these surfaces as all others, so that passes which read depth, normals or roughness know them. Limits: screen-space occlusion does not
//! darken them, and reflections are found for their highlight as if it lay bare.

use super::screen::replace;
use super::surface::{Limits, LitDesc, SurfacePipelines, lit_pipeline};
use super::{
    Endpoint, FrameContext, Making, Pass, PassRecorder, Presence, SAMPLED, culled, frame_data, looked_up, maps, meshes,
};
use crate::gpu::{self, DepthState, sync::Use, vk};
use crate::plan::Shading;
use crate::shaders::forward::Flags;

/// Looks shadow maps up.
pub const MAP_READ: Use = SAMPLED;

pub const PASS: Pass = Pass {
    name: Endpoint::pass("LOBES"),
    time: "lobes",
    what: "surfaces with lobes that the G-buffer has no room for, lit once more as they are drawn",
    presence: |plan| match plan.shading {
        Shading::Light { .. } if plan.relights() => {
            Presence::In("materials have lobes beside base and highlight".into())
        }
        Shading::Light { .. } if plan.is_forward() => Presence::Out("surfaces are lit as they are drawn".into()),
        Shading::Light { .. } => Presence::Out("no opaque material has a lobe beside base and highlight".into()),
        _ => Presence::Out("this view is not lit".into()),
    },
    // It draws into the attachments of LIGHTING, in whose subpass it is.
    touches: |plan| {
        let drawn = [frame_data()].into_iter().chain(meshes(plan)).chain(culled(plan));
        drawn.chain(maps(plan, MAP_READ)).chain(looked_up(plan)).collect()
    },
    leave_out: None,
    make: Some(|own| Ok(Box::new(LobesPass::new(own)?))),
};

/// The pass: a pipeline for each [`GeometryKey`](crate::plan::GeometryKey) of the plan that has lobes.
pub struct LobesPass {
    surfaces: SurfacePipelines,
}

impl LobesPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, layouts, plan, scene, .. } = own;
        let slot = own.slot()?;
        let surfaces = SurfacePipelines::new(device, plan, ("lobes", &plan.lobes), layouts, scene)?;
        let mut surfaces = surfaces.relighting();
        for &key in &plan.lobes {
            let desc = LitDesc {
                name: "lobes",
                weighted: Flags::NONE,
                limits: Limits::unweighted(plan.largest_light(), 0.0),
                masked: key.discards,
                // The depth of the surface that GEOMETRY has drawn, to the bit: both shaders have the same arithmetic, which is precise.
                depth: DepthState { test: vk::CompareOp::EQUAL, write: false },
                blend: &[replace()],
            };
            let pipeline = lit_pipeline(device, plan, slot, key, surfaces.layout(key), &desc)?;
            surfaces.insert(key, pipeline);
        }
        Ok(Self { surfaces })
    }
}

impl PassRecorder for LobesPass {
    /// Draws visible objects. Runs inside LIGHTING's subpass, after all light that is added.
    fn record(&self, context: &FrameContext) {
        self.surfaces.record_opaque(context);
    }
}

/// Returns the shader variant of one of the plan's pipelines.
#[cfg(test)]
pub(crate) fn flags(plan: &crate::plan::FramePlan, key: crate::plan::GeometryKey) -> Flags {
    super::surface::lit_flags(plan, key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Capabilities, FramePlan, GeometryKey, samples};
    use crate::scene::{Brdf, LightPath, Material, Scene, Settings, Sheen, Transparency, View};
    use crate::shaders::forward as shader;

    fn velvet() -> Material {
        Material {
            sheen: Sheen { color: glam::Vec3::splat(0.5), roughness: 0.4 },
            ..samples::textured(Brdf::CookTorrance)
        }
    }

    fn dressed() -> Scene {
        samples::scene(vec![velvet(), samples::material(Brdf::CookTorrance)], vec![samples::sun()])
    }

    /// The bindings of set 0 that the plan's frames have, as `src/gpu_scene/view.rs` makes them.
    fn has_binding(plan: &FramePlan, binding: u32) -> bool {
        match binding {
            0 => true,
            1 => plan.lights.any(),
            2 | 3 => plan.has_clusters(),
            5 => !plan.textures.mapped.is_empty(),
            7..=10 => plan.is_lit_by_sky(),
            11 | 13 => plan.effects.lobes.is_some(),
            12 => plan.is_lit_by_sky() && plan.shadow.is_some(),
            14 => plan.names_froxels(),
            _ => false,
        }
    }

    #[test]
    fn every_pipeline_has_a_shader_whose_bindings_and_streams_are_the_plans() {
        let mut pipelines = 0;
        for (name, plan) in samples::plans().iter().chain(&samples::plans_of_effects()) {
            for &key in &plan.lobes {
                let flags = flags(plan, key);
                let variant = shader::variant(flags).unwrap_or_else(|| panic!("{name}: no variant {flags:?}"));
                let stages = [variant.vertex(), variant.fragment()].into_iter().flatten();
                for binding in stages.flat_map(|stage| stage.bindings).filter(|binding| binding.set == 0) {
                    assert!(has_binding(plan, binding.binding), "{name} {key:?}: {}", binding.name);
                }
                assert!(plan.geometry.contains(&GeometryKey { forward: None, ..key }), "{name} {key:?}");
                assert!(plan.streams.normals, "{name} {key:?}");
                pipelines += 1;
            }
        }
        assert!(pipelines > 0);
    }

    #[test]
    fn surfaces_with_lobes_take_no_byte_of_the_gbuffer_and_others_no_pass() {
        let settings = samples::deferred();
        let bare =
            samples::scene(vec![samples::textured(Brdf::CookTorrance), Material::default()], vec![samples::sun()]);
        let [with, without] = [dressed(), bare].map(|scene| samples::plan(&scene, &settings));
        assert_eq!((with.lobes.len(), without.lobes.len()), (1, 0));
        assert_eq!(with.gbuffer_bytes_per_pixel(), without.gbuffer_bytes_per_pixel());
        assert_eq!(with.target_bytes_per_pixel(), without.target_bytes_per_pixel());
        assert!(
            matches!((PASS.presence)(&with), Presence::In(_)) && matches!((PASS.presence)(&without), Presence::Out(_))
        );
        // Without a lobe the slots of lobes are not there: no texture, no row of a UV map.
        assert_eq!((with.textures.mapped_slots, without.textures.mapped_slots), (11, 7));
        assert!(without.textures.images.len() < with.textures.images.len());
    }

    #[test]
    fn lobes_are_drawn_where_the_picture_is_lit_and_refused_where_compute_writes_it() {
        let plan = |scene: &Scene, settings: Settings| FramePlan::of(scene, &settings, &Capabilities::ample());
        let scene = dressed();
        let on = |light_path| plan(&scene, Settings { light_path, ..Settings::default() });
        let forward = on(LightPath::Forward).expect("a plan");
        assert!(forward.lobes.is_empty() && forward.geometry.iter().any(|key| !key.lobes.is_empty()));
        let why = on(LightPath::Compute).map(|_| ()).expect_err("refused").to_string();
        assert!(why.contains("--light-path compute cannot draw lobes of materials"), "{why}");
        for settings in [
            Settings { view: View::Lighting, ..samples::deferred() },
            Settings { view: View::Albedo, ..samples::deferred() },
            Settings { textbook: true, ..samples::deferred() },
            Settings { brdf: Some(Brdf::Phong), ..samples::deferred() },
        ] {
            let plan = plan(&scene, settings).expect("a plan");
            assert!(plan.lobes.is_empty() && plan.effects.lobes.is_none(), "{:?}", plan.shading);
        }
        // Transparent surfaces have them where they are sorted.
        let gauze = Material { alpha_mode: crate::scene::AlphaMode::Blend, alpha: 0.5, ..velvet() };
        let gauze = samples::scene(vec![gauze, Material::default()], vec![samples::sun()]);
        for (transparency, has) in [(Transparency::Sorted, true), (Transparency::Oit, false)] {
            let plan = plan(&gauze, Settings { transparency, ..samples::deferred() }).expect("a plan");
            assert!(plan.lobes.is_empty());
            assert_eq!(plan.transparent.iter().any(|key| !key.lobes.is_empty()), has, "{transparency}");
        }
    }
}
