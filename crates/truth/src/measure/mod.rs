//! Numbers about pictures and runs: distributions of times and how sure they are, differences of images, Pareto fronts, orders of
//! convergence, memory and CPU time of the process, the kind of the CPU. No Vulkan.

mod bootstrap;
mod cpu;
mod difference;
mod fit;
#[cfg(feature = "flip")]
mod flip;
mod front;
mod images;
mod process;
mod settle;
mod shard;
mod statistics;

pub use bootstrap::{GroupedMedian, LEAST_FOR_95, MedianInterval, median_interval};
pub use cpu::cpu_kind;
pub use difference::{Difference, RELATIVE_EPSILON, errors, shown_errors};
pub use fit::{PowerLaw, fit_power_law};
#[cfg(feature = "flip")]
pub use flip::{FlipMap, PIXELS_PER_DEGREE, flip};
pub use front::{front, front_probability};
pub use images::{LinearImage, Mismatch, Srgb8Image};
pub use process::{cpu_seconds, open_files, peak_memory_bytes, resident_memory_bytes, threads};
pub use settle::{WarmUp, settle, still_moving};
pub use shard::Shard;
pub use statistics::{Distribution, percentile};

/// Returns words for people about the motion in the timed frames.
pub fn what_moves(moving: bool) -> &'static str {
    match moving {
        true => "everything moves: shadow maps are drawn in each frame",
        false => "nothing moves: shadow maps are kept",
    }
}
