//! Errors of planning.

use super::TooFew;
use crate::scene::{self, HdrFormat, LightPath};

/// A frame that cannot be planned. One line that names the setting and the limit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// `Scene::check` found a fault.
    #[error("{0}")]
    Scene(String),
    /// Width and height of the picture, and the device's limit.
    #[error("the size {0}x{1} is not possible on this device: each edge must be 1 to {2} pixels")]
    Size(u32, u32, u32),
    /// The edge of a shadow map, and the device's limit.
    #[error("a shadow map of {0} texels is not possible on this device: the limit is {1}")]
    ShadowSize(u32, u32),
    /// A G-buffer of more colour attachments than a subpass of the device can have.
    #[error("{} a G-buffer of {} colour attachments in one subpass, and the device has {}{}", .0.who, .0.needed, .0.most, .0.advice)]
    ColorAttachments(TooFew),
    /// A G-buffer of more input attachments than a subpass of the device can have.
    #[error("{} a G-buffer of {} input attachments in one subpass, and the device has {}{}", .0.who, .0.needed, .0.most, .0.advice)]
    InputAttachments(TooFew),
    #[error(
        "this device cannot blend into the HDR format {0}: choose `--hdr-format rgba16f`, into which every device can"
    )]
    /// A format that the device cannot blend into.
    HdrFormat(HdrFormat),
    /// A view of the G-buffer on a light path without one.
    #[error("the light path {0} has no G-buffer to show: leave --light-path out to see this view")]
    NoGbuffer(LightPath),
    /// A part of the frame that reads a G-buffer, on a light path without one.
    #[error("{0}: a G-buffer is needed, and the light path {1} has none: choose another, as loop")]
    NoGbufferFor(&'static str, LightPath),
    /// A light path that needs blending into 32-bit floats.
    #[error("the light path {0} adds lights by blending into 32-bit floats, which this device cannot: try clustered")]
    NoFloatBlending(LightPath),
    #[error("--light-path {0} cannot draw {1}: it writes the tone-mapped picture itself. Use --light-path clustered")]
    /// An effect on the finished picture, by its name, on a light path that ends with a compute pass.
    ComputeWithEffect(LightPath, &'static str),
    #[error("the light path {0} needs work groups of {1} invocations, and this device has at most {2}: try clustered")]
    /// Invocations of a work group, and the device's limit.
    WorkGroup(LightPath, u32, u32),
    #[error(
        "the light path {0} adds lights into 32-bit floats, so that the HDR format {1} does not apply: leave it out"
    )]
    /// An HDR format on a light path that has its own.
    BlendedFormat(LightPath, HdrFormat),
    /// A light cut-off for a linear picture.
    #[error("a light cut-off is certified against half a step of 8 bits, and a linear picture has none: leave it off")]
    CutoffWithoutSteps,
    /// The view of triangles on a device that does not number them.
    #[error("this device does not number triangles (it lacks geometryShader): the view triangle cannot be drawn")]
    NoTriangles,
    /// The view of shadow maps where there are none, and why.
    #[error("there is no shadow map to show: {0}")]
    NoShadowMap(String),
    /// Anti-aliasing that does not go with other settings.
    #[error("anti-aliasing: {0}")]
    AntiAliasing(String),
    /// The light path `visibility` where the device or the scene does not allow it.
    #[error("the light path visibility: {0}: choose another, as compute or clustered")]
    Visibility(String),
    /// A light path, the storage buffers and colour attachments that one of its fragment shaders names, and the device's limit of both together.
    #[error(
        "the light path {0} names {1} storage buffers and colour attachments in a fragment shader, and this device has room for {2}: choose loop"
    )]
    FragmentResources(LightPath, u32, u32),
    /// Bloom that does not go with other settings.
    #[error("bloom: {0}")]
    Bloom(String),
    /// Fog of which a number is out of range.
    #[error("fog: {0}")]
    Fog(String),
    /// Particles that do not go with other settings.
    #[error("particles: {0}")]
    Particles(String),
    /// Ambient occlusion that does not go with other settings, or of which a number is out of range.
    #[error("ambient occlusion: {0}")]
    AmbientOcclusion(String),
    /// A lens or a shutter that does not go with the camera or other settings.
    #[error("{0}")]
    Lens(String),
    /// Reflections that do not go with other settings, or of which a number is out of range.
    #[error("reflections: {0}")]
    Reflections(String),
    /// A change of a living scene that its plan does not allow.
    #[error("{0}")]
    Change(String),
    /// A depth pre-pass on the light path `forward-naive`.
    #[error("forward-naive has no depth pre-pass, which is what it is there to show: choose `--light-path forward`")]
    NaivePrepass,
    #[error(
        "--light-path {0} cannot draw transparent surfaces: it writes the tone-mapped picture itself. Use --light-path clustered"
    )]
    /// Transparent surfaces on a light path that ends with a compute pass.
    ComputeWithTransparency(LightPath),
    #[error("--light-path {0} cannot draw a sky: it writes the tone-mapped picture itself. Use --light-path clustered")]
    /// A sky on such a path.
    ComputeWithSky(LightPath),
    /// The edge of a face of the sky's cube, and the device's limit.
    #[error("a sky whose faces are {0} texels wide is not possible on this device: the limit is {1}")]
    Sky(u32, u32),
}

impl From<scene::Error> for Error {
    fn from(error: scene::Error) -> Self {
        Self::Scene(error.to_string())
    }
}
