//! Wavefront OBJ and MTL, as real files have them. This module needs the feature `readers`.
//!
//! tobj parses. Around it [`scan`](self) and its MTL twin check numbers and indices while their line is known, and rewrite everything that tobj would
//! refuse, misread or drop. Everything that can be drawn is drawn; a warning names the first part of each kind that is left out, and counts the
//! others. Only a file of which no face can be drawn is refused.
//!
//! **Text.** UTF-8, UTF-16 or Latin-1, with any line ends; keywords in any case; a decimal comma counts as a point. A backslash continues its line
//! unless it ends a comment, a name or the last line before another statement.
//!
//! **Geometry.** Positions are read as f64 and recentred by mesh, one mesh for each group and material. Polygons are cut, also concave ones. A face
//! is left out if one of its vertices is missing or has no position. Texture coordinates that are not numbers are 0. Missing normals follow smoothing
//! groups; in a file without any, edges above 60 degrees are hard and all others smooth. Two faces back to back are each seen from their own side.
//! Tangents are made if a material has a normal map. V is flipped, so that (0, 0) is the image's upper left. Points, lines and free-form surfaces are
//! not drawn.
//!
//! **Colours of vertices**, `v x y z r g b`, are no part of the format. They are taken as sRGB, as photogrammetry and Blender write them, in codes of
//! 8 or 16 bits where one is above 1, and multiply `Kd`. A material with a `map_Kd` is drawn without them: both show the same photographs. ZBrush's
//! `#MRGB` comments count too.
//!
//! **Materials.** MTL describes Phong's model, Afterlight's default is metallic-roughness. Both are filled:
//!
//! | MTL | becomes |
//! |---|---|
//! | `Kd`, `map_Kd` | base colour: their product; a black `Kd` beside a map counts as white |
//! | `map_d`, alpha of `map_Kd` | alpha; blended if most texels are neither opaque nor clear, else masked at a half, and two-sided, if anything is below it; 0 everywhere is drawn opaque with a warning |
//! | `d`, `Tr` | alpha, and blended over surfaces behind it, from 0 (exclusive) to 1; 0, which leaves nothing, is drawn opaque with a warning |
//! | `Ns`, `map_Ns` | shininess; perceptual roughness (2 / (Ns + 2))^(1/4), whose highlight is as wide; rough without `Ns` |
//! | `Pr`, `Pm`, `map_Pr`, `map_Pm` | roughness and metalness, which override `Ns`; metallic is 0 if they are missing |
//! | `Ks`, `map_Ks` | specular colour of the Phong models; F0 stays 0.04 whatever it is |
//! | `Ka` | ambient share of the Phong models: luminance of Ka over Kd |
//! | `Ke`, `map_Ke` | emitted radiance in nits; in a bare model, which stands in the sun, shares of the radiance that is drawn as white |
//! | `norm`, `bump`, `map_Bump` | normal map; +Y up, unless the maps' curl shows it to point down; any other picture is taken for heights; `-bm` scales both |
//! | `-s`, `-o` | texture coordinates, if all maps of the material agree |
//! | `-clamp on` | the edges of that map go on beyond it |
//!
//! `Kd`, `Ks` and `Ke` are taken as linear, as the format does not say. `illum`, `Ni`, `Tf` and `map_Ka` change nothing. A map that is missing or
//! cannot be read is left out with a warning, and the surface has the factors that it would have without the map.

mod colors;
mod ears;
mod geometry;
mod keywords;
mod maps;
mod materials;
mod mtl;
mod normal_maps;
mod normals;
mod numbers;
mod polygon;
mod scan;
mod sheets;
mod text;
mod tobj_text;

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use glam::{DAffine3, Vec3};

use self::geometry::{GroupMesh, ObjGeometry};
use self::materials::PendingMaterial;
use self::mtl::Definition;
use self::scan::Scan;
use super::{Error, Material, Object, TextureSlot};
pub use super::{Imported, LoadOptions, Progress};

