//! The choices of fog.

use crate::ValueKind;
use crate::settings::choices::choice;

/// Froxels on each axis, and in all: 16 bytes of each, and of those of one slice more, fit into the 128 MiB that a storage buffer may have on every
/// device.
pub(super) const FROXELS: ValueKind = ValueKind::Grid([1024, 1024, 512], 7_400_000);

choice! {
    /// The air between the eye and the surfaces, which takes light away and scatters some of it to the eye.
    #[derive(Default)]
    pub enum Fog: "fog" {
        /// The air is clear.
        #[default]
        Off => "off",
        /// Fog that grows thinner with height, by formulas in closed form: lit by what comes from everywhere and by directional lights, without shadows.
        Height => "height",
        /// The same fog with all lights in it and their shadows, found in a grid of froxels.
        Froxels => "froxels",
    }
}
