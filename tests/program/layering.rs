//! Imports run one way (ARCHITECTURE.md): `cli -> {window, stress, report} -> frame -> passes -> {gpu_scene, targets} -> {visible, gpu}`,
//! `visible -> plan -> scene`. Every path in `src/` that starts at the crate's root, at a parent or at the library's name is resolved and held
//! against the table below; paths inside macros, attributes and nested imports too, because the check reads tokens.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// The imports that each part of the project may have. A part may always import itself; an import that is not listed here fails.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("scene", &["regular_file"]),
    ("shaders", &[]),
    ("gpu", &["regular_file", "user_cache", "whole_file"]),
    // Decided once: nothing in it is worked out for a frame.
    ("plan", &["scene"]),
    ("visible", &["plan", "scene"]),
    ("targets", &["plan", "gpu", "scene"]),
    ("gpu_scene", &["visible", "plan", "gpu", "scene", "shaders"]),
    ("passes", &["gpu_scene", "targets", "visible", "plan", "gpu", "scene", "shaders"]),
    ("frame", &["passes", "gpu_scene", "targets", "visible", "plan", "gpu", "scene", "shaders"]),
    ("reference", &["scene", "regular_file", "user_cache", "whole_file"]),
    ("measure", &["scene"]),
    ("window", FRAME_AND_BELOW),
    ("stress", FRAME_AND_BELOW),
    ("mutants", FRAME_AND_BELOW),
    ("report", FRAME_AND_BELOW),
    ("cli", CLI),
    // Ways to read and to write a file, for all who do.
    ("regular_file", &[]),
    ("whole_file", &[]),
    // The folder of the caches of `gpu` and `reference`.
    ("user_cache", &[]),
    ("main", &["cli"]),
    // `afterlight-gtest`, which starts the program.
    ("bin", &[]),
];

const FRAME_AND_BELOW: &[&str] = &[
    "frame",
    "passes",
    "gpu_scene",
    "targets",
    "visible",
    "plan",
    "gpu",
    "scene",
    "shaders",
    "measure",
    "reference",
    "regular_file",
];

/// The program is a crate of its own, which sees the library's interface.
const CLI: &[&str] = &[
    "window",
    "stress",
    "mutants",
    "report",
    "frame",
    "plan",
    "gpu",
    "scene",
    "measure",
    "reference",
    "regular_file",
    "whole_file",
];

/// Parts that know no Vulkan.
const WITHOUT_VULKAN: &[&str] = &["scene", "shaders", "reference", "measure"];

/// A path in a source file, resolved to the project's modules.
#[derive(Debug, PartialEq, Eq)]
struct Import {
    line: usize,
    /// From the crate's root; `ash` alone for a path into the Vulkan bindings.
    path: Vec<String>,
    vulkan: bool,
}

/// An arrow that runs back.
#[derive(Debug)]
struct Violation {
    file: String,
    line: usize,
    what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.file, self.line, self.what)
    }
}

/// The module that a file below `src/` is: `passes/mod.rs` is `[passes]`, `plan/sun.rs` is `[plan, sun]`, the roots are `[]`.
fn module_of(file: &str) -> Vec<String> {
    let parts = file.trim_end_matches(".rs").split('/').map(str::to_string);
    let mut module: Vec<String> = parts.collect();
    if module.last().is_some_and(|last| last == "mod") || file == "lib.rs" || file == "main.rs" {
        module.pop();
    }
    module
}

/// Every import of a source file, whose own module is `module`.
fn imports(source: &str, module: &[String]) -> Result<Vec<Import>, String> {
    let tokens = TokenStream::from_str(source).map_err(|error| error.to_string())?;
    let mut found = Vec::new();
    scan(tokens, module, &mut found);
    Ok(found)
}

fn scan(tokens: TokenStream, module: &[String], found: &mut Vec<Import>) {
    let tokens: Vec<TokenTree> = tokens.into_iter().collect();
    let mut at = 0;
    while at < tokens.len() {
        match &tokens[at..] {
            [TokenTree::Ident(word), TokenTree::Ident(name), TokenTree::Group(body), ..] if word == "mod" => {
                let inner = [module, &[name.to_string()]].concat();
                scan(body.stream(), &inner, found);
                at += 3;
                continue;
            }
            [TokenTree::Group(group), ..] => scan(group.stream(), module, found),
            // An alias of the root would hide the path that follows it.
            [TokenTree::Ident(root), TokenTree::Ident(alias), ..] if root == "crate" && alias == "as" => {
                found.push(Import { line: root.span().start().line, path: Vec::new(), vulkan: false });
            }
            [TokenTree::Ident(first), ..] if !continues_a_path(&tokens, at) && is_colons(&tokens, at + 1) => {
                let name = first.to_string();
                let vulkan = name == "ash";
                if vulkan || ["crate", "afterlight", "super", "self"].contains(&name.as_str()) {
                    let mut paths = Vec::new();
                    collect(&tokens[at + 3..], vec![name], &mut paths);
                    let line = first.span().start().line;
                    let resolved = paths.iter().map(|path| resolve(path, module));
                    found.extend(resolved.map(|path| Import { line, path, vulkan }));
                }
            }
            _ => {}
        }
        at += 1;
    }
}

