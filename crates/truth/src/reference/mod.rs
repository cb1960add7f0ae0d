//! The truth: the same scene, evaluated in 64 bits on the CPU by rays. Exact visibility, exact shadows, no G-buffer, no maps.
//!
//! It shares no shading code with the shaders and is written from the formulas, for reading. Where a picture of the renderer differs
//! from the truth, the difference is the renderer's error. No Vulkan.
//!
//! Nothing that a ray does goes through `map` of an array: compiled in several units that is not inlined, and all of this took twice as long.

pub mod aberration;
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
pub mod refraction;
mod render;
mod sampling;
pub mod screen_march;
mod shadow;
pub mod shown;
pub mod shutter;
mod sky;
mod strokes;
mod surface;
mod texture;
mod tints;
pub mod tonemap;

pub use bloom::spreading;
pub use cache::{Cache, Cached, TruthOrigin};
pub use render::{Accumulation, ProgressCallback, Reference};
pub use sky::{SkySampler, share_of};
pub use surface::{ShadingPoint, SurfaceLobes};

pub use afterlight_scene::TriangleId;

use fingerprint::Fingerprint;
use particles::{Billboards, Lit};

use afterlight_scene::{Camera, Scene, Settings};

/// A picture that is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraView {
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
    /// The mean of `samples` samples over the pixel's square: aliasing counts as error, too.
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
pub struct TruthOptions {
    /// The way a pixel is computed.
    pub mode: Mode,
    /// The masking and shadowing function.
    pub smith: Smith,
}

impl TruthOptions {
    /// Options with the renderer's own masking and shadowing.
    pub fn of(mode: Mode) -> Self {
        Self { mode, smith: Smith::default() }
    }
}

/// A finished truth, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Scene-linear RGB in nits, the background where nothing is seen.
    pub radiance: Vec<[f64; 3]>,
    /// Standard error of the mean in each channel, if there are several samples a pixel.
    pub standard_error: Option<Vec<[f64; 3]>>,
    /// The nearest opaque triangle through each pixel's centre, in [`Mode::Point`].
    pub triangles: Option<Vec<Option<TriangleId>>>,
}

/// The effects that rays know. Bloom is none of them: it spreads the light of a finished truth ([`Truth::with_spread_light`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effects {
    /// Metres within which surfaces hide light from everywhere from each other, as [`Settings::occlusion_radius`] has it.
    pub occlusion: Option<f64>,
    /// The fog; none for clear air.
    pub fog: Option<fog::Medium>,
    /// The scene's particles are seen.
    pub particles: bool,
    /// The greatest roughness of surfaces that mirror others, as [`Settings::mirrored_roughness`] has it.
    pub reflections: Option<f64>,
    /// Transparent surfaces cast shadows.
    pub tints: bool,
}

impl Effects {
    /// As settings have them.
    pub fn of(settings: &Settings) -> Self {
        Self {
            occlusion: settings.occlusion_radius(),
            fog: fog::Medium::of(settings),
            particles: settings.particles,
            reflections: settings.mirrored_roughness(),
            tints: settings.shadows.tinted,
        }
    }

    /// Adds all that a truth depends on. Truths without an effect keep the hashes that they had before there was one.
    fn hash(&self, scene: &Scene, fingerprint: &mut Fingerprint) {
        if let Some(radius) = self.occlusion {
            occlusion::hash(radius, fingerprint);
        }
        if let Some(fog) = &self.fog {
            fog.hash(fingerprint);
        }
        if self.particles && !scene.emitters.is_empty() {
            particles::hash(scene, fingerprint);
        }
        if let Some(roughest) = self.reflections {
            reflections::hash(roughest, fingerprint);
        }
        if self.tints {
            fingerprint.bytes(b"tinted shadows");
        }
    }
}

/// The effects of default settings.
impl Default for Effects {
    fn default() -> Self {
        Self::of(&Settings::default())
    }
}
