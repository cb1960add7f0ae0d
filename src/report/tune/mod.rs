//! The choice: settings from a measured front that keep a bound, verified from cameras that the front was not made with.
//!
//! [`choice`] decides, [`cameras`] says where else to look from, [`verify`] measures there, and [`evidence`] writes down what was chosen and
//! by what. The front itself comes from [`crate::report::sweep`].

pub mod cameras;
pub mod choice;
pub mod evidence;
pub mod verify;
