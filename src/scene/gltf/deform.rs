//! Meshes as they are where nothing moves them: shapes blended in, and hung on joints that stand still. All in f64.

use glam::{DAffine3, DMat3, DVec3, DVec4, Vec3};

use crate::scene::Mesh;

/// Blends a mesh's shapes in for good (glTF 2.0, "Morph Targets").
pub(super) fn blend(mesh: &mut Mesh, weights: &[f64]) {
    let morphs = std::mem::take(&mut mesh.morphs);
    let shapes: Vec<_> = morphs.iter().zip(weights).filter(|(_, weight)| **weight != 0.0).collect();
    for (shape, weight) in shapes {
        add(&mut mesh.positions, &shape.positions, *weight);
        add(&mut mesh.normals, &shape.normals, *weight);
        add(&mut mesh.uvs, &shape.uvs, *weight);
        add(&mut mesh.colors, &shape.colors, *weight);
        for (tangent, more) in mesh.tangents.iter_mut().zip(&shape.tangents) {
            for (number, more) in tangent.iter_mut().zip(more) {
                *number = (f64::from(*number) + weight * f64::from(*more)) as f32;
            }
        }
    }
    for color in mesh.colors.as_flattened_mut() {
        *color = color.clamp(0.0, 1.0);
    }
    mesh.normals.iter_mut().for_each(|normal| *normal = unit(*normal));
    for tangent in &mut mesh.tangents {
        let [x, y, z] = unit([tangent[0], tangent[1], tangent[2]]);
        *tangent = [x, y, z, tangent[3]];
    }
}

fn add<const N: usize>(values: &mut [[f32; N]], more: &[[f32; N]], weight: f64) {
    for (value, more) in values.iter_mut().zip(more) {
        for (number, more) in value.iter_mut().zip(more) {
            *number = (f64::from(*number) + weight * f64::from(*more)) as f32;
        }
    }
}

fn unit(vector: [f32; 3]) -> [f32; 3] {
    Vec3::from(vector).as_dvec3().normalize_or(DVec3::Y).as_vec3().to_array()
}

/// Hangs a mesh on joints for good; `pose` leads from mesh space to the world by joint (glTF 2.0, "Skins").
pub(super) fn pose(mesh: &mut Mesh, pose: &[DAffine3]) {
    let Some(influences) = mesh.influences.take() else { return };
    let count = influences.per_vertex;
    let mut points = Vec::with_capacity(mesh.positions.len());
    for (vertex, (joints, weights)) in
        influences.joints.chunks_exact(count).zip(influences.weights.chunks_exact(count)).enumerate()
    {
        let sum: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
        let blended = joints.iter().zip(weights).fold([DVec4::ZERO; 3], |rows, (&joint, &weight)| {
            let matrix = pose.get(usize::from(joint)).copied().unwrap_or(DAffine3::IDENTITY);
            let share = f64::from(weight) / sum;
            let own = [0, 1, 2].map(|row| matrix.matrix3.row(row).extend(matrix.translation[row]) * share);
            [rows[0] + own[0], rows[1] + own[1], rows[2] + own[2]]
        });
        let place = mesh.origin + Vec3::from(mesh.positions[vertex]).as_dvec3();
        points.push(DVec3::from_array(blended.map(|row| row.dot(place.extend(1.0)))));
        let turned = DMat3::from_cols(blended[0].truncate(), blended[1].truncate(), blended[2].truncate()).transpose();
        if let Some(normal) = mesh.normals.get_mut(vertex) {
            *normal = of_cofactors(turned, *normal);
        }
        if let Some(tangent) = mesh.tangents.get_mut(vertex) {
            let along = turned * Vec3::new(tangent[0], tangent[1], tangent[2]).as_dvec3();
            let sign = tangent[3] * if turned.determinant() < 0.0 { -1.0 } else { 1.0 };
            *tangent = along.normalize_or(DVec3::X).as_vec3().extend(sign).to_array();
        }
    }
    let posed = Mesh::from_points("", &points);
    (mesh.origin, mesh.positions) = (posed.origin, posed.positions);
}

/// A normal under a matrix: by its cofactors, which turn as the inverse's transpose does and exist where that does not.
fn of_cofactors(matrix: DMat3, normal: [f32; 3]) -> [f32; 3] {
    let [a, b, c] = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    let cofactors = DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b));
    let turned = (cofactors * Vec3::from(normal).as_dvec3()).try_normalize();
    let flipped = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
    turned.map_or(normal, |turned| (turned * flipped).as_vec3().to_array())
}
