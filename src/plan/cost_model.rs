//! A cost model of frames on a device, by which `auto` chooses between ways to the same picture.
//!
//! A calibration (`afterlight doctor --calibrate`) measures its figures. Without one, a device has the figures of its kind, measured in the same way
//! on one such device (but for culling on CPUs, whose cost is too small to measure).
//!
//! A device's figures choose among light paths with bit-identical pictures, and whether the device culls, which changes no bit either. Visibility
//! numbers in place of a G-buffer change the last digits of the picture, so only a calibration that somebody asked for may choose them: a device's
//! pictures must not change because a window was once opened on it.

use crate::scene::LightPath;

/// The origin of the figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// Measured on another device of the same kind, named here.
    Kind(&'static str),
    /// A calibration that ran by itself.
    Unasked,
    /// A calibration that somebody asked for.
    Asked,
}

/// The cost of a frame with one light path, GEOMETRY included, in picoseconds a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct PathCost {
    /// The cost without lights, for surfaces that fill the picture.
    pub base: u32,
    /// Added for each triangle of the scene, in picoseconds.
    pub triangle: u32,
    /// Added once a pixel if some light has a limited reach.
    pub lists: u32,
    /// More for each light that reaches everywhere.
    pub unlimited: u32,
    /// More for each light of limited reach. On average 1.8 such lights reach a place, however many the scene has.
    pub limited: u32,
}

impl PathCost {
    /// Returns a frame's time in picoseconds.
    // ANCHOR: path-cost
    fn of(self, load: &Load) -> u64 {
        let times = |count: u64, each: u32| count.saturating_mul(u64::from(each));
        let lists = if load.limited > 0 { self.lists } else { 0 };
        let of_pixel = [times(load.unlimited, self.unlimited), times(load.limited, self.limited), u64::from(lists)];
        let of_pixel = of_pixel.into_iter().fold(u64::from(self.base), u64::saturating_add);
        of_pixel.saturating_mul(load.pixels).saturating_add(times(load.triangles, self.triangle))
    }
    // ANCHOR_END: path-cost
}

/// The load of a frame, as far as its cost depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    /// Pixels of the picture.
    pub pixels: u64,
    /// Triangles of all objects.
    pub triangles: u64,
    /// Lights that reach everywhere.
    pub unlimited: u64,
    /// Lights of limited reach.
    pub limited: u64,
}

/// The cost of culling in nanoseconds: the CPU's recording, and the additional time of frames on a device that culls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct CullingCost {
    /// The cost of an object where the CPU culls.
    pub cpu_object: u32,
    /// The cost of a frame where the device culls, whatever it holds.
    pub device_frame: u32,
    /// The cost of an object where the device culls.
    pub device_object: u32,
}

impl CullingCost {
    /// Objects from which on a device culls by itself, as it is done sooner; `usize::MAX` where it never is.
    pub fn many_objects(&self) -> usize {
        match self.cpu_object.saturating_sub(self.device_object) {
            0 => usize::MAX,
            saved => (self.device_frame.div_ceil(saved) as usize).max(FEWEST_CULLED),
        }
    }
}

/// Below, no measurement tells the two ways to cull apart.
const FEWEST_CULLED: usize = 256;

/// The light paths that `auto` chooses among by their cost.
pub const COMPARED: [LightPath; 4] = [LightPath::Loop, LightPath::Clustered, LightPath::Compute, LightPath::Visibility];

/// The figures of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CostModel {
    /// The origin of the figures.
    pub basis: Basis,
    /// One entry for each of [`COMPARED`]; [`ABSENT`] is never cheapest.
    pub paths: [PathCost; COMPARED.len()],
    /// The cost of both ways to cull.
    pub culling: CullingCost,
}

/// Stands for a path that a device does not have, or that could not be measured.
pub const ABSENT: PathCost = PathCost { base: u32::MAX, triangle: 0, lists: 0, unlimited: 0, limited: 0 };

