//! `afterlight compare`: how far two pictures are apart. No Vulkan.

mod image_file;
mod metric;
mod pair;

use serde::Serialize;

use afterlight::frame::{Picture, Pixels};
use afterlight::scene::Tonemap;

use super::args::{exposure, value};
use super::failure::{Exit, Failure};
use super::image_output::{Destination, PictureFormat};
use super::output;
use super::table::TextTable;
#[cfg(feature = "ci")]
pub use image_file::ImageFile;
use metric::{ComparisonMetric, Limit};
use pair::{Comparison, ImagePair};

/// Tell how far two pictures of the same size are apart, by all metrics
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight compare hall.png expected.png
  afterlight compare hall.exr truth.exr -o difference.png
  afterlight compare hall.exr truth.exr --exposure 12 --tonemap agx --json
  afterlight compare hall.png hall.exr --exposure 14.5 --max flip=0.02
  afterlight compare a.png b.png --max flip=0.01 --max psnr=40
  afterlight compare a.exr b.exr -o signed.png --difference signed

A mean FLIP of .01 nobody sees; at .05 pictures look the same side by side, at
.1 materials or shadows differ, at .3 a light is missing. docs/FLIP.md has
pictures.")]
pub struct Args {
    /// The picture that is judged: 8-bit sRGB (as .png or .jpg), or linear light (.exr, 16 or 32-bit floats)
    actual: std::path::PathBuf,
    /// The picture that it should be, of the same size
    expected: std::path::PathBuf,
    /// Write a picture of the difference, a .png; - is standard output
    #[arg(short, long, value_name = "FILE", value_parser = Destination::parse)]
    output: Option<Destination>,
    /// Draw the difference as flip (black where nobody sees one, then purple, orange, pale yellow), or signed
    /// (grey where equal, brighter where the first picture is) [default: flip, or signed where FLIP is not built in]
    #[arg(long, value_enum, value_name = "NAME", requires = "output")]
    difference: Option<DifferenceKind>,
    /// Exposure of linear light as EV100 [default: the expected picture's mean luminance becomes 0.18]
    #[arg(long, value_name = "EV100", value_parser = exposure, allow_hyphen_values = true)]
    exposure: Option<f32>,
    /// Tone mapper of linear light: neutral, agx, aces or none [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = value::<Tonemap>)]
    tonemap: Option<Tonemap>,
    /// Fail with exit code 1 where the metric is larger: rmse, relmse, max, p99.9, flip, differing (pixels), or psnr (where it is
    /// smaller). Can be given several times; any fails where a pixel is not finite
    #[arg(long = "max", value_name = "METRIC=VALUE", value_parser = Limit::parse)]
    limits: Vec<Limit>,
    /// Print the metrics, the limits and the verdict as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum DifferenceKind {
    #[cfg(feature = "report")]
    Flip,
    Signed,
}

/// Compares, and prints and writes the results.
pub fn run(args: &Args) -> Result<(), Failure> {
    if let Some(target) = &args.output {
        if target.format != PictureFormat::Png {
            return Err(Failure::usage("a picture of a difference is a .png"));
        }
        if target.sink.is_stdout() && args.json {
            return Err(Failure::usage("--json and -o - cannot both have standard output"));
        }
        target.sink.check()?;
        output::spare([&target.sink], [&args.actual, &args.expected])?;
    }
    let pair = ImagePair::open(args)?;
    // Before the work, so that a metric that the pictures do not have is told at once.
    for limit in &args.limits {
        limit.metric.applies(pair.is_light())?;
    }
    let comparison = pair.compare()?;
    if let Some(target) = &args.output {
        let pixels = difference_picture(args, &pair, &comparison);
        let rgba = pixels.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        target.write(&Picture { size: pair.size(), pixels: Pixels::Srgb8(rgba) })?;
    }
    let stdout_is_taken = args.output.as_ref().is_some_and(|target| target.sink.is_stdout());
    match args.json {
        true => output::print(&output::json(&ComparisonReport::of(args, &pair, &comparison))?, false)?,
        false => output::print(&text(args, &pair, &comparison), stdout_is_taken)?,
    }
    judge(&args.limits, &comparison)
}