/// Loads an OBJ file, the MTL files that it names and their textures.
///
/// # Errors
/// `Error::Read` for an OBJ that cannot be read; `Error::Content` for one without a triangle to draw, with the line of the first fault if
/// there is one. Materials and textures that cannot be read are left out with a warning.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Imported, Error> {
    let mut scan = scan::scan(path, &text::read(path)?)?;
    let mut warnings: Vec<String> =
        scan.warnings.iter().map(|warning| format!("{}: {warning}", path.display())).collect();
    let mut files = BTreeSet::from([path.to_owned()]);
    let pending = read_materials(path, &scan, &mut files, &mut warnings);
    let needs: Vec<_> = pending.iter().map(|one| one.needs).collect();
    let have_colors: Vec<bool> = pending.iter().map(|one| one.has_color).collect();

    // Decoding textures and building meshes take about as long, and neither waits for the other.
    let (finished, built) = rayon::join(
        || materials::finish(pending, options, &mut warnings),
        || {
            let parsed = geometry::parse(path, &std::mem::take(&mut scan.text))?;
            Ok(geometry::build(&scan, parsed, &needs, options))
        },
    );
    let ObjGeometry { groups, degenerate, fans } = built?;
    let (materials, textures) = finished;
    if degenerate > 0 {
        warnings.push(format!("{}: triangles without area ({degenerate}) are left out", path.display()));
    }
    warnings.extend(cut_as_fans(&scan, &fans).map(|what| format!("{}:{what}", path.display())));
    if groups.is_empty() {
        let what = format!("has no triangle with an area ({degenerate} without)");
        return Err(Error::Content { path: path.to_owned(), line: None, what });
    }
    let mut imported = Imported { materials, textures, warnings, ..Imported::default() };
    imported.files = files.into_iter().collect();
    let normals_given = groups.iter().all(|group| group.has_own_normals);
    let sheets: Vec<bool> = groups.iter().map(|group| group.is_sheet).collect();
    groups.into_iter().for_each(|group| place(&mut imported, &scan, group));
    if !scan.colors.is_empty() {
        decide_colors(&mut imported, path, &have_colors);
    }
    decide_sides(&mut imported, normals_given);
    part_sheets(&mut imported, &sheets);
    Ok(imported)
}

/// Names the polygons that crossed themselves so often that they were cut as fans.
fn cut_as_fans(scan: &Scan, fans: &[(usize, usize)]) -> Option<String> {
    let line = |&(part, corners): &(usize, usize)| {
        let found = scan.large.iter().find(|large| (large.0, large.1) == (part, corners));
        found.map(|&(.., line)| line)
    };
    let first = fans.iter().filter_map(line).min()?;
    let more = if fans.len() > 1 { format!(", and {} more such faces", fans.len() - 1) } else { String::new() };
    Some(format!("{first}: a face of many corners crosses itself, so that it may cover what lies beside it{more}"))
}

/// Gives faces that lie back to back one-sided materials. `sheets` tells for each object whether its faces do.
fn part_sheets(imported: &mut Imported, sheets: &[bool]) {
    let mut copies = HashMap::new();
    for (object, _) in imported.objects.iter_mut().zip(sheets).filter(|(_, is_sheet)| **is_sheet) {
        let material = &imported.materials[object.material];
        if material.two_sided {
            let copy = Material { two_sided: false, ..material.clone() };
            object.material = *copies.entry(object.material).or_insert_with(|| {
                imported.materials.push(copy);
                imported.materials.len() - 1
            });
        }
    }
}

/// Drops the vertex colours of textured materials, and makes a material without a `Kd` white, so that vertex colours show unchanged. `have_colors`
/// tells for each material whether it has a `Kd`.
fn decide_colors(imported: &mut Imported, path: &Path, have_colors: &[bool]) {
    let mut unused = 0;
    for object in &imported.objects {
        let (mesh, material) = (&mut imported.meshes[object.mesh], &mut imported.materials[object.material]);
        let is_white = mesh.colors.iter().all(|color| *color == [1.0; 4]);
        if material.texture(TextureSlot::BaseColor).is_some() {
            unused += if is_white { 0 } else { mesh.colors.len() };
            mesh.colors = Vec::new();
            continue;
        }
        if is_white {
            mesh.colors = Vec::new();
        }
        if !have_colors[object.material] {
            material.base_color = Vec3::ONE;
        }
    }
    if unused > 0 {
        let what = format!("vertex colours ({unused}) are not used beside textures of the colour");
        imported.warnings.push(format!("{}: {what}", path.display()));
    }
}

