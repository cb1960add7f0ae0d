//! Truths on disk: a finished one is read instead of computed, a broken-off one goes on where its last save was.
//!
//! Each truth and number of samples has a file, `truth-HASH-SAMPLES.bin`, or `.part` for an unfinished run; the hash covers everything that the truth
//! depends on. A file is written under another name and renamed, and carries the hash and a checksum: a damaged, truncated or foreign file is
//! computed again. All files may be deleted at any time. A truth of 1280x720 takes 44 MB. All files together take 2 GiB at most, or as much as the
//! last one: the least recently used are removed.

use std::env;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use afterlight_files::regular_file::read_regular;
use afterlight_files::user_cache::user_cache;
use afterlight_files::whole_file::WholeFile;

use super::render::{Accumulation, PASS, ProgressCallback, Reference};
use super::{CameraView, Mode, TriangleId, Truth, TruthOptions, fingerprint};

const MAGIC: [u8; 8] = *b"AFTLTR01";
/// Sizes of the magic, the hash of everything that the truth depends on, and the hash of the rest of the file.
const HEADER_BYTES: usize = 8 + 32 + 32;
/// No triangle, in a file.
const NO_TRIANGLE: u32 = u32::MAX;
/// Extensions of files.
const FINISHED: &str = "bin";
const UNFINISHED: &str = "part";
/// The least time between two saves of work in progress.
const SAVE_EVERY: Duration = Duration::from_secs(10);
/// The most bytes that all files of a folder take.
const LIMIT: u64 = 2 << 30;

/// A folder of truths.
#[derive(Debug, Clone)]
pub struct Cache {
    folder: PathBuf,
    save_every: Duration,
    limit: u64,
}

/// The origin of a truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TruthOrigin {
    /// All of it was computed.
    Computed,
    /// So many samples a pixel were there already.
    Continued(u32),
    /// All of it was read.
    Read,
}

/// A truth that may have been read from a cache.
#[derive(Debug, Clone, PartialEq)]
pub struct Cached {
    /// The picture.
    pub truth: Truth,
    /// Whether it was read, rendered, or both.
    pub source: TruthOrigin,
    /// Warnings about the cache, a line each. The truth is right all the same.
    pub warnings: Vec<String>,
}

impl Cached {
    /// A truth that no cache was asked for.
    pub fn computed(truth: Truth) -> Self {
        Self { truth, source: TruthOrigin::Computed, warnings: Vec::new() }
    }

    /// [`Cache::render`] if there is a cache, else [`Reference::render`].
    pub fn render(
        cache: Option<&Cache>,
        reference: &Reference,
        view: &CameraView,
        options: &TruthOptions,
        progress: ProgressCallback,
    ) -> Self {
        match cache {
            Some(cache) => cache.render(reference, view, options, progress),
            None => Self::computed(reference.render(view, options, progress)),
        }
    }
}

