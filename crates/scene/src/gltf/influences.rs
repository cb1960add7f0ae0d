//! Joints and weights of vertices.

use super::primitive::of_each;
use super::source::PrimitiveSource;
use crate::Influences;

/// The most joints of a vertex.
const MOST: usize = 8;

/// Reads which joints move the vertices of a primitive. If more than eight move a vertex, the eight heaviest count. Where it cannot be read, vertices hang on the first joint alone.
pub(super) fn read(
    source: &PrimitiveSource,
    vertices: usize,
    joints_of_skin: usize,
    warnings: &mut Vec<String>,
) -> Influences {
    let sets = sets(source, vertices, warnings);
    if sets.is_empty() {
        warnings.push("no joints or weights of its vertices can be read: it hangs on its skin's first joint".into());
        let own = |weight| [weight, 0.0, 0.0, 0.0];
        return Influences {
            per_vertex: 4,
            joints: vec![0; vertices * 4],
            weights: std::iter::repeat_n(own(1.0), vertices).flatten().collect(),
        };
    }
    let per_vertex = (4 * sets.len()).min(MOST);
    let (mut joints, mut weights) = (Vec::new(), Vec::new());
    joints.reserve_exact(vertices * per_vertex);
    weights.reserve_exact(vertices * per_vertex);
    let (mut is_odd, mut strange, mut cut) = (false, None, DroppedWeights::default());
    let mut own: Vec<(u32, f64)> = Vec::with_capacity(4 * sets.len());
    for vertex in 0..vertices {
        own.clear();
        let all = sets.iter().flat_map(|(numbers, shares)| numbers[vertex].into_iter().zip(shares[vertex]));
        own.extend(all.map(|(joint, weight)| (joint, f64::from(weight))));
        for (joint, weight) in &mut own {
            if *weight > 0.0 && *joint as usize >= joints_of_skin {
                strange.get_or_insert((vertex, *joint));
                *weight = 0.0;
            }
        }
        is_odd |= mend(&mut own);
        cut.keep_heaviest(&mut own, per_vertex, vertex);
        is_odd |= normalize(&mut own);
        for (joint, weight) in &own {
            // A joint without a weight may be any number.
            let is_there = *weight > 0.0 && (*joint as usize) < joints_of_skin;
            joints.push(u16::try_from(*joint).ok().filter(|_| is_there).unwrap_or(0));
            weights.push(*weight as f32);
        }
    }
    if let Some((vertex, joint)) = strange {
        let joint = if joint == u32::MAX { "of no number".to_owned() } else { joint.to_string() };
        let words = format!("vertex {vertex} hangs on joint {joint}, but its skin has {joints_of_skin} joints");
        warnings.push(format!("{words}: such weights are left out"));
    }
    if is_odd {
        warnings.push("weights of joints are negative, not finite or all 0, mended".into());
    }
    warnings.extend(cut.warning());
    Influences { per_vertex, joints, weights }
}

/// A set of four joints and weights for each vertex.
type Set = (Vec<[u32; 4]>, Vec<[f32; 4]>);

/// The sets that a primitive has and that move something.
fn sets(source: &PrimitiveSource, vertices: usize, warnings: &mut Vec<String>) -> Vec<Set> {
    let mut sets = Vec::new();
    for set in 0.. {
        let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
        if !source.has(&joints) && !source.has(&weights) {
            break;
        }
        let numbers = of_each(&joints, source.quadruples(&joints), vertices, warnings);
        let shares = of_each(&weights, source.floats::<4>(&weights, &["VEC4"], 0.0), vertices, warnings);
        if let Some((numbers, shares)) = numbers.zip(shares)
            && (set == 0 || shares.iter().flatten().any(|&weight| weight > 0.0))
        {
            sets.push((numbers, shares));
        }
    }
    // The first may be there without moving anything where others do.
    if sets.len() > 1 && !sets[0].1.iter().flatten().any(|&weight| weight > 0.0) {
        sets.remove(0);
    }
    sets
}

/// The weights that vertices lose to the limit of joints.
#[derive(Default)]
struct DroppedWeights {
    vertices: usize,
    /// The largest share of a vertex's weight, and the vertex.
    most: (f64, usize),
}

