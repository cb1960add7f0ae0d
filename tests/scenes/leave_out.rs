//! Parts that a scene does not need are left out, and nobody can tell by the picture: proofs over scenes that each lack something.
//!
//! - The picture equals the full plan's, which keeps every part with neutral input: to the last bit, but for the parts in [`INEXACT`], whose bounds
//!   stand there with their reasons.
//! - A part that is left out leaves no trace: no object by its name, no label, no descriptor, and no bytes. The names exist as soon as the part is
//!   kept, so that the list of traces cannot go stale.

use std::collections::{BTreeMap, BTreeSet};

use crate::common::compare::{assert_identical, largest_code_difference};
use crate::common::gpu::{Gpu, bytes, on_gpu};
use crate::common::scenes::sprites;
use crate::common::stage::{add, beam, directional, lambert, open, own, plane, point, rectangle, spot, stage, sun};
use crate::common::{some_of, tries_all};
use afterlight::frame::Picture;
use afterlight::gpu::MemoryKind;
use afterlight::plan::{FramePlan, PartGroup};
use afterlight::scene::builtin::shapes;
use afterlight::scene::{
    AlphaMode, Anisotropy, BlockFormat, Brdf, ColorSpace, DiffuseTransmission, Environment, Falloff, HdrFormat, Keep,
    LightPath, Material, OptionalPart as P, Scene, Settings, Sheen, Texels, Texture, TextureSlot, ThinFilm, UvMap,
};
use glam::{DAffine3, DVec3, Vec3};

const SIZE: [u32; 2] = [64, 36];

/// The greatest distance of a picture from the lean plan's picture.
#[derive(Debug, Clone, Copy)]
struct Bound {
    /// Codes of 8 bits that a channel may differ by, and the share of the pixels that may differ by more.
    codes: u8,
    beyond: f64,
}

// ANCHOR: inexact
/// Parts that legitimately change bits when they are kept, by how much, and why.
const INEXACT: &[(P, Bound, &str)] = &[(
    P::ConstantTextures,
    Bound { codes: 1, beyond: 0.0 },
    "a driver decodes sRGB texels to fewer bits than the factor has that the texture was folded into",
)];
// ANCHOR_END: inexact

/// Every part that changes no bit.
fn exact() -> Keep {
    INEXACT.iter().fold(Keep::ALL, |keep, &(part, ..)| keep.without(part))
}

struct Case {
    scene: Scene,
    path: LightPath,
    /// Out of the lean plan; why the scene is here.
    lacks: &'static [P],
}

fn texture(name: &str, color_space: ColorSpace, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let texels = (0..64).flat_map(|index| texel(index % 8, index / 8)).collect();
    Texture { name: name.into(), size: [8, 8], color_space, sampler: Default::default(), texels }
}

fn checks() -> Texture {
    texture("checks", ColorSpace::Srgb, |x, y| if (x + y) % 2 == 0 { [255, 200, 40, 255] } else { [30, 60, 200, 255] })
}

fn holes() -> Texture {
    texture("holes", ColorSpace::Srgb, |x, y| [200, 200, 200, if (x + y) % 2 == 0 { 255 } else { 0 }])
}

pub fn bumps() -> Texture {
    texture("bumps", ColorSpace::Linear, |x, y| [100 + 8 * x as u8, 156 - 8 * y as u8, 240, 255])
}

/// A texture of BC7 blocks of mode 5, each of one grey.
fn blocks() -> Texture {
    let block =
        |grey: u128| (1u128 << 5 | (0..6).map(|at| grey << (8 + 7 * at)).sum::<u128>() | 0xffff << 50).to_le_bytes();
    let levels = [vec![20, 90, 60, 127], vec![70], vec![70], vec![70]];
    let levels = levels.map(|greys| greys.into_iter().flat_map(block).collect()).to_vec();
    let texels = Texels::Blocks { format: BlockFormat::Bc7, levels };
    Texture { texels, color_space: ColorSpace::Linear, ..checks() }
}

fn plain(name: &str, texel: [u8; 4]) -> Texture {
    texture(name, ColorSpace::Srgb, move |_, _| texel)
}

