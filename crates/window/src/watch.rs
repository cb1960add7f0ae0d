//! Watching of files while a window is open: the scene's files, and with the feature `hot-reload` the shaders. A separate thread reads and compiles
//! them anew, so that the window goes on meanwhile.

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use notify::event::{AccessKind, AccessMode};
use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher};

use super::ReadAgain;
use afterlight::scene::{Scene, Settings};
#[cfg(feature = "hot-reload")]
use afterlight::shaders::exchange::{Replacements, asked, compile};

/// Editors write a file in several steps: it is read when so long nothing has happened to it.
const QUIET: Duration = Duration::from_millis(60);
/// And after so long in any case.
const LONGEST: Duration = Duration::from_millis(500);

/// The outcome of reading changed files.
pub enum Reload {
    /// The scene as it is in its files, or the fault in them.
    Scene(Result<Box<(Scene, Settings)>, String>),
    /// The variants that passes have asked for, or the fault in the sources.
    #[cfg(feature = "hot-reload")]
    Shaders(Result<Replacements, String>),
}

/// An order to the thread.
enum WatchOrder {
    Changed(Vec<PathBuf>),
    /// Pipelines were made, perhaps of variants that are not compiled yet.
    #[cfg(feature = "hot-reload")]
    Fitted,
    End,
}

/// Watches until it is dropped.
pub struct Watch {
    orders: Sender<WatchOrder>,
    reloads: Receiver<Reload>,
    is_reading: Arc<AtomicBool>,
}

/// Shaders to be watched.
#[derive(Debug, Clone)]
pub struct ShaderFolder {
    /// With `*.wgsl` and `shared/*.wgsl`.
    pub path: PathBuf,
    /// True if the shaders differ from the program's own; they are then compiled at once.
    pub differs: bool,
}

impl Watch {
    /// Watches the `files` of a scene, which `read` reads again, and a folder of shaders. `wake` is called, from the other thread, when a
    /// file was read again.
    ///
    /// # Errors
    /// When the system does not tell of changes.
    pub fn new(
        files: &[PathBuf],
        read: ReadAgain,
        shaders: Option<ShaderFolder>,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Self, String> {
        let (orders, received) = channel();
        let (told, reloads) = channel();
        let changed = orders.clone();
        let watcher = notify::recommended_watcher(move |event: notify::Result<Event>| {
            if let Some(paths) = event.ok().and_then(changed_by) {
                // The thread only ends when it is not wanted any more.
                let _ = changed.send(WatchOrder::Changed(paths));
            }
        });
        let is_reading = Arc::new(AtomicBool::new(false));
        let mut reader = WatchThread {
            is_reading: Arc::clone(&is_reading),
            watcher: watcher.map_err(|error| error.to_string())?,
            watched: BTreeSet::new(),
            files: BTreeSet::new(),
            is_wrong: false,
            read,
            #[cfg(feature = "hot-reload")]
            shaders: None,
            told,
            wake: Box::new(wake),
        };
        // Each of them for itself.
        if let Err(why) = reader.follow(files) {
            reader.tell(Reload::Scene(Err(format!("the scene's files are not watched: {why}"))));
        }
        if let Err(why) = reader.follow_shaders(shaders) {
            reader.tell_of_shaders(format!("they are not watched: {why}"));
        }
        std::thread::spawn(move || reader.run(&received));
        Ok(Self { orders, reloads, is_reading })
    }

    /// Returns true while changed files are read or compiled.
    pub fn is_reading(&self) -> bool {
        self.is_reading.load(Ordering::Relaxed)
    }

    /// The next result of reading files again, if one has come.
    pub fn next_reload(&self) -> Option<Reload> {
        self.reloads.try_recv().ok()
    }

    /// Reports that pipelines were made: variants that they asked for are compiled too, if the sources differ from the program's own.
    #[cfg(feature = "hot-reload")]
    pub fn fitted(&self) {
        let _ = self.orders.send(WatchOrder::Fitted);
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        let _ = self.orders.send(WatchOrder::End);
    }
}

/// The files that an event changed; reading is none.
fn changed_by(event: Event) -> Option<Vec<PathBuf>> {
    let is_change = match event.kind {
        EventKind::Access(AccessKind::Close(AccessMode::Write)) => true,
        EventKind::Access(_) => false,
        _ => true,
    };
    is_change.then_some(event.paths)
}

/// The orders since files were last read.
#[derive(Default)]
struct Noted {
    scene: bool,
    shaders: bool,
    ends: bool,
}

/// The other thread.
struct WatchThread {
    watcher: RecommendedWatcher,
    /// Folders that the system was asked about.
    watched: BTreeSet<PathBuf>,
    /// Files of the scene.
    files: BTreeSet<PathBuf>,
    /// True if the scene could not be read the last time.
    is_wrong: bool,
    read: ReadAgain,
    #[cfg(feature = "hot-reload")]
    shaders: Option<ShaderReloader>,
    told: Sender<Reload>,
    wake: Box<dyn Fn() + Send>,
    is_reading: Arc<AtomicBool>,
}

#[cfg(feature = "hot-reload")]
struct ShaderReloader {
    folder: PathBuf,
    /// True if the shaders differ from the program's own.
    differ: bool,
    compiled: Replacements,
    /// Variants that were asked for at the last compilation.
    tried: usize,
}

impl WatchThread {
    fn run(mut self, orders: &Receiver<WatchOrder>) {
        while let Ok(order) = orders.recv() {
            let mut noted = Noted::default();
            let begun = Instant::now();
            let mut quiet = begun;
            if self.note(order, &mut noted) {
                quiet += QUIET;
            }
            // A file that is written all the time is read all the same.
            while let Some(left) = quiet.min(begun + LONGEST).checked_duration_since(Instant::now()) {
                let Ok(order) = orders.recv_timeout(left) else { break };
                if self.note(order, &mut noted) {
                    quiet = Instant::now() + QUIET;
                }
            }
            if noted.ends {
                return;
            }
            let is_reading = noted.scene || noted.shaders;
            if is_reading {
                self.read(true);
            }
            if noted.scene {
                self.read_scene();
            }
            #[cfg(feature = "hot-reload")]
            self.compile_shaders(noted.shaders);
            if is_reading {
                self.read(false);
            }
        }
    }

