//! A choice on disk: settings as a scene file has them, and beside them the evidence that they were chosen by.

use serde::Serialize;

use super::choice::{Attempt, Goal, GoalBound, Measurement, PairedMeasurement, SearchResult};
use crate::report::sweep::model::{Machine, Metric, SceneReport};
use afterlight::scene::SettingsPatch;

/// The evidence that settings were chosen by. Times are milliseconds a picture, sizes pixels.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// The program and its version.
    pub program: String,
    /// The device's name.
    pub device: String,
    /// The driver and its version.
    pub driver: String,
    /// The processor's name.
    pub cpu: String,
    /// Threads that the process may use.
    pub threads: usize,
    /// Threads that a software driver draws with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub driver_threads: Option<usize>,
    /// The scene's name.
    pub scene: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The bound that was asked for, as the command line has it.
    pub bound: String,
    /// The metric of error, against a truth of `truth_samples` samples a pixel.
    pub metric: Metric,
    /// Samples a pixel of the truth.
    pub truth_samples: u32,
    /// The size of the truth and of the pictures that it is compared with.
    pub truth_size: [u32; 2],
    /// The truth's own standard error, by RMSE and relMSE: errors near it are not told apart from noise.
    pub noise_rmse: f64,
    /// The truth's own noise.
    pub noise_rel_mse: f64,
    /// The clock that counts: "device" or "wall".
    pub clock: &'static str,
    /// True if times are of frames in which everything moves, and not of frames that keep their shadow maps.
    pub moving: bool,
    /// The path that the cameras stand on, if they do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
    /// The moment that the settings were chosen with, in seconds from the path's start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
    /// Figures from the camera that the settings were chosen with.
    pub choice: MeasuredSettings,
    /// The settings as given.
    pub default: MeasuredSettings,
    /// Figures from other cameras than the one the settings were chosen with. Errors there are estimated from a picture of the settings that err
    /// least.
    pub held_out: Vec<HeldOut>,
    /// The settings for which the bound did not hold from one of these cameras.
    pub passed_over: Vec<PassedOver>,
}

/// Settings with their figures, as measured from the camera of the scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasuredSettings {
    /// The settings, as a command line has them.
    pub settings: String,
    /// The measurements.
    #[serde(flatten)]
    pub figures: Figures,
}

/// A median with its 95% interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// The error by the goal's metric.
    pub error: f64,
    /// The median time of a picture, in milliseconds.
    pub ms: f64,
    /// The lower end of its interval.
    pub ms_low: f64,
    /// The upper end of its interval.
    pub ms_high: f64,
}

/// The choice and the settings as given, as measured in turns from another camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOut {
    /// The camera, as `--camera` takes it.
    pub camera: String,
    /// The moment of the path, in seconds from its start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
    /// The figures of the choice.
    #[serde(flatten)]
    pub choice: Figures,
    /// The error of the settings as given.
    pub default_error: f64,
    /// The time of the settings as given, in milliseconds.
    pub default_ms: f64,
}

/// Settings that were tried before the choice, and the camera from which the bound did not hold.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PassedOver {
    /// The settings, as a command line has them.
    pub settings: String,
    /// The camera, as `--camera` takes it.
    pub camera: String,
    /// The measurements.
    #[serde(flatten)]
    pub figures: Figures,
    /// The error of the settings as given.
    pub default_error: f64,
    /// The time of the settings as given, in milliseconds.
    pub default_ms: f64,
}

impl Figures {
    fn of(measured: &Measurement) -> Self {
        let Measurement { error, time } = measured;
        Self { error: *error, ms: time.median, ms_low: time.low, ms_high: time.high }
    }
}

impl MeasuredSettings {
    /// A point's figures, as far as the goal asks for them.
    pub fn of(scene: &SceneReport, goal: &Goal, point: usize) -> Self {
        let point = &scene.points[point];
        Self { settings: point.name.clone(), figures: Figures::of(&goal.of(point)) }
    }
}

