//! The patch adds the parts to SPIR-V that naga cannot write: subpass inputs, specialization constants, uniform indices, Invariant and NoContraction.
//! It also takes the layout off a work group's memory.

mod arrays;
mod constants;
mod decorate;
mod subpass;
mod workgroup;

use rspirv::binary::Assemble;
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Op, Word};

use crate::compose::source_name;

/// A texture variable that becomes an input attachment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SubpassInput {
    /// The name in the source.
    pub name: String,
    /// Descriptor set.
    pub set: u32,
    /// Binding in the set.
    pub binding: u32,
    /// Index into `pInputAttachments`.
    pub index: u32,
}

/// A private variable that becomes a specialization constant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    /// The name in the source.
    pub name: String,
    /// The name in the module.
    pub symbol: String,
    /// SpecId.
    pub id: u32,
}

/// All that a module is patched with.
#[derive(Clone, Debug, Default)]
pub struct Patch {
    /// The subpass inputs. Inputs that the module does not have are ignored.
    pub inputs: Vec<SubpassInput>,
    /// The specialization constants. Constants that the module does not have are ignored.
    pub constants: Vec<Constant>,
    /// Decorate floating-point arithmetic with NoContraction.
    pub precise: bool,
}

/// A module that cannot be patched, and the reason.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct PatchError {
    /// The variable at fault; empty if none.
    pub variable: String,
    /// One line that names it.
    pub message: String,
}

impl PatchError {
    fn of(variable: &str, message: impl Into<String>) -> Self {
        Self { variable: variable.to_owned(), message: message.into() }
    }
}

impl Patch {
    /// Patches the SPIR-V module `words`, which needs its OpNames.
    ///
    /// # Errors
    /// Words that are not a module, or an invalid use of a subpass input or an override.
    pub fn apply(&self, words: &[u32]) -> Result<Vec<u32>, PatchError> {
        let mut module = rspirv::dr::load_words(words)
            .map_err(|error| PatchError::of("", format!("the SPIR-V to be patched cannot be read: {error}")))?;
        subpass::patch(&mut module, &self.inputs)?;
        constants::patch(&mut module, &self.constants)?;
        workgroup::strip_layout(&mut module)?;
        arrays::complete_non_uniform(&mut module);
        decorate::invariant_position(&mut module);
        if self.precise {
            decorate::no_contraction(&mut module);
        }
        restore_names(&mut module);
        Ok(module.assemble())
    }
}

/// Restores the names of the source, for debuggers and layers.
fn restore_names(module: &mut Module) {
    for instruction in &mut module.debug_names {
        if let Some(Operand::LiteralString(name)) = instruction.operands.last_mut() {
            *name = source_name(name).to_owned();
        }
    }
}

/// A new id.
fn fresh(module: &mut Module) -> Word {
    module.header.as_mut().map_or(0, |header| {
        header.bound += 1;
        header.bound - 1
    })
}

/// The id operand number `index`.
fn id(instruction: &Instruction, index: usize) -> Option<Word> {
    match instruction.operands.get(index) {
        Some(Operand::IdRef(id)) => Some(*id),
        _ => None,
    }
}

/// The type, constant or global variable with this id.
fn global(module: &Module, id: Word) -> Option<&Instruction> {
    module.types_global_values.iter().find(|instruction| instruction.result_id == Some(id))
}

/// The name of a function for messages.
fn function_name(module: &Module, function: Option<&Instruction>) -> String {
    let Some(wanted) = function.and_then(|function| function.result_id) else { return "?".to_owned() };
    let named = module.debug_names.iter().find(|name| name.class.opcode == Op::Name && id(name, 0) == Some(wanted));
    match named.and_then(|name| name.operands.last()) {
        Some(Operand::LiteralString(name)) => source_name(name).to_owned(),
        _ => "?".to_owned(),
    }
}
