//! Pictures of hazards, drawn on purpose. A driver seldom shows a missing dependency, so its reader is given content that it could have found: the
//! draws of the pass that it should have waited for are left out, kept in every second tile, or made from the camera of an earlier frame.
//!
//! A simulated frame is ordered as any other. Each of its commands is one that some frame records, and it has all rows unless they are dropped
//! besides, so that a validation layer has nothing to say about it. The crate `afterlight-proof` decides which passes show a missing row.

use std::fmt;

use glam::DQuat;

use super::rows::{Endpoint, RowName};
use crate::passes::Tile;
use crate::plan::FramePlan;
use crate::scene::Camera;

/// The content that a reader finds where nothing makes it wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum HazardPicture {
    /// The content of the last frame.
    Stale,
    /// Every second tile is not drawn yet.
    Torn,
    /// Nothing is drawn yet: the attachments have the values that they are cleared to.
    Cleared,
}

impl HazardPicture {
    /// All of them, by the names that `afterlight view --hazard` takes.
    pub const NAMES: &'static [(&'static str, Self)] =
        &[("stale", Self::Stale), ("torn", Self::Torn), ("cleared", Self::Cleared)];
}

impl fmt::Display for HazardPicture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let own = Self::NAMES.iter().find(|(_, own)| own == self);
        f.pad(own.map_or("", |(name, _)| name))
    }
}

/// Degrees by which the camera turns from the last frame to a simulated one: a quick look to the side at 30 frames a second. The fault is hard to see
/// in a still picture at 2 degrees.
const TURN_DEGREES: f64 = 4.0;

/// Tiles of a torn attachment, across and down: large enough to be seen, and few enough to record a pass once for each.
const TILES: [u32; 2] = [8, 6];

/// A row that seems to be missing, and the picture of its hazard.
#[derive(Debug, Clone, Copy)]
pub struct MissingRow {
    /// The row.
    pub name: RowName,
    /// The content that its readers find.
    pub how: HazardPicture,
    /// Decides how frames of a plan show it; `None` where no such picture would be honest. The function is `afterlight_proof::simulation::simulation`.
    pub decide: fn(&FramePlan, RowName, HazardPicture) -> Option<Simulation>,
}

impl MissingRow {
    /// Decides how frames of a plan show it.
    pub(super) fn simulation(&self, plan: &FramePlan) -> Option<Simulation> {
        (self.decide)(plan, self.name, self.how)
    }
}

/// Compares rows and pictures, and no functions.
impl PartialEq for MissingRow {
    fn eq(&self, other: &Self) -> bool {
        (self.name, self.how) == (other.name, other.how)
    }
}

/// A hazard that frames show.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// The row that seems to be missing.
    pub missing: MissingRow,
    /// The pass for which nothing waits.
    pub producer: Endpoint,
    /// The passes that read too early.
    pub readers: Vec<Endpoint>,
    /// The producer and the passes whose results it reads: all of them are drawn as the last frame drew them where the result is stale.
    pub earlier: Vec<Endpoint>,
}

impl Simulation {
    /// Returns true if frames need the data of an earlier camera.
    pub(super) fn is_stale(&self) -> bool {
        self.missing.how == HazardPicture::Stale
    }

    /// Returns true if the passes at a place are drawn as the last frame drew them.
    pub(super) fn is_earlier(&self, place: Endpoint) -> bool {
        self.is_stale() && self.earlier.contains(&place)
    }

    /// The tiles that the passes at a place draw; `None` for all of the attachment.
    pub fn tiles(&self, place: Endpoint) -> Option<Vec<Tile>> {
        let is_own = place == self.producer;
        match self.missing.how {
            HazardPicture::Cleared if is_own => Some(Vec::new()),
            HazardPicture::Torn if is_own => {
                let [across, down] = TILES;
                let all = (0..down).flat_map(|y| (0..across).map(move |x| [x, y]));
                Some(all.filter(|[x, y]| (x + y).is_multiple_of(2)).map(|at| Tile { at, of: TILES }).collect())
            }
            _ => None,
        }
    }
}

/// As the window labels it.
impl fmt::Display for Simulation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { missing: MissingRow { name, how, .. }, producer, readers, .. } = self;
        let read = if readers.len() == 1 { "reads" } else { "read" };
        let readers = readers.iter().map(Endpoint::to_string).collect::<Vec<_>>().join(" and ");
        write!(f, "simulation of a missing {name}, {how}: {readers} {read} ")?;
        match how {
            HazardPicture::Stale => write!(
                f,
                "what {producer} wrote in the last frame, as if the camera had turned by {TURN_DEGREES} degrees since"
            ),
            HazardPicture::Torn => write!(f, "before {producer} has drawn, in every second tile"),
            HazardPicture::Cleared => write!(f, "before {producer} has drawn"),
        }
    }
}

/// The camera of the last frame, by which stale content is drawn. It is another one than this frame's also while the camera rests: without motion
/// the last frame's content is the right one, and nothing would be seen.
pub(super) fn earlier_camera(camera: &Camera) -> Camera {
    let turn = DQuat::from_axis_angle(camera.up(), TURN_DEGREES.to_radians());
    Camera { rotation: turn * camera.rotation, ..*camera }
}
