//! The materials of a scene as a plan draws them: factors replace a texture that has one value all over, and a mask that cuts nothing is none. World,
//! pipelines, shadows and reports all go by these.
//!
//! A factor times a texture's one colour is the shader's product: exactly where the colour is 0 or 1 (codes 0 and 255), else but for the rounding of
//! the device's conversion and of one product, about 1 part in 2^22. No channel of a picture changes by more than one code.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;

use super::TextureMask;
use crate::scene::{
    AlphaMode, Anisotropy, Brdf, ChannelTarget, ColorSpace, DiffuseTransmission, Material, MaterialValue, Mesh, Object,
    OptionalPart, Sampler, Scene, Settings, Sheen, Texture, TextureSlot, ThinFilm, View, scaled,
};

/// Materials as they are drawn, and the record of their simplification.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EffectiveMaterials {
    /// The scene's materials, in its order. [`Material::ambient`] is the share of ambient light for every model.
    pub all: Vec<Material>,
    /// Textures of one colour, which a factor can hold, whether they are kept or not.
    pub constant: BTreeSet<usize>,
    /// Materials whose masks cut nothing, whether they are kept or not.
    pub opened: usize,
    /// Materials whose masks leave nothing, whether they are kept or not.
    pub emptied: usize,
    /// Meshes whose vertices are not all white and opaque.
    pub colored: BTreeSet<usize>,
    /// Meshes of points and lines.
    pub strokes: BTreeSet<usize>,
    /// Materials whose UV maps a clip moves.
    pub moving_maps: BTreeSet<usize>,
    /// Materials of objects that have a look, or whose cells a clip moves.
    pub looks: BTreeSet<usize>,
    /// The sampling of the scene's textures, in its order.
    samplers: Vec<Sampler>,
    view: View,
    brdf_override: Option<Brdf>,
}

impl EffectiveMaterials {
    pub(in crate::plan) fn of(scene: &Scene, settings: &Settings) -> Self {
        let mut texels =
            TexelStatistics { textures: &scene.textures, colors: BTreeMap::new(), alphas: BTreeMap::new() };
        let white = |mesh: &Mesh| mesh.colors.iter().all(|color| *color == [1.0; 4]);
        let colored = (0..scene.meshes.len()).filter(|&mesh| !white(&scene.meshes[mesh]));
        let mut effective = Self {
            colored: colored.collect(),
            strokes: (0..scene.meshes.len()).filter(|&mesh| scene.meshes[mesh].is_strokes).collect(),
            moving_maps: moving_maps(scene),
            looks: looks(scene),
            samplers: scene.textures.iter().map(|texture| texture.sampler).collect(),
            view: settings.view,
            brdf_override: settings.brdf,
            ..Self::default()
        };
        let veiled = effective.veiled(scene);
        let moving = scene.motion.moved_materials();
        for (index, material) in scene.materials.iter().enumerate() {
            let moves = moving.contains(&index);
            let widest = if moves { scene.motion.widest(index, material) } else { material.clone() };
            let mut own = effective.as_drawn(widest);
            // A value that a clip changes is no constant.
            if moves {
                effective.all.push(effective.glowing(index, own));
                continue;
            }
            let judged = match veiled.contains(&index) {
                true => own.clone(),
                false => effective.judge_mask(own.clone(), &mut texels),
            };
            if !settings.keep.has(OptionalPart::OpaqueMasks) {
                own = judged;
            }
            let folded = effective.fold(own.clone(), &mut texels);
            if !settings.keep.has(OptionalPart::ConstantTextures) {
                own = folded;
            }
            effective.all.push(effective.glowing(index, own));
        }
        effective
    }

    /// A material whose objects may be selected, and whose colour is its emission: also a black one may come to glow, so that a plan for it has the
    /// parts that emission needs.
    fn glowing(&self, index: usize, mut material: Material) -> Material {
        if self.looks.contains(&index) && self.emits_color(&material) {
            material.emissive = material.emissive.max(Vec3::splat(f32::MIN_POSITIVE));
        }
        material
    }

    /// A material of the scene as the plan draws it, with no textures folded into factors, as materials that clips change are always drawn.
    pub(crate) fn as_drawn(&self, material: Material) -> Material {
        let mut own = simplified(material, self.view);
        if !own.has_lobes(own.model(self.brdf_override)) {
            (own.sheen, own.film, own.anisotropy) = (Sheen::NONE, ThinFilm::NONE, Anisotropy::NONE);
            own.refraction = None;
            own.diffuse_transmission = DiffuseTransmission::NONE;
        }
        // A body of glass shows only its front faces, and the picture behind it through them.
        if own.refracts(own.model(self.brdf_override)).is_some_and(|glass| glass.thickness > 0.0) {
            own.two_sided = false;
        }
        if !matches!(own.model(self.brdf_override), Brdf::Phong | Brdf::BlinnPhong) {
            own.ambient = 1.0;
        }
        own
    }

