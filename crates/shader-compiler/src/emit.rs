//! One composed variant: a SPIR-V module for each entry point, and its reflected interface.

use naga::back::spv;
use naga::compact::{KeepUnused, compact};
use naga::valid::{ModuleInfo, ValidationFlags, Validator};
use naga::{Expression, Literal, ShaderStage};

use crate::compose::{CAPABILITIES, Library, source_name};
use crate::error::Error;
use crate::host::HostConstant;
use crate::patch::{Constant, Patch, PatchError, SubpassInput};
use crate::reflect::{self, Located, PushConstants, ReflectedBinding, StructLayout};
use crate::source::{SUBPASS_PREFIX, Source};
use crate::{ScalarValue, SpecializationConstant};

/// A compiled entry point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompiledEntryPoint {
    /// The name.
    pub name: String,
    /// The stage.
    pub stage: StageKind,
    /// The SPIR-V 1.3 module, in the words' native order.
    pub spirv: Vec<u32>,
    /// The resources that it uses, by set and binding.
    pub bindings: Vec<ReflectedBinding>,
    /// Vertex attributes, by location; empty in other stages.
    pub vertex_inputs: Vec<Located>,
    /// Colours written, by location; empty in other stages.
    pub fragment_outputs: Vec<Located>,
    /// The push constants that it uses.
    pub push_constants: Option<PushConstants>,
    /// Invocations in a work group; zeros in other stages than compute.
    pub workgroup_size: [u32; 3],
}

/// A shader stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StageKind {
    /// `@vertex`
    Vertex,
    /// `@fragment`
    Fragment,
    /// `@compute`
    Compute,
}

/// The output of one variant.
pub struct Emitted {
    pub entry_points: Vec<CompiledEntryPoint>,
    pub structs: Vec<StructLayout>,
    pub push_constants: Option<PushConstants>,
    pub constants: Vec<SpecializationConstant>,
    pub host_constants: Vec<HostConstant>,
}

/// A shader, and the specialization constants that it and its imports can have.
pub struct SpirvEmitter<'a> {
    pub library: &'a Library,
    pub shader: &'a Source,
    pub constants: &'a [Constant],
    pub precise: bool,
}

impl SpirvEmitter<'_> {
    /// Compiles every entry point of `module`, a variant of the shader.
    ///
    /// # Errors
    /// An unsupported stage or subpass input, a construct that naga cannot write, or one that the patch refuses.
    pub fn emit(&self, module: &naga::Module) -> Result<Emitted, Error> {
        let mut split = Vec::new();
        for entry in &module.entry_points {
            let mut only = module.clone();
            only.entry_points = vec![entry.clone()];
            compact(&mut only, KeepUnused::No);
            split.push(only);
        }
        let patch =
            Patch { inputs: self.subpass_inputs(&split)?, constants: self.constants.to_vec(), precise: self.precise };
        let entry_points = split.iter().map(|only| self.entry_point(only, &patch)).collect::<Result<_, _>>()?;
        Ok(Emitted {
            entry_points,
            structs: reflect::structs(module),
            push_constants: reflect::push_constants(module),
            constants: self.spec_constants(module)?,
            host_constants: HostConstant::all_of(self.shader, module, "")?,
        })
    }

    /// The subpass inputs that some entry point uses, indexed in the order of their bindings, so that the indices have no gaps in
    /// any variant and agree between its entry points.
    fn subpass_inputs(&self, split: &[naga::Module]) -> Result<Vec<SubpassInput>, Error> {
        let mut inputs: Vec<SubpassInput> = Vec::new();
        for (module, (_, global)) in
            split.iter().flat_map(|module| module.global_variables.iter().map(move |global| (module, global)))
        {
            let name = source_name(global.name.as_deref().unwrap_or(""));
            let Some(place) = global.binding.filter(|_| name.starts_with(SUBPASS_PREFIX)) else { continue };
            let entry = &module.entry_points[0];
            if entry.stage != ShaderStage::Fragment {
                let message =
                    format!("the subpass input `{name}` is read by `{}`, which is no fragment shader", entry.name);
                return Err(self.at_variable(name, message));
            }
            if !is_subpass_type(&module.types[global.ty].inner) {
                let message = format!(
                    "the subpass input `{name}` must be a texture_2d, texture_multisampled_2d or texture_depth_2d"
                );
                return Err(self.at_variable(name, message));
            }
            if !inputs.iter().any(|input| (input.set, input.binding) == (place.group, place.binding)) {
                inputs.push(SubpassInput { name: name.to_owned(), set: place.group, binding: place.binding, index: 0 });
            }
        }
        inputs.sort_by_key(|input| (input.set, input.binding));
        for (index, input) in (0..).zip(&mut inputs) {
            input.index = index;
        }
        Ok(inputs)
    }

    /// `module` has one entry point.
    fn entry_point(&self, module: &naga::Module, patch: &Patch) -> Result<CompiledEntryPoint, Error> {
        let entry = &module.entry_points[0];
        let stage = match entry.stage {
            ShaderStage::Vertex => StageKind::Vertex,
            ShaderStage::Fragment => StageKind::Fragment,
            ShaderStage::Compute => StageKind::Compute,
            other => {
                return Err(Error::in_file(
                    &self.shader.path,
                    format!("`{}` is of the stage {other:?}, which is not supported", entry.name),
                ));
            }
        };
        let fail =
            |what: String| Error::in_file(&self.shader.path, format!("the entry point `{}`: {what}", entry.name));
        let info = Validator::new(ValidationFlags::all(), CAPABILITIES)
            .validate(module)
            .map_err(|error| fail(error.into_inner().to_string()))?;
        let words = write_spirv(module, &info).map_err(|error| fail(error.to_string()))?;
        let spirv = patch.apply(&words).map_err(|error| self.patch_error(error))?;
        let input_index = |set, binding| {
            patch.inputs.iter().find(|input| (input.set, input.binding) == (set, binding)).map(|input| input.index)
        };
        Ok(CompiledEntryPoint {
            name: entry.name.clone(),
            stage,
            bindings: reflect::bindings(module, &spirv, input_index),
            spirv,
            vertex_inputs: reflect::vertex_inputs(module, entry),
            fragment_outputs: reflect::fragment_outputs(module, entry),
            push_constants: reflect::push_constants(module),
            workgroup_size: entry.workgroup_size,
        })
    }

    /// The types and defaults of the overrides that this variant has.
    fn spec_constants(&self, module: &naga::Module) -> Result<Vec<SpecializationConstant>, Error> {
        let mut found = Vec::new();
        for (_, global) in module.global_variables.iter() {
            let constant = self.constants.iter().find(|constant| Some(&constant.symbol) == global.name.as_ref());
            let Some(constant) = constant.filter(|_| global.space == naga::AddressSpace::Private) else { continue };
            let value = global.init.and_then(|init| scalar_value(module, global.ty, init)).ok_or_else(|| {
                let message =
                    format!("the override `{}` must be a bool, u32, i32 or f32 with a constant default", constant.name);
                self.at_variable(&constant.name, message)
            })?;
            found.push(SpecializationConstant { name: constant.name.clone(), id: constant.id, default: value });
        }
        Ok(found)
    }

    fn patch_error(&self, error: PatchError) -> Error {
        self.at_variable(&error.variable, error.message)
    }

    /// An error at the declaration of an override or a subpass input.
    fn at_variable(&self, name: &str, message: String) -> Error {
        let place = self.library.closure(self.shader).into_iter().rev().find_map(|source| {
            let input = source.subpass_inputs.iter().find(|(input, _)| input == name).map(|(_, place)| place);
            input.or_else(|| {
                source.overrides.iter().find(|declared| declared.name == name).map(|declared| &declared.location)
            })
        });
        match place {
            Some(place) => Error::at(place.clone(), message),
            None => Error::in_file(&self.shader.path, message),
        }
    }
}