impl Cache {
    /// The cache in a folder, which is made when something is written.
    pub fn at(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), save_every: SAVE_EVERY, limit: LIMIT }
    }

    /// The user's: in `AFTERLIGHT_CACHE` (empty: none), else `afterlight/truth` in `XDG_CACHE_HOME`, `%LOCALAPPDATA%` (Windows),
    /// `~/Library/Caches` (macOS) or `~/.cache`.
    pub fn of_user() -> Option<Self> {
        if let Some(folder) = env::var_os("AFTERLIGHT_CACHE") {
            return (!folder.is_empty()).then(|| Self::at(folder));
        }
        user_cache().map(|folder| Self::at(folder.join("truth")))
    }

    /// Returns the folder of the files.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns true if a converged truth of this many samples is there.
    pub fn has(&self, reference: &Reference, view: &CameraView, samples: u32) -> bool {
        let options = TruthOptions::of(Mode::Converged { samples });
        let work = CacheEntry { cache: self, key: fingerprint::of(reference, view, &options), warnings: Vec::new() };
        work.file(samples, FINISHED).is_file()
    }

    /// Renders like [`Reference::render`], to the last bit, and reuses cached work.
    pub fn render(
        &self,
        reference: &Reference,
        view: &CameraView,
        options: &TruthOptions,
        progress: ProgressCallback,
    ) -> Cached {
        let mut work = CacheEntry { cache: self, key: fingerprint::of(reference, view, options), warnings: Vec::new() };
        let (truth, source) = match options.mode {
            Mode::Point => work.point(reference, view, options, progress),
            Mode::Converged { samples } => {
                work.converged(reference, view, options, (samples, &|_| true), progress).unwrap_or_else(|| {
                    // Nothing asked to stop.
                    (reference.render(view, options, progress), TruthOrigin::Computed)
                })
            }
        };
        Cached { truth, source, warnings: work.warnings }
    }

    /// Removes the files that were not used for longest, until the others are within the limit; `newest` stays.
    fn shrink(&self, newest: &Path) {
        let is_truth = |path: &Path| {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            name.starts_with("truth-") && [FINISHED, UNFINISHED].iter().any(|end| name.ends_with(&format!(".{end}")))
        };
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let mut files: Vec<(SystemTime, u64, PathBuf)> = entries
            .filter(|entry| is_truth(&entry.path()))
            .filter_map(|entry| {
                let about = entry.metadata().ok()?;
                Some((about.modified().ok()?, about.len(), entry.path()))
            })
            .collect();
        files.sort_unstable();
        let mut bytes: u64 = files.iter().map(|(_, bytes, _)| bytes).sum();
        for (_, own, path) in files.iter().filter(|(_, _, path)| path != newest) {
            if bytes <= self.limit {
                break;
            }
            // A file that cannot be removed still counts, so that others are removed in its place.
            if fs::remove_file(path).is_ok() {
                bytes -= own;
            }
        }
    }
}

/// One truth on its way.
struct CacheEntry<'a> {
    cache: &'a Cache,
    key: blake3::Hash,
    warnings: Vec<String>,
}

