//! A shader with all its variants, and the parts that must be the same in all of them.

use crate::compose::{Composing, Library, check_imports, composed_name};
use crate::emit::{CompiledEntryPoint, Emitted, SpirvEmitter};
use crate::error::Error;
use crate::host::HostConstant;
use crate::patch::Constant;
use crate::reflect::{PushConstants, StructLayout};
use crate::source::Source;
use crate::variants::Head;

/// A compiled shader.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompiledShader {
    /// The file's name without `.wgsl`.
    pub name: String,
    /// The flags; bit `i` of a variant's number is flag `i`.
    pub flags: Vec<String>,
    /// The variants, ascending.
    pub variants: Vec<CompiledVariant>,
    /// The numbers of variants that the file states.
    pub counts: Option<String>,
    /// The specialization constants of all variants, by id.
    pub constants: Vec<SpecializationConstant>,
    /// The structs of the buffers, in all variants, sorted by name.
    pub structs: Vec<StructLayout>,
    /// The push constants.
    pub push_constants: Option<PushConstants>,
    /// The constants that it and its imports mark for the host.
    pub host_constants: Vec<HostConstant>,
}

/// A shader with certain flags on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompiledVariant {
    /// The flags, a bit each.
    pub bits: u32,
    /// The entry points in the order of the source.
    pub entry_points: Vec<CompiledEntryPoint>,
}

/// A specialization constant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpecializationConstant {
    /// The name in the source.
    pub name: String,
    /// SpecId.
    pub id: u32,
    /// The value if the pipeline sets none, with its type.
    pub default: ScalarValue,
}

/// The value of a constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScalarValue {
    /// `bool`; four bytes for Vulkan.
    Bool(bool),
    /// `u32`
    U32(u32),
    /// `i32`
    I32(i32),
    /// `f32`, as its bits.
    F32(u32),
}

impl ScalarValue {
    /// The name of the type in WGSL and in Rust.
    #[must_use]
    pub fn type_name(self) -> &'static str {
        match self {
            Self::Bool(_) => "bool",
            Self::U32(_) => "u32",
            Self::I32(_) => "i32",
            Self::F32(_) => "f32",
        }
    }

    /// The value as Rust writes it.
    #[must_use]
    pub fn literal(self) -> String {
        match self {
            Self::Bool(value) => value.to_string(),
            Self::U32(value) => value.to_string(),
            Self::I32(value) => value.to_string(),
            Self::F32(bits) => format!("{:?}", f32::from_bits(bits)),
        }
    }
}

/// The parts of a shader that are to be compiled.
pub struct Plan {
    source: Source,
    pub name: String,
    head: Head,
    pub combinations: Vec<u32>,
    constants: Vec<Constant>,
    /// The constants that imported modules mark for the host.
    imported: Vec<HostConstant>,
}

impl Plan {
    /// Reads the shader `text`, the content of the file `path`. `shared` has the constants for the host of each module of the library.
    ///
    /// # Errors
    /// A fault in its name, head, imports, flags, overrides or subpass inputs.
    pub fn new(path: &str, text: &str, library: &Library, shared: &[Vec<HostConstant>]) -> Result<Self, Error> {
        let source = Source::new(path, text)?;
        check_imports(&source, &library.modules)?;
        let head = Head::parse(path, &source.text)?;
        check_conditions(&source, &head)?;
        let files = library.closure(&source);
        let constants = assign_ids(&files)?;
        let is_in = |module: &Source| files.iter().any(|file| std::ptr::eq(*file, module));
        let imported = library.modules.iter().zip(shared).filter(|(module, _)| is_in(module));
        let imported = imported.flat_map(|(_, own)| own.iter().cloned()).collect();
        let name = source.stem().to_owned();
        Ok(Self { name, combinations: head.combinations(), head, constants, imported, source })
    }

    /// Compiles the variant `bits`.
    ///
    /// # Errors
    /// A fault in it, with a note that names the flags.
    pub fn compile(&self, composing: &mut Composing, library: &Library, bits: u32) -> Result<Emitted, Error> {
        let flags: Vec<_> = self.head.names(bits).collect();
        let emitter =
            SpirvEmitter { library, shader: &self.source, constants: &self.constants, precise: self.head.precise };
        let result = composing.compose(&self.source, &flags).and_then(|module| emitter.emit(&module));
        result.map_err(|error| {
            if flags.is_empty() { error } else { error.note(format!("in the variant {}", flags.join(" | "))) }
        })
    }
}

