//! What people read: the drawing of a frame, made from the values that the frame itself is made from, and how far its pictures are from
//! the truth for what they cost.

pub mod graph;
#[cfg(feature = "report")]
pub mod page;
#[cfg(feature = "report")]
pub mod sweep;
#[cfg(feature = "report")]
pub mod tune;
