//! KTX 2.0 files of blocks that stay as they are.

use proptest::prelude::*;
use serde_json::json;

use super::GltfBuilder;
use crate::gltf::ktx::{is_ktx, read};
use crate::{BlockFormat, Imported, Texels};

/// A file of one flat image: a header, the index of its levels, and the levels.
fn file(format: u32, [width, height]: [u32; 2], packing: u32, levels: &[(Vec<u8>, usize)]) -> Vec<u8> {
    let count = levels.len() as u32;
    let words = [format, 1, width, height, 0, 0, 1, count, packing, 0, 0, 0, 0, 0, 0, 0, 0];
    let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    words.iter().for_each(|word| bytes.extend(word.to_le_bytes()));
    let mut offset = bytes.len() + 24 * levels.len();
    for (level, unpacked) in levels {
        [offset, level.len(), *unpacked].iter().for_each(|&number| bytes.extend((number as u64).to_le_bytes()));
        offset += level.len();
    }
    levels.iter().for_each(|(level, _)| bytes.extend(level));
    bytes
}

/// Levels of some bytes of 10x6 texels, of as many as are asked for.
fn levels(format: BlockFormat, count: u32) -> Vec<Vec<u8>> {
    let bytes = |level: u32| format.level_bytes([10, 6].map(|edge: u32| (edge >> level).max(1)));
    (0..count).map(|level| (0..bytes(level)).map(|byte| (byte * 37 + 64) as u8).collect()).collect()
}

fn plain(levels: &[Vec<u8>]) -> Vec<(Vec<u8>, usize)> {
    levels.iter().map(|level| (level.clone(), level.len())).collect()
}

fn packed(levels: &[Vec<u8>]) -> Vec<(Vec<u8>, usize)> {
    let pack = |level: &Vec<u8>| zstd::bulk::compress(level, 3).expect("packed");
    levels.iter().map(|level| (pack(level), level.len())).collect()
}

const FORMATS: [(u32, BlockFormat); 8] = [
    (145, BlockFormat::Bc7),
    (146, BlockFormat::Bc7),
    (147, BlockFormat::Etc2Rgb8),
    (148, BlockFormat::Etc2Rgb8),
    (149, BlockFormat::Etc2Rgb8A1),
    (150, BlockFormat::Etc2Rgb8A1),
    (151, BlockFormat::Etc2Rgba8),
    (152, BlockFormat::Etc2Rgba8),
];

#[test]
fn blocks_and_levels_are_those_of_the_file() {
    for (number, format) in FORMATS {
        for count in [1, 3, 4] {
            let levels = levels(format, count);
            for (packing, stored) in [(0, plain(&levels)), (2, packed(&levels))] {
                let bytes = file(number, [10, 6], packing, &stored);
                assert!(is_ktx(&bytes));
                let found = read(&bytes).unwrap_or_else(|error| panic!("{number} {count} {packing}: {error}"));
                assert_eq!(found.size, [10, 6]);
                assert_eq!(found.texels, Texels::Blocks { format, levels: levels.clone() });
            }
        }
    }
}

