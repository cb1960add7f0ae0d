use roxmltree::Document;

use super::samples::{self, picture};
use super::*;
use crate::report::sweep::model::{Interval, Metric, Point};

fn page(report: &Report) -> String {
    html(report, &picture)
}

/// The page of one scene.
fn page_of(scene: SceneReport) -> String {
    page(&Report { scenes: vec![scene], ..samples::report() })
}

/// Each inline SVG of the page.
fn drawings(page: &str) -> Vec<&str> {
    let begin = page.match_indices("<svg").map(|(at, _)| at);
    begin.map(|at| &page[at..at + page[at..].find("</svg>").expect("an end") + "</svg>".len()]).collect()
}

/// Plots alone, without legends and bars.
fn plots(page: &str) -> Vec<Document<'_>> {
    let plots = drawings(page).into_iter().filter(|svg| svg.starts_with("<svg class=\"plot\""));
    plots.map(|svg| Document::parse(svg).expect("well-formed SVG")).collect()
}

fn tooltips(plot: &Document) -> Vec<String> {
    let titles = plot.descendants().filter(|node| node.has_tag_name("title"));
    titles.map(|title| title.text().unwrap_or_default().to_owned()).collect()
}

#[test]
fn every_drawing_is_well_formed_and_says_what_it_is() {
    let page = page(&samples::report());
    let drawings = drawings(&page);
    assert!(drawings.len() > 20);
    for svg in drawings {
        let document = Document::parse(svg).unwrap_or_else(|error| panic!("{error}: {svg}"));
        let root = document.root_element();
        assert!(root.attribute("aria-label").is_some() || root.attribute("aria-hidden") == Some("true"), "{svg}");
    }
}

