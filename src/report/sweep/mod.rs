//! Error against run time: families of settings, measured on the device at hand against the truth.

pub mod model;
