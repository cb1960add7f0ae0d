//! The textures on the device, and the textures that each material's pipelines sample.

use std::collections::{BTreeMap, BTreeSet};

use ash::vk;
use glam::{DVec3, DVec4, Vec4};

use super::{GeometryKey, SurfaceRules, TextureMask};
use crate::plan::Capabilities;
use crate::scene::{
    BlockFormat, ColorSpace, OptionalPart, Sampler, Scene, Texels, Texture, TextureSlot, UvMap, Wrap, level_size,
    most_levels,
};

/// The origin of a texture's texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TextureSource {
    /// Index into the scene's textures.
    Scene(usize),
    /// One texel that changes no factor, for a slot that is kept without need.
    White,
    /// One texel that changes no normal.
    Flat,
    /// One texel that turns no direction of an anisotropy.
    Along,
}

impl TextureSource {
    /// The only texel of a neutral one.
    pub fn texel(self) -> Option<[u8; 4]> {
        match self {
            Self::Scene(_) => None,
            Self::White => Some([255; 4]),
            Self::Flat => Some([128, 128, 255, 255]),
            Self::Along => Some([255, 128, 255, 255]),
        }
    }

    fn neutral(slot: TextureSlot) -> Self {
        match slot {
            TextureSlot::Normal => Self::Flat,
            TextureSlot::Anisotropy => Self::Along,
            _ => Self::White,
        }
    }
}

/// A texture on the device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlannedTexture {
    /// A texture of the scene, or a neutral texel.
    pub source: TextureSource,
    /// Width and height in texels.
    pub size: [u32; 2],
    /// The colour space. Neutral white is linear: codes of 255 are exactly 1 without a curve.
    pub color_space: ColorSpace,
    /// The sampler. Neutral textures have the same value with any sampler.
    pub sampler: Sampler,
    /// The number of cells of an atlas: each cell is a layer of an array image of this size. A filter never leaves a layer, and each level of a layer
    /// is made from that layer alone, so cells cannot bleed into each other with any level, filter or anisotropy. Side by side in one image they
    /// would: the smallest levels have less than a texel a cell.
    pub cells: Option<u32>,
    /// The number of mip levels: the file's, or down to one texel; 1 if only the largest is sampled.
    pub levels: u32,
    /// True if blits make all levels but the first, in 8-bit RGBA. Vulkan's table of required formats makes these formats blittable with linear
    /// filtering on every device.
    pub makes_levels: bool,
    /// The format of the file's blocks if they stay compressed on the device; `None` for 8-bit RGBA.
    pub blocks: Option<BlockFormat>,
    /// The format of the file's blocks.
    pub compressed: Option<BlockFormat>,
}

/// The format of a texture's image.
pub fn texture_format(blocks: Option<BlockFormat>, color_space: ColorSpace) -> vk::Format {
    let [srgb, linear] = match blocks {
        None => [vk::Format::R8G8B8A8_SRGB, vk::Format::R8G8B8A8_UNORM],
        Some(BlockFormat::Bc7) => [vk::Format::BC7_SRGB_BLOCK, vk::Format::BC7_UNORM_BLOCK],
        Some(BlockFormat::Etc2Rgb8) => [vk::Format::ETC2_R8G8B8_SRGB_BLOCK, vk::Format::ETC2_R8G8B8_UNORM_BLOCK],
        Some(BlockFormat::Etc2Rgb8A1) => [vk::Format::ETC2_R8G8B8A1_SRGB_BLOCK, vk::Format::ETC2_R8G8B8A1_UNORM_BLOCK],
        Some(BlockFormat::Etc2Rgba8) => [vk::Format::ETC2_R8G8B8A8_SRGB_BLOCK, vk::Format::ETC2_R8G8B8A8_UNORM_BLOCK],
    };
    if color_space == ColorSpace::Srgb { srgb } else { linear }
}

