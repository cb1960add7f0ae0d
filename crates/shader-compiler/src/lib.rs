//! WGSL to checked, patched SPIR-V with reflected layouts, at build time.
//!
//! A directory holds one shader a file, and modules that they import in `shared/` (`#define_import_path`, `#import`, `#ifdef`: naga_oil).
//! WGSL has no words for some features; they are written as follows:
//! - A texture named `subpass_...` is a subpass input (input attachment), read with `textureLoad(subpass_x, vec2<i32>(0, 0), 0)`. The
//!   inputs that a variant uses are indexed in the order of their bindings.
//! - `override NAME: T = value;` becomes a specialization constant; its id is `@id(n)`, or the next free one in the order of declaration, imported
//!   files first. It is the same in every variant.
//! - `var<immediate>` holds the push constants.
//! - `const NAME: T = value; // host`, on one line, is a scalar that the generated Rust declares as well. In a shared module its value is the one
//!   without flags.
//! - Comment lines in a shader's head name its variants (see [`variants`]).
//!
//! Limits: vertex, fragment and compute stages; SPIR-V 1.3 for Vulkan 1.1; exports of modules cannot have names with a digit or `_` at the end, since
//! naga_oil writes them back as WGSL.

mod compose;
mod counts;
mod emit;
mod error;
mod generate;
mod host;
mod number;
mod pack;
mod parallel;
pub mod patch;
pub mod reflect;
mod scan;
mod shader;
mod source;
pub mod variants;

use std::path::Path;

use compose::{Composing, Library};
pub use counts::{count_variants, variants_growth};
pub use emit::{CompiledEntryPoint, StageKind};
pub use error::{Error, SourceSpan};
pub use generate::{Written, write_rust};
pub use host::{HostConstant, host_interface};
pub use number::same_but_for_ids;
pub use shader::{CompiledShader, CompiledVariant, ScalarValue, SpecializationConstant};
use shader::{Plan, merge};
use source::Source;

/// A file as it was read: its name for errors, and its text.
pub type NamedText<'a> = (&'a str, &'a str);

/// Compiles every `*.wgsl` of `directory`, with the files of `directory/shared` as modules to import. The shaders are sorted by name. The list is
/// empty if the directory is empty or missing.
///
/// # Errors
/// All faults of the shaders, each once; or a directory or file that cannot be read.
pub fn compile_directory(directory: &Path) -> Result<Vec<CompiledShader>, Vec<Error>> {
    compile_variants(directory, &|_, _| true)
}

/// Compiles selected variants only: `wanted` is called with a shader's name and a variant's flags as bits. A shader has the constants and structs of
/// its compiled variants; a shader without any is left out.
///
/// # Errors
/// As [`compile_directory`].
pub fn compile_variants(
    directory: &Path,
    wanted: &dyn Fn(&str, u32) -> bool,
) -> Result<Vec<CompiledShader>, Vec<Error>> {
    let shared = read_all(&directory.join("shared")).map_err(|error| vec![error])?;
    let shaders = read_all(directory).map_err(|error| vec![error])?;
    compile(&shaders, &shared, wanted)
}

/// Compiles one shader with the modules `shared`.
///
/// # Errors
/// All faults of the shader, each once.
pub fn compile_source(shader: NamedText, shared: &[NamedText]) -> Result<CompiledShader, Vec<Error>> {
    let owned = |(path, text): &NamedText| ((*path).to_owned(), (*text).to_owned());
    let shared: Vec<_> = shared.iter().map(owned).collect();
    let mut shaders = compile(&[owned(&shader)], &shared, &|_, _| true)?;
    shaders.pop().ok_or_else(|| vec![Error::in_file(shader.0, "no shader was compiled")])
}

/// Reads the WGSL files of a directory, sorted by name; none if there is no such directory.
fn read_all(directory: &Path) -> Result<Vec<(String, String)>, Error> {
    let fault = |path: &Path, error: std::io::Error| {
        Error::in_file(&path.display().to_string(), format!("cannot be read: {error}"))
    };
    let entries = match std::fs::read_dir(directory) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(fault(directory, error)),
    };
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.map_err(|error| fault(directory, error))?.path();
        if path.extension().is_some_and(|extension| extension == "wgsl") {
            let text = std::fs::read_to_string(&path).map_err(|error| fault(&path, error))?;
            files.push((path.display().to_string(), text));
        }
    }
    files.sort();
    Ok(files)
}

fn compile(
    shaders: &[(String, String)],
    shared: &[(String, String)],
    wanted: &dyn Fn(&str, u32) -> bool,
) -> Result<Vec<CompiledShader>, Vec<Error>> {
    let sources = collect(shared.iter().map(|(path, text)| Source::new(path, text)))?;
    let library = Library::new(sources).map_err(|error| vec![error])?;
    let constants = host::shared_constants(&library).map_err(|error| vec![error])?;
    let mut plans = collect(shaders.iter().map(|(path, text)| Plan::new(path, text, &library, &constants)))?;
    for plan in &mut plans {
        let Plan { name, combinations, .. } = plan;
        combinations.retain(|&bits| wanted(name, bits));
    }
    plans.retain(|plan| !plan.combinations.is_empty());
    let jobs: Vec<_> = plans.iter().flat_map(|plan| plan.combinations.iter().map(move |bits| (plan, *bits))).collect();
    let done = run(&jobs, &library);
    let mut results = done.into_iter();
    collect(
        plans
            .iter()
            .map(|plan| {
                collect(results.by_ref().take(plan.combinations.len())).and_then(|emitted| merge(plan, emitted))
            })
            .map(flatten),
    )
}

/// The errors of several faults stand as one list; see [`collect`].
fn flatten<T>(result: Result<T, Vec<Error>>) -> Result<T, CompileErrors> {
    result.map_err(CompileErrors)
}

struct CompileErrors(Vec<Error>);

impl From<Error> for CompileErrors {
    fn from(error: Error) -> Self {
        Self(vec![error])
    }
}

/// All results, or all faults, each once.
fn collect<T, E: Into<CompileErrors>>(results: impl Iterator<Item = Result<T, E>>) -> Result<Vec<T>, Vec<Error>> {
    let (mut values, mut faults) = (Vec::new(), Vec::<Error>::new());
    for result in results {
        match result {
            Ok(value) => values.push(value),
            Err(error) => {
                for fault in error.into().0 {
                    if !faults.iter().any(|known| known.same_fault(&fault)) {
                        faults.push(fault);
                    }
                }
            }
        }
    }
    if faults.is_empty() { Ok(values) } else { Err(faults) }
}

/// Compiles every job.
fn run(jobs: &[(&Plan, u32)], library: &Library) -> Vec<Result<emit::Emitted, Error>> {
    parallel::map(
        jobs,
        || Composing::new(library),
        |composing, (plan, bits)| match composing {
            Ok(composing) => plan.compile(composing, library, *bits),
            Err(error) => Err(error.clone()),
        },
    )
}
