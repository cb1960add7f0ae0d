//! Patches of SPIR-V, to fit a shader to the bindings of its pipeline.

use crate::gpu_scene::{OWN_SAMPLERS, SAMPLER, SetForm};
use crate::plan::GeometryKey;
use crate::shaders::{BindingKind, Variant};

/// The fragment shader of a variant for the sets of a key. The shader declares a texture and a sampler for each slot, and the constants say which are
/// sampled. Vulkan requires a binding in the set for each declared variable, sampled or not, but several variables may share a binding
/// ("DescriptorSet and Binding Assignment" of its specification). So variables of absent textures become aliases of a present texture, and samplers
/// of textures that are sampled alike become aliases of the only sampler.
pub fn bound_fragment(variant: &Variant, key: GeometryKey) -> Vec<u32> {
    let form = SetForm::of(key);
    let Some(fragment) = variant.fragment() else { return Vec::new() };
    let mut spirv = with_cells(fragment.spirv.words(), (key.has_extras(), key.extras.cells));
    let Some(present) = form.textures.slots().next() else { return spirv };
    let has = |slot: u32| form.textures.slots().any(|own| own as u32 == slot);
    for binding in fragment.bindings.iter().filter(|binding| binding.set == MATERIAL_SET) {
        let number = match binding.kind {
            BindingKind::SampledImage if !has(binding.binding) => present as u32,
            BindingKind::Sampler if !form.own_samplers => SAMPLER,
            BindingKind::Sampler if !has(binding.binding - OWN_SAMPLERS) => OWN_SAMPLERS + present as u32,
            _ => continue,
        };
        spirv[binding.word as usize] = number;
    }
    spirv
}

/// Fits a fragment shader to textures that are atlases, or not. Shaders with EXTRAS declare arrays and sample them with a layer. For materials
/// without cells, the patch clears the one word of the type that marks an array. The images are then plain, and the layer is an extra component of
/// the coordinate beyond the required ones, which SPIR-V allows ("OpImageSampleImplicitLod"). So plain materials cost nothing extra, and no further
/// variant is needed. A module must not declare the same type twice ("Universal Validation Rules"). It may have a plain image type already, so the
/// patched type leaves open whether it is a depth image, which Vulkan ignores. Size queries on patched images return two numbers instead of three;
/// shaders use only the first two. The tints of shadow maps stay an array.
pub fn with_cells(words: &[u32], (has_extras, cells): (bool, bool)) -> Vec<u32> {
    let mut spirv = words.to_vec();
    if has_extras && !cells {
        keep_tints_of_shadows(&mut spirv);
        // The first is the material's.
        let Some(array) = instructions(&spirv).find(|&at| is_array_of_colors(&spirv[at..])) else { return spirv };
        (spirv[array + DEPTH], spirv[array + ARRAYED]) = (UNTOLD, 0);
        let sizes: Vec<usize> = sizes_of(&spirv, &[spirv[array + 1]]).collect();
        if let Some(pair) = pair_of_numbers(&spirv) {
            sizes.into_iter().for_each(|at| spirv[at + 1] = pair);
        }
    }
    spirv
}

/// Gives the array of shadow tints a separate type, which keeps its layers.
fn keep_tints_of_shadows(spirv: &mut Vec<u32>) {
    let find = |wanted: &dyn Fn(&[u32]) -> bool| instructions(spirv).find(|&at| wanted(&spirv[at..]));
    let Some(array) = find(&|own| is_array_of_colors(own)) else { return };
    let kind = spirv[array + 1];
    // OpTypePointer (32): its id, the class, and the type.
    let Some(pointer) = find(&|own| own[0] & 0xffff == 32 && own[3] == kind) else { return };
    let pointer_kind = spirv[pointer + 1];
    // OpDecorate (71) of a variable with its DescriptorSet (34).
    let others = instructions(spirv)
        .filter(|&at| spirv[at] & 0xffff == 71 && spirv[at + 2] == 34 && spirv[at + 3] == SHADOW_SET)
        .map(|at| spirv[at + 1]);
    let others: Vec<u32> = others.collect();
    // OpVariable (59) begins with the type of its pointer, and its own id.
    let variables = instructions(spirv)
        .filter(|&at| spirv[at] & 0xffff == 59 && spirv[at + 1] == pointer_kind && others.contains(&spirv[at + 2]));
    let variables: Vec<usize> = variables.collect();
    if variables.is_empty() {
        return;
    }
    let ids: Vec<u32> = variables.iter().map(|&at| spirv[at + 2]).collect();
    // OpLoad (61) of these: the type, the id, and the variable.
    let loads = instructions(spirv).filter(|&at| spirv[at] & 0xffff == 61 && ids.contains(&spirv[at + 3]));
    let loads: Vec<usize> = loads.collect();
    let [own_kind, own_pointer] = [spirv[BOUND], spirv[BOUND] + 1];
    spirv[BOUND] += 2;
    variables.iter().for_each(|&at| spirv[at + 1] = own_pointer);
    loads.iter().for_each(|&at| spirv[at + 1] = own_kind);
    let length = |at: usize| (spirv[at] >> 16) as usize;
    let mut types = [&spirv[array..array + length(array)], &spirv[pointer..pointer + length(pointer)]].concat();
    types[1] = own_kind;
    let image = length(array);
    (types[image + 1], types[image + 3]) = (own_pointer, own_kind);
    let end = pointer + length(pointer);
    spirv.splice(end..end, types);
}