/// Points at a condition on a name that is no flag of the shader: a misspelt one would be off in silence.
fn check_conditions(source: &Source, head: &Head) -> Result<(), Error> {
    let clean = crate::scan::without_comments(&source.text);
    let (mut start, mut defined) = (0, Vec::new());
    for line in clean.split_inclusive('\n') {
        let begin = start;
        start += line.len();
        let Some(directive) = line.trim_start().strip_prefix('#') else { continue };
        let mut words = directive.split_whitespace().skip_while(|word| *word == "else");
        let (keyword, Some(name)) = (words.next().unwrap_or(""), words.next()) else { continue };
        match keyword {
            "define" => defined.push(name),
            "ifdef" | "ifndef" | "if" if !head.flags.iter().any(|flag| flag == name) && !defined.contains(&name) => {
                let at = begin + line.find(name).unwrap_or(0);
                let place = crate::error::SourceSpan::of(&source.path, &source.text, at, name.len());
                return Err(Error::at(
                    place,
                    format!("no `// variants:` line in this shader's head declares `{name}`"),
                ));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Gives every override of `files` an id: its own, or the first that is free, in the order of declaration.
fn assign_ids(files: &[&Source]) -> Result<Vec<Constant>, Error> {
    let declared: Vec<_> =
        files.iter().flat_map(|file| file.overrides.iter().map(move |declaration| (*file, declaration))).collect();
    let mut taken: Vec<(u32, String)> = Vec::new();
    for (file, declaration) in &declared {
        let Some(id) = declaration.id else { continue };
        let symbol = composed_name(file, &declaration.name);
        if taken.iter().any(|(other, owner)| *other == id && *owner != symbol) {
            return Err(Error::at(
                declaration.location.clone(),
                format!("the id {id} of the override `{}` is taken", declaration.name),
            ));
        }
        taken.push((id, symbol));
    }
    let mut constants: Vec<Constant> = Vec::new();
    for (file, declaration) in declared {
        let (name, symbol) = (declaration.name.clone(), composed_name(file, &declaration.name));
        if let Some(known) = constants.iter().find(|known| known.name == name) {
            // Equal declarations under `#ifdef` and under its `#else` are one constant.
            if known.symbol == symbol && declaration.id.is_none_or(|id| id == known.id) {
                continue;
            }
            return Err(Error::at(
                declaration.location.clone(),
                format!("another override is named `{name}` too, or has another id here"),
            ));
        }
        let explicit = taken.iter().find(|(_, owner)| *owner == symbol).map(|(id, _)| *id);
        let free = || (0..).find(|id| !taken.iter().any(|(other, _)| other == id)).unwrap_or(u32::MAX);
        let id = explicit.unwrap_or_else(free);
        taken.push((id, symbol.clone()));
        constants.push(Constant { name, symbol, id });
    }
    Ok(constants)
}

/// Puts the variants of a shader together.
///
/// # Errors
/// A struct, the push constants, an override's default or a constant for the host that differ between variants: the host has one of each.
pub fn merge(plan: &Plan, emitted: Vec<Emitted>) -> Result<CompiledShader, Vec<Error>> {
    let mut shader = CompiledShader {
        name: plan.name.clone(),
        flags: plan.head.flags.clone(),
        variants: Vec::new(),
        counts: plan.head.counts.clone(),
        constants: Vec::new(),
        structs: Vec::new(),
        push_constants: None,
        host_constants: plan.imported.clone(),
    };
    let differs = |what: String| {
        vec![Error::in_file(&plan.source.path, format!("{what} differs between variants, or between two files"))]
    };
    for (bits, variant) in plan.combinations.iter().zip(emitted) {
        for layout in variant.structs {
            match shader.structs.iter().find(|known| known.name == layout.name) {
                Some(known) if *known != layout => {
                    return Err(differs(format!("the layout of the struct `{}`", layout.name)));
                }
                Some(_) => {}
                None => shader.structs.push(layout),
            }
        }
        for constant in variant.constants {
            match shader.constants.iter().find(|known| known.id == constant.id) {
                Some(known) if *known != constant => {
                    return Err(differs(format!("the default or type of the override `{}`", constant.name)));
                }
                Some(_) => {}
                None => shader.constants.push(constant),
            }
        }
        for constant in variant.host_constants {
            match shader.host_constants.iter().find(|known| (&known.module, &known.name) == (&None, &constant.name)) {
                Some(known) if *known != constant => {
                    return Err(differs(format!("the constant `{}`, which is for the host,", constant.name)));
                }
                Some(_) => {}
                None => shader.host_constants.push(constant),
            }
        }
        match (&shader.push_constants, variant.push_constants) {
            (Some(known), Some(other)) if *known != other => {
                return Err(differs("the layout of the push constants".to_owned()));
            }
            (None, other) => shader.push_constants = other,
            _ => {}
        }
        shader.variants.push(CompiledVariant { bits: *bits, entry_points: variant.entry_points });
    }
    shader.structs.sort_by(|a, b| a.name.cmp(&b.name));
    shader.constants.sort_by_key(|constant| constant.id);
    Ok(shader)
}
