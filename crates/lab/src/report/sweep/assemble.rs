//! From measurements to a report: times with their intervals, families, fronts, fits.

use std::collections::{BTreeMap, BTreeSet};

use super::convergence;
use super::families::{PlannedFamily, ordered};
use super::journal::{JournalHeader, SceneInfo, SceneMeasurements};
use super::model::{
    Against, Family, Front, LAYOUT, LeftOut, Member, Metric, Point, Report, SceneReport, Shard, Standing,
};
use super::timing::{Anchor, PointTimes, TimingSample};
use afterlight_truth::measure::{front, front_probability};

/// The fronts that a report may have.
pub const FRONTS: [(Metric, Against); 6] = [
    (Metric::RelMse, Against::Point),
    (Metric::RelMse, Against::Converged),
    (Metric::Rmse, Against::Point),
    (Metric::Rmse, Against::Converged),
    (Metric::Flip, Against::Point),
    (Metric::Flip, Against::Converged),
];

/// The fronts that a report has; a quick one has that by one metric against the converged truth, for each point of a front is timed twice.
pub fn fronts_of(quick: bool, metric: Metric) -> Vec<(Metric, Against)> {
    FRONTS.into_iter().filter(|&front| !quick || front == (metric, Against::Converged)).collect()
}

/// A point that is measured.
struct MeasuredPoint {
    point: Point,
    /// The times over the times of the settings as given in the same rounds. The ratio cancels the noise that both have in common, which tells no
    /// point from another.
    ratios: Vec<f64>,
}

/// The points of a scene that have both errors and times, in the order of the sweep, by their index there.
fn measured_points(info: &SceneInfo, measured: &SceneMeasurements) -> BTreeMap<usize, MeasuredPoint> {
    let batches: Vec<&[TimingSample]> = measured.batches.iter().map(|batch| batch.rounds.anchor.as_slice()).collect();
    let Some(anchor) = Anchor::of(&batches) else { return BTreeMap::new() };
    let times = |index: usize, name: &str| -> Option<PointTimes> {
        if index == 0 {
            return anchor.times(measured.batches.iter().any(|batch| batch.confirms));
        }
        let (batch, own) = measured.times_of(name)?;
        anchor.scaled(own, &batch.rounds.anchor, batch.confirms)
    };
    let point = |(index, name): (usize, &String)| {
        let drawn = measured.drawn.get(name).filter(|_| !measured.failed.contains_key(name))?;
        let PointTimes { timing, ratios } = times(index, name)?;
        let point = Point {
            name: name.clone(),
            errors: drawn.errors,
            time: timing,
            memory: drawn.memory,
            gbuffer_bytes_per_pixel: drawn.gbuffer_bytes_per_pixel,
            pictures: BTreeMap::new(),
        };
        Some((index, MeasuredPoint { point, ratios }))
    };
    info.points.iter().enumerate().filter_map(point).collect()
}

/// The names of all points that are on a front.
pub fn on_fronts(measured: &SceneMeasurements) -> BTreeSet<String> {
    let Some(info) = &measured.info else { return BTreeSet::new() };
    let points: Vec<Point> = measured_points(info, measured).into_values().map(|whole| whole.point).collect();
    let on = |&(metric, truth): &(Metric, Against)| front(&coordinates(&points, metric, truth));
    info.fronts.iter().flat_map(on).map(|index| points[index].name.clone()).collect()
}

/// Time and error of each point; one with pixels that are not finite is on no front, and neither are textbooks' formulas: their savings are
/// reported, but they must not be chosen for a picture that happens not to show their errors.
fn coordinates(points: &[Point], metric: Metric, truth: Against) -> Vec<(f64, f64)> {
    let error = |point: &Point| match point.name.split(' ').any(|setting| setting == "textbook=on") {
        true => f64::INFINITY,
        false => point.errors.against(truth).comparable(metric),
    };
    points.iter().map(|point| (point.time.decisive().median, error(point))).collect()
}

/// All scenes that have been measured.
pub fn report(header: &JournalHeader, scenes: &[SceneMeasurements], shard: Option<Shard>) -> Report {
    Report {
        layout: LAYOUT,
        version: header.version.clone(),
        machine: header.machine.clone(),
        shard,
        scenes: scenes.iter().filter_map(scene_report).collect(),
    }
}

