//! Thumbnails of chosen points with their difference from the truth, in the page itself.

use maud::{Markup, html};

use super::words::{self, number};
use crate::page::pictures::{enlarged, small};
use crate::report::sweep::model::{Point, SceneReport};

/// The bytes of a PNG file beside the report, by its name.
pub type PictureLookup<'a> = &'a dyn Fn(&str) -> Option<Vec<u8>>;

pub fn pairs(scene: &SceneReport, pictures: PictureLookup) -> Markup {
    let chosen: Vec<&Point> = scene.points.iter().filter(|point| !point.pictures.is_empty()).collect();
    html! {
        @if chosen.is_empty() { p.none { "No pictures were kept." } }
        @else { p { "A picture fills the window when it is chosen, and goes back when it is chosen again." } }
        div.pictures { @for point in chosen { (card(scene, point, pictures)) } }
    }
}

fn card(scene: &SceneReport, point: &Point, pictures: PictureLookup) -> Markup {
    let of_default = scene.points.get(scene.default).is_some_and(|default| default.name == point.name);
    // First the picture, then the pictures of its error.
    let mut files: Vec<(&String, &String)> = point.pictures.iter().collect();
    files.sort_by_key(|(shows, _)| (shows.as_str() != "picture", shows.as_str()));
    html! {
        figure {
            h4 { code { (point.name) } @if of_default && point.name != "default" { " (default)" } }
            div.pair {
                @for (shows, file) in files { (picture(&point.name, shows, file, pictures(file))) }
            }
            figcaption {
                (number(point.time.decisive().median)) " ms, relMSE " (number(point.errors.converged.rel_mse)) ", FLIP "
                (number(point.errors.converged.flip))
                @if point.errors.converged.not_finite > 0 {
                    ", " (words::counted(point.errors.converged.not_finite, "pixel")) " not finite"
                }
            }
        }
    }
}

fn picture(point: &str, shows: &str, file: &str, bytes: Option<Vec<u8>>) -> Markup {
    html! {
        @if let Some(bytes) = bytes {
            (enlarged(shows, &format!("of {point}"), &format!("{shows} with {point}"), &small(&bytes)))
        } @else {
            p.none { "The " (shows) " is missing: no file " code { (file) } "." }
        }
    }
}
