//! Tests of frames: pixels, golden images, edges, transparency, culling, frames in flight and the ways out of a renderer.

#[path = "../common/mod.rs"]
mod common;

mod aberration;
mod antialiasing;
mod ao;
mod bloom;
mod camera_paths;
mod capture;
mod carriers;
mod changes;
mod clips;
mod compressed;
mod culling;
#[cfg(feature = "window")]
mod encode;
mod fog;
mod frames;
mod froxels;
mod gbuffer;
#[cfg(feature = "report")]
mod golden;
mod hazards;
mod leaves;
mod lens;
#[cfg(feature = "report")]
mod levels;
mod looks;
mod multisampling;
mod nine_times;
mod orthographic;
mod outputs;
mod particles;
mod pixels;
mod reflections;
mod skin;
mod strokes;
mod taa;
mod tone;
mod transparency;
mod visibility;
