//! Primitive modes as lists of triangles (glTF 2.0, "Meshes").

/// The arrangement of a primitive's vertices, by its mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Topology {
    Points,
    Lines,
    Triangles,
    Strip,
    Fan,
}

impl Topology {
    pub fn of(mode: usize) -> Result<Self, String> {
        Ok(match mode {
            0 => Self::Points,
            1..=3 => Self::Lines,
            4 => Self::Triangles,
            5 => Self::Strip,
            6 => Self::Fan,
            other => return Err(format!("its mode is {other}, but there are only 0 to 6")),
        })
    }

    /// Three vertices a triangle, in the order that makes its front; vertices that are left over make none, and triangles with an index of no vertex are
    /// left out: the first such index is the oddity.
    pub fn triangles(self, order: Option<Vec<u32>>, vertices: usize) -> Result<(Vec<u32>, Option<String>), String> {
        let Ok(count) = u32::try_from(vertices) else { return Err(format!("it has {vertices} vertices")) };
        let order = order.unwrap_or_else(|| (0..count).collect());
        let last = order.iter().fold(0, |most, &index| most.max(index));
        if last < count {
            return Ok((self.of_run(order), None));
        }
        let is_wild = |index: &u32| *index >= count;
        let wild = order.iter().position(is_wild).map(|at| {
            let index = order[at];
            format!(
                "index {at} is {index}, but there are only {count} vertices: triangles with such indices are left out"
            )
        });
        let triangles = match self {
            Self::Points | Self::Lines => Vec::new(),
            Self::Triangles => {
                let whole = order.as_chunks::<3>().0.iter().filter(|corners| !corners.iter().any(is_wild));
                whole.flatten().copied().collect()
            }
            // A strip begins again after such an index, as with a device's primitive restart.
            Self::Strip => order.split(is_wild).flat_map(|run| self.of_run(run.to_vec())).collect(),
            // All of a fan's triangles have its first vertex.
            Self::Fan if order.first().is_some_and(is_wild) => Vec::new(),
            Self::Fan => {
                let triangles = self.of_run(order);
                let whole = triangles.as_chunks::<3>().0.iter().filter(|corners| !corners.iter().any(is_wild));
                whole.flatten().copied().collect()
            }
        };
        Ok((triangles, wild))
    }

    /// The triangles of indices that all exist.
    fn of_run(self, mut order: Vec<u32>) -> Vec<u32> {
        match self {
            Self::Points | Self::Lines => Vec::new(),
            Self::Triangles => {
                order.truncate(order.len() / 3 * 3);
                order
            }
            Self::Strip => order
                .windows(3)
                .enumerate()
                .flat_map(|(at, corners)| {
                    let [a, b, c] = [corners[0], corners[1], corners[2]];
                    if at % 2 == 0 { [a, b, c] } else { [a, c, b] }
                })
                .collect(),
            Self::Fan => {
                let first = order.first().copied().unwrap_or_default();
                order.windows(2).skip(1).flat_map(|edge| [edge[0], edge[1], first]).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mode_gives_the_triangles_of_the_specification() {
        let of = |mode, count| Topology::of(mode).unwrap().triangles(None, count).unwrap().0;
        assert_eq!(of(4, 7), [0, 1, 2, 3, 4, 5]);
        assert_eq!(of(5, 5), [0, 1, 2, 1, 3, 2, 2, 3, 4]);
        assert_eq!(of(6, 5), [1, 2, 0, 2, 3, 0, 3, 4, 0]);
        for mode in 0..7 {
            for count in 0..3 {
                assert!(of(mode, count).is_empty(), "{mode} {count}");
            }
        }
        assert!(Topology::of(7).is_err());
    }

    #[test]
    fn an_index_out_of_range_is_named_in_each_mode_and_takes_its_triangles_along() {
        let of = |mode, order: &[u32]| Topology::of(mode).unwrap().triangles(Some(order.to_vec()), 6).unwrap();
        for mode in 0..7 {
            let (_, odd) = of(mode, &[0, 1, 9, 2]);
            assert!(odd.unwrap().starts_with("index 2 is 9, but there are only 6 vertices"), "{mode}");
        }
        assert_eq!(of(4, &[0, 1, 9, 3, 4, 5, 0]).0, [3, 4, 5]);
        // The strip begins anew, so that the second run's first triangle keeps its order.
        assert_eq!(of(5, &[0, 1, 2, u32::MAX, 3, 4, 5]).0, [0, 1, 2, 3, 4, 5]);
        assert_eq!(of(6, &[0, 1, 2, 77, 3, 4]).0, [1, 2, 0, 3, 4, 0]);
        assert!(of(6, &[77, 1, 2, 3]).0.is_empty());
    }
}
