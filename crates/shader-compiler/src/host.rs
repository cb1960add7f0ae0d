//! The interface that Rust is compiled against of a shader: flags, specialization constants, push constants, and the structs of its buffers.

use std::fmt::Write as _;

use crate::reflect::{PushConstants, StructLayout};
use crate::shader::{CompiledConstant, CompiledShader, OverrideValue};

/// The facts on which a program that was built with `shader` relies, one a line; bindings, inputs and outputs are told by its variants. A shader can
/// replace the program's own if each of its lines is among those that the program was built with.
#[must_use]
pub fn host_interface(shader: &CompiledShader) -> String {
    let mut text = String::new();
    for (bit, flag) in shader.flags.iter().enumerate() {
        let _ = writeln!(text, "flag {flag}: bit {bit}");
    }
    for CompiledConstant { name, id, default } in &shader.constants {
        let kind = match default {
            OverrideValue::Bool(_) => "bool",
            OverrideValue::U32(_) => "u32",
            OverrideValue::I32(_) => "i32",
            OverrideValue::F32(_) => "f32",
        };
        let _ = writeln!(text, "override {name}: {kind}, id {id}");
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
