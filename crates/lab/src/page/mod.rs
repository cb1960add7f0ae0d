//! The look of every page: one style, one frame, one kind of plot, and pictures within the page. A page needs nothing else: no network, no files beside it
//! and no scripts. Plots are inline SVG; colours follow the reader's scheme and print in the light one.

pub mod marks;
pub mod pictures;
pub mod plot;
pub mod scales;

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// As one line in the page's head.
const STYLE: &str = include_str!("style.css");

/// A page with this title and body.
pub fn page(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}
