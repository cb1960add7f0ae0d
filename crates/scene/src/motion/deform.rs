//! A mesh as shapes and joints deform it, in f64: the reference for frames on a device.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::{Influences, Morph};
use crate::Mesh;

/// The mesh with `weights[i]` of its i-th shape, hung on `joints`, one matrix for each joint of its skin from mesh space to the space of the
/// result (see [`Pose::joint_matrices`](super::Pose::joint_matrices)), or on none. The result is a plain mesh: nothing deforms it further.
///
/// Shapes are added first, then joints are blended linearly with weights that are divided by their sum in f64. Normals follow the cofactors of
/// the blended matrix and tangents the matrix itself; both have a length of 1 again. The result is recentred, so that it is as precise far from
/// the origin as at it. A shape that the mesh has no weight for counts nothing, and neither does a joint without a matrix.
pub fn deform(mesh: &Mesh, weights: &[f64], joints: Option<&[DAffine3]>) -> Mesh {
    let shapes: Vec<(&Morph, f64)> = mesh.morphs.iter().zip(weights.iter().copied()).collect();
    let blend = |vertex| match (joints, &mesh.influences) {
        (Some(joints), Some(influences)) => blended(influences, joints, vertex),
        _ => DAffine3::IDENTITY,
    };
    let mut points = Vec::with_capacity(mesh.positions.len());
    let mut normals = Vec::with_capacity(mesh.normals.len());
    let mut tangents = Vec::with_capacity(mesh.tangents.len());
    for (vertex, &position) in mesh.positions.iter().enumerate() {
        let matrix = blend(vertex);
        let place = mesh.origin + Vec3::from(position).as_dvec3() + offset(&shapes, |own| &own.positions, vertex);
        points.push(matrix.transform_point3(place));
        if let Some(&normal) = mesh.normals.get(vertex) {
            let normal = Vec3::from(normal).as_dvec3() + offset(&shapes, |own| &own.normals, vertex);
            normals.push(unit(cofactors(&matrix.matrix3) * normal, mesh.normals[vertex]));
        }
        if let Some(&[x, y, z, sign]) = mesh.tangents.get(vertex) {
            let tangent = Vec3::new(x, y, z).as_dvec3() + offset(&shapes, |own| &own.tangents, vertex);
            let [a, b, c] = unit(matrix.transform_vector3(tangent), [x, y, z]);
            tangents.push([a, b, c, sign]);
        }
    }
    let mut deformed = Mesh::from_points(mesh.name.clone(), &points);
    deformed.normals = normals;
    deformed.tangents = tangents;
    deformed.uvs = added(&mesh.uvs, &shapes, |own| &own.uvs);
    deformed.uvs_1 = mesh.uvs_1.clone();
    deformed.colors = added(&mesh.colors, &shapes, |own| &own.colors);
    if shapes.iter().any(|(shape, _)| !shape.colors.is_empty()) {
        // glTF 2.0, "Morph Targets": colours are clamped once the shapes are added.
        deformed.colors.as_flattened_mut().iter_mut().for_each(|value| *value = value.clamp(0.0, 1.0));
    }
    deformed.indices = mesh.indices.clone();
    deformed.is_strokes = mesh.is_strokes;
    deformed
}

/// The space that a mesh on these joints is deformed in, so that its fronts stay fronts: mirrored where they mirror. It is its own inverse.
pub fn deform_frame(joints: &[DAffine3]) -> DAffine3 {
    let mirrors = joints.first().is_some_and(|joint| joint.matrix3.determinant() < 0.0);
    DAffine3::from_scale(DVec3::new(if mirrors { -1.0 } else { 1.0 }, 1.0, 1.0))
}

/// Returns the offset that shapes add to a vertex.
fn offset(shapes: &[(&Morph, f64)], list: impl Fn(&Morph) -> &Vec<[f32; 3]>, vertex: usize) -> DVec3 {
    let own =
        |(shape, weight): &(&Morph, f64)| list(shape).get(vertex).map(|&value| Vec3::from(value).as_dvec3() * *weight);
    shapes.iter().filter_map(own).sum()
}

/// Values with the offsets of shapes.
fn added<const N: usize>(
    values: &[[f32; N]],
    shapes: &[(&Morph, f64)],
    list: impl Fn(&Morph) -> &Vec<[f32; N]>,
) -> Vec<[f32; N]> {
    let mut sums = values.to_vec();
    for (vertex, sum) in sums.iter_mut().enumerate() {
        for (axis, sum) in sum.iter_mut().enumerate() {
            let own = |(shape, weight): &(&Morph, f64)| Some(f64::from(list(shape).get(vertex)?[axis]) * weight);
            let more: f64 = shapes.iter().filter_map(own).sum();
            *sum = (f64::from(*sum) + more) as f32;
        }
    }
    sums
}

/// The weighted mean of the matrices of a vertex's joints. A vertex whose weights are all 0 follows its first joint alone.
fn blended(influences: &Influences, joints: &[DAffine3], vertex: usize) -> DAffine3 {
    let own = vertex * influences.per_vertex..(vertex + 1) * influences.per_vertex;
    let (Some(indices), Some(weights)) = (influences.joints.get(own.clone()), influences.weights.get(own)) else {
        return DAffine3::IDENTITY;
    };
    let of = |index: u16| joints.get(usize::from(index)).copied().unwrap_or(DAffine3::IDENTITY);
    let sum: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
    if sum.is_nan() || sum <= 0.0 {
        return indices.first().map_or(DAffine3::IDENTITY, |&index| of(index));
    }
    let mut columns = [0.0; 12];
    for (&index, &weight) in indices.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let share = f64::from(weight) / sum;
        columns.iter_mut().zip(of(index).to_cols_array()).for_each(|(sum, value)| *sum += share * value);
    }
    DAffine3::from_cols_array(&columns)
}

/// The cofactor matrix, which maps cross products: (M a) x (M b) = cofactors(M) (a x b). A normal transformed by it stays on the side from which its
/// triangle is counter-clockwise, and nothing is divided by a determinant that may be 0.
fn cofactors(matrix: &DMat3) -> DMat3 {
    let DMat3 { x_axis, y_axis, z_axis } = *matrix;
    DMat3::from_cols(y_axis.cross(z_axis), z_axis.cross(x_axis), x_axis.cross(y_axis))
}

/// Scales a direction to a length of 1; returns `fallback` for a zero vector.
fn unit(direction: DVec3, fallback: [f32; 3]) -> [f32; 3] {
    let largest = direction.abs().max_element();
    // Squares of the components may overflow or underflow f64.
    (direction / largest).try_normalize().map_or(fallback, |unit| unit.as_vec3().to_array())
}
