//! Private variables that stand for overrides become specialization constants.

use std::collections::HashMap;

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op, StorageClass, Word};

use super::{Constant, PatchError, function_name, global, id};

pub(super) fn patch(module: &mut Module, constants: &[Constant]) -> Result<(), PatchError> {
    let mut variables: HashMap<Word, &Constant> = HashMap::new();
    for constant in constants {
        let Some(variable) = find_variable(module, &constant.symbol) else { continue };
        specialize(module, variable, constant)?;
        let decoration =
            vec![Operand::IdRef(variable), Operand::Decoration(Decoration::SpecId), Operand::LiteralBit32(constant.id)];
        module.annotations.push(Instruction::new(Op::Decorate, None, None, decoration));
        variables.insert(variable, constant);
    }
    if variables.is_empty() {
        return Ok(());
    }
    for entry in &mut module.entry_points {
        entry
            .operands
            .retain(|operand| !matches!(operand, Operand::IdRef(variable) if variables.contains_key(variable)));
    }
    let mut functions = std::mem::take(&mut module.functions);
    let result = functions.iter_mut().try_for_each(|function| replace_loads(module, function, &variables));
    module.functions = functions;
    result
}

/// The private variable of this name.
fn find_variable(module: &Module, symbol: &str) -> Option<Word> {
    let named = module.debug_names.iter().filter(|name| {
        name.class.opcode == Op::Name
            && matches!(name.operands.last(), Some(Operand::LiteralString(name)) if name == symbol)
    });
    let private = |variable: &Word| {
        global(module, *variable).is_some_and(|value| {
            value.class.opcode == Op::Variable
                && value.operands.first() == Some(&Operand::StorageClass(StorageClass::Private))
        })
    };
    named.filter_map(|name| id(name, 0)).find(private)
}

/// Puts a specialization constant with the variable's id and initial value in the variable's place.
fn specialize(module: &mut Module, variable: Word, constant: &Constant) -> Result<(), PatchError> {
    let fault = || {
        PatchError::of(
            &constant.name,
            format!("the override `{}` must be a bool, u32, i32 or f32 with a constant default", constant.name),
        )
    };
    let declaration = global(module, variable).ok_or_else(fault)?;
    let pointee = declaration
        .result_type
        .and_then(|pointer| global(module, pointer))
        .and_then(|pointer| id(pointer, 1))
        .ok_or_else(fault)?;
    let boolean = match global(module, pointee).map(|ty| ty.class.opcode) {
        Some(Op::TypeBool) => true,
        Some(Op::TypeInt | Op::TypeFloat) => false,
        _ => return Err(fault()),
    };
    let initial = id(declaration, 1).and_then(|initial| global(module, initial)).ok_or_else(fault)?;
    let (opcode, operands) = match (initial.class.opcode, boolean) {
        (Op::ConstantTrue, _) => (Op::SpecConstantTrue, vec![]),
        (Op::ConstantFalse, _) | (Op::ConstantNull, true) => (Op::SpecConstantFalse, vec![]),
        (Op::ConstantNull, false) => (Op::SpecConstant, vec![Operand::LiteralBit32(0)]),
        (Op::Constant, _) => (Op::SpecConstant, initial.operands.clone()),
        _ => return Err(fault()),
    };
    let new = Instruction::new(opcode, Some(pointee), Some(variable), operands);
    if let Some(value) = module.types_global_values.iter_mut().find(|value| value.result_id == Some(variable)) {
        *value = new;
    }
    Ok(())
}

/// Drops the loads of the variables and puts the constants where their results were used.
fn replace_loads(
    module: &Module,
    function: &mut rspirv::dr::Function,
    variables: &HashMap<Word, &Constant>,
) -> Result<(), PatchError> {
    let mut replaced: HashMap<Word, Word> = HashMap::new();
    for block in &mut function.blocks {
        block.instructions.retain(|instruction| {
            let variable = id(instruction, 0).filter(|variable| variables.contains_key(variable));
            match (instruction.class.opcode, variable, instruction.result_id) {
                (Op::Load, Some(variable), Some(result)) => {
                    replaced.insert(result, variable);
                    false
                }
                _ => true,
            }
        });
    }
    let name = function_name(module, function.def.as_ref());
    for operand in function
        .blocks
        .iter_mut()
        .flat_map(|block| &mut block.instructions)
        .flat_map(|instruction| &mut instruction.operands)
    {
        let Operand::IdRef(used) = operand else { continue };
        if let Some(constant) = variables.get(used) {
            let message = format!(
                "the override `{}` is assigned to, or its address is taken, in `{name}`: it is a constant",
                constant.name
            );
            return Err(PatchError::of(&constant.name, message));
        }
        if let Some(constant) = replaced.get(used) {
            *used = *constant;
        }
    }
    Ok(())
}
