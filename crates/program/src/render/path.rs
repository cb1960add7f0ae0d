//! `afterlight render` with `--path`, `--fps` or `--duration`: a picture for each moment of a camera path and of clips.

use std::sync::Arc;
use std::time::Instant;

use afterlight::frame::Renderer;
use afterlight::gpu::Device;
use afterlight::scene::{self, Camera, CameraPath, Output, Pose, SettingsPatch, counted, metered_ev100};
use afterlight_truth::measure::Distribution;

use super::{Args, RenderOutput, costs, heading, renderer, settings};
use crate::args::ViewChoice;
use crate::failure::Failure;
use crate::image_output::PictureFormat;
use crate::progress;
use crate::table::{TextTable, milliseconds};
use crate::workload::{Workload, milliseconds_since};

/// The most pictures of one path.
const MAX_PICTURES: f64 = 1e6;

/// Pictures for each second where nothing else is said.
const DEFAULT_FPS: f64 = 30.0;

/// The moments of a sequence.
struct Moments {
    /// The camera's path; `None` where it stands, or is one that clips move.
    path: Option<CameraPath>,
    /// The camera of each picture, around a model.
    around: Vec<Camera>,
    fps: f64,
    count: u32,
}

impl Moments {
    /// A path is drawn with both of its ends. Clips loop, so that the moment at the end of a duration would be the first one again.
    fn of(args: &Args, workload: &mut Workload) -> Result<Self, Failure> {
        let fps = args.fps.unwrap_or(DEFAULT_FPS);
        if let Some(count) = args.turntable {
            let [width, height] = workload.decided(&SettingsPatch::default()).size;
            let around = scene::turntable(&workload.scene, count, f64::from(width) / f64::from(height));
            let first =
                around.first().ok_or_else(|| Failure::usage("--turntable: the scene has nothing to go around"))?;
            (workload.scene.camera, workload.scene.looks_through) = (*first, None);
            return Ok(Self { path: None, around, fps, count });
        }
        let path = args.path.as_deref().map(|file| workload.follow(file)).transpose()?;
        let clips = workload.motion.duration(&workload.playing.clips);
        let (seconds, moments) = match (args.duration, &path) {
            (Some(seconds), _) => (seconds, (seconds * fps - 1e-9).ceil().max(1.0)),
            (None, Some(path)) => (path.seconds(), (path.seconds() * fps + 1e-9).floor() + 1.0),
            (None, None) if clips > 0.0 => (clips, (clips * fps - 1e-9).ceil().max(1.0)),
            (None, None) => {
                let why = "--fps is of pictures along a --path, for a --duration, or of a scene in which a clip plays";
                return Err(Failure::usage(why));
            }
        };
        if moments > MAX_PICTURES {
            let why = format!("{seconds} s at {fps} pictures a second are {moments:.0}, and at most 1e6 are drawn");
            return Err(Failure::usage(why).with_hint("lower --fps"));
        }
        Ok(Self { path, around: Vec::new(), fps, count: moments as u32 })
    }

    /// Seconds from the first one.
    fn seconds(&self, index: u32) -> f64 {
        f64::from(index) / self.fps
    }
}

/// Has the renderer draw the scene as it is `seconds` after the first moment, and returns the scene's camera then.
pub(super) fn go_to(
    seconds: f64,
    renderer: &mut Renderer,
    workload: &Workload,
    pose: &mut Pose,
) -> Result<Camera, Failure> {
    let scene = &workload.scene;
    if !scene.moves() {
        return Ok(scene.camera);
    }
    let playing = workload.playing.with_time(workload.playing.time + seconds);
    scene.motion.pose_into(&playing, pose);
    renderer.pose(scene, pose)?;
    Ok(scene.looks_through.map_or(scene.camera, |index| pose.camera(scene, index)))
}

