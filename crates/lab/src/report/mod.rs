//! Drawings and pages for people: the drawing of a frame, made from the values that the frame itself is made from, and the error of its pictures
//! against their cost.

// Items that only the program needs are hidden: they change with its pages and files.
#[cfg(feature = "report")]
#[doc(hidden)]
pub mod advice;
pub mod calibrate;
#[doc(hidden)]
pub mod commands;
#[doc(hidden)]
pub mod graph;
#[cfg(feature = "report")]
#[doc(hidden)]
pub mod page;
#[cfg(feature = "report")]
#[doc(hidden)]
pub mod sweep;
#[cfg(feature = "report")]
pub mod tune;