fn at(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// A box over a plane, under a light.
fn boxed(name: &str, material: Material, lights: Vec<afterlight::scene::Light>) -> Scene {
    let mut scene = plane(lambert(0.6), lights);
    scene.name = name.into();
    add(&mut scene, shapes::cuboid([0.5; 3]), material, at(0.1, 0.1, 0.3));
    scene
}

fn with_textures(mut scene: Scene, textures: Vec<Texture>) -> Scene {
    scene.textures = textures;
    scene
}

fn cases() -> Vec<Case> {
    use LightPath::{Clustered, Forward, Loop, PerLight};
    let slanted = DVec3::new(0.5, 0.3, 1.0);
    let lamp = |x, range| point(DVec3::new(x, 0.4, 1.0), 3.0, range, Falloff::InverseSquare);
    let cone = || spot(DVec3::new(0.0, 0.0, 1.6), 3.0, 15.0, 30.0);
    let metal = Material { metallic: 1.0, roughness: 0.4, ..Material::default() };
    let phong = Material { brdf: Brdf::Phong, specular: Vec3::splat(0.3), shininess: 20.0, ..Material::default() };
    let phong_again = phong.clone();
    let textured = |slot: fn(&mut Material) -> &mut Option<usize>, base: Material| {
        let mut material = base;
        *slot(&mut material) = Some(0);
        material
    };
    let ambient = |mut scene: Scene| {
        scene.environment = Environment { ambient: Vec3::new(0.3, 0.4, 0.5), ..scene.environment };
        scene
    };
    let emitting = Material { emissive: Vec3::new(2.0, 1.0, 0.5), ..lambert(0.4) };
    let glass = Material { alpha_mode: AlphaMode::Blend, alpha: 0.4, ..Material::default() };
    let masked = Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, two_sided: true, ..lambert(0.8) };
    let mut unused = with_textures(
        boxed("unused", lambert(0.5), vec![directional(slanted, 3.0)]),
        vec![Texture { name: "nobody's".into(), ..checks() }],
    );
    unused.materials.push(Material { base_color_texture: Some(0), ..lambert(1.0) });
    unused.meshes.push(shapes::sphere(0.3, 8).finish("nobody's"));
    let mut idle = boxed("idle lights", lambert(0.5), vec![directional(slanted, 3.0)]);
    idle.lights.push(point(DVec3::new(0.0, 0.0, 900.0), 3.0, Some(2.0), Falloff::Quadratic));
    let mut hidden = boxed("hidden", lambert(0.5), vec![sun(slanted, 3.0)]);
    add(&mut hidden, shapes::cuboid([0.2; 3]), lambert(0.7), at(40.0, 0.0, 0.3));
    let case = |path, lacks, scene| Case { scene, path, lacks };
    vec![
        case(Clustered, &[P::Uvs, P::LightLists, P::DirectionalLights], Scene { name: "empty".into(), ..stage() }),
        case(
            Clustered,
            &[P::DirectionalLights, P::PunctualLights, P::ShadowMaps],
            ambient(boxed("ambient only", lambert(0.5), Vec::new())),
        ),
        case(
            Clustered,
            &[
                P::HdrTarget,
                P::MaterialTarget,
                P::SpecularTarget,
                P::BrdfByPixel,
                P::AmbientLight,
                P::PunctualLights,
                P::ShadowMaps,
                P::WideIndices,
            ],
            boxed("one light", lambert(0.5), vec![directional(slanted, 3.0)]),
        ),
        case(
            Clustered,
            &[P::GeometricNormalChannels, P::NormalMaps, P::Tangents, P::IdleCasters],
            boxed("sun and shadow", Material::default(), vec![sun(slanted, 3.0)]),
        ),
        case(
            Clustered,
            &[P::SpotCones, P::Beams, P::Falloffs, P::DirectionalLights],
            boxed("lamps", metal.clone(), vec![lamp(-0.5, Some(4.0)), lamp(0.5, Some(3.0))]),
        ),
        case(PerLight, &[P::LightRanges, P::MetallicChannel], boxed("a cone", Material::default(), vec![cone()])),
        case(
            Clustered,
            &[P::SpotCones, P::LightRanges],
            boxed("a beam", Material::default(), vec![beam(1.6 * slanted, -slanted, 3.0, [0.6, 0.3], None)]),
        ),
        case(Loop, &[P::LightRanges, P::Uvs], boxed("metal", metal.clone(), vec![lamp(0.3, None)])),
        case(Clustered, &[P::MetallicChannel, P::Emissive], boxed("phong", phong, vec![cone(), lamp(0.4, Some(2.0))])),
        case(
            Clustered,
            &[P::NormalMaps, P::Tangents, P::AlphaMasks],
            with_textures(
                boxed("a texture", textured(|m| &mut m.base_color_texture, lambert(1.0)), vec![sun(slanted, 3.0)]),
                vec![checks()],
            ),
        ),
        case(
            Clustered,
            &[P::BaseColorTextures, P::EmissiveTextures],
            with_textures(
                boxed("bumps", textured(|m| &mut m.normal_texture, metal), vec![sun(slanted, 3.0), lamp(0.2, None)]),
                vec![bumps()],
            ),
        ),
        case(
            Clustered,
            &[P::Transparent, P::HdrTarget],
            with_textures(
                boxed("holes", textured(|m| &mut m.base_color_texture, masked.clone()), vec![sun(slanted, 3.0)]),
                vec![holes()],
            ),
        ),
        case(Clustered, &[P::NormalMaps, P::VertexColors, P::PunctualLights], sprites()),
        // Features of glTF alone: vertices with colours and second coordinates here, reflectances, a coat and something unlit below.
        case(Clustered, &[P::HdrTarget, P::Transparent], {
            let mut worn =
                textured(|m| &mut m.base_color_texture, Material { alpha_mode: masked.alpha_mode, ..lambert(0.9) });
            worn.uv_maps[0] = UvMap { set: 1, rotation: 0.4, ..UvMap::IDENTITY };
            let mut scene = boxed("painted", worn, vec![sun(slanted, 3.0)]);
            let mesh = &mut scene.meshes[1];
            mesh.uvs_1 = mesh.uvs.iter().map(|[u, v]| [v * 0.5, u + 0.25]).collect();
            mesh.colors = mesh
                .uvs
                .iter()
                .map(|uv| uv.map(|at| at.fract().abs()))
                .map(|[u, v]| [u, v, 0.5, 1.0 - 0.25 * v])
                .collect();
            with_textures(scene, vec![holes()])
        }),
        case(Clustered, &[P::SecondUvs, P::VertexColors, P::Looks, P::ShadowMaps], {
            let base = Material { reflectance: Vec3::new(0.2, 0.1, 0.05), grazing: 0.7, ..Material::default() };
            let mut scene = ambient(boxed("lacquered", base, vec![directional(slanted, 3.0)]));
            let coat = Material { alpha_mode: AlphaMode::Coat, roughness: 0.2, ..Material::default() };
            add(&mut scene, shapes::cuboid([0.5; 3]), coat, at(0.1, 0.1, 0.3));
            let sign = Material { unlit: true, base_color: Vec3::new(0.2, 0.4, 0.1), ..Material::default() };
            add(&mut scene, rectangle([-0.4, -0.3], [0.5, 0.3], 0.0), sign, at(0.0, -0.4, 0.8));
            scene
        }),
        case(Clustered, &[P::Transparent, P::Uvs], boxed("glow", emitting, vec![lamp(0.0, Some(3.0))])),
        case(Clustered, &[P::Emissive, P::ShadowMaps], {
            let mut scene = boxed("glass", lambert(0.5), vec![directional(slanted, 3.0)]);
            add(&mut scene, rectangle([-0.4, -0.3], [0.5, 0.3], 0.0), glass, at(0.0, 0.0, 0.8));
            scene
        }),
        // With a texture in every slot of one or the other, and lamps of every fall-off.
        case(Clustered, &[P::Transparent, P::UnusedTextures], {
            let slots = |m: &mut Material| {
                for (slot, own) in TextureSlot::ALL.into_iter().zip([0, 1, 2, 2, 0, 0, 2, 0, 2, 2, 0]) {
                    *m.texture_mut(slot) = Some(own);
                }
            };
            let lobes = Material {
                sheen: Sheen { color: Vec3::splat(0.5), roughness: 0.4 },
                film: ThinFilm { strength: 0.5, ..ThinFilm::NONE },
                anisotropy: Anisotropy { strength: 0.5, rotation: 1.0 },
                diffuse_transmission: DiffuseTransmission { strength: 0.5, color: Vec3::ONE },
                ..Material::default()
            };
            let (mut first, mut second) = (Material { emissive: Vec3::ONE, ..lobes }, phong_again);
            slots(&mut first);
            slots(&mut second);
            let dim = point(DVec3::new(0.6, -0.4, 1.0), 2.0, Some(3.0), Falloff::Quadratic);
            let mut scene = ambient(boxed("every texture", first, vec![lamp(-0.5, None), dim]));
            add(&mut scene, shapes::cuboid([0.3; 3]), second, at(-0.5, 0.2, 0.4));
            let rough = Texture { color_space: ColorSpace::Linear, name: "rough".into(), ..checks() };
            with_textures(scene, vec![checks(), bumps(), rough])
        }),
        case(
            Clustered,
            &[P::ConstantTextures],
            with_textures(
                boxed(
                    "one colour",
                    textured(|m| &mut m.base_color_texture, lambert(0.9)),
                    vec![directional(slanted, 3.0)],
                ),
                vec![plain("ochre", [180, 120, 40, 255])],
            ),
        ),
        case(
            Clustered,
            &[P::OpaqueMasks, P::AlphaMasks],
            with_textures(
                boxed(
                    "no holes",
                    textured(|m| &mut m.base_color_texture, Material { two_sided: false, ..masked }),
                    vec![sun(slanted, 3.0)],
                ),
                vec![checks()],
            ),
        ),
        case(
            Clustered,
            &[P::DecodedTextures],
            with_textures(
                boxed("blocks", textured(|m| &mut m.base_color_texture, lambert(0.9)), vec![sun(slanted, 3.0)]),
                vec![blocks()],
            ),
        ),
        case(Clustered, &[P::UnusedTextures, P::UnusedMeshes], unused),
        case(Clustered, &[P::IdleLights, P::PunctualLights], idle),
        case(Clustered, &[P::OffscreenObjects], hidden),
        case(Forward, &[P::Uvs, P::ShadowMaps], boxed("forward", lambert(0.5), vec![directional(slanted, 3.0)])),
        case(Forward, &[P::LightRanges], boxed("forward, lit from all sides", Material::default(), vec![cone()])),
        case(Clustered, &[], open("builtin:hall")),
        case(Loop, &[], open("builtin:cornell")),
        case(
            LightPath::Compute,
            &[P::Transparent],
            boxed("by compute", Material::default(), vec![lamp(0.1, Some(4.0))]),
        ),
    ]
}

