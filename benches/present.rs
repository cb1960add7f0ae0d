//! The cost of showing frames, on a surface without a display: a frame against the same one of a renderer that shows it to nobody, a change of
//! size, and changes of settings, which make frames anew. Each is timed as the CPU meets it, from the call until the device is done.
//!
//! A change is first made as a window makes it, in another thread while frames go on as they were: the report has the time until new ones are there,
//! and the longest of the old ones meanwhile. Then it is made at once.
//!
//! If the driver has no such surfaces, only the changes are timed, by renderers that are made anew with all that is on the device: an upper bound.
//! With AFTERLIGHT_PIPELINE_CACHE empty nothing is left of earlier runs but the driver's own caches.
//!
//! `cargo bench --bench present -- [SCENE] [--size WxH] [--frames N]`

use std::error::Error;
use std::ffi::CStr;
use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::{FitOutcome, Presenter, Renderer, Wake};
use afterlight::gpu::{self, Device, DeviceChoice, HEADLESS, Instance, InstanceOptions, Surface, Validation, Vsync};
use afterlight::scene::{GbufferChoice, GbufferPreset, LightPath, OpenOptions, Scene, Settings, View, open};
use afterlight_truth::measure::Distribution;

type Result<T> = std::result::Result<T, Box<dyn Error>>;
type SettingsEdit = fn(&mut Settings);

const SWAPCHAIN: &CStr = c"VK_KHR_swapchain";
/// Changes that a user may make on the panels. Each is made, and taken back.
const CHANGES: [(&str, SettingsEdit); 7] = [
    ("view of the normals", |settings| settings.view = View::Normal),
    ("forward", |settings| settings.light_path = LightPath::Forward),
    ("clustered", |settings| settings.light_path = LightPath::Clustered),
    ("compute", |settings| settings.light_path = LightPath::Compute),
    ("fat G-buffer", |settings| {
        settings.gbuffer = GbufferChoice { preset: GbufferPreset::Fat, ..GbufferChoice::default() };
    }),
    ("4 samples", |settings| settings.msaa = 4),
    ("FXAA", |settings| settings.fxaa = true),
];

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let option = |name: &str| Some(given.get(given.iter().position(|word| word == name)? + 1)?.clone());
    let spec = given.first().filter(|word| !word.starts_with("--")).cloned().unwrap_or_else(|| "builtin:hall".into());
    let frames: usize = option("--frames").map_or(Ok(40), |text| text.parse())?;
    let size = option("--size").unwrap_or_else(|| "1280x720".into());
    let (width, height) = size.split_once('x').ok_or("--size WxH")?;
    let size: [u32; 2] = [width.parse()?, height.parse()?];

    let options = InstanceOptions { validation: Validation::Off, ..InstanceOptions::default() };
    let scene = open(&spec, &OpenOptions::default())?;
    let settings = Settings { size, samples: 1, ..scene.settings.decide() };
    let instance = match Instance::with_extensions(&options, &HEADLESS) {
        Err(gpu::Error::Unsupported(why)) => {
            println!("{why}: renderers are made anew");
            let device = Device::new(&Instance::new(&options)?, &DeviceChoice::Auto)?;
            println!("{spec}, {width}x{height}, on {}", device.physical.name);
            return each_change(&mut Apart { device: &device, scene: &scene }, &settings, frames);
        }
        instance => instance?,
    };
    let device = Device::with_extensions(&instance, &DeviceChoice::Auto, &[SWAPCHAIN])?;
    println!("{spec}, {width}x{height}, on {}; medians, and from the 5th to the 95th percentile", device.physical.name);
    let presenter = || -> Result<Presenter> {
        let surface = Surface::headless(&device)?;
        Ok(Presenter::new(&device, surface, &scene, &settings, Vsync::Off)?)
    };
    let mut shown = Shown { device: &device, presenter: presenter()?, scene: &scene };
    shown.fit(&settings)?;
    let mut encoded = Shown { device: &device, presenter: presenter()?.with_encoding(), scene: &scene };
    encoded.fit(&settings)?;
    compare([&mut shown, &mut encoded], &settings, frames)?;
    drop(encoded);
    let [width, height] = size;
    let smaller = Settings { size: [width - width / 5, height - height / 5], ..settings.clone() };
    let mut resizes = Vec::new();
    for number in 0..frames {
        resizes.push(shown.timed(if number % 2 == 0 { &smaller } else { &settings })?);
    }
    tell("a change of size and its frame", resizes)?;
    shown.fit(&settings)?;
    each_change(&mut shown, &settings, frames)
}

/// The ways in which frames of new settings replace the old ones.
trait Changes {
    /// In another thread, with frames of settings that were drawn `before` going on meanwhile.
    fn later(&mut self, before: &Settings, after: &Settings) -> Result<Meanwhile>;
    /// Milliseconds until a frame of these settings is drawn that are taken at once.
    fn at_once(&mut self, settings: &Settings) -> Result<f64>;
}

/// Milliseconds of a change that is made in another thread.
struct Meanwhile {
    /// From when it was asked for to its first frame.
    all: f64,
    /// Milliseconds of each frame meanwhile; where a window adopts new frames, the first of them includes its adoption.
    frames: Vec<f64>,
}