/// Returns whether all limits hold, in a word; `None` without any.
fn verdict(limits: &[Limit], comparison: &Comparison) -> Option<&'static str> {
    let passed = || if judge(limits, comparison).is_ok() { "passed" } else { "failed" };
    (!limits.is_empty()).then(passed)
}

/// The limits that do not hold, in a sentence.
fn judge(limits: &[Limit], comparison: &Comparison) -> Result<(), Failure> {
    if limits.is_empty() {
        return Ok(());
    }
    let not_finite = comparison.not_finite();
    let mut broken = Vec::new();
    if not_finite > 0 {
        broken.push(format!("{not_finite} pixel(s) are not finite"));
    }
    broken.extend(limits.iter().filter_map(|limit| limit.broken_by(comparison)));
    match broken.is_empty() {
        true => Ok(()),
        false => Err(Failure::new(Exit::FailedCheck, format!("the pictures differ too much: {}", broken.join("; ")))),
    }
}

fn difference_picture(args: &Args, pair: &ImagePair, comparison: &Comparison) -> Vec<[u8; 3]> {
    match args.difference {
        Some(DifferenceKind::Signed) => pair.signed_difference(comparison),
        #[cfg(feature = "report")]
        None | Some(DifferenceKind::Flip) => comparison.flip.heat().pixels,
        #[cfg(not(feature = "report"))]
        None => pair.signed_difference(comparison),
    }
}

/// The comparison as JSON; docs/COMMANDS.md has the keys.
#[derive(Debug, Serialize)]
struct ComparisonReport {
    afterlight: &'static str,
    actual: String,
    expected: String,
    size: [u32; 2],
    exposure_ev100: Option<f64>,
    tonemap: Option<String>,
    light: Option<ErrorFigures>,
    shown: ErrorFigures,
    psnr_db: Option<f64>,
    flip: Option<f64>,
    differing_pixels: usize,
    not_finite: usize,
    expected_not_finite: usize,
    limits: Vec<LimitReport>,
    verdict: Option<&'static str>,
}

/// A `--max`, and the value found.
#[derive(Debug, Serialize)]
struct LimitReport {
    metric: &'static str,
    limit: f64,
    value: Option<f64>,
    holds: bool,
}

#[derive(Debug, Serialize)]
struct ErrorFigures {
    rmse: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    rel_mse: Option<f64>,
    max: f64,
    p99_9: f64,
}

impl ComparisonReport {
    fn of(args: &Args, pair: &ImagePair, comparison: &Comparison) -> Self {
        let shown = &comparison.shown;
        let light = comparison.light.as_ref();
        let counted = light.unwrap_or(shown);
        Self {
            afterlight: env!("CARGO_PKG_VERSION"),
            actual: args.actual.display().to_string(),
            expected: args.expected.display().to_string(),
            size: pair.size(),
            exposure_ev100: pair.exposure().map(f64::from),
            tonemap: pair.exposure().map(|_| pair.tonemap().to_string()),
            light: light.map(|light| ErrorFigures {
                rmse: light.rmse,
                rel_mse: Some(light.rel_mse),
                max: light.max,
                p99_9: light.p99_9,
            }),
            shown: ErrorFigures { rmse: shown.rmse, rel_mse: None, max: shown.max, p99_9: shown.p99_9 },
            psnr_db: Some(shown.psnr_db(1.0)).filter(|psnr| psnr.is_finite()),
            flip: ComparisonMetric::Flip.of(comparison),
            differing_pixels: counted.differing_pixels,
            not_finite: comparison.actual_not_finite,
            expected_not_finite: comparison.expected_not_finite,
            limits: args
                .limits
                .iter()
                .map(|limit| LimitReport {
                    metric: limit.metric.name(),
                    limit: limit.value,
                    value: limit.metric.of(comparison).filter(|value| value.is_finite()),
                    holds: limit.broken_by(comparison).is_none(),
                })
                .collect(),
            verdict: verdict(&args.limits, comparison),
        }
    }
}