    /// Tells the window that reading has begun or ended.
    fn read(&self, is_reading: bool) {
        self.is_reading.store(is_reading, Ordering::Relaxed);
        (self.wake)();
    }

    /// Takes note of an order. True if more of its kind may follow at once.
    fn note(&self, order: WatchOrder, noted: &mut Noted) -> bool {
        match order {
            WatchOrder::Changed(paths) => {
                let scene = paths.iter().any(|path| self.is_of_scene(path));
                let shaders = paths.iter().any(|path| self.is_shader(path));
                noted.scene |= scene;
                noted.shaders |= shaders;
                scene || shaders
            }
            #[cfg(feature = "hot-reload")]
            WatchOrder::Fitted => false,
            WatchOrder::End => {
                noted.ends = true;
                false
            }
        }
    }

    /// Returns true if a file belongs to the scene. While something is wrong, any file beside the scene's files may be the missing one.
    fn is_of_scene(&self, path: &Path) -> bool {
        let is_beside =
            || path.parent().is_some_and(|folder| self.files.iter().any(|file| file.parent() == Some(folder)));
        self.files.contains(path) || self.is_wrong && is_beside()
    }

    #[cfg(feature = "hot-reload")]
    fn is_shader(&self, path: &Path) -> bool {
        let is_in = |shaders: &ShaderReloader| path.starts_with(&shaders.folder);
        path.extension() == Some("wgsl".as_ref()) && self.shaders.as_ref().is_some_and(is_in)
    }

    #[cfg(not(feature = "hot-reload"))]
    fn is_shader(&self, _: &Path) -> bool {
        false
    }

    fn read_scene(&mut self) {
        let read = guarded(|| (self.read)());
        self.is_wrong = read.is_err();
        if let Ok((scene, _)) = &read {
            // A folder that cannot be watched any more is no reason to withhold the scene.
            let _ = self.follow(&scene.files);
        }
        self.tell(Reload::Scene(read.map(Box::new)));
    }

    fn tell(&self, reload: Reload) {
        if self.told.send(reload).is_ok() {
            (self.wake)();
        }
    }

    /// Watches these files, and no others of a scene. A file that is replaced is another one: its folder tells.
    fn follow(&mut self, files: &[PathBuf]) -> Result<(), String> {
        self.files = files.iter().filter_map(|file| whole(file)).collect();
        let folders: BTreeSet<PathBuf> = self.files.iter().filter_map(|file| Some(file.parent()?.to_owned())).collect();
        folders.into_iter().try_for_each(|folder| self.watch(folder, RecursiveMode::NonRecursive))
    }

    fn watch(&mut self, folder: PathBuf, mode: RecursiveMode) -> Result<(), String> {
        if self.watched.insert(folder.clone()) {
            self.watcher.watch(&folder, mode).map_err(|error| format!("{}: {error}", folder.display()))?;
        }
        Ok(())
    }

    #[cfg(feature = "hot-reload")]
    fn tell_of_shaders(&self, fault: String) {
        self.tell(Reload::Shaders(Err(fault)));
    }

    #[cfg(not(feature = "hot-reload"))]
    fn tell_of_shaders(&self, _: String) {}

    #[cfg(not(feature = "hot-reload"))]
    fn follow_shaders(&mut self, _: Option<ShaderFolder>) -> Result<(), String> {
        Ok(())
    }

