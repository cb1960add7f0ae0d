//! Types of a work group's memory lose their explicit layout: strides of arrays and matrices, offsets of members.
//!
//! naga lays out every array and struct, whatever memory it is of. Vulkan allows a layout in memory that a host can share, and forbids it in a work group's
//! unless `VK_KHR_workgroup_memory_explicit_layout` is on (VUID-StandaloneSpirv-None-10684). Both kinds of memory may use the same type, so variables of a
//! work group get a copy of it without a layout. A whole value that is loaded or stored changes from one type to the other part by part:
//! OpCopyLogical needs SPIR-V 1.4, and modules are 1.3.

use std::collections::HashMap;

use rspirv::dr::{Block, Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op, StorageClass, Word};

use super::{PatchError, fresh, global, id};

/// Copies without a layout, by the type that has one.
type Copies = HashMap<Word, Word>;

pub(super) fn strip_layout(module: &mut Module) -> Result<(), PatchError> {
    let pointers: HashMap<Word, Word> = module
        .types_global_values
        .iter()
        .filter(|own| own.class.opcode == Op::TypePointer)
        .filter(|own| own.operands.first() == Some(&Operand::StorageClass(StorageClass::Workgroup)))
        .filter_map(|own| Some((own.result_id?, id(own, 1)?)))
        .collect();
    // Sorted, so that the same source gives the same bytes.
    let mut pointees: Vec<Word> = pointers.values().copied().collect();
    pointees.sort_unstable();
    let mut copies = Copies::new();
    for pointee in pointees {
        copy_without_layout(module, pointee, &mut copies);
    }
    if copies.is_empty() {
        return Ok(());
    }
    for own in &mut module.types_global_values {
        if let Some(copy) = own.result_id.and_then(|own| copies.get(pointers.get(&own)?)) {
            own.operands[1] = Operand::IdRef(*copy);
        }
    }
    retype_initial_values(module, &pointers, &copies);
    convert_values(module, &pointers, &copies)?;
    drop_unused(module, &copies);
    Ok(())
}

/// Returns the type without a layout: itself, or a copy that is declared right behind it.
fn copy_without_layout(module: &mut Module, ty: Word, copies: &mut Copies) -> Word {
    if let Some(copy) = copies.get(&ty) {
        return *copy;
    }
    let Some(declaration) = global(module, ty).cloned() else { return ty };
    let parts = match declaration.class.opcode {
        Op::TypeArray => 1,
        Op::TypeStruct => declaration.operands.len(),
        _ => return ty,
    };
    let mut operands = declaration.operands.clone();
    for part in operands.iter_mut().take(parts) {
        if let Operand::IdRef(part) = part {
            *part = copy_without_layout(module, *part, copies);
        }
    }
    let has_layout = module.annotations.iter().any(|own| id(own, 0) == Some(ty) && is_layout(own));
    if operands == declaration.operands && !has_layout {
        return ty;
    }
    let copy = fresh(module);
    let of_copy = |own: &Instruction| {
        let mut own = own.clone();
        own.operands[0] = Operand::IdRef(copy);
        own
    };
    let is_of = |own: &&Instruction| id(own, 0) == Some(ty);
    let names: Vec<_> = module.debug_names.iter().filter(is_of).map(of_copy).collect();
    module.debug_names.extend(names);
    let kept: Vec<_> = module.annotations.iter().filter(is_of).filter(|own| !is_layout(own)).map(of_copy).collect();
    module.annotations.extend(kept);
    let behind = module.types_global_values.iter().position(|own| own.result_id == Some(ty)).map_or(0, |at| at + 1);
    let new = Instruction::new(declaration.class.opcode, None, Some(copy), operands);
    module.types_global_values.insert(behind, new);
    copies.insert(ty, copy);
    copy
}

/// Returns true for the decorations of a layout. `Block` is one: it marks the type of a buffer or uniform, whose members have offsets.
fn is_layout(annotation: &Instruction) -> bool {
    let decoration = match annotation.class.opcode {
        Op::Decorate => annotation.operands.get(1),
        Op::MemberDecorate => annotation.operands.get(2),
        _ => None,
    };
    let Some(Operand::Decoration(decoration)) = decoration else { return false };
    matches!(
        decoration,
        Decoration::ArrayStride
            | Decoration::MatrixStride
            | Decoration::Offset
            | Decoration::RowMajor
            | Decoration::ColMajor
            | Decoration::Block
            | Decoration::BufferBlock
    )
}

/// Variables of a work group start undefined, or as zero: then the zero has the variable's type.
fn retype_initial_values(module: &mut Module, pointers: &HashMap<Word, Word>, copies: &Copies) {
    let initial = |own: &Instruction| {
        let copy = copies.get(pointers.get(&own.result_type?)?)?;
        (own.class.opcode == Op::Variable).then_some((id(own, 1)?, *copy))
    };
    let mut at = 0;
    while at < module.types_global_values.len() {
        if let Some((_, copy)) = initial(&module.types_global_values[at]) {
            let null = fresh(module);
            module.types_global_values[at].operands[1] = Operand::IdRef(null);
            let zero = Instruction::new(Op::ConstantNull, Some(copy), Some(null), vec![]);
            module.types_global_values.insert(at, zero);
            at += 1;
        }
        at += 1;
    }
}

