//! Wavefront OBJ and MTL.

mod geometry;
mod normals;
mod polygon;
mod scan;
mod text;

use std::path::Path;

use glam::DAffine3;

use super::{Error, Material, Object};
pub use super::{Imported, LoadOptions};

/// Loads a model.
pub fn load(path: &Path, _options: &LoadOptions) -> Result<Imported, Error> {
    let t0 = std::time::Instant::now();
    let text = text::read(path)?;
    eprintln!("read {:?}", t0.elapsed());
    let mut scan = scan::scan(path, &text)?;
    drop(text);
    eprintln!("scan {:?}", t0.elapsed());
    let needs = vec![geometry::MaterialNeeds { tangents: true, ..Default::default() }; scan.materials.len()];
    let parsed = geometry::parse(path, &std::mem::take(&mut scan.text))?;
    eprintln!("tobj {:?}", t0.elapsed());
    let (groups, degenerate) = geometry::build(&scan, parsed, &needs);
    eprintln!("build {:?}", t0.elapsed());
    let mut imported = Imported::default();
    if degenerate > 0 {
        scan.warnings.push(format!("{degenerate} triangles without area are left out"));
    }
    for group in groups {
        imported.objects.push(Object {
            name: scan.groups[group.group].clone(),
            mesh: imported.meshes.len(),
            material: group.material,
            transform: DAffine3::IDENTITY,
        });
        imported.meshes.push(group.mesh);
    }
    imported.materials =
        scan.materials.iter().map(|(name, _)| Material { name: name.clone(), ..Material::default() }).collect();
    imported.warnings = scan.warnings.iter().map(|warning| format!("{}: {warning}", path.display())).collect();
    Ok(imported)
}
