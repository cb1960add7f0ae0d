//! Joints and weights of vertices.

use super::source::Source;
use crate::scene::Influences;

/// Sets of four that are read.
const SETS: usize = 2;

/// Reads what joints move the vertices of a primitive; none where it does not say.
pub(super) fn read(
    source: &Source,
    vertices: usize,
    joints_of_skin: usize,
    warnings: &mut Vec<&'static str>,
) -> Result<Option<Influences>, String> {
    let mut sets = Vec::new();
    for set in 0..=SETS {
        let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
        let found = source.quadruples(&joints)?.zip(source.floats::<4>(&weights, &["VEC4"], 0.0)?);
        let Some((numbers, shares)) = found else { break };
        if numbers.len() != vertices || shares.len() != vertices {
            let (a, b) = (numbers.len(), shares.len());
            return Err(format!("{joints} has {a} and {weights} {b} elements, but POSITION has {vertices}"));
        }
        if set == SETS {
            warnings.push("vertices hang on more than 8 joints, of which the first 8 move them");
        } else if set == 0 || shares.iter().flatten().any(|&weight| weight > 0.0) {
            sets.push((numbers, shares));
        }
    }
    if sets.is_empty() {
        return Ok(None);
    }
    let per_vertex = 4 * sets.len();
    let (mut joints, mut weights) = (Vec::new(), Vec::new());
    joints.reserve_exact(vertices * per_vertex);
    weights.reserve_exact(vertices * per_vertex);
    let mut is_odd = false;
    for vertex in 0..vertices {
        let own = sets.iter().flat_map(|(numbers, shares)| numbers[vertex].into_iter().zip(shares[vertex]));
        let mut own: [(u32, f64); 4 * SETS] = filled(own.map(|(joint, weight)| (joint, f64::from(weight))));
        is_odd |= normalize(&mut own);
        for (joint, weight) in &own[..per_vertex] {
            // A joint without a weight may be any number.
            let joint = if *weight > 0.0 { *joint } else { 0 };
            let number = u16::try_from(joint).ok().filter(|&number| usize::from(number) < joints_of_skin);
            joints.push(number.ok_or_else(|| {
                format!("vertex {vertex} hangs on joint {joint}, but its skin has {joints_of_skin} joints")
            })?);
            weights.push(*weight as f32);
        }
    }
    if is_odd {
        warnings.push("weights of joints are negative, not finite or all 0, mended");
    }
    Ok(Some(Influences { per_vertex, joints, weights }))
}

fn filled<T: Copy + Default, const N: usize>(values: impl Iterator<Item = T>) -> [T; N] {
    let mut array = [T::default(); N];
    array.iter_mut().zip(values).for_each(|(place, value)| *place = value);
    array
}

/// Makes the weights of a vertex sum to 1, in f64: a sum of 0.98 moves a vertex half a metre at 24 m. Returns whether some were no weights.
fn normalize(own: &mut [(u32, f64)]) -> bool {
    let mut is_odd = false;
    for (_, weight) in own.iter_mut() {
        if !(weight.is_finite() && *weight >= 0.0) {
            (*weight, is_odd) = (0.0, true);
        }
    }
    let sum: f64 = own.iter().map(|(_, weight)| weight).sum();
    if sum > 0.0 {
        own.iter_mut().for_each(|(_, weight)| *weight /= sum);
    } else if let Some((_, weight)) = own.first_mut() {
        (*weight, is_odd) = (1.0, true);
    }
    is_odd
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_whatever_they_were() {
        let of = |weights: [f64; 4]| {
            let mut own = weights.map(|weight| (3, weight));
            let is_odd = normalize(&mut own);
            (own.map(|(_, weight)| weight), is_odd)
        };
        assert_eq!(of([0.49, 0.49, 0.0, 0.0]), ([0.5, 0.5, 0.0, 0.0], false));
        assert_eq!(of([0.0; 4]), ([1.0, 0.0, 0.0, 0.0], true));
        assert_eq!(of([f64::NAN, 2.0, -1.0, 2.0]), ([0.0, 0.5, 0.0, 0.5], true));
        let (weights, _) = of([1e-30, 1e-38, 3e-39, 0.0]);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
}
