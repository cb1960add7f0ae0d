//! Marks that points are drawn with: a colour and a shape each, so that families can be told apart without colours.

use std::fmt::Write as _;

use maud::{Markup, html};

/// Colours of the style sheet, classes `c0` and so on; after Okabe and Ito (2008), darker on light pages.
pub const COLORS: usize = 8;

/// Half of a mark's extent in pixels.
pub const RADIUS: f64 = 4.6;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    Inverted,
    Pentagon,
    Star,
    Hexagon,
    Cross,
}

const SHAPES: [Shape; 8] = [
    Shape::Square,
    Shape::Triangle,
    Shape::Diamond,
    Shape::Inverted,
    Shape::Star,
    Shape::Pentagon,
    Shape::Cross,
    Shape::Hexagon,
];

/// The look of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Glyph {
    pub shape: Shape,
    /// `None`: as text; [`COLORS`]: grey.
    pub color: Option<usize>,
}

impl Glyph {
    /// The glyph of the default settings.
    pub const DEFAULT: Self = Self { shape: Shape::Circle, color: None };
    /// The glyph of points that belong to no family of a single setting.
    pub const JOINT: Self = Self { shape: Shape::Circle, color: Some(COLORS) };

    /// The glyph of the family with this index. Beyond eight, the colours come again with other shapes.
    pub const fn family(index: usize) -> Self {
        let round = index / COLORS;
        Self { shape: SHAPES[(index + round * 3) % SHAPES.len()], color: Some(index % COLORS) }
    }

    /// The classes that the style sheet colours it by.
    pub fn class(self, is_hollow: bool) -> String {
        let hollow = if is_hollow { " hollow" } else { "" };
        match self.color {
            None => format!("mark ink{hollow}"),
            Some(COLORS) => format!("mark grey{hollow}"),
            Some(color) => format!("mark c{color}{hollow}"),
        }
    }

    /// The outline around this point, as the data of an SVG path.
    pub fn path(self, x: f64, y: f64) -> String {
        let corners = |count: usize, turn: f64, radius: &dyn Fn(usize) -> f64| {
            let mut path = String::new();
            for index in 0..count {
                let angle = (turn + index as f64 / count as f64) * std::f64::consts::TAU;
                let (x, y) = (x + radius(index) * angle.sin(), y - radius(index) * angle.cos());
                let _ = write!(path, "{}{x:.2} {y:.2}", if index == 0 { 'M' } else { 'L' });
            }
            path + "Z"
        };
        let r = RADIUS;
        match self.shape {
            Shape::Circle => {
                format!("M{:.2} {y:.2}a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0Z", x - r, d = 2.0 * r)
            }
            Shape::Square => corners(4, 0.125, &|_| r * 1.25),
            Shape::Triangle => corners(3, 0.0, &|_| r * 1.3),
            Shape::Inverted => corners(3, 0.5, &|_| r * 1.3),
            Shape::Diamond => corners(4, 0.0, &|_| r * 1.3),
            Shape::Pentagon => corners(5, 0.0, &|_| r * 1.15),
            Shape::Hexagon => corners(6, 1.0 / 12.0, &|_| r * 1.1),
            Shape::Star => corners(10, 0.0, &|index| if index % 2 == 0 { r * 1.5 } else { r * 0.68 }),
            Shape::Cross => cross(x, y),
        }
    }
}

/// A mark in a legend.
pub fn sample(glyph: Glyph, is_hollow: bool) -> Markup {
    html! {
        svg viewBox="-9 -9 18 18" aria-hidden="true" { g class=(glyph.class(is_hollow)) { path d=(glyph.path(0.0, 0.0)) {} } }
    }
}

/// An upright cross with arms as wide as a third of it.
fn cross(x: f64, y: f64) -> String {
    let (a, b) = (RADIUS * 0.4, RADIUS * 1.15);
    let corners =
        [(-a, -b), (a, -b), (a, -a), (b, -a), (b, a), (a, a), (a, b), (-a, b), (-a, a), (-b, a), (-b, -a), (-a, -a)];
    let mut path = String::new();
    for (index, (dx, dy)) in corners.into_iter().enumerate() {
        let _ = write!(path, "{}{:.2} {:.2}", if index == 0 { 'M' } else { 'L' }, x + dx, y + dy);
    }
    path + "Z"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn families_differ_by_shape_or_colour_and_neighbours_by_both() {
        let glyphs: Vec<Glyph> = (0..24).map(Glyph::family).collect();
        for (index, glyph) in glyphs.iter().enumerate() {
            assert!(!glyphs[..index].contains(glyph), "family {index} looks like an earlier one");
        }
        for (index, glyph) in glyphs[..8].iter().enumerate() {
            let earlier = &glyphs[..index];
            assert!(earlier.iter().all(|other| other.shape != glyph.shape && other.color != glyph.color));
        }
    }
}
