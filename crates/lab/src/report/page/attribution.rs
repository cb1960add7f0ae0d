//! The parts of the error by their causes: signed shares that add up to the whole, each bar beginning where the last one ended.

use maud::{Markup, html};

use super::words::{grouped, number, percent};
use crate::report::sweep::model::{AttributedPart, Attribution, SceneReport};

/// The row that the others add up to.
const WHOLE: &str = "whole";
/// The width of a bar's drawing, from end to end.
const WIDTH: f64 = 100.0;

pub fn tables(scene: &SceneReport) -> Markup {
    html! {
        @if scene.attributions.is_empty() { p.none { "No frame was taken apart." } }
        @else {
            p {
                "Shares of the mean squared error in exposed linear light, against the converged truth. They add up to the whole; a negative \
                 one works against the others. Surface, shadows, arithmetic and the formats of light and picture depend on one \
                 another: they are averaged over all orders in which they can be put right (Shapley). Sampling, light cut-off, other \
                 triangles, transparent surfaces and what is not explained are taken once, as differences. BRDF arithmetic is modelled on the \
                 CPU, and so is what formats make of light that was never drawn; all else is measured on the device."
            }
        }
        @for attribution in &scene.attributions { (table(scene, attribution)) }
    }
}

/// A bar: where it begins and ends, in shares of the whole.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bar {
    from: f64,
    to: f64,
}

/// The parts, the largest first, each with its bar; parts without a share have no bar.
fn bars(parts: &[AttributedPart]) -> Vec<(&AttributedPart, Option<Bar>)> {
    let mut parts: Vec<&AttributedPart> = parts.iter().filter(|part| part.name != WHOLE).collect();
    parts.sort_by(|a, b| b.share.total_cmp(&a.share));
    let mut end = 0.0;
    let bar = |part| {
        let part: &AttributedPart = part;
        let bar = part.share.is_finite().then_some(Bar { from: end, to: end + part.share });
        end = bar.map_or(end, |bar| bar.to);
        (part, bar)
    };
    parts.into_iter().map(bar).collect()
}

fn table(scene: &SceneReport, attribution: &Attribution) -> Markup {
    let bars = bars(&attribution.parts);
    let ends = bars.iter().filter_map(|(_, bar)| *bar).flat_map(|bar| [bar.from, bar.to]);
    let (low, high) = ends.fold((0.0_f64, 1.0_f64), |(low, high), end| (low.min(end), high.max(end)));
    let pad = 0.02 * (high - low);
    let place = move |share: f64| (share - low + pad) / (high - low + 2.0 * pad) * WIDTH;
    let whole = attribution.parts.iter().find(|part| part.name == WHOLE);
    let name = scene.points.get(attribution.point).map_or("a point that is not in this report", |point| &point.name);
    html! {
        div.scroll {
            table.parts {
                caption.words {
                    "Of " code { (name) } ", " (grouped(attribution.pixels)) " of " (grouped(attribution.of_pixels)) " pixels taken apart. "
                    "Before a picture is made of it, its light has an RMSE of " (number(attribution.light_rms))
                }
                thead { tr {
                    th.words { "part" } th.words { "share of the squared error" } th { "share" } th { "mean" } th { "RMS" } th.words { "" }
                } }
                tbody {
                    @for (part, bar) in &bars { (row(part, *bar, &place)) }
                    @if let Some(whole) = whole { (row(whole, Some(Bar { from: 0.0, to: 1.0 }), &place)) }
                }
            }
        }
    }
}

fn share_of_width(percent: f64) -> String {
    format!("{percent:.2}%")
}

fn row(part: &AttributedPart, bar: Option<Bar>, place: &dyn Fn(f64) -> f64) -> Markup {
    let is_whole = part.name == WHOLE;
    let label = format!("{}: {} of the squared error", part.name, percent(part.share));
    html! {
        tr class=[is_whole.then_some("sum")] {
            td.words { (part.name) }
            td.bar {
                // Widths are shares of the cell, heights pixels: so that bars are of one height in rows of any.
                svg role="img" aria-label=(label) {
                    title { (label) }
                    @for share in [0.0, 1.0] {
                        line.guide x1=(share_of_width(place(share))) x2=(share_of_width(place(share))) y1="0" y2="100%" {}
                    }
                    @if let Some(bar) = bar {
                        @let (left, right) = (place(bar.from.min(bar.to)), place(bar.from.max(bar.to)));
                        @let kind = if is_whole { "sum" } else if bar.to < bar.from { "minus" } else { "plus" };
                        @if !is_whole {
                            line.link x1=(share_of_width(place(bar.from))) x2=(share_of_width(place(bar.from))) y1="0" y2="50%" {}
                            line.link x1=(share_of_width(place(bar.to))) x2=(share_of_width(place(bar.to))) y1="50%" y2="100%" {}
                        }
                        rect class=(kind) x=(share_of_width(left)) width=(share_of_width((right - left).max(0.2))) y="50%" height="16"
                            transform="translate(0 -8)" {}
                    }
                }
            }
            td { (percent(part.share)) } td { (number(part.mean)) } td { (number(part.rms)) }
            td.words.note { (part.note) }
        }
    }
}
