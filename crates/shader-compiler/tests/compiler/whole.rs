//! A small lighting pass with everything in it: imports, variants, subpass inputs, overrides, push constants.

use std::path::Path;

use crate::common::{all, module, validate};
use afterlight_shader_compiler::reflect::ResourceKind;
use afterlight_shader_compiler::{
    CompiledEntryPoint, CompiledShader, ScalarValue, compile_directory, same_but_for_ids, write_rust,
};
use rspirv::spirv::Op;

fn lighting() -> CompiledShader {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/shaders");
    let mut shaders = compile_directory(&directory).unwrap_or_else(|errors| panic!("{}", errors[0]));
    assert_eq!(shaders.len(), 1);
    shaders.remove(0)
}

#[test]
fn every_variant_is_valid() {
    let shader = lighting();
    assert_eq!(shader.name, "lighting");
    assert_eq!(shader.variants.iter().map(|variant| variant.bits).collect::<Vec<_>>(), [0, 1, 2, 3]);
    for entry in shader.variants.iter().flat_map(|variant| &variant.entry_points) {
        validate(entry);
    }
}

#[test]
fn a_binding_says_which_word_of_the_module_is_its_number() {
    let shader = lighting();
    let mut bindings = 0;
    for entry in shader.variants.iter().flat_map(|variant| &variant.entry_points) {
        for binding in &entry.bindings {
            let at = binding.word as usize;
            // OpDecorate, four words: the variable, Binding, its number.
            let decoration = (entry.spirv[at - 3], entry.spirv[at - 1], entry.spirv[at]);
            assert_eq!(decoration, (4 << 16 | 71, 33, binding.binding), "{}", binding.name);
            let variable = entry.spirv[at - 2];
            let set = entry.spirv.windows(4).any(|words| words == [4 << 16 | 71, variable, 34, binding.set]);
            assert!(set, "{} is in another set", binding.name);
            bindings += 1;
        }
    }
    assert!(bindings > 4);
}

#[test]
fn names_and_bindings_are_those_of_the_source() {
    let shader = lighting();
    let bindings = |bits: usize| -> Vec<_> {
        let fragment = &shader.variants[bits].entry_points[1];
        assert_eq!(fragment.name, "fragment");
        fragment.bindings.iter().map(|b| (b.name.clone(), b.set, b.binding, b.kind)).collect()
    };
    let input = |name: &str, binding, index| (name.to_owned(), 0, binding, ResourceKind::InputAttachment { index });
    let rest = [
        ("lights".to_owned(), 1, 0, ResourceKind::StorageBuffer { read_only: true }),
        ("noise".to_owned(), 1, 1, ResourceKind::SampledImage),
        ("noise_sampler".to_owned(), 1, 2, ResourceKind::Sampler),
    ];
    let few = [input("subpass_albedo", 0, 0), input("subpass_depth", 3, 1)];
    let many = [input("subpass_albedo", 0, 0), input("subpass_normal", 1, 1), input("subpass_depth", 3, 2)];
    assert_eq!(bindings(0), [&few[..], &rest[..]].concat());
    assert_eq!(bindings(1), [&many[..], &rest[..]].concat());
}

#[test]
fn an_entry_point_has_only_what_it_uses() {
    let shader = lighting();
    let vertex = &shader.variants[3].entry_points[0];
    assert!(vertex.bindings.is_empty());
    assert_eq!(vertex.push_constants.as_ref().map(|push| push.size()), Some(64));
    let inputs: Vec<_> = vertex.vertex_inputs.iter().map(|i| (i.name.as_str(), i.location, i.components)).collect();
    assert_eq!(inputs, [("position", 0, 3), ("material", 2, 1)]);
    assert_eq!(all(&module(vertex), Op::Function).len(), 1);
    assert!(
        shader.variants[0].entry_points[0] == shader.variants[3].entry_points[0],
        "the vertex shader is the same in all variants"
    );
}

#[test]
fn constants_keep_their_ids_in_every_variant() {
    let shader = lighting();
    let found: Vec<_> = shader.constants.iter().map(|c| (c.name.as_str(), c.id, c.default)).collect();
    assert_eq!(
        found,
        [
            ("LIGHT_MODEL", 0, ScalarValue::U32(1)),
            ("SCALE", 1, ScalarValue::F32(0.5_f32.to_bits())),
            ("FANCY", 8, ScalarValue::Bool(false)),
        ]
    );
    let fragment = module(&shader.variants[0].entry_points[1]);
    assert_eq!(all(&fragment, Op::SpecConstant).len(), 2);
    assert_eq!(all(&fragment, Op::SpecConstantFalse).len(), 1);
}

#[test]
fn rust_is_written_with_equal_modules_once() {
    let directory = std::env::temp_dir().join(format!("afterlight-shader-compiler-{}", std::process::id()));
    std::fs::create_dir_all(&directory).expect("a temporary directory");
    let written = write_rust(&[lighting()], &directory).expect("written");
    let rust = std::fs::read_to_string(directory.join("shaders.rs")).expect("the Rust file");
    let packed = std::fs::read(directory.join("shaders.zst")).expect("the packed modules");
    std::fs::remove_dir_all(&directory).expect("removed");
    assert_eq!(rust.matches("static ENTRY_").count(), 5, "one vertex and four fragment shaders");
    assert_eq!((written.modules, written.packed), (5, packed.len()));
    assert!(rust.contains("static BLOCKS: [Block; 1]") && written.packed < written.bytes / 2);
    let spirv = zstd::bulk::decompress(&packed, written.bytes).expect("unpacked");
    assert_eq!(spirv.len(), written.bytes);
    // Each packed module equals an entry point of the shader except for ids, and each entry point is among the modules.
    let words: Vec<u32> =
        spirv.chunks_exact(4).map(|word| u32::from_ne_bytes([word[0], word[1], word[2], word[3]])).collect();
    let starts: Vec<usize> = (0..words.len()).filter(|at| words[*at] == 0x0723_0203).collect();
    let ends = starts.iter().copied().skip(1).chain([words.len()]);
    let modules: Vec<&[u32]> = starts.iter().zip(ends).map(|(start, end)| &words[*start..end]).collect();
    assert_eq!(modules.len(), 5);
    let shader = lighting();
    let entries: Vec<_> = shader.variants.iter().flat_map(|variant| &variant.entry_points).collect();
    for module in &modules {
        assert!(entries.iter().any(|entry| same_but_for_ids(&entry.spirv, module)));
        validate(&CompiledEntryPoint { spirv: module.to_vec(), ..entries[0].clone() });
    }
    assert!(entries.iter().all(|entry| modules.iter().any(|module| same_but_for_ids(&entry.spirv, module))));
    for expected in [
        "pub mod lighting {",
        "flags!(NORMALS = 0, TONEMAP = 1);",
        "pub const EXPOSURE: usize = 48;",
        "pub const LIST_STRIDE: usize = 32;",
    ] {
        assert!(rust.contains(expected), "{expected} is missing");
    }
}

#[test]
fn an_empty_directory_gives_an_empty_file() {
    assert_eq!(compile_directory(Path::new("/nonexistent/shaders")), Ok(Vec::new()));
}
