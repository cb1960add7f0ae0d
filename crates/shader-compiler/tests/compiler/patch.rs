//! The patch on real WGSL: its effect on subpass inputs, overrides and decorations.

use crate::common::{all, compile, error, module, only, validate};
use afterlight_shader_compiler::ScalarValue;
use rspirv::dr::{Module, Operand};
use rspirv::spirv::{Capability, Decoration, Dim, ImageOperands, Op};

/// A fragment shader with the globals `declarations` that returns `value`.
fn fragment(declarations: &str, value: &str) -> String {
    format!("{declarations}\n@fragment\nfn fragment() -> @location(0) vec4<f32> {{\n    return {value};\n}}\n")
}

fn subpass_types(module: &Module) -> usize {
    let subpass = Operand::Dim(Dim::DimSubpassData);
    all(module, Op::TypeImage).iter().filter(|image| image.operands[1] == subpass).count()
}

fn decorations(module: &Module, decoration: Decoration) -> Vec<u32> {
    let mut values = Vec::new();
    for annotation in all(module, Op::Decorate) {
        match annotation.operands[1..] {
            [Operand::Decoration(found)] if found == decoration => values.push(0),
            [Operand::Decoration(found), Operand::LiteralBit32(value)] if found == decoration => values.push(value),
            _ => {}
        }
    }
    values
}

#[test]
fn each_type_of_subpass_input_is_read() {
    let types = [
        ("texture_2d<f32>", "textureLoad(subpass_in, vec2<i32>(0, 0), 0)"),
        ("texture_2d<u32>", "vec4<f32>(textureLoad(subpass_in, vec2<u32>(0u, 0u), 0))"),
        ("texture_2d<i32>", "vec4<f32>(textureLoad(subpass_in, vec2<i32>(), 0))"),
        ("texture_depth_2d", "vec4<f32>(textureLoad(subpass_in, vec2(0), 0))"),
        ("texture_multisampled_2d<f32>", "textureLoad(subpass_in, vec2<i32>(0, 0), 1)"),
        ("texture_depth_multisampled_2d", "vec4<f32>(textureLoad(subpass_in, vec2<i32>(0, 0), 1))"),
    ];
    for (ty, read) in types {
        let shader = compile(&fragment(&format!("@group(1) @binding(4) var subpass_in: {ty};"), read));
        validate(only(&shader));
        let module = module(only(&shader));
        assert_eq!(
            (subpass_types(&module), all(&module, Op::ImageFetch).len(), all(&module, Op::ImageRead).len()),
            (1, 0, 1),
            "{ty}"
        );
        assert_eq!(decorations(&module, Decoration::InputAttachmentIndex), [0], "{ty}");
        let sample = all(&module, Op::ImageRead)[0].operands.get(2).cloned();
        assert_eq!(
            sample,
            ty.contains("multisampled").then_some(Operand::ImageOperands(ImageOperands::SAMPLE)),
            "{ty}"
        );
    }
}

#[test]
fn ordinary_textures_stay_as_they_are() {
    let declarations = "
        @group(0) @binding(0) var ordinary: texture_2d<f32>;
        @group(0) @binding(1) var subpass_in: texture_2d<f32>;";
    let read = "textureLoad(subpass_in, vec2<i32>(0, 0), 0) + textureLoad(ordinary, vec2<i32>(0, 0), 0)";
    let shader = compile(&fragment(declarations, read));
    validate(only(&shader));
    let module = module(only(&shader));
    assert_eq!((all(&module, Op::ImageFetch).len(), all(&module, Op::ImageRead).len()), (1, 1));
    let without = compile(&fragment(
        "@group(0) @binding(0) var ordinary: texture_2d<f32>;",
        "textureLoad(ordinary, vec2<i32>(0, 0), 0)",
    ));
    assert_eq!(decorations(&module, Decoration::InputAttachmentIndex), [0]);
    let capability = Operand::Capability(Capability::InputAttachment);
    let capable = |module: &Module| module.capabilities.iter().any(|has| has.operands[0] == capability);
    assert!(capable(&module) && !capable(&crate::common::module(only(&without))));
}

