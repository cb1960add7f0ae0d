//! The view and the casters of each shadow map in a frame. A cascade's size depends on its part of the view and on the scene, not on the visible
//! objects, and it moves by whole texels: shadows do not swim, whether the camera walks or turns.

mod cache;
mod receivers;
#[cfg(test)]
mod tests;
mod views;

pub use cache::{MapDraw, ShadowCache};
pub use receivers::Receivers;
pub use views::{Caster, ShadowView};
pub(super) use views::{Changes, add_cascades, lamp_views, widened};
