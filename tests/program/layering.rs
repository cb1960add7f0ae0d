//! Imports run one way (ARCHITECTURE.md). Between crates cargo holds that; within them this does:
//! `frame -> passes -> {gpu_scene, targets} -> visible -> plan -> shaders` in the renderer, and nothing between the parts of the laboratory and of the truth. Every path
//! that starts at a crate's root, at a parent or at the renderer's name is resolved and held against the table below; paths inside macros, attributes
//! and nested imports too, because the check reads tokens.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// The imports that each part of the project may have. A part may always import itself; an import that is not listed here fails. `scene` and `gpu` are
/// crates, by the names that the renderer gives them.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("shaders", &[]),
    // Decided once: nothing in it is worked out for a frame. From `gpu` it knows only the terms of synchronization and of a device's lacks, which are
    // values.
    ("plan", &["scene", "shaders", "gpu/sync", "gpu/lack"]),
    ("visible", &["plan", "scene", "shaders"]),
    ("targets", &["plan", "gpu", "scene"]),
    ("gpu_scene", &["visible", "plan", "gpu", "scene", "shaders"]),
    ("passes", &["gpu_scene", "targets", "visible", "plan", "gpu", "scene", "shaders"]),
    ("frame", &["passes", "gpu_scene", "targets", "visible", "plan", "gpu", "scene", "shaders"]),
    ("proof", RENDERER),
    ("truth/reference", &[]),
    ("truth/measure", &[]),
    ("lab/page", &[]),
    ("lab/report", PAGES),
    ("lab/stress", PAGES),
    ("lab/mutants", RENDERER),
    ("window", RENDERER),
    // The program sees only the parts of the renderer that every user of the library sees.
    ("program", &["frame", "plan", "gpu", "scene"]),
    ("scene", &[]),
    ("gpu", &[]),
];

const RENDERER: &[&str] = &["frame", "passes", "gpu_scene", "targets", "visible", "plan", "gpu", "scene", "shaders"];
/// The imports of parts that draw pages.
const PAGES: &[&str] =
    &["lab/page", "frame", "passes", "gpu_scene", "targets", "visible", "plan", "gpu", "scene", "shaders"];

/// The folders whose files are read.
const SOURCES: [&str; 6] =
    ["src", "crates/proof/src", "crates/truth/src", "crates/lab/src", "crates/window/src", "crates/program/src"];

/// Parts of the renderer that know no Vulkan. Crates without a dependency on it cannot.
const WITHOUT_VULKAN: &[&str] = &["shaders"];

