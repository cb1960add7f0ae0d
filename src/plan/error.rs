//! Errors of planning.

use std::fmt;

use super::TooFew;
use crate::scene::{self, BlockFormat, HdrFormat, LightPath};

/// A frame that cannot be planned. One line that names the setting and the limit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
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
    /// A part of the frame that does not go with other settings, with the scene or with the device.
    #[error("{0}")]
    Refused(Refusal),
    /// A light path that needs blending into 32-bit floats.
    #[error("the light path {0} adds lights by blending into 32-bit floats, which this device cannot: try clustered")]
    NoFloatBlending(LightPath),
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
    /// The view of shadow maps without any map, and the reason for their absence.
    #[error("there is no shadow map to show: {0}")]
    NoShadowMap(String),
    /// The light path `visibility` where the device or the scene does not allow it.
    #[error("the light path visibility: {0}: choose another, as compute or clustered")]
    Visibility(String),
    /// A light path, the storage buffers and colour attachments that one of its fragment shaders names, and the device's limit of both together.
    #[error(
        "the light path {0} names {1} storage buffers and colour attachments in a fragment shader, and this device has room for {2}: choose loop"
    )]
    FragmentResources(LightPath, u32, u32),
    /// A lens or a shutter that does not go with the camera or other settings.
    #[error("{0}")]
    Lens(String),
    /// A change of a living scene that its plan does not allow.
    #[error("{0}")]
    Change(String),
    /// A depth pre-pass on the light path `forward-naive`.
    #[error("forward-naive has no depth pre-pass, which is what it is there to show: choose `--light-path forward`")]
    NaivePrepass,
    /// The name of a texture in blocks, and their format, where the library cannot decode them and the device cannot sample the texture as it is.
    #[error(
        "the texture {0} is compressed as {1}, which the library decodes with its feature `readers` alone; without, the device must sample {1}, and the texture must have all its levels and be no atlas"
    )]
    Blocks(String, BlockFormat),
    /// The edge of a face of the sky's cube, and the device's limit.
    #[error("a sky whose faces are {0} texels wide is not possible on this device: the limit is {1}")]
    Sky(u32, u32),
}

/// A part of the frame that is refused, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The part, as sentences name it.
    pub what: &'static str,
    /// The reason.
    pub why: RefusalReason,
}

/// Why a part of the frame is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RefusalReason {
    /// It reads a G-buffer, and the light path has none.
    NoGbuffer(LightPath),
    /// It comes after lighting, and the light path ends with a compute pass that writes the tone-mapped picture.
    WritesPicture(LightPath),
    /// A view shows it alone, and the scene has none.
    NothingToShow(String),
    /// Another reason, in a sentence that follows a colon.
    Other(String),
}

impl Refusal {
    pub(crate) fn of(what: &'static str, why: impl Into<String>) -> PlanError {
        PlanError::Refused(Self { what, why: RefusalReason::Other(why.into()) })
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = self.what;
        match &self.why {
            RefusalReason::NoGbuffer(path) => {
                write!(f, "{what}: a G-buffer is needed, and the light path {path} has none: choose another, as loop")
            }
            RefusalReason::WritesPicture(path) => write!(
                f,
                "--light-path {path} cannot draw {what}: it writes the tone-mapped picture itself. Use --light-path clustered"
            ),
            RefusalReason::NothingToShow(why) | RefusalReason::Other(why) => write!(f, "{what}: {why}"),
        }
    }
}

impl PlanError {
    /// Returns true if only the view is refused, because the scene or the device has nothing that it could show.
    pub fn shows_nothing(&self) -> bool {
        let nothing = |own: &Refusal| matches!(own.why, RefusalReason::NothingToShow(_));
        matches!(self, Self::NoShadowMap(_) | Self::NoTriangles) || matches!(self, Self::Refused(own) if nothing(own))
    }

    /// Returns true if the light path lacks the G-buffer that a view or an effect reads.
    pub(super) fn lacks_gbuffer(&self) -> bool {
        matches!(self, Self::NoGbuffer(_) | Self::Refused(Refusal { why: RefusalReason::NoGbuffer(_), .. }))
    }
}

impl From<scene::Error> for PlanError {
    fn from(error: scene::Error) -> Self {
        Self::Scene(error.to_string())
    }
}
