//! The joint sweep: all points with the front, and the front as a table, for each metric and truth.

use maud::{Markup, html};

use super::words::{self, mebibytes, number, percent};
use super::{summary, tables};
use crate::page::marks::{Glyph, Shape, sample};
use crate::page::plot::{Axis, Line, Mark, Plot, Stroke};
use crate::report::sweep::model::{Against, Front, Point, SceneReport};

/// The family that combines all settings. It has no curve.
pub const JOINT: &str = "joint";

/// The fronts against the converged truth (all of the error), then the fronts against the point truth.
pub fn in_order(scene: &SceneReport) -> impl Iterator<Item = &Front> {
    let of = |truth| scene.fronts.iter().filter(move |front| front.truth == truth);
    of(Against::Converged).chain(of(Against::Point))
}

/// One front a tab.
pub fn tabs(scene: &SceneReport, uid: usize) -> Markup {
    html! {
        div.tabs {
            @for (index, front) in in_order(scene).enumerate() {
                @let id = format!("front-{uid}-{index}");
                input type="radio" name=(format!("front-{uid}")) id=(id) checked[index == 0];
                label for=(id) { (front.metric.title()) ", " (front.truth.title()) }
                div {
                    h4 { "Error as " (front.metric.title()) ", " (front.truth.title()) }
                    (joint_plot(scene, front))
                    (front_table(scene, front))
                }
            }
        }
    }
}

/// Returns the look of a point: the look of the first family that it belongs to, or grey if it is in the joint sweep only.
pub fn glyph(scene: &SceneReport, point: usize) -> Glyph {
    if point == scene.default {
        return Glyph::DEFAULT;
    }
    let single = scene.families.iter().filter(|family| family.key != JOINT);
    let of = single.enumerate().find(|(_, family)| family.members.iter().any(|member| member.point == point));
    of.map_or(Glyph::JOINT, |(index, _)| Glyph::family(index))
}

fn joint_plot(scene: &SceneReport, front: &Front) -> Markup {
    let error = |point: &Point| point.errors.against(front.truth).by(front.metric);
    let mark = |(index, point): (usize, &Point)| {
        let time = point.time.decisive();
        let place = front.points.iter().position(|other| *other == index);
        let label = match (place, index == scene.default) {
            (Some(place), true) => Some(format!("{} default", place + 1)),
            (Some(place), false) => Some((place + 1).to_string()),
            (None, true) => Some("default".to_owned()),
            (None, false) => None,
        };
        Mark {
            x: time.median,
            whisker: time.low..time.high,
            y: error(point),
            glyph: glyph(scene, index),
            hollow: time.is_wide(),
            ringed: index == scene.default,
            tooltip: words::tooltip(point, front.metric, front.truth),
            label,
        }
    };
    let mut marks: Vec<Mark> = scene.points.iter().enumerate().map(mark).collect();
    // Marks with names lie over marks without.
    marks.sort_by_key(|mark| (mark.label.is_some(), mark.ringed));
    let on_front = front.points.iter().filter_map(|index| scene.points.get(*index));
    let steps = on_front.map(|point| (point.time.decisive().median, error(point))).collect();
    let plot = Plot {
        size: (960.0, 500.0),
        x: Axis::of(format!("{}, ms a picture", words::clock(scene))),
        y: Axis::of(format!("{}, {}", front.metric.title(), front.truth.title())),
        label: format!(
            "Error as {} against time of {} of {}, with the front of {}. The numbers are in the tables below.",
            front.metric.title(),
            words::counted(scene.points.len(), "point"),
            scene.name,
            words::counted(front.points.len(), "point"),
        ),
        lines: vec![Line { stroke: Stroke::Front, points: steps }],
        marks,
        area: summary::noise_area(&scene.truth, front.metric, front.truth),
    };
    html! {
        figure {
            (plot.draw())
            (legend(scene))
            figcaption {
                "Lower left is better. The line is the front: nothing measured lies below it and to its left. Its points bear the numbers of \
                 the table; whiskers are 95% intervals of the median time."
            }
        }
        (unsure(scene))
    }
}

fn legend(scene: &SceneReport) -> Markup {
    let single = scene.families.iter().filter(|family| family.key != JOINT);
    let drawn: Vec<Glyph> = (0..scene.points.len()).map(|index| glyph(scene, index)).collect();
    html! {
        ul.legend {
            li { (sample(Glyph::DEFAULT, false)) "default settings" }
            @for (index, family) in single.enumerate() {
                @if drawn.contains(&Glyph::family(index)) { li { (sample(Glyph::family(index), false)) (family.title) } }
            }
            @if drawn.contains(&Glyph::JOINT) { li { (sample(Glyph::JOINT, false)) "several settings changed" } }
            @if scene.points.iter().any(|point| point.time.decisive().is_wide()) {
                li { (sample(Glyph { shape: Shape::Circle, color: None }, true)) "hollow: time not well known" }
            }
        }
    }
}

/// Points whose times are not to be relied on.
fn unsure(scene: &SceneReport) -> Markup {
    let wide: Vec<&Point> = scene.points.iter().filter(|point| point.time.decisive().is_wide()).collect();
    html! {
        @if !wide.is_empty() {
            details {
                summary { (words::counted(wide.len(), "time")) " known to worse than 5%" }
                p {
                    @for (index, point) in wide.iter().enumerate() {
                        @if index > 0 { ", " }
                        code { (point.name) } " (" (words::uncertainty(point.time.decisive())) ")"
                    }
                    "."
                }
            }
        }
    }
}

fn front_table(scene: &SceneReport, front: &Front) -> Markup {
    let error = |point: &Point| point.errors.against(front.truth).by(front.metric);
    let default = scene.points.get(scene.default);
    html! {
        div.scroll {
            table {
                thead { tr {
                    th { "" } th.words { "settings" } th { "time, ms" } th { "of default" } th { (front.metric.title()) } th { "of default" }
                    th { "probability" br; "of being on it" } th { "confirmed" } th { "memory" } th { "G-buffer," br; "bytes a pixel" }
                } }
                tbody {
                    @for (place, index) in front.points.iter().enumerate() {
                        @if let Some(point) = scene.points.get(*index) {
                            @let time = point.time.decisive();
                            tr class=[(*index == scene.default).then_some("default")] {
                                td { span.number { (place + 1) } }
                                td.words { code { (point.name) } }
                                td { (number(time.median)) span.aside { " (" (number(time.low)) " to " (number(time.high)) ")" } }
                                td { (default.map_or_else(String::new, |default| words::times(time.median, default.time.decisive().median))) }
                                td { (number(error(point))) }
                                td { (default.map_or_else(String::new, |default| words::times(error(point), error(default)))) }
                                td { (front.probability.get(*index).map_or_else(|| "—".to_owned(), |share| percent(*share))) }
                                td { @if point.time.confirmed { "yes" } @else { "no" } }
                                td { (mebibytes(point.memory)) }
                                td { (point.gbuffer_bytes_per_pixel) }
                            }
                        }
                    }
                }
            }
        }
        (tables::near_misses(scene, front))
    }
}