impl PlannedTexture {
    /// Plans a texture of a material with an atlas of these rows and columns. Block-compressed textures stay compressed if `samples` accepts their
    /// format, unless the texture is an atlas or its sampler uses levels that the file lacks: blocks cannot be blitted, and a file's levels may mix
    /// cells.
    fn of(scene: &Scene, (source, atlas): Atlas, samples: impl Fn(BlockFormat) -> bool) -> Self {
        let [rows, columns] = atlas;
        let texture = match source {
            TextureSource::Scene(index) => scene.textures.get(index),
            TextureSource::White | TextureSource::Flat | TextureSource::Along => None,
        };
        let ([width, height], color_space, sampler) = texture
            .map_or(([columns, rows], ColorSpace::Linear, Sampler::DEFAULT), |own| {
                (own.size, own.color_space, own.sampler)
            });
        let size = [width / columns, height / rows];
        // Neutral textures need one layer only: all cells are equal, and layer indices are clamped to the last one (Vulkan, "Image Operations").
        let count = if texture.is_some() { rows * columns } else { 1 };
        let cells = (atlas != [1, 1]).then_some(count);
        let wanted = sampler.levels.map_or(1, |_| most_levels(size));
        let given = texture.map_or(1, Texture::own_levels);
        let compressed = match texture.map(|own| &own.texels) {
            Some(Texels::Blocks { format, .. }) => Some(*format),
            _ => None,
        };
        let given = if cells.is_some() { 1 } else { given };
        let makes_levels = wanted > 1 && given == 1;
        let levels = if makes_levels { wanted } else { wanted.min(given) };
        let blocks = compressed.filter(|&format| !makes_levels && cells.is_none() && samples(format));
        Self { source, size, color_space, sampler, cells, levels, makes_levels, blocks, compressed }
    }

    /// Plans a sheet of pictures, whose cells become the layers of an array.
    pub(in crate::plan) fn of_sheet(
        scene: &Scene,
        (index, [columns, rows]): (usize, [u32; 2]),
        device: &Capabilities,
    ) -> Self {
        let own = Self::of(scene, (TextureSource::Scene(index), [rows, columns]), |format| device.samples(format));
        Self { cells: Some(rows * columns), ..own }
    }

    /// The number of array images that its cells need, with at most `most` layers each.
    pub fn sheets(&self, most: u32) -> u32 {
        self.cells.map_or(1, |cells| cells.div_ceil(most.max(1)))
    }

    /// The format of its image.
    pub fn format(&self) -> vk::Format {
        texture_format(self.blocks, self.color_space)
    }

    /// Bytes of all levels and cells without padding.
    pub fn bytes(&self) -> u64 {
        self.bytes_in(self.blocks)
    }

    /// Returns the bytes that its blocks save over texels.
    pub(in crate::plan) fn saved_bytes(&self) -> u64 {
        self.bytes_in(None) - self.bytes()
    }

    /// Bytes of all levels and cells if stored in this format.
    fn bytes_in(&self, blocks: Option<BlockFormat>) -> u64 {
        let level_bytes = |size: [u32; 2]| match blocks {
            Some(format) => format.level_bytes(size),
            None => size.map(u64::from).iter().product::<u64>() * 4,
        };
        let of_cell: u64 = (0..self.levels).map(|level| level_bytes(level_size(self.size, level))).sum();
        u64::from(self.cells.unwrap_or(1)) * of_cell
    }
}

/// A texture, with the rows and columns of the atlas that a material samples it as.
type Atlas = (TextureSource, [u32; 2]);

/// The number of layers that 15 bits can index (`src/visible/looks.rs`).
const MOST_LAYERS: u32 = 1 << 15;

/// The samplers of the textures of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetSamplers {
    /// One sampler for all textures.
    One(Sampler),
    /// A separate sampler for each texture.
    Each,
}