/// With an HDR target that rounds nothing, so that only the parts make a difference.
fn settings(case: &Case, keep: Keep) -> Settings {
    let [width, height] = SIZE;
    Settings { keep, light_path: case.path, hdr_format: HdrFormat::Rgba32f, ..own(&case.scene, width, height) }
}

fn out(plan: &FramePlan) -> BTreeSet<P> {
    plan.parts().iter().filter(|part| !part.included).filter_map(|part| part.optional).collect()
}

fn draw(gpu: &Gpu, case: &Case, keep: Keep) -> Picture {
    gpu.draw(&case.scene, &settings(case, keep))
}

#[test]
fn every_part_is_left_out_somewhere_and_needed_somewhere() {
    on_gpu(|gpu| {
        let (mut left_out, mut needed) = (BTreeSet::new(), BTreeSet::new());
        for case in cases() {
            let renderer = gpu.renderer(&case.scene, &settings(&case, Keep::NONE));
            let out = out(renderer.plan());
            for part in case.lacks {
                assert!(out.contains(part), "{}: {part} is not left out", case.scene.name);
            }
            let own = renderer.plan().parts().iter().filter(|part| part.included).filter_map(|part| part.optional);
            needed.extend(own);
            left_out.extend(out);
        }
        let parts: BTreeSet<P> = P::all().collect();
        // Everything lit reads normals; occluded objects need a large scene, which has a separate test.
        let always = BTreeSet::from([P::Normals, P::OccludedObjects]);
        let missing: Vec<_> = parts.difference(&left_out).filter(|part| !always.contains(part)).collect();
        assert!(missing.is_empty(), "no scene lacks {missing:?}");
        // Parts that a plan never has by itself: waste, and a G-buffer in memory, which no pass needs.
        let waste = BTreeSet::from([
            P::StoredGbuffer,
            P::DecodedTextures,
            P::UnusedMeshes,
            P::UnusedTextures,
            P::ConstantTextures,
            P::OpaqueMasks,
            P::IdleLights,
            P::IdleCasters,
            P::OffscreenObjects,
            P::OccludedObjects,
            P::WideIndices,
        ]);
        let unneeded: Vec<_> = parts.difference(&needed).filter(|part| !waste.contains(part)).collect();
        assert!(unneeded.is_empty(), "no scene needs {unneeded:?}");
    });
}