fn is_punct(tokens: &[TokenTree], at: usize, wanted: char) -> bool {
    matches!(tokens.get(at), Some(TokenTree::Punct(punct)) if punct.as_char() == wanted)
}

fn is_colons(tokens: &[TokenTree], at: usize) -> bool {
    is_punct(tokens, at, ':') && is_punct(tokens, at + 1, ':')
}

/// Returns true if the token is in the middle of a path. A leading `::` starts a path.
fn continues_a_path(tokens: &[TokenTree], at: usize) -> bool {
    at >= 3 && is_colons(tokens, at - 2) && matches!(&tokens[at - 3], TokenTree::Ident(before) if before != "use")
}

/// The paths that go on from `prefix` at the first token: one, or several where braces follow.
fn collect(tokens: &[TokenTree], mut prefix: Vec<String>, paths: &mut Vec<Vec<String>>) {
    match tokens.first() {
        Some(TokenTree::Ident(name)) => {
            if name != "self" {
                prefix.push(name.to_string());
            }
            if is_colons(tokens, 1) { collect(&tokens[3..], prefix, paths) } else { paths.push(prefix) }
        }
        Some(TokenTree::Punct(star)) if star.as_char() == '*' => {
            prefix.push("*".into());
            paths.push(prefix);
        }
        Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
            let inner: Vec<TokenTree> = group.stream().into_iter().collect();
            let comma = |token: &TokenTree| matches!(token, TokenTree::Punct(punct) if punct.as_char() == ',');
            for piece in inner.split(comma).filter(|piece| !piece.is_empty()) {
                collect(piece, prefix.clone(), paths);
            }
        }
        // A turbofish: the path ends before it.
        _ => paths.push(prefix),
    }
}

fn resolve(path: &[String], module: &[String]) -> Vec<String> {
    let mut resolved = match path[0].as_str() {
        "ash" => return path.to_vec(),
        "crate" | "afterlight" => return path[1..].to_vec(),
        _ => module.to_vec(),
    };
    for name in path {
        match name.as_str() {
            "self" => {}
            "super" => drop(resolved.pop()),
            other => resolved.push(other.to_string()),
        }
    }
    resolved
}

/// The violations of one file; `file` is its path below `src/`, `passes` the names of the files in `src/passes/`.
fn check(file: &str, source: &str, passes: &[String]) -> Vec<Violation> {
    if file == "lib.rs" {
        return Vec::new();
    }
    let module = module_of(file);
    let part = module.first().map_or("main", String::as_str);
    let violation = |line, what| Violation { file: format!("src/{file}"), line, what };
    let Some((_, allowed)) = MAY_IMPORT.iter().find(|(name, _)| *name == part) else {
        return vec![violation(
            1,
            format!("{part} is not in the table of tests/program/layering.rs: say what it may import"),
        )];
    };
    let all = match imports(source, &module) {
        Ok(all) => all,
        Err(error) => return vec![violation(1, format!("does not parse: {error}"))],
    };
    let wrong = |import: &Import| -> Option<String> {
        let path = import.path.join("::");
        if import.vulkan {
            return WITHOUT_VULKAN.contains(&part).then(|| format!("{part} knows no Vulkan, and names {path}"));
        }
        let target = match import.path.first().map(String::as_str) {
            None | Some("*") => return Some("names the whole crate, so that nothing says what it uses".into()),
            Some(target) => target,
        };
        let known = MAY_IMPORT.iter().any(|(name, _)| *name == target);
        if target != part && known && !allowed.contains(&target) {
            return Some(format!("{part} must not import {path}"));
        }
        (part == "passes" && target == "passes").then(|| wrong_pass(&module, &import.path, passes)).flatten()
    };
    all.iter().filter_map(|import| wrong(import).map(|what| violation(import.line, what))).collect()
}

/// Passes never import each other, nor do their shared helpers import one.
fn wrong_pass(module: &[String], path: &[String], passes: &[String]) -> Option<String> {
    let own = module.get(1);
    match path.get(1) {
        None => own.map(|own| format!("the pass {own} names all passes at once")),
        Some(all) if all == "*" => own.map(|own| format!("the pass {own} imports all passes")),
        Some(other) if passes.contains(other) && own != Some(other) => {
            Some(format!("{} must not import the pass {other}", module.join("::")))
        }
        Some(_) => None,
    }
}

/// The Rust files below a folder, sorted.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("src can be listed") {
        let path = entry.expect("src can be listed").path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

