//! Compiles `shaders/` into what `src/shaders.rs` includes, and says when a shader has more variants than before.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use afterlight_shader_compiler::{Error, Shader, compile_directory, variants_growth, variants_table, write_rust};

/// The committed table of variants, which the build compares with what it compiles.
const TABLE: &str = "shaders/variants.txt";

/// The most different SPIR-V modules that the program may hold. A new flag can double a shader's: then ask whether a specialization constant
/// does as well, or whether `requires:` and `excludes:` rule variants out.
const MOST_MODULES: usize = 1330;

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
    let grown = tell_growth(&shaders, out).map_err(|error| vec![error])?;
    let written = write_rust(&shaders, out).map_err(|error| vec![error])?;
    if written.modules > MOST_MODULES {
        let (modules, grown) = (written.modules, grown.join("; "));
        let message = format!("{modules} SPIR-V modules are more than the {MOST_MODULES} of build.rs: {grown}");
        return Err(vec![Error::in_file(TABLE, message)]);
    }
    Ok(())
}

/// Warns of each number of variants that is not the one in [`TABLE`], and returns what it warned of.
fn tell_growth(shaders: &[Shader], out: &Path) -> Result<Vec<String>, Error> {
    let fault = |path: &Path, error: std::io::Error| Error::in_file(&path.display().to_string(), error.to_string());
    let now = variants_table(shaders);
    let path = out.join("variants.txt");
    std::fs::write(&path, &now).map_err(|error| fault(&path, error))?;
    let before = std::fs::read_to_string(TABLE).map_err(|error| fault(Path::new(TABLE), error))?;
    let grown = variants_growth(&before, &now);
    for line in &grown {
        println!("cargo::warning={line}");
    }
    if !grown.is_empty() {
        println!("cargo::warning=once that is as it should be: cp {} {TABLE}", path.display());
    }
    Ok(grown)
}
