//! Shaders that replace the ones that the program was built with. The test has a process to itself, since an exchange holds for the whole process.

use std::fs;
use std::path::Path;

use afterlight::shaders::exchange::{compile, exchange};
use afterlight::shaders::formulas::{Flags, variant};

const SHADER: &str = "formulas.wgsl";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for part in ["", "shared"] {
        let from = Path::new(env!("AFTERLIGHT_ROOT")).join("shaders").join(part);
        fs::create_dir_all(folder.path().join(part)).expect("a folder");
        for entry in fs::read_dir(from).expect("the shaders") {
            let path = entry.expect("a file").path();
            if path.is_file() {
                let name = path.file_name().expect("a name");
                fs::copy(&path, folder.path().join(part).join(name)).expect("copied");
            }
        }
    }
    folder
}

#[test]
fn a_shader_is_exchanged_only_for_one_that_fits_and_goes_back() {
    let built = variant(Flags::NONE).expect("a variant");
    let folder = folder();
    let path = folder.path().join(SHADER);
    let source = fs::read_to_string(&path).expect("a shader");
    let same = compile(folder.path()).expect("compiles");
    assert!(same.changes().is_empty(), "the same source is another shader: {:?}", same.changes());

    let sizes = source.find("@workgroup_size(").expect("a compute shader");
    let body = sizes + source[sizes..].find('{').expect("a body") + 1;
    let compiled = |text: String| {
        fs::write(&path, text).expect("written");
        compile(folder.path())
    };
    let broken = compiled(format!("{} let nothing = nowhere; {}", &source[..body], &source[body..]));
    let broken = broken.err().expect("does not compile");
    assert!(broken.contains(SHADER) && broken.contains('^'), "{broken}");
    let other = compiled(source.replacen("@workgroup_size(64", "@workgroup_size(32", 1));
    let other = other.err().expect("does not fit");
    assert!(other.contains("built anew"), "{other}");

    // Rust has constants of modules, too.
    let lights = folder.path().join("shared/lights.wgsl");
    let good = fs::read_to_string(&lights).expect("a module");
    fs::write(&lights, good.replacen("POLYNOMIAL: u32 = 2u", "POLYNOMIAL: u32 = 5u", 1)).expect("written");
    let other = compiled(source.clone()).err().expect("does not fit");
    assert!(other.contains("constant lights::POLYNOMIAL: u32 = 5") && other.contains("built anew"), "{other}");
    fs::write(&lights, good).expect("written");

    let new = compiled(format!("{} if FORMULA == 12345u {{ return; }} {}", &source[..body], &source[body..]));
    let new = new.unwrap_or_else(|fault| panic!("{fault}"));
    assert_eq!(new.changes(), ["formulas"]);
    let former = exchange(new.clone());
    assert!(!std::ptr::eq(variant(Flags::NONE).expect("a variant"), built));
    assert!(new.changes().is_empty());
    exchange(former);
    assert!(std::ptr::eq(variant(Flags::NONE).expect("a variant"), built));
}