/// A search with its subject.
#[derive(Debug, Clone, Copy)]
pub struct SearchContext<'a> {
    /// The program and its version.
    pub program: &'a str,
    /// The machine that measured.
    pub machine: &'a Machine,
    /// The front that the choice is from.
    pub scene: &'a SceneReport,
    /// The goal of the search.
    pub goal: &'a Goal,
    /// The cameras by index, as `--camera` takes them.
    pub cameras: &'a [String],
    /// The path that they stand on, if they do.
    pub path: Option<&'a PathMoments>,
}

/// A path with the moments that are looked at, in seconds from its start.
#[derive(Debug, Clone, PartialEq)]
pub struct PathMoments {
    /// The file.
    pub file: String,
    /// The moment of the camera that settings are chosen with.
    pub own: f64,
    /// The moments of the other cameras.
    pub others: Vec<f64>,
}

impl Evidence {
    /// The evidence for a search's choice.
    pub fn of(search: &SearchContext, chosen: &Attempt, passed_over: &[Attempt]) -> Self {
        let SearchContext { machine, scene, goal, cameras, .. } = search;
        let held_out = |(index, (pair, camera)): (usize, (&PairedMeasurement, &String))| HeldOut {
            camera: camera.clone(),
            at_s: search.path.and_then(|path| path.others.get(index).copied()),
            choice: Figures::of(&pair.own),
            default_error: pair.default.error,
            default_ms: pair.default.time.median,
        };
        Self {
            program: search.program.to_owned(),
            device: machine.device.clone(),
            driver: machine.driver.clone(),
            cpu: machine.cpu.clone(),
            threads: machine.threads,
            driver_threads: machine.driver_threads,
            scene: scene.name.clone(),
            size: scene.size,
            bound: bound_text(goal),
            metric: goal.metric,
            truth_samples: scene.truth.samples,
            truth_size: scene.truth.size.unwrap_or(scene.size),
            noise_rmse: scene.truth.noise_rmse,
            noise_rel_mse: scene.truth.noise_rel_mse,
            clock: goal.clock(&scene.points[chosen.point].time).0,
            moving: scene.moving,
            path: search.path.map(|path| path.file.clone()),
            at_s: search.path.map(|path| path.own),
            choice: MeasuredSettings::of(scene, goal, chosen.point),
            default: MeasuredSettings::of(scene, goal, scene.default),
            held_out: chosen.held_out.iter().zip(*cameras).enumerate().map(held_out).collect(),
            passed_over: passed_over.iter().filter_map(|attempt| search.passed_over(attempt)).collect(),
        }
    }
}

impl SearchContext<'_> {
    /// The camera on which a candidate failed: the last one that measured it.
    pub fn passed_over(&self, attempt: &Attempt) -> Option<PassedOver> {
        let pair = attempt.held_out.last()?;
        Some(PassedOver {
            settings: self.scene.points[attempt.point].name.clone(),
            camera: self.cameras.get(attempt.held_out.len() - 1)?.clone(),
            figures: Figures::of(&pair.own),
            default_error: pair.default.error,
            default_ms: pair.default.time.median,
        })
    }

    /// Returns the reason why nothing was chosen, in a sentence that names the nearest point.
    pub fn failure(&self, outcome: &SearchResult) -> String {
        let limit = bound_text(self.goal);
        let worst = |attempt: &&Attempt| self.goal.worst(self.scene, attempt);
        let told = |figures: &Figures| match self.goal.bound {
            GoalBound::Error(_) | GoalBound::Loss(_) => format!("errs by {}", error_text(figures.error)),
            GoalBound::Milliseconds(_) => {
                format!("takes {:.3} ms, and {:.3} at the upper end of its 95% interval", figures.ms, figures.ms_high)
            }
        };
        let best = outcome.passed_over.iter().min_by(|a, b| worst(a).total_cmp(&worst(b)));
        if let Some(passed_over) = best.and_then(|best| self.passed_over(best)) {
            let PassedOver { settings, camera, figures, .. } = passed_over;
            return format!(
                "{limit} holds from the scene's camera and not from others: the nearest, {settings}, {} from {camera}",
                told(&figures)
            );
        }
        match self.goal.nearest(self.scene) {
            Some(nearest) => {
                let MeasuredSettings { settings, figures } = MeasuredSettings::of(self.scene, self.goal, nearest);
                format!("nothing that was measured keeps {limit}: the nearest, {settings}, {}", told(&figures))
            }
            None => format!("nothing was measured that could keep {limit}"),
        }
    }

    /// In a sentence, the bound that a near miss keeps from all cameras; `None` where nothing came near.
    pub fn fitting(&self, outcome: &SearchResult) -> Option<String> {
        let near_miss = outcome.near_miss.as_ref()?;
        let bound = self.goal.fitting(self.scene, near_miss);
        let (name, cameras) = (&self.scene.points[near_miss.point].name, 1 + near_miss.held_out.len());
        let where_it_holds = match cameras {
            1 => "from the scene's camera".to_owned(),
            count => format!("from each of {count} cameras"),
        };
        Some(format!("{} would fit: {name} keeps it {where_it_holds}", bound_text(&Goal { bound, ..*self.goal })))
    }
}

