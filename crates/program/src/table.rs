//! Columns of text, and figures as people read them.

use std::fmt::Write as _;

use afterlight::gpu::vk;

/// Rows of cells, printed with aligned columns.
#[derive(Debug, Default)]
pub struct TextTable {
    rows: Vec<Vec<String>>,
    /// Columns from this one on are set flush right; they hold figures.
    figures_from: usize,
}

impl TextTable {
    /// A table whose columns are flush left.
    pub fn new() -> Self {
        Self { rows: Vec::new(), figures_from: usize::MAX }
    }

    /// A table whose columns from `column` on are flush right.
    pub fn with_figures_from(column: usize) -> Self {
        Self { rows: Vec::new(), figures_from: column }
    }

    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) -> &mut Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }

    /// Returns all rows in one line.
    pub fn line(&self) -> String {
        self.rows.iter().map(|row| row.join(" ")).collect::<Vec<_>>().join("; ")
    }

    /// The table's lines, each indented by two spaces and without trailing blanks.
    pub fn render(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| {
            // A row's last cell may be a sentence; only cells before another cell set the width.
            let cells = self.rows.iter().filter(|row| row.len() > column + 1 || column >= self.figures_from);
            cells.filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let mut text = String::new();
        for row in &self.rows {
            let mut line = String::new();
            for (column, (cell, width)) in row.iter().zip(&widths).enumerate() {
                let _ = match column >= self.figures_from {
                    true => write!(line, "  {cell:>width$}"),
                    false => write!(line, "  {cell:<width$}"),
                };
            }
            text.push_str(line.trim_end());
            text.push('\n');
        }
        text
    }
}

/// A duration in milliseconds, with three significant digits or so.
pub fn milliseconds(ms: f64) -> String {
    let decimals = match ms.abs() {
        ms if ms >= 100.0 => 0,
        ms if ms >= 10.0 => 1,
        ms if ms >= 1.0 => 2,
        _ => 3,
    };
    format!("{ms:.decimals$} ms")
}

/// A number of bytes in the binary unit that suits it.
pub fn bytes(bytes: u64) -> String {
    const UNITS: [&str; 4] = ["KiB", "MiB", "GiB", "TiB"];
    if bytes < 1024 {
        return format!("{bytes} B");
    }
    let mut value = bytes as f64 / 1024.0;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    format!("{value:.1} {}", UNITS[unit])
}

/// A difference of bytes, with its sign.
pub fn bytes_more(change: i64) -> String {
    let sign = if change < 0 { "-" } else { "+" };
    format!("{sign}{}", bytes(change.unsigned_abs()))
}

/// A packed Vulkan version as people write it.
pub fn version(packed: u32) -> String {
    let (major, minor) = (vk::api_version_major(packed), vk::api_version_minor(packed));
    format!("{major}.{minor}.{}", vk::api_version_patch(packed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_align_and_lines_have_no_trailing_blanks() {
        let mut table = TextTable::with_figures_from(1);
        table.row(["load", "1.5 ms"]).row(["first frame", "12 ms"]);
        assert_eq!(table.render(), "  load         1.5 ms\n  first frame   12 ms\n");
        let mut table = TextTable::new();
        table.row(["a", "a long sentence"]).row(["bcd", "x", "y"]);
        assert_eq!(table.render(), "  a    a long sentence\n  bcd  x  y\n");
    }

    #[test]
    fn figures_take_the_unit_that_suits_them() {
        assert_eq!(bytes(1023), "1023 B");
        assert_eq!(bytes(1536), "1.5 KiB");
        assert_eq!(bytes(3 << 30), "3.0 GiB");
        assert_eq!(bytes(u64::MAX), "16777216.0 TiB");
        assert_eq!(
            (bytes_more(2048), bytes_more(-3), bytes_more(0)),
            ("+2.0 KiB".into(), "-3 B".into(), "+0 B".into())
        );
        assert_eq!(milliseconds(0.123_45), "0.123 ms");
        assert_eq!(milliseconds(123.45), "123 ms");
    }
}
