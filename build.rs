//! Compiles `shaders/` into what `src/shaders.rs` includes.

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=build.rs");
    let Some(out) = std::env::var_os("OUT_DIR") else {
        eprintln!("error: OUT_DIR is not set: this is cargo's build script");
        return ExitCode::FAILURE;
    };
    let compiled = afterlight_shader_compiler::compile_directory(Path::new("shaders"));
    let written = compiled.and_then(|shaders| {
        afterlight_shader_compiler::write_rust(&shaders, Path::new(&out)).map_err(|error| vec![error])
    });
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(errors) => {
            for error in errors {
                eprintln!("{error}\n");
            }
            ExitCode::FAILURE
        }
    }
}
