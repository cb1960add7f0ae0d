//! The truth: the same scene, evaluated in 64 bits on the CPU by rays. Exact visibility, exact shadows, no G-buffer, no maps.
//!
//! It shares no shading code with the shaders and is written from the formulas, for reading. Where a picture of the renderer differs
//! from the truth, the difference is the renderer's error. No Vulkan.
//!
//! Nothing that a ray does goes through `map` of an array: compiled in several units that is not inlined, and all of this took twice as long.

mod air;
pub mod bloom;
mod bvh;
mod cache;
pub mod depth_march;
mod fingerprint;
pub mod fog;
mod geometry;
mod intersect;
pub mod light;
mod material;
pub mod occlusion;
mod particles;
mod rays;
pub mod reflections;
mod render;
mod sampling;
pub mod screen_march;
mod shadow;
pub mod shown;
pub mod shutter;
mod sky;
mod surface;
mod texture;
pub mod tonemap;

pub use cache::{Cache, Cached, Source};
pub use render::{Accumulation, Progress, Reference};
pub use sky::{SkyLight, share_of};
pub use surface::Surface;

pub use crate::scene::TriangleId;

use crate::scene::{Camera, Settings};

/// A picture that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The camera that sees the scene.
    pub camera: Camera,
    /// Width and height in pixels.
    pub size: [u32; 2],
}

/// The way a pixel is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mode {
    /// The light through the pixel's centre, with textures bilinear at level 0: a picture of one sample differs from it by numeric error and
    /// by the filtering of textures alone.
    Point,
    /// The mean over the pixel's square, by so many samples: aliasing counts as error, too.
    Converged {
        /// Rays through each pixel.
        samples: u32,
    },
}

/// The masking and shadowing function of the specular lobe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Smith {
    /// The renderer's own (Heitz 2014).
    #[default]
    HeightCorrelated,
    /// The product of two, as other renderers have it: for comparisons with them.
    Separable,
}

/// Options for the evaluation of the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Options {
    /// The way a pixel is computed.
    pub mode: Mode,
    /// The masking and shadowing function.
    pub smith: Smith,
}

impl Truth {
    /// The same with its share of spread light, as the settings have it. The standard error, which spreading makes less, stays that of the light before.
    pub fn with_spread_light(mut self, settings: &Settings) -> Self {
        self.radiance = bloom::bloomed(&self.radiance, self.size, settings);
        self
    }
}

/// A finished truth, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Scene-linear RGB in nits, the background where nothing is seen.
    pub radiance: Vec<[f64; 3]>,
    /// Of the mean in each channel, where there are several samples a pixel.
    pub standard_error: Option<Vec<[f64; 3]>>,
    /// The nearest opaque triangle through each pixel's centre, in [`Mode::Point`].
    pub triangles: Option<Vec<Option<TriangleId>>>,
}
