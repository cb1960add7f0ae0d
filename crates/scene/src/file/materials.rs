//! `[[materials]]`: new materials, and changes to materials of models.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3, Vec3};

use super::node::{DISPERSION, DISTANCE, FACTOR, KeyedValue, NANOMETRES, REFRACTION, SHARE, STRENGTH, Table};
use super::schema;
use crate::texture::read_image;
use crate::{
    AlphaMode, ColorSpace, Error, Filter, MAX_ATLAS_EDGE, Material, Refraction, Sampler, Scene, SlotForm, Texture,
    TextureSlot, UvMap, Wrap,
};

/// Textures that have been read, so that two materials share one image.
pub(super) struct Textures<'a> {
    pub folder: &'a Path,
    read: HashMap<(PathBuf, ColorSpace, Sampler), usize>,
}

impl<'a> Textures<'a> {
    pub fn in_folder(folder: &'a Path) -> Self {
        Self { folder, read: HashMap::new() }
    }

    /// A texture that is a path, or a table of a path and how it is used; its number, and how it lies on meshes.
    fn load(&mut self, node: &KeyedValue, color_space: ColorSpace, scene: &mut Scene) -> Result<(usize, UvMap), Error> {
        if !node.is_table() {
            return Ok((self.image(node, (color_space, Sampler::DEFAULT), scene)?, UvMap::IDENTITY));
        }
        let table = node.table(schema::TEXTURE)?;
        let file = table.get("file").ok_or_else(|| table.wrong("needs file"))?;
        let map = uv_map(&table)?;
        Ok((self.image(&file, (color_space, sampler(&table)?), scene)?, map))
    }

    /// A texture that is a path.
    pub fn image(
        &mut self,
        node: &KeyedValue,
        (color_space, sampler): (ColorSpace, Sampler),
        scene: &mut Scene,
    ) -> Result<usize, Error> {
        let path = self.folder.join(node.string()?);
        if let Some(&index) = self.read.get(&(path.clone(), color_space, sampler)) {
            return Ok(index);
        }
        let picture = read_image(&path).map_err(|error| node.wrong(error))?;
        let image = picture.rgba8(color_space);
        scene.warnings.extend(picture.warning);
        let (name, size) = (path.display().to_string(), [image.width(), image.height()]);
        let mut texture = Texture { name, size, color_space, sampler, texels: image.into_raw().into() };
        texture.make_levels();
        scene.textures.push(texture);
        let index = scene.textures.len() - 1;
        scene.files.push(path.clone());
        self.read.insert((path, color_space, sampler), index);
        Ok(index)
    }
}

fn sampler(table: &Table) -> Result<Sampler, Error> {
    let one = |node: &KeyedValue| {
        Ok(match node.word(&["repeat", "mirror", "clamp"])? {
            "mirror" => Wrap::Mirror,
            "clamp" => Wrap::Clamp,
            _ => Wrap::Repeat,
        })
    };
    let both = |node: &KeyedValue| match node.is_string() {
        true => one(node).map(|wrap| [wrap; 2]),
        false => {
            let [u, v] = node.list()?.try_into().map_err(|_| node.wrong("must be a word, or two, [u, v]"))?;
            Ok([one(&u)?, one(&v)?])
        }
    };
    let filter = table.read("filter", |node| node.word(&["linear", "nearest"]))?;
    let filter = if filter == Some("nearest") { Filter::Nearest } else { Filter::Linear };
    let wrap = table.read("wrap", both)?.unwrap_or_default();
    Ok(Sampler { wrap, magnify: filter, minify: filter, levels: Some(filter) })
}

fn uv_map(table: &Table) -> Result<UvMap, Error> {
    let pair = |name: &str, limit| table.read(name, |node| node.numbers::<2>(limit, "[u, v]").map(DVec2::from));
    let turn = table.read("rotation_degrees", |node| node.number(FACTOR))?.unwrap_or(0.0);
    Ok(UvMap {
        set: table.read("uv_set", |node| node.integer(0..=1))?.unwrap_or(0) as u8,
        offset: pair("offset", FACTOR)?.unwrap_or(DVec2::ZERO),
        rotation: turn.to_radians(),
        scale: pair("scale", FACTOR)?.unwrap_or(DVec2::ONE),
    })
}

