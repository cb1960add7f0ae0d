//! Pictures of hazards, drawn on purpose. A driver seldom shows a missing dependency, so its reader is given content that it could have found: the
//! draws of the pass that it should have waited for are left out, kept in every second tile, or made from the camera of an earlier frame.
//!
//! A simulated frame is ordered as any other. Each of its commands is one that some frame records, and it has all rows unless they are dropped
//! besides, so that a validation layer has nothing to say about it.

use std::fmt;

use glam::DQuat;

use super::list::{Step, StepList};
use super::rows::{self, PassName, Row, RowName, Rows};
use crate::passes::{ContentsIfFirst, ONCE, Resource, ResourceUse, Tile, UseKind};
use crate::plan::FramePlan;
use crate::scene::Camera;

/// The content that a reader finds where nothing makes it wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum HazardPicture {
    /// The content of the last frame.
    Stale,
    /// In every second tile nothing is drawn yet.
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

/// The reason why a row has no such picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no picture: {0}")]
pub struct NoPicture(String);

/// Degrees by which the camera turns from the last frame to a simulated one: a quick look to the side at 30 frames a second. By 2 degrees the fault is
/// hard to see in a picture that rests.
const TURN_DEGREES: f64 = 4.0;

/// Tiles of a torn attachment, across and down: large enough to be seen, and few enough to record a pass once for each.
const TILES: [u32; 2] = [8, 6];

/// A hazard that frames show.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Simulation {
    row: RowName,
    /// The pass for which nothing waits.
    producer: PassName,
    readers: Vec<PassName>,
    /// The producer and the passes whose results it reads: all of them are drawn as the last frame drew them where the result is stale.
    earlier: Vec<PassName>,
    how: HazardPicture,
}

/// A subpass, or a pass outside of render passes, of a plan's frames.
struct Stop {
    place: PassName,
    touches: Vec<ResourceUse>,
    /// It is a subpass, so that its draws can be clipped to tiles.
    draws: bool,
    draws_maps: bool,
}

impl Simulation {
    /// Decides how frames of a plan show that a row is missing.
    ///
    /// # Errors
    /// When no such picture would be honest, with the reason.
    pub fn of(plan: &FramePlan, name: RowName, how: HazardPicture) -> Result<Self, NoPicture> {
        let rows = rows::table(plan);
        let row = rows.find(name).ok_or_else(|| NoPicture(format!("these frames have no row {name}")))?;
        let stops = Stop::all(plan);
        let find = |place: PassName| stops.iter().find(|stop| stop.place == place);
        let producer = find(row.from).ok_or_else(|| NoPicture(why_no_producer(row)))?;
        let readers: Vec<_> =
            waiting(row).filter(|&place| find(place).is_some_and(|own| own.reads_of(producer, row))).collect();
        let Some(&reader) = readers.first() else { return Err(NoPicture(why_no_reader(row, find(row.to)))) };
        if let Some((other, by)) = other_reader(&rows, &stops, (producer, name), &readers) {
            return Err(NoPicture(format!("{other} would find the same, though it waits by the row {by}")));
        }
        let mut earlier = vec![producer.place];
        match how {
            HazardPicture::Torn | HazardPicture::Cleared => producer.check_left_out(&stops).map_err(NoPicture)?,
            HazardPicture::Stale if producer.draws_maps => {
                return Err(NoPicture(format!(
                    "only the camera differs from the last frame's, and the maps that {reader} reads do not depend on it"
                )));
            }
            HazardPicture::Stale => earlier = sources(&rows, &stops, producer, name).map_err(NoPicture)?,
        }
        Ok(Self { row: name, producer: producer.place, readers, earlier, how })
    }

    /// The row that seems to be missing, and the content that its readers find.
    pub fn hazard(&self) -> (RowName, HazardPicture) {
        (self.row, self.how)
    }

    /// Returns true if frames need the data of an earlier camera.
    pub(super) fn is_stale(&self) -> bool {
        self.how == HazardPicture::Stale
    }

    /// Returns true if the passes at a place are drawn as the last frame drew them.
    pub(super) fn is_earlier(&self, place: PassName) -> bool {
        self.is_stale() && self.earlier.contains(&place)
    }

