//! The choices of fog.

use crate::ValueKind;
use crate::settings::choices::choice;

/// The most froxels on each axis, and in all. 16 bytes for each froxel, with one slice more, fit into the 128 MiB that every device allows for a
/// storage buffer.
pub(super) const FROXELS: ValueKind = ValueKind::Grid([1024, 1024, 512], 7_400_000);

choice! {
    /// The air between the eye and the surfaces, which takes light away and scatters some of it to the eye.
    #[derive(Default)]
    pub enum Fog: "fog" {
        /// The air is clear.
        #[default]
        Off => "off",
        /// Fog that thins out with height, by closed-form formulas: lit by ambient light, the sky and directional lights, without shadows.
        Height => "height",
        /// The fog of [`Fog::Height`], lit by all lights with their shadows, computed in a grid of froxels.
        Froxels => "froxels",
    }
}
