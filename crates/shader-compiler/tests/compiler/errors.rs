//! Errors name the file, the line and the column, through imports and preprocessing.

use crate::common::{error, error_with};

const MODULE: (&str, &str) =
    ("shared/brdf.wgsl", "#define_import_path test::brdf\n\nfn lobe(x: f32) -> f32 {\n    return x * 2.0;\n}\n");

#[test]
fn a_caret_stands_under_the_fault() {
    let error = error("@fragment\nfn fragment() -> @location(0) vec4<f32> {\n    return vec4<f32>(nothing);\n}\n");
    let expected = "error: no definition in scope for identifier: `nothing`
 --> demo.wgsl:3:22
  |
3 |     return vec4<f32>(nothing);
  |                      ^^^^^^^";
    assert!(error.to_string().starts_with(expected), "{error}");
}

#[test]
fn a_fault_in_an_imported_file_is_shown_there() {
    let module =
        ("shared/bad.wgsl", "#define_import_path test::bad\n\nfn lobe(x: f32) -> f32 {\n    return x + missing;\n}\n");
    let text = "#import test::bad::lobe\n@fragment\nfn fragment() -> @location(0) f32 { return lobe(1.0); }\n";
    let error = error_with(text, &[module]);
    let at = error.location.as_ref().expect("a place");
    assert_eq!(
        (at.file.as_str(), at.line, at.column, at.text.as_str()),
        ("shared/bad.wgsl", 4, 16, "    return x + missing;")
    );
}

#[test]
fn columns_are_right_behind_imported_names_and_overrides() {
    let text = "#import test::brdf::lobe\n@fragment\nfn fragment() -> @location(0) f32 { return lobe(1.0) + lobe(2.0) + wrong; }\n";
    let error = error_with(text, &[MODULE]);
    let at = error.location.as_ref().expect("a place");
    assert_eq!((at.line, at.column, at.length), (3, 68, 5), "{error}");
    let wrong = crate::common::error(
        "override GAIN: f32 = wrong;\n@fragment\nfn fragment() -> @location(0) f32 { return GAIN; }\n",
    );
    assert_eq!(wrong.location.as_ref().map(|at| (at.line, at.column)), Some((1, 22)), "{wrong}");
}

#[test]
fn an_unknown_item_has_its_readable_name() {
    let text = "#import test::brdf::nope\n@fragment\nfn fragment() -> @location(0) f32 { return nope(1.0); }\n";
    let error = error_with(text, &[MODULE]);
    assert!(error.message.contains("`test::brdf::nope`"), "{error}");
    assert_eq!(error.location.as_ref().map(|at| (at.line, at.column)), Some((3, 44)), "{error}");
}

#[test]
fn a_validation_fault_names_its_cause() {
    let text = "@group(0) @binding(0) var<uniform> table: array<f32, 4>;\n@fragment\nfn fragment() -> @location(0) f32 { return table[1]; }\n";
    let error = error(text);
    assert_eq!(error.location.as_ref().map(|at| at.line), Some(1), "{error}");
    assert!(error.to_string().contains("stride"), "{error}");
}

#[test]
fn an_unknown_import_and_a_circle_are_named() {
    let unknown =
        error_with("#import test::none::f\n@fragment\nfn fragment() -> @location(0) f32 { return f(); }\n", &[MODULE]);
    assert!(unknown.message.contains("`test::none`"), "{unknown}");
    assert_eq!(unknown.location.as_ref().map(|at| (at.line, at.column)), Some((1, 9)));
    let a = ("shared/a.wgsl", "#define_import_path a\n#import b::g\nfn f() -> f32 { return g(); }\n");
    let b = ("shared/b.wgsl", "#define_import_path b\n#import a::f\nfn g() -> f32 { return f(); }\n");
    let circle = error_with("@fragment\nfn fragment() {}\n", &[a, b]);
    assert!(circle.message.contains("circle: shared/a.wgsl, shared/b.wgsl"), "{circle}");
}

#[test]
fn a_name_that_cannot_be_shared_is_pointed_at() {
    let module =
        ("shared/a.wgsl", "#define_import_path a\nstruct S {\n    alpha2: f32,\n}\nfn f() -> S { return S(1.0); }\n");
    let error =
        error_with("#import a::f\n@fragment\nfn fragment() -> @location(0) f32 { return f().alpha2; }\n", &[module]);
    assert_eq!(error.location.as_ref().map(|at| (at.line, at.column, at.length)), Some((3, 5, 6)), "{error}");
}

#[test]
fn a_condition_on_no_flag_is_refused() {
    let error = error("// variants: TEXTURED\n@fragment\nfn fragment() {\n#ifdef TEXTURD\n#endif\n}\n");
    assert!(error.message.contains("`TEXTURD`"), "{error}");
    assert_eq!(error.location.as_ref().map(|at| (at.line, at.column)), Some((4, 8)));
}

#[test]
fn the_variant_is_told_and_a_fault_is_told_once() {
    let error = error("// variants: A B\n@fragment\nfn fragment() {\n#ifdef B\n    wrong();\n#endif\n}\n");
    assert_eq!(error.location.as_ref().map(|at| at.line), Some(5));
    assert_eq!(error.notes.last().map(String::as_str), Some("in the variant B"), "{error}");
}

#[test]
fn broken_preprocessing_and_syntax_fail_without_a_panic() {
    for text in [
        "#ifdef A\n",
        "#endif\n",
        "fn",
        "@fragment fn f( {",
        "override",
        "#import",
        "#import a::{",
        "var subpass_",
        "/*",
        "@id(9) override",
        "é",
        "",
    ] {
        let _ = afterlight_shader_compiler::compile_source(("demo.wgsl", text), &[MODULE]);
    }
    // Windows line ends and a byte order mark are harmless.
    let text = "\u{feff}// variants: A\r\n@fragment\r\nfn fragment() {\r\n}\r\n";
    assert_eq!(crate::common::compile(text).variants.len(), 2);
}
