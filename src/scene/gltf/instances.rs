//! EXT_mesh_gpu_instancing.

use glam::{DAffine3, DQuat, DVec3};

use super::accessor::Accessors;
use super::drawables::MOST_OBJECTS;
use super::json_extensions::Instances;
use crate::scene::check::fits;

/// Reads the transforms of copies in their node.
pub(super) fn read(json: &Instances, accessors: &Accessors) -> Result<Vec<DAffine3>, String> {
    let within = |semantic: &str, what: String| format!("instances: {semantic}: {what}");
    let three = |semantic: &str| {
        let accessor = json.attributes.get(semantic);
        let read = accessor.map(|&accessor| accessors.numbers::<3>(accessor, &["VEC3"])).transpose();
        read.map_err(|what| within(semantic, what))
    };
    let (translations, scales) = (three("TRANSLATION")?, three("SCALE")?);
    let rotations = json.attributes.get("ROTATION").map(|&accessor| accessors.numbers::<4>(accessor, &["VEC4"]));
    let rotations = rotations.transpose().map_err(|what| within("ROTATION", what))?;
    let counts = [translations.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
    let count = counts.into_iter().flatten().max().unwrap_or(1);
    if counts.into_iter().flatten().any(|own| own != count) {
        return Err("its instances have attributes of different counts".into());
    }
    if count > MOST_OBJECTS {
        return Err(format!("makes {count} objects, but at most {MOST_OBJECTS} are read"));
    }
    let place = |index: usize| {
        let vector =
            |list: &Option<Vec<[f64; 3]>>, without| list.as_ref().map_or(without, |list| DVec3::from(list[index]));
        let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |list| DQuat::from_array(list[index]));
        // One that is 0 turns nothing.
        let rotation = if rotation.length() > 1e-12 { rotation.normalize() } else { DQuat::IDENTITY };
        let (scale, translation) = (vector(&scales, DVec3::ONE), vector(&translations, DVec3::ZERO));
        let place = DAffine3::from_scale_rotation_translation(scale, rotation, translation);
        if fits(&place) { Ok(place) } else { Err(format!("the transform of instance {index} is not finite")) }
    };
    (0..count).map(place).collect()
}
