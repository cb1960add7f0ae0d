//! From WGSL to SPIR-V: the patch, layouts, errors with their place, and a whole shader.

mod common;
mod errors;
mod layouts;
mod patch;
mod whole;
mod workgroup;
