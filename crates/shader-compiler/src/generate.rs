//! Compiled shaders as Rust source and one file of packed SPIR-V beside it, for a crate that defines the types named in it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;

use crate::emit::CompiledEntryPoint;
use crate::error::Error;
use crate::host::{HostConstant, host_interface};
use crate::number::Numbering;
use crate::pack::{Pool, pack};
use crate::parallel;
use crate::reflect::{Located, NumericType, PushConstants, ResourceKind, StructLayout};
use crate::shader::{CompiledShader, ScalarValue};

/// The file with all modules.
const SPIRV_FILE: &str = "shaders.zst";
/// The file to be included.
const RUST_FILE: &str = "shaders.rs";

/// The size of a program's shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Written {
    /// Different SPIR-V modules.
    pub modules: usize,
    /// The size of the modules, in bytes.
    pub bytes: usize,
    /// The size of the packed modules, in bytes.
    pub packed: usize,
}

/// Writes `shaders.rs`, for `include!`, and `shaders.zst`, which it embeds, into `directory`.
///
/// # Errors
/// A name that Rust cannot have, or a file that cannot be written.
pub fn write_rust(shaders: &[CompiledShader], directory: &Path) -> Result<Written, Error> {
    let mut pool = Pool::default();
    let mut modules = String::new();
    for (shader, entries) in shaders.iter().zip(parallel::map(shaders, || (), |(), shader| Entries::of(shader))) {
        let fault = |message| Error::in_file(&format!("{}.wgsl", shader.name), message);
        write_shader(&mut modules, shader, &entries.map_err(fault)?, &mut pool).map_err(fault)?;
    }
    let path = directory.join(SPIRV_FILE);
    let packed = pack(&pool).map_err(|error| Error::in_file(&path.display().to_string(), error.to_string()))?;
    let mut text = String::from("// Written by the shader compiler at build time.\n\n");
    text.push_str(&format!("/// All modules, packed.\nstatic SPIRV: &[u8] = include_bytes!(\"{SPIRV_FILE}\");\n\n"));
    let blocks = packed.blocks.len();
    text.push_str("/// Where each block of modules lies in that, and its words.\n");
    text.push_str(&format!("static BLOCKS: [Block; {blocks}] = [\n"));
    for block in &packed.blocks {
        let (range, words) = (&block.range, block.words);
        line(&mut text, format_args!("    Block::new({}, {}, {words}),\n", range.start, range.end));
    }
    text.push_str("];\n\n/// Every shader.\npub static ALL: &[Shader] = &[\n");
    for shader in shaders {
        let (name, interface) = (&shader.name, host_interface(shader));
        let fields = format!("name: \"{name}\", variants: {name}::VARIANTS, interface: {interface:?}");
        line(&mut text, format_args!("    Shader {{ {fields} }},\n"));
    }
    text.push_str("];\n");
    text.push_str(&modules);
    write_shared(&mut text, shaders).map_err(|message| Error::in_file("shared", message))?;
    write_whole(&path, &packed.bytes)?;
    write_whole(&directory.join(RUST_FILE), text.as_bytes())?;
    Ok(Written { modules: pool.modules(), bytes: pool.bytes(), packed: packed.bytes.len() })
}

/// Writes a file so that it is either the old one or the new one.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let partial = path.with_extension("partial");
    let written = std::fs::write(&partial, bytes).and_then(|()| std::fs::rename(&partial, path));
    written.map_err(|error| Error::in_file(&path.display().to_string(), format!("cannot be written: {error}")))
}

/// A shader's different entry points. Variants that differ in one stage only share the entry points of the other stages.
struct Entries<'a> {
    all: Vec<&'a CompiledEntryPoint>,
    /// The indices of each variant's entry points in [`Entries::all`].
    of_variants: Vec<Vec<usize>>,
    /// The module of each entry point, with ids that mean the same in all of them.
    modules: Vec<Vec<u32>>,
}