/// The place of the header's word that is above all ids.
const BOUND: usize = 3;

/// The places of the operands of OpTypeImage for depth and for layers.
const DEPTH: usize = 4;
const ARRAYED: usize = 5;
/// The operand's value for neither yes nor no.
const UNTOLD: u32 = 2;

/// The indices at which the instructions of a module begin, after its header of five words. The upper half of the first word of each is its length.
fn instructions(spirv: &[u32]) -> impl Iterator<Item = usize> {
    let mut next = 5;
    std::iter::from_fn(move || {
        let at = next;
        next += (*spirv.get(at)? >> 16).max(1) as usize;
        Some(at)
    })
}

/// Each OpImageQuerySizeLod (103) of an image of these types, which was loaded (OpLoad, 61).
fn sizes_of(spirv: &[u32], types: &[u32]) -> impl Iterator<Item = usize> {
    let loaded = |at: usize| match spirv[at..] {
        [first, kind, loaded, ..] if first & 0xffff == 61 && types.contains(&kind) => Some(loaded),
        _ => None,
    };
    let images: Vec<u32> = instructions(spirv).filter_map(loaded).collect();
    let is_size = move |&at: &usize| matches!(spirv[at..], [first, _, _, image, ..] if first & 0xffff == 103 && images.contains(&image));
    instructions(spirv).filter(is_size)
}

/// The type of two unsigned numbers: OpTypeVector (23) of OpTypeInt (21) of 32 bits.
fn pair_of_numbers(spirv: &[u32]) -> Option<u32> {
    let number =
        instructions(spirv).find(|&at| matches!(spirv[at..], [first, _, 32, 0, ..] if first & 0xffff == 21))?;
    let is_pair =
        |&at: &usize| matches!(spirv[at..], [first, _, of, 2, ..] if first & 0xffff == 23 && of == spirv[number + 1]);
    instructions(spirv).find(is_pair).map(|at| spirv[at + 1])
}

/// OpTypeImage (25) of two dimensions (1), without depth, in layers, of one sample, to be sampled (1).
fn is_array_of_colors(instruction: &[u32]) -> bool {
    matches!(instruction, [first, _, _, 1, 0, 1, 0, 1, ..] if first & 0xffff == 25)
}

/// The set of a material's textures.
const MATERIAL_SET: u32 = 1;

/// The set of shadow maps.
const SHADOW_SET: u32 = 2;

/// The lengths that `shaders/shared/seen.wgsl` declares for its arrays of textures and of samplers, no number twice.
const DECLARED: [u32; 2] = [1021, 1019];

