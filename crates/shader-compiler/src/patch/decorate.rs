//! Decorations that make different pipelines agree to the bit.

use std::collections::HashSet;

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{BuiltIn, Decoration, Op, Word};

/// Decorates every position output as Invariant, so that two pipelines that compute it alike place it alike: depth tests with EQUAL,
/// and shadow and geometry passes, depend on it.
pub(super) fn invariant_position(module: &mut Module) {
    let decorated = |wanted: &[Operand]| -> HashSet<Word> {
        let annotations = module.annotations.iter().filter(|annotation| annotation.class.opcode == Op::Decorate);
        annotations
            .filter_map(|annotation| match annotation.operands.split_first() {
                Some((Operand::IdRef(target), rest)) if rest == wanted => Some(*target),
                _ => None,
            })
            .collect()
    };
    let positions = decorated(&[Operand::Decoration(Decoration::BuiltIn), Operand::BuiltIn(BuiltIn::Position)]);
    let already = decorated(&[Operand::Decoration(Decoration::Invariant)]);
    // Sorted, so that the same source gives the same bytes.
    let mut missing: Vec<_> = positions.difference(&already).copied().collect();
    missing.sort_unstable();
    module.annotations.extend(missing.into_iter().map(|position| decorate(position, Decoration::Invariant)));
}

/// Decorates all floating-point arithmetic as NoContraction, so that no driver fuses a multiplication and an addition, which rounds
/// once instead of twice, in one pipeline and not in another.
pub(super) fn no_contraction(module: &mut Module) {
    let results: Vec<_> = module
        .all_inst_iter()
        .filter(|instruction| is_arithmetic(instruction.class.opcode))
        .filter_map(|instruction| instruction.result_id)
        .collect();
    module.annotations.extend(results.into_iter().map(|result| decorate(result, Decoration::NoContraction)));
}

fn is_arithmetic(opcode: Op) -> bool {
    matches!(
        opcode,
        Op::FNegate
            | Op::FAdd
            | Op::FSub
            | Op::FMul
            | Op::FDiv
            | Op::FRem
            | Op::FMod
            | Op::VectorTimesScalar
            | Op::MatrixTimesScalar
            | Op::VectorTimesMatrix
            | Op::MatrixTimesVector
            | Op::MatrixTimesMatrix
            | Op::OuterProduct
            | Op::Dot
    )
}

pub(super) fn decorate(target: Word, decoration: Decoration) -> Instruction {
    Instruction::new(Op::Decorate, None, None, vec![Operand::IdRef(target), Operand::Decoration(decoration)])
}
