//! Normals and tangents of any length, as shaders get them.
//!
//! A device may take denormal numbers for 0, and where products overflow a direction is lost as well. So lengths far from 1 are brought near it, by
//! powers of two: that changes no bit of a direction.

use std::borrow::Cow;

use crate::scene::Mesh;

/// The normals of a mesh, all of them by one factor: a normal's length is its share between vertices.
pub fn normals(mesh: &Mesh) -> Cow<'_, [[f32; 3]]> {
    let scale = normal_scale(mesh);
    if scale == 1.0 {
        return mesh.normals.as_slice().into();
    }
    mesh.normals.iter().map(|normal| normal.map(|axis| scaled(axis, scale))).collect()
}

/// The tangents of a mesh, each scaled so that products of its numbers neither overflow nor vanish. Shaders normalize them, so no picture changes.
pub fn tangents(mesh: &Mesh) -> Cow<'_, [[f32; 4]]> {
    if mesh.tangents.iter().all(|tangent| tangent_scale(tangent) == 1.0) {
        return mesh.tangents.as_slice().into();
    }
    let one = |&[x, y, z, sign]: &[f32; 4]| {
        let scale = tangent_scale(&[x, y, z, sign]);
        let [x, y, z] = [x, y, z].map(|axis| scaled(axis, scale));
        [x, y, z, sign]
    };
    mesh.tangents.iter().map(one).collect()
}

/// The offsets that a shape adds to the normals, by the factor of these normals.
pub fn normal_offsets<'a>(mesh: &Mesh, offsets: &'a [[f32; 3]]) -> Cow<'a, [[f32; 3]]> {
    let scale = normal_scale(mesh);
    by(offsets, |_| scale)
}

/// The offsets that a shape adds to the tangents, each by the factor of its tangent.
pub fn tangent_offsets<'a>(mesh: &Mesh, offsets: &'a [[f32; 3]]) -> Cow<'a, [[f32; 3]]> {
    by(offsets, |vertex| mesh.tangents.get(vertex).map_or(1.0, tangent_scale))
}

fn by(offsets: &[[f32; 3]], scale: impl Fn(usize) -> f64) -> Cow<'_, [[f32; 3]]> {
    if (0..offsets.len()).all(|vertex| scale(vertex) == 1.0) {
        return offsets.into();
    }
    let one = |(vertex, offset): (usize, &[f32; 3])| offset.map(|axis| scaled(axis, scale(vertex)));
    offsets.iter().enumerate().map(one).collect()
}

fn normal_scale(mesh: &Mesh) -> f64 {
    scale_of(mesh.normals.as_flattened())
}

fn tangent_scale([x, y, z, _]: &[f32; 4]) -> f64 {
    scale_of(&[*x, *y, *z])
}

/// The power of two that brings the largest axis to 1..2; 1 for zeros, and for axes up to 1/2..2, as unit vectors have them.
fn scale_of(axes: &[f32]) -> f64 {
    let largest = f64::from(axes.iter().fold(0.0f32, |most, axis| most.max(axis.abs())));
    if largest == 0.0 || !largest.is_finite() || (0.5..=2.0).contains(&largest) {
        return 1.0;
    }
    (-largest.log2().floor()).exp2()
}

/// Multiplies in f64, since the factor of 1e-45, 2^149, is more than f32 holds.
fn scaled(axis: f32, scale: f64) -> f32 {
    (f64::from(axis) * scale) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Morph;

    fn mesh(normals: &[[f32; 3]], tangents: &[[f32; 4]]) -> Mesh {
        Mesh { normals: normals.to_vec(), tangents: tangents.to_vec(), ..Mesh::default() }
    }

    #[test]
    fn normals_of_unusual_lengths_are_scaled_all_alike() {
        let usual = [[0.0, 1.0, 0.5], [1e-30, 0.0, 0.0]];
        assert!(matches!(normals(&mesh(&usual, &[])), Cow::Borrowed(own) if own == usual));
        assert!(normals(&mesh(&[], &[])).is_empty());
        for length in [f32::MAX, 1e20, 3.0, 0.25, 1e-20, 1e-40, 1e-44] {
            let odd = mesh(&[[length, 0.0, 0.0], [0.0, length / 4.0, -length / 8.0]], &[]);
            let near = normals(&odd);
            assert!((1.0..=2.0).contains(&near[0][0]), "{length}: {near:?}");
            // Scales are powers of two, so ratios stay exact.
            let share = f64::from(length / 4.0) / f64::from(length);
            assert_eq!(f64::from(near[1][1]), f64::from(near[0][0]) * share, "{length}");
        }
    }

    #[test]
    fn each_tangent_is_scaled_by_itself_and_keeps_its_sign() {
        let own = [[1e-40, 0.0, 0.0, -1.0], [0.0, 0.6, 0.8, 1.0], [0.0, 0.0, 0.0, 1.0], [-1e30, 0.0, 1e29, 1.0]];
        let odd = mesh(&[], &own);
        let near = tangents(&odd);
        for (tangent, before) in near.iter().zip(own) {
            let largest = tangent[..3].iter().fold(0.0f32, |most, axis| most.max(axis.abs()));
            assert!(largest == 0.0 || (0.5..=2.0).contains(&largest), "{tangent:?}");
            assert_eq!(tangent[3], before[3]);
        }
        assert_eq!((near[1], near[2]), (own[1], own[2]));
        assert_eq!(f64::from(near[3][2]) / f64::from(near[3][0]), f64::from(own[3][2]) / f64::from(own[3][0]));
        assert!(matches!(tangents(&mesh(&[], &own[1..3])), Cow::Borrowed(_)));
    }

    #[test]
    fn what_shapes_add_is_scaled_as_what_it_is_added_to() {
        let odd = mesh(&[[4.0, 0.0, 0.0]; 2], &[[8.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]]);
        let shape = Morph { normals: vec![[0.0, 4.0, 0.0]; 2], tangents: vec![[0.0, 8.0, 0.0]; 2], ..Morph::default() };
        assert_eq!(*normal_offsets(&odd, &shape.normals), [[0.0, 1.0, 0.0]; 2]);
        assert_eq!(*tangent_offsets(&odd, &shape.tangents), [[0.0, 1.0, 0.0], [0.0, 8.0, 0.0]]);
    }
}
