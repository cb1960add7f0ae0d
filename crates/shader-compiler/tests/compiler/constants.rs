//! Constants that a shader shares with the host: their values and types, as values and as Rust.

use crate::common::{compile_with, error, error_with};
use afterlight_shader_compiler::{HostConstant, ScalarValue, host_interface, write_rust};

const MODULE: (&str, &str) = (
    "shared/grid.wgsl",
    "#define_import_path test::grids
const TILE: u32 = 4u * 8u; // host
const OFFSET: i32 = -3; // host
const SLACK: f32 = 1e-4; // host
const OWN: u32 = 7u;
fn tiles(edge: u32) -> u32 { return (edge + TILE - 1u) / TILE; }
",
);

const SHADER: &str = "// variants: MORE
#import test::grids::tiles
const IS_WIDE = true; // host
#ifdef MORE
const PLACES: u32 = 32u; // host
#endif
@group(0) @binding(0) var<storage, read_write> out: array<u32>;
@compute @workgroup_size(8, 4)
fn main() { out[0] = tiles(out[1]); }
";

#[test]
fn marked_constants_have_their_values_and_types() {
    let shader = compile_with(SHADER, &[MODULE]);
    let constant = |module: Option<&str>, name: &str, value| HostConstant {
        module: module.map(str::to_owned),
        name: name.to_owned(),
        value,
    };
    let expected = [
        constant(Some("grid"), "TILE", ScalarValue::U32(32)),
        constant(Some("grid"), "OFFSET", ScalarValue::I32(-3)),
        constant(Some("grid"), "SLACK", ScalarValue::F32(1e-4_f32.to_bits())),
        constant(None, "IS_WIDE", ScalarValue::Bool(true)),
        constant(None, "PLACES", ScalarValue::U32(32)),
    ];
    assert_eq!(shader.host_constants, expected);
    let interface = host_interface(&shader);
    assert!(interface.contains("constant grid::TILE: u32 = 32\n"), "{interface}");
    assert!(interface.contains("constant PLACES: u32 = 32\n"), "{interface}");
}

#[test]
fn rust_declares_them_and_the_size_of_work_groups() {
    let directory = std::env::temp_dir().join(format!("afterlight-host-constants-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a temporary directory");
    write_rust(&[compile_with(SHADER, &[MODULE])], &directory).expect("written");
    let rust = std::fs::read_to_string(directory.join("shaders.rs")).expect("the Rust file");
    std::fs::remove_dir_all(&directory).expect("removed");
    for expected in [
        "pub mod host {\n        pub const IS_WIDE: bool = true;\n        pub const PLACES: u32 = 32;\n",
        "pub const WORKGROUP_SIZE: [u32; 3] = [8, 4, 1];\n",
        "pub mod grid {\n        pub const TILE: u32 = 32;\n        pub const OFFSET: i32 = -3;\n        pub const SLACK: f32 = 0.0001;\n",
    ] {
        assert!(rust.contains(expected), "{expected} is missing");
    }
}

#[test]
fn a_constant_that_is_no_scalar_is_refused_where_it_stands() {
    let entry = "@compute @workgroup_size(1)\nfn main() {}\n";
    let error = error(&format!("const AXIS = vec2<f32>(1.0, 0.0); // host\n{entry}"));
    assert!(error.message.contains("`AXIS` is for the host, so it must be a bool, u32, i32 or f32"), "{error}");
    assert_eq!(error.location.map(|at| (at.line, at.column)), Some((1, 7)));
    let module = ("shared/grid.wgsl", "#define_import_path test::grids\nconst AXIS = vec2<f32>(1.0, 0.0); // host\n");
    let error = error_with(entry, &[module]);
    assert_eq!(error.location.map(|at| (at.file, at.line)), Some(("shared/grid.wgsl".to_owned(), 2)));
}

#[test]
fn a_constant_that_differs_between_variants_is_refused() {
    let text = "// variants: MORE
#ifdef MORE
const PLACES: u32 = 32u; // host
#else
const PLACES: u32 = 16u; // host
#endif
@compute @workgroup_size(1)
fn main() {}
";
    let error = error(text);
    assert!(error.message.contains("`PLACES`, which is for the host, differs between variants"), "{error}");
}
