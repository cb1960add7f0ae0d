//! The figures of the pages, in a browser without a screen: their elements, their keys and pointers, and their looks on a wide page and on a narrow
//! one.

use std::fs;
use std::path::Path;
use std::process::Command;

use image::{Rgb, RgbImage};

use crate::chapter::project;

/// Pictures of one colour each, in each kind of figure; in the first as mdBook makes them.
const PAGE: &str = r#"<!doctype html><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<link rel="stylesheet" href="figures.css"><style>body { margin: 0 } figure { margin: 0 !important }</style>
<div class="content">
<figure class="compare"><p><label><input type="checkbox"><img src="red.png" alt="red"><span class="img-wrapper"><img src="red.png" alt="red"></span></label>
<label><input type="checkbox"><img src="blue.png" alt="blue"><span class="img-wrapper"><img src="blue.png" alt="blue"></span></label></p><figcaption>c</figcaption></figure>
<figure class="steps"><p><img src="red.png" alt="red"></p><p><img src="lime.png" alt="lime"></p><p><img src="blue.png" alt="blue"></p></figure>
<figure class="probe"><p><img src="red.png" alt="red"> <img src="half.png" alt="half"></p></figure>
</div>
<script src="figures.js"></script><script src="drive.js"></script>"#;

/// Drives the figures as a reader would, and leaves its findings in the page.
const DRIVE: &str = r#"
window.addEventListener("load", () => {
    const told = [];
    const tell = (name, value) => told.push(`${name}=${value}`);
    const find = (selector) => document.querySelector(selector);
    const slide = (selector, value) => {
        find(selector).value = value;
        find(selector).dispatchEvent(new Event("input"));
    };
    tell("compare-first", find(".compare .figure-over").style.clipPath);
    slide(".compare input[type=range]", 25);
    tell("compare-slid", find(".compare .figure-over").style.clipPath);
    const box = find(".compare .figure-frame").getBoundingClientRect();
    find(".compare .figure-frame").dispatchEvent(new PointerEvent("pointermove", { buttons: 1, clientX: box.left + box.width * 0.75, bubbles: true }));
    tell("compare-dragged", find(".compare input[type=range]").value);
    const shown = () => [...document.querySelectorAll(".steps img")].filter((picture) => getComputedStyle(picture).display !== "none").map((picture) => picture.alt).join();
    tell("steps-first", shown());
    slide(".steps input", 1);
    tell("steps-slid", shown());
    tell("steps-told", find(".steps .figure-told").textContent);
    const frame = find(".probe .figure-frame");
    const area = frame.getBoundingClientRect();
    const point = (x) => frame.dispatchEvent(new PointerEvent("pointermove", { clientX: area.left + area.width * x, clientY: area.top + 10 }));
    // A canvas with pictures of a folder cannot be read; where the spot is that it magnifies can be.
    const spot = () => parseFloat(find(".probe .figure-spot").style.left).toFixed(1);
    point(0.1);
    tell("probe-left", spot());
    point(0.9);
    tell("probe-right", spot());
    frame.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
    tell("probe-key", spot());
    tell("captions", document.querySelectorAll("figcaption").length);
    tell("overflow", document.documentElement.scrollWidth > window.innerWidth);
    document.title = told.join(" ");
    document.body.dataset.told = told.join(" ");
});
"#;

fn browser() -> Option<&'static str> {
    let names = ["chromium", "google-chrome", "chromium-browser"];
    names
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success()))
}

fn fill(path: &Path, left: [u8; 3], right: [u8; 3]) {
    let image = RgbImage::from_fn(320, 180, |x, _| Rgb(if x < 160 { left } else { right }));
    image.save(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

/// Opens a page, and returns the browser's output.
fn open(browser: &str, folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(browser);
    command.args([
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        "--hide-scrollbars",
    ]);
    command.arg(format!("--user-data-dir={}", folder.join("profile").display())).arg("--virtual-time-budget=2000");
    let output =
        command.args(arguments).arg(folder.join("page.html")).current_dir(folder).output().expect("the browser starts");
    assert!(output.status.success(), "{browser}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn figures_follow_pointer_and_keys_on_wide_and_narrow_screens() {
    let Some(browser) = browser() else {
        assert!(std::env::var_os("AFTERLIGHT_NEEDS_BROWSER").is_none(), "there is no Chromium");
        eprintln!("NOT RUN: the figures of the book need Chromium");
        return;
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [red, lime, blue] = [[255, 0, 0], [0, 255, 0], [0, 0, 255]];
    for (name, left, right) in [("red", red, red), ("lime", lime, lime), ("blue", blue, blue), ("half", red, blue)] {
        fill(&folder.path().join(name).with_extension("png"), left, right);
    }
    for name in ["figures.css", "figures.js"] {
        fs::copy(project().join("book/theme").join(name), folder.path().join(name)).expect("the book has its theme");
    }
    fs::write(folder.path().join("page.html"), PAGE).expect("a page");
    fs::write(folder.path().join("drive.js"), DRIVE).expect("a script");
    for (width, height, shown) in [(1000, 1300, 480), (360, 1800, 360)] {
        let size = format!("--window-size={width},{height}");
        let page = open(browser, folder.path(), &[&size, "--dump-dom"]);
        let told =
            page.split_once("data-told=\"").and_then(|(_, rest)| rest.split_once('"')).map_or("", |(told, _)| told);
        for expected in [
            "compare-first=inset(0px 0px 0px 50%)",
            "compare-slid=inset(0px 0px 0px 25%)",
            "compare-dragged=75",
            "steps-first=red",
            "steps-slid=lime",
            "steps-told=2 of 3: lime",
            "probe-left=6.3",
            "probe-right=86.3",
            "probe-key=85.6",
            "captions=1",
            "overflow=false",
        ] {
            assert!(told.contains(expected), "{width} pixels wide: not {expected}, but {told}");
        }
        let picture = folder.path().join(format!("{width}.png"));
        open(browser, folder.path(), &[&size, &format!("--screenshot={}", picture.display())]);
        let picture =
            image::open(&picture).unwrap_or_else(|error| panic!("{}: {error}", picture.display())).into_rgb8();
        // The handle is at three quarters: red before it, blue after it.
        let (middle, three_quarters) = (shown * 9 / 32, shown * 3 / 4);
        assert_eq!(picture.get_pixel(three_quarters - 20, middle).0, red);
        assert_eq!(picture.get_pixel(three_quarters + 20, middle).0, blue);
        assert!(picture.pixels().any(|pixel| pixel.0 == lime), "the second step is not seen");
    }
}