#[test]
fn the_full_plan_draws_the_same_bits() {
    on_gpu(|gpu| {
        for (turn, case) in cases().into_iter().enumerate() {
            if turn % 2 != 0 && !tries_all() {
                continue;
            }
            let (lean, full) = (draw(gpu, &case, Keep::NONE), draw(gpu, &case, exact()));
            let colors: BTreeSet<&[u8]> = bytes(&lean).chunks_exact(4).collect();
            assert!(colors.len() > 1 || case.scene.objects.is_empty(), "{}: there is nothing to see", case.scene.name);
            assert_identical(&lean, &full, &case.scene.name);
            // Parts that change bits are kept alone below.
            if turn % 6 != 0 && !tries_all() {
                continue;
            }
            let all = draw(gpu, &case, Keep::ALL);
            let most = INEXACT.iter().fold(Bound { codes: 0, beyond: 0.0 }, |most, &(_, bound, _)| Bound {
                codes: most.codes.max(bound.codes),
                beyond: most.beyond + bound.beyond,
            });
            assert_within(&lean, &all, most, &format!("{} with everything", case.scene.name));
        }
    });
}

fn assert_within(lean: &Picture, kept: &Picture, bound: Bound, what: &str) {
    let pairs = bytes(lean).chunks_exact(4).zip(bytes(kept).chunks_exact(4));
    let differs = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > bound.codes);
    let beyond = pairs.filter(|&pair| differs(pair)).count() as f64 / f64::from(SIZE[0] * SIZE[1]);
    assert!(beyond <= bound.beyond, "{what}: {beyond} of the pixels");
}

