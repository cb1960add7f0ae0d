//! Compiles each step's `shaders.wgsl` to a SPIR-V file for every entry point: `OUT_DIR/step-NAME/ENTRY.spv`.

use std::error::Error;
use std::path::Path;
use std::{env, fs};

use afterlight_shader_compiler::compile_source;

fn main() -> Result<(), Box<dyn Error>> {
    let out = env::var("OUT_DIR")?;
    // A new step has a line there.
    println!("cargo::rerun-if-changed=Cargo.toml");
    for entry in fs::read_dir(".")? {
        let folder = entry?.path();
        let source = folder.join("shaders.wgsl");
        if source.exists() {
            println!("cargo::rerun-if-changed={}", source.display());
            let step = folder.file_name().ok_or("a folder without a name")?.to_string_lossy();
            compile(&source, &Path::new(&out).join(format!("step-{step}")))?;
        }
    }
    Ok(())
}

fn compile(source: &Path, out: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(out)?;
    let (name, text) = (source.display().to_string(), fs::read_to_string(source)?);
    let shader = compile_source((&name, &text), &[])
        .map_err(|errors| errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
    for entry in shader.variants.iter().flat_map(|variant| &variant.entry_points) {
        let words: Vec<u8> = entry.spirv.iter().flat_map(|word| word.to_ne_bytes()).collect();
        fs::write(out.join(format!("{}.spv", entry.name)), words)?;
    }
    Ok(())
}
