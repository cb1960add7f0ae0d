//! A frame as a drawing: passes and subpasses, their targets, and every dependency with its stages and accesses.
//!
//! It is made from the values that the render passes and barriers are made from ([`afterlight::frame::render_pass`] and
//! [`afterlight::frame::rows`]), so that it cannot differ from them.

mod hazards;
mod layout;
mod model;
mod svg;
#[cfg(test)]
mod tests;

pub use svg::escape;

use afterlight::frame::rows::{Row, Rows};
use afterlight::plan::FramePlan;

/// The frames of a plan as SVG. `title` names their scene.
pub fn draw(title: &str, plan: &FramePlan, rows: &Rows) -> String {
    let graph = model::Graph::of(plan, rows);
    layout::draw(title, plan, &graph)
}

/// A strip for each of some rows of a plan's table: the uses that the row orders, and the hazard between them without it.
pub fn draw_hazards(title: &str, plan: &FramePlan, table: &Rows, rows: &[&Row]) -> String {
    let strips: Vec<_> = rows.iter().map(|row| hazards::Strip::of(plan, table, row)).collect();
    hazards::draw(title, &strips)
}
