//! One picture of several labelled ones.

use font8x8::UnicodeFonts;

/// A picture with its label.
#[derive(Debug)]
pub struct SheetTile {
    pub label: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// 8-bit sRGB and alpha, rows from the top; 4 bytes a pixel. Nothing for a tile that stays empty.
    pub rgba: Vec<u8>,
}

/// An 8-bit RGBA picture, rows from the top.
#[derive(Debug)]
pub struct Sheet {
    pub size: [u32; 2],
    pub rgba: Vec<u8>,
}

/// Columns of a sheet of views.
pub const COLUMNS: u32 = 4;
/// A glyph's edge in the font.
const GLYPH: u32 = 8;
const PAPER: [u8; 4] = [24, 24, 28, 255];
const INK: [u8; 4] = [235, 235, 235, 255];

/// Lays the tiles out in rows of `columns`, each tile under its label.
pub fn compose(tiles: &[SheetTile], columns: u32) -> Sheet {
    let widest = tiles.iter().map(|tile| tile.size[0]).max().unwrap_or(0);
    let highest = tiles.iter().map(|tile| tile.size[1]).max().unwrap_or(0);
    // About as many lines of text as fit 16 times into a tile stay legible at any size.
    let scale = (highest / 128).max(1);
    let label_width = tiles.iter().map(|tile| tile.label.chars().count() as u32).max().unwrap_or(0) * GLYPH * scale;
    let margin = GLYPH * scale / 2;
    let label_height = GLYPH * scale + 2 * margin;
    let cell = [widest.max(label_width) + margin, highest + label_height];
    let columns = columns.min(tiles.len() as u32).max(1);
    let rows = (tiles.len() as u32).div_ceil(columns);
    let size = [columns * cell[0] + margin, rows * cell[1] + margin];
    let mut sheet = Sheet { size, rgba: PAPER.repeat(size[0] as usize * size[1] as usize) };
    for (index, tile) in (0u32..).zip(tiles) {
        let corner = [margin + index % columns * cell[0], index / columns * cell[1]];
        sheet.write([corner[0], corner[1] + margin], scale, &tile.label);
        sheet.paste([corner[0], corner[1] + label_height], tile);
    }
    sheet
}

impl Sheet {
    /// Copies the tile's rows to where its upper left corner is to be; the sheet is large enough by construction.
    fn paste(&mut self, [left, top]: [u32; 2], tile: &SheetTile) {
        let row_bytes = tile.size[0] as usize * 4;
        if row_bytes == 0 {
            return;
        }
        for (y, row) in (top as usize..).zip(tile.rgba.chunks_exact(row_bytes).take(tile.size[1] as usize)) {
            let start = (y * self.size[0] as usize + left as usize) * 4;
            self.rgba[start..start + row_bytes].copy_from_slice(row);
        }
    }

    /// Draws one line of text, each of the font's pixels as a square of `scale`. Characters that the font lacks are blank.
    fn write(&mut self, [left, top]: [u32; 2], scale: u32, text: &str) {
        for (column, character) in (0u32..).zip(text.chars()) {
            let glyph = font8x8::BASIC_FONTS.get(character).unwrap_or_default();
            for (y, bits) in (0u32..).zip(glyph) {
                // The lowest bit is the leftmost pixel.
                for x in (0..GLYPH).filter(|x| bits >> x & 1 == 1) {
                    self.square([left + (column * GLYPH + x) * scale, top + y * scale], scale);
                }
            }
        }
    }

    fn square(&mut self, [left, top]: [u32; 2], edge: u32) {
        for y in top..top + edge {
            let start = (y as usize * self.size[0] as usize + left as usize) * 4;
            self.rgba[start..start + edge as usize * 4].as_chunks_mut::<4>().0.fill(INK);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(label: &str, size: [u32; 2], colour: [u8; 4]) -> SheetTile {
        SheetTile { label: label.into(), size, rgba: colour.repeat((size[0] * size[1]) as usize) }
    }

    fn count(sheet: &Sheet, colour: [u8; 4]) -> usize {
        sheet.rgba.as_chunks::<4>().0.iter().filter(|&&pixel| pixel == colour).count()
    }

    #[test]
    fn every_tile_is_there_whole_and_labelled() {
        let colours: Vec<[u8; 4]> = (0..6).map(|i| [200, i * 10, 0, 255]).collect();
        let tiles: Vec<SheetTile> = colours.iter().map(|&colour| tile("Ab", [40, 30], colour)).collect();
        let sheet = compose(&tiles, COLUMNS);
        assert_eq!(sheet.rgba.len(), (sheet.size[0] * sheet.size[1] * 4) as usize);
        for colour in colours {
            assert_eq!(count(&sheet, colour), 40 * 30);
        }
        let glyphs = ['A', 'b'].map(|c| font8x8::BASIC_FONTS.get(c).expect("a letter"));
        let pixels: u32 = glyphs.iter().flatten().map(|bits| bits.count_ones()).sum();
        assert_eq!(count(&sheet, INK), 6 * pixels as usize);
    }

    #[test]
    fn tiny_tiles_and_odd_labels_stay_inside() {
        let sheet = compose(&[tile("a label wider than its tile, ä→∞", [1, 1], [9, 9, 9, 255])], COLUMNS);
        assert_eq!(count(&sheet, [9, 9, 9, 255]), 1);
        assert!(sheet.size[0] > 200);
        assert_eq!(
            compose(&[], COLUMNS).rgba.len(),
            (compose(&[], COLUMNS).size[0] * compose(&[], COLUMNS).size[1] * 4) as usize
        );
    }

    #[test]
    fn labels_grow_with_the_tiles() {
        let label = |height| count(&compose(&[tile("x", [64, height], [9, 9, 9, 255])], COLUMNS), INK);
        assert_eq!(label(512), 16 * label(100));
    }
}
