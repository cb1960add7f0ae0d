//! MTL definitions into materials; the module above documents the mapping.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::geometry::MaterialNeeds;
use super::maps::{MapImage, MapRequest, MapTexture, TextureOpacity, roughness_of_shininess};
use super::mtl::{Definition, Map};
use super::normal_maps::{CLEARLY_DOWN, turn_green_over};
use super::text;
use crate::{AlphaMode, LoadOptions, Material, Texture, TextureSlot};

/// A material whose textures are still to be made.
#[derive(Debug, Default)]
pub(super) struct PendingMaterial {
    pub material: Material,
    pub needs: MaterialNeeds,
    pub requests: Vec<(TextureSlot, MapRequest)>,
    /// The material without its maps, whose factors replace unreadable maps.
    pub without_maps: Material,
    /// True if the file gives it a colour.
    pub has_color: bool,
}

/// Returns the material for faces whose material is not defined anywhere.
pub(super) fn plain(name: &str) -> PendingMaterial {
    let mut pending = PendingMaterial::default();
    if !name.is_empty() {
        pending.material.name = name.to_owned();
    }
    pending
}

/// Reads a material. Textures are looked for in `folders`, in this order; a missing one gives a warning.
pub(super) fn read(definition: &Definition, folders: &[&Path], warnings: &mut Vec<String>) -> PendingMaterial {
    let mut reader = MaterialReader { definition, folders, warnings, placements: Vec::new() };
    let source = &definition.source;
    let diffuse = reader.map("map_Kd", source.diffuse_texture.as_deref());
    let mut without_maps = reader.constants();
    if source.diffuse_texture.is_some() && without_maps.base_color == Vec3::ZERO {
        // Exporters write a black Kd beside a map and mean the map, so black is wrong if the map is lost.
        without_maps.base_color = Material::default().base_color;
    }
    let mut pending = PendingMaterial {
        material: without_maps.clone(),
        has_color: source.diffuse.is_some(),
        without_maps,
        ..PendingMaterial::default()
    };
    if diffuse.is_some() && source.diffuse.is_none_or(|kd| kd == [0.0; 3]) {
        pending.material.base_color = Vec3::ONE;
    }
    if source.ambient_texture.is_some() && source.diffuse_texture.is_none() {
        reader.warn("map_Ka", "map_Ka without map_Kd is not used");
    }
    reader.color(&mut pending, diffuse.as_ref());
    reader.normals(&mut pending, diffuse.as_ref());
    reader.roughness(&mut pending);
    reader.emission(&mut pending);
    if let Some((image, _)) = reader.map("map_Ks", source.specular_texture.as_deref()) {
        if source.specular.is_none() {
            pending.material.specular = Vec3::ONE;
        }
        // The slot would hold a dielectric's reflectance if there were no Ks.
        if pending.material.specular != Vec3::ZERO {
            pending.requests.push((TextureSlot::Specular, MapRequest::Color { image: Some(image), mask: None }));
        }
    }
    (pending.needs.uv_scale, pending.needs.uv_offset) = reader.placement();
    pending.needs.is_clamped = pending.requests.iter().any(|(_, request)| request.sources().any(|own| own.is_clamped));
    pending
}

struct MaterialReader<'a> {
    definition: &'a Definition,
    folders: &'a [&'a Path],
    warnings: &'a mut Vec<String>,
    /// Scale and offset of each map's texture coordinates.
    placements: Vec<(DVec2, DVec2)>,
}

