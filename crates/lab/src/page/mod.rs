//! The look of every page: one style, and one kind of plot.

pub mod marks;
pub mod pictures;
pub mod plot;
pub mod scales;

/// As one line in the page's head.
pub const STYLE: &str = include_str!("style.css");
