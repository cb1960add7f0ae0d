//! Transforms of nodes, written with the fewest numbers that keep them exact.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use nalgebra::{Matrix3, SVD};
use serde_json::{Value, json};

/// The cosine of the smallest deviation from a right angle at which axes count as skewed. Validators allow 5e-5.
const SKEWED: f64 = 1e-6;

/// The JSON keys of a node's transform in its parent, as one node or as two nested ones.
pub(super) enum Placing {
    One(Value),
    Two(Value, Value),
}

/// Returns the keys of a transform. A pure translation is written as a translation, a transform that keeps axes square as a matrix. A node's matrix
/// must not be skewed (glTF 2.0, "Transformations"), so a skewed transform takes two nodes: a rotation in a scale in a rotation.
pub(super) fn placing(transform: &DAffine3) -> Placing {
    let DAffine3 { matrix3, translation } = *transform;
    if matrix3 == DMat3::IDENTITY {
        return Placing::One(translated(translation));
    }
    let [x, y, z] = [matrix3.x_axis, matrix3.y_axis, matrix3.z_axis];
    let skewed = |a: DVec3, b: DVec3| (a.dot(b)).abs() > SKEWED * a.length() * b.length();
    if matrix3.determinant() != 0.0 && !skewed(x, y) && !skewed(y, z) && !skewed(z, x) {
        return Placing::One(json!({ "matrix": DMat4::from(*transform).to_cols_array() }));
    }
    let (outer, scale, inner) = singular_values(&matrix3);
    let mut parent = translated(translation);
    (parent["rotation"], parent["scale"]) = (json!(outer.to_array()), json!(scale.to_array()));
    Placing::Two(parent, json!({ "rotation": inner.to_array() }))
}

/// A position, and the rotation that turns -Z to a direction.
pub(super) fn aimed(place: DVec3, direction: DVec3) -> Value {
    turned(place, DQuat::from_rotation_arc(DVec3::NEG_Z, direction))
}

/// A position and a rotation of length 1.
pub(super) fn turned(place: DVec3, rotation: DQuat) -> Value {
    let mut keys = translated(place);
    if rotation != DQuat::IDENTITY {
        keys["rotation"] = json!(rotation.to_array());
    }
    keys
}

fn translated(place: DVec3) -> Value {
    if place == DVec3::ZERO { json!({}) } else { json!({ "translation": place.to_array() }) }
}

/// Decomposes a linear map into a rotation in a scale in a rotation, with signs that make both rotations proper.
fn singular_values(matrix: &DMat3) -> (DQuat, DVec3, DQuat) {
    let columns = matrix.to_cols_array();
    // Normalized by its largest element: squares of very large or small numbers would overflow or underflow.
    let size = columns.iter().fold(0.0f64, |most, value| most.max(value.abs())).max(f64::MIN_POSITIVE);
    let SVD { u, v_t, singular_values } =
        Matrix3::from_column_slice(&columns.map(|value| value / size)).svd(true, true);
    let of = |found: Option<Matrix3<f64>>| found.map_or(DMat3::IDENTITY, |own| DMat3::from_cols_slice(own.as_slice()));
    let (outer, inner) = (of(u), of(v_t));
    let sign = |own: &DMat3| own.determinant().signum();
    let scale = DVec3::from_slice(singular_values.as_slice()) * (size * sign(&outer) * sign(&inner));
    let rotation = |own: DMat3| DQuat::from_mat3(&(own * sign(&own))).normalize();
    (rotation(outer), scale, rotation(inner))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(keys: &Value) -> DAffine3 {
        let list = |key: &str| keys[key].as_array().map(|own| own.iter().map(|own| own.as_f64().unwrap()).collect());
        if let Some(matrix) = list("matrix") {
            let matrix: Vec<f64> = matrix;
            return DAffine3::from_mat4(DMat4::from_cols_slice(&matrix));
        }
        let (scale, rotation): (Option<Vec<f64>>, Option<Vec<f64>>) = (list("scale"), list("rotation"));
        let translation: Option<Vec<f64>> = list("translation");
        DAffine3::from_scale_rotation_translation(
            scale.map_or(DVec3::ONE, |own| DVec3::from_slice(&own)),
            rotation.map_or(DQuat::IDENTITY, |own| DQuat::from_slice(&own)),
            translation.map_or(DVec3::ZERO, |own| DVec3::from_slice(&own)),
        )
    }

    #[test]
    fn transforms_are_said_without_loss_and_skewed_ones_by_two_nodes() {
        let turn = DAffine3::from_quat(DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1));
        let scale = |x: f64, y: f64, z: f64| DAffine3::from_scale(DVec3::new(x, y, z));
        let moved = DAffine3::from_translation(DVec3::new(0.1, -7.0, 3e5));
        let plain = [DAffine3::IDENTITY, moved, moved * turn * scale(2.0, 3.0, -0.5), turn * scale(1e-9, 1e-9, 1e-9)];
        for transform in plain {
            let Placing::One(keys) = placing(&transform) else { panic!("{transform}") };
            assert_eq!(read(&keys), transform);
        }
        let skewed = [scale(1.0, 3.0, 1.0) * turn, moved * scale(-1.0, 2.0, 5.0) * turn, turn * scale(1.0, 0.0, 2.0)];
        for transform in skewed {
            let Placing::Two(outer, inner) = placing(&transform) else { panic!("{transform}") };
            let found = read(&outer) * read(&inner);
            let size = transform.matrix3.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
            assert!(found.abs_diff_eq(transform, 1e-14 * size), "{found} {transform}");
        }
    }
}
