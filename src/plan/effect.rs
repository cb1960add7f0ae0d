//! The declaration of an effect, written once, in the effect's own file. [`super::effects`] lists them, and plan, refusals and reasons follow from that list.

use super::{Capabilities, Error, Refusal, Shading, Why, is_tiled, lacks_gbuffer};
use crate::scene::{LightPath, Scene, Settings, View};

/// Something that frames do beside lighting surfaces, where settings or the scene ask for it.
pub struct Effect {
    /// Its name in sentences.
    pub name: &'static str,
    /// Returns true if it would be drawn on every light path that allows it.
    pub is_asked_for: fn(&Scene, &Settings) -> bool,
    /// Leaves it out.
    pub off: Option<Off>,
    /// The view that shows it alone.
    pub view: Option<View>,
    /// Why no light path can draw it that writes the tone-mapped picture itself: `they cannot draw fog`.
    pub not_by_compute: Option<&'static str>,
    /// Why no light path without a G-buffer can draw it.
    pub reads_gbuffer: Option<&'static str>,
    /// Its shaders name so many buffers that a device with few may have to do without it.
    pub names_many_buffers: bool,
    /// Refuses the settings, light paths and devices that it does not go with.
    pub check: fn(&Request) -> Result<(), Error>,
}

/// An option that leaves an effect out, and the same as a change of settings.
pub type Off = (&'static str, fn(&mut Settings));

impl Effect {
    /// An effect of which its declaration says nothing else.
    pub const PLAIN: Self = Self {
        name: "",
        is_asked_for: |_, _| false,
        off: None,
        view: None,
        not_by_compute: None,
        reads_gbuffer: None,
        names_many_buffers: false,
        check: |_| Ok(()),
    };

    /// The error of settings that it does not go with.
    pub fn refuse<T>(&self, why: impl Into<String>) -> Result<T, Error> {
        Err(Refusal::of(self.name, why))
    }

    /// Refuses light paths that lack what it needs.
    pub fn check_path(&self, path: LightPath) -> Result<(), Error> {
        let why = match path {
            _ if self.not_by_compute.is_some() && is_tiled(path) => Why::WritesPicture(path),
            _ if self.reads_gbuffer.is_some() && lacks_gbuffer(path) => Why::NoGbuffer(path),
            _ => return Ok(()),
        };
        Err(Error::Refused(Refusal { what: self.name, why }))
    }
}

/// The facts by which effects are chosen and refused.
pub struct Request<'a> {
    pub scene: &'a Scene,
    /// The settings that are planned.
    pub settings: &'a Settings,
    /// The view that was asked for, in whose place another may be planned.
    pub view: View,
    pub shading: Shading,
    /// Never `Auto`.
    pub path: LightPath,
    pub device: &'a Capabilities,
}