#[test]
#[ignore = "test-all: all parts of the plan together stay"]
fn every_part_alone_draws_the_same_bits() {
    on_gpu(|gpu| {
        let mut kept_in = BTreeMap::new();
        for case in cases() {
            let renderer = gpu.renderer(&case.scene, &settings(&case, Keep::NONE));
            let out = out(renderer.plan());
            let lean = draw(gpu, &case, Keep::NONE);
            for part in exact().parts().filter(|part| out.contains(part)) {
                // A part that one scene can do without is hardly needed by the twentieth: `make test-all` tries them all.
                let times = kept_in.entry(part).or_insert(0);
                *times += 1;
                if *times > 1 && !tries_all() {
                    continue;
                }
                let kept = draw(gpu, &case, Keep::NONE.with(part));
                assert_identical(&lean, &kept, &format!("{} with {part}", case.scene.name));
            }
        }
    });
}

#[test]
fn what_changes_bits_stays_within_its_bound() {
    on_gpu(|gpu| {
        for case in some_of(cases(), 6) {
            let lean = draw(gpu, &case, Keep::NONE);
            for &(part, bound, why) in INEXACT {
                let kept = draw(gpu, &case, Keep::NONE.with(part));
                let what = format!("{} with {part} ({why})", case.scene.name);
                assert_within(&lean, &kept, bound, &what);
            }
        }
    });
}

