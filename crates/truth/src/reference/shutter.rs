//! The truth of a scene or camera that moves while the shutter is open.
//!
//! Sample n of N takes the n-th of N equal parts of the time, in every pixel; each pixel chooses by itself one of [`MOMENTS`] moments in that part.
//! So a pixel's samples are spread evenly over the time, and neighbouring pixels see other moments: a moving edge leaves noise, not a row of copies.
//! For each moment the scene is posed and its tree of boxes built anew: exact motion, whatever moves, along any curve.

use super::render::{Accumulation, ProgressCallback};
use super::{CameraView, Reference, Smith, Truth, sampling};
use afterlight_scene::{Camera, CameraPath, Error, Playing, Scene, Settings};

/// Moments in the part of the time that one sample has.
const MOMENTS: u32 = 4;

/// A scene in which something moves, or whose camera does, and for how long it is looked at.
#[derive(Debug, Clone)]
pub struct ShutterScene<'a> {
    /// As it was read, with all that moves in it.
    pub scene: &'a Scene,
    /// The moment at which the shutter opens, and the clips.
    pub playing: Playing,
    /// The camera's path, and the seconds along it at which the shutter opens.
    pub path: Option<(&'a CameraPath, f64)>,
    /// The time for which the shutter is open, in seconds.
    pub seconds: f64,
}

impl ShutterScene<'_> {
    /// The scene as it stands at a share of the time, with its camera.
    fn at(&self, share: f64) -> Scene {
        let seconds = share * self.seconds;
        let mut scene = self.scene.at(&self.playing.with_time(self.playing.time + seconds)).into_owned();
        if let Some((path, start)) = self.path {
            scene.camera = path.at(start + seconds);
        }
        scene
    }
}

/// The other parameters that a truth of it depends on, beside the settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShutterOptions {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Samples of each pixel.
    pub samples: u32,
    /// The masking and shadowing function.
    pub smith: Smith,
}

/// Renders the mean over the pixel, the lens that the settings ask for, and the time. The result is the same to the last bit on any number of
/// threads.
///
/// # Errors
/// When [`Scene::check`] finds a fault at some moment.
pub fn render(
    shot: &ShutterScene,
    exposure: &ShutterOptions,
    settings: &Settings,
    progress: ProgressCallback,
) -> Result<Truth, Error> {
    let ShutterOptions { size, samples, smith } = *exposure;
    let mut accumulation = Accumulation::new(size);
    let pixels = accumulation.mean.len() as u64;
    for sample in 0..samples {
        for moment in 0..MOMENTS {
            let part = f64::from(sample) + (f64::from(moment) + 0.5) / f64::from(MOMENTS);
            let scene = shot.at(part / f64::from(samples));
            let camera: Camera = scene.camera;
            let reference = Reference::new(&scene)?.with_settings(settings, &camera);
            let is_now = |pixel: u64| sampling::part_of_time(sample, pixel, MOMENTS) == moment;
            let view = CameraView { camera, size };
            reference.accumulate_some(&view, (smith, 1), &is_now, &mut accumulation, &|_| ());
        }
        accumulation.samples += 1;
        progress(u64::from(sample + 1) * pixels, u64::from(samples) * pixels);
    }
    Ok(accumulation.truth(size))
}
