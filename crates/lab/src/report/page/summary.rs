//! A summary of a scene's figures, in words: the place of the default settings, and the points that beat them.

use maud::{Markup, html};

use super::words::{self, less, number};
use crate::page::plot::Area;
use crate::report::advice::{self, Advice, Reason};
use crate::report::sweep::model::{Against, Front, Metric, Point, SceneReport, Standing, TruthInfo};

/// An error below this multiple of the truth's noise cannot be told well.
const NEAR_NOISE: f64 = 2.0;

/// The root mean square of the truth's own noise, in the measure of this metric.
pub fn noise(truth: &TruthInfo, metric: Metric, against: Against) -> Option<f64> {
    match (against, metric) {
        (Against::Converged, Metric::Rmse) => Some(truth.noise_rmse),
        (Against::Converged, Metric::RelMse) => Some(truth.noise_rel_mse),
        _ => None,
    }
}

/// The part of a plot in which there is noise only.
pub fn noise_area(truth: &TruthInfo, metric: Metric, against: Against) -> Option<Area> {
    let area = |level| Area { class: "noise", level, between: None, note: "noise of the converged truth" };
    noise(truth, metric, against).map(area)
}

pub fn paragraphs(scene: &SceneReport) -> Markup {
    let Some(point) = scene.points.get(scene.default) else {
        return html! { p.lead { "The default settings were not measured." } };
    };
    let (all, centres) = (&point.errors.converged, &point.errors.point);
    html! {
        (advice(scene))
        p {
            "With the default settings a picture takes " strong { (number(point.time.decisive().median)) " ms" }
            " (" (words::clock(scene)) "; 95%: " (number(point.time.decisive().low)) " to " (number(point.time.decisive().high))
            "). Against the converged truth it errs by " strong { (number(all.rmse)) " RMSE" } ", "
            strong { (number(all.rel_mse)) " relMSE" } " and " strong { (number(all.flip)) " FLIP" }
            ". Against the point truth, so without what one sample a pixel misses but with how textures are filtered, these are "
            (number(centres.rmse)) " RMSE, " (number(centres.rel_mse)) " relMSE and " (number(centres.flip)) " FLIP."
        }
        @if scene.fronts.is_empty() { p.none { "No front was sought." } }
        ul.verdicts { @for front in super::front::in_order(scene) { (verdict(scene, front, point)) } }
        (doubts(scene))
    }
}

/// The first paragraph: the changes to make, by FLIP if that front was sought.
fn advice(scene: &SceneReport) -> Markup {
    let by_flip = super::front::in_order(scene).find(|front| front.metric == Metric::Flip);
    let Some(front) = by_flip.or_else(|| super::front::in_order(scene).next()) else { return html! {} };
    let advice = advice::of(scene, front);
    html! {
        p.lead {
            @if !advice.iter().any(|one| one.reason == Reason::Free) { (advice::KEEP) " " }
            @for Advice { reason, point } in &advice {
                (reason.text()) ": " code { (scene.points[*point].name) } ": "
                (advice::gain(scene, front.metric, front.truth, *point)) ". "
            }
            "Error here is " (front.metric.title()) ": "
            a href="#flip" { "what it looks like" } "."
        }
    }
}

fn verdict(scene: &SceneReport, front: &Front, default: &Point) -> Markup {
    let error = |point: &Point| point.errors.against(front.truth).by(front.metric);
    let scope = html! { "By " (front.metric.title()) ", " (front.truth.title()) ": " };
    let mine = error(default);
    let near_noise = noise(&scene.truth, front.metric, front.truth).filter(|noise| mine < NEAR_NOISE * noise);
    html! {
        li {
            @if front.standing(scene.default) != Standing::Off {
                @match front.standing(scene.default) {
                    Standing::On => span.pill.good { "on the front" },
                    _ => span.pill { "not told" },
                }
                span {
                    (scope) "nothing measured is both faster and closer to the truth"
                    @if let Some(probability) = front.probability.get(scene.default) {
                        ", with a probability of " (words::percent(*probability))
                    }
                    "." (noise_remark(near_noise))
                }
            } @else {
                span.pill.bad { "not on the front" }
                span {
                    (scope)
                    @match best_dominator(scene, front) {
                        Some(better) => { (beaten_by(better, default, error(better), mine)) }
                        None => "no point of the front is both faster and closer to the truth, yet they are not counted among its points.",
                    }
                    (noise_remark(near_noise))
                }
            }
        }
    }
}

fn beaten_by(better: &Point, default: &Point, error: f64, mine: f64) -> Markup {
    let (time, of) = (better.time.decisive(), default.time.decisive());
    html! {
        code { (better.name) } " takes " (less("time", time.median, of.median)) " and has " (less("error", error, mine)) "."
        @if better.time.ratio.high >= default.time.ratio.low { " Their times are not told apart, so that this may be chance." }
    }
}

fn noise_remark(noise: Option<f64>) -> Markup {
    html! { @if let Some(noise) = noise { " This error is near the noise of the truth (" (number(noise)) "): more samples would tell it better." } }
}

/// Returns the point of a front that beats the default settings in both error and time by the largest factor.
fn best_dominator<'a>(scene: &'a SceneReport, front: &Front) -> Option<&'a Point> {
    let figures = |point: &Point| (point.time.decisive().median, point.errors.against(front.truth).by(front.metric));
    let (time, error) = figures(scene.points.get(scene.default)?);
    let gain = |point: &Point| {
        let (other_time, other_error) = figures(point);
        (other_time / time) * (other_error / error)
    };
    let on_front = front.points.iter().filter_map(|index| scene.points.get(*index));
    let better = on_front.filter(|point| {
        let (other_time, other_error) = figures(point);
        other_time <= time && other_error <= error && (other_time < time || other_error < error)
    });
    better.min_by(|a, b| gain(a).total_cmp(&gain(b)))
}

/// Writes the doubts that readers must know before they believe a figure.
fn doubts(scene: &SceneReport) -> Markup {
    let broken: Vec<&Point> = scene.points.iter().filter(|point| not_finite(point) > 0).collect();
    let untold = scene.points.iter().filter(|point| !has_numbers(point));
    let untold: Vec<&Point> = untold.collect();
    html! {
        @if !broken.is_empty() {
            p.warning {
                "Pixels that are no numbers: "
                @for (index, point) in broken.iter().enumerate() {
                    @if index > 0 { "; " }
                    (words::counted(not_finite(point), "pixel")) " with " code { (point.name) }
                }
                ". Their errors leave these pixels out."
            }
        }
        @if !untold.is_empty() {
            p.warning {
                "Not drawn, as their error or time is not a finite number: "
                @for (index, point) in untold.iter().enumerate() { @if index > 0 { ", " } code { (point.name) } }
                ". The table of all points has their figures."
            }
        }
    }
}

fn not_finite(point: &Point) -> usize {
    point.errors.point.not_finite.max(point.errors.converged.not_finite)
}

fn has_numbers(point: &Point) -> bool {
    let errors = [&point.errors.point, &point.errors.converged];
    let metrics = [Metric::RelMse, Metric::Rmse, Metric::Flip];
    let finite = errors.iter().all(|errors| metrics.iter().all(|metric| errors.by(*metric).is_finite()));
    finite && point.time.decisive().median.is_finite() && point.time.decisive().median > 0.0
}