impl CostModel {
    /// Stands for GPUs that were not measured.
    pub const GPU: Self = Self {
        basis: Basis::Kind("an NVIDIA H200"),
        paths: [
            PathCost { base: 674, triangle: 633, lists: 0, unlimited: 80, limited: 32 },
            PathCost { base: 674, triangle: 633, lists: 115, unlimited: 80, limited: 3 },
            PathCost { base: 410, triangle: 633, lists: 0, unlimited: 3, limited: 0 },
            PathCost { base: 263, triangle: 818, lists: 0, unlimited: 3, limited: 0 },
        ],
        // With these figures the device culls from 4256 objects on.
        culling: CullingCost { cpu_object: 99, device_frame: 400_000, device_object: 5 },
    };

    /// Stands for CPUs that were not measured.
    pub const CPU: Self = Self {
        basis: Basis::Kind("lavapipe of Mesa 25.0"),
        // ANCHOR: cpu-paths
        paths: [
            PathCost { base: 65_300, triangle: 65_500, lists: 0, unlimited: 2650, limited: 950 },
            PathCost { base: 65_300, triangle: 65_500, lists: 3800, unlimited: 2650, limited: 276 },
            PathCost { base: 113_000, triangle: 66_000, lists: 140_000, unlimited: 4150, limited: 420 },
            PathCost { base: 208_000, triangle: 161_000, lists: 277_000, unlimited: 4400, limited: 770 },
        ],
        // ANCHOR_END: cpu-paths
        // From 4348 objects on; more than that is not told apart by measuring.
        culling: CullingCost { cpu_object: 570, device_frame: 2_000_000, device_object: 110 },
    };

    /// Returns the figures for a device that was not measured.
    pub fn of_kind(software: bool) -> Self {
        if software { Self::CPU } else { Self::GPU }
    }

    /// Returns a frame's time by one of [`COMPARED`], in picoseconds.
    pub fn of(&self, path: LightPath, load: &Load) -> Option<u64> {
        let cost = self.paths[COMPARED.iter().position(|compared| *compared == path)?];
        (cost != ABSENT).then(|| cost.of(load))
    }

    /// The first of the cheapest of these paths.
    pub fn cheapest(&self, paths: impl IntoIterator<Item = LightPath>, load: &Load) -> Option<LightPath> {
        let costs = paths.into_iter().filter_map(|path| Some((path, self.of(path, load)?)));
        costs.min_by_key(|&(_, cost)| cost).map(|(path, _)| path)
    }

    /// Returns the device whose figures these are, for a sentence.
    pub fn whose(&self) -> &'static str {
        match self.basis {
            Basis::Kind(name) => name,
            Basis::Unasked | Basis::Asked => "this device",
        }
    }

    /// The figures by which a choice is made that the picture shows.
    pub fn of_pictures(&self, software: bool) -> Self {
        match self.basis {
            Basis::Unasked => Self::of_kind(software),
            Basis::Kind(_) | Basis::Asked => *self,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_costs_what_pixels_lights_and_triangles_do_and_lists_only_with_some() {
        let cost = PathCost { base: 100, triangle: 9, lists: 30, unlimited: 7, limited: 2 };
        let load = |pixels, triangles, unlimited, limited| Load { pixels, triangles, unlimited, limited };
        assert_eq!((cost.of(&load(1, 0, 0, 0)), cost.of(&load(2, 0, 3, 0))), (100, 242));
        assert_eq!(cost.of(&load(10, 100, 3, 10)), 1710 + 900);
        assert_eq!(PathCost { unlimited: u32::MAX, ..cost }.of(&load(1 << 30, 1, u64::MAX, 0)), u64::MAX);
        let absent = CostModel { paths: [ABSENT; COMPARED.len()], ..CostModel::GPU };
        assert_eq!(absent.cheapest(COMPARED, &load(1, 1, 1, 1)), None);
        assert_eq!(CostModel::GPU.of(LightPath::Forward, &load(1, 1, 1, 1)), None);
    }

    #[test]
    fn a_device_culls_from_where_it_is_done_sooner() {
        let cost = CullingCost { cpu_object: 100, device_frame: 1_000_000, device_object: 20 };
        assert_eq!(cost.many_objects(), 12_500);
        let many = 12_500;
        assert!(many * 100 >= 1_000_000 + many * 20 && (many - 1) * 100 < 1_000_000 + (many - 1) * 20);
        assert_eq!(CullingCost { device_frame: 0, ..cost }.many_objects(), FEWEST_CULLED);
        assert_eq!(CullingCost { device_object: 100, ..cost }.many_objects(), usize::MAX);
    }
}
