//! The report as one page. It only shows the figures of a [`Report`]; nothing is measured or judged anew here.

mod attribution;
mod family;
mod front;
mod pictures;
mod reading;
#[cfg(test)]
pub(super) mod samples;
mod summary;
mod tables;
#[cfg(test)]
mod tests;
mod words;

use maud::{Markup, html};

use self::pictures::PictureLookup;
use super::sweep::model::{Machine, Report, SceneReport};
use crate::page::page;
use afterlight_truth::measure::what_moves;

/// The page. `pictures` gives the bytes of a PNG file beside the report by its name; the page says which pictures are missing.
pub fn html(report: &Report, pictures: PictureLookup) -> String {
    let body = html! {
        (header(report))
        main {
            @if report.scenes.is_empty() { p.none { "No scene was measured." } }
            @for (index, scene) in report.scenes.iter().enumerate() { (scene_section(scene, index, pictures)) }
            (reading::section())
        }
    };
    page(&format!("Error against run time: {}", report.machine.device), &body)
}

fn header(report: &Report) -> Markup {
    let machine = &report.machine;
    html! {
        header {
            p.eyebrow { "Afterlight " (report.version) }
            h1 { "Error against run time" }
            p.lead { "How far the pictures of each choice of settings are from the truth, and what they cost, on " (machine.device) "." }
            dl.facts {
                @for (name, value) in facts(report, machine) { div { dt { (name) } dd { (value) } } }
            }
            nav aria-label="Contents" {
                @for (index, scene) in report.scenes.iter().enumerate() { a href=(format!("#scene-{index}")) { (scene.name) } }
                a href="#reading" { "How to read this" }
            }
        }
    }
}

fn facts(report: &Report, machine: &Machine) -> Vec<(&'static str, String)> {
    let mut facts = vec![
        ("Device", machine.device.clone()),
        ("Driver", machine.driver.clone()),
        ("Processor", machine.cpu.clone()),
        ("System", machine.os.clone()),
        ("Threads", machine.threads.to_string()),
    ];
    facts.extend(machine.driver_threads.map(|threads| ("Threads that the driver draws with", threads.to_string())));
    facts.push(match machine.software {
        true => ("Clock", "wall clock, as a CPU draws".to_owned()),
        false => ("Clock", "the device's own, where it has one".to_owned()),
    });
    let shard = report.shard.map(|shard| ("Part of the sweep", format!("{} of {}", shard.index, shard.count)));
    facts.extend(shard);
    facts
}

fn scene_section(scene: &SceneReport, index: usize, pictures: PictureLookup) -> Markup {
    html! {
        section.scene id=(format!("scene-{index}")) {
            h2 { (scene.name) }
            p.meta {
                (scene.size[0]) " × " (scene.size[1]) " pixels, " (words::counted(scene.triangles, "triangle")) ", "
                (words::counted(scene.lights, "light")) ", " (words::percent(scene.truth.sky)) " of the pixels sky; truth of "
                (words::counted(scene.truth.samples as usize, "sample")) " a pixel; times: " (what_moves(scene.moving))
                @if let Some(clocks) = scene.clocks() { "; " strong { (clocks) } }
            }
            (summary::paragraphs(scene))
            @if !scene.fronts.is_empty() { h3 { "The front" } (front::tabs(scene, index)) }
            (tables::all_points(scene))
            h3 { "One setting at a time" }
            (family::figures(scene))
            h3 { "Where the error comes from" }
            (attribution::tables(scene))
            (other_triangles(scene))
            h3 { "Pictures" }
            (pictures::pairs(scene, pictures))
            h3 { "What was left out" }
            (tables::left_out(scene))
        }
    }
}

fn other_triangles(scene: &SceneReport) -> Markup {
    html! {
        p {
            @match scene.truth.other_triangle {
                Some(share) => {
                    "On " strong { (words::percent(share)) } " of the pixels the rasterizer and the truth see different triangles at the pixel's \
                     centre: rasterizers snap corners to a fraction of a pixel. That is error of coverage, and a part of its own."
                }
                None => "On which pixels the rasterizer and the truth see different triangles was not found out on this device.",
            }
        }
    }
}
