//! `afterlight render FOLDER`: the models in a folder on one sheet.

use std::path::{Path, PathBuf};

use afterlight::frame::{Picture, Pixels};
use afterlight::scene::{SettingsPatch, counted};

use super::Args;
use super::scenes::{names_of, one, verdict};
use crate::contact_sheet::{self, SheetTile};
use crate::failure::{Exit, Failure};
use crate::image_output::PictureFormat;
use crate::output;

/// Folders within folders that are looked into.
const DEPTH: u32 = 4;
/// Models of one sheet, at most.
const MOST: usize = 1000;
/// The size of a tile, where nobody says one.
const TILE: [u32; 2] = [400, 300];

/// The given scenes, with the models of each folder in its place, in the order of their names.
pub fn models(scenes: &[String]) -> Result<Vec<String>, Failure> {
    let mut all = Vec::new();
    for scene in scenes {
        let path = Path::new(scene);
        if !path.is_dir() {
            all.push(scene.clone());
            continue;
        }
        let mut found = Vec::new();
        collect(path, DEPTH, &mut found)?;
        found.sort();
        if found.is_empty() {
            return Err(Failure::new(
                Exit::BadInput,
                format!("{scene} is a directory without a model (.gltf, .glb, .obj)"),
            ));
        }
        for model in found {
            let name = model
                .to_str()
                .ok_or_else(|| Failure::new(Exit::BadInput, format!("{}: its name is not UTF-8", model.display())))?;
            all.push(name.to_owned());
        }
    }
    if all.len() > MOST {
        return Err(Failure::usage(format!("{} models: at most {MOST} are drawn at once", all.len())));
    }
    Ok(all)
}

fn collect(folder: &Path, depth: u32, found: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let unread = |error| Failure::new(Exit::BadInput, format!("cannot read {}: {error}", folder.display()));
    for entry in std::fs::read_dir(folder).map_err(unread)? {
        let path = entry.map_err(unread)?.path();
        // Not through links: a loop of them would have no end.
        let is_folder = path.is_dir() && !path.is_symlink();
        if is_folder && depth > 0 {
            collect(&path, depth - 1, found)?;
        }
        let extension = path.extension().map(|own| own.to_string_lossy().to_lowercase());
        if path.is_file() && matches!(extension.as_deref(), Some("gltf" | "glb" | "obj")) {
            found.push(path);
        }
    }
    Ok(())
}

/// Draws each scene into a tile. One that fails has an empty tile, and does not keep the others from being drawn.
pub fn draw_sheet(args: &Args, is_verbose: bool) -> Result<(), Failure> {
    refuse(args)?;
    args.output.sink.check()?;
    let mut settings = args.settings.clone();
    settings.said = settings.said.or(&SettingsPatch { size: Some(TILE), ..SettingsPatch::default() });
    let size = settings.said.size.unwrap_or(TILE);
    let mut tiles = Vec::new();
    let mut failures: Vec<(&str, Failure)> = Vec::new();
    for (scene, label) in args.scenes.iter().zip(names_of(&args.scenes)) {
        let kept = super::Tiles::default();
        let args = Args { settings: settings.clone(), tiles: Some(kept.clone()), ..args.clone() };
        let (_, files, outcome) = one(&args, scene, is_verbose)?;
        output::spare([&args.output.sink], &files)?;
        let picture = kept.borrow_mut().pop();
        tiles.push(match (picture, &outcome) {
            (Some(Picture { pixels: Pixels::Srgb8(rgba), .. }), Ok(())) => SheetTile { label, size, rgba },
            _ => SheetTile { label: format!("{label}: failed"), size, rgba: Vec::new() },
        });
        match outcome {
            Err(failure) if failure.is_quiet() => return Err(failure),
            Err(failure) => {
                output::print(&format!("{scene} failed: {}\n", failure.one_line()), true)?;
                failures.push((scene, failure));
            }
            Ok(()) => {}
        }
    }
    // About as wide as high, for tiles that are wider than high.
    let columns = (tiles.len() as f64).sqrt().ceil() as u32;
    let sheet = contact_sheet::compose(&tiles, columns);
    args.output.write(&Picture { size: sheet.size, pixels: Pixels::Srgb8(sheet.rgba) })?;
    if !args.quiet {
        let told = format!("{} -> {}\n", counted(args.scenes.len(), "model"), args.output.sink);
        output::print(&told, args.output.sink.is_stdout())?;
    }
    verdict(failures, args.scenes.len().max(2))
}

fn refuse(args: &Args) -> Result<(), Failure> {
    let why = "a sheet of a folder's models is one PNG picture of lit models";
    let is_other = args.output.format != PictureFormat::Png || args.view == Some(crate::args::ViewChoice::All);
    if is_other || args.is_sequence() || args.transparent || args.json.is_some() || args.junit.is_some() {
        return Err(Failure::usage(format!(
            "{why}: --view all, --transparent, sequences, --json, --junit and .exr need one picture a model"
        ))
        .with_hint("give -o a name with {name} in it, as -o {name}.png"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_found_in_folders_within_folders_and_sorted() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["b.glb", "a/a.gltf", "a/a.bin", "a/deep/c.OBJ", "notes.txt"] {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("in a folder")).expect("made");
            std::fs::write(path, "").expect("written");
        }
        let own = folder.path().display().to_string();
        let found = models(&["builtin:quad".into(), own.clone()]).expect("models");
        assert_eq!(
            found,
            ["builtin:quad".into(), format!("{own}/a/a.gltf"), format!("{own}/a/deep/c.OBJ"), format!("{own}/b.glb")]
        );
        let empty = tempfile::tempdir().expect("a folder");
        let error = models(&[empty.path().display().to_string()]).expect_err("nothing to draw");
        assert!(error.message().contains("without a model"), "{error:?}");
    }
}
