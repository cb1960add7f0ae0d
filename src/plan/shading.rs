//! The work of the subpass after GEOMETRY: light, or a value to show.

use super::{Capabilities, PlanError, effects};
use crate::scene::View;

/// The work of the subpass after GEOMETRY.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shading {
    /// Lights every pixel.
    Light {
        /// True if surfaces are lit with an albedo of 1.
        light_only: bool,
    },
    /// Shows a G-buffer value.
    ShowGbuffer(View),
    /// Shows as a heat map how many fragments were shaded for each pixel.
    ShowOverdraw,
    /// Shows the nearest opaque triangle, each in a different colour.
    ShowTriangle,
    /// Shows the maps of the shadow atlas; nothing else is drawn.
    ShowShadowMap,
}

impl Shading {
    pub(super) fn of(view: View, device: &Capabilities) -> Result<Self, PlanError> {
        Ok(match view {
            View::Lighting => Self::Light { light_only: true },
            lit if effects::is_lit(lit) => Self::Light { light_only: false },
            View::Overdraw => Self::ShowOverdraw,
            View::Triangle if !device.primitive_index => return Err(PlanError::NoTriangles),
            View::Triangle => Self::ShowTriangle,
            View::ShadowMap => Self::ShowShadowMap,
            other => Self::ShowGbuffer(other),
        })
    }

    pub(crate) fn is_lit(self) -> bool {
        matches!(self, Self::Light { .. })
    }

    /// Returns true if a G-buffer is read, unless surfaces are lit as they are drawn.
    pub(crate) fn reads_gbuffer(self) -> bool {
        matches!(self, Self::Light { .. } | Self::ShowGbuffer(_))
    }

    /// Returns true if GEOMETRY uses only the positions of surfaces.
    pub fn only_covers(self) -> bool {
        matches!(self, Self::ShowOverdraw | Self::ShowTriangle)
    }
}
