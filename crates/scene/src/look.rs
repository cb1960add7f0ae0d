//! Differences between objects of one mesh and material: the cell of an atlas, a tint, a highlight. One draw command still draws them all.

use glam::Vec3;

use super::{Material, Object, Scene};

/// The most rows, and the most columns, of an atlas.
pub const MAX_ATLAS_EDGE: u32 = 256;

/// The colour that a selected object's base colour is mixed with: linear RGB. An unlit surface emits the mix, in nits. A coat has no colour, so it
/// shows the highlight of the surface below it.
pub const HIGHLIGHT: Vec3 = Vec3::new(1.0, 0.4, 0.0);

/// The highlight's share of the mix. A half would make cyan grey, as orange is its complement.
pub const HIGHLIGHT_SHARE: f32 = 0.75;

/// The looks by which an object differs from others of its mesh and material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The cell of its material's atlas that it shows: row by row, 0 in the upper left.
    pub cell: u32,
    /// Linear RGB from 0 to 1, which multiplies the base colour.
    pub tint: Vec3,
    /// True if it is selected: three quarters of its base colour are [`HIGHLIGHT`], and a quarter is its own colour.
    pub selected: bool,
}

impl Look {
    /// The first cell, not tinted, not selected.
    pub const PLAIN: Self = Self { cell: 0, tint: Vec3::ONE, selected: false };

    /// Returns, in words, the part of the look that an object of this material cannot have.
    pub fn fault(&self, material: &Material) -> Option<String> {
        let (cells, [rows, columns]) = (material.cells(), material.atlas);
        if self.cell >= cells {
            let name = &material.name;
            return Some(format!(
                "its cell is {}, but the atlas of its material `{name}` is {rows}x{columns}: expected 0 to {}",
                self.cell,
                cells - 1
            ));
        }
        let is_share = self.tint.to_array().iter().all(|channel| (0.0..=1.0).contains(channel));
        (!is_share).then(|| "its tint is not from 0 to 1".into())
    }
}

impl Default for Look {
    fn default() -> Self {
        Self::PLAIN
    }
}

impl Object {
    /// The object's look; [`Look::PLAIN`] if it has none.
    pub fn shown_look(&self) -> Look {
        self.look.unwrap_or_default()
    }

    pub(super) fn look_fault(&self, scene: &Scene) -> Option<String> {
        self.shown_look().fault(scene.materials.get(self.material)?)
    }
}

impl Material {
    /// Returns true if its textures are grids of more than one cell.
    pub fn has_atlas(&self) -> bool {
        self.atlas != [1, 1]
    }

    /// The number of cells in the atlas; 1 without an atlas.
    pub fn cells(&self) -> u32 {
        self.atlas[0].max(1).saturating_mul(self.atlas[1].max(1))
    }

    /// A fault of its atlas: each texture is a whole number of texels a cell.
    pub(super) fn atlas_fault(&self, scene: &Scene) -> Option<String> {
        let [rows, columns] = self.atlas;
        if !self.atlas.iter().all(|edge| (1..=MAX_ATLAS_EDGE).contains(edge)) {
            return Some(format!("its atlas has {rows} rows and {columns} columns: expected 1 to {MAX_ATLAS_EDGE}"));
        }
        self.textures().find_map(|(slot, index)| {
            let texture = scene.textures.get(index)?;
            let [width, height] = texture.size;
            let divides = width.is_multiple_of(columns) && height.is_multiple_of(rows);
            (!divides).then(|| {
                let name = &texture.name;
                format!("its {slot:?} texture (`{name}`) is {width}x{height} texels, which are no {columns}x{rows} cells of whole texels")
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ColorSpace, Texture, builtin};

    /// The sentence about a scene whose first object and material are changed so.
    fn fault(change: impl FnOnce(&mut Scene)) -> Option<String> {
        let mut scene = builtin::open("builtin:quad").expect("built in");
        let own = scene.objects[0].material;
        scene.textures = vec![Texture {
            name: "sheet".into(),
            size: [6, 4],
            color_space: ColorSpace::Srgb,
            sampler: Default::default(),
            texels: vec![9; 96].into(),
        }];
        (scene.materials[own].base_color_texture, scene.materials[own].atlas) = (Some(0), [2, 3]);
        change(&mut scene);
        scene.check().err().map(|error| error.to_string())
    }

    #[test]
    fn a_cell_that_the_atlas_lacks_and_a_tint_beyond_white_are_named() {
        let wear = |look| move |scene: &mut Scene| scene.objects[0].look = Some(look);
        assert_eq!(fault(|_| {}), None);
        assert_eq!(fault(wear(Look { cell: 5, tint: Vec3::new(0.0, 0.5, 1.0), selected: true })), None);
        let error = fault(wear(Look { cell: 6, ..Look::PLAIN })).expect("a fault");
        assert!(error.contains("object 0 (") && error.contains("its cell is 6") && error.contains("0 to 5"), "{error}");
        for tint in [Vec3::new(0.0, 1.5, 0.0), Vec3::NAN, Vec3::splat(-0.1)] {
            let error = fault(wear(Look { tint, ..Look::PLAIN })).expect("a fault");
            assert!(error.ends_with("its tint is not from 0 to 1"), "{error}");
        }
    }

    #[test]
    fn an_atlas_has_cells_of_whole_texels() {
        for (atlas, expected) in [
            ([4, 6], None),
            ([1, 1], None),
            ([3, 3], Some("no 3x3 cells of whole texels")),
            ([2, 4], Some("no 4x2 cells of whole texels")),
            ([0, 3], Some("expected 1 to 256")),
            ([2, 257], Some("expected 1 to 256")),
        ] {
            let found = fault(|scene| {
                let own = scene.objects[0].material;
                scene.materials[own].atlas = atlas;
            });
            match expected {
                None => assert_eq!(found, None, "{atlas:?}"),
                Some(words) => {
                    assert!(found.as_ref().is_some_and(|found| found.contains(words)), "{atlas:?}: {found:?}")
                }
            }
        }
    }
}
