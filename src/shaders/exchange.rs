//! Shaders that are compiled while the program runs, and replace the built-in ones.
//!
//! A pass asks for a variant when its pipelines are made, and gets the newest one. The interface that Rust was compiled against must not change:
//! flags, constants and layouts of structs, and each variant's entry points with their inputs and outputs. A new variant may take fewer inputs.
//! Compiled variants are kept until the program ends, because pipelines in creation may hold them.

use std::collections::{HashMap, HashSet};
use std::ffi::CString;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use afterlight_shader_compiler as compiler;

use super::{
    ALL, Binding, BindingKind, EntryPoint, FragmentOutput, NumberKind, Shader, Spirv, Stage, Variant, VertexFormat,
    VertexInput,
};

/// The key of a variant: its shader, and its flags as bits.
type VariantKey = (&'static str, u32);

/// Compiled variants that replace built-in ones.
#[derive(Clone, Default)]
pub struct Replacements(HashMap<VariantKey, &'static Variant>);

/// The variants in use, and the variants that passes have asked for.
#[derive(Default)]
struct ExchangeState {
    asked: HashSet<VariantKey>,
    replacements: Replacements,
}

fn state() -> MutexGuard<'static, Option<ExchangeState>> {
    static STATE: Mutex<Option<ExchangeState>> = Mutex::new(None);
    // No invariant spans two of its fields.
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the variant that replaces one of the build, or that one, and notes that it was asked for.
pub(super) fn current(shader: &'static str, built: &'static Variant) -> &'static Variant {
    let key = (shader, built.bits);
    state().get_or_insert_default().asked.insert(key);
    replaced(key).unwrap_or(built)
}

fn replaced(key: VariantKey) -> Option<&'static Variant> {
    state().as_ref()?.replacements.0.get(&key).copied()
}

/// Installs variants for all pipelines that are made from now on, and returns the previous replacements.
pub fn exchange(replacements: Replacements) -> Replacements {
    std::mem::replace(&mut state().get_or_insert_default().replacements, replacements)
}

/// The number of variants that passes have asked for so far.
pub fn asked() -> usize {
    state().as_ref().map_or(0, |state| state.asked.len())
}

impl Replacements {
    /// Returns true if some pass has asked for a variant that is not among these.
    #[must_use]
    pub fn lack(&self) -> bool {
        state().as_ref().is_some_and(|state| state.asked.iter().any(|key| !self.0.contains_key(key)))
    }

    /// The shaders of which a variant differs from the one in its place now, by name.
    #[must_use]
    pub fn changes(&self) -> Vec<&'static str> {
        let differs = |name: &'static str, built: &'static Variant| {
            let key = (name, built.bits);
            self.0.get(&key).is_some_and(|new| words(new) != words(replaced(key).unwrap_or(built)))
        };
        let has_changed = |shader: &&Shader| shader.variants.iter().any(|built| differs(shader.name, built));
        ALL.iter().filter(has_changed).map(|shader| shader.name).collect()
    }
}

fn words(variant: &Variant) -> Vec<&'static [u32]> {
    variant.entry_points.iter().map(|entry| entry.spirv.words()).collect()
}

/// Compiles the variants that some pass has asked for so far, from the sources in `directory`.
///
/// # Errors
/// All that is wrong with the sources, with places and carets; or a change for which Rust would have to be built anew.
pub fn compile(directory: &Path) -> Result<Replacements, String> {
    let asked: HashSet<VariantKey> = state().as_ref().map(|state| state.asked.clone()).unwrap_or_default();
    let compiled =
        compiler::compile_variants(directory, &|name, bits| asked.contains(&(name, bits))).map_err(|errors| {
            let errors: Vec<String> = errors.iter().map(ToString::to_string).collect();
            errors.join("\n\n")
        })?;
    let mut new = HashMap::new();
    for shader in ALL {
        for built in shader.variants.iter().filter(|built| asked.contains(&(shader.name, built.bits))) {
            let found = compiled.iter().find(|own| own.name == shader.name);
            let found = found.and_then(|own| Some((own, own.variants.iter().find(|own| own.bits == built.bits)?)));
            let Some((own, variant)) = found else {
                return Err(stale(shader, format!("it has no variant with the flags {:#b}", built.bits)));
            };
            check_interface(shader, own)?;
            new.insert((shader.name, built.bits), replacement(shader, built, variant)?);
        }
    }
    Ok(Replacements(new))
}

/// Returns the error for a shader that cannot be exchanged while the program runs.
fn stale(shader: &Shader, what: String) -> String {
    format!("error: {what}\n --> {}.wgsl\n = the program has to be built anew for that", shader.name)
}

fn check_interface(shader: &Shader, own: &compiler::CompiledShader) -> Result<(), String> {
    let interface = compiler::host_interface(own);
    match interface.lines().find(|line| !shader.interface.lines().any(|built| built == *line)) {
        Some(line) => Err(stale(shader, format!("the program was not built with this: {line}"))),
        None => Ok(()),
    }
}