fn pass_names(src: &Path) -> Vec<String> {
    let stem = |path: &PathBuf| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    sources(&src.join("passes"))
        .iter()
        .filter_map(stem)
        .filter(|name| {
            ![
                "mod",
                "air",
                "background",
                "blending",
                "culling",
                "curves",
                "depth_only",
                "object",
                "per_pixel",
                "screen",
                "spirv",
                "spread",
                "surface",
            ]
            .contains(&name.as_str())
        })
        .collect()
}

#[test]
fn no_import_runs_back() {
    let src = Path::new(env!("AFTERLIGHT_ROOT")).join("src");
    let passes = pass_names(&src);
    assert!(passes.contains(&"lighting".to_string()), "{passes:?}");
    let mut violations = Vec::new();
    for path in sources(&src) {
        let source = fs::read_to_string(&path).expect("a source file is text");
        let file = path.strip_prefix(&src).expect("below src").to_string_lossy().replace('\\', "/");
        violations.extend(check(&file, &source, &passes).iter().map(ToString::to_string));
    }
    assert!(violations.is_empty(), "imports that run back:\n{}", violations.join("\n"));
}

/// Arrows that run back, each in another disguise.
const PLANTED: &[(&str, &str)] = &[
    ("gpu/image.rs", "use crate::plan::FramePlan;"),
    ("gpu/image.rs", "use crate::{gpu::Device, scene};"),
    ("gpu/image.rs", "fn f() -> crate::scene::Scene { todo!() }"),
    ("gpu/image.rs", "fn f() { assert_eq!(1, crate::plan::COUNT); }"),
    ("gpu/image.rs", "fn f() { g::<crate::targets::Target>() }"),
    ("gpu/image.rs", "mod tests { use super::super::super::plan::FramePlan; }"),
    ("gpu/image.rs", "use crate::*;"),
    ("gpu/image.rs", "use crate as root; use root::plan;"),
    ("gpu/mod.rs", "use super::scene::Scene;"),
    ("plan/sun.rs", "use crate::{scene::{Aabb, Camera}, gpu::{self, Device}};"),
    ("plan/sun.rs", "use crate::visible::World;"),
    ("plan.rs", "#[derive(Debug)] struct A { a: afterlight::gpu::Device }"),
    ("scene/mod.rs", "use ash::vk;"),
    ("measure/statistics.rs", "fn f(a: ::ash::vk::Format) {}"),
    ("measure/statistics.rs", "use crate::gpu::Timestamps;"),
    ("reference/mod.rs", "use crate::frame::Renderer;"),
    ("targets.rs", "use crate::passes::lighting;"),
    ("gpu_scene/view.rs", "use crate::passes::Recording;"),
    ("passes/lighting.rs", "use super::geometry::COLOR_WRITE;"),
    ("passes/lighting.rs", "use crate::passes::{Slot, shadow::MAP_WRITE};"),
    ("passes/lighting.rs", "use super::*;"),
    ("passes/lighting.rs", "use crate::passes;"),
    ("passes/screen.rs", "use super::geometry::DEPTH_TEST;"),
    ("passes/mod.rs", "use self::lighting::MAP_READ;"),
    ("passes/copy.rs", "use crate::frame::edges;"),
    ("frame/mod.rs", "use afterlight::cli::Failure;"),
    ("main.rs", "use afterlight::frame::Renderer;"),
    ("novelty.rs", "fn f() {}"),
];

#[test]
fn a_planted_arrow_is_found_in_every_disguise() {
    let passes = ["geometry", "lighting", "shadow", "copy"].map(str::to_string);
    for (file, source) in PLANTED {
        let found = check(file, source, &passes);
        assert!(!found.is_empty(), "src/{file}: {source}");
        assert_eq!((found[0].line, found[0].file.as_str()), (1, format!("src/{file}").as_str()));
    }
}

#[test]
fn an_arrow_that_runs_forward_is_left_alone() {
    let passes = ["geometry", "lighting"].map(str::to_string);
    for (file, source) in [
        ("gpu/image.rs", "use super::device::Device; use crate::gpu::Error; use ash::vk;"),
        ("gpu/image.rs", "/// See [`crate::plan`].\nfn f() { log(\"use crate::plan\") } // crate::plan"),
        (
            "passes/lighting.rs",
            "use super::screen::Screen; use super::{Slot, Recording}; use crate::shaders::lighting;",
        ),
        ("passes/lighting.rs", "mod tests { use super::*; use crate::plan::Shading; }"),
        ("frame/mod.rs", "use crate::passes::{copy, geometry}; fn f() { geometry::COLOR_WRITE; super::gpu::x() }"),
        ("plan/sun.rs", "use super::World; pub(crate) use crate::scene::Camera; pub(super) fn f() {}"),
        ("cli/render.rs", "use crate::cli::table::Table; use afterlight::{frame, gpu, measure}; use ash::vk;"),
        ("lib.rs", "pub mod frame; pub use crate::frame::Renderer;"),
        ("main.rs", "mod cli; use crate::cli::run;"),
    ] {
        let found = check(file, source, &passes);
        assert!(found.is_empty(), "src/{file}: {source}: {found:?}");
    }
}