/// Puts the change of type behind each load of a whole value from a work group's memory, and before each store. naga reads and writes memory in no other way.
fn convert_values(module: &mut Module, pointers: &HashMap<Word, Word>, copies: &Copies) -> Result<(), PatchError> {
    // Types that pointers point at as naga gave them, by pointer.
    let pointees: HashMap<Word, Word> = module
        .all_inst_iter()
        .filter_map(|own| Some((own.result_id?, *pointers.get(&own.result_type?)?)))
        .filter(|(_, pointee)| copies.contains_key(pointee))
        .collect();
    let mut functions = std::mem::take(&mut module.functions);
    let blocks = functions.iter_mut().flat_map(|function| &mut function.blocks);
    let result = blocks.into_iter().try_for_each(|block| convert_in(module, block, &pointees, copies));
    module.functions = functions;
    result
}

fn convert_in(
    module: &mut Module,
    block: &mut Block,
    pointees: &HashMap<Word, Word>,
    copies: &Copies,
) -> Result<(), PatchError> {
    let mut converted = Vec::with_capacity(block.instructions.len());
    for mut own in std::mem::take(&mut block.instructions) {
        let Some(ty) = id(&own, 0).and_then(|pointer| pointees.get(&pointer)).copied() else {
            converted.push(own);
            continue;
        };
        let copy = copies[&ty];
        match (own.class.opcode, own.result_id, id(&own, 1)) {
            (Op::Load, Some(result), _) => {
                let loaded = fresh(module);
                own.result_type = Some(copy);
                own.result_id = Some(loaded);
                converted.push(own);
                let value = convert(module, loaded, (copy, ty), &mut converted)?;
                // The last instruction makes the whole value, which the function knows by the load's id.
                if let Some(last) = converted.last_mut().filter(|last| last.result_id == Some(value)) {
                    last.result_id = Some(result);
                }
            }
            (Op::Store, _, Some(value)) => {
                let value = convert(module, value, (ty, copy), &mut converted)?;
                own.operands[1] = Operand::IdRef(value);
                converted.push(own);
            }
            _ => converted.push(own),
        }
    }
    block.instructions = converted;
    Ok(())
}

/// Takes a value apart and puts it together as another type of the same shape. Returns the new value.
fn convert(
    module: &mut Module,
    value: Word,
    (from, to): (Word, Word),
    instructions: &mut Vec<Instruction>,
) -> Result<Word, PatchError> {
    if from == to {
        return Ok(value);
    }
    let parts: Vec<(Word, Word)> = parts(module, from)?.into_iter().zip(parts(module, to)?).collect();
    let mut operands = Vec::with_capacity(parts.len());
    for (index, part) in (0..).zip(parts) {
        let taken = fresh(module);
        let place = vec![Operand::IdRef(value), Operand::LiteralBit32(index)];
        instructions.push(Instruction::new(Op::CompositeExtract, Some(part.0), Some(taken), place));
        operands.push(Operand::IdRef(convert(module, taken, part, instructions)?));
    }
    let whole = fresh(module);
    instructions.push(Instruction::new(Op::CompositeConstruct, Some(to), Some(whole), operands));
    Ok(whole)
}

/// The types of an array's or struct's parts.
fn parts(module: &Module, ty: Word) -> Result<Vec<Word>, PatchError> {
    let fault = || PatchError::of("", "a value of a work group's memory is an array of unknown length".to_owned());
    let declaration = global(module, ty).ok_or_else(fault)?;
    let types: Vec<Word> = (0..declaration.operands.len()).filter_map(|part| id(declaration, part)).collect();
    match (declaration.class.opcode, &types[..]) {
        (Op::TypeArray, [element, length]) => {
            let length = global(module, *length).filter(|length| length.class.opcode == Op::Constant);
            match length.and_then(|length| length.operands.first()) {
                Some(Operand::LiteralBit32(length)) => Ok(vec![*element; *length as usize]),
                _ => Err(fault()),
            }
        }
        (Op::TypeStruct, _) => Ok(types),
        _ => Err(fault()),
    }
}

/// Drops the types that only a work group's memory had, the containing ones first.
fn drop_unused(module: &mut Module, copies: &Copies) {
    let own: Vec<Word> = module.types_global_values.iter().filter_map(|own| own.result_id).collect();
    for ty in own.into_iter().rev().filter(|own| copies.contains_key(own)) {
        let global = &module.types_global_values;
        let in_functions = module.functions.iter().flat_map(rspirv::dr::Function::all_inst_iter);
        let is_used = global
            .iter()
            .chain(in_functions)
            .any(|own| own.result_type == Some(ty) || own.operands.contains(&Operand::IdRef(ty)));
        if !is_used {
            module.types_global_values.retain(|own| own.result_id != Some(ty));
            module.annotations.retain(|own| id(own, 0) != Some(ty));
            module.debug_names.retain(|own| id(own, 0) != Some(ty));
        }
    }
}
