//! Attachments and the buffers that stand in for them.

use ash::vk;

use super::{Part, PartGroup, part, why};
use crate::plan::{
    FramePlan, Gbuffer, NormalEncoding, OitTargets, OwnTarget, PlannedBrdf, Shading, Target, ToneMapping, format_bytes,
};
use crate::scene::{Brdf, HdrFormat, OptionalPart, Settings, TextureSlot, View, counted};

fn with_format(name: &str, format: Option<vk::Format>) -> String {
    format.map_or_else(|| name.to_owned(), |format| format!("{name} ({format:?})"))
}

pub(super) fn output(plan: &FramePlan) -> Part {
    part(&format!("output ({:?})", plan.output), true, "the picture", bytes_of_target(plan, Target::Output))
}

fn attachment(plan: &FramePlan, name: &str, target: Target, reason: String) -> Part {
    let format = plan.format_of(target);
    part(&with_format(name, format), format.is_some(), reason, bytes_of_target(plan, target))
}

/// A target of an effect.
pub(in crate::plan) fn line_of_target(plan: &FramePlan, effect: &str, own: &OwnTarget, why: &str) -> Part {
    let reason = if plan.format_of(own.target).is_some() { why } else { plan.reasons.lack_of(effect) };
    attachment(plan, own.line.unwrap_or(own.noun), own.target, reason.into()).of(PartGroup::Targets)
}

/// `read_depth`: the targets of effects that read depth and the G-buffer.
pub(super) fn gbuffer(plan: &FramePlan, read_depth: Vec<Part>) -> Vec<Part> {
    let attachment = |name, target, reason| attachment(plan, name, target, reason);
    let rebuilt = plan.gbuffer.is_some_and(|gbuffer| gbuffer.position.is_none());
    let hides = match (plan.has_geometry(), rebuilt) {
        (false, _) => "nothing is drawn that could hide anything",
        (true, true) => "hides what lies behind; position is rebuilt from it",
        (true, false) => "hides what lies behind",
    };
    let mut parts = vec![
        output(plan),
        attachment("depth", Target::Depth, hides.into()),
        attachment("depth of the largest objects", Target::Occluders, plan.reasons.hiding.clone()),
    ];
    parts.extend(read_depth);
    let Some(gbuffer) = &plan.gbuffer else {
        if plan.shading == Shading::ShowOverdraw {
            parts.push(attachment("fragment count", Target::Count, "the view shows it".into()));
        }
        if plan.shading == Shading::ShowTriangle {
            parts.push(attachment("triangle", Target::Triangle, "the view shows it".into()));
        }
        if let Some(code) = plan.triangles {
            let why = match code.bits {
                0 => "instance: each mesh is one triangle".into(),
                bits => format!("low {}: triangle in its mesh; above: instance", counted(bits as usize, "bit")),
            };
            parts.push(attachment("triangle", Target::Triangle, why));
        }
        let reason = match plan.triangles {
            Some(_) => "surfaces are looked up by their triangles",
            None if plan.is_forward() => "surfaces are lit as they are drawn",
            None => "this view reads none",
        };
        parts.push(part("G-buffer", false, reason, 0));
        return parts;
    };
    parts.push(attachment("albedo", Target::Albedo, "every light needs it; alpha is ambient occlusion".into()));
    parts.push(attachment("normal", Target::Normal, normal(gbuffer.normal_encoding).into()));
    parts.push(attachment("material", Target::Material, material(plan, gbuffer)).is(OptionalPart::MaterialTarget));
    parts.extend(channels(plan, gbuffer));
    parts.push(attachment("specular", Target::Specular, specular(plan, gbuffer)).is(OptionalPart::SpecularTarget));
    let position = why(gbuffer.position.is_some(), "asked for", "rebuilt from depth");
    parts.push(attachment("position", Target::Position, position));
    parts
}

fn normal(encoding: NormalEncoding) -> &'static str {
    match encoding {
        NormalEncoding::Octahedral | NormalEncoding::Octahedral8 => "shading normal, octahedral",
        NormalEncoding::HalfEncoded => "shading normal, from -1..1 to 0..1",
        NormalEncoding::Signed => "shading normal, as it is",
    }
}

fn material(plan: &FramePlan, gbuffer: &Gbuffer) -> String {
    let rough = plan.brdf != PlannedBrdf::One(Brdf::Lambert) || plan.shading == Shading::ShowGbuffer(View::Roughness);
    let reason = match gbuffer.material {
        None => "all opaque materials are lambert, and no shadow needs the geometric normal",
        Some(_) if rough => "roughness; the channels below if they are in",
        Some(_) => "the channels below if they are in",
    };
    reason.into()
}

fn specular(plan: &FramePlan, gbuffer: &Gbuffer) -> String {
    match (gbuffer.specular, plan.brdf) {
        (None, _) => "all opaque materials have one BRDF, without Phong's terms or a reflectance of their own".into(),
        (Some(_), PlannedBrdf::PerPixel) => "opaque materials differ in their BRDF".into(),
        (Some(_), PlannedBrdf::One(brdf)) if !plan.reflectance => format!("all opaque materials are {brdf}"),
        (Some(_), _) => "an opaque material has a reflectance of its own".into(),
    }
}