fn replacement(
    shader: &Shader,
    built: &'static Variant,
    own: &compiler::CompiledVariant,
) -> Result<&'static Variant, String> {
    // A known variant is not kept twice. The build has given its ids other numbers.
    let same = |known: &&Variant| {
        let mut pairs = known.entry_points.iter().zip(&own.entry_points);
        known.entry_points.len() == own.entry_points.len()
            && pairs.all(|(known, own)| compiler::same_but_for_ids(known.spirv.words(), &own.spirv))
    };
    if let Some(known) = replaced((shader.name, built.bits)).into_iter().chain([built]).find(same) {
        return Ok(known);
    }
    let entries: Vec<EntryPoint> = own.entry_points.iter().map(entry_point).collect::<Option<_>>().unwrap_or_default();
    let fits = |new: &EntryPoint| built.entry_points.iter().any(|old| takes_and_gives(new, old));
    if entries.len() != built.entry_points.len() || !entries.iter().all(fits) {
        let what = "entry points, bindings, inputs or outputs are not those that the program was built with";
        return Err(stale(shader, what.to_owned()));
    }
    let new =
        Variant { bits: own.bits, entry_points: kept(entries.into_iter().map(|entry| &*Box::leak(Box::new(entry)))) };
    Ok(Box::leak(Box::new(new)))
}

/// Returns true if a new entry point can stand where an old one stands.
fn takes_and_gives(new: &EntryPoint, old: &EntryPoint) -> bool {
    let known = |binding: &Binding| {
        let place = |own: &Binding| (own.set, own.binding, own.kind, own.count);
        old.bindings.iter().any(|own| place(own) == place(binding))
    };
    let gives = |entry: &EntryPoint| {
        let give = |output: &FragmentOutput| (output.location, output.kind, output.components);
        entry.fragment_outputs.iter().map(give).collect::<Vec<_>>()
    };
    (new.name, new.stage, new.workgroup_size) == (old.name, old.stage, old.workgroup_size)
        && new.push_constant_size <= old.push_constant_size
        && new.bindings.iter().all(known)
        && new.vertex_inputs.iter().all(|input| {
            old.vertex_inputs.iter().any(|own| (own.location, own.format) == (input.location, input.format))
        })
        && gives(new) == gives(old)
}

/// In the types that generated shaders have; `None` for a vertex attribute of more than four components.
fn entry_point(own: &compiler::CompiledEntryPoint) -> Option<EntryPoint> {
    let vertex_inputs: Option<Vec<VertexInput>> = own
        .vertex_inputs
        .iter()
        .map(|input| {
            let format = vertex_format(kind(input.kind), input.components)?;
            Some(VertexInput { name: text(&input.name), location: input.location, format })
        })
        .collect();
    let outputs = own.fragment_outputs.iter().map(|output| FragmentOutput {
        name: text(&output.name),
        location: output.location,
        kind: kind(output.kind),
        components: output.components,
    });
    Some(EntryPoint {
        name: Box::leak(CString::new(own.name.as_str()).ok()?.into_boxed_c_str()),
        stage: match own.stage {
            compiler::StageKind::Vertex => Stage::Vertex,
            compiler::StageKind::Fragment => Stage::Fragment,
            compiler::StageKind::Compute => Stage::Compute,
        },
        spirv: Spirv::Plain(kept(own.spirv.iter().copied())),
        bindings: kept(own.bindings.iter().map(binding)),
        vertex_inputs: kept(vertex_inputs?),
        fragment_outputs: kept(outputs),
        push_constant_size: own.push_constants.as_ref().map_or(0, compiler::reflect::PushConstants::size),
        workgroup_size: own.workgroup_size,
    })
}

fn binding(own: &compiler::reflect::ReflectedBinding) -> Binding {
    use compiler::reflect::ResourceKind as Own;
    let kind = match own.kind {
        Own::UniformBuffer => BindingKind::UniformBuffer,
        Own::StorageBuffer { read_only } => BindingKind::StorageBuffer { read_only },
        Own::SampledImage => BindingKind::SampledImage,
        Own::Sampler => BindingKind::Sampler,
        Own::ComparisonSampler => BindingKind::ComparisonSampler,
        Own::InputAttachment { index } => BindingKind::InputAttachment { index },
        Own::StorageImage => BindingKind::StorageImage,
    };
    let name = text(&own.name);
    Binding { name, set: own.set, binding: own.binding, kind, count: own.count, word: own.word }
}

fn kind(own: compiler::reflect::NumericType) -> NumberKind {
    match own {
        compiler::reflect::NumericType::Float => NumberKind::Float,
        compiler::reflect::NumericType::Uint => NumberKind::Uint,
        compiler::reflect::NumericType::Sint => NumberKind::Sint,
    }
}

fn vertex_format(kind: NumberKind, components: u32) -> Option<VertexFormat> {
    use VertexFormat as F;
    let [one, two, three, four] = match kind {
        NumberKind::Float => [F::Float32, F::Float32x2, F::Float32x3, F::Float32x4],
        NumberKind::Uint => [F::Uint32, F::Uint32x2, F::Uint32x3, F::Uint32x4],
        NumberKind::Sint => [F::Sint32, F::Sint32x2, F::Sint32x3, F::Sint32x4],
    };
    match components {
        1 => Some(one),
        2 => Some(two),
        3 => Some(three),
        4 => Some(four),
        _ => None,
    }
}

fn kept<T>(all: impl IntoIterator<Item = T>) -> &'static [T] {
    Box::leak(all.into_iter().collect::<Vec<T>>().into_boxed_slice())
}

fn text(own: &str) -> &'static str {
    Box::leak(own.to_owned().into_boxed_str())
}
