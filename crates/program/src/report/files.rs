//! The files of a report, each whole or not there.

use std::fs;
use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use afterlight_files::regular_file::read_regular;
use afterlight_lab::report::page;
use afterlight_lab::report::sweep::choice::{self, KINDS, LONGEST_EDGE};
use afterlight_lab::report::sweep::families::{Sweep, name_of};
use afterlight_lab::report::sweep::meter::DeviceMeter;
use afterlight_lab::report::sweep::model::{Report, SceneReport};
use afterlight_lab::report::sweep::table;
use afterlight_truth::measure::{Srgb8Image, flip};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, RgbImage};

use crate::failure::{Exit, Failure};
use crate::output::make_folder;
use crate::output::{self, Sink};

/// A report as JSON, CSV and a page.
const FILES: [&str; 3] = ["report.json", "report.csv", "report.html"];

/// The most bytes of a picture that a page shows: it is small, but a part of a report may come from elsewhere.
const MOST_BYTES: u64 = 64 << 20;

/// A report's folder.
pub struct Folder(PathBuf);

impl Folder {
    /// Makes the folder if it is missing.
    pub fn make(path: &Path) -> Result<Self, Failure> {
        make_folder(path)?;
        make_folder(&path.join(choice::FOLDER))?;
        Ok(Self(path.to_owned()))
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Removes an earlier report: its files and its pictures, and nothing else.
    pub fn clear(&self) -> Result<(), Failure> {
        let pictures = self.0.join(choice::FOLDER);
        let failed = |path: &Path, error: &io::Error| Failure::write(&path.display().to_string(), error);
        let mut old: Vec<PathBuf> = FILES.map(|name| self.0.join(name)).into();
        for entry in fs::read_dir(&pictures).map_err(|error| failed(&pictures, &error))? {
            let entry = entry.map_err(|error| failed(&pictures, &error))?;
            if entry.file_name().to_str().is_some_and(choice::is_file) {
                old.push(entry.path());
            }
        }
        for path in old {
            match fs::remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(&path, &error)),
                _ => {}
            }
        }
        Ok(())
    }

    /// Writes the report as JSON, CSV and a page.
    pub fn write(&self, report: &Report) -> Result<(), Failure> {
        let failed = |error: csv::Error| Failure::new(Exit::BadInput, format!("cannot write the table: {error}"));
        let [json, csv, page] = FILES;
        self.put(json, output::json(report)?.as_bytes())?;
        self.put(csv, &table::csv(report).map_err(failed)?)?;
        let pictures = |name: &str| read_regular(&self.0.join(name), MOST_BYTES).ok();
        self.put(page, page::html(report, &pictures).as_bytes())
    }

    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        Sink::File(self.0.join(name)).write(bytes)
    }

    /// Draws the pictures that the report shows, unless they are there already: [`Folder::clear`] has removed the pictures of other runs.
    pub fn draw_pictures(
        &self,
        mut scene: SceneReport,
        meter: &DeviceMeter,
        sweep: &Sweep,
    ) -> Result<SceneReport, Failure> {
        for index in choice::shown(&scene) {
            let name = scene.points[index].name.clone();
            let files = KINDS.map(|kind| choice::file(&scene, &name, kind));
            let there = files.iter().all(|file| self.0.join(file).is_file());
            let patch = sweep.points.iter().find(|patch| name_of(patch) == name);
            if let (Some(patch), false) = (patch, there) {
                let shown = meter.shown(patch)?;
                let difference = flip(&shown, &meter.truths.converged.shown)
                    .map_err(afterlight_lab::report::sweep::SweepError::from)?;
                for (file, picture) in files.iter().zip([&shown, &difference.heat()]) {
                    self.put(file, &thumbnail(picture)?)?;
                }
            }
            for (kind, file) in KINDS.iter().zip(files) {
                scene.points[index].pictures.insert((*kind).into(), file);
            }
        }
        Ok(scene)
    }

    /// Takes over the pictures that the report shows from wherever a part of it has drawn them.
    pub fn copy_pictures(&self, scene: &mut SceneReport, parts: &[PathBuf]) -> Result<(), Failure> {
        for index in choice::shown(scene) {
            for kind in KINDS {
                let file = choice::file(scene, &scene.points[index].name, kind);
                let read = |part: &PathBuf| read_regular(&part.join(&file), MOST_BYTES).ok();
                let Some(bytes) = parts.iter().find_map(read) else { continue };
                self.put(&file, &bytes)?;
                scene.points[index].pictures.insert(kind.into(), file);
            }
        }
        Ok(())
    }
}

/// A PNG file of a picture, no larger than a page shows it.
fn thumbnail(picture: &Srgb8Image) -> Result<Vec<u8>, Failure> {
    let [width, height] = picture.size;
    let failed = |why: String| Failure::new(Exit::BadInput, format!("cannot encode a picture: {why}"));
    let whole = RgbImage::from_raw(width, height, picture.pixels.as_flattened().to_vec());
    let whole = whole.ok_or_else(|| failed("it is not as long as it should be".into()))?;
    let longest = width.max(height);
    let small = match longest > LONGEST_EDGE {
        true => {
            let scaled = |edge: u32| (u64::from(edge) * u64::from(LONGEST_EDGE) / u64::from(longest)).max(1) as u32;
            image::imageops::thumbnail(&whole, scaled(width), scaled(height))
        }
        false => whole,
    };
    let mut file = Cursor::new(Vec::new());
    let (width, height) = small.dimensions();
    let encoded = PngEncoder::new(&mut file).write_image(&small, width, height, ExtendedColorType::Rgb8);
    encoded.map_err(|error| failed(error.to_string()))?;
    Ok(file.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_earlier_report_has_left_goes_and_nothing_else() {
        let temporary = tempfile::tempdir().expect("a temporary folder");
        let folder = Folder::make(&temporary.path().join("out")).expect("made");
        let picture = "pictures/hall-0a1b2c-shadow-size-512-difference.png";
        let own = ["journal", "pictures/cat.png", "pictures/my-picture.png", "notes.txt"];
        for name in FILES.iter().chain([&picture]).chain(&own) {
            folder.put(name, b"old").expect("written");
        }
        folder.clear().expect("cleared");
        let is_there = |name: &&str| folder.path().join(name).exists();
        assert!(own.iter().all(is_there) && !FILES.iter().any(is_there) && !is_there(&picture));
        folder.clear().expect("nothing is left to remove");
    }

    #[test]
    fn pictures_are_as_small_as_a_page_shows_them() {
        let size = |size: [u32; 2]| {
            let pixels = vec![[9, 8, 7]; (size[0] * size[1]) as usize];
            let bytes = thumbnail(&Srgb8Image { size, pixels }).expect("encodes");
            image::load_from_memory(&bytes).expect("is a PNG").into_rgb8().dimensions()
        };
        assert_eq!((size([96, 54]), size([960, 540]), size([1, 2000])), ((96, 54), (480, 270), (1, 480)));
    }
}
