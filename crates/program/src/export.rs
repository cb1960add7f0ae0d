//! `afterlight export`: a scene as glTF 2.0, for other renderers. No Vulkan.

use std::fmt::Write as _;
use std::path::Path;

use afterlight::scene::builtin;
use afterlight::scene::gltf::{self, ExportedView};
use afterlight::scene::{SETTINGS, Setting, Settings, SettingsPatch, ev100_of};

use super::args::SettingsArgs;
use super::failure::Failure;
use super::output::{self, Sink};
use super::table::bytes;
use super::typed::Typed;
use super::workload::{Workload, counts};

/// The licence and the author of the built-in scenes.
const CC0: &str = "CC0 1.0: made by the Afterlight project";

/// Write a scene as glTF 2.0, so that other renderers can draw it
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  afterlight export builtin:hall -o hall.glb
  afterlight export \"builtin:field?objects=1000&lights=64\" -o field.glb
  afterlight export scene.toml -o scene.glb --size 1920x1080 --exposure 9
  afterlight export model.obj -o model.glb --camera \"-9,2,0/0,3,0/70\"
  afterlight export builtin:seaweed --time 2.5 -o sea.glb")]
pub struct Args {
    /// The scene: a model (.gltf, .glb, .obj), a .toml scene file, or `builtin:NAME?key=value&...`
    scene: String,
    /// The file: .glb, with all buffers and textures in it; - is standard output
    #[arg(short, long, value_name = "FILE", value_parser = model)]
    output: Sink,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    settings: SettingsArgs,
}

/// Opens the scene and writes it.
pub fn run(args: &Args) -> Result<(), Failure> {
    args.output.check()?;
    let mut workload = Workload::open(&args.scene, &args.settings, args.quiet)?;
    workload.spare([&args.output])?;
    let settings = workload.decided(&SettingsPatch::default());
    let exposure = ev100_of(&workload.scene, &settings);
    let place = workload.place(&settings);
    let copyright = args.scene.starts_with(builtin::PREFIX).then(|| CC0.to_owned());
    let shot = ExportedView { size: settings.size, exposure, settings: workload.patch(), copyright };
    let scene = std::mem::take(&mut workload.scene);
    let name = scene.name.clone();
    let exported = gltf::write(scene, &shot)?;
    args.output.write(&exported.bytes)?;
    if args.quiet {
        return Ok(());
    }
    let mut left_out = exported.left_out;
    left_out.extend(effects(&settings));
    if !workload.motion.clips.is_empty() {
        left_out.push(format!("clips: the scene is that at {} s", workload.playing.time));
    }
    let warnings = left_out.iter().fold(String::new(), |text, what| text + "warning: not in the file: " + what + "\n");
    output::print(&warnings, true)?;
    workload.scene = exported.scene;
    let size = bytes(exported.bytes.len() as u64);
    let mut text = format!("{name} -> {}: {size} of glTF 2.0\n{}\n{place}\n", args.output, counts(&workload.scene));
    if !exported.extensions.is_empty() {
        let _ = writeln!(text, "extensions: {}", exported.extensions.join(", "));
    }
    let [width, height] = shot.size;
    let file = if args.output.is_stdout() { "FILE.glb".to_owned() } else { args.output.to_string() };
    let drawing = Typed::new("render").about(file).option("size", format!("{width}x{height}"));
    let _ = writeln!(text, "draw it: {}", drawing.option("exposure", exposure.to_string()));
    output::print(&text, args.output.is_stdout())
}

/// Names the settings in use that glTF has no words for, because they work on this renderer's frames.
fn effects(settings: &Settings) -> Option<String> {
    let (own, plain) = (settings.patch(), Settings::default().patch());
    let is_on = |row: &&Setting| row.beyond_gltf && row.text(&own) != row.text(&plain);
    let on: Vec<&str> = SETTINGS.iter().filter(is_on).map(|row| row.key).collect();
    (!on.is_empty()).then(|| format!("effects of the picture ({}): the scene's extras name them", on.join(", ")))
}

/// A file for a model, or standard output.
fn model(text: &str) -> Result<Sink, String> {
    let sink = Sink::parse(text)?;
    let Sink::File(path) = &sink else { return Ok(sink) };
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("glb") => Ok(sink),
        // Writing refuses a folder by that name, which says more than its ending.
        _ if Path::new(text).is_dir() => Ok(sink),
        Some(other) => Err(format!("'.{other}' is not written; use .glb")),
        None => Err("the name must end in .glb".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_written_as_glb_alone() {
        assert_eq!(model("a.GLB"), Ok(Sink::File("a.GLB".into())));
        assert_eq!(model("-"), Ok(Sink::Stdout));
        for (text, words) in [("", "a file name is needed"), ("a.gltf", "'.gltf' is not written"), ("a", "end in .glb")]
        {
            assert!(model(text).is_err_and(|error| error.contains(words)), "{text}");
        }
    }

    #[test]
    fn effects_that_are_on_are_named() {
        let of = |text: &str| effects(&text.parse::<SettingsPatch>().expect("settings").decide());
        assert_eq!(of("exposure=3 size=9x9"), None);
        assert!(of("fog=height bloom=0.1").is_some_and(|told| told.contains("(fog, bloom)")));
    }
}