/// A path in a source file, resolved to the project's modules.
#[derive(Debug, PartialEq, Eq)]
struct Import {
    line: usize,
    /// From the root of the crate, or of the renderer where `of_renderer`; `ash` alone for a path into the Vulkan bindings.
    path: Vec<String>,
    of_renderer: bool,
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

/// The crate of a file, by its folder in `crates/`; none is the renderer.
fn crate_of(file: &str) -> Option<&str> {
    file.strip_prefix("crates/")?.split('/').next()
}

/// Returns the row of the table for an import, by its crate and its first module.
fn part_of(of_crate: Option<&str>, first: Option<&str>) -> String {
    let within = of_crate.zip(first).map(|(of_crate, first)| format!("{of_crate}/{first}"));
    let is_row = |name: &String| MAY_IMPORT.iter().any(|(row, _)| row == name);
    within.filter(is_row).or(of_crate.map(str::to_string)).or(first.map(str::to_string)).unwrap_or_default()
}

/// The module that a file is in its crate: `src/passes/mod.rs` is `[passes]`, `src/plan/sun.rs` is `[plan, sun]`, the roots are `[]`.
fn module_of(file: &str) -> Vec<String> {
    let file = file.split_once("src/").map_or(file, |(_, file)| file);
    let parts = file.trim_end_matches(".rs").split('/').map(str::to_string);
    let mut module: Vec<String> = parts.collect();
    if module.last().is_some_and(|last| last == "mod") || ["lib.rs", "main.rs"].contains(&file) {
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
            [TokenTree::Ident(root), TokenTree::Ident(alias), ..]
                if ["crate", "afterlight"].contains(&root.to_string().as_str()) && alias == "as" =>
            {
                let line = root.span().start().line;
                let of_renderer = root == "afterlight";
                found.push(Import { line, path: Vec::new(), of_renderer, vulkan: false });
            }
            [TokenTree::Ident(first), ..] if !continues_a_path(&tokens, at) && is_colons(&tokens, at + 1) => {
                let name = first.to_string();
                let vulkan = name == "ash";
                if vulkan || ["crate", "afterlight", "super", "self"].contains(&name.as_str()) {
                    let mut paths = Vec::new();
                    collect(&tokens[at + 3..], vec![name], &mut paths);
                    let line = first.span().start().line;
                    let resolved = paths.iter().map(|path| (resolve(path, module), path[0] == "afterlight"));
                    found.extend(resolved.map(|(path, of_renderer)| Import { line, path, of_renderer, vulkan }));
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

/// The violations of one file; `file` is its path in the project, `passes` the names of the files in `src/passes/`.
fn check(file: &str, source: &str, passes: &[String]) -> Vec<Violation> {
    let of_crate = crate_of(file);
    let module = module_of(file);
    // The roots list the parts.
    if module.is_empty() && of_crate.is_none() {
        return Vec::new();
    }
    let part = part_of(of_crate, module.first().map(String::as_str));
    let violation = |line, what| Violation { file: file.into(), line, what };
    let Some((_, allowed)) = MAY_IMPORT.iter().find(|(name, _)| *name == part) else {
        return match of_crate {
            // The root of a crate with parts.
            Some(_) if module.is_empty() => Vec::new(),
            _ => vec![violation(
                1,
                format!("{part} is not in the table of tests/program/layering.rs: say what it may import"),
            )],
        };
    };
    let all = match imports(source, &module) {
        Ok(all) => all,
        Err(error) => return vec![violation(1, format!("does not parse: {error}"))],
    };
    let wrong = |import: &Import| -> Option<String> {
        let path = import.path.join("::");
        if import.vulkan {
            return WITHOUT_VULKAN.contains(&&*part).then(|| format!("{part} knows no Vulkan, and names {path}"));
        }
        let target = match import.path.first().map(String::as_str) {
            // A crate of one part.
            None | Some("*") if !import.of_renderer && of_crate == Some(&*part) => return None,
            None | Some("*") => return Some("names a whole crate, so that nothing says what it uses".into()),
            Some(first) if import.of_renderer => part_of(None, Some(first)),
            Some(first) => part_of(of_crate, Some(first)),
        };
        let known = MAY_IMPORT.iter().any(|(name, _)| *name == target);
        let within = import.path.get(1).map(|second| format!("{target}/{second}"));
        let is_allowed = allowed.iter().any(|own| *own == target || Some(*own) == within.as_deref());
        if target != part && known && !is_allowed {
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
                "casters",
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
    let root = Path::new(env!("AFTERLIGHT_ROOT"));
    let passes = pass_names(&root.join("src"));
    assert!(passes.contains(&"lighting".to_string()), "{passes:?}");
    let mut violations = Vec::new();
    for path in SOURCES.iter().flat_map(|folder| sources(&root.join(folder))) {
        let source = fs::read_to_string(&path).expect("a source file is text");
        let file = path.strip_prefix(root).expect("in the project").to_string_lossy().replace('\\', "/");
        violations.extend(check(&file, &source, &passes).iter().map(ToString::to_string));
    }
    assert!(violations.is_empty(), "imports that run back:\n{}", violations.join("\n"));
}

/// Arrows that run back, each in another disguise.
const PLANTED: &[(&str, &str)] = &[
    ("src/plan/sun.rs", "use crate::visible::World;"),
    ("src/plan/sun.rs", "use crate::{scene::{Aabb, Camera}, gpu::{self, Device}};"),
    ("src/plan/sun.rs", "fn f() -> crate::gpu::Device { todo!() }"),
    ("src/plan/sun.rs", "fn f() { assert_eq!(1, crate::frame::COUNT); }"),
    ("src/plan/sun.rs", "fn f() { g::<crate::targets::Target>() }"),
    ("src/plan/sun.rs", "mod tests { use super::super::super::frame::Renderer; }"),
    ("src/plan/sun.rs", "use crate::*;"),
    ("src/plan/sun.rs", "use crate as root; use root::gpu;"),
    ("src/plan.rs", "use super::gpu::Device;"),
    ("src/plan.rs", "#[derive(Debug)] struct A { a: afterlight::gpu::Device }"),
    ("src/shaders.rs", "fn f(a: ::ash::vk::Format) {}"),
    ("src/targets.rs", "use crate::passes::lighting;"),
    ("src/gpu_scene/view.rs", "use crate::passes::FrameContext;"),
    ("src/passes/lighting.rs", "use super::geometry::COLOR_WRITE;"),
    ("src/passes/lighting.rs", "use crate::passes::{Slot, shadow::MAP_WRITE};"),
    ("src/passes/lighting.rs", "use super::*;"),
    ("src/passes/lighting.rs", "use crate::passes;"),
    ("src/passes/screen.rs", "use super::geometry::DEPTH_TEST;"),
    ("src/passes/mod.rs", "use self::lighting::MAP_READ;"),
    ("src/passes/copy.rs", "use crate::frame::rows;"),
    ("src/novelty.rs", "fn f() {}"),
    ("crates/truth/src/measure/fit.rs", "use crate::reference::Truth;"),
    ("crates/truth/src/reference/mod.rs", "use super::measure::Error;"),
    ("crates/lab/src/stress/run.rs", "use crate::report::page;"),
    ("crates/lab/src/page/plot.rs", "use crate::report::sweep::model;"),
    ("crates/lab/src/novelty.rs", "use afterlight::frame::Renderer;"),
    ("crates/program/src/render.rs", "use afterlight::passes::copy;"),
    ("crates/program/src/render.rs", "use afterlight::{frame, shaders};"),
    ("crates/window/src/app.rs", "use afterlight::*;"),
    ("crates/program/src/render.rs", "use afterlight as a; use a::passes::copy;"),
];

#[test]
fn a_planted_arrow_is_found_in_every_disguise() {
    let passes = ["geometry", "lighting", "shadow", "copy"].map(str::to_string);
    for (file, source) in PLANTED {
        let found = check(file, source, &passes);
        assert!(!found.is_empty(), "{file}: {source}");
        assert_eq!((found[0].line, found[0].file.as_str()), (1, *file));
    }
}

#[test]
fn an_arrow_that_runs_forward_is_left_alone() {
    let passes = ["geometry", "lighting"].map(str::to_string);
    for (file, source) in [
        ("src/targets.rs", "use super::plan::FramePlan; use crate::gpu::Error; use ash::vk;"),
        ("src/plan/sun.rs", "/// See [`crate::frame`].\nfn f() { log(\"use crate::frame\") } // crate::frame"),
        (
            "src/passes/lighting.rs",
            "use super::screen::Screen; use super::{Slot, FrameContext}; use crate::shaders::lighting;",
        ),
        ("src/passes/lighting.rs", "mod tests { use super::*; use crate::plan::Shading; }"),
        ("src/frame/mod.rs", "use crate::passes::{copy, geometry}; fn f() { geometry::COLOR_WRITE; super::gpu::x() }"),
        ("src/plan/sun.rs", "use super::World; pub(crate) use crate::scene::Camera; pub(super) fn f() {}"),
        ("src/lib.rs", "pub mod frame; pub use crate::frame::Renderer;"),
        ("crates/lab/src/lib.rs", "pub mod report; pub mod stress;"),
        (
            "crates/lab/src/report/page.rs",
            "use crate::report::sweep; use afterlight::frame; use afterlight_truth::measure;",
        ),
        ("crates/lab/src/stress/page/mod.rs", "use crate::page::plot::Plot; use crate::stress::StressResult;"),
        ("crates/window/src/app.rs", "use crate::keys; use super::steps; use afterlight::passes::overlay::Panels;"),
        ("crates/program/src/render.rs", "use crate::table::Table; use afterlight::{frame, gpu}; use ash::vk;"),
        ("crates/program/src/main.rs", "mod tests { use super::*; }"),
        ("crates/program/src/main.rs", "mod render; use afterlight::scene::builtin; use crate::failure::Failure;"),
    ] {
        let found = check(file, source, &passes);
        assert!(found.is_empty(), "{file}: {source}: {found:?}");
    }
}
