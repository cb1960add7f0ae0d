//! What it takes to show frames, on a surface without a display: a frame against the same one of a renderer that shows it to nobody, a change of
//! size, and changes of settings, which make frames anew. Each is timed as the CPU meets it, from the call until the device is done.
//!
//! Where the driver has no such surfaces, the changes alone, by renderers that are made anew with all that is on the device: an upper bound.
//!
//! `cargo bench --bench present -- [SCENE] [--size WxH] [--frames N]`

use std::error::Error;
use std::ffi::CStr;
use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::{Presenter, Renderer};
use afterlight::gpu::{self, Device, DeviceChoice, HEADLESS, Instance, InstanceOptions, Surface, Validation, Vsync};
use afterlight::measure::Distribution;
use afterlight::scene::{GbufferChoice, GbufferPreset, LightPath, OpenOptions, Scene, Settings, View, open};

type Result<T> = std::result::Result<T, Box<dyn Error>>;
type Change = fn(&mut Settings);

const SWAPCHAIN: &CStr = c"VK_KHR_swapchain";
/// What a user may change on the panels. Each is made, and taken back.
const CHANGES: [(&str, Change); 7] = [
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
            return each_change(&settings, frames, |settings| made_anew(&device, &scene, settings));
        }
        instance => instance?,
    };
    let device = Device::with_extensions(&instance, &DeviceChoice::Auto, &[SWAPCHAIN])?;
    println!("{spec}, {width}x{height}, on {}; medians, and from the 5th to the 95th percentile", device.physical.name);
    let surface = Surface::headless(&device)?;
    let mut shown =
        Shown { presenter: Presenter::new(&device, surface, &scene, &settings, Vsync::Off)?, scene: &scene };
    shown.fit(&settings)?;
    compare(&device, &mut shown, &settings, frames)?;
    let [width, height] = size;
    let smaller = Settings { size: [width - width / 5, height - height / 5], ..settings.clone() };
    let mut resizes = Vec::new();
    for number in 0..frames {
        resizes.push(shown.timed(&device, if number % 2 == 0 { &smaller } else { &settings }, false)?);
    }
    tell("a change of size and its frame", resizes)?;
    shown.fit(&settings)?;
    each_change(&settings, frames, |settings| shown.timed(&device, settings, true))
}

/// Tells how long `timed` takes for each change, the first time and again.
fn each_change(settings: &Settings, frames: usize, mut timed: impl FnMut(&Settings) -> Result<f64>) -> Result<()> {
    for (name, change) in CHANGES {
        let mut changed = settings.clone();
        change(&mut changed);
        let first = timed(&changed)?;
        timed(settings)?;
        let mut again = Vec::new();
        for _ in 0..(frames / 8).max(2) {
            again.push(timed(&changed)?);
            timed(settings)?;
        }
        tell(&format!("{name}, first {first:.1} ms, then"), again)?;
    }
    Ok(())
}

/// Milliseconds until a renderer of its own has drawn a frame.
fn made_anew(device: &Arc<Device>, scene: &Scene, settings: &Settings) -> Result<f64> {
    device.wait_idle()?;
    let begun = Instant::now();
    let mut renderer = Renderer::new(device, scene, settings)?;
    renderer.render(&scene.camera)?;
    device.wait_idle()?;
    Ok(milliseconds(begun))
}

/// A scene on a surface.
struct Shown<'a> {
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

    /// Milliseconds of a change and the frame after it.
    fn timed(&mut self, device: &Device, settings: &Settings, is_other: bool) -> Result<f64> {
        device.wait_idle()?;
        let begun = Instant::now();
        if is_other {
            self.presenter.change(false);
        }
        self.fit(settings)?;
        self.draw()?;
        device.wait_idle()?;
        Ok(milliseconds(begun))
    }
}

/// Frames in turn: one that is shown, and one that is not.
fn compare(device: &Arc<Device>, shown: &mut Shown, settings: &Settings, frames: usize) -> Result<()> {
    let mut alone = Renderer::new(device, shown.scene, settings)?;
    let (mut presented, mut rendered, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for number in 0..frames + 4 {
        let begun = Instant::now();
        shown.draw()?;
        device.wait_idle()?;
        let own = milliseconds(begun);
        let begun = Instant::now();
        alone.render(&shown.scene.camera)?;
        device.wait_idle()?;
        let other = milliseconds(begun);
        // The first ones find caches cold.
        if number >= 4 {
            presented.push(own);
            rendered.push(other);
            ratios.push(own / other);
        }
    }
    tell("a frame that is shown", presented)?;
    tell("the same without a surface", rendered)?;
    let ratio = Distribution::of(ratios).ok_or("no frame")?;
    println!("{:>44} {:>9.3} {:>9.3}..{:.3}", "ratio, frame by frame", ratio.median, ratio.p5, ratio.p95);
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
