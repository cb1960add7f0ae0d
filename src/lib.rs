//! Afterlight: a deferred renderer on raw Vulkan. Geometry first, light after.
//!
//! Scene in, plan, frame, image out: [`scene`] says what is drawn, [`plan::FramePlan`] what of it all frames need,
//! [`visible`] what one camera sees, and [`frame`] draws it. ARCHITECTURE.md has the map.

pub mod frame;
pub mod gpu;
pub mod gpu_scene;
pub mod measure;
pub mod passes;
pub mod plan;
pub mod reference;
pub mod report;
pub mod scene;
pub mod shaders;
pub mod stress;
pub mod targets;
pub mod visible;
#[cfg(feature = "window")]
pub mod window;

/// The README's Rust, compiled and run by the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
