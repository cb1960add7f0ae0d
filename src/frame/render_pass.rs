//! The render passes of a plan: attachments, subpasses, and the rows of [`super::edges`] as dependencies.

use std::sync::Arc;

use ash::vk;

use super::edges::{self, Carrier, Edge, Place};
use crate::gpu::sync::Use;
use crate::gpu::{self, Device, RenderPass, SubpassDesc};
use crate::passes::{fxaa, shadow};
use crate::plan::{FramePlan, Shading};
use crate::scene::Transparency;
use crate::targets::{COMPOSITE_INPUTS, Target, attachments, gbuffer_inputs, light_target, samples_of};

/// Resolves samples into the output after the subpass that is the last to write them: reads them, and as their last user drops them.
pub const RESOLVE: Use = Use::new(
    vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT,
    vk::AccessFlags::from_raw(
        vk::AccessFlags::COLOR_ATTACHMENT_WRITE.as_raw() | vk::AccessFlags::COLOR_ATTACHMENT_READ.as_raw(),
    ),
);

/// Indices of the main pass's subpasses; which exist depends on the plan.
#[derive(Debug, Clone, Copy)]
pub struct Subpasses {
    pub geometry: Option<u32>,
    /// Or FORWARD, in a frame without a G-buffer.
    pub lighting: u32,
    pub transparent: Option<u32>,
    pub composite: Option<u32>,
    pub tonemap: Option<u32>,
}

impl Subpasses {
    /// Of a tiled plan only GEOMETRY is a subpass.
    pub fn of(plan: &FramePlan) -> Self {
        let geometry = (plan.has_geometry() && !plan.is_forward()).then_some(0);
        let lighting = u32::from(geometry.is_some());
        let mut last = lighting;
        let mut next = |present: bool| {
            last += u32::from(present);
            present.then_some(last)
        };
        let transparent = next(plan.transparency.is_some());
        let composite = next(plan.transparency == Some(Transparency::Oit));
        Self { geometry, lighting, transparent, composite, tonemap: next(plan.has_tonemap_subpass()) }
    }

    fn index(&self, place: Place) -> u32 {
        match place {
            Place::Geometry => self.geometry.unwrap_or(0),
            Place::Lighting | Place::Forward => self.lighting,
            Place::Transparent => self.transparent.unwrap_or(self.lighting),
            Place::Composite => self.composite.unwrap_or(self.lighting),
            Place::Tonemap => self.tonemap.unwrap_or(self.lighting),
            // The passes of these have one subpass.
            Place::Shadow | Place::Fxaa => 0,
            Place::Outside | Place::Tiled | Place::Copy | Place::Host => vk::SUBPASS_EXTERNAL,
        }
    }
}