impl MaterialReader<'_> {
    fn warn(&mut self, keyword: &str, what: &str) {
        let at = self.definition.lines.get(keyword).map(|line| format!(":{line}")).unwrap_or_default();
        let (file, name) = (self.definition.file.display(), &self.definition.name);
        self.warnings.push(format!("{file}{at}: material `{name}`: {what}"));
    }

    fn unknown(&self, keyword: &str) -> Option<&str> {
        self.definition.source.unknown_param.get(keyword).map(String::as_str)
    }

    fn number(&self, keyword: &str) -> Option<f32> {
        // `mtl` has checked that it is a number.
        self.unknown(keyword)?.parse().ok()
    }

    /// The image that a map statement names, if it is there.
    fn map(&mut self, keyword: &str, value: Option<&str>) -> Option<(MapImage, Map)> {
        let map = Map::parse(value?);
        let found = |map: Map| {
            let path = self.folders.iter().find_map(|folder| text::find_file(folder, &map.name))?;
            Some((path, map))
        };
        let Some((path, map)) = found(map.clone()).or_else(|| found(map.without_tail()?)) else {
            let name = &map.name;
            let is_folder = self.folders.iter().any(|folder| folder.join(name.trim_matches('"')).is_dir());
            let is = if is_folder { "a folder" } else { "missing" };
            self.warn(keyword, &format!("texture `{name}` is {is}, drawn without it"));
            return None;
        };
        for option in &map.ignored {
            self.warn(keyword, &format!("option `{option}` of {keyword} is not supported"));
        }
        self.placements.push((map.scale, map.offset));
        Some((MapImage { path, channel: map.channel, is_clamped: map.is_clamped }, map))
    }

    /// The material without its maps.
    fn constants(&mut self) -> Material {
        let source = &self.definition.source;
        for (keyword, channels) in [("Kd", source.diffuse), ("Ks", source.specular)] {
            let is_share = |channel: &f64| (0.0..=1.0).contains(channel);
            if channels.is_some_and(|channels| !channels.iter().all(is_share)) {
                self.warn(keyword, &format!("{keyword} is not from 0 to 1, taken for the nearest"));
            }
        }
        for keyword in ["Pr", "Pm"] {
            if self.number(keyword).is_some_and(|value| !(0.0..=1.0).contains(&value)) {
                self.warn(keyword, &format!("{keyword} is not from 0 to 1, taken for the nearest"));
            }
        }
        let color = |channels: [f64; 3]| Vec3::from(channels.map(|c| c as f32)).max(Vec3::ZERO);
        let diffuse = source.diffuse.map(|kd| color(kd).min(Vec3::ONE));
        let shininess = source.shininess.unwrap_or(0.0).max(0.0) as f32;
        let unit = |value: f32| value.clamp(0.0, 1.0);
        let opacity = source.dissolve.or(self.number("Tr").map(|tr| 1.0 - f64::from(tr)));
        let keyword = if source.dissolve.is_some() { "d" } else { "Tr" };
        if opacity.is_some_and(|opacity| opacity > 1.0) {
            self.warn(keyword, &format!("{keyword} is not from 0 to 1, taken for the nearest"));
        }
        let opacity = opacity.filter(|&opacity| opacity < 1.0);
        if let Some(opacity) = opacity.filter(|&opacity| opacity <= 0.0) {
            // Some exporters swap `d` and `Tr`, and nobody models invisible surfaces.
            self.warn(keyword, &format!("opacity {opacity} would leave nothing to see, drawn opaque"));
        }
        let alpha = opacity.filter(|&opacity| opacity > 0.0).map(|opacity| opacity as f32);
        Material {
            name: self.definition.name.clone(),
            base_color: diffuse.unwrap_or(Material::default().base_color),
            roughness: self.number("Pr").map_or(roughness_of_shininess(shininess), unit),
            metallic: self.number("Pm").map_or(0.0, unit),
            specular: source.specular.map_or(Vec3::ZERO, |ks| color(ks).min(Vec3::ONE)),
            shininess,
            ambient: source.ambient.map_or(1.0, |ka| ambient_share(color(ka), diffuse.unwrap_or(Vec3::ONE))),
            emissive: source.emissive.map_or(Vec3::ZERO, color),
            alpha: alpha.unwrap_or(1.0),
            alpha_mode: if alpha.is_some() { AlphaMode::Blend } else { AlphaMode::Opaque },
            ..Material::default()
        }
    }

    fn color(&mut self, pending: &mut PendingMaterial, diffuse: Option<&(MapImage, Map)>) {
        let mask = self.map("map_d", self.definition.source.dissolve_texture.as_deref()).map(|(mask, _)| mask);
        let image = diffuse.map(|(image, _)| image.clone());
        // A mask that is the colour map itself means the map's own alpha, which counts anyway.
        let mask = mask.filter(|mask| mask.channel.is_some() || image.as_ref().is_none_or(|i| i.path != mask.path));
        if image.is_some() || mask.is_some() {
            pending.requests.push((TextureSlot::BaseColor, MapRequest::Color { image, mask }));
        }
    }

    fn normals(&mut self, pending: &mut PendingMaterial, diffuse: Option<&(MapImage, Map)>) {
        let norm = self.unknown("norm").map(str::to_owned);
        let (found, must_be_normals) = match self.map("norm", norm.as_deref()) {
            Some(found) => (Some(found), true),
            None => (self.map("bump", self.definition.source.normal_texture.as_deref()), false),
        };
        let Some((image, map)) = found else { return };
        let is_color_too = diffuse.is_some_and(|(diffuse, _)| diffuse.path == image.path);
        pending.material.normal_scale = map.bump_scale as f32;
        pending.needs.tangents = true;
        let bump_scale = pending.material.normal_scale.to_bits();
        pending
            .requests
            .push((TextureSlot::Normal, MapRequest::Normal { image, must_be_normals, is_color_too, bump_scale }));
    }

    fn roughness(&mut self, pending: &mut PendingMaterial) {
        let [roughness, metallic] = ["map_Pr", "map_Pm"].map(|keyword| {
            let value = self.unknown(keyword).map(str::to_owned);
            self.map(keyword, value.as_deref()).map(|(source, _)| source)
        });
        let shininess = match roughness {
            Some(_) => None,
            None => self.map("map_Ns", self.definition.source.shininess_texture.as_deref()).map(|(source, _)| source),
        };
        if roughness.is_none() && metallic.is_none() && shininess.is_none() {
            return;
        }
        if roughness.is_some() && self.number("Pr").is_none_or(|pr| pr == 0.0) || shininess.is_some() {
            pending.material.roughness = 1.0;
        }
        if metallic.is_some() && pending.material.metallic == 0.0 {
            pending.material.metallic = 1.0;
        }
        // Shininess stays unchanged, in green.
        let share = shininess.clone().map(|source| MapRequest::MetallicRoughness {
            roughness: Some(source),
            shininess: None,
            metallic: None,
        });
        let exponent = shininess.is_some().then(|| pending.material.shininess.to_bits());
        let request =
            MapRequest::MetallicRoughness { roughness: roughness.or(shininess), shininess: exponent, metallic };
        pending.requests.push((TextureSlot::MetallicRoughness, request));
        pending.requests.extend(share.map(|request| (TextureSlot::Shininess, request)));
    }

    fn emission(&mut self, pending: &mut PendingMaterial) {
        let value = self.unknown("map_Ke").map(str::to_owned);
        let Some((image, _)) = self.map("map_Ke", value.as_deref()) else { return };
        if pending.material.emissive == Vec3::ZERO {
            pending.material.emissive = Vec3::ONE;
        }
        pending.requests.push((TextureSlot::Emissive, MapRequest::Color { image: Some(image), mask: None }));
    }

    /// Scale and offset for all maps: a mesh has one set of texture coordinates.
    fn placement(&mut self) -> (DVec2, DVec2) {
        let Some(&first) = self.placements.first() else { return (DVec2::ONE, DVec2::ZERO) };
        if self.placements.iter().any(|placement| *placement != first) {
            self.warn("", "its maps have different -s or -o; the first map's are used for all");
        }
        first
    }
}

