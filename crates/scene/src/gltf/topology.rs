//! Primitive modes as lists of triangles, or of the two ends of lines (glTF 2.0, "Meshes").

/// The arrangement of a primitive's vertices, by its mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Topology {
    Points,
    Lines,
    LineLoop,
    LineStrip,
    Triangles,
    Strip,
    Fan,
}

impl Topology {
    pub fn of(mode: usize) -> Result<Self, String> {
        Ok(match mode {
            0 => Self::Points,
            1 => Self::Lines,
            2 => Self::LineLoop,
            3 => Self::LineStrip,
            4 => Self::Triangles,
            5 => Self::Strip,
            6 => Self::Fan,
            other => return Err(format!("its mode is {other}, but there are only 0 to 6")),
        })
    }

    /// Returns true for points and lines.
    pub fn is_strokes(self) -> bool {
        matches!(self, Self::Points | Self::Lines | Self::LineLoop | Self::LineStrip)
    }

    /// Returns three vertices for each triangle, in the order that makes its front; two for each line; the same vertex twice for each point. Surplus
    /// vertices are ignored. Triangles and lines with an invalid index are left out; the second result is a warning about the first invalid index.
    pub fn corners(self, order: Option<Vec<u32>>, vertices: usize) -> Result<(Vec<u32>, Option<String>), String> {
        let Ok(count) = u32::try_from(vertices) else { return Err(format!("it has {vertices} vertices")) };
        let order = order.unwrap_or_else(|| (0..count).collect());
        let last = order.iter().fold(0, |most, &index| most.max(index));
        if last < count {
            return Ok((self.of_run(order), None));
        }
        let is_wild = |index: &u32| *index >= count;
        let what = match self {
            Self::Points => "points",
            Self::Lines | Self::LineLoop | Self::LineStrip => "lines",
            Self::Triangles | Self::Strip | Self::Fan => "triangles",
        };
        let wild = order.iter().position(is_wild).map(|at| {
            let index = order[at];
            format!("index {at} is {index}, but there are only {count} vertices: {what} with such indices are left out")
        });
        let corners = match self {
            // An invalid index ends a strip, as primitive restart does on a device.
            Self::Strip | Self::LineStrip => order.split(is_wild).flat_map(|run| self.of_run(run.to_vec())).collect(),
            // All of a fan's triangles share its first vertex.
            Self::Fan if order.first().is_some_and(is_wild) => Vec::new(),
            Self::Triangles | Self::Fan => whole::<3>(&self.of_run(order), is_wild),
            Self::Points | Self::Lines | Self::LineLoop => whole::<2>(&self.of_run(order), is_wild),
        };
        Ok((corners, wild))
    }

    /// The corners for indices that are all valid.
    fn of_run(self, mut order: Vec<u32>) -> Vec<u32> {
        match self {
            Self::Points => order.iter().flat_map(|&vertex| [vertex; 2]).collect(),
            Self::Lines => {
                order.truncate(order.len() / 2 * 2);
                order
            }
            Self::LineStrip => order.windows(2).flatten().copied().collect(),
            Self::LineLoop => {
                // A loop of two vertices gets no closing line, which would repeat the first one.
                let closing = if order.len() > 2 { [order[order.len() - 1], order[0]].to_vec() } else { Vec::new() };
                Self::LineStrip.of_run(order).into_iter().chain(closing).collect()
            }
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

/// The primitives of `N` corners whose indices are all valid.
fn whole<const N: usize>(corners: &[u32], is_wild: impl Fn(&u32) -> bool) -> Vec<u32> {
    corners.as_chunks::<N>().0.iter().filter(|own| !own.iter().any(&is_wild)).flatten().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mode_gives_the_corners_of_the_specification() {
        let of = |mode, count| Topology::of(mode).unwrap().corners(None, count).unwrap().0;
        assert_eq!(of(0, 3), [0, 0, 1, 1, 2, 2]);
        assert_eq!(of(1, 5), [0, 1, 2, 3]);
        assert_eq!(of(2, 4), [0, 1, 1, 2, 2, 3, 3, 0]);
        assert_eq!(of(2, 2), [0, 1]);
        assert_eq!(of(3, 4), [0, 1, 1, 2, 2, 3]);
        assert_eq!(of(4, 7), [0, 1, 2, 3, 4, 5]);
        assert_eq!(of(5, 5), [0, 1, 2, 1, 3, 2, 2, 3, 4]);
        assert_eq!(of(6, 5), [1, 2, 0, 2, 3, 0, 3, 4, 0]);
        for mode in 0..7 {
            let least = [1, 2, 2, 2, 3, 3, 3][mode];
            for count in 0..least {
                assert!(of(mode, count).is_empty(), "{mode} {count}");
            }
            let topology = Topology::of(mode).unwrap();
            assert_eq!(of(mode, least).len(), if topology.is_strokes() { 2 } else { 3 }, "{mode}");
        }
        assert!(Topology::of(7).is_err());
    }

    #[test]
    fn an_index_out_of_range_is_named_in_each_mode_and_takes_its_triangles_along() {
        let of = |mode, order: &[u32]| Topology::of(mode).unwrap().corners(Some(order.to_vec()), 6).unwrap();
        for (mode, what) in (0..7).zip(["points", "lines", "lines", "lines", "triangles", "triangles", "triangles"]) {
            let odd = of(mode, &[0, 1, 9, 2]).1.unwrap();
            assert!(odd.starts_with("index 2 is 9, but there are only 6 vertices"), "{mode}");
            assert!(odd.ends_with(&format!(": {what} with such indices are left out")), "{mode}");
        }
        assert_eq!(of(0, &[0, 9, 2]).0, [0, 0, 2, 2]);
        assert_eq!(of(1, &[0, 9, 2, 3, 4, 77]).0, [2, 3]);
        // The loop still closes.
        assert_eq!(of(2, &[0, 1, 9, 2, 3]).0, [0, 1, 2, 3, 3, 0]);
        assert_eq!(of(3, &[0, 1, 2, u32::MAX, 3, 4]).0, [0, 1, 1, 2, 3, 4]);
        assert_eq!(of(4, &[0, 1, 9, 3, 4, 5, 0]).0, [3, 4, 5]);
        // The strip restarts, so the second run's first triangle keeps its winding.
        assert_eq!(of(5, &[0, 1, 2, u32::MAX, 3, 4, 5]).0, [0, 1, 2, 3, 4, 5]);
        assert_eq!(of(6, &[0, 1, 2, 77, 3, 4]).0, [1, 2, 0, 3, 4, 0]);
        assert!(of(6, &[77, 1, 2, 3]).0.is_empty());
    }
}