#[test]
fn inputs_are_indexed_by_binding_whatever_their_order() {
    let declarations = "
        @group(0) @binding(9) var subpass_c: texture_2d<f32>;
        @group(0) @binding(2) var subpass_b: texture_2d<f32>;
        @group(0) @binding(5) var subpass_unused: texture_2d<f32>;
        @group(0) @binding(0) var subpass_a: texture_2d<u32>;";
    let zero = "vec2<i32>(0, 0), 0";
    let value = format!(
        "textureLoad(subpass_c, {zero}) + textureLoad(subpass_b, {zero}) * vec4<f32>(textureLoad(subpass_a, {zero}))"
    );
    let shader = compile(&fragment(declarations, &value));
    validate(only(&shader));
    let bindings: Vec<_> =
        only(&shader).bindings.iter().map(|binding| (binding.name.as_str(), format!("{:?}", binding.kind))).collect();
    let expected = [("subpass_a", 0), ("subpass_b", 1), ("subpass_c", 2)];
    let expected: Vec<_> = expected.map(|(name, index)| (name, format!("InputAttachment {{ index: {index} }}"))).into();
    assert_eq!(bindings, expected);
    assert_eq!(subpass_types(&module(only(&shader))), 2, "one type for each sampled type");
}

#[test]
fn loads_in_helpers_loops_and_branches_are_found() {
    let text = "
        @group(0) @binding(0) var subpass_in: texture_2d<f32>;
        fn helper(scale: f32) -> vec4<f32> { return scale * textureLoad(subpass_in, vec2<i32>(0, 0), 0); }
        @fragment
        fn fragment(@location(0) @interpolate(flat) count: u32) -> @location(0) vec4<f32> {
            var sum = helper(1.0);
            for (var i = 0u; i < count; i++) {
                if i % 2u == 0u {
                    sum += textureLoad(subpass_in, vec2<i32>(0, 0), 0);
                } else {
                    sum += helper(2.0);
                }
            }
            return sum + textureLoad(subpass_in, vec2<i32>(0, 0), 0);
        }";
    let shader = compile(text);
    validate(only(&shader));
    let module = module(only(&shader));
    assert_eq!((all(&module, Op::ImageFetch).len(), all(&module, Op::ImageRead).len()), (0, 3));
}

#[test]
fn wrong_uses_are_refused() {
    let texture = "@group(0) @binding(0) var subpass_in: texture_2d<f32>;";
    let other_pixel = error(&fragment(texture, "textureLoad(subpass_in, vec2<i32>(0, 1), 0)"));
    assert!(
        other_pixel.message.contains("`subpass_in` is read at other coordinates than (0, 0) in `fragment`"),
        "{other_pixel}"
    );
    assert_eq!(other_pixel.location.map(|at| (at.line, at.column)), Some((1, 27)));
    let other_level = error(&fragment(texture, "textureLoad(subpass_in, vec2<i32>(0, 0), 1)"));
    assert!(other_level.message.contains("at another level than 0"), "{other_level}");
    let passed = error(&fragment(
        &format!("{texture}\nfn f(t: texture_2d<f32>) -> vec4<f32> {{ return textureLoad(t, vec2<i32>(0, 0), 0); }}"),
        "f(subpass_in)",
    ));
    assert!(passed.message.contains("`subpass_in` is passed to the function `f`"), "{passed}");
    let array = error(&fragment(
        "@group(0) @binding(0) var subpass_in: texture_2d_array<f32>;",
        "textureLoad(subpass_in, vec2<i32>(0, 0), 0, 0)",
    ));
    assert!(array.message.contains("must be a texture_2d"), "{array}");
    let storage = error(&fragment(
        "@group(0) @binding(0) var subpass_in: texture_storage_2d<rgba8unorm, read>;",
        "textureLoad(subpass_in, vec2<i32>(0, 0))",
    ));
    assert!(storage.message.contains("must be a texture_2d"), "{storage}");
    let vertex =
        "@vertex\nfn v() -> @builtin(position) vec4<f32> { return textureLoad(subpass_in, vec2<i32>(0, 0), 0); }";
    let vertex = error(&format!("{texture}\n{vertex}"));
    assert!(vertex.message.contains("`v`, which is no fragment shader"), "{vertex}");
}