impl<'a> Entries<'a> {
    fn of(shader: &'a CompiledShader) -> Result<Self, String> {
        let mut all: Vec<&CompiledEntryPoint> = Vec::new();
        let mut place = |entry| {
            all.iter().position(|known| *known == entry).unwrap_or_else(|| {
                all.push(entry);
                all.len() - 1
            })
        };
        let of_variants = shader.variants.iter().map(|variant| variant.entry_points.iter().map(&mut place).collect());
        let of_variants = of_variants.collect();
        let mut numbering = Numbering::default();
        let modules = all.iter().map(|entry| numbering.renumber(&entry.spirv)).collect::<Option<_>>();
        let modules = modules.ok_or("its SPIR-V cannot be read")?;
        Ok(Self { all, of_variants, modules })
    }
}

fn write_shader(out: &mut String, shader: &CompiledShader, entries: &Entries, pool: &mut Pool) -> Result<(), String> {
    let name = module_name(&shader.name)?;
    line(out, format_args!("\n/// `{}.wgsl`.\npub mod {name} {{\n    use super::*;\n", shader.name));
    let flags: Vec<_> = shader.flags.iter().enumerate().map(|(bit, flag)| format!("{flag} = {bit}")).collect();
    line(out, format_args!("    flags!({});\n", flags.join(", ")));

    let mut variants = String::new();
    for (variant, own) in shader.variants.iter().zip(&entries.of_variants) {
        let own: Vec<_> = own.iter().map(|index| format!("&ENTRY_{index}")).collect();
        line(
            &mut variants,
            format_args!("        Variant {{ bits: {}, entry_points: &[{}] }},\n", variant.bits, own.join(", ")),
        );
    }
    for (index, (entry, module)) in entries.all.iter().zip(&entries.modules).enumerate() {
        write_entry(out, index, entry, module, pool);
    }
    line(
        out,
        format_args!(
            "    /// Every variant, ascending by its flags.\n    pub static VARIANTS: &[Variant] = &[\n{variants}    ];\n\n"
        ),
    );
    out.push_str("    /// The variant with exactly these flags, if the shader has it.\n");
    out.push_str("    pub fn variant(flags: Flags) -> Option<&'static Variant> {\n");
    line(out, format_args!("        find(\"{name}\", VARIANTS, flags.bits())\n    }}\n"));
    write_constants(out, shader);
    let own = shader.host_constants.iter().filter(|constant| constant.module.is_none());
    let own: Vec<_> = own.collect();
    if !own.is_empty() {
        out.push_str("\n    /// The constants that it shares with the program.\n");
        write_host(out, "host", own);
    }
    write_workgroup_size(out, shader);
    write_layouts(out, shader)?;
    out.push_str("}\n");
    Ok(())
}

/// Writes the constants for the host that modules declare, each once.
fn write_shared(out: &mut String, shaders: &[CompiledShader]) -> Result<(), String> {
    let mut modules: BTreeMap<&str, Vec<&HostConstant>> = BTreeMap::new();
    for constant in shaders.iter().flat_map(|shader| &shader.host_constants) {
        let Some(module) = &constant.module else { continue };
        let own = modules.entry(module).or_default();
        if !own.contains(&constant) {
            own.push(constant);
        }
    }
    out.push_str("\n/// The constants that the files of `shared/` share with the program.\npub mod shared {\n");
    for (module, constants) in modules {
        line(out, format_args!("    /// `shared/{module}.wgsl`.\n"));
        write_host(out, &module_name(module)?, constants);
    }
    out.push_str("}\n");
    Ok(())
}

fn write_host(out: &mut String, name: &str, constants: Vec<&HostConstant>) {
    line(out, format_args!("    pub mod {name} {{\n"));
    for HostConstant { name, value, .. } in constants {
        line(out, format_args!("        pub const {name}: {} = {};\n", value.type_name(), value.literal()));
    }
    out.push_str("    }\n");
}

/// Writes the size of work groups, if all variants have the same.
fn write_workgroup_size(out: &mut String, shader: &CompiledShader) {
    let entries = shader.variants.iter().flat_map(|variant| &variant.entry_points);
    let sizes: BTreeSet<_> = entries.map(|entry| entry.workgroup_size).collect();
    if let [size] = sizes.into_iter().collect::<Vec<_>>()[..]
        && size != [0; 3]
    {
        out.push_str("\n    /// Invocations in a work group of any variant.\n");
        line(out, format_args!("    pub const WORKGROUP_SIZE: [u32; 3] = {size:?};\n"));
    }
}

