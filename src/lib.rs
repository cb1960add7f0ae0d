//! Afterlight: a deferred renderer on raw Vulkan. Geometry first, light after.
//!
//! The renderer turns a scene into a plan, the plan into frames, and frames into images: [`scene`] describes the content, [`plan::FramePlan`] decides
//! which work its frames need, and [`frame`] draws them. [ARCHITECTURE.md] is the map of the sources, and the book explains one frame from its
//! [introduction] on:
//!
//! | Chapter | Goes with |
//! |---|---|
//! | [The frame](https://docs.rs/crate/afterlight/latest/source/book/src/frame.md) | [`frame`] |
//! | [Synchronization](https://docs.rs/crate/afterlight/latest/source/book/src/synchronization.md) | [`frame::rows`], the crate `afterlight_proof` |
//! | [What is left out](https://docs.rs/crate/afterlight/latest/source/book/src/leaving-out.md) | [`plan`] |
//! | [Light](https://docs.rs/crate/afterlight/latest/source/book/src/light.md), [many lights](https://docs.rs/crate/afterlight/latest/source/book/src/many-lights.md), [shadows](https://docs.rs/crate/afterlight/latest/source/book/src/shadows.md) | [`scene`] |
//! | [Error](https://docs.rs/crate/afterlight/latest/source/book/src/error.md) | the crates `afterlight_truth` and `afterlight_lab` |
//! | [A workload for CI](https://docs.rs/crate/afterlight/latest/source/book/src/ci.md) | the program's `afterlight ci` |
//!
//! Features of this crate, of which the first two are on by default:
//!
//! - `readers`: scenes, models, skies and pictures are read from files, and built-in scenes are there. Tangents, the order of triangles and levels of
//!   detail are computed ([`scene`]).
//! - `caches`: pipelines and measured figures of devices are kept from run to run, and errors name the manifest of a driver that is not found ([`gpu`]).
//! - `present`: frames in a window of any library that gives raw window handles.
//! - `serde`: the types that settings and figures consist of are serialized. `caches` includes it.
//! - `hot-reload`: shaders are compiled while the program runs.
//!
//! Without any, a program that fills a [`scene::Scene`] itself renders into memory, and links 34 crates in place of 112.
//!
//! In the repository `scripts/book` builds the chapters into pages with their listings and pictures.
//!
//! [ARCHITECTURE.md]: https://docs.rs/crate/afterlight/latest/source/ARCHITECTURE.md
//! [introduction]: https://docs.rs/crate/afterlight/latest/source/book/src/introduction.md

#![deny(missing_docs)]
#![cfg_attr(
    not(feature = "present"),
    allow(dead_code, reason = "only frames of a window are resized, encoded, split and covered by panels")
)]

/// The vectors, matrices and rotations of scenes.
pub use glam;

pub use afterlight_gpu as gpu;
pub use afterlight_scene as scene;

pub mod frame;
pub mod plan;

// These record commands and name handles, and can be called wrongly. The window draws its panels with them, the laboratory compares them with the truth,
// and tests look inside: nothing there stays as it is.
#[doc(hidden)]
pub mod gpu_scene;
#[doc(hidden)]
pub mod passes;
#[doc(hidden)]
pub mod shaders;
mod targets;
#[doc(hidden)]
pub mod visible;