/// The textures of a plan. Indices are into [`TexturePlan::images`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct TexturePlan {
    /// The textures in the order of the scene; neutral ones last.
    pub images: Vec<PlannedTexture>,
    /// The images that each material's pipelines sample, by material. The pipelines bind exactly these.
    pub sets: BTreeMap<usize, BTreeMap<TextureSlot, usize>>,
    /// By material, the base colour that cuts holes into its shadow, or tints it.
    pub holes: BTreeMap<usize, usize>,
    /// Materials with UV maps in the frame's buffer, in the order of their records there.
    pub mapped: Vec<usize>,
    /// Rows of a record: one for each slot that the plan's shaders know.
    pub mapped_slots: usize,
    /// The most cells of one array. A larger atlas is split into several arrays, the sheets, and each sheet's instances need a separate draw. 0 in a
    /// plan without textures.
    pub sheet: u32,
}

impl TexturePlan {
    /// Returns the textures that the pipelines of these rules sample.
    pub(in crate::plan) fn of(scene: &Scene, rules: &SurfaceRules, device: &Capabilities) -> Self {
        let samples = |format| device.samples(format) && !rules.keep.has(OptionalPart::DecodedTextures);
        let mut sets: BTreeMap<usize, BTreeMap<TextureSlot, Atlas>> = BTreeMap::new();
        let mut holes: BTreeMap<usize, Atlas> = BTreeMap::new();
        let mut mapped = BTreeSet::new();
        let mut any_lobes = false;
        for object in rules.drawn(scene) {
            let material = rules.material(object);
            if rules.has_geometry() {
                let own = GeometryKey::own_textures(object, rules);
                let key = GeometryKey::of(object, rules);
                let has_lobes = !key.lobes.is_empty();
                // A shader with lobes reads the rows of their slots, textured or not.
                any_lobes |= has_lobes;
                if (has_lobes || key.extras.any()) && !key.textures.is_empty() {
                    mapped.insert(object.material);
                }
                for slot in key.textures.slots() {
                    let texture = material.texture(slot).filter(|_| own.contains(slot));
                    let source = texture.map_or(TextureSource::neutral(slot), TextureSource::Scene);
                    sets.entry(object.material).or_default().insert(slot, (source, material.atlas));
                }
            }
            if let Some(texture) = rules.holes_of(object) {
                holes.insert(object.material, (TextureSource::Scene(texture), material.atlas));
            }
        }
        let mut sources: BTreeSet<Atlas> =
            sets.values().flat_map(|slots| slots.values()).chain(holes.values()).copied().collect();
        if rules.keep.has(OptionalPart::UnusedTextures) {
            let used: BTreeSet<TextureSource> = sources.iter().map(|&(source, _)| source).collect();
            let unused = (0..scene.textures.len()).map(TextureSource::Scene).filter(|source| !used.contains(source));
            sources.extend(unused.map(|source| (source, [1, 1])));
        }
        let index: BTreeMap<Atlas, usize> =
            sources.iter().enumerate().map(|(index, &source)| (source, index)).collect();
        Self {
            images: sources.into_iter().map(|source| PlannedTexture::of(scene, source, samples)).collect(),
            sets: sets
                .into_iter()
                .map(|(material, slots)| {
                    (material, slots.iter().map(|(&slot, source)| (slot, index[source])).collect())
                })
                .collect(),
            holes: holes.iter().map(|(&material, source)| (material, index[source])).collect(),
            mapped: mapped.into_iter().collect(),
            mapped_slots: if any_lobes { TextureSlot::ALL.len() } else { TextureSlot::STORED },
            sheet: device.max_layers.clamp(1, MOST_LAYERS),
        }
    }

    /// The sheet that a cell lies in, and its layer there.
    pub fn place_of_cell(&self, cell: u32) -> (u32, u32) {
        let sheet = self.sheet.max(1);
        (cell / sheet, cell % sheet)
    }

