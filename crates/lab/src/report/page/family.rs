//! A curve of error against time for each family: one setting changes.

use std::ops::Range;

use maud::{Markup, html};

use super::front::{JOINT, glyph};
use super::summary;
use super::words::{self, number};
use crate::page::marks;
use crate::page::plot::{Axis, Line, Mark, Plot, Stroke};
use crate::report::sweep::model::{Against, Convergence, Family, Metric, Point, SceneReport};
use afterlight::scene::SETTINGS;

/// All but the joint sweep.
pub fn figures(scene: &SceneReport) -> Markup {
    let single: Vec<&Family> = scene.families.iter().filter(|family| family.key != JOINT).collect();
    html! {
        @if single.is_empty() {
            p.none { "No setting was varied on its own." }
        } @else {
            p {
                "One setting changes, the others stay as they are by default. Full marks are all of the error, hollow ones against the \
                 point truth: numeric error and texture filtering. The gap between them is the price of one sample a pixel, which this \
                 setting may not change. Where the setting \
                 smooths edges, only all of the error means something: the point truth has none."
            }
            div.families { @for (index, family) in single.iter().enumerate() { (figure(scene, family, index)) } }
        }
    }
}

/// Returns true for families of which the point truth tells nothing: it looks through the middle of each pixel, and their pictures do not.
fn smooths(family: &Family) -> bool {
    SETTINGS.iter().any(|setting| setting.smooths && setting.key == family.key)
}

/// A member with the point that it is.
type MemberPoint<'a> = (&'a str, usize, &'a Point);

fn figure(scene: &SceneReport, family: &Family, index: usize) -> Markup {
    let metric = family.convergence.as_ref().map(|fit| fit.metric);
    let metric = metric.or_else(|| scene.fronts.first().map(|front| front.metric)).unwrap_or(Metric::RelMse);
    let members = family.members.iter();
    let members: Vec<MemberPoint> = members
        .filter_map(|member| Some((member.label.as_str(), member.point, scene.points.get(member.point)?)))
        .collect();
    html! {
        figure {
            h4 { (family.title) }
            @if members.is_empty() { p.none { "Nothing of this family was measured." } } @else {
                (plot(scene, family, &members, (metric, index)).draw())
            }
            figcaption {
                @if let Some(fit) = &family.convergence { (fitted(fit)) }
                @if let Some(floor) = &family.floor { " " (floor) }
            }
            (numbers(&members, metric))
        }
    }
}

fn plot(scene: &SceneReport, family: &Family, members: &[MemberPoint], (metric, index): (Metric, usize)) -> Plot {
    let mark = |truth: Against| {
        move |&(label, point, measured): &MemberPoint| {
            let time = measured.time.decisive();
            let alone = truth == Against::Point;
            let whisker: Range<f64> = if alone { time.median..time.median } else { time.low..time.high };
            let is_default = point == scene.default;
            Mark {
                x: time.median,
                whisker,
                y: measured.errors.against(truth).by(metric),
                glyph: if is_default { glyph(scene, point) } else { marks::Glyph::family(index) },
                hollow: alone,
                ringed: is_default && !alone,
                tooltip: format!("{label}\n{}", words::tooltip(measured, metric, truth)),
                label: (!alone).then(|| label.to_owned()),
            }
        }
    };
    // Numbers are a curve; names have no order between them.
    let is_curve = family.members.len() > 1 && family.members.iter().all(|member| member.value.is_some());
    let curve = |stroke, truth: Against| Line {
        stroke,
        points: members
            .iter()
            .map(|(_, _, point)| (point.time.decisive().median, point.errors.against(truth).by(metric)))
            .collect(),
    };
    let truths: &[Against] = match smooths(family) {
        true => &[Against::Converged],
        false => &[Against::Point, Against::Converged],
    };
    let stroke = |truth| if truth == Against::Point { Stroke::Faint } else { Stroke::Curve };
    let lines = truths.iter().filter(|_| is_curve).map(|&truth| curve(stroke(truth), truth));
    let marks = truths.iter().flat_map(|&truth| members.iter().map(mark(truth)));
    Plot {
        size: (520.0, 330.0),
        x: Axis::of(format!("{}, ms a picture", words::clock(scene))),
        y: Axis::of(metric.title().to_owned()),
        label: format!(
            "{}: error as {} against time of {}. The numbers are in the table below.",
            family.title,
            metric.title(),
            words::counted(members.len(), "point")
        ),
        lines: lines.collect(),
        marks: marks.collect(),
        area: summary::noise_area(&scene.truth, metric, Against::Converged),
    }
}

fn fitted(fit: &Convergence) -> Markup {
    html! {
        "Fitted to " (fit.metric.title()) ", " (fit.truth.title()) ": order " strong { (number(fit.order)) }
        " (95%: " (number(fit.low)) " to " (number(fit.high)) "), with a floor of " (number(fit.floor)) ". Theory: " (fit.expected)
        @if !fit.expected.ends_with('.') { "." }
    }
}

fn numbers(members: &[MemberPoint], metric: Metric) -> Markup {
    html! {
        details {
            summary { "The numbers" }
            div.scroll {
                table {
                    thead { tr {
                        th.words { "" } th.words { "settings" } th { "time, ms" } th { (metric.title()) "," br; (Against::Converged.title()) }
                        th { (metric.title()) "," br; (Against::Point.title()) }
                    } }
                    tbody { @for (label, _, point) in members {
                        @let time = point.time.decisive();
                        tr {
                            td.words { (label) } td.words { code { (point.name) } }
                            td { (number(time.median)) span.aside { " (" (number(time.low)) " to " (number(time.high)) ")" } }
                            td { (number(point.errors.converged.by(metric))) } td { (number(point.errors.point.by(metric))) }
                        }
                    } }
                }
            }
        }
    }
}
