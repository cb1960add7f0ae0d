//! Textures that stay in the blocks of their files are drawn as the texels that the blocks decode to.

use crate::common::compare::largest_code_difference;
use crate::common::gpu::{Gpu, code, on_gpu, places};
use crate::common::stage::{display, lambert, plane};
use afterlight::frame::{Picture, capabilities};
use afterlight::plan::FramePlan;
use afterlight::scene::{
    BlockFormat, ColorSpace, Filter, Keep, Material, OptionalPart, Sampler, Scene, Settings, Texels, Texture, View,
};

/// Neither edge is one of whole blocks, on any level.
const SIZE: [u32; 2] = [58, 27];
const LEVELS: u32 = 6;

/// Blocks of any bytes: all modes of a format, valid or not.
fn noise(format: BlockFormat, color_space: ColorSpace, sampler: Sampler) -> Texture {
    let mut random = fastrand::Rng::with_seed(7 + format as u64);
    let mut level = |level: u32| {
        let mut bytes = vec![0; format.level_bytes(SIZE.map(|edge| (edge >> level).max(1))) as usize];
        random.fill(&mut bytes);
        bytes
    };
    let levels = (0..LEVELS).map(&mut level).collect();
    Texture { name: format!("{format}"), size: SIZE, color_space, sampler, texels: Texels::Blocks { format, levels } }
}

/// The plane with a texture that repeats `times` times across it.
fn papered(texture: Texture, times: f32) -> Scene {
    let mut scene = plane(Material { base_color_texture: Some(0), ..lambert(1.0) }, vec![]);
    scene.meshes[0].uvs.iter_mut().flatten().for_each(|uv| *uv *= times);
    scene.textures.push(texture);
    scene
}

fn albedo() -> Settings {
    Settings { view: View::Albedo, anisotropy: 1, ..display(96, 96) }
}

fn draw(gpu: &Gpu, scene: &Scene, keep: Keep) -> (Picture, FramePlan) {
    let settings = Settings { keep, ..albedo() };
    (gpu.draw(scene, &settings), gpu.renderer(scene, &settings).plan().clone())
}

#[test]
fn blocks_of_every_format_are_drawn_as_their_texels() {
    let nearest = Sampler { magnify: Filter::Nearest, levels: None, ..Sampler::DEFAULT };
    on_gpu(|gpu| {
        let device = capabilities(&gpu.device.physical);
        for format in BlockFormat::ALL {
            for color_space in [ColorSpace::Linear, ColorSpace::Srgb] {
                for (sampler, times) in [(nearest, 0.5), (Sampler::DEFAULT, 0.5), (Sampler::DEFAULT, 20.0)] {
                    let what = format!("{format} {color_space:?} {sampler:?} {times}");
                    let scene = papered(noise(format, color_space, sampler), times);
                    let (picture, plan) = draw(gpu, &scene, Keep::NONE);
                    let (decoded, kept) = draw(gpu, &scene, Keep::NONE.with(OptionalPart::DecodedTextures));
                    let blocks = |plan: &FramePlan| plan.textures.images[0].blocks;
                    assert_eq!(blocks(&plan), Some(format).filter(|&own| device.samples(own)), "{what}");
                    assert_eq!((blocks(&kept), kept.uploads.mip_levels), (None, false), "{what}");
                    // A driver may filter sRGB blocks from more bits than sRGB texels.
                    let worst = largest_code_difference(&picture, &decoded);
                    assert!(worst.0 <= 1, "{what}: {worst:?}");
                }
            }
        }
    });
}

#[test]
fn the_levels_that_are_drawn_are_those_of_the_file() {
    // BC7 of mode 5: white with an alpha of 255, and black.
    let white = (1u128 << 5 | ((1 << 58) - 1) << 8).to_le_bytes();
    let black = (1u128 << 5 | 0xffff << 50).to_le_bytes();
    let level = |level: u32, block: [u8; 16]| block.repeat((256u32 >> level).div_ceil(4).pow(2) as usize);
    let mut levels: Vec<_> = (0..5).map(|index| level(index, if index == 0 { black } else { white })).collect();
    // Not of one colour, which a material would hold in the texture's place.
    levels[0][..16].copy_from_slice(&white);
    let texture = |count: usize| Texture {
        name: "levels".into(),
        size: [256; 2],
        color_space: ColorSpace::Linear,
        sampler: Sampler::DEFAULT,
        texels: Texels::Blocks { format: BlockFormat::Bc7, levels: levels[..count].to_vec() },
    };
    on_gpu(|gpu| {
        for keep in [Keep::NONE, Keep::NONE.with(OptionalPart::DecodedTextures)] {
            for (count, bright) in [(5, true), (1, false)] {
                let (picture, plan) = draw(gpu, &papered(texture(count), 40.0), keep);
                let planned = &plan.textures.images[0];
                // A file of several levels gets no others, and its last four are missing; of a file of one level all others are made.
                assert_eq!((planned.levels, planned.makes_levels), if bright { (5, false) } else { (9, true) });
                let is_bright = |(x, y)| code(&picture, x, y)[0] > 128;
                assert!(places(&picture).all(|place| is_bright(place) == bright), "{count} levels, {keep}");
            }
        }
    });
}
