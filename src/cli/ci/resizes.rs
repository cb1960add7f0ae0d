//! A storm of resizes: one surface without a display is fitted to many sizes, and drawn into at each.

use afterlight::frame::{self, Outcome, Presenter};
use afterlight::gpu::{self, Device, HEADLESS, Instance, InstanceOptions, MessageKind, Surface, Validation, Vsync};
use afterlight::scene::Settings;

use super::evidence::Evidence;
use super::examine::{Drawing, Place, Stop};
use super::verdict::{CaseReport, Check};

/// Sizes are the same in each run, so that a failure comes again.
const SEED: u64 = 7;
/// The longest edge, in pixels.
const LONGEST: u32 = 256;

/// Draws into `count` sizes at random. Skipped where the instance or the device has no surface without a display.
pub fn storm(
    count: u32,
    place: &Place,
    drawing: &Drawing,
    evidence: &Evidence,
    report: &mut CaseReport,
) -> Result<(), Stop> {
    let options = InstanceOptions { validation: Validation::Off, ..InstanceOptions::default() };
    let instance = match Instance::with_extensions(&options, &HEADLESS) {
        Err(error @ gpu::Error::Unsupported(_)) => {
            report.skip(Check::Resizes, error.to_string());
            return Ok(());
        }
        made => made?,
    };
    let log = instance.message_log();
    let device = match Device::with_extensions(&instance, place.device, &[c"VK_KHR_swapchain"]) {
        Err(error @ gpu::Error::Unsupported(_)) => {
            report.skip(Check::Resizes, error.to_string());
            return Ok(());
        }
        made => made?,
    };
    evidence.labels("resizes", &device);
    let surface = Surface::headless(&device)?;
    let drawn = draw(count, &device, surface, drawing);
    drop((device, instance));
    let left = log.take().into_iter().find(|message| message.kind == MessageKind::Leak);
    match (drawn?, left) {
        (_, Some(left)) => report.hold(Check::ResourcesLeft, false, format!("after resizes: {}", left.text)),
        (None, None) => report.hold(Check::Resizes, true, format!("{count} sizes were drawn into")),
        (Some(why), None) => report.hold(Check::Resizes, false, why),
    }
    Ok(())
}

/// Why a size was not drawn into, if one was not.
fn draw(
    count: u32,
    device: &std::sync::Arc<Device>,
    surface: std::sync::Arc<Surface>,
    drawing: &Drawing,
) -> Result<Option<String>, Stop> {
    let mut presenter = Presenter::new(device, surface, &drawing.scene, &drawing.settings, Vsync::Off)?;
    let mut random = fastrand::Rng::with_seed(SEED);
    for _ in 0..count {
        // One-pixel edges find the most faults.
        let size = [(); 2].map(|()| if random.u32(..8) == 0 { 1 } else { random.u32(1..=LONGEST) });
        let settings = Settings { size, ..drawing.settings.clone() };
        presenter.fit(&drawing.scene, &settings, size)?;
        if let Some(refused) = presenter.refusal() {
            return Err(frame::Error::into(refused));
        }
        let [width, height] = size;
        match presenter.draw(&drawing.scene.camera, true, None)? {
            Outcome::Shown(_) => {
                let picture = presenter.picture()?;
                if picture.size != size {
                    return Ok(Some(format!("the picture of {width}x{height} is {:?}", picture.size)));
                }
            }
            Outcome::Nothing(fit) => return Ok(Some(format!("nothing was drawn at {width}x{height}: {fit:?}"))),
        }
    }
    Ok(None)
}
