//! Blind spots of layers before [`LAYER`], beside those of [`LAYER`] itself. They were found with 1.3.239; layers between the two may have fewer.

use super::Mutant;
use crate::frame::edges::unreported_mutants::{LAYER, Part};
use crate::frame::edges::{Carrier, Place, Side};
use crate::gpu::vk::AccessFlags;
use crate::scene::Transparency;

/// Mutants that an older layer does not notice, for one reason.
#[derive(Debug)]
pub struct OlderLayers {
    /// The first layer that notices them, packed as Vulkan packs it.
    pub seen_from: u32,
    is_about: fn(&Mutant) -> bool,
    /// Why the older ones stay silent, in a sentence.
    pub why: &'static str,
}

/// The first reason for which a layer of this version misses a mutant.
pub fn reason(layer: u32, mutant: &Mutant) -> Option<&'static OlderLayers> {
    OLDER_LAYERS.iter().find(|entry| layer < entry.seen_from && (entry.is_about)(mutant))
}

/// The list.
pub static OLDER_LAYERS: &[OlderLayers] = &[
    OlderLayers {
        seen_from: LAYER,
        is_about: |mutant| {
            let is_read_by_tonemap = ["spread-to-readers", "taa-to-readers"].contains(&mutant.edge.label);
            matches!(mutant.edge.carrier, Carrier::BufferBarrier | Carrier::MemoryBarrier) && !is_read_by_tonemap
        },
        why: "the layer notices hardly a hazard on a buffer: neither between compute shaders, nor on what draws fetch, nor after a copy in another submission",
    },
    OlderLayers {
        seen_from: LAYER,
        is_about: |mutant| matches!(mutant.part, Part::Bits(..)) && mutant.edge.is_between_subpasses(),
        why: "the layer does not look at the masks of a dependency between two subpasses: it takes each for one of all stages and accesses",
    },
    OlderLayers {
        seen_from: LAYER,
        is_about: |mutant| mutant.edge.label == "bloom-to-tonemap",
        why: "the layer lets the barrier from SPREAD to TONEMAP order the light that BLOOM has read as well. By then nothing says that the light is visible to TONEMAP",
    },
    OlderLayers {
        seen_from: LAYER,
        is_about: is_in_another_submission,
        why: "the layer looks at each submission by itself. What the frame before has done, uploads, and the copy to the CPU are in submissions of their own",
    },
    OlderLayers {
        seen_from: LAYER,
        is_about: |mutant| {
            let Part::Bits(Side::After, bits) = mutant.part else { return false };
            match mutant.edge.label {
                "tonemap-reuse" => bits.access == AccessFlags::COLOR_ATTACHMENT_READ,
                "ao-denoise-to-lighting" => bits.access == AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ,
                _ => false,
            }
        },
        why: "the layer does not notice that a load operation reads after a layout change that is not visible to it, where the same dependency makes the change \
              visible to other accesses",
    },
];

/// Returns true if the part orders work of another submission, before or after those that the layer looks at.
fn is_in_another_submission(mutant: &Mutant) -> bool {
    let edge = &mutant.edge;
    let (begins_outside, ends_outside) = (edge.from == Place::OUTSIDE, edge.to == Place::OUTSIDE);
    let is_prepared = [Place::UPLOAD, Place::CLEAR, Place::PREFILTER].contains(&edge.from) && edge.to != Place::UPLOAD;
    match (mutant.part, edge.label) {
        // After AO or REFLECT_RESOLVE the layer sees that layouts change without a dependency.
        (Part::Row, "transparent-reuse") => !mutant.plan.has_ao() && !mutant.plan.reflects(),
        (Part::Row, "velocity-reuse") => !mutant.plan.reflects(),
        (Part::Row, _) if begins_outside || ends_outside => edge.carrier.is_render_pass(),
        // FOG's row orders the rest for the layer (`unreported_mutants`); the sums of the frame before are left.
        (Part::Row, "reflect-resolve-to-transparent") => {
            mutant.plan.has_fog() && mutant.plan.transparency == Some(Transparency::Sorted)
        }
        (Part::Bits(Side::Before, _), "reflect-resolve-to-transparent") => mutant.plan.has_fog(),
        (Part::Bits(Side::Before, _), _) => begins_outside,
        (Part::Bits(Side::After, _), _) => ends_outside || is_prepared,
        (Part::Row | Part::AcrossSamples, _) => false,
    }
}
