//! Shared by the tests: compiling a text, looking into SPIR-V, and running spirv-val.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use afterlight_shader_compiler::{CompiledEntryPoint, CompiledShader, Error, compile_source};
use rspirv::dr::{Instruction, Module};
use rspirv::spirv::Op;

pub fn compile(text: &str) -> CompiledShader {
    compile_with(text, &[])
}

pub fn compile_with(text: &str, shared: &[(&str, &str)]) -> CompiledShader {
    compile_source(("demo.wgsl", text), shared).unwrap_or_else(|errors| panic!("{}", errors[0]))
}

pub fn error(text: &str) -> Error {
    error_with(text, &[])
}

pub fn error_with(text: &str, shared: &[(&str, &str)]) -> Error {
    let mut errors = compile_source(("demo.wgsl", text), shared).expect_err("must fail");
    assert_eq!(errors.len(), 1, "{errors:#?}");
    errors.remove(0)
}

pub fn only(shader: &CompiledShader) -> &CompiledEntryPoint {
    assert_eq!((shader.variants.len(), shader.variants[0].entry_points.len()), (1, 1));
    &shader.variants[0].entry_points[0]
}

pub fn module(entry: &CompiledEntryPoint) -> Module {
    rspirv::dr::load_words(&entry.spirv).expect("a SPIR-V module")
}

pub fn all(module: &Module, opcode: Op) -> Vec<&Instruction> {
    module.all_inst_iter().filter(|instruction| instruction.class.opcode == opcode).collect()
}

/// Validates against Vulkan 1.1, by the system's spirv-val and by the newest one that `scripts/fetch-newest` has unpacked; where neither is there it says
/// so and passes.
pub fn validate(entry: &CompiledEntryPoint) {
    let bytes: Vec<u8> = entry.spirv.iter().flat_map(|word| word.to_ne_bytes()).collect();
    let mut validators = vec![Command::new("spirv-val")];
    validators.extend(newest());
    for mut validator in validators {
        validator.args(["--target-env", "vulkan1.1", "-"]).stdin(Stdio::piped()).stderr(Stdio::piped());
        let mut child = match validator.spawn() {
            Ok(child) => child,
            Err(error) => {
                eprintln!("spirv-val cannot be run ({error}): {} is not validated", entry.name);
                continue;
            }
        };
        child.stdin.take().expect("piped").write_all(&bytes).expect("spirv-val reads");
        let output = child.wait_with_output().expect("spirv-val ends");
        assert!(output.status.success(), "{}: {}", entry.name, String::from_utf8_lossy(&output.stderr));
    }
}

/// The newest spirv-val, if `scripts/fetch-newest` has fetched it.
fn newest() -> Option<Command> {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2)?;
    let cache = std::env::var_os("AFTERLIGHT_CACHE").map_or_else(|| project.join(".cache"), PathBuf::from);
    let mut command = Command::new(project.join("scripts/on-newest"));
    command.arg("spirv-val");
    cache.join("newest/packages.txt").exists().then_some(command)
}