fn text(args: &Args, pair: &ImagePair, comparison: &Comparison) -> String {
    let [width, height] = pair.size();
    let mut text = format!("{} against {}: {width}x{height}\n", args.actual.display(), args.expected.display());
    let mut table = TextTable::with_figures_from(1);
    if let Some(ev100) = pair.exposure() {
        text += &format!("light exposed at EV100 {ev100:.2}, shown by the tone mapper {}\n", pair.tonemap());
    }
    if let Some(light) = &comparison.light {
        text += "\nLight, 1 being where the sensor saturates\n";
        table.row(["relMSE".to_owned(), figure(light.rel_mse)]);
        table.row(["RMSE".to_owned(), figure(light.rmse)]);
        table.row(["99.9th percentile".to_owned(), figure(light.p99_9)]);
        table.row(["largest".to_owned(), figure(light.max)]);
        text += &table.render();
        table = TextTable::with_figures_from(1);
    }
    let shown = &comparison.shown;
    text += "\nAs shown, sRGB from 0 to 1\n";
    match ComparisonMetric::Flip.of(comparison) {
        Some(flip) => table.row(["mean FLIP".to_owned(), figure(flip)]),
        None => table.row(["mean FLIP".to_owned(), "not built in (feature report)".to_owned()]),
    };
    table.row(["PSNR".to_owned(), psnr(shown.psnr_db(1.0))]);
    table.row(["RMSE".to_owned(), figure(shown.rmse)]);
    table.row(["99.9th percentile".to_owned(), figure(shown.p99_9)]);
    table.row(["largest".to_owned(), figure(shown.max)]);
    text += &table.render();
    text += "\nPixels\n";
    let mut table = TextTable::with_figures_from(1);
    let differing = comparison.light.as_ref().unwrap_or(shown).differing_pixels;
    let pixels = (u64::from(width) * u64::from(height)).max(1);
    let share = 100.0 * differing as f64 / pixels as f64;
    table.row(["differing".to_owned(), differing.to_string(), format!("{share:.2} %")]);
    table.row(["not finite".to_owned(), comparison.actual_not_finite.to_string()]);
    table.row(["not finite in the expected".to_owned(), comparison.expected_not_finite.to_string()]);
    text + &table.render()
}

/// Four significant digits.
fn figure(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 { format!("{value:.3e}") } else { format!("{value:.4}") }
}

fn psnr(decibels: f64) -> String {
    if decibels.is_finite() { format!("{decibels:.2} dB") } else { "equal".to_owned() }
}

/// Pixels that are not the same to the bit.
pub fn differing(one: &Picture, other: &Picture) -> usize {
    let count = |differ: &mut dyn Iterator<Item = bool>| differ.filter(|differs| *differs).count();
    match (&one.pixels, &other.pixels) {
        (Pixels::Srgb8(a), Pixels::Srgb8(b)) if a.len() == b.len() => {
            count(&mut a.chunks(4).zip(b.chunks(4)).map(|(a, b)| a != b))
        }
        (Pixels::LinearF32(a), Pixels::LinearF32(b)) if a.len() == b.len() => {
            let bits = |pixel: &[f32]| pixel.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            count(&mut a.chunks(4).zip(b.chunks(4)).map(|(a, b)| bits(a) != bits(b)))
        }
        _ => one.size[0].max(other.size[0]) as usize * one.size[1].max(other.size[1]) as usize,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_that_differ_are_counted_by_their_bits() {
        let shown = |bytes: &[u8]| Picture { size: [2, 1], pixels: Pixels::Srgb8(bytes.to_vec()) };
        let light = |light: &[f32]| Picture { size: [2, 1], pixels: Pixels::LinearF32(light.to_vec()) };
        assert_eq!(differing(&shown(&[1; 8]), &shown(&[1; 8])), 0);
        assert_eq!(differing(&shown(&[1; 8]), &shown(&[1, 1, 1, 1, 1, 2, 1, 1])), 1);
        assert_eq!(differing(&light(&[0.0; 8]), &light(&[-0.0, 0., 0., 0., 0., 0., 0., 0.])), 1);
        assert_eq!(differing(&light(&[f32::NAN; 8]), &light(&[f32::NAN; 8])), 0);
        assert_eq!(differing(&shown(&[1; 8]), &light(&[1.0; 8])), 2);
    }
}