/// An HDR target of the default format rounds to 11 bits: half a code of 8 bits at most, so one after rounding.
#[test]
#[ignore = "test-all: all parts of the plan together stay"]
fn the_default_hdr_format_changes_one_code_at_most() {
    on_gpu(|gpu| {
        for case in cases() {
            let with = |keep| Settings { hdr_format: HdrFormat::default(), ..settings(&case, keep) };
            let lean = gpu.draw(&case.scene, &with(Keep::NONE));
            let kept = gpu.draw(&case.scene, &with(Keep::NONE.with(P::HdrTarget)));
            let (codes, place) = largest_code_difference(&lean, &kept);
            assert!(codes <= 1, "{}: {codes} codes at {place:?}", case.scene.name);
        }
    });
}

/// The objects and bytes that a device holds for one renderer, and the labels of its frames.
struct Traces {
    objects: Vec<String>,
    descriptors: Vec<String>,
    labels: Vec<String>,
    memory: BTreeMap<MemoryKind, u64>,
    plan: FramePlan,
}

fn traces(gpu: &Gpu, case: &Case, keep: Keep) -> Traces {
    // Objects of earlier renderers are gone before this one is made.
    gpu.device.wait_idle().unwrap_or_else(|error| panic!("{error}"));
    gpu.device.take_labels();
    let mut renderer = gpu.renderer(&case.scene, &settings(case, keep));
    renderer.render(&case.scene.camera).unwrap_or_else(|error| panic!("{error}"));
    renderer.wait().unwrap_or_else(|error| panic!("{error}"));
    Traces {
        objects: gpu.device.live_objects(),
        descriptors: gpu.device.live_descriptors(),
        labels: gpu.device.take_labels(),
        memory: gpu.device.memory_report().kinds.into_iter().map(|(kind, report)| (kind, report.bytes)).collect(),
        plan: renderer.plan().clone(),
    }
}

/// The trace of a part that is kept: parts of objects' names, labels, and how descriptors' names begin and end.
struct Trace {
    part: P,
    objects: &'static [&'static str],
    labels: &'static [&'static str],
    descriptors: &'static [(&'static str, &'static str)],
}

const fn trace(
    part: P,
    objects: &'static [&'static str],
    labels: &'static [&'static str],
    descriptors: &'static [(&'static str, &'static str)],
) -> Trace {
    Trace { part, objects, labels, descriptors }
}

/// Parts that are only a constant or a location in a shader have no object.
const TRACES: &[Trace] = &[
    trace(
        P::HdrTarget,
        &["target Hdr", "tonemap", "HDR input"],
        &["TONEMAP"],
        &[("HDR input", ": 0 INPUT_ATTACHMENT")],
    ),
    trace(P::Transparent, &[], &["TRANSPARENT"], &[]),
    trace(P::MaterialTarget, &["target Material"], &[], &[("G-buffer inputs", ": 3 INPUT_ATTACHMENT")]),
    trace(P::SpecularTarget, &["target Specular"], &[], &[("G-buffer inputs", ": 4 INPUT_ATTACHMENT")]),
    trace(P::Uvs, &["vertex uvs"], &[], &[]),
    trace(P::Tangents, &["vertex tangents"], &[], &[]),
    trace(P::SecondUvs, &["vertex second uvs"], &[], &[]),
    trace(P::VertexColors, &["vertex colours"], &[], &[]),
    trace(P::Looks, &["looks of instances of frame"], &[], &[]),
    trace(P::WideIndices, &["indices of 32 bits"], &[], &[]),
    trace(P::BaseColorTextures, &[], &[], &[("material ", ": 0 SAMPLED_IMAGE")]),
    trace(P::NormalMaps, &[], &[], &[("material ", ": 1 SAMPLED_IMAGE")]),
    trace(P::MetallicRoughnessTextures, &[], &[], &[("material ", ": 2 SAMPLED_IMAGE")]),
    trace(P::OcclusionTextures, &[], &[], &[("material ", ": 3 SAMPLED_IMAGE")]),
    trace(P::EmissiveTextures, &[], &[], &[("material ", ": 4 SAMPLED_IMAGE")]),
    trace(P::SpecularTextures, &[], &[], &[("material ", ": 5 SAMPLED_IMAGE")]),
    trace(P::UnusedTextures, &["texture nobody's"], &[], &[]),
    trace(P::ConstantTextures, &["texture ochre"], &[], &[]),
    trace(P::AlphaMasks, &["discards: true"], &[], &[]),
    trace(P::LightLists, &["light list 2", "light list 3"], &[], &[("set of frame", ": 2 STORAGE_BUFFER")]),
    // ANCHOR: trace-of-shadow-maps
    trace(
        P::ShadowMaps,
        &["shadow atlas", "SHADOW pass", "shadow set layout", "shadow maps of frame"],
        &["SHADOW"],
        &[("shadow set of frame", ": 0 SAMPLED_IMAGE"), ("shadow set of frame", ": 1 UNIFORM_BUFFER")],
    ),
    // ANCHOR_END: trace-of-shadow-maps
];