/// As the command line has it.
fn bound_text(goal: &Goal) -> String {
    // Small figures with an exponent, and whole ones without a point.
    let short = |most: f64| format!("{most:?}").trim_end_matches(".0").to_owned();
    let bound = match goal.bound {
        GoalBound::Error(most) => format!("--max-error {}", short(most)),
        // Two digits, or as many as were typed: 7% and not 7.000000000000001%.
        GoalBound::Loss(most) => format!("--max-loss {}%", short((most * 1e8).round() / 1e6)),
        GoalBound::Milliseconds(most) => format!("--max-ms {}", short(most)),
    };
    format!("{bound} --metric {}", metric_key(goal.metric))
}

/// An error: FLIP is never small, and the others span decades.
pub fn error_text(error: f64) -> String {
    if error >= 1e-3 { format!("{error:.5}") } else { format!("{error:.3e}") }
}

/// A metric's name on the command line.
pub fn metric_key(metric: Metric) -> &'static str {
    match metric {
        Metric::Flip => "flip",
        Metric::RelMse => "relmse",
        Metric::Rmse => "rmse",
    }
}

/// The settings file.
///
/// # Errors
/// When the evidence has no form in TOML.
pub fn file(settings: &SettingsPatch, evidence: &Evidence) -> Result<String, toml::ser::Error> {
    #[derive(Serialize)]
    struct Beside<'a> {
        evidence: &'a Evidence,
    }
    Ok(format!("{}\n{}", settings.to_toml(), toml::to_string(&Beside { evidence })?))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::report::page::samples;
    use afterlight::scene::file::parse_settings;

    fn pair(goal: &Goal, scene: &SceneReport, point: usize) -> PairedMeasurement {
        goal.pair(scene, point)
    }

    #[test]
    fn a_settings_file_is_read_again_and_keeps_its_evidence() {
        let report = samples::report();
        let goal = Goal { bound: GoalBound::Error(0.05), metric: Metric::Flip };
        let scene = &report.scenes[0];
        let cameras = ["0,1,2/3,4,5/60".to_owned(), "1,1,2/3,4,5/60".to_owned()];
        let search = SearchContext {
            program: "afterlight 0.1.0",
            machine: &report.machine,
            scene,
            goal: &goal,
            cameras: &cameras,
            path: None,
        };
        let chosen = Attempt { point: 2, held_out: vec![pair(&goal, scene, 2); 2] };
        let passed = Attempt { point: 1, held_out: vec![pair(&goal, scene, 1)] };
        let evidence = Evidence::of(&search, &chosen, &[passed]);
        let settings: SettingsPatch = "gbuffer=fat samples=1 shadow-size=512".parse().expect("settings");
        let text = file(&settings, &evidence).expect("TOML");
        assert_eq!(parse_settings(&text, Path::new("tuned.toml")).expect("a settings file"), settings);
        let table: toml::Table = text.parse().expect("TOML");
        let evidence = &table["evidence"];
        assert_eq!(evidence["moving"].as_bool(), Some(scene.moving));
        assert_eq!(evidence["bound"].as_str(), Some("--max-error 0.05 --metric flip"));
        assert_eq!(evidence["choice"]["settings"].as_str(), Some(scene.points[2].name.as_str()));
        assert_eq!(evidence["noise_rmse"].as_float(), Some(scene.truth.noise_rmse));
        assert_eq!(evidence["held_out"].as_array().map(Vec::len), Some(2));
        assert_eq!(evidence["passed_over"][0]["camera"].as_str(), Some(cameras[0].as_str()));
        assert_eq!(evidence["choice"]["ms"].as_float(), Some(scene.points[2].time.wall.median));
    }

    #[test]
    fn a_failure_names_what_came_nearest() {
        let report = samples::report();
        let scene = &report.scenes[0];
        let cameras = ["0,1,2/3,4,5/60".to_owned()];
        let goal = Goal { bound: GoalBound::Error(1e-9), metric: Metric::Flip };
        let search =
            SearchContext { program: "", machine: &report.machine, scene, goal: &goal, cameras: &cameras, path: None };
        let nothing = SearchResult { chosen: None, passed_over: Vec::new(), near_miss: None };
        let nearest = &scene.points[goal.nearest(scene).expect("a front")].name;
        assert!(search.failure(&nothing).contains(&format!("the nearest, {nearest}, errs by")));
        let attempts = [1, 2].map(|point| Attempt { point, held_out: vec![pair(&goal, scene, point)] });
        let failed = SearchResult { chosen: None, passed_over: attempts.into(), near_miss: None };
        let better = [1, 2].into_iter().min_by(|a, b| {
            let error = |index: &usize| goal.of(&scene.points[*index]).error;
            error(a).total_cmp(&error(b))
        });
        let better = &scene.points[better.expect("one of two")].name;
        let told = search.failure(&failed);
        assert!(told.contains(&format!("the nearest, {better}, ")) && told.contains(&cameras[0]), "{told}");
    }

    #[test]
    fn a_near_miss_is_told_with_the_bound_that_would_fit() {
        let report = samples::report();
        let scene = &report.scenes[0];
        let cameras = ["0,1,2/3,4,5/60".to_owned()];
        let told = |bound: GoalBound, near_miss: Option<Attempt>| {
            let goal = Goal { bound, metric: Metric::Flip };
            let search = SearchContext {
                program: "",
                machine: &report.machine,
                scene,
                goal: &goal,
                cameras: &cameras,
                path: None,
            };
            search.fitting(&SearchResult { chosen: None, passed_over: Vec::new(), near_miss })
        };
        let attempt = |held_out| Attempt { point: 0, held_out };
        let goal = Goal { bound: GoalBound::Error(0.02), metric: Metric::Flip };
        let fits = told(goal.bound, Some(attempt(vec![pair(&goal, scene, 0)]))).expect("near");
        assert_eq!(fits, "--max-error 0.038 --metric flip would fit: default keeps it from each of 2 cameras");
        let fits = told(GoalBound::Milliseconds(10.0), Some(attempt(Vec::new()))).expect("near");
        assert!(fits.starts_with("--max-ms 1") && fits.ends_with("default keeps it from the scene's camera"), "{fits}");
        assert_eq!(told(goal.bound, None), None);
    }

    #[test]
    fn bounds_read_as_they_were_typed() {
        let told = |bound| bound_text(&Goal { bound, metric: Metric::Flip });
        assert_eq!(told(GoalBound::Loss(0.07)), "--max-loss 7% --metric flip");
        assert_eq!(told(GoalBound::Loss(0.025)), "--max-loss 2.5% --metric flip");
        assert_eq!(told(GoalBound::Milliseconds(16.0)), "--max-ms 16 --metric flip");
    }
}