/// The ambient share: luminance(Ka) / luminance(Kd), at most 1.
fn ambient_share(ambient: Vec3, diffuse: Vec3) -> f32 {
    let luminance = |color: Vec3| color.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    if luminance(diffuse) > 0.0 { (luminance(ambient) / luminance(diffuse)).min(1.0) } else { 1.0 }
}

/// Makes the textures of the pending materials, in parallel and each once, and puts them in. Images that cannot be read are named in a warning.
pub(super) fn finish(
    pending: Vec<PendingMaterial>,
    options: &LoadOptions,
    warnings: &mut Vec<String>,
) -> (Vec<Material>, Vec<Texture>) {
    let mut numbers = HashMap::new();
    let mut requests = Vec::new();
    for (_, request) in pending.iter().flat_map(|one| &one.requests) {
        numbers.entry(request.clone()).or_insert_with(|| {
            requests.push(request);
            requests.len() - 1
        });
    }
    let done = AtomicUsize::new(0);
    let make = |request: &&MapRequest| {
        let mut made = request.make();
        // Normal maps get their levels later, since they may still be flipped.
        if made.downwardness.is_none() {
            made.texture.iter_mut().for_each(Texture::make_levels);
        }
        options.report("textures", done.fetch_add(1, Ordering::Relaxed) + 1, requests.len());
        made
    };
    let made: Vec<MapTexture> = requests.par_iter().map(make).collect();
    let mut textures = Vec::new();
    let mut outcomes = Vec::new();
    for MapTexture { texture, warnings: own, lost, opacity, downwardness } in made {
        for warning in own {
            // The warning about an image is given once, even if several maps use it.
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
        outcomes.push(FinishedTexture {
            texture: texture.is_some().then_some(textures.len()),
            lost,
            opacity,
            downwardness,
        });
        textures.extend(texture);
    }
    let normal_maps: BTreeMap<_, _> =
        outcomes.iter().filter_map(|outcome| Some((outcome.texture?, outcome.downwardness?))).collect();
    finish_normal_maps(&mut textures, &normal_maps, warnings);
    let materials = pending.into_iter().map(|PendingMaterial { mut material, requests, without_maps, .. }| {
        for (slot, request) in requests {
            outcomes[numbers[&request]].put(slot, &mut material, &without_maps);
        }
        material
    });
    let materials = materials.collect();
    (materials, textures)
}

/// A finished texture's number and properties.
struct FinishedTexture {
    texture: Option<usize>,
    lost: [bool; 2],
    opacity: TextureOpacity,
    downwardness: Option<f32>,
}

impl FinishedTexture {
    /// Puts a texture into its slot. Unreadable images take the factors of the material without maps.
    fn put(&self, slot: TextureSlot, material: &mut Material, without: &Material) {
        *material.texture_mut(slot) = self.texture;
        let [first, second] = self.lost;
        match slot {
            TextureSlot::BaseColor => {
                if first {
                    material.base_color = without.base_color;
                }
                if !material.is_transparent() {
                    material.alpha_mode = match self.opacity {
                        TextureOpacity::Whole => material.alpha_mode,
                        TextureOpacity::Holes => AlphaMode::Mask { cutoff: 0.5 },
                        TextureOpacity::Soft => AlphaMode::Blend,
                    };
                }
            }
            TextureSlot::MetallicRoughness => {
                if first {
                    material.roughness = without.roughness;
                }
                if second {
                    material.metallic = without.metallic;
                }
            }
            TextureSlot::Emissive if first => material.emissive = without.emissive,
            TextureSlot::Specular if first => material.specular = without.specular,
            // The scale is baked into the map, or there is no map.
            TextureSlot::Normal if self.downwardness.is_none() => material.normal_scale = 1.0,
            _ => {}
        }
    }
}

/// MTL does not define the direction of a normal map's green. All maps of a model come from one tool, so they vote. Then their levels are made.
/// `maps` holds the evidence of each map, by its index among the textures.
fn finish_normal_maps(textures: &mut [Texture], maps: &BTreeMap<usize, f32>, warnings: &mut Vec<String>) {
    let mean = maps.values().sum::<f32>() / maps.len().max(1) as f32;
    let points_down = mean > CLEARLY_DOWN;
    if let Some((&first, _)) = maps.first_key_value().filter(|_| points_down) {
        let (first, count) = (&textures[first].name, maps.len());
        warnings
            .push(format!("normal maps ({count}, as `{first}`) have green pointing down, as in DirectX; turned over"));
    }
    textures.par_iter_mut().enumerate().filter(|(index, _)| maps.contains_key(index)).for_each(|(_, texture)| {
        if points_down {
            turn_green_over(texture.rgba8_mut());
        }
        texture.make_levels();
    });
}

/// The definitions of the libraries that an OBJ names. A library that cannot be read gives a warning. If none exists, the file with the OBJ's name
/// and `.mtl` is tried.
///
/// A line may name several files, or one with spaces: the longest run of words that is a file is taken.
pub(super) fn read_libraries(obj: &Path, libraries: &[(String, usize)], warnings: &mut Vec<String>) -> Vec<Definition> {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let mut found = Vec::new();
    for (names, line) in libraries {
        let (paths, missing) = library_paths(folder, names);
        for name in missing {
            warnings.push(format!("{}:{line}: material library `{name}` is missing", obj.display()));
        }
        found.extend(paths);
    }
    let namesake = obj.with_extension("mtl");
    if found.is_empty() && namesake.is_file() {
        warnings.push(format!("{}: its materials are taken from {}", obj.display(), namesake.display()));
        found.push(namesake);
    }
    let mut seen = HashSet::new();
    found.retain(|path| seen.insert(path.clone()));
    let mut definitions = Vec::new();
    for path in found {
        match super::mtl::read(&path) {
            Ok((own, odd)) => {
                definitions.extend(own);
                warnings.extend(odd);
            }
            Err(error) => warnings.push(format!("{error}; drawn without its materials")),
        }
    }
    definitions
}

fn library_paths<'a>(folder: &Path, names: &'a str) -> (Vec<PathBuf>, Vec<&'a str>) {
    let (mut paths, mut missing, mut rest) = (Vec::new(), Vec::new(), names.trim());
    while !rest.is_empty() {
        let ends = rest.char_indices().filter(|(_, c)| c.is_whitespace()).map(|(at, _)| at);
        let mut ends: Vec<usize> = ends.chain([rest.len()]).collect();
        ends.reverse();
        let found = ends.iter().find_map(|&end| text::find_file(folder, &rest[..end]).map(|path| (path, end)));
        let end = match found {
            Some((path, end)) => {
                paths.push(path);
                end
            }
            None => {
                let end = *ends.last().unwrap_or(&rest.len());
                missing.push(&rest[..end]);
                end
            }
        };
        rest = rest[end..].trim_start();
    }
    (paths, missing)
}
