//! Sampled images that are marked as subpass inputs become images of Dim SubpassData.

use std::collections::HashMap;

use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Capability, Decoration, Dim, ImageFormat, ImageOperands, Op, StorageClass, Word};

use super::{PatchError, SubpassInput, fresh, function_name, global, id};

/// The image and pointer types made so far, by sampled type and multisampling: SPIR-V forbids declaring a type twice.
type Types = HashMap<(Word, u32), (Word, Word)>;

/// A variable that is being turned into a subpass input.
struct SubpassVariable<'a> {
    name: &'a str,
    /// The new OpTypeImage.
    image_type: Word,
}

pub(super) fn patch(module: &mut Module, inputs: &[SubpassInput]) -> Result<(), PatchError> {
    let mut patched: HashMap<Word, SubpassVariable> = HashMap::new();
    let mut types = Types::new();
    for input in inputs {
        let Some(variable) = find_variable(module, input) else { continue };
        let image_type = retype(module, variable, input, &mut types)?;
        let index = Operand::LiteralBit32(input.index);
        let decoration = vec![Operand::IdRef(variable), Operand::Decoration(Decoration::InputAttachmentIndex), index];
        module.annotations.push(Instruction::new(Op::Decorate, None, None, decoration));
        patched.insert(variable, SubpassVariable { name: &input.name, image_type });
    }
    if patched.is_empty() {
        return Ok(());
    }
    let capability = vec![Operand::Capability(Capability::InputAttachment)];
    module.capabilities.push(Instruction::new(Op::Capability, None, None, capability));
    let zero = null_ivec2(module);
    let mut functions = std::mem::take(&mut module.functions);
    let result = functions.iter_mut().try_for_each(|function| patch_function(module, function, &patched, zero));
    module.functions = functions;
    result
}

/// The variable with the input's set and binding.
fn find_variable(module: &Module, input: &SubpassInput) -> Option<Word> {
    let decorated = |variable: Word, decoration: Decoration, value: u32| {
        module.annotations.iter().any(|annotation| {
            annotation.class.opcode == Op::Decorate
                && annotation.operands
                    == [Operand::IdRef(variable), Operand::Decoration(decoration), Operand::LiteralBit32(value)]
        })
    };
    let mut variables = module
        .types_global_values
        .iter()
        .filter(|value| value.class.opcode == Op::Variable)
        .filter_map(|value| value.result_id);
    variables.find(|variable| {
        decorated(*variable, Decoration::DescriptorSet, input.set)
            && decorated(*variable, Decoration::Binding, input.binding)
    })
}

/// Gives the variable a pointer to a SubpassData image, and returns the image's type.
fn retype(module: &mut Module, variable: Word, input: &SubpassInput, types: &mut Types) -> Result<Word, PatchError> {
    let (sampled_type, multisampled) = sampled_image(module, variable).ok_or_else(|| {
        let must = "must be a texture_2d, texture_multisampled_2d or texture_depth_2d";
        PatchError::of(&input.name, format!("the subpass input `{}` {must}", input.name))
    })?;
    let (image_type, pointer_type) = match types.get(&(sampled_type, multisampled)) {
        Some(known) => *known,
        None => {
            let new = declare_subpass_image(module, sampled_type, multisampled);
            types.insert((sampled_type, multisampled), new);
            new
        }
    };
    if let Some(value) = module.types_global_values.iter_mut().find(|value| value.result_id == Some(variable)) {
        value.result_type = Some(pointer_type);
    }
    Ok(image_type)
}

/// The sampled type and the MS operand of the 2D image that a variable is, if it is one.
fn sampled_image(module: &Module, variable: Word) -> Option<(Word, u32)> {
    let pointer = global(module, global(module, variable)?.result_type?)?;
    let image = global(module, id(pointer, 1)?).filter(|image| image.class.opcode == Op::TypeImage)?;
    // Operands: sampled type, Dim, depth, arrayed, multisampled, sampled (1: with a sampler), format.
    match image.operands[..] {
        [
            Operand::IdRef(sampled_type),
            Operand::Dim(Dim::Dim2D),
            _,
            Operand::LiteralBit32(0),
            Operand::LiteralBit32(multisampled),
            Operand::LiteralBit32(1),
            ..,
        ] => Some((sampled_type, multisampled)),
        _ => None,
    }
}

/// Declares a SubpassData image and the pointer to it right behind its sampled type, and so before any variable.
fn declare_subpass_image(module: &mut Module, sampled_type: Word, multisampled: u32) -> (Word, Word) {
    let (image_type, pointer_type) = (fresh(module), fresh(module));
    let image = vec![
        Operand::IdRef(sampled_type),
        Operand::Dim(Dim::DimSubpassData),
        Operand::LiteralBit32(0),
        Operand::LiteralBit32(0),
        Operand::LiteralBit32(multisampled),
        Operand::LiteralBit32(2),
        Operand::ImageFormat(ImageFormat::Unknown),
    ];
    let pointer = vec![Operand::StorageClass(StorageClass::UniformConstant), Operand::IdRef(image_type)];
    let new = [
        Instruction::new(Op::TypeImage, None, Some(image_type), image),
        Instruction::new(Op::TypePointer, None, Some(pointer_type), pointer),
    ];
    let declared = module.types_global_values.iter().position(|value| value.result_id == Some(sampled_type));
    let behind = declared.map_or(0, |at| at + 1);
    module.types_global_values.splice(behind..behind, new);
    (image_type, pointer_type)
}

