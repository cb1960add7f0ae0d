//! The 64-bit reference, and measurements against it: errors, reports, choices of settings, extreme cases.

#[path = "../common/mod.rs"]
mod common;

mod ao;
#[cfg(feature = "report")]
mod attribution;
mod catalogue;
mod compare;
mod cross_check;
mod formulas;
mod leaves;
mod lens;
mod looks;
mod materials;
mod particles;
mod reference;
mod reflections;
mod refraction;
#[cfg(feature = "report")]
mod report;
mod sky;
mod sky_shadows;
mod stress;
mod tints;
#[cfg(feature = "report")]
mod tune;