fn write_entry(out: &mut String, index: usize, entry: &CompiledEntryPoint, module: &[u32], pool: &mut Pool) {
    let push_constants = entry.push_constants.as_ref().map_or(0, PushConstants::size);
    line(out, format_args!("    static ENTRY_{index}: EntryPoint = EntryPoint {{\n"));
    line(out, format_args!("        name: c\"{}\",\n        stage: Stage::{:?},\n", entry.name, entry.stage));
    let place = pool.place(module);
    let (block, start, words) = (place.block, place.start, module.len());
    line(
        out,
        format_args!(
            "        spirv: Spirv::Packed {{ block: {block}, start: {start}, words: {words} }},\n        bindings: &[\n"
        ),
    );
    for binding in &entry.bindings {
        let kind = match binding.kind {
            ResourceKind::StorageBuffer { read_only } => format!("StorageBuffer {{ read_only: {read_only} }}"),
            ResourceKind::InputAttachment { index } => format!("InputAttachment {{ index: {index} }}"),
            plain => format!("{plain:?}"),
        };
        let (name, set, slot) = (&binding.name, binding.set, binding.binding);
        let (count, word) = (binding.count, binding.word);
        let fields = format!(
            "name: \"{name}\", set: {set}, binding: {slot}, kind: BindingKind::{kind}, count: {count}, word: {word}"
        );
        line(out, format_args!("            Binding {{ {fields} }},\n"));
    }
    out.push_str("        ],\n        vertex_inputs: &[\n");
    for input in &entry.vertex_inputs {
        let (name, location, format) = (&input.name, input.location, vertex_format(input));
        line(
            out,
            format_args!(
                "            VertexInput {{ name: \"{name}\", location: {location}, format: VertexFormat::{format} }},\n"
            ),
        );
    }
    out.push_str("        ],\n        fragment_outputs: &[\n");
    for output in &entry.fragment_outputs {
        let (name, location, kind, components) = (&output.name, output.location, output.kind, output.components);
        let fields =
            format!("name: \"{name}\", location: {location}, kind: NumberKind::{kind:?}, components: {components}");
        line(out, format_args!("            FragmentOutput {{ {fields} }},\n"));
    }
    line(
        out,
        format_args!(
            "        ],\n        push_constant_size: {push_constants},\n        workgroup_size: {:?},\n    }};\n",
            entry.workgroup_size
        ),
    );
}

fn vertex_format(input: &Located) -> String {
    let kind = match input.kind {
        NumericType::Float => "Float32",
        NumericType::Uint => "Uint32",
        NumericType::Sint => "Sint32",
    };
    match input.components {
        1 => kind.to_owned(),
        components => format!("{kind}x{components}"),
    }
}

fn write_constants(out: &mut String, shader: &CompiledShader) {
    out.push_str("\n    /// Ids of the specialization constants.\n    pub mod constants {\n");
    for constant in &shader.constants {
        line(out, format_args!("        pub const {}: u32 = {};\n", upper_snake(&constant.name), constant.id));
    }
    out.push_str("    }\n\n    /// The specialization constants with their types and defaults, by id.\n    pub static CONSTANTS: &[SpecConstant] = &[\n");
    for constant in &shader.constants {
        let value = match constant.default {
            ScalarValue::Bool(value) => format!("Bool({value})"),
            ScalarValue::U32(value) => format!("U32({value})"),
            ScalarValue::I32(value) => format!("I32({value})"),
            ScalarValue::F32(bits) => format!("F32(f32::from_bits({bits}))"),
        };
        let (name, id) = (&constant.name, constant.id);
        line(
            out,
            format_args!("        SpecConstant {{ name: \"{name}\", id: {id}, default: ConstantValue::{value} }},\n"),
        );
    }
    out.push_str("    ];\n");
}

