//! What cannot be planned.

use crate::scene::{self, HdrFormat, LightPath};

/// A frame that cannot be planned. One line that names the setting and the limit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    #[error("{0}")]
    Scene(String),
    #[error("the size {0}x{1} is not possible on this device: each edge must be 1 to {2} pixels")]
    Size(u32, u32, u32),
    #[error("a shadow map of {0} texels is not possible on this device: the limit is {1}")]
    ShadowSize(u32, u32),
    #[error(
        "this G-buffer needs {0} colour attachments in one subpass and the device has {1}: choose fewer targets, as `--gbuffer lean`"
    )]
    ColorAttachments(u32, u32),
    #[error(
        "this G-buffer is read through {0} input attachments and the device has {1}: choose fewer targets, as `--gbuffer lean`"
    )]
    InputAttachments(u32, u32),
    #[error(
        "this device cannot blend into the HDR format {0}: choose `--hdr-format rgba16f`, into which every device can"
    )]
    HdrFormat(HdrFormat),
    #[error("the light path {0} has no G-buffer to show: leave --light-path out to see this view")]
    NoGbuffer(LightPath),
    #[error("the light path {0} adds lights by blending into 32-bit floats, which this device cannot: try clustered")]
    NoFloatBlending(LightPath),
    #[error(
        "compute writes the finished picture by itself, and {0} works on one that is drawn: choose another light path"
    )]
    ComputeWithEffect(&'static str),
    #[error(
        "the light path compute needs work groups of {0} invocations, and this device has at most {1}: try clustered"
    )]
    WorkGroup(u32, u32),
    #[error(
        "the light path {0} adds lights into 32-bit floats, so that the HDR format {1} does not apply: leave it out"
    )]
    BlendedFormat(LightPath, HdrFormat),
    #[error("a light cut-off is certified against half a step of 8 bits, and a linear picture has none: leave it off")]
    CutoffWithoutSteps,
    #[error("this device does not number triangles (it lacks geometryShader): the view triangle cannot be drawn")]
    NoTriangles,
    #[error("there is no shadow map to show: {0}")]
    NoShadowMap(String),
    #[error("anti-aliasing: {0}")]
    AntiAliasing(String),
    #[error("{0}")]
    Change(String),
    #[error("forward-naive has no depth pre-pass, which is what it is there to show: choose `--light-path forward`")]
    NaivePrepass,
    #[error(
        "the light path compute writes the finished picture, and transparent surfaces would have to come after it: choose `--light-path clustered`"
    )]
    ComputeWithTransparency,
}

impl From<scene::Error> for Error {
    fn from(error: scene::Error) -> Self {
        Self::Scene(error.to_string())
    }
}
