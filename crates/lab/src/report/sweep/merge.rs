//! Parts of a report, measured by several jobs or machines of one kind, into one.

use std::collections::{BTreeMap, BTreeSet};

use super::error::SweepError;
use super::journal::{self, Contents, JournalHeader, SceneMeasurements};
use super::model::Shard;

/// A part, and its folder's name.
#[derive(Debug, Clone, PartialEq)]
pub struct ShardJournal {
    pub folder: String,
    pub contents: Contents,
}

/// All parts as one: their common header, and everything that they have measured.
///
/// # Errors
/// When one is missing, there twice, not finished, or of another layout, program, scene, size, choice of points, device, driver or CPU; the
/// sentence names both.
pub fn join(parts: &[ShardJournal]) -> Result<(JournalHeader, Vec<SceneMeasurements>), SweepError> {
    let Some(first) = parts.first() else { return Err(SweepError::Refused("there is nothing to merge".into())) };
    let header = JournalHeader { shard: None, ..first.contents.header.clone() };
    for part in &parts[1..] {
        let other = JournalHeader { shard: None, ..part.contents.header.clone() };
        if let Some(difference) = journal::difference(&header, &other) {
            return Err(apart(first, part, &difference));
        }
    }
    check_shards(parts)?;
    let mut joined = Vec::new();
    for scene in 0..header.scenes.len() {
        let mut all = SceneMeasurements::default();
        for part in parts {
            let measured = part.contents.scenes.get(scene).filter(|measured| measured.done);
            let Some(measured) = measured else {
                let (folder, name) = (&part.folder, &header.scenes[scene]);
                let why = format!("{folder} is not finished with {name}: run its command again");
                return Err(SweepError::Refused(why));
            };
            if let (Some(there), Some(here)) = (&all.info, &measured.info)
                && let Some(difference) = journal::scene_difference(there, here)
            {
                return Err(apart(first, part, &difference));
            }
            all.info = all.info.or_else(|| measured.info.clone());
            all.drawn.extend(measured.drawn.clone());
            all.failed.extend(measured.failed.clone());
            all.batches.extend(measured.batches.iter().cloned());
            all.attribution = all.attribution.or_else(|| measured.attribution.clone());
            all.done = true;
        }
        joined.push(all);
    }
    Ok((header, joined))
}

fn apart(first: &ShardJournal, other: &ShardJournal, difference: &str) -> SweepError {
    SweepError::Refused(format!(
        "{} and {} do not belong together: of the first, {difference}",
        first.folder, other.folder
    ))
}

/// Each shard of the same number, once.
fn check_shards(parts: &[ShardJournal]) -> Result<(), SweepError> {
    let mut seen: BTreeMap<u32, &str> = BTreeMap::new();
    let mut counts = BTreeSet::new();
    for part in parts {
        let Some(Shard { index, count }) = part.contents.header.shard else {
            return Err(SweepError::Refused(format!("{} is no shard: it is a whole report", part.folder)));
        };
        if let Some(other) = seen.insert(index, &part.folder) {
            return Err(SweepError::Refused(format!("{other} and {} are both shard {index}/{count}", part.folder)));
        }
        counts.insert(count);
    }
    let Some(&count) = counts.first().filter(|_| counts.len() == 1) else {
        return Err(SweepError::Refused(format!("the parts are of different numbers of shards: {counts:?}")));
    };
    match (1..=count).find(|index| !seen.contains_key(index)) {
        Some(missing) => Err(SweepError::Refused(format!("shard {missing}/{count} is missing"))),
        None => Ok(()),
    }
}