#[test]
fn overrides_are_specialization_constants_with_their_defaults() {
    let declarations = "
        override ON = true;
        override OFF: bool = bool();
        override COUNT: u32 = 3u * 2u;
        override SHIFT: i32 = -4;
        override ZERO: u32 = u32();
        override GAIN = 0.25;";
    let value = "select(vec4<f32>(GAIN), vec4<f32>(f32(COUNT) + f32(ZERO)), ON && !OFF) + f32(SHIFT)";
    let shader = compile(&fragment(declarations, value));
    validate(only(&shader));
    let module = module(only(&shader));
    let mut values: Vec<_> =
        all(&module, Op::SpecConstant).iter().map(|constant| constant.operands[0].clone()).collect();
    values.sort_by_key(|value| format!("{value:?}"));
    let mut expected = [6, (-4_i32) as u32, 0, 0.25_f32.to_bits()].map(Operand::LiteralBit32);
    expected.sort_by_key(|value| format!("{value:?}"));
    assert_eq!(values, expected);
    assert_eq!((all(&module, Op::SpecConstantTrue).len(), all(&module, Op::SpecConstantFalse).len()), (1, 1));
    let mut ids = decorations(&module, Decoration::SpecId);
    ids.sort_unstable();
    assert_eq!(ids, [0, 1, 2, 3, 4, 5]);
    use ScalarValue::{Bool, F32, I32, U32};
    let reflected: Vec<_> = shader.constants.iter().map(|constant| constant.default).collect();
    assert_eq!(reflected, [Bool(true), Bool(false), U32(6), I32(-4), U32(0), F32(0.25_f32.to_bits())]);
}

#[test]
fn overrides_cannot_be_assigned_to() {
    let assigned = error(
        "override GAIN = 1.0;\n@fragment\nfn fragment() -> @location(0) vec4<f32> {\n    GAIN = 2.0;\n    return vec4<f32>(GAIN);\n}\n",
    );
    assert!(assigned.message.contains("override `GAIN` is assigned to"), "{assigned}");
    let vector = error(&fragment("override TINT: vec4<f32> = vec4<f32>(1.0);", "TINT"));
    assert!(vector.message.contains("`TINT` must be a bool, u32, i32 or f32"), "{vector}");
    let bare = error(&fragment("override GAIN: f32;", "vec4<f32>(GAIN)"));
    assert!(bare.message.contains("`GAIN` needs a default value"), "{bare}");
    let twice = error(&fragment("@id(1) override A = 1.0;\n@id(1) override B = 2.0;", "vec4<f32>(A, B, A, B)"));
    assert!(twice.message.contains("the id 1 of the override `B` is taken"), "{twice}");
}

#[test]
fn positions_are_invariant_and_precise_arithmetic_is_not_contracted() {
    let vertex = "@vertex\nfn vertex(@location(0) p: vec3<f32>) -> @builtin(position) vec4<f32> { return vec4<f32>(p * 2.0 + 1.0, dot(p, p)); }\n";
    let (plain, precise) = (compile(vertex), compile(&format!("// precise\n{vertex}")));
    validate(only(&precise));
    let (plain, precise) = (module(only(&plain)), module(only(&precise)));
    assert_eq!(decorations(&plain, Decoration::Invariant).len(), 1);
    assert_eq!(decorations(&plain, Decoration::NoContraction).len(), 0);
    assert_eq!(decorations(&precise, Decoration::NoContraction).len(), 3, "a product, a sum and a dot product");
}

#[test]
fn textures_that_invocations_index_differently_are_declared_and_decorated_so() {
    let text = |index: &str| {
        format!(
            "enable wgpu_binding_array;\n@group(0) @binding(0) var textures: binding_array<texture_2d<f32>, 4>;\n\
             @group(0) @binding(1) var samplers: binding_array<sampler, 4>;\n@fragment\n\
             fn fragment(@location(0) @interpolate(flat) own: u32) -> @location(0) vec4<f32> {{\n    \
             return textureSampleLevel(textures[{index}], samplers[{index}], vec2(0.5), 0.0);\n}}\n"
        )
    };
    let [one, many] = ["2u", "own"].map(|index| {
        let shader = compile(&text(index));
        validate(only(&shader));
        module(only(&shader))
    });
    for own in [Capability::SampledImageArrayDynamicIndexing, Capability::SampledImageArrayNonUniformIndexing] {
        let declared = |module: &Module| {
            let own = [Operand::Capability(own)];
            module.capabilities.iter().filter(|found| found.operands == own).count()
        };
        assert_eq!((declared(&one), declared(&many)), (0, 1), "{own:?}");
    }
    assert_eq!(decorations(&one, Decoration::NonUniform).len(), 0);
    let sampled = all(&many, Op::SampledImage);
    assert_eq!(sampled.len(), 1);
    let sampled = Operand::IdRef(sampled[0].result_id.expect("a result"));
    let decorated = |own: &Operand| {
        let operands = [own.clone(), Operand::Decoration(Decoration::NonUniform)];
        all(&many, Op::Decorate).iter().any(|annotation| annotation.operands == operands)
    };
    assert!(decorated(&sampled) && all(&many, Op::SampledImage)[0].operands.iter().all(decorated));
}