    /// The samplers of a material's set: one if all of its scene textures have the same sampler, otherwise one for each texture.
    pub fn samplers(&self, material: usize) -> SetSamplers {
        let own = self.sets.get(&material).into_iter().flat_map(BTreeMap::values).map(|&image| &self.images[image]);
        let own: BTreeSet<Sampler> = own.filter(|own| own.source.texel().is_none()).map(|own| own.sampler).collect();
        match own.len() {
            0 | 1 => SetSamplers::One(own.first().copied().unwrap_or_default()),
            _ => SetSamplers::Each,
        }
    }

    /// The first row of a material's record in the buffer of all records, if it has one.
    pub fn first_uv_map(&self, material: usize) -> Option<u32> {
        let record = self.mapped.binary_search(&material).ok()?;
        Some((record * self.mapped_slots) as u32)
    }

    /// The UV map of a material's texture in the shaders' form: the rows of the map, the first with the UV set in w. Offsets are reduced by whole
    /// periods of a repeating image before they become f32.
    pub fn uv_rows(&self, material: usize, slot: TextureSlot, map: &UvMap) -> [Vec4; 2] {
        let hole = self.holes.get(&material).filter(|_| slot == TextureSlot::BaseColor);
        let image = self.sets.get(&material).and_then(|set| set.get(&slot)).or(hole);
        let wrap = image.map_or([Wrap::Clamp; 2], |&image| self.images[image].sampler.wrap);
        let [mut x, mut y] = map.rows();
        for (row, wrap) in [(&mut x, wrap[0]), (&mut y, wrap[1])] {
            row.z = match wrap {
                Wrap::Repeat => row.z.rem_euclid(1.0),
                Wrap::Mirror => row.z.rem_euclid(2.0),
                Wrap::Clamp => row.z,
            };
        }
        let row = |row: DVec3, w: f64| row.extend(w).clamp(DVec4::splat(-1e38), DVec4::splat(1e38)).as_vec4();
        [row(x, f64::from(map.set)), row(y, 0.0)]
    }

    /// The slots that a material's pipelines sample.
    pub fn mask(&self, material: usize) -> TextureMask {
        let slots = self.sets.get(&material).into_iter().flat_map(BTreeMap::keys);
        slots.fold(TextureMask::default(), |mask, &slot| mask.with(slot))
    }

    /// The images that something samples.
    pub fn sampled(&self) -> BTreeSet<usize> {
        self.sets.values().flat_map(BTreeMap::values).chain(self.holes.values()).copied().collect()
    }

    /// Returns true if some sampled image has more than one level.
    pub fn have_levels(&self) -> bool {
        self.sampled().into_iter().any(|image| self.images[image].levels > 1)
    }