impl DroppedWeights {
    /// Keeps the heaviest joints of a vertex, in the order in which they are.
    fn keep_heaviest(&mut self, own: &mut Vec<(u32, f64)>, count: usize, vertex: usize) {
        if own.len() <= count {
            own.resize(count, (0, 0.0));
            return;
        }
        let all: f64 = own.iter().map(|(_, weight)| weight).sum();
        let mut order: Vec<usize> = (0..own.len()).collect();
        // Stable: of equal weights the first is kept.
        order.sort_by(|&a, &b| own[b].1.total_cmp(&own[a].1));
        order.truncate(count);
        order.sort_unstable();
        *own = order.into_iter().map(|index| own[index]).collect();
        let kept: f64 = own.iter().map(|(_, weight)| weight).sum();
        let lost = if all > 0.0 { 1.0 - kept / all } else { 0.0 };
        // Below that the difference is the sums' own rounding.
        if lost > 1e-12 {
            self.vertices += 1;
            if lost > self.most.0 {
                self.most = (lost, vertex);
            }
        }
    }

    fn warning(&self) -> Option<String> {
        let Self { vertices, most: (lost, vertex) } = *self;
        (vertices > 0).then(|| {
            let who = if vertices == 1 { "1 vertex hangs".to_owned() } else { format!("{vertices} vertices hang") };
            let words = format!("{who} on more than {MOST} joints, of which the heaviest move them");
            format!("{words}; vertex {vertex} loses the most, {:.1}% of its weight", lost * 100.0)
        })
    }
}

/// Makes weights that are none 0. Returns whether some were.
fn mend(own: &mut [(u32, f64)]) -> bool {
    let bad = own.iter_mut().filter(|(_, weight)| !(weight.is_finite() && *weight >= 0.0));
    bad.map(|(_, weight)| *weight = 0.0).count() > 0
}

/// Makes the weights of a vertex sum to 1, in f64: a sum of 0.98 moves a vertex half a metre at 24 m. Returns whether all were 0, which hangs the vertex
/// on the first.
fn normalize(own: &mut [(u32, f64)]) -> bool {
    let sum: f64 = own.iter().map(|(_, weight)| weight).sum();
    if sum > 0.0 {
        own.iter_mut().for_each(|(_, weight)| *weight /= sum);
        return false;
    }
    if let Some((_, weight)) = own.first_mut() {
        *weight = 1.0;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_whatever_they_were() {
        let of = |weights: [f64; 4]| {
            let mut own = weights.map(|weight| (3, weight));
            let is_odd = mend(&mut own) | normalize(&mut own);
            (own.map(|(_, weight)| weight), is_odd)
        };
        assert_eq!(of([0.49, 0.49, 0.0, 0.0]), ([0.5, 0.5, 0.0, 0.0], false));
        assert_eq!(of([0.0; 4]), ([1.0, 0.0, 0.0, 0.0], true));
        assert_eq!(of([f64::NAN, 2.0, -1.0, 2.0]), ([0.0, 0.5, 0.0, 0.5], true));
        let (weights, _) = of([1e-30, 1e-38, 3e-39, 0.0]);
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn of_twelve_joints_the_eight_heaviest_are_kept_in_their_order() {
        let mut own: Vec<(u32, f64)> = (0..12).map(|joint| (joint, 0.01)).collect();
        own[11].1 = 0.5;
        own[2].1 = 0.2;
        let mut cut = DroppedWeights::default();
        cut.keep_heaviest(&mut own, 8, 7);
        assert_eq!(own.iter().map(|(joint, _)| *joint).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6, 11]);
        normalize(&mut own);
        assert!((own[7].1 - 0.5 / 0.76).abs() < 1e-12, "{own:?}");
        assert!(cut.warning().unwrap().contains("vertex 7 loses the most, 5.0%"), "{:?}", cut.warning());
        // Joints without a weight are no loss.
        let mut own: Vec<(u32, f64)> = (0..12).map(|joint| (joint, f64::from(joint / 4) * 0.125)).collect();
        let mut cut = DroppedWeights::default();
        cut.keep_heaviest(&mut own, 8, 0);
        assert_eq!((own[0].0, cut.warning()), (4, None));
    }
}