/// A null constant of type ivec2, at the end of the globals, where every type that it needs has been declared.
fn null_ivec2(module: &mut Module) -> Word {
    let int = declared(module, Op::TypeInt, vec![Operand::LiteralBit32(32), Operand::LiteralBit32(1)]);
    let vector = declared(module, Op::TypeVector, vec![Operand::IdRef(int), Operand::LiteralBit32(2)]);
    let null = fresh(module);
    module.types_global_values.push(Instruction::new(Op::ConstantNull, Some(vector), Some(null), vec![]));
    null
}

/// The type with these operands, declared if it is not yet.
fn declared(module: &mut Module, opcode: Op, operands: Vec<Operand>) -> Word {
    let known =
        module.types_global_values.iter().find(|value| value.class.opcode == opcode && value.operands == operands);
    if let Some(known) = known.and_then(|known| known.result_id) {
        return known;
    }
    let new = fresh(module);
    module.types_global_values.push(Instruction::new(opcode, None, Some(new), operands));
    new
}

/// Rewrites a function's loads and fetches. A load may stand in another block than its fetch, so loads are tracked for the whole function.
fn patch_function(
    module: &Module,
    function: &mut rspirv::dr::Function,
    inputs: &HashMap<Word, SubpassVariable>,
    zero: Word,
) -> Result<(), PatchError> {
    let mut loaded: HashMap<Word, &SubpassVariable> = HashMap::new();
    for instruction in function.blocks.iter_mut().flat_map(|block| &mut block.instructions) {
        let input = id(instruction, 0).and_then(|variable| inputs.get(&variable));
        if let (Op::Load, Some(input), Some(result)) = (instruction.class.opcode, input, instruction.result_id) {
            instruction.result_type = Some(input.image_type);
            loaded.insert(result, input);
        }
    }
    let name = || function_name(module, function.def.as_ref());
    for instruction in function.blocks.iter_mut().flat_map(|block| &mut block.instructions) {
        if let (Op::ImageFetch, Some(input)) =
            (instruction.class.opcode, id(instruction, 0).and_then(|image| loaded.get(&image)))
        {
            fetch_to_read(module, instruction, zero).map_err(|problem| {
                PatchError::of(input.name, format!("the subpass input `{}` is read {problem} in `{}`: write `textureLoad({0}, vec2<i32>(0, 0), 0)`", input.name, name()))
            })?;
            continue;
        }
        for operand in &instruction.operands {
            let Operand::IdRef(used) = operand else { continue };
            let load = instruction.class.opcode == Op::Load;
            if let Some(input) = loaded.get(used).copied().or_else(|| inputs.get(used).filter(|_| !load)) {
                let message = format!(
                    "the subpass input `{}` is used for more than `textureLoad` in `{}`: it cannot be sampled, asked for its size or passed to a function",
                    input.name,
                    name()
                );
                return Err(PatchError::of(input.name, message));
            }
        }
    }
    Ok(())
}

/// OpImageFetch becomes OpImageRead of the pixel itself: no level, but still a sample.
fn fetch_to_read(module: &Module, fetch: &mut Instruction, zero: Word) -> Result<(), &'static str> {
    let Some(image) = id(fetch, 0) else { return Err("without an image") };
    if !id(fetch, 1).is_some_and(|coordinates| is_zero(module, coordinates)) {
        return Err("at other coordinates than (0, 0)");
    }
    let mut operands = vec![Operand::IdRef(image), Operand::IdRef(zero)];
    if let Some(Operand::ImageOperands(mask)) = fetch.operands.get(2) {
        // The operands follow in the order of their bits; naga writes either a level or a sample.
        let value = id(fetch, 3).ok_or("with an operand missing")?;
        if *mask == ImageOperands::SAMPLE {
            operands.extend([Operand::ImageOperands(ImageOperands::SAMPLE), Operand::IdRef(value)]);
        } else if *mask != ImageOperands::LOD || !is_zero(module, value) {
            return Err("at another level than 0");
        }
    }
    *fetch = Instruction::new(Op::ImageRead, fetch.result_type, fetch.result_id, operands);
    Ok(())
}

/// Returns true if a constant is zero in all its components.
fn is_zero(module: &Module, constant: Word) -> bool {
    let Some(value) = global(module, constant) else { return false };
    match value.class.opcode {
        Op::ConstantNull => true,
        Op::Constant => value.operands.iter().all(|operand| *operand == Operand::LiteralBit32(0)),
        Op::ConstantComposite => {
            (0..value.operands.len()).all(|part| id(value, part).is_some_and(|part| is_zero(module, part)))
        }
        _ => false,
    }
}