/// A shader with arrays of textures and of samplers as long as their bindings: Vulkan wants a descriptor for each element, and WGSL a number.
pub fn with_lengths(words: &[u32], lengths: [u32; 2]) -> Vec<u32> {
    let mut spirv = words.to_vec();
    // OpConstant (43) of four words: its type, its id, and the number.
    let constants = instructions(words).filter(|&at| words[at] == 4 << 16 | 43);
    for at in constants {
        if let Some(index) = DECLARED.iter().position(|&declared| declared == words[at + 3]) {
            spirv[at + 3] = lengths[index];
        }
    }
    spirv
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::passes::surface::lit_flags;
    use crate::plan::{Capabilities, FramePlan, samples};
    use crate::scene::{Keep, Settings, TextureSlot};
    use crate::shaders::{forward as shader, geometry, shadow, tint};

    /// Returns the names of a module's variables in set 1, each with the word of its binding.
    fn bound(variant: &Variant, spirv: &[u32]) -> Vec<(&'static str, u32)> {
        let fragment = variant.fragment().expect("a fragment stage");
        let material = fragment.bindings.iter().filter(|binding| binding.set == MATERIAL_SET);
        material.map(|binding| (binding.name, spirv[binding.word as usize])).collect()
    }

    #[test]
    fn no_two_types_of_images_are_alike_with_cells_or_without_and_sizes_are_of_their_type() {
        let (mut plain, mut cleared, mut sized, mut kept) = (0, 0, 0, 0);
        for variant in shader::VARIANTS.iter().chain(geometry::VARIANTS).chain(shadow::VARIANTS).chain(tint::VARIANTS) {
            let Some(fragment) = variant.fragment() else { continue };
            let spirv = with_cells(fragment.spirv.words(), (true, false));
            let images: Vec<_> =
                instructions(&spirv).filter(|&at| spirv[at] & 0xffff == 25).map(|at| &spirv[at + 2..at + 9]).collect();
            assert_eq!(images.iter().collect::<BTreeSet<_>>().len(), images.len(), "{:#b}: {images:?}", variant.bits);
            let types: Vec<u32> = instructions(&spirv)
                .filter(|&at| spirv[at] & 0xffff == 25 && spirv[at + DEPTH] == UNTOLD)
                .map(|at| spirv[at + 1])
                .collect();
            let pair = pair_of_numbers(&spirv);
            sized += sizes_of(&spirv, &types).filter(|&at| Some(spirv[at + 1]) == pair).count();
            assert!(sizes_of(&spirv, &types).all(|at| Some(spirv[at + 1]) == pair), "{:#b}", variant.bits);
            // Tints of shadows have layers whatever the material's textures have.
            let names_tints = fragment.bindings.iter().any(|own| own.set == 2 && own.binding == 2);
            assert_eq!(images.iter().any(|image| image[1..5] == [1, 0, 1, 0]), names_tints, "{:#b}", variant.bits);
            kept += usize::from(names_tints);
            plain += usize::from(images.iter().any(|image| image[1..5] == [1, 0, 0, 0]));
            cleared += usize::from(images.iter().any(|image| image[1..5] == [1, UNTOLD, 0, 0]));
        }
        assert!(plain > 0 && cleared > 0 && sized > 0 && kept > 0);
    }

    #[test]
    fn a_pipeline_names_only_textures_that_its_set_has_and_its_own_by_their_bindings() {
        let mut aliased = 0;
        // Every plan here has a G-buffer.
        let device = Capabilities { storage_buffers: 8, ..samples::device() };
        for (name, scene) in samples::scenes() {
            for keep in [Keep::NONE, Keep::NONE.with(crate::scene::OptionalPart::NormalMaps), Keep::ALL] {
                let settings = Settings { keep, ..Settings::default() };
                let plan = FramePlan::of(&scene, &settings, &device).expect("a plan");
                for &key in plan.keys() {
                    let variant = match key.forward {
                        Some(_) => shader::variant(lit_flags(&plan, key)),
                        // The targets that it writes make no difference to the textures.
                        None if key.textures.is_empty() => geometry::variant(geometry::Flags::NONE),
                        None if key.textures.contains(TextureSlot::Normal) => {
                            geometry::variant(geometry::Flags::TEXTURED | geometry::Flags::NORMAL_MAP)
                        }
                        None => geometry::variant(geometry::Flags::TEXTURED),
                    };
                    let variant = variant.expect("a variant");
                    let own = variant.fragment().expect("a fragment stage");
                    let patched = bound_fragment(variant, key);
                    let before = bound(variant, own.spirv.words());
                    for ((name_of, number), (_, original)) in bound(variant, &patched).into_iter().zip(before) {
                        let place = own.bindings.iter().find(|binding| binding.name == name_of).expect("a binding");
                        assert_eq!(original, place.binding, "{name}: {name_of} stands at another word");
                        let is_sampler = place.kind == BindingKind::Sampler;
                        let first = if is_sampler { OWN_SAMPLERS } else { 0 };
                        let is_of_set = |number: u32| key.textures.slots().any(|slot| first + slot as u32 == number);
                        let shares = is_sampler && !key.own_samplers;
                        let present = if shares { number == SAMPLER } else { is_of_set(number) };
                        assert!(present, "{name} {key:?}: {name_of} is bound to {number}");
                        let same = shares || !is_of_set(original) || number == original;
                        assert!(same, "{name} {key:?}: {name_of} is another one");
                        aliased += u32::from(number != original);
                    }
                    let own = own.spirv.words();
                    let changed = own.iter().zip(&patched).filter(|(a, b)| a != b).count();
                    let is_alike = own.len() == patched.len() && changed < 2 * TextureSlot::ALL.len();
                    // Types of an image and of its pointer.
                    assert!(is_alike || patched.len() == own.len() + 13, "{name}");
                }
            }
        }
        assert!(aliased > 0);
    }
}