    /// Bytes of all images.
    pub fn bytes(&self) -> u64 {
        self.images.iter().map(PlannedTexture::bytes).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::FramePlan;
    use crate::plan::samples::{self, keeping, plan};
    use crate::scene::{Brdf, CastsShadow, Keep, Material, Settings, View};

    #[test]
    fn only_what_is_sampled_lies_on_the_device() {
        let mut scene = samples::scene(
            vec![samples::textured(Brdf::CookTorrance), samples::textured(Brdf::Phong), Material::default()],
            vec![samples::sky()],
        );
        let sources = |scene: &Scene, settings: &Settings| {
            plan(scene, settings).textures.images.iter().map(|image| image.source).collect::<Vec<_>>()
        };
        use TextureSource::Scene as Of;
        // Nothing emits and nothing is in ambient light; the first has no Ks, the second no metallic.
        assert_eq!(sources(&scene, &Settings::default()), [Of(0), Of(1), Of(2), Of(5), Of(6)]);
        let all = (0..11).map(Of).collect::<Vec<_>>();
        assert_eq!(sources(&scene, &keeping(&[OptionalPart::UnusedTextures])), all);
        let view = Settings { view: View::Overdraw, ..Settings::default() };
        assert_eq!(sources(&scene, &view), []);
        scene.objects.remove(1);
        assert_eq!(sources(&scene, &Settings::default()), [Of(0), Of(1), Of(2)]);
    }

    #[test]
    fn bytes_are_those_of_all_levels() {
        let mut scene = samples::scene(vec![samples::textured(Brdf::Lambert)], vec![]);
        scene.textures[0].size = [8, 2];
        scene.textures[0].texels = (0..64).collect();
        let textures = plan(&scene, &Settings::default()).textures;
        assert_eq!(textures.images[0].levels, 4);
        // 8x2, 4x1, 2x1, 1x1; and 2x2, 1x1 of the normal map.
        assert_eq!(textures.bytes(), 4 * (16 + 4 + 2 + 1) + 4 * (4 + 1));
    }

    /// A scene whose base colour has 8x8 texels in blocks of this format, and `count` levels.
    fn compressed(format: BlockFormat, count: u32) -> Scene {
        let mut scene = samples::scene(vec![samples::textured(Brdf::Lambert)], vec![]);
        // No two blocks alike, so that the texture is not of one colour.
        let level = |level: u32| (0..format.level_bytes([8 >> level; 2])).map(|byte| (byte * 37 + 64) as u8).collect();
        scene.textures[0].size = [8; 2];
        scene.textures[0].texels = Texels::Blocks { format, levels: (0..count).map(level).collect() };
        scene
    }

    #[test]
    fn blocks_stay_where_the_device_samples_them_and_the_file_has_their_levels() {
        let all = samples::device();
        let (no_bc7, no_etc2) = (Capabilities { bc7: false, ..all }, Capabilities { etc2: false, ..all });
        for format in BlockFormat::ALL {
            for (device, samples_it) in
                [(all, true), (no_bc7, format != BlockFormat::Bc7), (no_etc2, format == BlockFormat::Bc7)]
            {
                for (count, levels, makes_levels) in [(4, 4, false), (2, 2, false), (1, 4, true)] {
                    let scene = compressed(format, count);
                    let plan = FramePlan::of(&scene, &Settings::default(), &device).expect("a plan");
                    let image = &plan.textures.images[0];
                    let blocks = Some(format).filter(|_| samples_it && !makes_levels);
                    assert_eq!((image.blocks, image.levels, image.makes_levels), (blocks, levels, makes_levels));
                    assert_eq!(image.format(), texture_format(blocks, image.color_space));
                }
            }
            // 64 texels alone.
            let mut scene = compressed(format, 1);
            scene.textures[0].sampler.levels = None;
            let image = &plan(&scene, &Settings::default()).textures.images[0];
            assert_eq!((image.blocks, image.bytes()), (Some(format), 4 * format.block_bytes() as u64));
        }
    }

    #[test]
    fn a_plan_says_which_textures_stay_compressed_and_what_that_saves() {
        let said = |scene: &Scene, device: &Capabilities, settings: &Settings| {
            let plan = FramePlan::of(scene, settings, device).expect("a plan");
            let part = plan.parts().iter().find(|part| part.name == "decoded textures").expect("the part");
            (part.included, part.reason.clone())
        };
        let (device, settings) = (samples::device(), Settings::default());
        let scene = compressed(BlockFormat::Bc7, 4);
        // 64, 16, 4 and 1 texels of 4 bytes; 4, 1, 1 and 1 blocks of 16.
        let stays = "1 stay compressed (1 in BC7), 228 bytes less than decoded";
        assert_eq!(said(&scene, &device, &settings), (false, stays.into()));
        let kept = keeping(&[OptionalPart::DecodedTextures]);
        assert_eq!(said(&scene, &device, &kept), (true, format!("kept on request: {stays}")));
        let cost = plan(&scene, &settings).cost_of(OptionalPart::DecodedTextures, &scene, &settings, &device);
        assert_eq!(cost.expect("a cost").bytes, 228);
        let poor = Capabilities { bc7: false, ..device };
        assert_eq!(said(&scene, &poor, &settings), (true, "1 decoded: the device does not sample their blocks".into()));
        let single = compressed(BlockFormat::Etc2Rgba8, 1);
        let lacking = "1 decoded: their files lack smaller levels, which are made";
        assert_eq!(said(&single, &device, &settings), (true, lacking.into()));
        let plain = samples::scene(vec![samples::textured(Brdf::Lambert)], vec![]);
        assert_eq!(said(&plain, &device, &settings), (false, "no texture is compressed in its file".into()));
    }

    #[test]
    fn a_kept_slot_is_in_every_material_with_a_neutral_texel() {
        let glow = Material { emissive: glam::Vec3::ONE, ..Material::default() };
        let scene = samples::scene(vec![glow, samples::textured(Brdf::CookTorrance)], vec![samples::sky()]);
        let lean = plan(&scene, &samples::deferred());
        assert!(lean.textures.mask(0).is_empty());
        // No material has a lobe, and without one nothing samples its texture.
        for (slot, part) in TextureSlot::ALL[..TextureSlot::STORED].iter().map(|&slot| (slot, slot.form().part)) {
            let kept = plan(&scene, &Settings { keep: Keep::NONE.with(part), ..samples::deferred() });
            let image = &kept.textures.images[kept.textures.sets[&0][&slot]];
            let neutral = if slot == TextureSlot::Normal { [128, 128, 255, 255] } else { [255; 4] };
            assert_eq!((image.source.texel(), image.bytes()), (Some(neutral), 4), "{part}");
            let real = &kept.textures.images[kept.textures.sets[&1][&slot]];
            let wanted = lean.textures.mask(1).contains(slot);
            assert_eq!(real.source, if wanted { TextureSource::Scene(slot as usize) } else { image.source }, "{part}");
            assert!(kept.keys().all(|key| key.textures.contains(slot)) && kept.streams.uvs, "{part}");
            assert_eq!(kept.streams.tangents, lean.streams.tangents || slot == TextureSlot::Normal);
        }
        let all = plan(
            &scene,
            &Settings {
                keep: TextureSlot::ALL.map(|slot| slot.form().part).into_iter().collect(),
                ..Settings::default()
            },
        );
        assert_eq!(all.textures.mask(0).slots().count(), TextureSlot::STORED);
    }

    #[test]
    fn shadows_sample_the_holes_of_what_casts_them_and_nothing_else() {
        let plain = Material { base_color_texture: Some(1), ..Material::default() };
        let mut scene = samples::scene(vec![samples::masked(), plain], vec![samples::sun()]);
        let holes = |scene: &Scene, view| plan(scene, &Settings { view, ..Settings::default() }).textures;
        assert_eq!(holes(&scene, View::Final).holes, BTreeMap::from([(0, 0)]));
        let maps = holes(&scene, View::ShadowMap);
        assert_eq!((maps.images.len(), maps.sets.len(), maps.holes.len()), (1, 0, 1));
        scene.objects[0].casts_shadow = CastsShadow::No;
        assert!(holes(&scene, View::Final).holes.is_empty());
    }

    #[test]
    fn the_sets_of_a_plan_have_what_its_pipelines_sample() {
        for (name, scene) in samples::scenes() {
            for keep in [Keep::NONE, Keep::ALL] {
                let settings = Settings { keep, ..Settings::default() };
                let plan = plan(&scene, &settings);
                let rules = plan.surface_rules();
                for object in rules.drawn(&scene) {
                    let key = GeometryKey::of(object, &rules);
                    assert_eq!(plan.textures.mask(object.material), key.textures, "{name} {keep}");
                }
                let unused = plan.textures.images.len() - plan.textures.sampled().len();
                assert!(unused == 0 || keep == Keep::ALL, "{name}");
            }
        }
    }
}
