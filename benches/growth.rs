//! The growth of a frame's time with each thing that a scene can have more of: lights, objects, triangles, materials, pixels. One row a count, with
//! the slope from the row before: 0 where the time stays, 1 where it grows as the count does, 2 where it would be quadratic.
//!
//! A curve ends at its last count, or where a frame takes longer than `--most` milliseconds or cannot be drawn; then the sentence that says why is its
//! last row.
//!
//! `cargo bench --bench growth -- [CURVE...] [--most MS] [--frames N] [--size WxH]`, with `--list` the names of the curves.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::Renderer;
use afterlight::gpu::{Device, DeviceChoice, Instance, InstanceOptions, Validation};
use afterlight::scene::{OpenOptions, Settings, open};
use afterlight_truth::measure::Distribution;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// A thing of which scenes have ever more.
struct Curve {
    name: &'static str,
    what: &'static str,
    counts: &'static [u64],
    /// The amount grows as this power of the count.
    power: i32,
    /// The scene with so many, and the picture's size, if it is the size that grows.
    scene: fn(u64) -> (String, Option<[u32; 2]>),
}

/// Lamps fill the slab of the field evenly, with a range by which a place is in reach of as many lamps at any number of them.
fn lamps(count: u64) -> f64 {
    4.0 * (256.0 / count as f64).cbrt()
}

const CURVES: [Curve; 6] = [
    Curve {
        name: "lights",
        what: "point lights; a place is in reach of as many, whatever their number is",
        counts: &[1, 10, 100, 1_000, 10_000, 100_000],
        power: 1,
        scene: |count| (format!("builtin:field?objects=1000&lights={count}&range={}", lamps(count)), None),
    },
    Curve {
        name: "unlimited-lights",
        what: "point lights without a range: each pixel meets each",
        counts: &[1, 10, 100, 1_000, 10_000],
        power: 1,
        scene: |count| (format!("builtin:field?objects=1000&lights={count}&range=0"), None),
    },
    Curve {
        name: "objects",
        what: "objects of four meshes and eight materials",
        counts: &[1, 10, 100, 1_000, 10_000, 100_000, 1_000_000],
        power: 1,
        scene: |count| (format!("builtin:field?objects={count}&lights=16"), None),
    },
    Curve {
        name: "triangles",
        what: "times as many edges around each of 100 objects, so the square as many triangles",
        counts: &[1, 2, 4, 8, 16, 32, 64],
        power: 2,
        scene: |detail| (format!("builtin:field?objects=100&lights=16&detail={detail}"), None),
    },
    Curve {
        name: "materials",
        what: "materials of 20,000 objects of four meshes",
        counts: &[1, 10, 100, 1_000, 10_000],
        power: 1,
        scene: |count| (format!("builtin:field?objects=20000&lights=16&materials={count}"), None),
    },
    Curve {
        name: "pixels",
        what: "pixels: 64x36, 320x180, 1280x720, 1920x1080, 3840x2160, 7680x4320",
        counts: &[64, 320, 1280, 1920, 3840, 7680],
        power: 2,
        scene: |width| ("builtin:field?objects=1000&lights=256".into(), Some([width as u32, width as u32 * 9 / 16])),
    },
];

/// A row of a curve.
struct Row {
    /// The slope is taken by this: the count, or its square.
    amount: f64,
    ms: f64,
}