/// Tells how long each change takes, the first time and again.
fn each_change(changes: &mut impl Changes, settings: &Settings, frames: usize) -> Result<()> {
    for (name, change) in CHANGES {
        let mut changed = settings.clone();
        change(&mut changed);
        let first = changes.later(settings, &changed)?;
        changes.at_once(settings)?;
        let mut again = Vec::new();
        for _ in 0..(frames / 8).max(2) {
            again.push(changes.at_once(&changed)?);
            changes.at_once(settings)?;
        }
        let meanwhile = match Distribution::of(first.frames) {
            Some(own) => format!("{} frames of {:.1} ms, at most {:.1} ms", own.count, own.median, own.max),
            None => "no frame".to_owned(),
        };
        println!("{name}: first after {:.1} ms, meanwhile {meanwhile}", first.all);
        tell("again, at once", again)?;
    }
    Ok(())
}

/// A scene that is drawn without a surface.
struct Apart<'a> {
    device: &'a Arc<Device>,
    scene: &'a Scene,
}

impl Changes for Apart<'_> {
    fn later(&mut self, before: &Settings, after: &Settings) -> Result<Meanwhile> {
        let (device, scene) = (self.device, self.scene);
        let mut shown = Renderer::new(device, scene, before)?;
        shown.render(&scene.camera)?;
        shown.wait()?;
        let (begun, mut frames) = (Instant::now(), Vec::new());
        let mut made = std::thread::scope(|scope| -> Result<Renderer> {
            let made = scope.spawn(|| Renderer::new(device, scene, after));
            while !made.is_finished() {
                let begun = Instant::now();
                shown.render(&scene.camera)?;
                shown.wait()?;
                frames.push(milliseconds(begun));
            }
            Ok(made.join().map_err(|_| "the other thread has panicked")??)
        })?;
        made.render(&scene.camera)?;
        made.wait()?;
        Ok(Meanwhile { all: milliseconds(begun), frames })
    }

    fn at_once(&mut self, settings: &Settings) -> Result<f64> {
        self.device.wait_idle()?;
        let begun = Instant::now();
        let mut renderer = Renderer::new(self.device, self.scene, settings)?;
        renderer.render(&self.scene.camera)?;
        self.device.wait_idle()?;
        Ok(milliseconds(begun))
    }
}

/// A scene on a surface.
struct Shown<'a> {
    device: &'a Arc<Device>,
    presenter: Presenter,
    scene: &'a Scene,
}

impl Shown<'_> {
    fn fit(&mut self, settings: &Settings) -> Result<()> {
        match self.presenter.fit(self.scene, settings, settings.size)? {
            true => Ok(()),
            false => Err("the surface has no pixels".into()),
        }
    }

    fn draw(&mut self) -> Result<()> {
        self.presenter.draw(&self.scene.camera, false, None)?;
        Ok(())
    }

    /// Fits these settings and draws a frame. Returns the milliseconds of both.
    fn timed(&mut self, settings: &Settings) -> Result<f64> {
        self.device.wait_idle()?;
        let begun = Instant::now();
        self.fit(settings)?;
        self.draw()?;
        self.device.wait_idle()?;
        Ok(milliseconds(begun))
    }
}

impl Changes for Shown<'_> {
    fn later(&mut self, _: &Settings, after: &Settings) -> Result<Meanwhile> {
        // It asks by itself.
        let wake: Wake = Arc::new(|| {});
        let (begun, mut frames) = (Instant::now(), Vec::new());
        self.presenter.change(false);
        loop {
            let frame = Instant::now();
            let made = self.presenter.fit_later(self.scene, after, &wake)?;
            self.draw()?;
            self.device.wait_idle()?;
            frames.push(milliseconds(frame));
            if made != FitOutcome::Pending {
                return Ok(Meanwhile { all: milliseconds(begun), frames });
            }
        }
    }

    fn at_once(&mut self, settings: &Settings) -> Result<f64> {
        self.presenter.change(false);
        self.timed(settings)
    }
}

/// Frames in turn: one that is drawn into the surface's image, one that ENCODE brings there, and one that is not shown.
fn compare([straight, encoded]: [&mut Shown; 2], settings: &Settings, frames: usize) -> Result<()> {
    let device = straight.device;
    let mut alone = Renderer::new(device, straight.scene, settings)?;
    let mut all: [Vec<f64>; 3] = Default::default();
    for number in 0..frames + 4 {
        let timed = |draw: &mut dyn FnMut() -> Result<()>| -> Result<f64> {
            let begun = Instant::now();
            draw()?;
            device.wait_idle()?;
            Ok(milliseconds(begun))
        };
        let camera = &straight.scene.camera;
        let rendered = timed(&mut || Ok(alone.render(camera)?))?;
        let times = [timed(&mut || straight.draw())?, timed(&mut || encoded.draw())?, rendered];
        // The first ones find caches cold.
        if number >= 4 {
            all.iter_mut().zip(times).for_each(|(all, time)| all.push(time));
        }
    }
    let ratios = |over: usize, under: usize| all[over].iter().zip(&all[under]).map(|(a, b)| a / b).collect();
    let ratios: [(&str, Vec<f64>); 2] =
        [("ratio, shown to not shown", ratios(0, 2)), ("ratio, by ENCODE to straight", ratios(1, 0))];
    let [straight, encoded, rendered] = all;
    tell("a frame that is shown", straight)?;
    tell("the same by ENCODE", encoded)?;
    tell("the same without a surface", rendered)?;
    for (what, ratios) in ratios {
        let ratio = Distribution::of(ratios).ok_or("no frame")?;
        println!("{what:>44} {:>9.3} {:>9.3}..{:.3}", ratio.median, ratio.p5, ratio.p95);
    }
    Ok(())
}

fn tell(what: &str, times: Vec<f64>) -> Result<()> {
    let all = Distribution::of(times).ok_or("no time")?;
    println!("{what:>44} {:>9.2} {:>9.2}..{:.2} ms", all.median, all.p5, all.p95);
    Ok(())
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