    #[cfg(feature = "hot-reload")]
    fn follow_shaders(&mut self, shaders: Option<ShaderFolder>) -> Result<(), String> {
        let Some(ShaderFolder { path, differs }) = shaders else { return Ok(()) };
        let folder = path.canonicalize().map_err(|error| format!("{}: {error}", path.display()))?;
        self.watch(folder.clone(), RecursiveMode::Recursive)?;
        self.shaders = Some(ShaderReloader { folder, differ: differs, compiled: Replacements::default(), tried: 0 });
        Ok(())
    }

    /// Compiles the variants that are asked for, if sources have changed, or more variants are asked for of changed sources.
    #[cfg(feature = "hot-reload")]
    fn compile_shaders(&mut self, have_changed: bool) {
        let Some(shaders) = &mut self.shaders else { return };
        shaders.differ |= have_changed;
        // Without a new request, variants that did not compile would not compile now.
        let are_too_few = shaders.differ && shaders.compiled.lack() && asked() > shaders.tried;
        if !have_changed && !are_too_few {
            return;
        }
        shaders.tried = asked();
        let compiled = guarded(|| compile(&shaders.folder));
        if let Ok(compiled) = &compiled {
            shaders.compiled = compiled.clone();
        }
        self.tell(Reload::Shaders(compiled));
    }
}

/// A panic of our own code, or of the libraries that read files, is told as a fault of the files.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let done = catch_unwind(AssertUnwindSafe(work));
    done.unwrap_or_else(|_| Err("the program failed over these files: this is a fault of its own".into()))
}

/// A file by its folder's whole path, as the system names it.
fn whole(file: &Path) -> Option<PathBuf> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok()?.join(file.file_name()?))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use afterlight::scene::{OpenOptions, open};

    /// Waits for a scene with this many objects, or for a fault that contains this name.
    fn wait(watch: &Watch, wanted: Result<usize, &str>) {
        let begun = Instant::now();
        loop {
            let found = match (watch.next_reload(), wanted) {
                (Some(Reload::Scene(Ok(read))), Ok(objects)) => read.0.model_objects().count() == objects,
                (Some(Reload::Scene(Err(fault))), Err(name)) => fault.contains(name) && fault.contains("scene.toml:1"),
                _ => false,
            };
            if found {
                return;
            }
            assert!(begun.elapsed() < Duration::from_secs(20), "no such reload: {wanted:?}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn a_scene_is_read_again_when_a_file_of_it_changes_and_not_when_another_does() {
        const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("model.obj"), TRIANGLE).expect("written");
        fs::write(path("scene.toml"), "models = [{ path = 'model.obj' }]\n").expect("written");
        let spec = path("scene.toml").display().to_string();
        let read = move || {
            let scene = open(&spec, &OpenOptions::default()).map_err(|error| error.to_string())?;
            Ok((scene, Settings::default()))
        };
        let (scene, _) = read().expect("is a scene");
        assert_eq!(scene.files.len(), 2, "{:?}", scene.files);
        let watch = Watch::new(&scene.files, Box::new(read), None, || {}).expect("can be watched");

        fs::write(path("scene.toml"), "models = [{ path = 'model.obj' }, { path = 'model.obj' }]\n").expect("written");
        wait(&watch, Ok(2));
        // As editors save: another file takes its place.
        fs::write(path("new"), format!("{TRIANGLE}g second\nf 3 2 1\n")).expect("written");
        fs::rename(path("new"), path("model.obj")).expect("renamed");
        wait(&watch, Ok(4));
        fs::write(path("scene.toml"), "models = [{ path = 'none.obj' }]\n").expect("written");
        wait(&watch, Err("none.obj"));
        // The missing file appears.
        fs::write(path("none.obj"), TRIANGLE).expect("written");
        wait(&watch, Ok(1));
        // Another file that is written all the time delays nothing.
        let busy = path("busy");
        let stop = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !stop.load(std::sync::atomic::Ordering::Relaxed) {
                    fs::write(&busy, "x").expect("written");
                    std::thread::sleep(QUIET / 10);
                }
            });
            fs::write(path("scene.toml"), "models = [{ path = 'none.obj' }, { path = 'none.obj' }]\n")
                .expect("written");
            wait(&watch, Ok(2));
            stop.store(true, std::sync::atomic::Ordering::Relaxed);
        });

        std::thread::sleep(4 * QUIET);
        while watch.next_reload().is_some() {}
        // Neither a file beside it, nor that it is read.
        fs::write(path("other.toml"), "").expect("written");
        let _ = fs::read(path("scene.toml")).expect("read");
        std::thread::sleep(4 * QUIET);
        assert!(watch.next_reload().is_none());
        fs::write(path("scene.toml"), "models = [{ path = 'model.obj' }]\n").expect("written");
        wait(&watch, Ok(2));
    }
}
