//! The interface that the host must agree with: bindings, inputs, outputs, push constants, and the layouts of structs in memory.

use std::collections::BTreeMap;

use naga::proc::Layouter;
use naga::{AddressSpace, ImageClass, ScalarKind, ShaderStage, StorageAccess, TypeInner};

use crate::compose::source_name;

/// The kind of resource that a binding takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ResourceKind {
    /// `var<uniform>`
    UniformBuffer,
    /// `var<storage>`
    StorageBuffer {
        /// True if the shader only reads it.
        read_only: bool,
    },
    /// A texture, depth or multisampled too.
    SampledImage,
    /// `sampler`
    Sampler,
    /// `sampler_comparison`
    ComparisonSampler,
    /// A texture whose name marks it as a subpass input.
    InputAttachment {
        /// Index into `pInputAttachments`.
        index: u32,
    },
    /// A storage texture.
    StorageImage,
}

/// A resource that an entry point uses.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ReflectedBinding {
    /// The name in the source.
    pub name: String,
    /// Descriptor set.
    pub set: u32,
    /// Binding in the set.
    pub binding: u32,
    /// The kind of resource that it takes.
    pub kind: ResourceKind,
    /// The number of descriptors; 0 for an array without a size.
    pub count: u32,
    /// The index of the word in the module that holds the binding's number, so that a pipeline can change it.
    pub word: u32,
}

/// The numeric type of an input or output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NumericType {
    /// `f32`
    Float,
    /// `u32`
    Uint,
    /// `i32`
    Sint,
}

/// A vertex attribute or a colour output.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Located {
    /// The name in the source.
    pub name: String,
    /// `@location`
    pub location: u32,
    /// Type of a component.
    pub kind: NumericType,
    /// Components, 1 to 4.
    pub components: u32,
}

/// The layout of a struct in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StructLayout {
    /// The name in the source.
    pub name: String,
    /// Bytes, the padding at the end included; up to the array for a struct that ends in one without a size.
    pub size: u32,
    /// Alignment in bytes.
    pub align: u32,
    /// The members in order.
    pub members: Vec<MemberLayout>,
}

/// The place of a member in its struct.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemberLayout {
    /// The name.
    pub name: String,
    /// Bytes from the start of the struct.
    pub offset: u32,
    /// Bytes from one element to the next, if it is an array.
    pub stride: Option<u32>,
}

/// The push constants of an entry point or a shader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PushConstants {
    /// `var<immediate>` of a struct.
    Struct(StructLayout),
    /// `var<immediate>` of another type, with its size in bytes.
    Plain(u32),
}

impl PushConstants {
    /// The size in bytes.
    #[must_use]
    pub fn size(&self) -> u32 {
        match self {
            Self::Struct(layout) => layout.size,
            Self::Plain(size) => *size,
        }
    }
}

/// The bindings of `module`, which was written as `spirv`, by set and binding; `input_index` tells which are subpass inputs.
#[must_use]
pub fn bindings(
    module: &naga::Module,
    spirv: &[u32],
    input_index: impl Fn(u32, u32) -> Option<u32>,
) -> Vec<ReflectedBinding> {
    let words = binding_words(spirv);
    let mut bindings = Vec::new();
    for (_, global) in module.global_variables.iter() {
        let Some(place) = global.binding else { continue };
        let (count, inner) = match module.types[global.ty].inner {
            TypeInner::BindingArray { base, size } => {
                let count = match size {
                    naga::ArraySize::Constant(count) => count.get(),
                    _ => 0,
                };
                (count, &module.types[base].inner)
            }
            ref inner => (1, inner),
        };
        let kind = match (input_index(place.group, place.binding), global.space, inner) {
            (Some(index), _, _) => ResourceKind::InputAttachment { index },
            (_, AddressSpace::Uniform, _) => ResourceKind::UniformBuffer,
            (_, AddressSpace::Storage { access }, _) => {
                ResourceKind::StorageBuffer { read_only: !access.contains(StorageAccess::STORE) }
            }
            (_, _, TypeInner::Sampler { comparison: true }) => ResourceKind::ComparisonSampler,
            (_, _, TypeInner::Sampler { comparison: false }) => ResourceKind::Sampler,
            (_, _, TypeInner::Image { class: ImageClass::Storage { .. }, .. }) => ResourceKind::StorageImage,
            _ => ResourceKind::SampledImage,
        };
        let name = source_name(global.name.as_deref().unwrap_or("")).to_owned();
        let word = words.get(&(place.group, place.binding)).copied().unwrap_or(0);
        bindings.push(ReflectedBinding { name, set: place.group, binding: place.binding, kind, count, word });
    }
    bindings.sort_by_key(|binding| (binding.set, binding.binding));
    bindings
}

/// The index of the word that holds the number in `OpDecorate variable Binding number`, by set and binding.
fn binding_words(spirv: &[u32]) -> BTreeMap<(u32, u32), u32> {
    const HEADER_WORDS: usize = 5;
    let (mut sets, mut places) = (BTreeMap::new(), Vec::new());
    let mut at = HEADER_WORDS;
    while let Some(&first) = spirv.get(at) {
        let (opcode, length) = (first & 0xffff, (first >> 16) as usize);
        if let (OP_DECORATE, Some(&[variable, decoration, number])) = (opcode, spirv.get(at + 1..at + 4)) {
            match decoration {
                DECORATION_DESCRIPTOR_SET => drop(sets.insert(variable, number)),
                DECORATION_BINDING => places.push((variable, number, at as u32 + 3)),
                _ => {}
            }
        }
        at += length.max(1);
    }
    places.iter().filter_map(|(variable, binding, word)| Some(((*sets.get(variable)?, *binding), *word))).collect()
}

