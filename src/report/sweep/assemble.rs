//! From measurements to a report: times with their intervals, families, fronts, fits.

use std::collections::{BTreeMap, BTreeSet};

use super::convergence;
use super::families::{PlannedFamily, ordered};
use super::journal::{Header, Measured, SceneInfo};
use super::model::{Against, Family, Front, LAYOUT, LeftOut, Member, Metric, Point, Report, SceneReport, Shard};
use super::timing::{Anchor, PointTimes};
use crate::measure::{front, front_probability};

/// The fronts that a report has.
pub const FRONTS: [(Metric, Against); 6] = [
    (Metric::RelMse, Against::Point),
    (Metric::RelMse, Against::Converged),
    (Metric::Rmse, Against::Point),
    (Metric::Rmse, Against::Converged),
    (Metric::Flip, Against::Point),
    (Metric::Flip, Against::Converged),
];

/// A point that is measured.
struct Whole {
    point: Point,
    times: Vec<f64>,
}

/// The points of a scene that have both errors and times, in the order of the sweep, by their index there.
fn whole(info: &SceneInfo, measured: &Measured) -> BTreeMap<usize, Whole> {
    let anchor = Anchor(measured.batches.iter().flat_map(|batch| batch.rounds.anchor.iter().copied()).collect());
    let times = |index: usize, name: &str| -> Option<PointTimes> {
        if index == 0 {
            return anchor.times(measured.batches.iter().any(|batch| batch.confirms));
        }
        let (batch, own) = measured.times_of(name)?;
        anchor.scaled(own, &batch.rounds.anchor, batch.confirms)
    };
    let point = |(index, name): (usize, &String)| {
        let drawn = measured.drawn.get(name).filter(|_| !measured.failed.contains_key(name))?;
        let PointTimes { timing, samples } = times(index, name)?;
        let point = Point {
            name: name.clone(),
            errors: drawn.errors,
            time: timing,
            memory: drawn.memory,
            gbuffer_bytes_per_pixel: drawn.gbuffer_bytes_per_pixel,
            pictures: BTreeMap::new(),
        };
        Some((index, Whole { point, times: samples }))
    };
    info.points.iter().enumerate().filter_map(point).collect()
}

/// The names of all points that are on a front.
pub fn on_fronts(measured: &Measured) -> BTreeSet<String> {
    let Some(info) = &measured.info else { return BTreeSet::new() };
    let points: Vec<Point> = whole(info, measured).into_values().map(|whole| whole.point).collect();
    let on = |(metric, truth): (Metric, Against)| front(&coordinates(&points, metric, truth));
    FRONTS.into_iter().flat_map(on).map(|index| points[index].name.clone()).collect()
}

/// Time and error of each point.
fn coordinates(points: &[Point], metric: Metric, truth: Against) -> Vec<(f64, f64)> {
    points.iter().map(|point| (point.time.decisive().median, point.errors.against(truth).by(metric))).collect()
}

/// All scenes that have been measured.
pub fn report(header: &Header, scenes: &[Measured], shard: Option<Shard>) -> Report {
    Report {
        layout: LAYOUT,
        version: header.version.clone(),
        machine: header.machine.clone(),
        shard,
        scenes: scenes.iter().filter_map(scene_report).collect(),
    }
}

/// One scene; `None` while its default settings have not been measured.
pub fn scene_report(measured: &Measured) -> Option<SceneReport> {
    let info = measured.info.as_ref()?;
    let whole = whole(info, measured);
    whole.get(&0)?;
    let places: BTreeMap<usize, usize> = whole.keys().enumerate().map(|(place, &index)| (index, place)).collect();
    let (points, times): (Vec<Point>, Vec<Vec<f64>>) =
        whole.into_values().map(|whole| (whole.point, whole.times)).unzip();
    let fronts = FRONTS.into_iter().map(|(metric, truth)| {
        let coordinates = coordinates(&points, metric, truth);
        let errors: Vec<f64> = coordinates.iter().map(|&(_, error)| error).collect();
        Front { metric, truth, points: front(&coordinates), probability: front_probability(&times, &errors) }
    });
    let families = info.families.iter().filter_map(|family| self::family(family, &places, &points, info));
    let failed = measured.failed.iter().map(|(name, reason)| LeftOut { name: name.clone(), reason: reason.clone() });
    Some(SceneReport {
        name: info.name.clone(),
        size: info.size,
        triangles: info.triangles,
        lights: info.lights,
        truth: info.truth.clone(),
        families: families.collect(),
        default: 0,
        fronts: fronts.collect(),
        attributions: measured.attribution.iter().cloned().collect(),
        left_out: info.left_out.iter().cloned().chain(failed).collect(),
        points,
    })
}

/// A family as far as its members are measured; none where less than two are.
fn family(
    planned: &PlannedFamily,
    places: &BTreeMap<usize, usize>,
    points: &[Point],
    info: &SceneInfo,
) -> Option<Family> {
    let member = |member: &Member| Some(Member { point: *places.get(&member.point)?, ..member.clone() });
    let members = ordered(planned.members.iter().filter_map(member).collect());
    if members.len() < 2 {
        return None;
    }
    let (convergence, floor) = convergence::of(&planned.key, &members, points, &info.truth);
    Some(Family { key: planned.key.clone(), title: planned.title.clone(), members, convergence, floor })
}

/// Where the default settings lie: on the front, or what beats them there, in a sentence.
pub fn default_on_front(scene: &SceneReport, metric: Metric, truth: Against) -> String {
    let Some(front) = scene.fronts.iter().find(|front| front.metric == metric && front.truth == truth) else {
        return "no front was found".into();
    };
    let coordinates = coordinates(&scene.points, metric, truth);
    let (time, error) = coordinates[scene.default];
    if front.points.contains(&scene.default) {
        return format!(
            "The settings as given are on the front (with probability {:.2}).",
            front.probability[scene.default]
        );
    }
    let beats = |&&index: &&usize| coordinates[index].0 <= time && coordinates[index].1 <= error;
    // Of those that beat it the one with the least error: what it could have for no more time.
    let best = front.points.iter().filter(beats).min_by(|&&a, &&b| coordinates[a].1.total_cmp(&coordinates[b].1));
    let Some(&best) = best else { return "Nothing on the front beats the settings as given in both.".into() };
    let (best_time, best_error) = coordinates[best];
    // A front by measured times has whatever was luckiest among equals on it.
    let clocks = [best, scene.default].map(|index| scene.points[index].time.decisive());
    let unsure = if best_error > 0.99 * error && clocks[0].high >= clocks[1].low {
        ", no more than the times scatter"
    } else {
        ""
    };
    format!(
        "The settings as given are not on the front: {} takes {:.2} of the time and has {:.2} of the error{unsure}.",
        scene.points[best].name,
        best_time / time,
        if error > 0.0 { best_error / error } else { 1.0 }
    )
}
