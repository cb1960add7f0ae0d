//! Scenes: what files mean, which are refused, and what of a scene a frame leaves out without a change of the picture.

#[path = "../common/mod.rs"]
mod common;

// A journal is one of a report.
#[cfg(feature = "report")]
mod corpora;
mod export;
mod gltf;
mod harbour;
mod leave_out;
mod leave_out_assets;
mod obj;
mod odd_obj;
mod scene_files;
mod third_party;
