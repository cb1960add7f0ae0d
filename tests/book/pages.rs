//! The figures of the pages, in a browser without a screen: their elements, their keys, pointers and fingers, and their looks on a wide page and on a phone.

use std::fs;
use std::path::{Path, PathBuf};

use image::{Rgb, RgbImage};

use crate::browser::Browser;
use crate::chapter::project;

/// A picture as mdBook writes it: with a copy behind it, to be shown large.
fn picture(name: &str) -> String {
    format!(
        r#"<label><input type="checkbox" class="checkbox-img"><img src="{name}.png" alt="{name}"><span class="img-wrapper"><img src="{name}.png" alt="{name}"></span></label>"#
    )
}

/// Pictures of one colour each, in each kind of figure.
fn page() -> String {
    let [red, lime, blue, half] = ["red", "lime", "blue", "half"].map(picture);
    format!(
        r#"<!doctype html><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<link rel="stylesheet" href="figures.css"><style>body {{ margin: 0 }} figure {{ margin: 0 !important }} .checkbox-img:not(:checked) ~ .img-wrapper {{ display: none }}</style>
<div class="content">
<figure class="compare"><p>{red}
{blue}</p><figcaption>c</figcaption></figure>
<figure class="steps"><p>{red}</p><p>{lime}</p><p>{blue}</p></figure>
<figure class="probe"><p>{red} {half}</p></figure>
</div>
<script src="figures.js"></script>"#
    )
}

/// The figures of a page, each with the pictures that are seen.
const SHOWN: &str = r#"[...document.querySelectorAll("figure.compare, figure.steps, figure.probe")].map((figure) =>
    figure.classList[0] + ":" + [...figure.querySelectorAll("img")].filter((picture) => picture.offsetWidth > 0).length).join(" ")"#;

/// The addresses that the page has fetched from anywhere but a file.
const FETCHED: &str = r#"performance.getEntriesByType("resource").map((entry) => entry.name).filter((name) => !/^(file|data):/.test(name)).join(" ")"#;

const OVERFLOWS: &str = "document.documentElement.scrollWidth > window.innerWidth";

/// Drawings that are seen narrower than their texts can be read: whose width is below [`LEGIBLE`] pixels, or for which the page scrolls instead of the
/// paragraph of their figure.
fn illegible() -> String {
    format!(
        r#"[...document.querySelectorAll("main svg, main img[src$='.svg']")].filter((drawing) => drawing.checkVisibility()
            && drawing.getBoundingClientRect().width > {ICON}).filter((drawing) => {{
            const around = drawing.closest("figure p");
            const scrolls = around && getComputedStyle(around).overflowX === "auto";
            return !(drawing.getBoundingClientRect().width >= {LEGIBLE} && scrolls);
        }}).map((drawing) => drawing.getAttribute("src") || "a drawing").join(" ")"#
    )
}

/// The least width of a drawing in pixels. At the widths of the book's, about 1000 to 1500 units, their letters are then some 6 pixels high.
const LEGIBLE: u32 = 600;

/// Drawings up to this width are symbols without text.
const ICON: u32 = 32;

fn browser() -> Option<Browser> {
    let browser = Browser::start();
    if browser.is_none() {
        assert!(std::env::var_os("AFTERLIGHT_NEEDS_BROWSER").is_none(), "there is no Chromium");
        eprintln!("NOT RUN: the figures of the book need Chromium");
    }
    browser
}

