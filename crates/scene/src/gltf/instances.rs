//! EXT_mesh_gpu_instancing.

use glam::{DAffine3, DQuat, DVec3};

use super::accessor::Accessors;
use super::drawables::MOST_OBJECTS;
use super::json::Whole;
use super::json_extensions::GpuInstancing;
use crate::check::fits;

/// Reads the transforms of copies in their node. Attributes that cannot be read and copies that stand nowhere are left out.
///
/// # Errors
/// More copies than are read.
pub(super) fn read(
    json: &GpuInstancing,
    accessors: &Accessors,
    warnings: &mut Vec<String>,
) -> Result<Vec<DAffine3>, String> {
    let mut read = |semantic: &str, read: &dyn Fn(Whole) -> Result<Numbers, String>| {
        let numbers = json.attributes.get(semantic).map(|&accessor| read(accessor))?;
        numbers.map_err(|what| warnings.push(format!("instances: {semantic}: {what}: left out"))).ok()
    };
    let three = |accessor| accessors.numbers::<3>(accessor, &["VEC3"]).map(wide);
    let four = |accessor| accessors.numbers::<4>(accessor, &["VEC4"]).map(wide);
    let lists = [read("TRANSLATION", &three), read("ROTATION", &four), read("SCALE", &three)];
    let counts = || lists.iter().flatten().map(Vec::len);
    let (count, most) = (counts().min().unwrap_or(1), counts().max().unwrap_or(1));
    if count != most {
        warnings.push(format!("its instances have attributes of different counts: the first {count} are read"));
    }
    if count > MOST_OBJECTS {
        return Err(format!("makes {count} objects, but at most {MOST_OBJECTS} are read"));
    }
    let place = |index: usize| {
        let [translation, rotation, scale] = &lists;
        let of = |list: &Option<Numbers>, without: [f64; 4]| list.as_ref().map_or(without, |list| list[index]);
        let vector = |[x, y, z, _]: [f64; 4]| DVec3::new(x, y, z);
        let rotation = DQuat::from_array(of(rotation, [0.0, 0.0, 0.0, 1.0]));
        // One that is 0 turns nothing.
        let rotation = if rotation.length() > 1e-12 { rotation.normalize() } else { DQuat::IDENTITY };
        let (scale, translation) = (vector(of(scale, [1.0; 4])), vector(of(translation, [0.0; 4])));
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    };
    let mut places: Vec<DAffine3> = (0..count).map(place).collect();
    if let Some(index) = places.iter().position(|place| !fits(place)) {
        warnings.push(format!("the transform of instance {index} is not finite: such instances are left out"));
        places.retain(fits);
    }
    Ok(places)
}

type Numbers = Vec<[f64; 4]>;

fn wide<const N: usize>(numbers: Vec<[f64; N]>) -> Numbers {
    numbers.into_iter().map(|own| std::array::from_fn(|index| own.get(index).copied().unwrap_or_default())).collect()
}
