//! Textures, and factors of materials in their place.

use std::collections::BTreeSet;

use super::{Part, part};
use crate::plan::{FramePlan, PlannedTexture, TextureSource, anisotropy};
use crate::scene::{BlockFormat, OptionalPart, Scene, Settings, SlotForm, TextureSlot, counted};

pub(super) fn textures(scene: &Scene, settings: &Settings, plan: &FramePlan) -> Vec<Part> {
    let planned = &plan.textures;
    let mut parts = Vec::new();
    // A texture counts in the first slot that it is in.
    let mut counted = BTreeSet::new();
    for slot in TextureSlot::ALL {
        let SlotForm { name, part: optional, .. } = *slot.form();
        let holes = planned.holes.values().filter(|_| slot == TextureSlot::BaseColor);
        let images = planned.sets.values().filter_map(|slots| slots.get(&slot)).chain(holes);
        let images: BTreeSet<usize> = images.copied().collect();
        let own =
            images.iter().filter(|&&image| matches!(planned.images[image].source, TextureSource::Scene(_))).count();
        let used = match own {
            0 => "no drawn material uses one".to_owned(),
            _ => format!("{own}, used by drawn materials"),
        };
        let reason = match !images.is_empty() && plan.keep.has(optional) {
            true => format!("{used}; kept for all, with a neutral texel where one has none"),
            false => used,
        };
        let bytes = images.iter().filter(|&&image| counted.insert(image)).map(|&image| planned.images[image].bytes());
        let bytes = bytes.sum();
        parts.push(part(name, !images.is_empty(), reason, bytes).is(optional));
    }
    let sampled = planned.sampled();
    let unused: Vec<usize> = (0..planned.images.len()).filter(|image| !sampled.contains(image)).collect();
    // An atlas may be one texture in several layouts, and a neutral texel is none of the scene's.
    let of_scene = sampled.iter().map(|&image| planned.images[image].source);
    let of_scene: BTreeSet<_> = of_scene.filter(|source| matches!(source, TextureSource::Scene(_))).collect();
    let why_unused = match scene.textures.len() {
        0 => "the scene has no textures".into(),
        all => format!("{} of the scene's {all} are sampled", of_scene.len()),
    };
    let unused_bytes = unused.iter().map(|&image| planned.images[image].bytes()).sum();
    parts.push(part("unused textures", !unused.is_empty(), why_unused, unused_bytes).is(OptionalPart::UnusedTextures));
    parts.push(decoded(plan));
    parts.extend(masks(scene, plan));
    parts.push(anisotropy::part(settings, plan));
    parts
}

/// Returns the part about textures of compressed files: the number decoded to texels, and the bytes saved by textures that stay compressed.
fn decoded(plan: &FramePlan) -> Part {
    let images = || plan.textures.images.iter().filter(|image| image.compressed.is_some());
    let count = |is: &dyn Fn(&PlannedTexture) -> bool| images().filter(|image| is(image)).count();
    let formats = BlockFormat::ALL.map(|format| (count(&|image| image.blocks == Some(format)), format));
    let formats = formats.iter().filter(|(count, _)| *count > 0);
    let formats = formats.map(|(count, format)| format!("{count} in {format}")).collect::<Vec<_>>().join(", ");
    let saved: u64 = images().map(PlannedTexture::saved_bytes).sum();
    let stay = count(&|image| image.blocks.is_some());
    let lacking = count(&|image| image.makes_levels);
    let foreign = count(&|image| image.blocks.is_none() && !image.makes_levels);
    let says = [
        (stay, format!("{stay} stay compressed ({formats}), {saved} bytes less than decoded")),
        (lacking, format!("{lacking} decoded: their files lack smaller levels, which are made")),
        (foreign, format!("{foreign} decoded: the device does not sample their blocks")),
    ];
    let says: Vec<String> = says.into_iter().filter(|(count, _)| *count > 0).map(|(_, says)| says).collect();
    let reason = if says.is_empty() { "no texture is compressed in its file".into() } else { says.join("; ") };
    // The bytes are counted with the textures of each slot.
    part("decoded textures", lacking + foreign > 0, reason, 0).is(OptionalPart::DecodedTextures)
}

/// Returns the parts about textures for which factors of materials do as well.
fn masks(scene: &Scene, plan: &FramePlan) -> [Part; 3] {
    let materials = &plan.materials;
    let constant = materials.constant.len();
    let keeps = |part, count: usize| plan.keep.has(part) && count > 0;
    let why_constant = match constant {
        0 if scene.materials.iter().all(|material| material.textures().next().is_none()) => {
            "no material has a texture".into()
        }
        0 => "every texture of a material differs from texel to texel".into(),
        _ => format!("{} of one colour, which their materials' factors can hold", counted(constant, "texture")),
    };
    let idle = materials.opened + materials.emptied;
    let masked = plan.keys().any(|key| key.discards) || !plan.textures.holes.is_empty();
    let needs = plan.keys().any(|key| key.masked) || !plan.textures.holes.is_empty();
    let why_masked = match (masked, needs) {
        (true, true) => "a material is masked by its texture",
        (true, false) => "kept: every alpha passes",
        (false, _) if idle > 0 => "no mask cuts a part of a surface",
        (false, _) => "no drawn material is masked",
    };
    let why_idle = match idle {
        0 if !needs => "no drawn material is masked".into(),
        0 => "every mask cuts something and leaves something".into(),
        _ => format!("masks that cut nothing: {}; that leave nothing: {}", materials.opened, materials.emptied),
    };
    // The bytes are counted with the textures of each slot.
    [
        part("constant textures", keeps(OptionalPart::ConstantTextures, constant), why_constant, 0)
            .is(OptionalPart::ConstantTextures),
        part("alpha masks", masked, why_masked, 0).is(OptionalPart::AlphaMasks),
        part("idle masks", keeps(OptionalPart::OpaqueMasks, idle), why_idle, 0).is(OptionalPart::OpaqueMasks),
    ]
}