fn main() -> Result<()> {
    let given: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let option = |name: &str| Some(given.get(given.iter().position(|word| word == name)? + 1)?.clone());
    if given.iter().any(|word| word == "--list") {
        CURVES.iter().for_each(|curve| println!("{:<18}{}", curve.name, curve.what));
        return Ok(());
    }
    let most: f64 = option("--most").map_or(Ok(5000.0), |text| text.parse())?;
    let frames: usize = option("--frames").map_or(Ok(20), |text| text.parse())?;
    let size = option("--size").unwrap_or_else(|| "1280x720".into());
    let (width, height) = size.split_once('x').ok_or("--size WxH")?;
    let size: [u32; 2] = [width.parse()?, height.parse()?];
    let values = ["--most", "--frames", "--size"].map(|name| given.iter().position(|word| word == name));
    let is_value = |index: usize| values.iter().flatten().any(|&at| index == at || index == at + 1);
    let named: Vec<&String> =
        given.iter().enumerate().filter(|(index, _)| !is_value(*index)).map(|(_, name)| name).collect();
    if let Some(unknown) = named.iter().find(|name| CURVES.iter().all(|curve| curve.name != **name)) {
        return Err(format!("there is no curve {unknown}: --list names them").into());
    }

    let instance = Instance::new(&InstanceOptions { validation: Validation::Off, ..InstanceOptions::default() })?;
    let device = Device::new(&instance, &DeviceChoice::Auto)?;
    println!("On {}, {width}x{height} but for pixels; medians of up to {frames} frames", device.physical.name);
    for curve in CURVES.iter().filter(|curve| named.is_empty() || named.iter().any(|name| *name == curve.name)) {
        println!("\n### {}: {}\n", curve.name, curve.what);
        println!("| {} | triangles | light path | load ms | record ms | GPU ms | frame ms | slope |", curve.name);
        println!("|---|---|---|---|---|---|---|---|");
        let mut last: Option<Row> = None;
        for &count in curve.counts {
            let (spec, own) = (curve.scene)(count);
            let settings = |own_settings: Settings| Settings { size: own.unwrap_or(size), samples: 1, ..own_settings };
            match row(&device, (count, curve.power), &spec, &settings, (frames, most, &last)) {
                Ok(row) if row.ms > most => {
                    println!("| {count} | is the last: a frame took longer than {most} ms |");
                    break;
                }
                Ok(row) => last = Some(row),
                Err(error) => {
                    println!("| {count} | {error} |");
                    break;
                }
            }
        }
    }
    Ok(())
}

/// Measures a scene and prints it.
fn row(
    device: &Arc<Device>,
    (count, power): (u64, i32),
    spec: &str,
    settings: &dyn Fn(Settings) -> Settings,
    (frames, most, last): (usize, f64, &Option<Row>),
) -> Result<Row> {
    let begun = Instant::now();
    let mut scene = open(spec, &OpenOptions::default())?;
    let load_ms = begun.elapsed().as_secs_f64() * 1e3;
    let settings = settings(scene.settings.decide());
    let mut renderer = Renderer::taking(device, &mut scene, &settings)?;
    let camera = scene.camera;
    let mut measured = Vec::new();
    let mut drawn = 0;
    // The first two warm up: shaders and lists that are made at first use are no cost of a frame.
    for frame in 0..frames + 2 {
        let begun = Instant::now();
        renderer.render(&camera)?;
        let times = renderer.wait()?;
        drawn = times.drawn.triangles;
        let ms = begun.elapsed().as_secs_f64() * 1e3;
        if frame >= 2 {
            measured.push((times.record_ms, times.gpu_ms, ms));
        }
        if ms > most && frame >= 2 || ms > 4.0 * most {
            break;
        }
    }
    let median = |values: &mut dyn Iterator<Item = f64>| Distribution::of(values).map_or(f64::NAN, |own| own.median);
    let record_ms = median(&mut measured.iter().map(|own| own.0));
    let gpu_ms = median(&mut measured.iter().filter_map(|own| own.1));
    let ms = median(&mut measured.iter().map(|own| own.2));
    let amount = (count as f64).powi(power);
    let slope = match last {
        Some(last) if ms.is_finite() => format!("{:.2}", (ms / last.ms).ln() / (amount / last.amount).ln()),
        _ => "-".into(),
    };
    let path = renderer.plan().light_path;
    println!("| {count} | {drawn} | {path} | {load_ms:.0} | {record_ms:.2} | {gpu_ms:.2} | {ms:.2} | {slope} |");
    Ok(Row { amount, ms: if ms.is_finite() { ms } else { f64::INFINITY } })
}
