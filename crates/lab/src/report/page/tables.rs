//! The figures of all points, in full.

use maud::{Markup, html};

use super::words::{self, mebibytes, number, percent};
use crate::report::sweep::model::{ErrorMetrics, Front, Interval, Point, SceneReport};

/// From this probability on, a point that is off the front is named beside it.
const NEAR: f64 = 0.05;

/// Every point with every figure.
pub fn all_points(scene: &SceneReport) -> Markup {
    html! {
        details {
            summary { "All figures of " (words::counted(scene.points.len(), "point")) }
            div.scroll {
                table {
                    thead {
                        tr { th.words { "settings" } th { "wall, ms" } th { "device, ms" } th { "CPU, ms" } th { "memory" } th { "G-buffer," br; "bytes a pixel" } }
                    }
                    tbody { @for (index, point) in scene.points.iter().enumerate() {
                        tr class=[(index == scene.default).then_some("default")] {
                            td.words { code { (point.name) } }
                            td { (interval(Some(&point.time.wall))) } td { (interval(point.time.gpu.as_ref())) }
                            td { (interval(point.time.cpu.as_ref())) } td { (mebibytes(point.memory)) } td { (point.gbuffer_bytes_per_pixel) }
                        }
                    } }
                }
            }
            (errors(scene, "All of the error, against the converged truth", |point| &point.errors.converged))
            (errors(scene, "Numeric error and texture filtering, against the point truth", |point| &point.errors.point))
        }
    }
}

fn errors(scene: &SceneReport, title: &str, of: impl Fn(&Point) -> &ErrorMetrics) -> Markup {
    html! {
        div.scroll {
            table {
                caption.words { (title) }
                thead { tr {
                    th.words { "settings" } th { "relMSE" } th { "RMSE" } th { "p99.9" } th { "largest" } th { "FLIP" } th { "PSNR" }
                    th { "not finite" }
                } }
                tbody { @for (index, point) in scene.points.iter().enumerate() {
                    @let errors = of(point);
                    tr class=[(index == scene.default).then_some("default")] {
                        td.words { code { (point.name) } }
                        td { (number(errors.rel_mse)) } td { (number(errors.rmse)) } td { (number(errors.p99_9)) } td { (number(errors.max)) }
                        td { (number(errors.flip)) }
                        td { (errors.psnr_db.map_or_else(|| "equal".to_owned(), |db| format!("{} dB", number(db)))) }
                        td { (errors.not_finite) }
                    }
                } }
            }
        }
    }
}

fn interval(interval: Option<&Interval>) -> Markup {
    html! {
        @if let Some(time) = interval {
            (number(time.median)) span.aside { " (" (number(time.low)) " to " (number(time.high)) ", n " (time.count) ")" }
        } @else { "—" }
    }
}

/// Points that a little luck would have put on the front.
pub fn near_misses(scene: &SceneReport, front: &Front) -> Markup {
    let near = scene.points.iter().zip(&front.probability).enumerate();
    let near: Vec<_> =
        near.filter(|(index, (_, probability))| **probability >= NEAR && !front.points.contains(index)).collect();
    html! {
        @if !near.is_empty() {
            details {
                summary { (words::counted(near.len(), "point")) " that may be on it too" }
                p { @for (place, (_, (point, probability))) in near.iter().enumerate() {
                    @if place > 0 { ", " }
                    code { (point.name) } " (" (percent(**probability)) ")"
                } "." }
            }
        }
    }
}

/// Lists the points that could not be measured, by reason.
pub fn left_out(scene: &SceneReport) -> Markup {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for left_out in &scene.left_out {
        match reasons.iter_mut().find(|(reason, _)| *reason == left_out.reason) {
            Some((_, names)) => names.push(&left_out.name),
            None => reasons.push((&left_out.reason, vec![&left_out.name])),
        }
    }
    html! {
        @if reasons.is_empty() {
            p { "Nothing: all settings of the sweep were measured." }
        } @else {
            div.scroll {
                table {
                    thead { tr { th.words { "settings" } th.words { "why" } } }
                    tbody { @for (reason, names) in &reasons {
                        tr {
                            td.words { @for (index, name) in names.iter().enumerate() { @if index > 0 { ", " } code { (name) } } }
                            td.words { (reason) }
                        }
                    } }
                }
            }
        }
    }
}