// Numbers of the SPIR-V specification, sections 3.2.20 and 3.3.8.
const OP_DECORATE: u32 = 71;
const DECORATION_BINDING: u32 = 33;
const DECORATION_DESCRIPTOR_SET: u32 = 34;

/// The vertex attributes that an entry point takes; none unless it is a vertex shader.
#[must_use]
pub fn vertex_inputs(module: &naga::Module, entry: &naga::EntryPoint) -> Vec<Located> {
    let mut inputs = Vec::new();
    if entry.stage == ShaderStage::Vertex {
        for argument in &entry.function.arguments {
            located(module, argument.name.as_deref(), argument.ty, argument.binding.as_ref(), &mut inputs);
        }
    }
    inputs.sort_by_key(|input| input.location);
    inputs
}

/// The colours that an entry point writes; none unless it is a fragment shader.
#[must_use]
pub fn fragment_outputs(module: &naga::Module, entry: &naga::EntryPoint) -> Vec<Located> {
    let mut outputs = Vec::new();
    if let (ShaderStage::Fragment, Some(result)) = (entry.stage, &entry.function.result) {
        located(module, None, result.ty, result.binding.as_ref(), &mut outputs);
    }
    outputs.sort_by_key(|output| output.location);
    outputs
}

fn located(
    module: &naga::Module,
    name: Option<&str>,
    ty: naga::Handle<naga::Type>,
    binding: Option<&naga::Binding>,
    out: &mut Vec<Located>,
) {
    let inner = &module.types[ty].inner;
    match (binding, inner) {
        (None, TypeInner::Struct { members, .. }) => {
            for member in members {
                located(module, member.name.as_deref(), member.ty, member.binding.as_ref(), out);
            }
        }
        (
            Some(naga::Binding::Location { location, .. }),
            TypeInner::Scalar(scalar) | TypeInner::Vector { scalar, .. },
        ) => {
            let components = match inner {
                TypeInner::Vector { size, .. } => *size as u32,
                _ => 1,
            };
            let kind = match scalar.kind {
                ScalarKind::Uint => NumericType::Uint,
                ScalarKind::Sint => NumericType::Sint,
                _ => NumericType::Float,
            };
            out.push(Located { name: name.unwrap_or("").to_owned(), location: *location, kind, components });
        }
        _ => {}
    }
}

/// The push constants of `module`. After compaction to one entry point these are the ones that it uses.
#[must_use]
pub fn push_constants(module: &naga::Module) -> Option<PushConstants> {
    let layouter = layouter(module)?;
    let (_, global) = module.global_variables.iter().find(|(_, global)| global.space == AddressSpace::Immediate)?;
    Some(match layout_of(module, &layouter, global.ty) {
        Some(layout) => PushConstants::Struct(layout),
        None => PushConstants::Plain(layouter[global.ty].size),
    })
}

/// The layouts of all structs in uniform and storage buffers of `module`, and of all structs inside its push constants. Member structs come before
/// the structs that contain them.
#[must_use]
pub fn structs(module: &naga::Module) -> Vec<StructLayout> {
    let Some(layouter) = layouter(module) else { return Vec::new() };
    let mut shared = Vec::new();
    for (_, global) in module.global_variables.iter() {
        if let (AddressSpace::Immediate, TypeInner::Struct { members, .. }) =
            (global.space, &module.types[global.ty].inner)
        {
            members.iter().for_each(|member| collect(module, member.ty, &mut shared));
            continue;
        }
        if matches!(global.space, AddressSpace::Uniform | AddressSpace::Storage { .. }) {
            collect(module, global.ty, &mut shared);
        }
    }
    shared.into_iter().filter_map(|ty| layout_of(module, &layouter, ty)).collect()
}

fn layouter(module: &naga::Module) -> Option<Layouter> {
    let mut layouter = Layouter::default();
    // The module is valid, so every type has a layout.
    layouter.update(module.to_ctx()).ok().map(|()| layouter)
}

fn collect(module: &naga::Module, ty: naga::Handle<naga::Type>, out: &mut Vec<naga::Handle<naga::Type>>) {
    match &module.types[ty].inner {
        TypeInner::Array { base, .. } | TypeInner::BindingArray { base, .. } => collect(module, *base, out),
        TypeInner::Struct { members, .. } => {
            for member in members {
                collect(module, member.ty, out);
            }
            if !out.contains(&ty) {
                out.push(ty);
            }
        }
        _ => {}
    }
}

fn layout_of(module: &naga::Module, layouter: &Layouter, ty: naga::Handle<naga::Type>) -> Option<StructLayout> {
    let TypeInner::Struct { members, span } = &module.types[ty].inner else { return None };
    let name = source_name(module.types[ty].name.as_deref()?).to_owned();
    let mut size = *span;
    let mut layouts = Vec::new();
    for member in members {
        let mut stride = None;
        if let TypeInner::Array { size: elements, stride: bytes, .. } = module.types[member.ty].inner {
            stride = Some(bytes);
            if elements == naga::ArraySize::Dynamic {
                size = member.offset;
            }
        }
        layouts.push(MemberLayout { name: member.name.clone().unwrap_or_default(), offset: member.offset, stride });
    }
    Some(StructLayout { name, size, align: layouter[ty].alignment.round_up(1), members: layouts })
}