/// Draws and writes the pictures from the first moment to the last, and returns the facts to print.
pub fn draw(
    (args, scene): (&Args, &str),
    mut workload: Workload,
    device: &Arc<Device>,
    is_verbose: bool,
) -> Result<RenderOutput, Failure> {
    let moments = Moments::of(args, &mut workload)?;
    let count = moments.count;
    let view = args.view.as_ref().and_then(|view| match view {
        ViewChoice::One(view) => Some(*view),
        ViewChoice::All => None,
    });
    let mut settings = settings(args, &workload, device, view)?;
    if workload.scene.moves() && settings.output != Output::Nits && settings.exposure.is_none() {
        // Metered once: it does not follow lights that move.
        settings.exposure = Some(metered_ev100(&workload.scene));
    }
    if args.shard.is_some() && (args.output.sink.is_stdout() || args.output.format == PictureFormat::Video) {
        let why = "standard output and a video have the pictures in their order, and those of a shard have others between them";
        return Err(Failure::usage(why).with_hint("name a picture with -o"));
    }
    let own: Vec<u32> = (0..count).filter(|&index| args.shard.is_none_or(|shard| shard.owns(index as usize))).collect();
    let (Some(&first), Some(&last)) = (own.first(), own.last()) else {
        let why = format!("the sequence has {}, and none is left for this shard", counted(count, "picture"));
        return Err(Failure::usage(why).with_hint("deal them to fewer shards"));
    };
    let mut video = args.output.video(moments.fps)?;
    let target = |index| {
        if args.output.format == PictureFormat::Video {
            args.output.clone()
        } else {
            args.output.numbered(index, count)
        }
    };
    target(first).sink.check()?;
    workload.scene.check()?;

    let start = Instant::now();
    let output = match args.output.sink.is_stdout() || video.is_some() {
        true => args.output.sink.to_string(),
        false => format!("{} to {}", target(first).sink, target(last).sink),
    };
    let mut text = heading(&workload, &settings, device, &output);
    let (mut renderer, hazards) = renderer(args, device, &mut workload, &settings)?;
    let workload = &workload;
    workload.warn(renderer.plan())?;
    let mut pose = Pose::default();
    let set_up_ms = milliseconds_since(start);
    let bar = progress::bar("drawing".into(), own.len() as u64, args.quiet);
    let mut drawing = Vec::new();
    for &index in &own {
        let start = Instant::now();
        let seconds = moments.seconds(index);
        let show = |renderer: &mut Renderer, since| {
            let seconds = seconds + since;
            let own = go_to(seconds, renderer, workload, &mut pose)?;
            let own = moments.around.get(index as usize).copied().unwrap_or(own);
            Ok::<_, Failure>(moments.path.as_ref().map_or(own, |path| path.at(seconds)))
        };
        let picture = renderer.picture_while(show, || {})?;
        drawing.push(milliseconds_since(start));
        match &mut video {
            Some(video) => args.output.add_to(video, &picture)?,
            None => target(index).write(&picture)?,
        }
        bar.step();
    }
    drop(bar);
    if let Some(video) = video {
        video.finish(&args.output.sink)?;
    }

    let mut times = TextTable::with_figures_from(1);
    times.row(["load".to_owned(), milliseconds(workload.load_ms)]);
    times.row(["set-up".to_owned(), milliseconds(set_up_ms)]);
    if let Some(all) = Distribution::of(drawing.iter().copied()) {
        let what =
            format!("median of {} of {}", counted(own.len(), "picture"), super::frames_in_words(renderer.plan()));
        times.row([what, milliseconds(all.median)]);
        let slowest = moments.seconds(own[drawing.iter().position(|&ms| ms == all.max).unwrap_or_default()]);
        times.row([format!("slowest, at {slowest:.2} s"), milliseconds(all.max)]);
    }
    text.push_str(&costs((args, scene), renderer.plan(), &times, device, is_verbose));
    Ok(RenderOutput { text, hazards, files: Vec::new() })
}