/// The one pass with subpasses GEOMETRY, LIGHTING (or VIEW), TRANSPARENT, COMPOSITE and TONEMAP, as far as the plan has them.
///
/// # Errors
/// When the device cannot make it.
pub fn main(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<RenderPass> {
    let descriptions: Vec<_> = attachments(plan)
        .iter()
        .map(|attachment| {
            vk::AttachmentDescription::default()
                .format(attachment.format)
                .samples(samples_of(plan, attachment.target))
                .load_op(attachment.load)
                .store_op(attachment.store)
                .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
                .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                // Nothing is kept from frame to frame.
                .initial_layout(vk::ImageLayout::UNDEFINED)
                .final_layout(attachment.final_layout)
        })
        .collect();
    let refs = References::of(plan);
    // Nothing, but after the subpass that is the last to write the samples.
    let resolve = |place| if edges::resolving(plan) == Some(place) { &refs.resolve[..] } else { &[] };
    let mut subpasses = Vec::new();
    if plan.is_forward() {
        let depth = refs.reference(Target::Depth, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
        subpasses.push(SubpassDesc {
            color: &refs.lighting_color,
            resolve: resolve(Place::Forward),
            depth: Some(depth),
            ..SubpassDesc::default()
        });
    } else if plan.has_geometry() {
        subpasses.push(SubpassDesc {
            color: &refs.geometry_color,
            depth: Some(refs.reference(Target::Depth, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)),
            ..SubpassDesc::default()
        });
    }
    if !plan.is_tiled() && !plan.is_forward() {
        subpasses.push(SubpassDesc {
            input: &refs.lighting_input,
            color: &refs.lighting_color,
            resolve: resolve(Place::Lighting),
            // Tested and read as an input at once, written by neither.
            depth: plan
                .lighting_tests_depth()
                .then(|| refs.reference(Target::Depth, vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL)),
            ..SubpassDesc::default()
        });
    }
    if plan.transparency.is_some() {
        subpasses.push(SubpassDesc {
            color: &refs.transparent_color,
            resolve: resolve(Place::Transparent),
            // Tested, not written.
            depth: Some(refs.reference(Target::Depth, vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL)),
            preserve: &refs.transparent_preserve,
            ..SubpassDesc::default()
        });
    }
    if plan.transparency == Some(Transparency::Oit) {
        subpasses.push(SubpassDesc {
            input: &refs.composite_input,
            color: &refs.lighting_color,
            resolve: resolve(Place::Composite),
            ..SubpassDesc::default()
        });
    }
    if plan.has_tonemap_subpass() {
        subpasses.push(SubpassDesc {
            input: &refs.tonemap_input,
            color: &refs.tonemap_color,
            ..SubpassDesc::default()
        });
    }
    let dependencies = dependencies(plan, Carrier::MainPass);
    RenderPass::new(device, "main pass", &descriptions, &subpasses, &dependencies)
}

/// The shadow maps' pass: one subpass, depth only.
///
/// # Errors
/// When the device cannot make it.
pub fn shadow(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<RenderPass> {
    let depth = vk::AttachmentReference { attachment: 0, layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL };
    let subpass = SubpassDesc { depth: Some(depth), ..SubpassDesc::default() };
    let dependencies = dependencies(plan, Carrier::ShadowPass);
    RenderPass::new(device, "shadow pass", &[shadow::attachment()], &[subpass], &dependencies)
}

/// FXAA's pass: one subpass that writes the picture.
///
/// # Errors
/// When the device cannot make it.
pub fn fxaa(device: &Arc<Device>, plan: &FramePlan) -> gpu::Result<RenderPass> {
    let color = [vk::AttachmentReference { attachment: 0, layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL }];
    let subpass = SubpassDesc { color: &color, ..SubpassDesc::default() };
    let dependencies = dependencies(plan, Carrier::FxaaPass);
    RenderPass::new(device, "FXAA pass", &[fxaa::attachment(plan)], &[subpass], &dependencies)
}

fn dependencies(plan: &FramePlan, carrier: Carrier) -> Vec<vk::SubpassDependency> {
    let subpasses = Subpasses::of(plan);
    let index = |place| match (carrier, place) {
        // Seen from the main pass, FXAA is outside.
        (Carrier::MainPass, Place::Fxaa) => vk::SUBPASS_EXTERNAL,
        // The shadow pass has one subpass, and all else is outside.
        (Carrier::ShadowPass, place) if place != Place::Shadow => vk::SUBPASS_EXTERNAL,
        _ => subpasses.index(place),
    };
    let dependency = |edge: Edge| vk::SubpassDependency {
        src_subpass: index(edge.from),
        dst_subpass: index(edge.to),
        src_stage_mask: edge.before.stage,
        dst_stage_mask: edge.after.stage,
        src_access_mask: edge.before.access,
        dst_access_mask: edge.after.access,
        dependency_flags: if edge.by_region { vk::DependencyFlags::BY_REGION } else { vk::DependencyFlags::empty() },
    };
    edges::table(plan).into_iter().filter(|edge| edge.carrier == carrier).map(dependency).collect()
}

/// Attachment references of each subpass.
struct References {
    order: Vec<Target>,
    geometry_color: Vec<vk::AttachmentReference>,
    lighting_input: Vec<vk::AttachmentReference>,
    /// COMPOSITE's too.
    lighting_color: Vec<vk::AttachmentReference>,
    transparent_color: Vec<vk::AttachmentReference>,
    transparent_preserve: Vec<u32>,
    composite_input: Vec<vk::AttachmentReference>,
    resolve: Vec<vk::AttachmentReference>,
    tonemap_input: Vec<vk::AttachmentReference>,
    tonemap_color: Vec<vk::AttachmentReference>,
}

impl References {
    fn of(plan: &FramePlan) -> Self {
        let order = attachments(plan).iter().map(|attachment| attachment.target).collect();
        let mut refs = Self {
            order,
            geometry_color: Vec::new(),
            lighting_input: Vec::new(),
            lighting_color: Vec::new(),
            transparent_color: Vec::new(),
            transparent_preserve: Vec::new(),
            composite_input: Vec::new(),
            resolve: Vec::new(),
            tonemap_input: Vec::new(),
            tonemap_color: Vec::new(),
        };
        let color = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
        let read = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        refs.geometry_color = geometry_targets(plan)
            .into_iter()
            .map(|target| match target {
                Some(target) => refs.reference(target, color),
                None => {
                    vk::AttachmentReference { attachment: vk::ATTACHMENT_UNUSED, layout: vk::ImageLayout::UNDEFINED }
                }
            })
            .collect();
        refs.lighting_input =
            gbuffer_inputs(plan).into_iter().map(|(_, target)| refs.reference(target, input_layout(target))).collect();
        refs.lighting_color = vec![refs.reference(light_target(plan), color)];
        if plan.resolves_output() {
            refs.resolve = vec![refs.reference(Target::Output, color)];
        }
        match plan.transparency {
            Some(Transparency::Sorted) => refs.transparent_color = refs.lighting_color.clone(),
            Some(Transparency::Oit) => {
                refs.transparent_color = COMPOSITE_INPUTS.map(|(_, target)| refs.reference(target, color)).to_vec();
                refs.composite_input = COMPOSITE_INPUTS.map(|(_, target)| refs.reference(target, read)).to_vec();
                // LIGHTING has written it, COMPOSITE blends over it.
                refs.transparent_preserve = refs.lighting_color.iter().map(|light| light.attachment).collect();
            }
            None => {}
        }
        if plan.has_tonemap_subpass() {
            refs.tonemap_input = vec![refs.reference(Target::Hdr, read)];
            refs.tonemap_color = vec![refs.reference(Target::Output, color)];
        }
        refs
    }

    fn reference(&self, target: Target, layout: vk::ImageLayout) -> vk::AttachmentReference {
        let position = self.order.iter().position(|&own| own == target);
        let attachment = position.map_or(vk::ATTACHMENT_UNUSED, |index| index as u32);
        vk::AttachmentReference { attachment, layout }
    }
}

/// The layout in which a subpass reads a target as an input.
pub fn input_layout(target: Target) -> vk::ImageLayout {
    match target {
        Target::Depth => vk::ImageLayout::DEPTH_STENCIL_READ_ONLY_OPTIMAL,
        _ => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
    }
}

/// GEOMETRY's targets by location (`shaders/geometry.wgsl`); a gap where the plan lacks one.
fn geometry_targets(plan: &FramePlan) -> Vec<Option<Target>> {
    if plan.shading == Shading::ShowOverdraw {
        return vec![Some(Target::Count)];
    }
    let Some(gbuffer) = &plan.gbuffer else { return Vec::new() };
    let all = [
        Some(Target::Albedo),
        Some(Target::Normal),
        gbuffer.material.map(|_| Target::Material),
        plan.emissive.then(|| light_target(plan)),
        gbuffer.specular.map(|_| Target::Specular),
        gbuffer.position.map(|_| Target::Position),
    ];
    all[..plan.geometry_locations() as usize].to_vec()
}

#[cfg(test)]
mod tests;
