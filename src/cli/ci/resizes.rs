//! A storm of resizes: one surface without a display is fitted to many sizes, and drawn into at each.

use afterlight::frame::{self, Outcome, Presenter};
use afterlight::gpu::{self, Device, HEADLESS, Instance, InstanceOptions, MessageKind, Surface, Validation, Vsync};
use afterlight::scene::Settings;

use super::evidence::Evidence;
use super::examine::{Drawing, Place, Stop};
use super::verdict::{CaseReport, Check};

/// The edges of the sizes, in pixels, one after the other: from one pixel to some that share no factor.
const EDGES: [u32; 11] = [64, 1, 97, 33, 256, 2, 129, 64, 17, 200, 8];

/// Draws into `count` sizes. Skipped where the instance or the device has no surface without a display.
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
    for index in 0..count as usize {
        let size = [EDGES[index % EDGES.len()], EDGES[(index / EDGES.len() + 2 * index) % EDGES.len()]];
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