    /// The tiles that the passes at a place draw; `None` for all of the attachment.
    pub(super) fn tiles(&self, place: PassName) -> Option<Vec<Tile>> {
        let is_own = place == self.producer;
        match self.how {
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
        let Self { producer, readers, .. } = self;
        let read = if readers.len() == 1 { "reads" } else { "read" };
        let readers = readers.iter().map(PassName::to_string).collect::<Vec<_>>().join(" and ");
        write!(f, "simulation of a missing {}, {}: {readers} {read} ", self.row, self.how)?;
        match self.how {
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

impl Stop {
    /// The stops of a plan's frames up to the picture, in their order.
    fn all(plan: &FramePlan) -> Vec<Self> {
        let mut all = Vec::new();
        for step in StepList::of(plan).0 {
            match step {
                Step::RenderPass(name, subpasses) => all.extend(subpasses.into_iter().map(|own| Self {
                    place: own.place,
                    touches: own.touches,
                    draws: true,
                    draws_maps: name.draws_maps(),
                })),
                // Those after the picture are recorded beside the renderer's own part of a frame.
                Step::Commands(own) if own.pass.make.is_some() => {
                    let touches = own.pass.uses(plan);
                    all.push(Self { place: own.pass.place, touches, draws: false, draws_maps: false });
                }
                Step::Commands(_) | Step::Presentation | Step::HandOver(_) => {}
            }
        }
        all
    }

    fn writes(&self, resource: Resource) -> bool {
        self.touches.iter().any(|own| own.resource == resource && own.writes())
    }

    fn reads(&self, resource: Resource) -> bool {
        let has_read = |own: &&ResourceUse| own.uses.access != own.uses.writes().access;
        self.touches.iter().filter(|own| own.resource == resource).any(|own| has_read(&own))
    }

    /// Returns true if it reads something that `producer` writes and the row is about. Rows that are written by hand name no resources.
    fn reads_of(&self, producer: &Self, row: &Row) -> bool {
        let is_about = |resource| row.resources.is_empty() || row.resources.contains(&resource);
        let mut written = producer.touches.iter().map(|own| own.resource);
        written.any(|resource| is_about(resource) && producer.writes(resource) && self.reads(resource))
    }

    /// Checks that its draws can be left out: then each pixel has defined content, or its depth says that nothing was drawn there.
    fn check_left_out(&self, stops: &[Self]) -> Result<(), String> {
        if !self.draws {
            return Err(format!("{} is no draw, which could be left out of a tile", self.place));
        }
        let is_first = |own: &ResourceUse| {
            let mut users = stops.iter().filter(|stop| stop.touches.iter().any(|other| other.resource == own.resource));
            users.next().is_some_and(|stop| stop.place == self.place)
        };
        let first_of = |own: &ResourceUse| match own.how {
            UseKind::Color { first, .. } | UseKind::Depth { first } if is_first(own) => Some(first),
            _ => None,
        };
        let clears_depth = |own: &ResourceUse| own.is_depth() && first_of(own) == Some(ContentsIfFirst::Clear);
        let finds_nothing = |own: &&ResourceUse| first_of(own) == Some(ContentsIfFirst::Undefined);
        match self.touches.iter().find(finds_nothing) {
            Some(own) if !self.touches.iter().any(clears_depth) => {
                let Self { place, .. } = self;
                Err(format!("{place} draws every pixel of {}, which nothing clears before", own.resource))
            }
            _ => Ok(()),
        }
    }
}

/// The places that wait by a row.
fn waiting(row: &Row) -> impl Iterator<Item = PassName> {
    let named = row.waiting.iter().copied();
    named.chain(row.waiting.is_empty().then_some(row.to))
}

/// A pass beside `known` that reads the results of `producer` by another row than this one, with that row.
fn other_reader(
    rows: &Rows,
    stops: &[Stop],
    (producer, own): (&Stop, RowName),
    known: &[PassName],
) -> Option<(PassName, RowName)> {
    let others = rows.iter().filter(|row| row.from == producer.place && row.name != own);
    let mut readers = others.flat_map(|row| waiting(row).map(move |place| (place, row)));
    let is_other = |&(place, row): &(PassName, &Row)| {
        !known.contains(&place) && stops.iter().any(|stop| stop.place == place && stop.reads_of(producer, row))
    };
    readers.find(is_other).map(|(place, row)| (place, row.name))
}

/// The producer with all passes whose results it depends on, so that its own is that of one camera. Shadow maps are the same for both cameras.
fn sources(rows: &Rows, stops: &[Stop], producer: &Stop, own: RowName) -> Result<Vec<PassName>, String> {
    let mut found = vec![producer];
    let mut next = 0;
    while let Some(&reader) = found.get(next) {
        next += 1;
        for row in rows.iter().filter(|row| waiting(row).any(|place| place == reader.place)) {
            let source = stops.iter().find(|stop| stop.place == row.from && !stop.draws_maps);
            if let Some(source) = source.filter(|source| reader.reads_of(source, row))
                && !found.iter().any(|known| known.place == source.place)
            {
                found.push(source);
            }
        }
    }
    let places: Vec<_> = found.iter().map(|stop| stop.place).collect();
    for source in &found[1..] {
        if let Some((other, by)) = other_reader(rows, stops, (source, own), &places) {
            let (source, producer) = (source.place, producer.place);
            return Err(format!(
                "{producer} of the last frame needs {source} of the last frame, which {other} reads of this one by the row {by}"
            ));
        }
    }
    Ok(places)
}

/// Why a row has no writer among the passes of the frame.
fn why_no_producer(row: &Row) -> String {
    let is_once = |place: PassName| ONCE.iter().any(|(once, _)| *once == place);
    match row.from {
        place if is_once(place) || is_once(row.to) => "it orders work that is done once, before the first frame".into(),
        PassName::OUTSIDE if row.to.is_pass() => {
            "it orders frames in flight, and the last frame, whose content may be overwritten too soon, is already on its way to the screen".into()
        }
        _ => "it is not between two passes of the frame".into(),
    }
}

/// The reason why no pass of the frame reads too early.
fn why_no_reader(row: &Row, waits: Option<&Stop>) -> String {
    match waits {
        None => format!("no pass of the frame waits by it, but {}", row.to),
        Some(own) => format!(
            "nothing is read too early: {} may overwrite what {} still reads, for which a frame has no draws to leave out",
            own.place, row.from
        ),
    }
}

#[cfg(test)]
mod tests;
