//! Arrays of textures and samplers whose index differs between invocations (NonUniform).

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Capability, Decoration, Op, Word};

use super::decorate::decorate;
use super::id;

/// Completes the NonUniform decorations that SPIR-V requires. naga decorates the index, the pointer and the loaded value, and declares
/// `ShaderNonUniform`. The sampled image that sampling takes needs the decoration too, and the indices need the capabilities for texture arrays.
pub(super) fn complete_non_uniform(module: &mut Module) {
    let decorated: Vec<Word> =
        module.annotations.iter().filter(|own| is_non_uniform(own)).filter_map(|own| id(own, 0)).collect();
    if decorated.is_empty() {
        return;
    }
    let joined = module.all_inst_iter().filter(|own| {
        own.class.opcode == Op::SampledImage
            && [0, 1].iter().any(|&part| id(own, part).is_some_and(|id| decorated.contains(&id)))
    });
    let joined: Vec<Word> = joined.filter_map(|own| own.result_id).collect();
    module.annotations.extend(joined.into_iter().map(|own| decorate(own, Decoration::NonUniform)));
    for own in [Capability::SampledImageArrayDynamicIndexing, Capability::SampledImageArrayNonUniformIndexing] {
        let declaration = Instruction::new(Op::Capability, None, None, vec![Operand::Capability(own)]);
        if !module.capabilities.contains(&declaration) {
            module.capabilities.push(declaration);
        }
    }
}

fn is_non_uniform(annotation: &Instruction) -> bool {
    annotation.operands.get(1) == Some(&Operand::Decoration(Decoration::NonUniform))
}
