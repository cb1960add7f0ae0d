//! GEOMETRY: surfaces into the G-buffer, emissive light into the light target.

use std::sync::Arc;

use ash::vk;

use super::screen::{add, replace};
use super::surface::{SurfaceDesc, SurfacePipelines, opaque_depth, surface_pipeline};
use super::{
    COLOR_BLEND, ContentsIfFirst, EARLY_DEPTH_READ, Endpoint, FrameContext, LATE_DEPTH_WRITE, Making, Pass,
    PassRecorder, Presence, ResourceUse, SetLayouts, Slot, culled, frame_data, meshes, needed,
};
use crate::gpu::{self, Device, Owned, sync::Use};
use crate::plan::{FramePlan, GeometryKey, Shading, Target};
use crate::scene::TextureSlot;
use crate::shaders::geometry::{self as shader, Flags, constants};

/// Writes its colour targets; their clears and the undefined loads are writes too.
pub const COLOR_WRITE: Use = super::COLOR_WRITE;
/// Adds to the fragment count.
pub const COUNT_BLEND: Use = COLOR_BLEND;
/// Clears, tests and writes depth: early, and late where a mask may discard.
pub const DEPTH_TEST: Use = EARLY_DEPTH_READ.or(LATE_DEPTH_WRITE);

pub const PASS: Pass = Pass {
    name: Endpoint::pass("GEOMETRY"),
    time: "geometry",
    what: "surfaces into the G-buffer, near ones first",
    presence: |plan| match (plan.has_geometry(), plan.is_forward()) {
        (true, false) if plan.triangles.is_some() => {
            Presence::In("which triangle each pixel shows is stored, and looked up when it is lit".into())
        }
        (true, false) => Presence::In("surfaces are drawn before they are lit or shown".into()),
        (true, true) => Presence::Out("surfaces are lit as they are drawn".into()),
        (false, _) => Presence::Out("this view shows no surface".into()),
    },
    touches,
    leave_out: None,
    make: Some(|own| Ok(Box::new(GeometryPass::new(own)?))),
};

fn touches(plan: &FramePlan) -> Vec<ResourceUse> {
    // A location whose target the plan lacks stays empty. LIGHTING leaves out every pixel that is not written here, so only additive targets are
    // cleared. AMBIENT is an exception, as it finds its texels by normal, position and roughness: some drivers (lavapipe) filter several pixels
    // alike, and at a silhouette an unwritten pixel may decide how.
    let finds_texels = if plan.adds_ambient() { ContentsIfFirst::Clear } else { ContentsIfFirst::Undefined };
    let locations = [
        (0, Target::Albedo, ContentsIfFirst::Undefined, COLOR_WRITE),
        (1, Target::Normal, finds_texels, COLOR_WRITE),
        (2, Target::Material, finds_texels, COLOR_WRITE),
        (4, Target::Specular, ContentsIfFirst::Undefined, COLOR_WRITE),
        (5, Target::Position, finds_texels, COLOR_WRITE),
        (0, Target::Count, ContentsIfFirst::Clear, COUNT_BLEND),
        (0, Target::Triangle, ContentsIfFirst::Undefined, COLOR_WRITE),
    ];
    let drawn = locations.into_iter().filter(|&(_, target, ..)| plan.format_of(target).is_some());
    let mut touches = vec![
        ResourceUse::depth(ContentsIfFirst::Clear, DEPTH_TEST).because("clears depth, tests against it and writes it"),
        frame_data(),
    ];
    touches.extend(drawn.map(|(location, target, first, uses)| {
        ResourceUse::color(location, target, first, uses).because(if plan.gbuffer.is_some() {
            "writes the G-buffer"
        } else {
            "writes what the view shows"
        })
    }));
    if plan.emissive {
        touches.push(
            ResourceUse::color(3, plan.light_target(), ContentsIfFirst::Clear, COLOR_WRITE)
                .because("writes emitted light"),
        );
    }
    touches.extend(meshes(plan));
    touches.extend(culled(plan));
    touches
}

/// The pass: a pipeline for each [`GeometryKey`] of the plan.
pub struct GeometryPass {
    surfaces: SurfacePipelines,
}

impl GeometryPass {
    fn new(own: &Making) -> gpu::Result<Self> {
        let &Making { device, plan, scene, .. } = own;
        let frame_layout = own.layouts.frame;
        let slot = own.slot()?;
        let mut surfaces = SurfacePipelines::new(
            device,
            plan,
            ("geometry", &plan.geometry),
            SetLayouts { frame: frame_layout, shadows: None },
            scene,
        )?;
        for &key in &plan.geometry {
            let pipeline = pipeline(device, plan, slot, key, surfaces.layout(key))?;
            surfaces.insert(key, pipeline);
        }
        Ok(Self { surfaces })
    }
}

impl PassRecorder for GeometryPass {
    /// Draws visible objects. Runs inside its subpass.
    fn record(&self, context: &FrameContext) {
        self.surfaces.record_opaque(context);
    }
}