impl CacheEntry<'_> {
    fn point(
        &mut self,
        reference: &Reference,
        view: &CameraView,
        options: &TruthOptions,
        progress: ProgressCallback,
    ) -> (Truth, TruthOrigin) {
        let file = self.file(0, FINISHED);
        let bytes_a_pixel = 24 + 8;
        if let Some(truth) =
            self.read(&file, bytes_a_pixel * pixels(view.size), |bytes| decode_points(bytes, view.size))
        {
            return (truth, TruthOrigin::Read);
        }
        let truth = reference.render(view, options, progress);
        self.write(&file, &encode_points(&truth));
        (truth, TruthOrigin::Computed)
    }

    /// Up to `samples` samples, as long as `goes_on` agrees after each pass; none if it did not.
    fn converged(
        &mut self,
        reference: &Reference,
        view: &CameraView,
        options: &TruthOptions,
        (samples, goes_on): (u32, &dyn Fn(u32) -> bool),
        progress: ProgressCallback,
    ) -> Option<(Truth, TruthOrigin)> {
        let mut accumulation = self.furthest(view.size, samples);
        let found = accumulation.samples;
        let total = u64::from(samples) * accumulation.mean.len() as u64;
        let mut last_save = Instant::now();
        while accumulation.samples < samples {
            let count = PASS.min(samples - accumulation.samples);
            reference.accumulate(view, options.smith, count, &mut accumulation, &|done| progress(done, total));
            let is_done = accumulation.samples == samples;
            let stops = !is_done && !goes_on(accumulation.samples);
            if is_done || stops || last_save.elapsed() >= self.cache.save_every {
                self.save(&accumulation, is_done);
                last_save = Instant::now();
            }
            if stops {
                return None;
            }
        }
        let source = match found {
            0 => TruthOrigin::Computed,
            found if found == samples => TruthOrigin::Read,
            found => TruthOrigin::Continued(found),
        };
        Some((accumulation.truth(view.size), source))
    }

    /// Writes the samples, and removes what broken-off runs have left on the way there.
    fn save(&mut self, accumulation: &Accumulation, is_done: bool) {
        let extension = if is_done { FINISHED } else { UNFINISHED };
        let file = self.file(accumulation.samples, extension);
        self.write(&file, &encode_samples(accumulation));
        for (count, extension) in self.counts() {
            if extension == UNFINISHED && count < accumulation.samples {
                // It may have gone already; left behind, it does no harm.
                let _ = fs::remove_file(self.file(count, extension));
            }
        }
    }

    /// Samples and extensions of the files of this truth.
    fn counts(&self) -> Vec<(u32, &'static str)> {
        let prefix = format!("truth-{}-", self.name());
        let parse = |name: &str| {
            let (count, extension) = name.strip_prefix(&prefix)?.split_once('.')?;
            let extension = [FINISHED, UNFINISHED].into_iter().find(|known| *known == extension)?;
            Some((count.parse().ok()?, extension))
        };
        let entries = fs::read_dir(&self.cache.folder).into_iter().flatten().flatten();
        entries.filter_map(|entry| parse(entry.file_name().to_str()?)).collect()
    }

    /// Reads the sound file with the most samples up to `most`.
    fn furthest(&mut self, size: [u32; 2], most: u32) -> Accumulation {
        let mut counts = self.counts();
        counts.retain(|&(count, _)| (1..=most).contains(&count));
        counts.sort_unstable();
        while let Some((count, extension)) = counts.pop() {
            let sound = |bytes: &[u8]| decode_samples(bytes, size).filter(|found| found.samples == count);
            let bytes = 4 + pixels(size) * 2 * 24;
            if let Some(found) = self.read(&self.file(count, extension), bytes, sound) {
                return found;
            }
        }
        Accumulation::new(size)
    }

    /// Half of the hash: enough to tell truths apart.
    fn name(&self) -> String {
        self.key.to_hex()[..32].to_owned()
    }

    fn file(&self, samples: u32, extension: &str) -> PathBuf {
        self.cache.folder.join(format!("truth-{}-{samples}.{extension}", self.name()))
    }

    /// Reads a file and decodes its payload. Warns if the file exists and does not hold it.
    fn read<T>(&mut self, file: &Path, payload_bytes: usize, decode: impl Fn(&[u8]) -> Option<T>) -> Option<T> {
        let bytes = match read_regular(file, (HEADER_BYTES + payload_bytes) as u64) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return None,
            Err(error) => {
                self.warn(file, &format!("cannot be read ({error}): it is computed again"));
                return None;
            }
        };
        let payload = open(&bytes, &self.key);
        let found = payload.and_then(decode);
        if found.is_some() {
            // Records the file's last use; if that fails, the file is only removed earlier.
            let _ = fs::File::options().append(true).open(file).and_then(|file| file.set_modified(SystemTime::now()));
        } else {
            self.warn(file, "is damaged or not a truth of this scene and view: it is computed again");
        }
        found
    }

    fn write(&mut self, file: &Path, payload: &[u8]) {
        if let Err(error) = write(file, &self.key, payload) {
            self.warn(file, &format!("cannot be written: {error}"));
        }
        self.cache.shrink(file);
    }

    fn warn(&mut self, file: &Path, what: &str) {
        self.warnings.push(format!("{} {what}", file.display()));
    }
}

/// Returns the data behind a sound header.
fn open<'a>(bytes: &'a [u8], key: &blake3::Hash) -> Option<&'a [u8]> {
    let (header, payload) = bytes.split_at_checked(HEADER_BYTES)?;
    let sound = header.starts_with(&MAGIC)
        && header[8..40] == *key.as_bytes()
        && header[40..] == *blake3::hash(payload).as_bytes();
    sound.then_some(payload)
}

fn write(file: &Path, key: &blake3::Hash, payload: &[u8]) -> io::Result<()> {
    let Some(folder) = file.parent() else { return Ok(()) };
    fs::create_dir_all(folder)?;
    // Renamed into place when it is whole, so that a reader sees the old file or the new one.
    let mut temporary = WholeFile::begin_in(folder)?;
    temporary.write_all(&MAGIC)?;
    temporary.write_all(key.as_bytes())?;
    temporary.write_all(blake3::hash(payload).as_bytes())?;
    temporary.write_all(payload)?;
    temporary.persist(file)
}

