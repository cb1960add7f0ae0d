//! Sizes and offsets as the host must have them.

use crate::common::{compile, compile_with, error, only, validate};
use afterlight_shader_compiler::reflect::{NumericType, PushConstants};

#[test]
fn structs_are_laid_out_as_wgsl_says() {
    let shader = compile(
        "struct Inner { direction: vec3<f32>, angle: f32, count: u32 }
        struct Scene {
            ambient: vec3<f32>,
            inner: Inner,
            table: array<Inner, 3>,
            view: mat3x3<f32>,
            size: vec2<u32>,
        }
        struct Tail { count: u32, list: array<vec3<f32>> }
        @group(0) @binding(0) var<uniform> scene: Scene;
        @group(0) @binding(1) var<storage, read_write> tail: Tail;
        @compute @workgroup_size(8, 4)
        fn compute() { tail.list[0] = scene.ambient + scene.inner.direction; }",
    );
    validate(only(&shader));
    let layout = |name: &str| {
        let layout = shader.structs.iter().find(|layout| layout.name == name).expect("reflected");
        let members: Vec<_> =
            layout.members.iter().map(|member| (member.name.as_str(), member.offset, member.stride)).collect();
        (layout.size, layout.align, members)
    };
    assert_eq!(layout("Inner"), (32, 16, vec![("direction", 0, None), ("angle", 12, None), ("count", 16, None)]));
    let scene = vec![
        ("ambient", 0, None),
        ("inner", 16, None),
        ("table", 48, Some(32)),
        ("view", 144, None),
        ("size", 192, None),
    ];
    assert_eq!(layout("Scene"), (208, 16, scene));
    assert_eq!(layout("Tail"), (16, 16, vec![("count", 0, None), ("list", 16, Some(16))]));
    assert_eq!(only(&shader).workgroup_size, [8, 4, 1]);
}

#[test]
fn push_constants_are_those_of_the_entry_point() {
    let shader = compile(
        "struct Push { offset: vec2<f32>, tint: vec3<f32> }
        var<immediate> push: Push;
        @vertex fn vertex() -> @builtin(position) vec4<f32> { return vec4<f32>(push.offset, 0.0, 1.0); }
        @fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(1.0); }",
    );
    let entries = &shader.variants[0].entry_points;
    assert_eq!(entries[0].push_constants.as_ref().map(PushConstants::size), Some(32));
    assert_eq!(entries[1].push_constants, None);
    let Some(PushConstants::Struct(push)) = &shader.push_constants else { panic!("a struct") };
    assert_eq!(push.members.iter().map(|member| member.offset).collect::<Vec<_>>(), [0, 16]);
    let plain = compile(
        "var<immediate> scale: vec2<f32>;\n@fragment fn fragment() -> @location(0) vec2<f32> { return scale; }",
    );
    assert_eq!(plain.push_constants, Some(PushConstants::Plain(8)));
}

#[test]
fn outputs_tell_their_types() {
    let shader = compile(
        "struct Targets { @location(1) normal: vec2<u32>, @location(0) albedo: vec4<f32>, @location(3) mask: i32, @builtin(frag_depth) depth: f32 }
        @fragment fn fragment() -> Targets { return Targets(vec2<u32>(1u), vec4<f32>(1.0), 2, 0.5); }",
    );
    let outputs: Vec<_> =
        only(&shader).fragment_outputs.iter().map(|o| (o.name.as_str(), o.location, o.kind, o.components)).collect();
    use NumericType::{Float, Sint, Uint};
    assert_eq!(outputs, [("albedo", 0, Float, 4), ("normal", 1, Uint, 2), ("mask", 3, Sint, 1)]);
}

#[test]
fn a_layout_that_varies_is_refused() {
    let varies = "// variants: MORE
        struct Push {
        #ifdef MORE
            more: f32,
        #endif
            scale: f32,
        }
        var<immediate> push: Push;
        @fragment fn fragment() -> @location(0) f32 { return push.scale; }";
    let error = error(varies);
    assert!(error.message.contains("layout of the push constants differs between variants"), "{error}");
}

#[test]
fn structs_of_modules_have_their_own_names() {
    let shared = "#define_import_path test::light\nstruct Light { colour: vec3<f32>, range: f32 }\n";
    let text = "#import test::light::Light
        @group(0) @binding(0) var<storage, read> lights: array<Light>;
        @fragment fn fragment() -> @location(0) vec4<f32> { return vec4<f32>(lights[0].colour, 1.0); }";
    let shader = compile_with(text, &[("light.wgsl", shared)]);
    assert_eq!(
        shader.structs.iter().map(|layout| (layout.name.as_str(), layout.size)).collect::<Vec<_>>(),
        [("Light", 16)]
    );
}
