//! Third-party scenes, drawn under validation: every OBJ that loads ends in a picture, and Crytek's Sponza in the right one.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::gpu::{bytes, code, on_gpu};
use afterlight::scene::{OpenOptions, SettingsPatch, open};

fn obj_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    for entry in entries {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            obj_files(&path, found);
        } else if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
            found.push(path);
        }
    }
}

#[test]
fn every_odd_file_that_loads_ends_in_a_picture_that_shows_it() {
    let Some(folder) = crate::common::scenes_dir().map(|scenes| scenes.join("odd_obj")) else { return };
    let mut files = Vec::new();
    obj_files(&folder, &mut files);
    files.sort();
    let mut drawn = 0;
    on_gpu(|gpu| {
        for file in &files {
            // tests/scenes/odd_obj.rs says which files must load.
            let Ok(scene) = open(&file.to_string_lossy(), &OpenOptions::default()) else { continue };
            let said = SettingsPatch { size: Some([32, 32]), shadow_size: Some(64), ..SettingsPatch::default() };
            let picture = gpu.draw(&scene, &said.or(&scene.settings).decide());
            let background = code(&picture, 0, 0);
            let shows = bytes(&picture).as_chunks::<4>().0.iter().any(|pixel| pixel[..3] != background);
            assert!(shows, "{}: nothing but {background:?}", file.display());
            drawn += 1;
        }
    });
    assert!(drawn > 50, "only {drawn} of {} files were drawn", files.len());
}

#[test]
fn sponza_is_textured_sunlit_shadowed_and_masked_and_the_layer_is_silent() {
    let Some(folder) = crate::common::scenes_dir() else { return };
    let file = folder.join("crytek_sponza/sponza.obj");
    let scene = open(&file.to_string_lossy(), &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let said = SettingsPatch { size: Some([192, 108]), ..SettingsPatch::default() };
    on_gpu(|gpu| {
        let lit = gpu.draw(&scene, &said.or(&scene.settings).decide());
        let picture = |change: SettingsPatch| gpu.draw(&scene, &change.or(&said).or(&scene.settings).decide());
        // The sun's shadows cover more than a quarter of the pixels, and bright surfaces that it reaches more than 1 in 400.
        let unshadowed = picture(SettingsPatch { shadows: Some(false), ..SettingsPatch::default() });
        let pairs = || bytes(&lit).as_chunks::<4>().0.iter().zip(bytes(&unshadowed).as_chunks::<4>().0);
        let pixels = pairs().count();
        let luma = |pixel: &[u8; 4]| pixel[..3].iter().map(|&channel| u32::from(channel)).sum::<u32>();
        let shadowed = pairs().filter(|(lit, open)| luma(lit) + 30 < luma(open)).count();
        let sunlit = pairs().filter(|(lit, open)| lit == open && luma(lit) > 500).count();
        assert!(shadowed * 4 > pixels, "in shadow: {shadowed} of {pixels}");
        assert!(sunlit * 400 > pixels, "in the sun: {sunlit} of {pixels}");
        // Red, green and blue cloths: textures are where they belong.
        for channel in 0..3 {
            let dominant = |pixel: &&[u8; 4]| {
                let others = (0..3).filter(|&other| other != channel).map(|other| pixel[other]).max();
                pixel[channel] > 60 && others.is_some_and(|other| u16::from(pixel[channel]) > 2 * u16::from(other))
            };
            let count = bytes(&lit).as_chunks::<4>().0.iter().filter(dominant).count();
            assert!(count * 400 > pixels, "channel {channel} dominates {count} of {pixels} pixels");
        }
    });
    assert!(scene.materials.iter().any(|material| material.is_masked()), "no alpha mask");
    assert!(scene.materials.iter().any(|material| material.normal_texture.is_some()), "no normal map");
}
