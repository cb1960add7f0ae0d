//! Tests under the validation layers: of every kind of frame, of each dependency that is left out, and of the owners of Vulkan objects.

#[path = "../common/mod.rs"]
mod common;

mod combinations;
mod commands;
mod failures;
mod false_messages;
mod gpu;
mod necessity;
mod pipelines;
mod proof;
mod validation;
mod validation_modes;