/// Changes every material of that name, or adds one.
pub(super) fn material(node: &KeyedValue, scene: &mut Scene, textures: &mut Textures) -> Result<(), Error> {
    let table = node.table(schema::MATERIAL)?;
    let name = table.get("name").ok_or_else(|| table.wrong("needs name"))?.string()?;
    if !scene.materials.iter().any(|material| material.name == name) {
        scene.materials.push(Material { name: name.into(), ..Material::default() });
    }
    let slots = read_textures(&table, scene, textures)?;
    for material in scene.materials.iter_mut().filter(|material| material.name == name) {
        change(&table, material)?;
        for &(slot, (texture, map)) in &slots {
            *material.texture_mut(slot) = Some(texture);
            material.uv_maps[slot as usize] = map;
        }
    }
    Ok(())
}

/// A texture with how it lies, in its slot.
type Slotted = (TextureSlot, (usize, UvMap));

fn read_textures(table: &Table, scene: &mut Scene, textures: &mut Textures) -> Result<Vec<Slotted>, Error> {
    let mut slots = Vec::new();
    for slot in TextureSlot::ALL {
        let SlotForm { key, color_space, .. } = *slot.form();
        let texture = table.read(key, |node| textures.load(node, color_space, scene))?;
        slots.extend(texture.map(|texture| (slot, texture)));
    }
    Ok(slots)
}

fn change(table: &Table, material: &mut Material) -> Result<(), Error> {
    let share = |name: &str, before: f32| -> Result<f32, Error> {
        Ok(table.read(name, |node| node.number_f32(SHARE))?.unwrap_or(before))
    };
    let color = |name: &str, before: Vec3| -> Result<Vec3, Error> {
        Ok(table.read(name, |node| node.color(SHARE))?.unwrap_or(before))
    };
    material.brdf = table.read("brdf", KeyedValue::name)?.unwrap_or(material.brdf);
    material.base_color = color("base_color", material.base_color)?;
    material.alpha = share("alpha", material.alpha)?;
    material.metallic = share("metallic", material.metallic)?;
    material.roughness = share("roughness", material.roughness)?;
    material.specular = color("specular", material.specular)?;
    material.shininess = table.read("shininess", |node| node.number_f32(STRENGTH))?.unwrap_or(material.shininess);
    material.ambient = share("ambient", material.ambient)?;
    material.sheen.color = color("sheen_color", material.sheen.color)?;
    material.sheen.roughness = share("sheen_roughness", material.sheen.roughness)?;
    material.film.strength = share("film", material.film.strength)?;
    material.film.ior = table.read("film_ior", |node| node.number_f32(REFRACTION))?.unwrap_or(material.film.ior);
    material.anisotropy.strength = share("anisotropy", material.anisotropy.strength)?;
    let turn = table.read("anisotropy_rotation_degrees", |node| node.number_f32(FACTOR))?;
    material.anisotropy.rotation = turn.map_or(material.anisotropy.rotation, f32::to_radians);
    let through = &mut material.diffuse_transmission;
    through.strength = share("diffuse_transmission", through.strength)?;
    through.color = color("diffuse_transmission_color", through.color)?;
    material.film.nanometres = table.read("film_thickness", thickness)?.unwrap_or(material.film.nanometres);
    let strength = table.read("emissive_strength", |node| node.number_f32(STRENGTH))?.unwrap_or(1.0);
    let emissive = table.read("emissive", |node| node.color(STRENGTH))?;
    material.emissive = emissive.unwrap_or(material.emissive) * strength;
    material.normal_scale =
        table.read("normal_scale", |node| node.number_f32(FACTOR))?.unwrap_or(material.normal_scale);
    material.two_sided = table.read("two_sided", KeyedValue::boolean)?.unwrap_or(material.two_sided);
    material.unlit = table.read("unlit", KeyedValue::boolean)?.unwrap_or(material.unlit);
    material.atlas = table.read("atlas", atlas)?.unwrap_or(material.atlas);
    material.alpha_mode = alpha_mode(table, material.alpha_mode)?;
    refraction(table, material)?;
    dielectric(table, material)
}