fn write_layouts(out: &mut String, shader: &CompiledShader) -> Result<(), String> {
    match &shader.push_constants {
        Some(PushConstants::Struct(layout)) => {
            out.push_str("\n    /// The push constants: bytes, and where members lie.\n");
            write_layout(out, "push", layout, "    ")?;
        }
        Some(PushConstants::Plain(size)) => {
            out.push_str("\n    /// The push constants: bytes.\n");
            line(out, format_args!("    pub mod push {{\n        pub const SIZE: usize = {size};\n    }}\n"));
        }
        None => {}
    }
    out.push_str("\n    /// The structs in buffers: bytes, alignment, and where members lie.\n    pub mod structs {\n");
    let mut known: Vec<(String, &str)> = Vec::new();
    for layout in &shader.structs {
        let name = module_name(&lower_snake(&layout.name))?;
        if let Some((_, other)) = known.iter().find(|(taken, _)| *taken == name) {
            return Err(format!("the structs `{other}` and `{}` would both be the Rust module `{name}`", layout.name));
        }
        write_layout(out, &name, layout, "        ")?;
        known.push((name, &layout.name));
    }
    out.push_str("    }\n");
    Ok(())
}

fn write_layout(out: &mut String, name: &str, layout: &StructLayout, indent: &str) -> Result<(), String> {
    let mut constants = vec![("SIZE".to_owned(), layout.size), ("ALIGN".to_owned(), layout.align)];
    for member in &layout.members {
        let name = upper_snake(&member.name);
        constants.extend(member.stride.map(|stride| (format!("{name}_STRIDE"), stride)));
        constants.push((name, member.offset));
    }
    line(out, format_args!("{indent}pub mod {name} {{\n"));
    for (index, (constant, value)) in constants.iter().enumerate() {
        if constants[..index].iter().any(|(known, _)| known == constant) {
            return Err(format!(
                "the struct `{}` has a member whose constant {constant} is taken: rename it",
                layout.name
            ));
        }
        line(out, format_args!("{indent}    pub const {constant}: usize = {value};\n"));
    }
    line(out, format_args!("{indent}}}\n"));
    Ok(())
}

/// Writing to a string cannot fail.
fn line(out: &mut String, text: std::fmt::Arguments) {
    let _ = out.write_fmt(text);
}

/// A name that a Rust module can have.
fn module_name(name: &str) -> Result<String, String> {
    const KEYWORDS: &[&str] = &[
        "as", "async", "await", "box", "break", "const", "continue", "crate", "do", "dyn", "else", "enum", "extern",
        "false", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro", "match", "mod", "move", "mut", "pub",
        "ref", "return", "self", "static", "struct", "super", "trait", "true", "try", "type", "unsafe", "use",
        "virtual", "where", "while", "yield",
    ];
    let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(fits) && !KEYWORDS.contains(&name) {
        Ok(name.to_owned())
    } else {
        Err(format!("`{name}` cannot name a Rust module: use small letters, digits and `_`, and no keyword"))
    }
}

/// `PointLight` and `pointLight` as `point_light`.
fn lower_snake(name: &str) -> String {
    let mut out = String::new();
    let mut previous = '_';
    for character in name.chars() {
        if character.is_uppercase() && (previous.is_lowercase() || previous.is_ascii_digit()) {
            out.push('_');
        }
        out.extend(character.to_lowercase());
        previous = character;
    }
    out
}

/// `view_matrix` and `viewMatrix` as `VIEW_MATRIX`.
fn upper_snake(name: &str) -> String {
    // A name that is in capitals already, as an override's, stays.
    if name.chars().any(char::is_lowercase) { lower_snake(name).to_uppercase() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_change_case() {
        assert_eq!(lower_snake("PointLight"), "point_light");
        assert_eq!(upper_snake("viewMatrix"), "VIEW_MATRIX");
        assert_eq!(upper_snake("MAX_LIGHTS_2D"), "MAX_LIGHTS_2D");
        assert!(module_name("match").is_err() && module_name("2d").is_err() && module_name("gbuffer-debug").is_err());
    }
}
