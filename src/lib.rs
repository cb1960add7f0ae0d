//! Afterlight: a deferred renderer on raw Vulkan. Geometry first, light after.
//!
//! Scene in, plan, frame, image out: [`scene`] describes the scene, [`plan::FramePlan`] decides the parts that its frames need, and [`frame`] draws
//! them. In the repository the book explains one frame, beginning with `book/src/introduction.md`; its chapters `frame.md`, `light.md`, `error.md`
//! and `ci.md` go with [`frame`], [`scene`], [`reference`] and [`measure`], and the program. ARCHITECTURE.md has the map.

#![deny(missing_docs)]
#![cfg_attr(
    not(feature = "present"),
    allow(dead_code, reason = "only frames of a window are resized, encoded, split and covered by panels")
)]

/// The vectors, matrices and rotations of scenes.
pub use glam;

pub mod frame;
pub mod gpu;
pub mod measure;
// Tests of validation layers, for the program.
#[doc(hidden)]
pub mod mutants;
pub mod plan;
pub mod reference;
// Reads within a bound, for the program.
#[doc(hidden)]
pub mod regular_file;
pub mod report;
pub mod scene;
// The catalogue of extreme cases, for the program.
#[doc(hidden)]
pub mod stress;
mod user_cache;
mod visible;
// Whole files, for the program.
#[doc(hidden)]
pub mod whole_file;
#[cfg(feature = "window")]
pub mod window;

// Modules that record commands and name handles can be called wrongly: they are no part of the library's interface. Only the project's own tests
// and benchmarks look inside.
#[cfg(not(feature = "internals"))]
mod gpu_scene;
#[cfg(not(feature = "internals"))]
mod passes;
#[cfg(not(feature = "internals"))]
#[allow(dead_code, reason = "the build writes all that the shaders tell, and passes assert what they rely on")]
mod shaders;
#[cfg(not(feature = "internals"))]
mod targets;

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod gpu_scene;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod passes;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod shaders;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod targets;

/// The README's Rust, compiled and run by the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