    /// Returns true if a material's colour is its emission: an unlit one's, in views that show emission.
    pub(crate) fn emits_color(&self, material: &Material) -> bool {
        material.unlit && self.view.shows_emission()
    }

    /// Returns true if textures of a material in these slots are not sampled alike.
    pub(crate) fn samplers_differ(&self, material: &Material, slots: TextureMask) -> bool {
        let mut samplers = slots.slots().filter_map(|slot| self.samplers.get(material.texture(slot)?));
        let first = samplers.next();
        samplers.any(|sampler| Some(sampler) != first)
    }

    /// Materials of coloured meshes: the cuts of their masks depend on the vertices.
    fn veiled(&self, scene: &Scene) -> BTreeSet<usize> {
        let colored = scene.objects.iter().filter(|object| self.colored.contains(&object.mesh));
        colored.map(|object| object.material).collect()
    }

    /// The material without a mask that cuts nothing, or all.
    fn judge_mask(&mut self, mut material: Material, texels: &mut TexelStatistics) -> Material {
        let AlphaMode::Mask { cutoff } = material.alpha_mode else { return material };
        let range = material.base_color_texture.map_or(Some((255, 255)), |texture| texels.alphas(texture));
        let Some((least, most)) = range else { return material };
        // Filtering makes nothing beyond the least and the most texel but by rounding, for which there is a code on each side. Of equal
        // texels it is exact, as x + (x - x) t is x, and so are the conversions of 0 and 255.
        let passes = match least {
            255 => material.alpha >= cutoff,
            code => material.alpha * (f32::from(code) - 1.0) / 255.0 >= cutoff,
        };
        let fails = match most {
            0 => cutoff > 0.0,
            255 => material.alpha < cutoff,
            code => material.alpha * (f32::from(code) + 1.0) / 255.0 < cutoff,
        };
        if passes {
            material.alpha_mode = AlphaMode::Opaque;
            self.opened += 1;
        } else if fails {
            // Nothing of it is drawn.
            (material.alpha, material.base_color_texture) = (0.0, None);
            self.emptied += 1;
        }
        material
    }

    /// The material with constant textures folded into its factors.
    fn fold(&mut self, mut material: Material, texels: &mut TexelStatistics) -> Material {
        for slot in TextureSlot::ALL {
            let form = slot.form();
            let is_covering = slot == TextureSlot::BaseColor;
            // A coat has no colour.
            let [red, green, blue] = match form.channels {
                _ if is_covering && material.alpha_mode == AlphaMode::Coat => [false; 3],
                [red, green, blue, _] => [red, green, blue],
            };
            let is_strength = slot == TextureSlot::Specular && material.reflectance_texture().is_some();
            let alpha = is_covering && material.is_transparent();
            // A mask's decision must not be a matter of rounding.
            let texture = material.texture(slot).filter(|_| !(is_covering && material.is_masked()));
            let color = match slot {
                TextureSlot::Normal => texture.filter(|&texture| texels.is_flat(texture)).map(|_| [1.0; 4]),
                _ => texels.color(texture, [red, green, blue, alpha || is_strength || form.channels[3]]),
            };
            if let Some(color) = color {
                (form.fold)(&mut material, color);
                if alpha {
                    material.alpha = scaled(material.alpha, color[3]);
                }
                self.constant.extend(material.texture_mut(slot).take());
            }
        }
        material
    }
}

/// Simplifies a material: an unlit one emits its colour and reflects nothing; views that show no emission show the colour. A coat is a lobe and no
/// more.
fn simplified(mut material: Material, view: View) -> Material {
    if material.unlit {
        material.brdf = Brdf::Lambert;
        material.emissive = Vec3::ZERO;
        let others = TextureSlot::ALL.into_iter().filter(|&slot| slot != TextureSlot::BaseColor);
        others.for_each(|slot| *material.texture_mut(slot) = None);
        if view.shows_emission() {
            material.emissive = std::mem::take(&mut material.base_color);
            material.emissive_texture = material.base_color_texture;
            material.uv_maps[TextureSlot::Emissive as usize] = material.uv_maps[TextureSlot::BaseColor as usize];
            if material.alpha_mode == AlphaMode::Opaque {
                material.base_color_texture = None;
            }
        }
    }
    if material.alpha_mode == AlphaMode::Coat {
        (material.emissive, material.emissive_texture, material.specular_texture) = (Vec3::ZERO, None, None);
    }
    material
}