/// The channels of the material target that not every scene needs; their bytes are the target's.
fn channels(plan: &FramePlan, gbuffer: &Gbuffer) -> [Part; 2] {
    let (metallic, geometric) = (gbuffer.metallic, gbuffer.geometric_normal);
    let metal = match metallic {
        true if plan.shading == Shading::ShowGbuffer(View::Metallic) => "the view shows it",
        true => "a material is a metal",
        false => "no opaque material is a metal",
    };
    let bent = plan.keys().any(|key| key.textures.contains(TextureSlot::Normal));
    let normal = match (geometric, bent, plan.keys().any(|key| !key.receives)) {
        (true, true, false) => "shadow offsets need the unbent normal",
        (true, false, true) => "one code marks surfaces that receive no shadow",
        (true, ..) => "shadow offsets need the unbent normal; one code marks surfaces that receive no shadow",
        (false, ..) if plan.shadow.is_none() => "no shadow maps",
        (false, ..) => "no normal map bends the shading normal, and all surfaces receive shadows",
    };
    [
        part("metallic channel", metallic, metal, 0).is(OptionalPart::MetallicChannel),
        part("geometric normal channels", geometric, normal, 0).is(OptionalPart::GeometricNormalChannels),
    ]
}

pub(super) fn stored(plan: &FramePlan) -> Part {
    let reason = match plan.effects.present().find_map(|effect| effect.stores_gbuffer) {
        Some(why) => why,
        None if plan.gbuffer.is_none() => "there is no G-buffer",
        None if plan.is_tiled() => "its render pass ends with it, and TILED reads it: no other pass comes between",
        None if !plan.shading.is_lit() => {
            "no pass reads neighbours between GEOMETRY and VIEW, so the G-buffer can stay in the tile"
        }
        None => "no pass reads neighbours between GEOMETRY and LIGHTING, so the G-buffer can stay in the tile",
    };
    part("stored G-buffer", plan.stores_gbuffer, reason, 0).is(OptionalPart::StoredGbuffer)
}

pub(super) fn hdr(settings: &Settings, plan: &FramePlan) -> Part {
    let [blended, read] = plan.effects.hdr(plan.light_path);
    let reason = match plan.tone_mapping {
        ToneMapping::Subpass(_) if plan.adds_lights() => {
            "lights are added one by one before tone mapping, in 32-bit floats, as half floats would lose light"
        }
        ToneMapping::Subpass(_) if plan.emissive => "emissive light is blended before tone mapping",
        ToneMapping::Subpass(_) if blended.is_some() => blended.unwrap_or_default(),
        ToneMapping::Subpass(_) if plan.transparency.is_some() => {
            plan.blended_alone().map_or("transparent surfaces are blended before tone mapping", |own| own.hdr)
        }
        _ if read.is_some() => read.unwrap_or_default(),
        ToneMapping::Subpass(_) => "samples of a pixel are averaged as light before tone mapping",
        ToneMapping::InLighting(_) if plan.is_forward() => "nothing blends over it: FORWARD tone-maps into the output",
        ToneMapping::InLighting(_) if plan.is_tiled() => "compute tone-maps what it lit straight into the output",
        ToneMapping::InLighting(_) => "nothing blends over the lighting: it tone-maps straight into the output",
        ToneMapping::Kept => "light is kept as the tone-mapped frame keeps it, and written without a curve",
        ToneMapping::AfterFrames(_) => "frames are averaged before they are tone-mapped, on the CPU",
        ToneMapping::Absent if matches!(plan.shading, Shading::Light { .. }) => "the output itself is linear",
        ToneMapping::Absent => "a view is not tone-mapped",
    };
    let asked = settings.hdr_format;
    let reason = match plan.hdr {
        None if asked != HdrFormat::default() => format!("{reason}; --hdr-format {asked} has no effect"),
        _ => reason.to_owned(),
    };
    let name = if plan.is_tiled() { "target of emitted light" } else { "HDR target" };
    part(&with_format(name, plan.hdr), plan.hdr.is_some(), reason, bytes_of_target(plan, Target::Hdr))
        .is(OptionalPart::HdrTarget)
}

pub(super) fn sums(plan: &FramePlan) -> Part {
    let reason = match plan.sums {
        Some(OitTargets { accumulation, weights }) => {
            format!("in {accumulation:?} and {weights:?}: weighted light, the share that is left, and the weights")
        }
        None => plan.lack_of_sums().into(),
    };
    part(
        "sums of transparent surfaces",
        plan.sums.is_some(),
        reason,
        bytes_of_target(plan, Target::Accumulation) + bytes_of_target(plan, Target::Weights),
    )
}

pub(super) fn samples_of_output(plan: &FramePlan) -> Part {
    let resolved = match (plan.resolves_output(), plan.msaa) {
        (true, _) => "the render pass resolves the output's samples",
        (false, 1) => "one sample a pixel",
        (false, _) if plan.is_tiled() => "TILED resolves",
        (false, _) if plan.hdr.is_some() => "TONEMAP resolves",
        (false, _) => "the view shows all samples at once",
    };
    part("samples of the output", plan.resolves_output(), resolved, bytes_of_target(plan, Target::Samples))
}

/// Returns the bytes of a target for the whole picture; 0 if the plan lacks it.
pub(in crate::plan) fn bytes_of_target(plan: &FramePlan, target: Target) -> u64 {
    let [width, height] = plan.extent_of(target).map(u64::from);
    let texel = plan.format_of(target).map_or(0, format_bytes) * plan.samples_of(target);
    u64::from(texel) * width * height
}