fn reals(values: &[[f64; 3]]) -> impl Iterator<Item = u8> {
    values.iter().flatten().flat_map(|value| value.to_le_bytes())
}

/// Splits off the values of the first `pixels` pixels, and returns the bytes after them as well.
fn split_reals(bytes: &[u8], pixels: usize) -> Option<(Vec<[f64; 3]>, &[u8])> {
    let (own, rest) = bytes.split_at_checked(pixels.checked_mul(24)?)?;
    let values: Vec<f64> = own.as_chunks::<8>().0.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect();
    Some((values.as_chunks::<3>().0.to_vec(), rest))
}

fn pixels(size: [u32; 2]) -> usize {
    size[0] as usize * size[1] as usize
}

fn encode_samples(accumulation: &Accumulation) -> Vec<u8> {
    let samples = accumulation.samples.to_le_bytes().into_iter();
    samples.chain(reals(&accumulation.mean)).chain(reals(&accumulation.squares)).collect()
}

fn decode_samples(bytes: &[u8], size: [u32; 2]) -> Option<Accumulation> {
    let (samples, rest) = bytes.split_first_chunk::<4>()?;
    let (mean, rest) = split_reals(rest, pixels(size))?;
    let (squares, rest) = split_reals(rest, pixels(size))?;
    rest.is_empty().then(|| Accumulation { samples: u32::from_le_bytes(*samples), mean, squares })
}

fn encode_points(truth: &Truth) -> Vec<u8> {
    let triangles = truth.triangles.iter().flatten().flat_map(|triangle| {
        let [object, triangle] = triangle.map_or([NO_TRIANGLE; 2], |id| [id.object, id.triangle]);
        [object.to_le_bytes(), triangle.to_le_bytes()].concat()
    });
    reals(&truth.radiance).chain(triangles).collect()
}

