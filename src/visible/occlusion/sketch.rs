//! A mesh rasterised into the cells around it: which cells it covers, and which its outline comes near.

use glam::DVec2;

use super::view::Cells;

/// The effect of one mesh on the cells around it.
pub(super) struct Sketch {
    at: Cells,
    slack: f64,
    pub(super) cells: Vec<Sketched>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Sketched {
    /// A triangle covers its middle.
    pub(super) is_covered: bool,
    /// An edge of the outline comes near it.
    pub(super) is_outline: bool,
    /// The least of all triangles that come near it.
    pub(super) nearness: f64,
}

impl Sketch {
    pub(super) fn new(at: Cells, slack: f64) -> Self {
        Self {
            at,
            slack,
            cells: vec![Sketched { is_covered: false, is_outline: false, nearness: f64::INFINITY }; at.count()],
        }
    }

    /// Calls `each` for the cells of a row from one place to another.
    fn fill(&mut self, row: usize, (low, high): (f64, f64), mut each: impl FnMut(usize, &mut Sketched)) {
        let (first, last) = self.at.columns;
        let (low, high) = (low.floor().max(first as f64), high.floor().min(last as f64));
        if low > high {
            return;
        }
        let start = (row - self.at.rows.0) * self.at.width();
        for column in low as usize..=high as usize {
            each(column, &mut self.cells[start + column - first]);
        }
    }

    /// Rows that a span of y comes near.
    fn rows(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        let (first, last) = self.at.rows;
        let row = |y: f64| y.clamp(first as f64, (last + 1) as f64) as usize;
        row((low - self.slack).floor())..row((high + self.slack).floor() + 1.0)
    }

    /// Rasterises a triangle with these corners, in cells, and their [`OcclusionView::nearness`].
    pub(super) fn triangle(&mut self, points: [DVec2; 3], nearness: [f64; 3]) {
        let [a, b, c] = points;
        let slack = self.slack;
        let area = (b - a).perp_dot(c - a);
        let (db, dc) = (nearness[1] - nearness[0], nearness[2] - nearness[0]);
        let slope = DVec2::new(db * (c - a).y - dc * (b - a).y, dc * (b - a).x - db * (c - a).x) / area;
        let least = nearness.into_iter().fold(f64::INFINITY, f64::min);
        // The change of nearness towards a cell's farthest corner, with the slack.
        let reach = (slope.x.abs() + slope.y.abs()) * (0.5 + slack);
        let edges = [(a, b), (b, c), (c, a)];
        let (low, high) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
        for row in self.rows(low, high) {
            let top = row as f64;
            let Some(near) = span(&edges, top - slack, top + 1.0 + slack) else { continue };
            self.fill(row, (near.0 - slack, near.1 + slack), |column, cell| {
                let middle = DVec2::new(column as f64 + 0.5, top + 0.5);
                let here = nearness[0] + slope.dot(middle - a) - reach;
                // The slope of a triangle seen edge-on is meaningless.
                let here = if area.abs() > 1e-6 { here.max(least) } else { least };
                cell.nearness = cell.nearness.min(here);
            });
            if let Some((left, right)) = span(&edges, top + 0.5, top + 0.5) {
                // Only cells whose middles are between both ends.
                self.fill(row, ((left - 0.5).ceil(), right - 0.5), |_, cell| cell.is_covered = true);
            }
        }
    }

    pub(super) fn outline(&mut self, from: DVec2, to: DVec2) {
        let slack = self.slack;
        for row in self.rows(from.y.min(to.y), from.y.max(to.y)) {
            let top = row as f64;
            if let Some((left, right)) = span(&[(from, to)], top - slack, top + 1.0 + slack) {
                self.fill(row, (left - slack, right + slack), |_, cell| cell.is_outline = true);
            }
        }
    }
}

/// Returns the range in x of the parts of lines between two y.
fn span(lines: &[(DVec2, DVec2)], low: f64, high: f64) -> Option<(f64, f64)> {
    let mut found: Option<(f64, f64)> = None;
    for &(a, b) in lines {
        // Always in the same direction, so that two triangles find the same place on the edge that they share.
        let (a, b) = if (a.y, a.x) <= (b.y, b.x) { (a, b) } else { (b, a) };
        if b.y < low || a.y > high {
            continue;
        }
        let at = |y: f64| if a.y == b.y { a.x } else { a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0) };
        let ends = if a.y == b.y { (a.x, b.x) } else { (at(low), at(high)) };
        let (left, right) = (ends.0.min(ends.1), ends.0.max(ends.1));
        found = Some(found.map_or((left, right), |(l, r)| (l.min(left), r.max(right))));
    }
    found
}