fn fill(path: &Path, left: [u8; 3], right: [u8; 3]) {
    let image = RgbImage::from_fn(320, 180, |x, _| Rgb(if x < 160 { left } else { right }));
    image.save(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

#[test]
fn figures_follow_mouse_keys_and_fingers_on_wide_screens_and_phones() {
    let Some(mut browser) = browser() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [red, lime, blue] = [[255, 0, 0], [0, 255, 0], [0, 0, 255]];
    for (name, left, right) in [("red", red, red), ("lime", lime, lime), ("blue", blue, blue), ("half", red, blue)] {
        fill(&folder.path().join(name).with_extension("png"), left, right);
    }
    for name in ["figures.css", "figures.js"] {
        fs::copy(project().join("book/theme").join(name), folder.path().join(name)).expect("the book has its theme");
    }
    let path = folder.path().join("page.html");
    fs::write(&path, page()).expect("a page");
    for size in [[1000, 1300], [360, 1800]] {
        browser.open(&path, size);
        let is_phone = size[0] < 500;
        assert_eq!(browser.evaluate("window.innerWidth"), size[0].to_string());
        assert_eq!(browser.evaluate(SHOWN), "compare:2 steps:1 probe:2", "{size:?}");
        assert_eq!(browser.evaluate(OVERFLOWS), "false", "{size:?}");
        assert_eq!(browser.evaluate(r#"document.querySelectorAll("figcaption").length"#), "1");

        let slider = r#"document.querySelector(".compare input[type=range]").value"#;
        let cut = r#"document.querySelector(".compare .figure-over").style.clipPath"#;
        assert_eq!(browser.evaluate(cut), "inset(0px 0px 0px 50%)");
        browser.press(".compare input[type=range]", "ArrowRight", 39);
        assert_eq!([browser.evaluate(slider), browser.evaluate(cut)], ["51", "inset(0px 0px 0px 51%)"], "{size:?}");
        match is_phone {
            true => browser.touch(".compare .figure-frame", [0.75, 0.5]),
            false => browser.drag(".compare .figure-frame", [0.2, 0.5], [0.75, 0.5]),
        }
        assert_eq!(browser.evaluate(slider), "75", "{size:?}");

        let step = r#"[...document.querySelectorAll(".steps img")].filter((picture) => picture.offsetWidth > 0).map((picture) => picture.alt).join()"#;
        assert_eq!(browser.evaluate(step), "red");
        browser.press(".steps input[type=range]", "ArrowRight", 39);
        assert_eq!(browser.evaluate(step), "lime", "{size:?}");
        assert_eq!(browser.evaluate(r#"document.querySelector(".steps .figure-told").textContent"#), "2 of 3: lime");

        // A canvas with pictures of a folder cannot be read; the spot that it magnifies can be.
        let spot = r#"parseFloat(document.querySelector(".probe .figure-spot").style.left).toFixed(1)"#;
        for (share, left) in [(0.1, "6.3"), (0.9, "86.3")] {
            match is_phone {
                true => browser.touch(".probe .figure-frame", [share, 0.1]),
                false => browser.point(".probe .figure-frame", [share, 0.1]),
            }
            assert_eq!(browser.evaluate(spot), left, "{size:?}");
        }
        browser.press(".probe .figure-frame", "ArrowLeft", 37);
        assert_eq!(browser.evaluate(spot), "85.6", "{size:?}");

        // The handle is at three quarters: red before it, blue after it.
        browser.evaluate("window.scrollTo(0, 0)");
        let picture = browser.screenshot();
        let shown = size[0].min(480);
        let (middle, three_quarters) = (shown * 9 / 32, shown * 3 / 4);
        assert_eq!(picture.get_pixel(three_quarters - 20, middle).0, red);
        assert_eq!(picture.get_pixel(three_quarters + 20, middle).0, blue);
        assert!(picture.pixels().any(|pixel| pixel.0 == lime), "the second step is not seen");
    }
}

/// The built pages of chapters, in the folder that `AFTERLIGHT_BOOK_PAGES` names (`scripts/book` builds them).
#[test]
fn built_pages_fit_phones_show_their_figures_and_need_no_network() {
    let Some(folder) = std::env::var_os("AFTERLIGHT_BOOK_PAGES") else {
        eprintln!(
            "NOT RUN: pages of the book that are built, in a browser: AFTERLIGHT_BOOK_PAGES names no folder of them"
        );
        return;
    };
    let folder = fs::canonicalize(project().join(PathBuf::from(folder))).expect("AFTERLIGHT_BOOK_PAGES is a folder");
    let mut browser = Browser::start().expect("there is no Chromium");
    let (mut pages, mut figures, mut wrong) = (0, 0, Vec::new());
    for chapter in crate::chapter::Chapter::all() {
        let path = folder.join(&chapter.name).with_extension("html");
        for size in [[1000, 1300], [360, 740]] {
            browser.open(&path, size);
            let name = format!("{} at {} pixels", chapter.name, size[0]);
            let shown = browser.evaluate(SHOWN);
            for figure in shown.split_whitespace() {
                figures += 1;
                if !matches!(
                    figure.split_once(':'),
                    Some(("compare", "2") | ("steps", "1") | ("probe", "2" | "3" | "4"))
                ) {
                    wrong.push(format!("{name}: a figure shows {figure} pictures"));
                }
            }
            if browser.evaluate(OVERFLOWS) == "true" {
                wrong.push(format!("{name}: it is wider than the screen"));
            }
            let small = browser.evaluate(&illegible());
            if !small.is_empty() {
                wrong.push(format!("{name}: {small} is too small to be read, or stands in no figure that scrolls"));
            }
            let fetched = browser.evaluate(FETCHED);
            if !fetched.is_empty() {
                wrong.push(format!("{name}: it asks for {fetched}"));
            }
        }
        pages += 1;
    }
    println!("{pages} pages, {figures} figures");
    assert!(pages >= 12 && figures > 20, "{pages} pages with {figures} figures");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
