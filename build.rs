//! Compiles `shaders/` into the file that `src/shaders.rs` includes, and reports a shader with more variants than before.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use afterlight_shader_compiler::{
    CompiledShader, Error, compile_directory, count_variants, variants_growth, write_rust,
};

/// The most different SPIR-V modules that the program may hold. A new flag can double a shader's: then ask whether a specialization constant
/// does as well, or whether `requires:` and `excludes:` rule variants out.
const MOST_MODULES: usize = 1550;

fn main() -> ExitCode {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build.rs");
    let Some(out) = std::env::var_os("OUT_DIR").map(PathBuf::from) else {
        eprintln!("error: OUT_DIR is not set: this is cargo's build script");
        return ExitCode::FAILURE;
    };
    match build(&out) {
        Ok(()) => ExitCode::SUCCESS,
        Err(errors) => {
            for error in errors {
                eprintln!("{error}\n");
            }
            ExitCode::FAILURE
        }
    }
}

fn build(out: &Path) -> Result<(), Vec<Error>> {
    let shaders = compile_directory(Path::new("shaders"))?;
    let grown = tell_growth(&shaders);
    let written = write_rust(&shaders, out).map_err(|error| vec![error])?;
    if written.modules > MOST_MODULES {
        let (modules, grown) = (written.modules, grown.join("; "));
        let message = format!("{modules} SPIR-V modules are more than the {MOST_MODULES} of build.rs: {grown}");
        return Err(vec![Error::in_file("shaders", message)]);
    }
    Ok(())
}

/// Warns of each shader whose line `// counts:` does not state its numbers of variants, and returns how they have grown.
fn tell_growth(shaders: &[CompiledShader]) -> Vec<String> {
    let mut all = Vec::new();
    for shader in shaders {
        let Some(grown) = variants_growth(shader) else { continue };
        let (name, counts) = (&shader.name, count_variants(shader));
        println!("cargo::warning=variants of {name}: {grown}");
        println!(
            "cargo::warning=once that is as it should be, write in the head of shaders/{name}.wgsl: // counts: {counts}"
        );
        all.push(format!("{name}: {grown}"));
    }
    all
}
