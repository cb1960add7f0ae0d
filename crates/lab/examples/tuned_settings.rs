//! Settings tuned for a bound: the fastest on this device whose picture is near enough to the truth, also from another camera.
//!
//!     cargo run --release -p afterlight-lab --example tuned_settings --features report

use std::error::Error;

use afterlight::frame::Renderer;
use afterlight::gpu::{Device, DeviceChoice, Instance, InstanceOptions};
use afterlight::scene::{OpenOptions, SettingsPatch, open};
use afterlight_lab::report::tune::{Goal, GoalBound, Metric, Selection, tune};

fn main() -> Result<(), Box<dyn Error>> {
    let scene = open("builtin:spheres?columns=2&rows=1", &OpenOptions::default())?;
    let instance = Instance::new(&InstanceOptions::default())?;
    let device = Device::new(&instance, &DeviceChoice::Auto)?;

    // FLIP, a measure of differences that people see, of at most 0.3. A real bound is lower: 0.05 is hard to tell from the truth.
    let goal = Goal { bound: GoalBound::Error(0.3), metric: Metric::Flip };
    // A small picture, and few settings to choose from, so that this takes seconds. `families: None` tries all.
    let given = SettingsPatch { size: Some([64, 36]), ..scene.settings.clone() };
    let families = Some(vec!["gbuffer".into(), "msaa".into()]);
    let selection = Selection { families, joint: 0, quick: true, seed: 1 };
    let tuned = tune(&device, (&scene, &given), &selection, goal, 1)?;

    let Some(choice) = tuned.choice() else {
        return Err("no settings keep the bound".into());
    };
    println!("chosen of {}: {choice}", tuned.patches.len());

    // The choice holds the changes to the given settings.
    let mut renderer = Renderer::new(&device, &scene, &choice.or(&given).decide())?;
    renderer.picture(&scene.camera, || {})?;
    Ok(())
}