fn decode_points(bytes: &[u8], size: [u32; 2]) -> Option<Truth> {
    let (radiance, rest) = split_reals(bytes, pixels(size))?;
    let (numbers, beyond) = rest.as_chunks::<8>();
    if numbers.len() != pixels(size) || !beyond.is_empty() {
        return None;
    }
    let triangle = |bytes: &[u8; 8]| {
        let [a, b, c, d, e, f, g, h] = *bytes;
        let (object, triangle) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        (object != NO_TRIANGLE).then_some(TriangleId { object, triangle })
    };
    let triangles = numbers.iter().map(triangle).collect();
    Some(Truth { size, radiance, standard_error: None, triangles: Some(triangles) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Smith;
    use afterlight_scene::{self as scene, Scene};

    fn scene() -> Scene {
        scene::open("builtin:hall?bays=1&detail=6", &Default::default()).expect("a built-in scene")
    }

    fn view(scene: &Scene) -> CameraView {
        CameraView { camera: scene.camera, size: [24, 16] }
    }

    fn options(samples: u32) -> TruthOptions {
        TruthOptions { mode: Mode::Converged { samples }, smith: Smith::default() }
    }

    /// Renders as long as `goes_on` says.
    fn part(
        cache: &Cache,
        reference: &Reference,
        view: &CameraView,
        samples: u32,
        goes_on: &dyn Fn(u32) -> bool,
    ) -> bool {
        let options = options(samples);
        let mut work = CacheEntry { cache, key: fingerprint::of(reference, view, &options), warnings: Vec::new() };
        let done = work.converged(reference, view, &options, (samples, goes_on), &|_, _| {});
        assert_eq!(work.warnings, [""; 0]);
        done.is_some()
    }

    fn files(folder: &Path) -> Vec<PathBuf> {
        fs::read_dir(folder).expect("readable").map(|entry| entry.expect("an entry").path()).collect()
    }

    #[test]
    fn a_broken_off_run_goes_on_and_ends_as_if_it_had_not_been() {
        let (scene, folder) = (scene(), tempfile::tempdir().expect("a folder"));
        let (reference, view) = (Reference::new(&scene).expect("a scene"), view(&scene));
        let whole = reference.render(&view, &options(23), &|_, _| {});
        let cache = Cache::at(folder.path());
        assert!(!part(&cache, &reference, &view, 23, &|samples| samples < 4));
        assert!(!part(&cache, &reference, &view, 23, &|samples| samples < 16));
        assert_eq!(files(folder.path()).len(), 1, "the first save is gone");
        let done = cache.render(&reference, &view, &options(23), &|_, _| {});
        assert_eq!((done.source, done.warnings.len()), (TruthOrigin::Continued(16), 0));
        assert!(done.truth == whole, "resumed and uninterrupted differ");
        // A finished truth is read, and a run of more samples continues it.
        let again = cache.render(&reference, &view, &options(23), &|_, _| panic!("nothing is computed"));
        assert!(again.source == TruthOrigin::Read && again.truth == whole);
        let more = cache.render(&reference, &view, &options(32), &|_, _| {});
        assert_eq!(more.source, TruthOrigin::Continued(23));
        assert!(more.truth == reference.render(&view, &options(32), &|_, _| {}));
        assert_eq!(cache.render(&reference, &view, &options(23), &|_, _| {}).source, TruthOrigin::Read);
    }

    #[test]
    fn points_are_read_back_to_the_last_bit() {
        let (scene, folder) = (scene(), tempfile::tempdir().expect("a folder"));
        let (reference, view) = (Reference::new(&scene).expect("a scene"), view(&scene));
        let options = TruthOptions { mode: Mode::Point, smith: Smith::Separable };
        let cache = Cache::at(folder.path().join("deeper"));
        let first = cache.render(&reference, &view, &options, &|_, _| {});
        let second = cache.render(&reference, &view, &options, &|_, _| {});
        assert_eq!((first.source, second.source), (TruthOrigin::Computed, TruthOrigin::Read));
        assert!(first.truth == second.truth && first.truth.triangles.is_some());
    }

    #[test]
    fn what_was_not_used_for_longest_goes_when_all_is_too_much() {
        let (scene, folder) = (scene(), tempfile::tempdir().expect("a folder"));
        let reference = Reference::new(&scene).expect("a scene");
        let foreign = folder.path().join("other.bin");
        fs::write(&foreign, vec![0; 100_000]).expect("written");
        // Two and a half truths.
        let limit = 5 * (HEADER_BYTES as u64 + 4 + 24 * 16 * 48) / 2;
        let cache = Cache { limit, ..Cache::at(folder.path()) };
        let use_one = |roll: f64| {
            let camera = scene::Camera { projection: scene::Projection::perspective(40.0 + roll), ..scene.camera };
            let source =
                cache.render(&reference, &CameraView { camera, size: [24, 16] }, &options(1), &|_, _| {}).source;
            // Some file systems have no finer clock.
            std::thread::sleep(Duration::from_millis(20));
            source
        };
        assert_eq!([1.0, 2.0, 1.0].map(&use_one), [TruthOrigin::Computed, TruthOrigin::Computed, TruthOrigin::Read]);
        assert_eq!(use_one(3.0), TruthOrigin::Computed);
        assert_eq!(
            [1.0, 3.0].map(&use_one),
            [TruthOrigin::Read, TruthOrigin::Read],
            "the second was not used for longest"
        );
        assert_eq!(use_one(2.0), TruthOrigin::Computed);
        assert!(foreign.exists() && files(folder.path()).len() == 3);
        let small = Cache { limit: 1, ..cache.clone() };
        small.render(&reference, &view(&scene), &options(1), &|_, _| {});
        assert_eq!(files(folder.path()).len(), 2, "the newest stays");
    }

    #[test]
    fn damaged_and_foreign_files_are_never_trusted() {
        let (scene, folder) = (scene(), tempfile::tempdir().expect("a folder"));
        let (reference, view, options) = (Reference::new(&scene).expect("a scene"), view(&scene), options(2));
        let cache = Cache::at(folder.path());
        let truth = cache.render(&reference, &view, &options, &|_, _| {}).truth;
        let file = files(folder.path()).pop().expect("a file");
        let whole = fs::read(&file).expect("readable");
        let mut broken = vec![whole[..whole.len() - 1].to_vec(), whole[..20].to_vec(), Vec::new(), vec![0; 5000]];
        for index in [0, 10, 50, 80, whole.len() - 1] {
            let mut damaged = whole.clone();
            damaged[index] ^= 1;
            broken.push(damaged);
        }
        // Whole, of another truth.
        let other =
            cache.render(&Reference::new(&scene).expect("a scene").with_shadows(false), &view, &options, &|_, _| {});
        assert_eq!(other.source, TruthOrigin::Computed);
        let foreign = files(folder.path()).into_iter().find(|name| *name != file).expect("another file");
        broken.push(fs::read(foreign).expect("readable"));
        for bytes in broken {
            fs::write(&file, bytes).expect("written");
            let found = cache.render(&reference, &view, &options, &|_, _| {});
            assert_eq!((found.source, found.warnings.len()), (TruthOrigin::Computed, 1));
            assert!(found.truth == truth);
        }
        assert_eq!(cache.render(&reference, &view, &options, &|_, _| {}).source, TruthOrigin::Read);
    }

    #[test]
    fn whatever_changes_a_picture_changes_its_hash() {
        let scene = scene();
        let view = view(&scene);
        let options = options(1);
        let of = |scene: &Scene, view: &CameraView, options: &TruthOptions| {
            fingerprint::of(&Reference::new(scene).expect("a scene"), view, options)
        };
        let mut hashes = vec![of(&scene, &view, &options)];
        let mut change = |what: &dyn Fn(&mut Scene)| {
            let mut other = scene.clone();
            what(&mut other);
            hashes.push(of(&other, &view, &options));
        };
        change(&|scene| scene.lights[0].intensity *= 1.000_001);
        change(&|scene| scene.lights[0].casts_shadow ^= true);
        change(&|scene| scene.lights[0].size += 1e-9);
        change(&|scene| scene.meshes[0].positions[0][0] += 1e-4);
        change(&|scene| scene.objects[0].transform.translation.x += 1e-9);
        let look = scene::Look { tint: glam::Vec3::new(1.0, 1.0, 0.999), ..scene::Look::PLAIN };
        change(&|scene| scene.objects[0].look = Some(look));
        change(&|scene| scene.objects[0].look = Some(scene::Look { selected: true, ..scene::Look::PLAIN }));
        change(&|scene| scene.materials[0].atlas = [1, 2]);
        change(&|scene| scene.materials[0].atlas = [2, 1]);
        change(&|scene| scene.materials[0].roughness -= 1e-6);
        change(&|scene| scene.materials[0].two_sided ^= true);
        change(&|scene| scene.textures[0].rgba8_mut()[0] ^= 1);
        change(&|scene| scene.environment.ground = Some(scene.environment.ambient));
        let moved = CameraView { camera: scene::Camera { near: 0.2, ..view.camera }, ..view };
        hashes.push(of(&scene, &moved, &options));
        hashes.push(of(&scene, &CameraView { size: [16, 24], ..view }, &options));
        hashes.push(of(&scene, &view, &TruthOptions { smith: Smith::Separable, ..options }));
        hashes.push(of(&scene, &view, &TruthOptions { mode: Mode::Point, ..options }));
        hashes.push(fingerprint::of(
            &Reference::new(&scene).expect("a scene").with_brdf(Some(scene::Brdf::Lambert)),
            &view,
            &options,
        ));
        hashes.push(fingerprint::of(&Reference::new(&scene).expect("a scene").with_shadows(false), &view, &options));
        for (index, hash) in hashes.iter().enumerate() {
            assert!(!hashes[..index].contains(hash), "{index}");
        }
        let renamed = Scene { name: "another".into(), ..scene.clone() };
        assert_eq!(of(&renamed, &view, &options), hashes[0]);
    }
}