#[test]
fn a_file_that_is_wrong_says_what_was_expected() {
    let levels = levels(BlockFormat::Bc7, 4);
    let (stored, size) = (plain(&levels), [10, 6]);
    let error = |bytes: &[u8]| read(bytes).err().unwrap_or_else(|| "none".into());
    let changed = |at: usize, word: u32| {
        let mut bytes = file(145, size, 0, &stored);
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        error(&bytes)
    };
    for (at, word, words) in [
        (12, 98, "has vkFormat 98, but only Basis Universal (0), BC7 (145 and 146) and ETC2 (147 to 152) can be read"),
        (20, 0, "is 0x6 texels, but each edge must have 1 to 16384"),
        (20, 9, "level 1 has 32 bytes, but 4x3 texels in BC7 are 16"),
        (20, 13, "level 0 has 96 bytes, but 13x6 texels in BC7 are 128"),
        (36, 6, "is not one flat image"),
        (40, 5, "says that it has 5 levels, but 10x6 texels have 4 at most"),
        (44, 3, "has supercompression 3, but only none (0) and Zstandard (2) can be read"),
        (44, 2, "level 0 cannot be unpacked by Zstandard: "),
        (60, 7, "has 7 bytes of keys at 0, but both must be multiples of 4"),
        (88, 1000, "names 1000 bytes at 176, but has"),
        (88, 90, "level 0 has 90 bytes, but 10x6 texels in BC7 are 96"),
        (96 + 24, 16, "level 1 has 16 bytes, but 5x3 texels in BC7 are 32"),
    ] {
        let found = changed(at, word);
        assert!(found.starts_with(words), "{at}: {found}");
    }
    let bytes = file(145, size, 0, &stored);
    for length in [13, 79, 100, bytes.len() - 1] {
        let found = error(&bytes[..length]);
        assert!(found.contains("is cut short") || found.contains("but has"), "{length}: {found}");
    }
    // More than it says unpacks to, and less.
    for other in [200, 90] {
        let long = [(zstd::bulk::compress(&vec![1; other], 3).expect("packed"), 96)];
        let found = error(&file(145, size, 2, &long));
        assert!(found.starts_with("level 0 ") && !found.contains('\n'), "{found}");
    }
}

/// A model whose base colour, metals and occlusion are of the one image.
fn model(image: &[u8]) -> Imported {
    let mut file = GltfBuilder::triangle();
    let view = file.view(image);
    file.json["images"] = json!([{"bufferView": view, "mimeType": "image/ktx2", "name": "wall"}]);
    file.json["textures"] = json!([{"source": 0}]);
    let texture = json!({"index": 0});
    let surface = json!({"baseColorTexture": texture, "metallicRoughnessTexture": texture});
    let occlusion = json!({"index": 0, "strength": 0.5});
    file.json["materials"] = json!([{"pbrMetallicRoughness": surface, "occlusionTexture": occlusion}]);
    file.primitive("material", json!(0));
    file.read()
}

#[test]
fn what_is_sampled_as_it_is_stays_in_blocks_and_what_is_made_of_it_does_not() {
    let levels = levels(BlockFormat::Bc7, 4);
    let found = model(&file(145, [10, 6], 0, &plain(&levels)));
    let in_blocks = |index: usize| matches!(found.textures[index].texels, Texels::Blocks { .. });
    let material = &found.materials[0];
    let [color, metals, occlusion] =
        [material.base_color_texture, material.metallic_roughness_texture, material.occlusion_texture]
            .map(|index| index.expect("a texture"));
    assert_eq!([color, metals, occlusion].map(in_blocks), [true, true, false]);
    let [whole, half] = [color, occlusion].map(|index| found.textures[index].texel(9, 5));
    assert_eq!(half[0], (255.0 + 0.5 * (f64::from(whole[0]) - 255.0)).round() as u8);
    assert_eq!(whole[1..], half[1..]);
}

#[test]
fn an_image_that_is_wrong_is_left_out_with_a_line_that_names_it() {
    let found = model(&file(98, [10, 6], 0, &plain(&levels(BlockFormat::Bc7, 1))));
    let named = |warning: &&String| warning.contains("image 0 (`wall`): has vkFormat 98, but only");
    assert_eq!((found.textures.len(), found.warnings.iter().filter(named).count()), (0, 1), "{:?}", found.warnings);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_change_of_a_file_ends_in_a_panic(
        (number, format) in prop::sample::select(&FORMATS[..]),
        is_packed: bool,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5),
    ) {
        let levels = levels(format, 3);
        let stored = if is_packed { packed(&levels) } else { plain(&levels) };
        let mut bytes = file(number, [10, 6], if is_packed { 2 } else { 0 }, &stored);
        for (place, byte) in &changes {
            let place = place.index(bytes.len());
            bytes[place] = *byte;
        }
        let _ = read(&bytes);
    }
}
