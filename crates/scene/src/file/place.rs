//! Transforms: translation, rotation, scale.

use glam::{DAffine3, DQuat, DVec3, EulerRot};

use super::node::{COORDINATE, FACTOR, KeyedValue, Table};
use super::schema;
use crate::{Error, Placement};

/// Scales first, then rotates, then moves.
pub(super) fn transform(table: &Table) -> Result<DAffine3, Error> {
    let translation = table.read("translation", KeyedValue::point)?.unwrap_or(DVec3::ZERO);
    let rotation = table.read("rotation", rotation)?.unwrap_or(DQuat::IDENTITY);
    let scale = table.read("scale", scale)?.unwrap_or(DVec3::ONE);
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

/// Reads a placement's parts, for clips to move.
pub(super) fn placement(table: &Table) -> Result<Placement, Error> {
    Ok(Placement {
        translation: table.read("translation", KeyedValue::point)?.unwrap_or(DVec3::ZERO),
        rotation: table.read("rotation", rotation)?.unwrap_or(DQuat::IDENTITY),
        scale: table.read("scale", scale)?.unwrap_or(DVec3::ONE),
    })
}

/// One factor or three; negative ones mirror.
pub(super) fn scale(node: &KeyedValue) -> Result<DVec3, Error> {
    let scale =
        if node.is_number() { DVec3::splat(node.number(FACTOR)?) } else { node.numbers(FACTOR, "[x, y, z]")?.into() };
    if scale.abs().min_element() < 1e-12 {
        return Err(node.wrong("must not be 0 (nor nearer to it than 1e-12)"));
    }
    Ok(scale)
}

/// `[x, y, z]` in degrees about the fixed axes, X first; or a quaternion; or an axis and an angle.
pub(super) fn rotation(node: &KeyedValue) -> Result<DQuat, Error> {
    if !node.is_table() {
        let [x, y, z] = node.numbers(COORDINATE, "[x, y, z] in degrees, or a table")?.map(f64::to_radians);
        return Ok(DQuat::from_euler(EulerRot::ZYX, z, y, x));
    }
    let table = node.table(schema::ROTATION)?;
    match (table.get("quaternion"), table.get("axis"), table.get("degrees")) {
        (Some(quaternion), None, None) => {
            let parts = quaternion.numbers::<4>(COORDINATE, "[x, y, z, w]")?;
            let rotation = DQuat::from_array(parts);
            if rotation.length() < 1e-12 {
                return Err(quaternion.wrong("must not be zero"));
            }
            // One that has been written already is read as it was, to the last bit.
            let is_unit = (rotation.length_squared() - 1.0).abs() < 1e-14;
            Ok(if is_unit { rotation } else { rotation.normalize() })
        }
        (None, Some(axis), Some(degrees)) => {
            Ok(DQuat::from_axis_angle(axis.direction()?, degrees.number(COORDINATE)?.to_radians()))
        }
        _ => Err(node.wrong("must have either quaternion, or axis and degrees")),
    }
}