fn looks(scene: &Scene) -> BTreeSet<usize> {
    let moved = scene.motion.moved_cells();
    let has_look = |(index, object): (usize, &Object)| {
        (object.look.is_some() || moved.contains(&index)).then_some(object.material)
    };
    scene.objects.iter().enumerate().filter_map(has_look).collect()
}

fn moving_maps(scene: &Scene) -> BTreeSet<usize> {
    let targets = scene.motion.clips.iter().flat_map(|clip| &clip.channels).map(|channel| channel.target);
    let moves =
        |value| matches!(value, MaterialValue::UvOffset(_) | MaterialValue::UvRotation(_) | MaterialValue::UvScale(_));
    targets
        .filter_map(|target| match target {
            ChannelTarget::Material(material, value) if moves(value) => Some(material),
            _ => None,
        })
        .collect()
}

/// Red, green, blue and alpha: which of them count.
type ChannelMask = [bool; 4];

/// Values that are constant over whole textures. Each texture is scanned once for each different use.
struct TexelStatistics<'a> {
    textures: &'a [Texture],
    colors: BTreeMap<(usize, ChannelMask), Option<[f64; 4]>>,
    alphas: BTreeMap<usize, Option<(u8, u8)>>,
}

impl<'a> TexelStatistics<'a> {
    /// Returns a texture if its texels can be read. The plan assumes nothing about other textures.
    fn readable(&self, index: usize) -> Option<&'a Texture> {
        self.textures.get(index).filter(|texture| texture.is_readable())
    }

    /// The linear values that all texels have in these channels.
    fn color(&mut self, texture: Option<usize>, channels: ChannelMask) -> Option<[f64; 4]> {
        let index = texture?;
        let texture = self.readable(index)?;
        *self.colors.entry((index, channels)).or_insert_with(|| {
            let first = texture.texel(0, 0);
            let mask = u32::from_ne_bytes(channels.map(|counts| if counts { 255 } else { 0 }));
            let differs = |texel| (u32::from_ne_bytes(texel) ^ u32::from_ne_bytes(first)) & mask != 0;
            (!texture.any_texel(differs)).then(|| decoded(first, texture.color_space))
        })
    }

    /// The least and the most alpha.
    fn alphas(&mut self, index: usize) -> Option<(u8, u8)> {
        let texture = self.readable(index)?;
        *self.alphas.entry(index).or_insert_with(|| {
            let mut range: Option<(u8, u8)> = None;
            texture.any_texel(|[.., alpha]| {
                let (least, most) = range.unwrap_or((alpha, alpha));
                range = Some((least.min(alpha), most.max(alpha)));
                // Nothing can widen it any more.
                range == Some((0, 255))
            });
            range
        })
    }

    /// Returns true if a normal map says (0, 0, 1) everywhere: `mapped_normal` of `shaders/shared/material.wgsl` takes 128 for zero, whatever the third
    /// channel is above that.
    fn is_flat(&self, index: usize) -> bool {
        let is_bent = |[x, y, z, _]: [u8; 4]| [x, y] != [128; 2] || z <= 128;
        self.readable(index).is_some_and(|texture| !texture.any_texel(is_bent))
    }
}