/// One scene; `None` while its default settings have not been measured.
pub fn scene_report(measured: &SceneMeasurements) -> Option<SceneReport> {
    let info = measured.info.as_ref()?;
    let whole = measured_points(info, measured);
    whole.get(&0)?;
    let places: BTreeMap<usize, usize> = whole.keys().enumerate().map(|(place, &index)| (index, place)).collect();
    let without_time = info.points.iter().enumerate().filter(|&(index, name)| {
        let is_timed = measured.drawn.contains_key(name) && measured.times_of(name).is_some();
        is_timed && !whole.contains_key(&index) && !measured.failed.contains_key(name)
    });
    let reason = "none of its times is one that can be compared";
    let without_time: Vec<LeftOut> =
        without_time.map(|(_, name)| LeftOut { name: name.clone(), reason: reason.into() }).collect();
    let (points, ratios): (Vec<Point>, Vec<Vec<f64>>) =
        whole.into_values().map(|whole| (whole.point, whole.ratios)).unzip();
    let fronts = info.fronts.iter().map(|&(metric, truth)| {
        let coordinates = coordinates(&points, metric, truth);
        let errors: Vec<f64> = coordinates.iter().map(|&(_, error)| error).collect();
        Front { metric, truth, points: front(&coordinates), probability: front_probability(&ratios, &errors) }
    });
    let families = info.families.iter().filter_map(|family| self::family(family, &places, &points, info));
    let failed = measured.failed.iter().map(|(name, reason)| LeftOut { name: name.clone(), reason: reason.clone() });
    Some(SceneReport {
        name: info.name.clone(),
        size: info.size,
        moving: info.moving,
        clocks_moving: [measured.batches.iter().filter(|batch| batch.rounds.moving).count(), measured.batches.len()],
        triangles: info.triangles,
        lights: info.lights,
        truth: info.truth.clone(),
        families: families.collect(),
        default: 0,
        fronts: fronts.collect(),
        attributions: measured.attribution.iter().cloned().collect(),
        left_out: info.left_out.iter().cloned().chain(failed).chain(without_time).collect(),
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

/// Returns the place of the default settings in a sentence: on the front, or off it, with the point there that beats them.
pub fn default_on_front(scene: &SceneReport, metric: Metric, truth: Against) -> String {
    let Some(front) = scene.fronts.iter().find(|front| front.metric == metric && front.truth == truth) else {
        return "no front was found".into();
    };
    let coordinates = coordinates(&scene.points, metric, truth);
    let (time, error) = coordinates[scene.default];
    let probability = front.probability[scene.default];
    match front.standing(scene.default) {
        Standing::On => return format!("The settings as given are on the front (with probability {probability:.2})."),
        Standing::Perhaps => {
            return format!(
                "Whether the settings as given are on the front is not told: the probability is {probability:.2}."
            );
        }
        Standing::Off => {}
    }
    if !error.is_finite() {
        return "The settings as given have pixels that are not finite: they are on no front.".into();
    }
    let beats = |&&index: &&usize| coordinates[index].0 <= time && coordinates[index].1 <= error;
    // The best is the point with the least error among the points that beat the settings as given in both, so it takes no more time.
    let best = front.points.iter().filter(beats).min_by(|&&a, &&b| coordinates[a].1.total_cmp(&coordinates[b].1));
    let Some(&best) = best else { return "Nothing on the front beats the settings as given in both.".into() };
    let (best_time, best_error) = coordinates[best];
    // A front by measured times has the luckiest among equals on it.
    let ratios = [best, scene.default].map(|index| &scene.points[index].time.ratio);
    let unsure = if best_error > 0.99 * error && ratios[0].high >= ratios[1].low {
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

#[cfg(test)]
mod tests {
    use super::super::journal::{Batch, JournalRecord};
    use super::super::run::samples::{drawn, info, sweep};
    use super::super::timing::Rounds;
    use super::*;

    /// The settings as given scatter by a third, and `shadow-size=512` takes this share of their time in the same rounds; it errs less.
    fn measured(ratio: f64) -> SceneMeasurements {
        let mut random = fastrand::Rng::with_seed(1);
        let wall = |wall: f64| TimingSample { wall, gpu: None, cpu: None };
        let anchor: Vec<TimingSample> = (0..15).map(|_| wall(10.0 + 3.0 * random.f64())).collect();
        let own = anchor.iter().map(|sample| wall(ratio * sample.wall * (0.999 + 0.002 * random.f64()))).collect();
        let rounds = Rounds { anchor, others: vec![own], moving: false };
        let mut measured = SceneMeasurements { info: Some(info(&sweep())), ..SceneMeasurements::default() };
        measured.batches = vec![Batch { points: vec!["shadow-size=512".into()], confirms: true, rounds }];
        measured.drawn.insert("default".into(), drawn(0.2));
        measured.drawn.insert("shadow-size=512".into(), drawn(0.1));
        measured
    }

    #[test]
    fn a_ratio_that_is_sure_decides_however_the_machine_was_busy() {
        let report = scene_report(&measured(0.99)).expect("measured");
        let front = &report.fronts[0];
        assert_eq!((front.points.as_slice(), front.probability.as_slice()), (&[1][..], &[0.0, 1.0][..]));
        let time = &report.points[1].time;
        assert!(time.ratio.high < 1.0 && time.wall.high > report.points[0].time.wall.low, "{time:?}");
        assert!(!default_on_front(&report, Metric::RelMse, Against::Point).contains("scatter"));
        let slower = scene_report(&measured(1.01)).expect("measured");
        assert_eq!(slower.fronts[0].probability, [1.0, 1.0]);
    }

    #[test]
    fn below_an_even_probability_nothing_is_said_to_be_on_the_front() {
        let mut report = scene_report(&measured(1.5)).expect("measured");
        let told = |report: &SceneReport| default_on_front(report, Metric::RelMse, Against::Point);
        assert_eq!(told(&report), "The settings as given are on the front (with probability 1.00).");
        let front = &mut report.fronts[0];
        front.probability[0] = 0.49;
        assert_eq!((front.standing(0), front.standing(1)), (Standing::Perhaps, Standing::On));
        assert!(told(&report).contains("is not told: the probability is 0.49"), "{}", told(&report));
        report.fronts[0].probability[0] = 0.5;
        assert_eq!(report.fronts[0].standing(0), Standing::On);
        report.fronts[0].points.retain(|&point| point != 0);
        assert_eq!(report.fronts[0].standing(0), Standing::Off);
    }

    #[test]
    fn formulas_of_textbooks_are_points_and_on_no_front_however_fast() {
        let mut points = scene_report(&measured(0.5)).expect("measured").points;
        let errors = |points: &[Point]| coordinates(points, Metric::Flip, Against::Converged)[1].1;
        assert!(errors(&points).is_finite());
        points[1].name = "shadow-size=512 textbook=on".into();
        assert_eq!(errors(&points), f64::INFINITY);
        points[1].name = "textbook=off".into();
        assert!(errors(&points).is_finite());
    }

    #[test]
    fn what_is_not_finite_is_on_no_front() {
        let mut measured = measured(0.5);
        measured.drawn.get_mut("shadow-size=512").expect("there").errors.converged.not_finite = 1;
        let report = scene_report(&measured).expect("measured");
        for front in &report.fronts {
            let is_on = front.points.contains(&1);
            assert_eq!(is_on, front.truth == Against::Point, "{:?}", front.truth);
            assert_eq!(front.probability[1] > 0.0, is_on);
        }
    }

    #[test]
    fn a_point_without_a_time_is_left_out_with_its_reason() {
        let mut measured = measured(0.5);
        measured.add(JournalRecord::Drawn { scene: 0, point: "samples=4".into(), drawn: drawn(0.1) });
        for sample in &mut measured.batches[0].rounds.others[0] {
            sample.wall = f64::NAN;
        }
        let report = scene_report(&measured).expect("measured");
        let left: Vec<&str> = report.left_out.iter().map(|left| left.name.as_str()).collect();
        // A point that has not been timed yet is not listed.
        assert!(left.contains(&"shadow-size=512") && !left.contains(&"samples=4"), "{left:?}");
        assert_eq!(report.points.len(), 1);
    }
}
