//! Arrays of textures and samplers, indexed alike by all invocations that run together.

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Capability, Decoration, Op};

/// Takes every index of such an array for dynamically uniform, as shaders promise: naga loses sight of that in functions and variables, and then asks for
/// descriptor indexing, which Vulkan 1.1 has not. Uniform ones need no more than `shaderSampledImageArrayDynamicIndexing`.
pub(super) fn uniform_indices(module: &mut Module) {
    let is_non_uniform =
        |annotation: &Instruction| annotation.operands.contains(&Operand::Decoration(Decoration::NonUniform));
    let before = module.annotations.len();
    module.annotations.retain(|annotation| !is_non_uniform(annotation));
    let own = [
        Capability::ShaderNonUniform,
        Capability::SampledImageArrayNonUniformIndexing,
        Capability::RuntimeDescriptorArray,
    ];
    let is_own = |capability: &Instruction| matches!(capability.operands.first(), Some(Operand::Capability(capability)) if own.contains(capability));
    let had = module.capabilities.len();
    module.capabilities.retain(|capability| !is_own(capability));
    if before == module.annotations.len() && had == module.capabilities.len() {
        return;
    }
    let dynamic = vec![Operand::Capability(Capability::SampledImageArrayDynamicIndexing)];
    module.capabilities.push(Instruction::new(Op::Capability, None, None, dynamic));
    let is_extension = |extension: &Instruction| matches!(extension.operands.first(), Some(Operand::LiteralString(name)) if name == "SPV_EXT_descriptor_indexing");
    module.extensions.retain(|extension| !is_extension(extension));
}
