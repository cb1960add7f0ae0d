//! Arrays of textures and samplers, indexed differently from invocation to invocation.

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Capability, Op};

/// Declares `SampledImageArrayNonUniformIndexing` where such indices are decorated: naga decorates them, and declares `ShaderNonUniform` alone.
pub(super) fn declare_non_uniform_indexing(module: &mut Module) {
    let declares = |module: &Module, own: Capability| {
        module.capabilities.iter().any(|capability| capability.operands.first() == Some(&Operand::Capability(own)))
    };
    let own = Capability::SampledImageArrayNonUniformIndexing;
    if declares(module, Capability::ShaderNonUniform) && !declares(module, own) {
        module.capabilities.push(Instruction::new(Op::Capability, None, None, vec![Operand::Capability(own)]));
    }
}