/// As a sampler converts it; alpha is linear in either case.
fn decoded([red, green, blue, alpha]: [u8; 4], color_space: ColorSpace) -> [f64; 4] {
    let decode = |code: u8| {
        let value = f64::from(code) / 255.0;
        match color_space {
            ColorSpace::Linear => value,
            // IEC 61966-2-1.
            ColorSpace::Srgb if value <= 0.04045 => value / 12.92,
            ColorSpace::Srgb => ((value + 0.055) / 1.055).powf(2.4),
        }
    };
    [decode(red), decode(green), decode(blue), f64::from(alpha) / 255.0]
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::plan::samples;
    use crate::scene::Keep;

    fn texture(color_space: ColorSpace, texels: &[[u8; 4]]) -> Texture {
        let size = [texels.len() as u32, 1];
        Texture {
            name: "texture".into(),
            size,
            color_space,
            sampler: Default::default(),
            texels: texels.concat().into(),
        }
    }

    /// The only material of a scene, as it is drawn with these textures.
    fn drawn_with(material: Material, textures: Vec<Texture>, settings: &Settings) -> (Material, EffectiveMaterials) {
        let mut scene = samples::scene(vec![material], vec![samples::sky()]);
        scene.textures = textures;
        let effective = EffectiveMaterials::of(&scene, settings);
        (effective.all[0].clone(), effective)
    }

    fn drawn(material: Material, textures: Vec<Texture>) -> Material {
        drawn_with(material, textures, &Settings::default()).0
    }

    fn keeping(part: OptionalPart) -> Settings {
        Settings { keep: Keep::NONE.with(part), ..Settings::default() }
    }

    #[test]
    fn srgb_is_decoded_as_its_standard_says() {
        // 0.04045 * 255 is 10.3: codes 10 and 11 lie on the two sides of the bend.
        for (code, expected) in [(0, 0.0), (10, 0.003_035_27), (11, 0.003_346_54), (128, 0.215_860_5), (255, 1.0)] {
            let [red, .., alpha] = decoded([code, 0, 0, code], ColorSpace::Srgb);
            assert!((red - expected).abs() < 1e-7, "{code}: {red}");
            assert_eq!(alpha, f64::from(code) / 255.0);
        }
        assert_eq!(decoded([51, 255, 0, 255], ColorSpace::Linear), [0.2, 1.0, 0.0, 1.0]);
    }

    #[test]
    fn a_texture_of_one_colour_is_in_the_factor() {
        let grey = |space| texture(space, &[[128, 51, 255, 7]; 3]);
        let mut material = samples::textured(Brdf::Phong);
        (material.metallic, material.specular, material.emissive) = (0.5, Vec3::ONE, Vec3::splat(2.0));
        (material.ambient, material.roughness, material.shininess) = (0.5, 0.5, 50.0);
        let spaces = [0, 1, 1, 1, 0, 0, 1, 0, 1, 1, 0]
            .map(|linear| if linear == 1 { ColorSpace::Linear } else { ColorSpace::Srgb });
        let (own, effective) = drawn_with(material.clone(), spaces.map(grey).to_vec(), &Settings::default());
        let linear = 0.215_860_5;
        assert!((own.base_color.x - 0.8 * linear).abs() < 1e-6 && own.base_color.z == 0.8, "{}", own.base_color);
        assert!((own.emissive.x - 2.0 * linear).abs() < 1e-6 && own.emissive.z == 2.0);
        assert!((own.specular.x - linear).abs() < 1e-6 && own.specular.z == 1.0);
        assert_eq!((own.roughness, own.metallic, own.shininess), (0.1, 0.5, 10.0));
        assert_eq!(own.ambient, (0.5f64 * 128.0 / 255.0) as f32);
        assert_eq!(own.alpha, 1.0, "an opaque material does not look at alpha");
        let left: Vec<_> = own.textures().collect();
        assert_eq!(left, [(TextureSlot::Normal, 1)], "a normal that leans all over is no neutral one");
        assert_eq!(effective.constant, BTreeSet::from([0, 2, 3, 4, 5, 6, 7, 8, 9, 10]));
        let (kept, effective) =
            drawn_with(material.clone(), spaces.map(grey).to_vec(), &keeping(OptionalPart::ConstantTextures));
        assert_eq!((kept, effective.constant.len()), (material, 10));
    }

    #[test]
    fn a_leafs_texture_of_one_colour_is_in_its_tint_and_in_the_share_that_comes_through() {
        let through = DiffuseTransmission { strength: 0.5, color: Vec3::new(1.0, 0.5, 1.0) };
        let leaf = Material {
            diffuse_transmission: through,
            diffuse_transmission_texture: Some(0),
            ..samples::material(Brdf::CookTorrance)
        };
        let grey = texture(ColorSpace::Srgb, &[[128, 255, 0, 51]; 3]);
        let own = drawn(leaf.clone(), vec![grey.clone()]);
        let DiffuseTransmission { strength, color } = own.diffuse_transmission;
        assert!((color - Vec3::new(0.215_860_5, 0.5, 0.0)).abs().max_element() < 1e-6, "{color}");
        assert_eq!((strength, own.diffuse_transmission_texture), (0.1, None));
        // A surface that has no lobes keeps none of it.
        let phong = drawn(Material { brdf: Brdf::Phong, ..leaf }, vec![grey]);
        assert_eq!(phong.diffuse_transmission.strength, 0.0);
    }

    #[test]
    fn only_channels_that_are_sampled_need_be_constant() {
        let material = samples::textured(Brdf::CookTorrance);
        let varying = |texels: [[u8; 4]; 2]| {
            let linear = |_| texture(ColorSpace::Linear, &texels);
            let own = drawn(material.clone(), (0..11).map(linear).collect());
            own.textures().map(|(slot, _)| slot).collect::<Vec<_>>()
        };
        use TextureSlot::*;
        assert_eq!(varying([[9, 9, 9, 0], [9, 9, 9, 255]]), [Normal, Sheen, DiffuseTransmission]);
        assert_eq!(
            varying([[9, 9, 9, 9], [0, 9, 9, 9]]),
            [BaseColor, Normal, Occlusion, Emissive, Specular, Sheen, Film, Anisotropy, DiffuseTransmission]
        );
        assert_eq!(
            varying([[9, 9, 9, 9], [9, 0, 9, 9]]),
            [
                BaseColor,
                Normal,
                MetallicRoughness,
                Emissive,
                Specular,
                Shininess,
                Sheen,
                Film,
                Anisotropy,
                DiffuseTransmission,
            ]
        );
        assert_eq!(
            varying([[128, 128, 255, 9], [128, 128, 250, 9]]),
            [BaseColor, MetallicRoughness, Emissive, Specular, Sheen, Film, Anisotropy, DiffuseTransmission]
        );
    }

    #[test]
    fn alpha_counts_where_it_is_looked_at() {
        let veil = |alpha: [u8; 2]| texture(ColorSpace::Srgb, &alpha.map(|alpha| [255, 255, 255, alpha]));
        let glass = Material { base_color_texture: Some(0), alpha: 0.5, ..samples::glass() };
        assert_eq!(drawn(glass.clone(), vec![veil([51, 51])]).alpha, 0.1);
        assert_eq!(drawn(glass.clone(), vec![veil([51, 52])]).base_color_texture, Some(0));
        let opaque = Material { alpha_mode: AlphaMode::Opaque, ..glass };
        assert_eq!(drawn(opaque, vec![veil([51, 52])]).base_color_texture, None);
    }

    #[test]
    fn a_flat_normal_map_is_none() {
        let mapped = Material { normal_texture: Some(0), ..Material::default() };
        for (texels, flat) in [
            ([[128, 128, 255, 255]; 2], true),
            ([[128, 128, 129, 0], [128, 128, 255, 255]], true),
            ([[128, 128, 255, 255], [128, 129, 255, 255]], false),
            ([[127, 128, 255, 255]; 2], false),
            ([[128, 128, 128, 255]; 2], false),
        ] {
            let own = drawn(mapped.clone(), vec![texture(ColorSpace::Linear, &texels)]);
            assert_eq!(own.normal_texture.is_none(), flat, "{texels:?}");
        }
    }

    #[test]
    fn masks_that_cut_nothing_or_all_are_none() {
        #[derive(Debug, PartialEq)]
        enum Is {
            Mask,
            Opaque,
            Nothing,
        }
        for (alphas, factor, cutoff, expected) in [
            ([255, 255], 1.0, 0.5, Is::Opaque),
            ([255, 255], 1.0, 1.0, Is::Opaque),
            ([255, 255], 0.4, 0.5, Is::Nothing),
            // Of two codes that pass, filtering makes one that may be a code less.
            ([130, 255], 1.0, 0.5, Is::Opaque),
            ([129, 255], 1.0, 0.5, Is::Opaque),
            ([128, 255], 1.0, 0.5, Is::Mask),
            ([129, 255], 0.9, 0.5, Is::Mask),
            ([0, 126], 1.0, 0.5, Is::Nothing),
            ([0, 127], 1.0, 0.5, Is::Mask),
            ([0, 0], 1.0, 0.5, Is::Nothing),
            ([0, 0], 1.0, 0.0, Is::Mask),
            ([0, 255], 1.0, 0.5, Is::Mask),
        ] {
            let texels = alphas.map(|alpha| [alpha, 90, 90, alpha]);
            let material = Material { alpha: factor, alpha_mode: AlphaMode::Mask { cutoff }, ..samples::masked() };
            let textures = vec![texture(ColorSpace::Srgb, &texels)];
            let own = drawn(material.clone(), textures.clone());
            let is = match own.alpha_mode {
                AlphaMode::Opaque => Is::Opaque,
                _ if own.base_color_texture.is_some() => Is::Mask,
                _ => Is::Nothing,
            };
            assert_eq!(is, expected, "{alphas:?} times {factor}, cut off at {cutoff}");
            let kept = drawn_with(material.clone(), textures, &keeping(OptionalPart::OpaqueMasks)).0;
            assert_eq!(kept, material, "{alphas:?}: a mask that is kept keeps its texture");
        }
    }
}
