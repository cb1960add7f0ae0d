//! Scenes: the meaning of files, refused files, and parts of a scene that a frame leaves out without a change of the picture.

#[path = "../common/mod.rs"]
mod common;

// One of the readers reads journals, which only reports have.
#[cfg(feature = "report")]
mod corpora;
mod export;
mod gltf;
mod harbour;
mod leave_out;
mod leave_out_assets;
mod leave_out_random;
mod obj;
mod obj_left_out;
mod obj_sheets;
mod odd_obj;
mod scene_files;
mod third_party;