/// OBJ cannot mark a face as one-sided. If the file gives normals and nearly all faces are wound to agree with them, it was made with fronts in mind,
/// and back faces are culled. Any other file is drawn from both sides, and so are masked materials (leaves, chains).
fn decide_sides(imported: &mut Imported, normals_given: bool) {
    let mut faces = vec![(0_usize, 0_usize); imported.materials.len()];
    for object in &imported.objects {
        let (against, all) = &mut faces[object.material];
        *against += imported.meshes[object.mesh].faces_against_their_normals();
        *all += imported.meshes[object.mesh].indices.len() / 3;
    }
    for (material, (against, all)) in imported.materials.iter_mut().zip(faces) {
        material.two_sided = !normals_given || against * 100 > all || material.is_masked();
    }
}

/// Reads a material for each material that the OBJ uses, in the same order. Adds the MTL files and the texture files to `files`.
fn read_materials(
    path: &Path,
    scan: &Scan,
    files: &mut BTreeSet<PathBuf>,
    warnings: &mut Vec<String>,
) -> Vec<PendingMaterial> {
    let definitions = materials::read_libraries(path, &scan.libraries, warnings);
    files.extend(definitions.iter().map(|definition| definition.file.clone()));
    let mut by_name: HashMap<&str, usize> = HashMap::new();
    let mut again: Option<&Definition> = None;
    for (index, definition) in definitions.iter().enumerate() {
        if by_name.insert(&definition.name, index).is_some() {
            again.get_or_insert(definition);
        }
    }
    if let Some(Definition { name, file, .. }) = again {
        warnings.push(format!("{}: material `{name}` is defined again; its last definition is used", file.display()));
    }
    let roughly: HashMap<String, usize> =
        definitions.iter().enumerate().map(|(index, definition)| (plain_name(&definition.name), index)).collect();
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut pending = Vec::new();
    let mut undefined = Vec::new();
    for (name, line) in &scan.materials {
        let found = by_name.get(name.as_str()).or_else(|| roughly.get(&plain_name(name))).copied();
        pending.push(match found {
            Some(index) => {
                let definition = &definitions[index];
                // Names are relative to the MTL file, but some exporters make them relative to the OBJ.
                let folders = [definition.file.parent().unwrap_or(Path::new("")), folder];
                materials::read(definition, &folders, warnings)
            }
            None => {
                if !name.is_empty() {
                    undefined.push((name, line));
                }
                materials::plain(name)
            }
        });
    }
    let requests = pending.iter().flat_map(|one| &one.requests);
    files.extend(requests.flat_map(|(_, request)| request.sources()).map(|source| source.path.clone()));
    if let Some((name, line)) = undefined.first() {
        let others = if undefined.len() > 1 { format!(" and {} more", undefined.len() - 1) } else { String::new() };
        let verb = if undefined.len() > 1 { "are" } else { "is" };
        let what = format!("material `{name}`{others} {verb} not defined, drawn plain");
        warnings.push(format!("{}:{line}: {what}", path.display()));
    }
    pending
}

/// A material's name, without the differences that programs make between OBJ and MTL: case, quotes, runs of spaces, a comment after it.
fn plain_name(name: &str) -> String {
    let words = name.split_whitespace().take_while(|word| !word.starts_with('#'));
    words.collect::<Vec<_>>().join(" ").trim_matches('"').to_lowercase()
}

fn place(imported: &mut Imported, scan: &Scan, GroupMesh { group, material, mut mesh, .. }: GroupMesh) {
    if imported.materials[material].normal_texture.is_none() {
        // The bump map turned out not to be a normal map.
        mesh.tangents = Vec::new();
    }
    let object = Object::new(&scan.groups[group], imported.meshes.len(), material, DAffine3::IDENTITY);
    imported.objects.push(object);
    imported.meshes.push(mesh);
}
