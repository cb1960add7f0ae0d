//! Afterlight: a deferred renderer on raw Vulkan. Geometry first, light after.
//!
//! Scene in, plan, frame, image out: [`scene`] says what is drawn, `plan::FramePlan` what of it a frame needs, and
//! `frame` draws it. ARCHITECTURE.md has the map.

pub mod gpu;
pub mod measure;
pub mod scene;
