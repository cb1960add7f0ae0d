//! The part of a shader's interface that Rust code is compiled against: flags, constants, push constants, and the structs of its buffers.

use std::fmt::Write as _;

use crate::compose::{Composing, Library};
use crate::emit::scalar_value;
use crate::error::Error;
use crate::reflect::{PushConstants, StructLayout};
use crate::shader::{CompiledShader, ScalarValue, SpecializationConstant};
use crate::source::{HostDeclaration, Source};

/// A constant that a WGSL file marks for the host: `const NAME: T = value; // host`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostConstant {
    /// The shared file that declares it, without `.wgsl`; `None` if the shader does.
    pub module: Option<String>,
    /// The name in the source.
    pub name: String,
    /// The value, with its type.
    pub value: ScalarValue,
}

impl HostConstant {
    /// Returns the constants of `source`, as `module` has them, whose names begin there with `prefix`.
    ///
    /// # Errors
    /// Fails for a constant that is no [`ScalarValue`].
    pub fn all_of(source: &Source, module: &naga::Module, prefix: &str) -> Result<Vec<Self>, Error> {
        let shared = source.import_path.is_some().then(|| source.stem().to_owned());
        let mut found = Vec::new();
        for HostDeclaration { name, conditional, location } in &source.host_constants {
            let is_own = |constant: &&naga::Constant| {
                constant.name.as_deref().and_then(|own| own.strip_prefix(prefix)) == Some(name)
            };
            let own = module.constants.iter().map(|(_, constant)| constant).find(is_own);
            match own.map(|own| scalar_value(module, own.ty, own.init)) {
                Some(Some(value)) => found.push(Self { module: shared.clone(), name: name.clone(), value }),
                None if *conditional => {}
                _ => {
                    let message = format!("`{name}` is for the host, so it must be a bool, u32, i32 or f32");
                    return Err(Error::at(location.clone(), message));
                }
            }
        }
        Ok(found)
    }
}

/// Returns the constants for the host of each module of `library`, in its order. Flags are off in them.
///
/// # Errors
/// A fault in a module with such constants, or a constant that is no scalar.
pub fn shared_constants(library: &Library) -> Result<Vec<Vec<HostConstant>>, Error> {
    // naga_oil composes whole shaders only, without the constants that they do not name.
    const PREFIX: &str = "host_";
    let mut composing = None;
    let of_module = |module: &Source| {
        let Some(path) = module.import_path.as_ref().filter(|_| !module.host_constants.is_empty()) else {
            return Ok(Vec::new());
        };
        let mut text = format!("#import {path}\n");
        for HostDeclaration { name, .. } in &module.host_constants {
            let _ = writeln!(text, "const {PREFIX}{name} = {path}::{name};");
        }
        let composing = match &mut composing {
            Some(composing) => composing,
            none => none.insert(Composing::new(library)?),
        };
        let composed = composing.compose(&Source::new(&module.path, &text)?, &[])?;
        HostConstant::all_of(module, &composed, PREFIX)
    };
    library.modules.iter().map(of_module).collect()
}

/// Lists the facts that a program built with `shader` relies on, one a line. The variants' bindings, inputs and outputs are not listed. A shader can
/// replace the program's own if each of its lines is among the lines that the program was built with.
#[must_use]
pub fn host_interface(shader: &CompiledShader) -> String {
    let mut text = String::new();
    for (bit, flag) in shader.flags.iter().enumerate() {
        let _ = writeln!(text, "flag {flag}: bit {bit}");
    }
    for SpecializationConstant { name, id, default } in &shader.constants {
        let _ = writeln!(text, "override {name}: {}, id {id}", default.type_name());
    }
    for HostConstant { module, name, value } in &shader.host_constants {
        let module = module.as_ref().map_or(String::new(), |module| format!("{module}::"));
        let _ = writeln!(text, "constant {module}{name}: {} = {}", value.type_name(), value.literal());
    }
    match &shader.push_constants {
        Some(PushConstants::Struct(layout)) => text += &layout_line("push constants", layout),
        Some(PushConstants::Plain(size)) => _ = writeln!(text, "push constants: {size} bytes"),
        None => {}
    }
    for layout in &shader.structs {
        text += &layout_line("struct", layout);
    }
    text
}

fn layout_line(what: &str, layout: &StructLayout) -> String {
    let mut line = format!("{what} {}: {} bytes, aligned to {}", layout.name, layout.size, layout.align);
    for member in &layout.members {
        let _ = write!(line, ", {} at {}", member.name, member.offset);
        if let Some(stride) = member.stride {
            let _ = write!(line, " every {stride}");
        }
    }
    line + "\n"
}
