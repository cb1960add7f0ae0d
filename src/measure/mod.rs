//! Numbers about pictures and runs: distributions of times, differences of images, memory of the process. No Vulkan.

mod difference;
mod process;
mod statistics;

pub use difference::{Difference, Mismatch, difference_linear, difference_srgb8};
pub use process::peak_memory_bytes;
pub use statistics::{Distribution, percentile};
