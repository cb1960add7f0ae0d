//! The program's SPIR-V modules are valid: by the system's spirv-val, and by the newest one if `scripts/fetch-newest` has fetched it. The newest layer has
//! its rules.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::process::{Command, Stdio};

use afterlight::shaders::{self, Spirv};

use super::stacks::runner_of;
use crate::common::some_of;

/// Returns the spirv-val of the system, and the newest if there is one.
fn validators() -> Vec<Command> {
    let is_there =
        |command: &mut Command| command.arg("--version").output().is_ok_and(|output| output.status.success());
    let mut validators = Vec::new();
    if is_there(&mut Command::new("spirv-val")) {
        validators.push(Command::new("spirv-val"));
    }
    if let Some(runner) = runner_of("newest") {
        let mut newest = Command::new(runner);
        newest.arg("spirv-val");
        validators.push(newest);
    }
    validators
}

/// Returns the validator's complaint about a module, if it has one.
fn objection(mut validator: Command, words: &[u32]) -> Option<String> {
    validator
        .args(["--target-env", "vulkan1.1", "-"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .stdout(Stdio::null());
    let mut child = validator.spawn().expect("it has told its version");
    child.stdin.take().expect("piped").write_all(bytemuck::cast_slice(words)).expect("spirv-val reads");
    let output = child.wait_with_output().expect("spirv-val ends");
    (!output.status.success()).then(|| String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn every_module_is_valid() {
    if validators().is_empty() {
        eprintln!("SKIPPED: spirv-val is not installed");
        return;
    }
    // Entry points share modules that are the same.
    let mut seen = BTreeSet::new();
    let of_variants = shaders::ALL.iter().flat_map(|shader| {
        shader
            .variants
            .iter()
            .flat_map(move |variant| variant.entry_points.iter().map(move |entry| (shader, variant, entry)))
    });
    let modules: Vec<_> = of_variants
        .filter(|(.., entry)| match entry.spirv {
            Spirv::Packed { block, start, .. } => seen.insert((block, start)),
            Spirv::Plain(_) => true,
        })
        .collect();
    assert!(modules.len() > 1000, "{}", modules.len());
    // `make test` takes three of each hundred. The layer makes the same checks on all modules that other tests draw with.
    for (shader, variant, entry) in some_of(modules, 33) {
        for validator in validators() {
            let name = validator.get_program().display().to_string();
            if let Some(objection) = objection(validator, entry.spirv.words()) {
                panic!("{} {:b} {:?}: {name}: {objection}", shader.name, variant.bits, entry.name);
            }
        }
    }
}
