//! Wavefront OBJ and MTL, as real files have them.
//!
//! tobj parses; around it [`scan`](self) and its MTL twin check numbers and indices while their line is known and bring into
//! shape what tobj would refuse, misread or drop. A model that cannot be drawn is refused with file and line; one that can be drawn
//! without a part is drawn so, with a warning.
//!
//! **Geometry.** Positions are read as f64 and recentred by mesh, one mesh for each group and material. Polygons are cut, also
//! concave ones. Missing normals follow smoothing groups; a file without any gets edges above 60 degrees hard and all others
//! smooth. Tangents are made where a material has a normal map. V is turned over, so that (0, 0) is the image's upper left.
//! Points, lines, free-form surfaces and vertex colours are not drawn.
//!
//! **Materials.** MTL describes Phong's model, Afterlight's default is metallic-roughness. Both are filled:
//!
//! | MTL | becomes |
//! |---|---|
//! | `Kd`, `map_Kd` | base colour: their product; a black `Kd` beside a map counts as white |
//! | `map_d`, alpha of `map_Kd` | alpha; masked at a half, and two-sided, if anything is below it |
//! | `d`, `Tr` | alpha, and blended over what lies behind, from 0 (exclusive) to 1; 0, which leaves nothing, is drawn opaque with a warning |
//! | `Ns`, `map_Ns` | shininess; perceptual roughness (2 / (Ns + 2))^(1/4), whose highlight is as wide; rough without `Ns` |
//! | `Pr`, `Pm`, `map_Pr`, `map_Pm` | roughness and metalness, before what `Ns` says; 0 metallic without |
//! | `Ks`, `map_Ks` | specular colour of the Phong models; F0 stays 0.04 whatever it is |
//! | `Ka` | ambient share of the Phong models: luminance of Ka over Kd |
//! | `Ke`, `map_Ke` | emitted radiance in nits |
//! | `norm`, `bump`, `map_Bump` | normal map; +Y up, unless the maps' curl shows it to point down; any other picture is taken for heights; `-bm` scales both |
//! | `-s`, `-o` | texture coordinates, if all maps of the material agree |
//!
//! All colours are taken as linear, as the format does not say. `illum`, `Ni`, `Tf` and `map_Ka` change nothing.

mod geometry;
mod maps;
mod materials;
mod mtl;
mod normal_maps;
mod normals;
mod polygon;
mod scan;
mod text;

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use glam::DAffine3;

use self::geometry::Group;
use self::materials::PendingMaterial;
use self::scan::Scan;
use super::{Error, Object};
pub use super::{Imported, LoadOptions, Progress};

/// Loads an OBJ file, the MTL files that it names and their textures.
///
/// # Errors
/// `Error::Read` for a file that is there but cannot be read (of files that are named but missing only the OBJ itself is an
/// error); `Error::Content`, with the line where there is one, for what the module's documentation calls wrong, for a texture
/// that is no image, and for a file without a triangle to draw.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Imported, Error> {
    let mut scan = scan::scan(path, &text::read(path)?)?;
    let mut warnings: Vec<String> =
        scan.warnings.iter().map(|warning| format!("{}: {warning}", path.display())).collect();
    let mut files = BTreeSet::from([path.to_owned()]);
    let pending = read_materials(path, &scan, &mut files, &mut warnings)?;
    let needs: Vec<_> = pending.iter().map(|one| one.needs).collect();

    // Decoding textures and building meshes take about as long, and neither waits for the other.
    let (finished, built) = rayon::join(
        || materials::finish(pending, options, &mut warnings),
        || {
            let parsed = geometry::parse(path, &std::mem::take(&mut scan.text))?;
            Ok(geometry::build(&scan, parsed, &needs, options))
        },
    );
    let (groups, degenerate) = built?;
    let (materials, textures) = finished?;
    if degenerate > 0 {
        warnings.push(format!("{}: triangles without area ({degenerate}) are left out", path.display()));
    }
    if groups.is_empty() {
        let what = format!("has no triangle with an area ({degenerate} without)");
        return Err(Error::Content { path: path.to_owned(), line: None, what });
    }
    let mut imported = Imported { materials, textures, warnings, ..Imported::default() };
    imported.files = files.into_iter().collect();
    groups.into_iter().for_each(|group| place(&mut imported, &scan, group));
    decide_sides(&mut imported, scan.parts.iter().all(|part| part.has_normals));
    Ok(imported)
}

/// OBJ cannot say that a face is one-sided. If the file gives normals and nearly all faces are wound to agree with them, it was made with
/// fronts in mind, and backs are left out; any other file is drawn from both sides, as are sheets with holes (leaves, chains).
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

/// A material for each material that the OBJ uses, in its order. Adds the files that they come from, and those of their textures.
fn read_materials(
    path: &Path,
    scan: &Scan,
    files: &mut BTreeSet<PathBuf>,
    warnings: &mut Vec<String>,
) -> Result<Vec<PendingMaterial>, Error> {
    let definitions = materials::read_libraries(path, &scan.libraries, warnings)?;
    files.extend(definitions.iter().map(|definition| definition.file.clone()));
    let by_name: HashMap<&str, usize> = definitions.iter().enumerate().map(|(i, d)| (d.name.as_str(), i)).collect();
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut pending = Vec::new();
    let mut undefined = Vec::new();
    for (name, line) in &scan.materials {
        let ignoring_case = || definitions.iter().position(|d| d.name.eq_ignore_ascii_case(name));
        let found = by_name.get(name.as_str()).copied().or_else(ignoring_case);
        pending.push(match found {
            Some(index) => {
                let definition = &definitions[index];
                // Names are relative to the MTL; some exporters mean the OBJ.
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
    Ok(pending)
}

fn place(imported: &mut Imported, scan: &Scan, Group { group, material, mut mesh }: Group) {
    if imported.materials[material].normal_texture.is_none() {
        // Its bump map turned out to be none.
        mesh.tangents = Vec::new();
    }
    let object = Object::new(&scan.groups[group], imported.meshes.len(), material, DAffine3::IDENTITY);
    imported.objects.push(object);
    imported.meshes.push(mesh);
}