fn pipeline(
    device: &Arc<Device>,
    plan: &FramePlan,
    slot: &Slot,
    key: GeometryKey,
    layout: vk::PipelineLayout,
) -> gpu::Result<Owned<vk::Pipeline>> {
    let flags = flags(plan, key);
    let variant = needed("geometry", shader::variant, flags)?;
    let surface = SurfaceDesc {
        name: "geometry",
        variant,
        constants: &constants_of(plan, key),
        depth: opaque_depth(plan, key),
        blend: &blend(plan),
    };
    surface_pipeline(device, plan, slot, (key, layout), &surface)
}

/// Returns the shader variant of one of the plan's pipelines.
pub fn flags(plan: &FramePlan, key: GeometryKey) -> Flags {
    if plan.triangles.is_some() {
        // Nothing of a surface but its holes.
        return Flags::TEXTURED.when(key.discards && key.textures.contains(TextureSlot::BaseColor))
            | Flags::EXTRAS.when(key.discards && key.extras.any())
            | Flags::OVERDRAW
            | Flags::TRIANGLE
            | Flags::PACKED;
    }
    Flags::TEXTURED.when(!key.textures.is_empty())
        | Flags::NORMAL_MAP.when(key.textures.contains(TextureSlot::Normal))
        | Flags::EXTRAS.when(key.extras.any())
        | gbuffer_flags!(plan)
        | Flags::EMISSIVE.when(plan.emissive)
        | Flags::OVERDRAW.when(plan.shading.only_covers())
        | Flags::TRIANGLE.when(plan.shading == Shading::ShowTriangle)
}

fn constants_of(plan: &FramePlan, key: GeometryKey) -> Vec<(u32, u32)> {
    let gbuffer = plan.gbuffer.as_ref();
    let half_position = gbuffer.is_some_and(|gbuffer| gbuffer.position == Some(vk::Format::R16G16B16A16_SFLOAT));
    let farthest: f32 = if half_position { 65000.0 } else { f32::MAX };
    vec![
        (constants::TEXTURES, key.textures.bits()),
        (constants::FOOTPRINT, plan.footprint.to_bits()),
        (constants::PLACES, plan.places_of_shaders()),
        (constants::COLORED, u32::from(key.extras.colors)),
        (constants::COLORED_LIGHT, u32::from(key.extras.colored_light)),
        (constants::LOOKS, u32::from(key.extras.looks)),
        (constants::STROKES, u32::from(key.extras.strokes)),
        (constants::MASKED, u32::from(key.discards)),
        (constants::TWO_SIDED, u32::from(key.two_sided)),
        (constants::RECEIVES, u32::from(key.receives)),
        (constants::PHONG, u32::from(key.phong)),
        (constants::REFLECTANCE, u32::from(key.reflectance)),
        (constants::LARGEST, plan.largest_light().to_bits()),
        (constants::FARTHEST, farthest.to_bits()),
        (constants::NORMAL_ENCODING, gbuffer.map_or(0, |gbuffer| gbuffer.normal_encoding as u32)),
        (constants::GEOMETRIC_STEPS, gbuffer.map_or(0.0, |gbuffer| gbuffer.geometric_steps()).to_bits()),
        (constants::NORMALS_DIFFER, u32::from(gbuffer.is_some_and(|gbuffer| gbuffer.normals_differ))),
    ]
}

/// One state for each colour location of the subpass.
fn blend(plan: &FramePlan) -> Vec<vk::PipelineColorBlendAttachmentState> {
    match plan.shading {
        Shading::ShowOverdraw => vec![add()],
        _ => vec![replace(); plan.geometry_locations() as usize],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu_scene::{
        COLOR, LOOK, NORMAL, NUMBER, OTHER_COLOR, OTHER_END, OTHER_UV, POSITION, ROWS, SECOND_UV, TANGENT, UV,
    };
    use crate::plan::samples;

    #[test]
    fn there_is_one_blend_state_for_each_colour_location() {
        for (name, plan) in samples::plans().iter().filter(|(_, plan)| plan.has_geometry()) {
            assert_eq!(blend(plan).len(), plan.geometry_locations() as usize, "{name}");
            assert!(!blend(plan).is_empty(), "{name}");
        }
    }

    #[test]
    fn every_pipeline_has_a_shader_that_reads_only_streams_of_the_plan() {
        for (name, plan) in samples::plans() {
            let streams = plan.streams;
            for &key in &plan.geometry {
                let flags = flags(&plan, key);
                let variant = shader::variant(flags).unwrap_or_else(|| panic!("{name}: no variant {flags:?}"));
                for input in variant.vertex().expect("a vertex stage").vertex_inputs {
                    let present = match input.location {
                        POSITION | OTHER_END | OTHER_COLOR | ROWS..=NUMBER => true,
                        LOOK => plan.has_looks() || !key.extras.looks,
                        NORMAL => streams.normals,
                        UV | OTHER_UV => streams.uvs,
                        TANGENT => streams.tangents,
                        COLOR => streams.colors || !key.extras.colors,
                        SECOND_UV => streams.second_uvs || !key.extras.second_uvs,
                        other => panic!("{name}: no stream for location {other}"),
                    };
                    assert!(present, "{name} {key:?}: {} is not in {streams:?}", input.name);
                }
            }
        }
    }
}