fn is_subpass_type(inner: &naga::TypeInner) -> bool {
    use naga::{ImageClass, ImageDimension, TypeInner};
    let TypeInner::Image { dim: ImageDimension::D2, arrayed: false, class } = inner else { return false };
    matches!(class, ImageClass::Sampled { .. } | ImageClass::Depth { .. })
}

/// The value of a constant expression, if it is of a type that [`ScalarValue`] has.
pub fn scalar_value(
    module: &naga::Module,
    ty: naga::Handle<naga::Type>,
    init: naga::Handle<Expression>,
) -> Option<ScalarValue> {
    let naga::TypeInner::Scalar(scalar) = module.types[ty].inner else { return None };
    match module.global_expressions[init] {
        Expression::Literal(Literal::Bool(value)) => Some(ScalarValue::Bool(value)),
        Expression::Literal(Literal::U32(value)) => Some(ScalarValue::U32(value)),
        Expression::Literal(Literal::I32(value)) => Some(ScalarValue::I32(value)),
        Expression::Literal(Literal::F32(value)) => Some(ScalarValue::F32(value.to_bits())),
        Expression::ZeroValue(_) => match scalar {
            naga::Scalar::BOOL => Some(ScalarValue::Bool(false)),
            naga::Scalar::U32 => Some(ScalarValue::U32(0)),
            naga::Scalar::I32 => Some(ScalarValue::I32(0)),
            naga::Scalar::F32 => Some(ScalarValue::F32(0)),
            _ => None,
        },
        Expression::Constant(constant) => scalar_value(module, ty, module.constants[constant].init),
        _ => None,
    }
}

fn write_spirv(module: &naga::Module, info: &ModuleInfo) -> Result<Vec<u32>, spv::Error> {
    let entry = &module.entry_points[0];
    let bindings = module.global_variables.iter().filter_map(|(_, global)| global.binding);
    let options = spv::Options {
        // Vulkan 1.1 takes 1.3.
        lang_version: (1, 3),
        // The names are needed by the patch and by debuggers. No coordinate is flipped and no depth clamped behind the source's back.
        flags: spv::WriterFlags::DEBUG | spv::WriterFlags::LABEL_VARYINGS,
        fake_missing_bindings: false,
        binding_map: bindings
            .map(|place| {
                (
                    place,
                    spv::BindingInfo { descriptor_set: place.group, binding: place.binding, binding_array_size: None },
                )
            })
            .collect(),
        // A counter in every loop costs time; our loops end.
        force_loop_bounding: false,
        // naga would have one invocation zero the whole memory of a work group while the others wait. Our shaders read only memory that they have
        // written.
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        // No divisor of ours is zero.
        emit_int_div_checks: false,
        ..spv::Options::default()
    };
    let pipeline = spv::PipelineOptions { shader_stage: entry.stage, entry_point: entry.name.clone() };
    spv::write_vec(module, info, &options, Some(&pipeline))
}
