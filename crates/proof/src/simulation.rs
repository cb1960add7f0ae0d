//! Decides which frames show the hazard of a missing row ([`Simulation`]), and says why some have no such picture.

use afterlight::frame::list::{Step, StepList};
use afterlight::frame::rows::{self, Endpoint, Row, RowName, Rows};
use afterlight::frame::{HazardPicture, MissingRow, Simulation};
use afterlight::passes::{ContentsIfFirst, ONCE, Resource, ResourceUse, UseKind};
use afterlight::plan::FramePlan;

/// The reason why a row has no such picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no picture: {0}")]
pub struct NoPicture(String);

/// Decides how frames of a plan show that a row is missing.
///
/// # Errors
/// When no such picture would be honest, with the reason.
pub fn simulation(plan: &FramePlan, name: RowName, how: HazardPicture) -> Result<Simulation, NoPicture> {
    let rows = rows::table(plan);
    let row = rows.find(name).ok_or_else(|| NoPicture(format!("these frames have no row {name}")))?;
    let stops = Stop::all(plan);
    let find = |place: Endpoint| stops.iter().find(|stop| stop.place == place);
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
    let decide = |plan: &FramePlan, name, how| simulation(plan, name, how).ok();
    Ok(Simulation { missing: MissingRow { name, how, decide }, producer: producer.place, readers, earlier })
}

/// A subpass, or a pass outside of render passes, of a plan's frames.
struct Stop {
    place: Endpoint,
    touches: Vec<ResourceUse>,
    /// It is a subpass, so that its draws can be clipped to tiles.
    draws: bool,
    draws_maps: bool,
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
                // Passes after the picture are recorded beside the renderer's own part of a frame.
                Step::Commands(own) if own.pass.make.is_some() => {
                    let touches = own.pass.uses(plan);
                    all.push(Self { place: own.pass.name, touches, draws: false, draws_maps: false });
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
fn waiting(row: &Row) -> impl Iterator<Item = Endpoint> {
    let named = row.waiting.iter().copied();
    named.chain(row.waiting.is_empty().then_some(row.to))
}

/// A pass beside `known` that reads the results of `producer` by another row than this one, with that row.
fn other_reader(
    rows: &Rows,
    stops: &[Stop],
    (producer, own): (&Stop, RowName),
    known: &[Endpoint],
) -> Option<(Endpoint, RowName)> {
    let others = rows.iter().filter(|row| row.from == producer.place && row.name != own);
    let mut readers = others.flat_map(|row| waiting(row).map(move |place| (place, row)));
    let is_other = |&(place, row): &(Endpoint, &Row)| {
        !known.contains(&place) && stops.iter().any(|stop| stop.place == place && stop.reads_of(producer, row))
    };
    readers.find(is_other).map(|(place, row)| (place, row.name))
}

/// The producer with all passes whose results it depends on, so that its result is of one camera. Shadow maps are the same for both cameras.
fn sources(rows: &Rows, stops: &[Stop], producer: &Stop, own: RowName) -> Result<Vec<Endpoint>, String> {
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
    let is_once = |place: Endpoint| ONCE.iter().any(|(once, _)| *once == place);
    match row.from {
        place if is_once(place) || is_once(row.to) => "it orders work that is done once, before the first frame".into(),
        Endpoint::OUTSIDE if row.to.is_pass() => {
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