impl Traces {
    fn object(&self, part: &str) -> Option<&String> {
        self.objects.iter().find(|object| object.contains(part))
    }

    fn descriptor(&self, (begin, end): (&str, &str)) -> Option<&String> {
        self.descriptors.iter().find(|own| own.starts_with(begin) && own.ends_with(end))
    }

    fn label(&self, label: &str) -> Option<&String> {
        self.labels.iter().find(|own| *own == label)
    }

    fn bytes(&self) -> u64 {
        self.memory.values().sum()
    }
}

#[test]
fn what_is_left_out_leaves_no_trace() {
    on_gpu(|gpu| {
        let mut seen = BTreeSet::new();
        for case in cases() {
            let lean = traces(gpu, &case, Keep::NONE);
            let out = out(&lean.plan);
            for Trace { part, objects, labels, descriptors } in TRACES.iter().filter(|own| out.contains(&own.part)) {
                let name = format!("{} without {part}", case.scene.name);
                objects.iter().for_each(|text| assert_eq!(lean.object(text), None, "{name}"));
                descriptors.iter().for_each(|&text| assert_eq!(lean.descriptor(text), None, "{name}"));
                labels.iter().for_each(|label| assert_eq!(lean.label(label), None, "{name}"));
                // Names that were found once while the part was kept are the names to look for in every scene.
                if seen.contains(part) && !tries_all() {
                    continue;
                }
                // All names exist if the part is kept.
                let kept = traces(gpu, &case, Keep::NONE.with(*part));
                let is_there = objects.iter().all(|text| kept.object(text).is_some())
                    && descriptors.iter().all(|&text| kept.descriptor(text).is_some())
                    && labels.iter().all(|label| kept.label(label).is_some());
                if is_there {
                    seen.insert(*part);
                    // Discarding costs no bytes, and a part that draws nothing has no indices to sort.
                    let free = matches!(part, P::AlphaMasks | P::Transparent) && lean.bytes() == kept.bytes();
                    assert!(lean.bytes() < kept.bytes() || free, "{name}: {} >= {}", lean.bytes(), kept.bytes());
                }
            }
            if out.contains(&P::DirectionalLights) && out.contains(&P::PunctualLights) {
                assert_eq!((lean.object("lights of frame"), lean.descriptor(("set of frame", ": 1 "))), (None, None));
            }
        }
        let unseen: Vec<_> = TRACES.iter().map(|trace| trace.part).filter(|part| !seen.contains(part)).collect();
        assert!(unseen.is_empty(), "kept, they have other names: {unseen:?}");
    });
}

/// Each attachment is as large as the plan says, rounded up to the driver's alignment.
#[test]
#[ignore = "test-all: all parts of the plan together stay"]
fn attachments_take_the_bytes_of_the_plan() {
    on_gpu(|gpu| {
        for case in some_of(cases(), 6) {
            for keep in [Keep::NONE, Keep::ALL] {
                let traces = traces(gpu, &case, keep);
                let planned: Vec<u64> = (traces.plan.parts().iter())
                    .filter(|part| part.group == PartGroup::Targets && part.bytes > 0)
                    .map(|part| part.bytes)
                    .collect();
                let (sum, device) = (planned.iter().sum::<u64>(), traces.memory[&MemoryKind::Attachment]);
                let aligned = sum + 4096 * planned.len() as u64;
                assert!((sum..aligned).contains(&device), "{} {keep}: {device} for {sum}", case.scene.name);
            }
        }
    });
}
