//! A frame as a drawing: passes and subpasses, what they draw into, and every dependency with its stages and accesses.
//!
//! It is made from the values that the render passes and barriers are made from ([`crate::frame::render_pass`] and
//! [`crate::frame::edges`]), so that it cannot say anything else than they do.

mod layout;
mod model;
mod svg;
#[cfg(test)]
mod tests;

pub use svg::escape;

use crate::frame::edges::Edges;
use crate::plan::FramePlan;

/// The frames of a plan as SVG. `title` says what they are of.
pub fn draw(title: &str, plan: &FramePlan, edges: &Edges) -> String {
    let graph = model::Graph::of(plan, edges);
    layout::draw(title, plan, &graph)
}
