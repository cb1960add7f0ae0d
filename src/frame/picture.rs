//! Pictures of one frame or of many, read back.

use super::accumulate::Accumulator;
use super::jitter::{lens_point, moment, sample_offset};
use super::timeline::FRAMES_A_SECOND;
use super::{Error, Renderer};
use crate::scene::{Camera, ThinLens};

/// A finished picture, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The texels, row by row.
    pub pixels: Pixels,
}

/// The texels of a picture, RGBA.
#[derive(Debug, Clone, PartialEq)]
pub enum Pixels {
    /// Tone-mapped, sRGB-encoded.
    Srgb8(Vec<u8>),
    /// Linear, in nits or exposed as [`crate::scene::Output`] says, or the values of a view; exposed in a frame of a tone-mapped picture that is made of
    /// several.
    LinearF32(Vec<f32>),
}

impl Renderer {
    /// Draws the picture that the settings ask for, of one frame or many, and reads it back. Several frames sample the whole lens, if the camera has
    /// one. `drawn` is told of each frame.
    ///
    /// # Errors
    /// When the device is lost, or it lacks the memory for a copy.
    pub fn picture(&mut self, camera: &Camera, drawn: impl FnMut()) -> Result<Picture, Error> {
        self.picture_while(|_, _| Ok::<_, Error>(*camera), drawn)
    }

    /// Discards the history of frames averaged over time: the next frame shows something else, as after a cut in a film.
    pub fn cut(&mut self) {
        self.timeline.begin(self.plan.averaged_frames());
    }

    /// Returns true if more frames of the same would still come nearer to the truth.
    pub fn converges(&self) -> bool {
        self.plan.averages_over_time() && self.timeline.still() < self.plan.averaged_frames()
    }

    /// The camera of frame `index` of a picture: where the settings ask for a lens and several frames, it stands in that frame's own point of it.
    pub fn behind_lens(&self, camera: &Camera, index: u32) -> Camera {
        let count = self.plan.samples;
        let lens = ThinLens::of(&self.settings, camera).filter(|_| count > 1);
        lens.map_or(*camera, |lens| lens.through(camera, lens_point(index, count)))
    }

    /// Draws frame `index` of a picture of several, with its own subpixel offset, its own point of the lens and its own directions of the sky's
    /// light.
    ///
    /// # Errors
    /// When the device is lost or out of memory.
    pub fn render_sample(&mut self, camera: &Camera, index: u32) -> Result<(), Error> {
        self.world.aim_sky(&self.plan, index);
        let jitter = sample_offset(index, self.plan.frames_a_picture());
        self.render_jittered(&self.behind_lens(camera, index), jitter)
    }

    /// Draws a picture as [`Renderer::picture`] does, while things move and the shutter is open: before each frame `go_to` is given this renderer and the
    /// frame's moment, in seconds after the shutter opens; it poses the renderer, and returns the camera of that moment. One frame alone shows the moment
    /// 0. Where frames are averaged over time, a picture begins with a cut, and its frames show moments before 0, 60 a second, and at last 0.
    ///
    /// # Errors
    /// The errors of `go_to` and of [`Renderer::picture`].
    pub fn picture_while<E: From<Error>>(
        &mut self,
        mut go_to: impl FnMut(&mut Self, f64) -> Result<Camera, E>,
        mut drawn: impl FnMut(),
    ) -> Result<Picture, E> {
        let (count, shutter) = (self.plan.samples, f64::from(self.settings.shutter));
        if self.plan.averages_over_time() {
            let frames = self.plan.frames_a_picture();
            self.timeline.begin(frames.min(self.plan.averaged_frames()));
            for left in (0..frames).rev() {
                let camera = go_to(self, -f64::from(left) / FRAMES_A_SECOND)?;
                self.render(&camera)?;
                drawn();
            }
            return Ok(self.read_back()?);
        }
        if count == 1 {
            let camera = go_to(self, 0.0)?;
            self.render(&camera)?;
            drawn();
            return Ok(self.read_back()?);
        }
        let mut sum = Accumulator::new(&self.plan);
        for index in 0..count {
            let camera = go_to(self, moment(index, count) * shutter)?;
            self.render_sample(&camera, index)?;
            self.look_at_linear(|rgba| {
                drawn();
                sum.add(rgba);
            })?;
        }
        Ok(sum.picture())
    }
}
