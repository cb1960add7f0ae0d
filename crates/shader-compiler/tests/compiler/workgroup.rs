//! Types in a work group's memory have no explicit layout; types in buffers keep it.

use crate::common::{all, compile, module, only, validate};
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op, StorageClass, Word};

/// A struct with everything that a layout has, in a buffer and in the memory of a work group.
const SHARED: &str = "
    struct Part { turn: mat3x3<f32>, place: vec3<f32>, count: u32 }
    struct Whole { parts: array<Part, 2>, sum: array<vec2<u32>, 3> }
    @group(0) @binding(0) var<storage, read_write> wholes: array<Whole>;
    var<workgroup> own: Whole;
    var<workgroup> numbers: array<array<atomic<u32>, 2>, 8>;
";

fn compute(body: &str) -> String {
    format!(
        "{SHARED}\n@compute @workgroup_size(4) fn compute(@builtin(local_invocation_index) index: u32) {{ {body} }}"
    )
}

fn declaration(module: &Module, id: Word) -> &Instruction {
    let found = module.types_global_values.iter().find(|own| own.result_id == Some(id));
    found.unwrap_or_else(|| panic!("%{id} is not declared"))
}

fn ids(instruction: &Instruction) -> impl Iterator<Item = Word> {
    instruction.operands.iter().filter_map(|operand| match operand {
        Operand::IdRef(id) => Some(*id),
        _ => None,
    })
}

/// The layout decorations of a type and of its member types.
fn layout(module: &Module, ty: Word) -> Vec<Decoration> {
    let is_of = |own: &&Instruction| own.operands[0] == Operand::IdRef(ty);
    let of_own =
        module.annotations.iter().filter(is_of).flat_map(|own| &own.operands).filter_map(|operand| match operand {
            Operand::Decoration(
                own @ (Decoration::ArrayStride
                | Decoration::MatrixStride
                | Decoration::Offset
                | Decoration::ColMajor
                | Decoration::Block),
            ) => Some(*own),
            _ => None,
        });
    let declaration = declaration(module, ty);
    let parts: Vec<Word> = match declaration.class.opcode {
        Op::TypeArray | Op::TypeRuntimeArray => ids(declaration).take(1).collect(),
        Op::TypeStruct => ids(declaration).collect(),
        _ => Vec::new(),
    };
    of_own.chain(parts.into_iter().flat_map(|part| layout(module, part))).collect()
}

/// The types that pointers into this memory point at.
fn pointees(module: &Module, class: StorageClass) -> Vec<Word> {
    let pointers = all(module, Op::TypePointer);
    pointers.iter().filter(|own| own.operands[0] == Operand::StorageClass(class)).flat_map(|own| ids(own)).collect()
}

fn count_layouts(module: &Module, class: StorageClass) -> usize {
    pointees(module, class).into_iter().map(|ty| layout(module, ty).len()).sum()
}

#[test]
fn only_types_of_a_work_group_lose_their_layout() {
    let shader = compile(&compute(
        "own.parts[index & 1u].turn[1] = wholes[index].parts[0].place;
        atomicAdd(&numbers[index][0], own.parts[0].count);
        workgroupBarrier();
        wholes[index].sum[0] = vec2<u32>(atomicLoad(&numbers[0][0]), 1u) + own.sum[2];
        wholes[index].parts[1].turn = own.parts[1].turn;",
    ));
    validate(only(&shader));
    let module = module(only(&shader));
    assert!(!pointees(&module, StorageClass::Workgroup).is_empty());
    assert_eq!(count_layouts(&module, StorageClass::Workgroup), 0);
    // Whole: the offsets of its two members, two strides, and of Part three offsets, a matrix's stride and order.
    let stored = all(&module, Op::TypeStruct).into_iter().filter_map(|own| own.result_id);
    let most = stored.map(|ty| layout(&module, ty).len()).max();
    assert!(most >= Some(9), "{most:?}");
    assert!(count_layouts(&module, StorageClass::StorageBuffer) >= 9);
    // Debuggers show the name of the copy as well.
    let is_part = |own: &&&Instruction| own.operands[1] == Operand::LiteralString("Part".into());
    assert_eq!(all(&module, Op::Name).iter().filter(is_part).count(), 2);
}

#[test]
fn a_whole_value_goes_from_one_memory_to_the_other_part_by_part() {
    let shader = compile(&compute(
        "own = wholes[index];
        workgroupBarrier();
        var copy = own;
        copy.parts[0].count += 1u;
        wholes[index + 1u] = copy;
        own.parts[1] = copy.parts[0];",
    ));
    validate(only(&shader));
    let module = module(only(&shader));
    assert_eq!(count_layouts(&module, StorageClass::Workgroup), 0);
    // No instruction of SPIR-V 1.4.
    assert!(all(&module, Op::CopyLogical).is_empty());
    // A whole value takes five: its two parts, their two arrays, and itself. It is loaded and stored once, and one part alone is copied.
    assert_eq!(all(&module, Op::CompositeConstruct).len(), 2 * 5 + 1);
}

#[test]
fn a_type_that_no_buffer_has_is_declared_once() {
    let shader = compile(
        "var<workgroup> own: array<u32, 16>;
        @group(0) @binding(0) var<storage, read_write> sum: u32;
        @compute @workgroup_size(16) fn compute(@builtin(local_invocation_index) index: u32) {
            own[index] = index;
            workgroupBarrier();
            sum = own[3];
        }",
    );
    validate(only(&shader));
    let module = module(only(&shader));
    assert_eq!(all(&module, Op::TypeArray).len(), 1);
    let strides = all(&module, Op::Decorate)
        .into_iter()
        .filter(|own| own.operands[1] == Operand::Decoration(Decoration::ArrayStride));
    assert_eq!(strides.count(), 0);
}