/// A phone is narrower than most of them.
#[test]
fn every_table_scrolls_by_itself_where_the_page_is_narrow() {
    let page = page(&samples::report());
    let before: Vec<&str> = page.match_indices("<table").map(|(at, _)| &page[..at]).collect();
    assert!(before.len() > 5 && page.contains("What was left out</h3><div"), "a table of each kind");
    for before in before {
        assert!(before.ends_with(r#"<div class="scroll">"#), "{}", &before[before.len().saturating_sub(200)..]);
    }
}

#[test]
fn elements_are_closed_in_order() {
    let page = page(&samples::report());
    let mut open: Vec<&str> = Vec::new();
    let voids = ["meta", "br", "img", "input", "!DOCTYPE"];
    for tag in page.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').expect("the end of a tag");
        let name = tag.split([' ', '\n', '/']).find(|name| !name.is_empty()).expect("a name");
        match tag {
            tag if tag.starts_with('/') => assert_eq!(open.pop(), Some(name)),
            tag if tag.ends_with('/') || voids.contains(&name) => {}
            _ => open.push(name),
        }
    }
    assert_eq!(open, Vec::<&str>::new());
}

#[test]
fn the_page_needs_nothing_from_outside() {
    let page = page(&samples::report());
    for forbidden in ["http", "<script", "<link", "@import", "url(", "srcset"] {
        assert!(!page.contains(forbidden), "the page has {forbidden}");
    }
    for attribute in [" src=\"", " href=\""] {
        for (at, _) in page.match_indices(attribute) {
            let target = &page[at + attribute.len()..];
            assert!(target.starts_with("data:image/") || target.starts_with('#'), "{:.60}", target);
        }
    }
}

#[test]
fn every_point_is_named_and_has_a_tooltip_in_every_joint_plot() {
    let scene = samples::scene("hall", 3);
    let page = page_of(scene.clone());
    let plots = plots(&page);
    assert_eq!(plots.len(), scene.fronts.len() + scene.families.len());
    for plot in &plots[..scene.fronts.len()] {
        let tooltips = tooltips(plot);
        assert_eq!(tooltips.len(), scene.points.len());
        for point in &scene.points {
            let line = format!("{}\n", point.name);
            assert!(tooltips.iter().any(|tooltip| tooltip.starts_with(&line)), "no tooltip for {}", point.name);
        }
    }
    for point in &scene.points {
        assert!(page.contains(&format!("<code>{}</code>", point.name)), "{} is not named", point.name);
    }
}

#[test]
fn family_plots_show_both_truths_of_every_member_but_where_edges_are_smoothed() {
    let scene = samples::scene("hall", 3);
    let page = page_of(scene.clone());
    let plots = plots(&page);
    for (family, plot) in scene.families.iter().zip(&plots[scene.fronts.len()..]) {
        let truths = if family.key == "msaa" { 1 } else { 2 };
        assert_eq!(tooltips(plot).len(), truths * family.members.len(), "{}", family.key);
        let texts: Vec<&str> = plot.descendants().filter_map(|node| node.text()).collect();
        for member in &family.members {
            assert!(texts.contains(&member.label.as_str()), "{} has no label {}", family.key, member.label);
        }
    }
}

#[test]
fn names_are_text_and_never_markup() {
    let mut scene = samples::scene("<b>&\"hall\"", 3);
    scene.points[0].name = "a<script>&\"".to_owned();
    scene.families[0].title = "<i>title".to_owned();
    scene.left_out[0].reason = "x < y & z".to_owned();
    let page = page_of(scene);
    for raw in ["<b>", "<i>", "<script>", "x < y & z", "&\"hall"] {
        assert!(!page.contains(raw), "{raw} is not escaped");
    }
    assert!(page.contains("&lt;b&gt;&amp;&quot;hall&quot;") && page.contains("a&lt;script&gt;&amp;"));
    for svg in drawings(&page) {
        Document::parse(svg).expect("well-formed SVG");
    }
}

/// Returns the heights of a plot's marks, by the first line of their tooltips.
fn heights(plot: &Document) -> Vec<(String, f64)> {
    let marks =
        plot.descendants().filter(|node| node.attribute("class").is_some_and(|class| class.starts_with("mark")));
    let height = |mark: roxmltree::Node| {
        let title = mark.descendants().find(|node| node.has_tag_name("title"))?.text()?;
        let path = mark.descendants().find(|node| node.has_tag_name("path"))?.attribute("d")?;
        let y = path.split([' ', 'L', 'a']).nth(1)?.parse().ok()?;
        Some((title.lines().next()?.to_owned(), y))
    };
    marks.filter_map(height).collect()
}

#[test]
fn an_error_of_zero_lies_on_the_floor_with_a_mark() {
    let mut scene = samples::scene("hall", 3);
    let exact = 1;
    scene.points[exact].errors.converged.rel_mse = 0.0;
    let name = scene.points[exact].name.clone();
    let page = page_of(scene);
    let plots = plots(&page);
    let heights = heights(&plots[0]);
    let floor = heights.iter().find(|(point, _)| *point == name).expect("the exact point is drawn").1;
    assert!(heights.iter().all(|(point, y)| *point == name || *y < floor - 10.0), "{heights:?}");
    let arrows = plots[0].descendants().filter(|node| node.attribute("class") == Some("arrow")).count();
    assert_eq!(arrows, 1);
}

#[test]
fn what_is_not_finite_is_told_in_words() {
    let mut scene = samples::scene("hall", 3);
    scene.points[2].errors.converged.flip = f64::NAN;
    scene.points[3].errors.point.not_finite = 7;
    let page = page_of(scene.clone());
    assert!(page.contains("Not drawn") && page.contains("7 pixels"));
    let flip = &plots(&page)[2];
    assert_eq!(tooltips(flip).len(), scene.points.len() - 1);
}

#[test]
fn a_default_off_the_front_is_told_with_what_beats_it() {
    let mut scene = samples::scene("hall", 3);
    let default = scene.default;
    scene.points[default].time.wall.median *= 1.5;
    for front in &mut scene.fronts {
        front.points.retain(|point| *point != default);
    }
    let page = page_of(scene);
    assert!(page.contains("not on the front") && page.contains("less time and has"));
    assert!(!page.contains(">on the front<"));
}

#[test]
fn the_first_paragraph_says_what_to_change() {
    let mut scene = samples::scene("hall", 3);
    let first = |scene: &SceneReport| {
        let page = page_of(scene.clone());
        let (_, section) = page.split_once("<section class=\"scene\"").expect("a scene");
        let (_, lead) = section.split_once("<p class=\"lead\">").expect("a first paragraph");
        lead.split_once("</p>").expect("its end").0.to_owned()
    };
    // No ratio of the sample is told apart from 1, and so nothing is faster; some are nearer to the truth.
    let best = scene.fronts.iter().find(|front| front.metric == Metric::Flip).and_then(|front| front.points.last());
    let best = *best.expect("a front");
    assert!(first(&scene).starts_with("What to change: <code>"), "{}", first(&scene));
    for front in &mut scene.fronts {
        front.points = vec![scene.default, best];
    }
    let told = first(&scene);
    assert!(told.contains(&format!("<code>{}</code>: the same time within noise", scene.points[best].name)), "{told}");
    assert!(told.contains("<a href=\"#flip\">") && page_of(scene.clone()).contains("id=\"flip\""));
    for front in &mut scene.fronts {
        front.points = vec![scene.default];
    }
    assert!(first(&scene).starts_with("What to change: nothing."), "{}", first(&scene));
}

#[test]
fn no_badge_says_on_the_front_below_an_even_probability() {
    let mut scene = only_the_default();
    for (front, probability) in scene.fronts.iter_mut().zip([0.49, 0.5, 0.2, 1.0]) {
        front.probability = vec![probability];
    }
    let page = page_of(scene);
    assert_eq!((page.matches(">on the front<").count(), page.matches(">not told<").count()), (2, 2));
}

fn only_the_default() -> SceneReport {
    let mut scene = samples::scene("hall", 3);
    scene.points.truncate(1);
    scene.families.clear();
    scene.attributions.clear();
    scene.left_out.clear();
    for front in &mut scene.fronts {
        front.points = vec![0];
        front.probability = vec![1.0];
    }
    scene
}

#[test]
fn one_point_is_a_report_too() {
    let page = page_of(only_the_default());
    assert_eq!(plots(&page).len(), 4);
    assert!(page.contains(">on the front<"));
}

#[test]
fn a_report_of_nothing_says_so() {
    assert!(page(&Report { scenes: Vec::new(), ..samples::report() }).contains("No scene was measured"));
    let mut scene = only_the_default();
    scene.points.clear();
    scene.fronts.clear();
    let page = page_of(scene);
    assert!(page.contains("The default settings were not measured") && page.contains("No setting was varied"));
}

#[test]
fn times_are_the_devices_own_where_it_has_a_clock() {
    let on_device = |point: &mut Point| {
        point.time.gpu = Some(Interval { median: 0.5, low: 0.49, high: 0.51, count: 9 });
        point.time.cpu = None;
    };
    let mut scene = samples::scene("hall", 3);
    assert!(page_of(scene.clone()).contains("wall-clock time, ms a picture"));
    scene.points.iter_mut().for_each(on_device);
    let page = page_of(scene);
    assert!(page.contains("device time, ms a picture") && page.contains("0.500 ms"));
}

#[test]
fn pictures_are_in_the_page_and_missing_ones_are_named() {
    let report = samples::report();
    let page = html(&report, &|file| if file.contains("fat") { None } else { picture(file) });
    assert_eq!(page.matches("src=\"data:image/").count(), 2 * 4);
    assert!(page.contains("fat-picture.png"));
}

#[test]
fn parts_of_the_error_add_up_where_their_bars_end() {
    let page = page_of(samples::scene("hall", 3));
    let bars = drawings(&page).into_iter().filter(|svg| svg.contains("of the squared error"));
    let ends = |svg: &str| {
        let document = Document::parse(svg).expect("well-formed SVG");
        let rectangle = document.descendants().find(|node| node.has_tag_name("rect")).expect("a bar");
        let number = |name| {
            rectangle.attribute(name).and_then(|text| text.trim_end_matches('%').parse::<f64>().ok()).expect("a number")
        };
        (rectangle.attribute("class") == Some("minus"), number("x"), number("x") + number("width"))
    };
    let bars: Vec<_> = bars.map(ends).collect();
    let (whole, parts) = bars.split_last().expect("bars");
    let (negative, left, right) = parts.last().expect("parts");
    assert!(*negative, "the sample's last part works against the others");
    assert!((left - whole.2).abs() < 0.3, "the parts end where the whole does: {left} against {}", whole.2);
    assert!(*right > whole.2);
}

/// Writes the sample's page, to be looked at: `AFTERLIGHT_PAGE=page.html cargo test -p afterlight-lab --features report report::page -- --ignored`.
#[test]
#[ignore = "writes a file for people"]
fn the_sample_page_is_written() {
    let Some(path) = std::env::var_os("AFTERLIGHT_PAGE") else { return };
    std::fs::write(path, page(&samples::report())).expect("a file that can be written");
}
