//! Readers of files that the program writes itself.

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use afterlight::gpu::{DriverHeader, decode_device_file, encode_device_file};
use afterlight::scene::{Scene, open};
use afterlight_lab::report::sweep::journal::Contents;
use afterlight_lab::report::sweep::line::with_checksums;
use afterlight_lab::report::sweep::merge::{ShardJournal, join};
use afterlight_lab::report::sweep::model::Shard;
use afterlight_lab::report::sweep::{assemble, table};
use afterlight_lab::report::{advice, page};
use afterlight_truth::reference::{Cache, Cached, CameraView, Mode, Reference, Smith, Truth, TruthOptions};

use super::{folder, is_one_line};

static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| folder("files"));

/// A report's journal. Chance finds no checksum: also the same with one before each line.
pub fn journal(bytes: &[u8]) {
    journal_of(bytes);
    journal_of(&with_checksums(bytes));
}

/// A journal, and the report that is joined from it and another part, which has measured the same.
fn journal_of(bytes: &[u8]) {
    let file = FOLDER.join("journal");
    fs::write(&file, bytes).expect("written");
    let contents = match Contents::read(&file) {
        Ok(Some(contents)) => contents,
        Ok(None) => return,
        Err(error) => return is_one_line(&error),
    };
    // A journal's own report, and that of the parts.
    let mut parts = Vec::new();
    for index in 1..=2 {
        let mut part = ShardJournal { folder: format!("part-{index}"), contents: contents.clone() };
        part.contents.header.shard = Some(Shard { index, count: 2 });
        parts.push(part);
    }
    let mut reports = vec![assemble::report(&contents.header, &contents.scenes, contents.header.shard)];
    match join(&parts) {
        Ok((header, scenes)) => reports.push(assemble::report(&header, &scenes, None)),
        Err(error) => is_one_line(&error),
    }
    for report in &reports {
        page::html(report, &|_| None);
        table::csv(report).expect("a table");
        for scene in &report.scenes {
            for front in &scene.fronts {
                advice::of(scene, front);
                assemble::default_on_front(scene, front.metric, front.truth);
            }
        }
    }
}

/// A pipeline cache's file: the driver is given the data that come out of it.
pub fn pipeline_cache(bytes: &[u8]) {
    let header = DriverHeader { vendor: 0x1_0005, device: 0, uuid: *b"0123456789abcdef" };
    if let Some(data) = decode_device_file(bytes.to_vec()) {
        assert_eq!(encode_device_file(&data), bytes, "a file that this program has not written");
    }
    // Chance finds no checksum: the same with a header of the program's own around it.
    let data = decode_device_file(encode_device_file(bytes));
    assert_eq!(data.as_deref(), Some(bytes));
    if header.begins(bytes) {
        assert!(bytes.len() >= 32 && bytes[16..32] == header.uuid, "a foreign header");
    }
}

/// A scene whose truth is cached, that truth, and the file that holds it.
struct Known {
    scene: Scene,
    truth: Truth,
    file: PathBuf,
    whole: Vec<u8>,
}

const SAMPLES: u32 = 2;

static KNOWN: LazyLock<Known> = LazyLock::new(|| {
    let scene = open("builtin:triangle", &Default::default()).expect("a built-in scene");
    let truth = render(&scene).truth;
    let file = fs::read_dir(FOLDER.join("truths"))
        .expect("a cache")
        .map(|entry| entry.expect("an entry").path())
        .find(|path| path.extension().is_some_and(|extension| extension == "bin"))
        .expect("the truth's file");
    let whole = fs::read(&file).expect("readable");
    Known { scene, truth, file, whole }
});

fn render(scene: &Scene) -> Cached {
    let options = TruthOptions { mode: Mode::Converged { samples: SAMPLES }, smith: Smith::default() };
    let reference = Reference::new(scene).expect("a scene");
    let view = CameraView { camera: scene.camera, size: [3, 2] };
    Cache::at(FOLDER.join("truths")).render(&reference, &view, &options, &|_, _| {})
}

/// Bytes of a header before the samples: a mark, and two hashes.
const HASHED: usize = 40;
const HEADER: usize = 72;

/// A file of the reference's cache: damaged, and whole around damaged samples.
pub fn truth(bytes: &[u8]) {
    let known = &*KNOWN;
    let put = |bytes: &[u8]| fs::write(&known.file, bytes).expect("written");
    put(bytes);
    let damaged = render(&known.scene);
    assert_eq!(damaged.truth, known.truth, "a wrong picture");
    damaged.warnings.iter().for_each(is_one_line);
    assert_eq!(damaged.warnings.is_empty(), bytes == known.whole);
    // Chance finds no hash. With one, samples are believed, if they are as many as the picture has.
    let sealed = [&known.whole[..HASHED], blake3::hash(bytes).as_bytes(), bytes].concat();
    put(&sealed);
    let believed = render(&known.scene);
    assert_eq!(believed.truth.radiance.len(), known.truth.radiance.len());
    if bytes.len() != known.whole.len() - HEADER {
        assert_eq!(believed.truth, known.truth, "a wrong picture of too few samples, or too many");
    }
}