/// Reads the way of light through glass, where one of its keys is there.
fn refraction(table: &Table, material: &mut Material) -> Result<(), Error> {
    let thickness = table.read("thickness", |node| node.number_f32(STRENGTH))?;
    let color = table.read("attenuation_color", |node| node.color(SHARE))?;
    let distance = table.read("attenuation_distance", |node| node.number_f32(DISTANCE))?;
    let dispersion = table.read("dispersion", |node| node.number_f32(DISPERSION))?;
    let says_none = thickness.is_none() && color.is_none() && distance.is_none() && dispersion.is_none();
    if material.alpha_mode != AlphaMode::Glass {
        material.refraction = None;
        return match says_none {
            true => Ok(()),
            false => Err(table.wrong("thickness, attenuation and dispersion go with alpha_mode = \"glass\"")),
        };
    }
    if says_none && material.refraction.is_none() {
        return Ok(());
    }
    let ior = table.read("ior", |node| node.number_f32(REFRACTION))?;
    let before = material.refraction.unwrap_or_default();
    material.refraction = Some(Refraction {
        ior: ior.unwrap_or(before.ior),
        thickness: thickness.unwrap_or(before.thickness),
        color: color.unwrap_or(before.color),
        distance: distance.unwrap_or(before.distance),
        dispersion: dispersion.unwrap_or(before.dispersion),
    });
    Ok(())
}

/// Nanometres of a film: of black and of white in its texture.
fn thickness(node: &KeyedValue) -> Result<[f32; 2], Error> {
    let [least, most] = node.list()?.try_into().map_err(|_| node.wrong("must be [least, most]"))?;
    Ok([least.number_f32(NANOMETRES)?, most.number_f32(NANOMETRES)?])
}

/// Rows and columns.
fn atlas(node: &KeyedValue) -> Result<[u32; 2], Error> {
    let [rows, columns] = node.list()?.try_into().map_err(|_| node.wrong("must be [rows, columns]"))?;
    Ok([rows.integer(1..=MAX_ATLAS_EDGE)?, columns.integer(1..=MAX_ATLAS_EDGE)?])
}

/// Reads the reflectance of the dielectric share (KHR_materials_ior, KHR_materials_specular), where one of its keys is there.
fn dielectric(table: &Table, material: &mut Material) -> Result<(), Error> {
    let ior = table.read("ior", |node| node.number(REFRACTION))?;
    let strength = table.read("specular_strength", |node| node.number(SHARE))?;
    let tint = table.read("specular_tint", |node| node.color(STRENGTH))?;
    if ior.is_none() && strength.is_none() && tint.is_none() {
        return Ok(());
    }
    let (ior, strength) = (ior.unwrap_or(1.5), strength.unwrap_or(1.0));
    let facing = tint.unwrap_or(Vec3::ONE).as_dvec3() * ((ior - 1.0) / (ior + 1.0)).powi(2);
    material.reflectance = (facing.min(DVec3::ONE) * strength).as_vec3();
    material.grazing = strength as f32;
    Ok(())
}

fn alpha_mode(table: &Table, before: AlphaMode) -> Result<AlphaMode, Error> {
    let cutoff = table.read("alpha_cutoff", |node| node.number_f32(SHARE))?;
    let mode = match table.read("alpha_mode", |node| node.word(&["opaque", "mask", "blend", "glass", "coat"]))? {
        Some("opaque") => AlphaMode::Opaque,
        Some("blend") => AlphaMode::Blend,
        Some("glass") => AlphaMode::Glass,
        Some("coat") => AlphaMode::Coat,
        Some(_) => AlphaMode::Mask { cutoff: 0.5 },
        None => before,
    };
    match (mode, cutoff) {
        (AlphaMode::Mask { .. }, Some(cutoff)) => Ok(AlphaMode::Mask { cutoff }),
        (_, Some(_)) => Err(table.wrong("alpha_cutoff goes with alpha_mode = \"mask\"")),
        (mode, None) => Ok(mode),
    }
}
