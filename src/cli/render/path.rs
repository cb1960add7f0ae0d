//! `afterlight render --path`: a picture for each moment of a camera path.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use afterlight::gpu::Device;
use afterlight::measure::Distribution;

use super::{Args, Drawn, costs, heading, renderer, settings};
use crate::cli::args::ViewChoice;
use crate::cli::failure::Failure;
use crate::cli::progress;
use crate::cli::table::{Table, milliseconds};
use crate::cli::workload::{Workload, milliseconds_since};

/// The most pictures of one path.
const MAX_PICTURES: f64 = 1e6;

/// Draws and writes the pictures from the path's start to its end, `--fps` to a second, and returns what there is to tell.
pub fn draw(
    args: &Args,
    mut workload: Workload,
    device: &Arc<Device>,
    file: &Path,
    is_verbose: bool,
) -> Result<Drawn, Failure> {
    let path = workload.follow(file)?;
    let moments = (path.seconds() * args.fps + 1e-9).floor() + 1.0;
    if moments > MAX_PICTURES {
        let seconds = path.seconds();
        let why = format!("{seconds} s at {} pictures a second are {moments:.0}, and at most 1e6 are drawn", args.fps);
        return Err(Failure::usage(why).with_hint("lower --fps"));
    }
    let count = moments as u32;
    let view = args.view.as_ref().and_then(|view| match view {
        ViewChoice::One(view) => Some(*view),
        ViewChoice::All => None,
    });
    let settings = settings(args, &workload, device, view)?;
    let target = |index| args.output.numbered(index, count);
    target(0).sink.check()?;

    let start = Instant::now();
    let (mut renderer, hazards) = renderer(args, device, &workload, &settings)?;
    workload.warn(renderer.plan())?;
    let set_up_ms = milliseconds_since(start);
    let bar = progress::bar("drawing".into(), u64::from(count), args.quiet);
    let mut drawing = Vec::new();
    for index in 0..count {
        let camera = path.at(f64::from(index) / args.fps);
        let start = Instant::now();
        let picture = renderer.picture(&camera, || {})?;
        drawing.push(milliseconds_since(start));
        target(index).write(&picture)?;
        bar.step();
    }
    drop(bar);

    let mut times = Table::with_figures_from(1);
    times.row(["load".to_owned(), milliseconds(workload.load_ms)]);
    times.row(["set-up".to_owned(), milliseconds(set_up_ms)]);
    if let Some(all) = Distribution::of(drawing.iter().copied()) {
        let what = format!("median of {count} pictures of {} samples", settings.samples);
        times.row([what, milliseconds(all.median)]);
        let slowest = drawing.iter().position(|&ms| ms == all.max).unwrap_or_default() as f64 / args.fps;
        times.row([format!("slowest, at {slowest:.2} s"), milliseconds(all.max)]);
    }
    let output = match args.output.sink.is_stdout() {
        true => args.output.sink.to_string(),
        false => format!("{} to {}", target(0).sink, target(count - 1).sink),
    };
    let mut text = heading(&workload, &settings, device, &output);
    text.push_str(&costs(&workload, renderer.plan(), &times, device, is_verbose));
    Ok(Drawn { text, hazards, files: Vec::new() })
}
