//! `[[materials]]`: new ones, and changes to those that models bring.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::Vec3;

use super::node::{FACTOR, Node, SHARE, STRENGTH, Table};
use super::schema;
use crate::scene::texture::read_image;
use crate::scene::{AlphaMode, ColorSpace, Error, Material, Scene, SlotForm, Texture, TextureSlot};

/// Textures that have been read, so that two materials share one image.
pub(super) struct Textures<'a> {
    pub folder: &'a Path,
    read: HashMap<(PathBuf, ColorSpace), usize>,
}

impl<'a> Textures<'a> {
    pub fn in_folder(folder: &'a Path) -> Self {
        Self { folder, read: HashMap::new() }
    }

    fn load(&mut self, node: &Node, color_space: ColorSpace, scene: &mut Scene) -> Result<usize, Error> {
        let path = self.folder.join(node.string()?);
        if let Some(&index) = self.read.get(&(path.clone(), color_space)) {
            return Ok(index);
        }
        let image = read_image(&path, color_space).map_err(|error| node.wrong(error))?;
        let (name, size) = (path.display().to_string(), [image.width(), image.height()]);
        scene.textures.push(Texture { name, size, color_space, sampler: Default::default(), texels: image.into_raw() });
        let index = scene.textures.len() - 1;
        scene.files.push(path.clone());
        self.read.insert((path, color_space), index);
        Ok(index)
    }
}

/// Changes every material of that name, or adds one.
pub(super) fn material(node: &Node, scene: &mut Scene, textures: &mut Textures) -> Result<(), Error> {
    let table = node.table(schema::MATERIAL)?;
    let name = table.get("name").ok_or_else(|| table.wrong("needs name"))?.string()?;
    if !scene.materials.iter().any(|material| material.name == name) {
        scene.materials.push(Material { name: name.into(), ..Material::default() });
    }
    let slots = read_textures(&table, scene, textures)?;
    for material in scene.materials.iter_mut().filter(|material| material.name == name) {
        change(&table, material)?;
        for &(slot, texture) in &slots {
            *material.texture_mut(slot) = Some(texture);
        }
    }
    Ok(())
}

fn read_textures(
    table: &Table,
    scene: &mut Scene,
    textures: &mut Textures,
) -> Result<Vec<(TextureSlot, usize)>, Error> {
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
    material.brdf = table.read("brdf", Node::name)?.unwrap_or(material.brdf);
    material.base_color = color("base_color", material.base_color)?;
    material.alpha = share("alpha", material.alpha)?;
    material.metallic = share("metallic", material.metallic)?;
    material.roughness = share("roughness", material.roughness)?;
    material.specular = color("specular", material.specular)?;
    material.shininess = table.read("shininess", |node| node.number_f32(STRENGTH))?.unwrap_or(material.shininess);
    material.ambient = share("ambient", material.ambient)?;
    let strength = table.read("emissive_strength", |node| node.number_f32(STRENGTH))?.unwrap_or(1.0);
    let emissive = table.read("emissive", |node| node.color(STRENGTH))?;
    material.emissive = emissive.unwrap_or(material.emissive) * strength;
    material.normal_scale =
        table.read("normal_scale", |node| node.number_f32(FACTOR))?.unwrap_or(material.normal_scale);
    material.two_sided = table.read("two_sided", Node::boolean)?.unwrap_or(material.two_sided);
    material.alpha_mode = alpha_mode(table, material.alpha_mode)?;
    Ok(())
}

fn alpha_mode(table: &Table, before: AlphaMode) -> Result<AlphaMode, Error> {
    let cutoff = table.read("alpha_cutoff", |node| node.number_f32(SHARE))?;
    let mode = match table.read("alpha_mode", |node| node.word(&["opaque", "mask", "blend", "glass"]))? {
        Some("opaque") => AlphaMode::Opaque,
        Some("blend") => AlphaMode::Blend,
        Some("glass") => AlphaMode::Glass,
        Some(_) => AlphaMode::Mask { cutoff: 0.5 },
        None => before,
    };
    match (mode, cutoff) {
        (AlphaMode::Mask { .. }, Some(cutoff)) => Ok(AlphaMode::Mask { cutoff }),
        (_, Some(_)) => Err(table.wrong("alpha_cutoff goes with alpha_mode = \"mask\"")),
        (mode, None) => Ok(mode),
    }
}
