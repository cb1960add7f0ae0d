//! From WGSL to SPIR-V: the patch, layouts, constants of the host, errors with their place, and a whole shader.

mod common;
mod constants;
mod errors;
mod layouts;
mod patch;
mod whole;
mod workgroup;
