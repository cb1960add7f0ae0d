//! Light and shadow: every light path, every kind of shadow, and frames that are halted between two lights.

#[path = "../common/mod.rs"]
mod common;

mod forward;
mod light_paths;
mod shadow_rays;
mod shadows;
mod steps;
