//! Frames with other dependencies than the plan's, for the layer to look at; and all that a window's frames can have, on a surface without a display.

use std::sync::Arc;

use afterlight::frame::rows::Rows;
use afterlight::frame::{Error, Picture, Renderer};
#[cfg(feature = "present")]
use afterlight::frame::{Outcome, Presenter};
use afterlight::gpu::Device;
#[cfg(feature = "present")]
use afterlight::gpu::{Error as GpuError, Surface, Vsync, vk};
#[cfg(feature = "present")]
use afterlight::passes::overlay::{PanelDraw, PanelTexture, PanelVertex, Panels};
use afterlight::scene::{Playing, Scene, Settings};

/// Draws enough frames that each dependency has something to order: frames in flight, each of whose slots is used again, and read-backs under way
/// while the next frame is drawn. Waits until all of it is done and destroyed, so that the layer has reported everything. Returns the picture that
/// was copied last.
///
/// # Safety
/// As of [`Renderer::with_rows`].
///
/// # Errors
/// As [`Renderer::with_rows`], [`Renderer::render`] and [`Renderer::read_back`].
pub unsafe fn draw(device: &Arc<Device>, scene: &Scene, settings: &Settings, rows: Rows) -> Result<Picture, Error> {
    // SAFETY: the caller's promise.
    let mut renderer = unsafe { Renderer::with_rows(device, scene, settings, rows) }?;
    for frame in 0..4 {
        pose(&mut renderer, scene, frame)?;
        renderer.render(&scene.camera)?;
        if frame == 1 || frame == 2 {
            renderer.start_read_back()?;
        }
    }
    let picture = renderer.finish_read_back()?;
    drop(renderer);
    device.wait_idle()?;
    Ok(picture)
}

/// Another moment of the scene's motion in each frame but one, so that a pose is also drawn twice.
fn pose(renderer: &mut Renderer, scene: &Scene, frame: u32) -> Result<(), Error> {
    if scene.motion.is_empty() || frame == 2 {
        return Ok(());
    }
    renderer.pose(scene, &scene.motion.pose(&Playing::at(0.1 * f64::from(frame))))
}

/// The way of pictures into a swapchain's images. No dependency depends on the images' format or encoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PresentPath {
    /// The last pass draws into them.
    Straight,
    /// PRESENT enlarges them.
    Enlarged,
    /// ENCODE writes them.
    Encoded,
    /// ENCODE writes them from a copy of the picture, which is kept.
    EncodedKept,
}

/// Draws like [`draw`], but presents the frames, on a surface without a display: with and without everything that may lie over the picture (another
/// picture beside it, panels, and a copy of it all). Returns the first picture, with nothing beside it or over it.
///
/// # Safety
/// As of [`Renderer::with_rows`].
///
/// # Errors
/// As [`Presenter::fit`] and [`Presenter::draw`]; an instance without [`afterlight::gpu::HEADLESS`].
#[cfg(feature = "present")]
pub unsafe fn present(
    device: &Arc<Device>,
    scene: &Scene,
    settings: &Settings,
    rows: Rows,
    path: PresentPath,
) -> Result<Picture, Error> {
    let presenter = presenter(device, scene, settings, path)?;
    // SAFETY: the caller's promise.
    let presenter = unsafe { presenter.with_rows(move |_| rows.clone()) };
    show_all(device, presenter, scene, settings, path)
}

/// [`present`] with the dependencies that [`afterlight::frame::rows::table`] has for the plan.
///
/// # Errors
/// As there.
#[cfg(feature = "present")]
pub fn show(device: &Arc<Device>, scene: &Scene, settings: &Settings, path: PresentPath) -> Result<Picture, Error> {
    show_all(device, presenter(device, scene, settings, path)?, scene, settings, path)
}

#[cfg(feature = "present")]
fn presenter(device: &Arc<Device>, scene: &Scene, settings: &Settings, path: PresentPath) -> Result<Presenter, Error> {
    let presenter = Presenter::new(device, Surface::headless(device)?, scene, settings, Vsync::Off)?;
    Ok(match path {
        PresentPath::Straight => presenter,
        PresentPath::Enlarged => presenter.with_dynamic_resolution(),
        PresentPath::Encoded => presenter.with_encoding(),
        PresentPath::EncodedKept => presenter.with_encoding().with_kept_pictures(),
    })
}

#[cfg(feature = "present")]
fn show_all(
    device: &Device,
    mut presenter: Presenter,
    scene: &Scene,
    settings: &Settings,
    path: PresentPath,
) -> Result<Picture, Error> {
    let mut first = None;
    for beside in [None, Some(settings.view)] {
        presenter.show_beside(beside);
        presenter.fit(scene, settings, settings.size)?;
        if let Some(refused) = presenter.refusal() {
            return Err(refused);
        }
        // More than there are images, so that each is drawn into again.
        for frame in 0..12 {
            // Smaller pictures than the window, once whole ones are shown.
            if path == PresentPath::Enlarged && frame == 4 {
                presenter.set_resolution(0.5)?;
            }
            let (is_copied, has_panels) = (frame % 2 == 1, frame % 4 > 1);
            let panels = has_panels.then(|| panels(settings.size, !presenter.has_overlay()));
            match presenter.draw(&scene.camera, is_copied, panels.as_ref())? {
                Outcome::Shown(_) if is_copied => _ = first.get_or_insert(presenter.picture()?),
                Outcome::Shown(_) => {}
                Outcome::Nothing(fit) => {
                    return Err(GpuError::Unsupported(format!("no image to draw into: {fit:?}")).into());
                }
            }
        }
    }
    drop(presenter);
    device.wait_idle()?;
    first.ok_or_else(|| GpuError::Misuse("no picture was copied".into()).into())
}

/// A triangle over a part of the picture, with its texture where that is not on the device yet.
#[cfg(feature = "present")]
fn panels([width, height]: [u32; 2], with_texture: bool) -> Panels {
    let corner =
        |x: u32, y: u32| PanelVertex { position: [x as f32, y as f32], uv: [0.5; 2], color: [90, 60, 30, 128] };
    let white = PanelTexture { id: 0, size: [1; 2], rgba: vec![255; 4] };
    let scissor = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
    Panels {
        pixels_per_point: 1.0,
        vertices: vec![corner(0, 0), corner(width, 0), corner(0, height)],
        indices: vec![0, 1, 2],
        draws: vec![PanelDraw { texture: 0, scissor, indices: 0..3 }],
        textures: if with_texture { vec![white] } else { Vec::new() },
        ..Panels::default()
    }
}
