use std::collections::BTreeSet;
use std::sync::LazyLock;

use super::model::Graph;
use super::{draw, draw_hazards, hazards, layout};
use afterlight::frame::render_pass::PassDescription;
use afterlight::frame::rows::{self, Rows};
use afterlight::plan::{FramePlan, samples};
use afterlight::scene::{LightPath, Settings, View};

/// One plan for each different frame: many samples differ only in facts that no drawing shows.
fn plans() -> &'static [(String, FramePlan, Rows)] {
    static PLANS: LazyLock<Vec<(String, FramePlan, Rows)>> = LazyLock::new(|| {
        let mut seen = BTreeSet::new();
        // `make test-all` looks at each of them.
        let every = if std::env::var("AFTERLIGHT_TESTS").is_ok_and(|value| value == "all") { 1 } else { 61 };
        let all = samples::of_every_kind();
        let all = all.into_iter().step_by(every);
        let with_rows = all.map(|(name, plan)| {
            let edges = rows::table(&plan);
            (name, plan, edges)
        });
        with_rows.filter(|(_, plan, edges)| seen.insert(draw("x", plan, edges))).collect()
    });
    &PLANS
}

/// The names of all groups of a kind.
fn groups(document: &roxmltree::Document, kind: &str) -> Vec<String> {
    let attribute = format!("data-{kind}");
    document.descendants().filter_map(|node| node.attribute(attribute.as_str())).map(str::to_owned).collect()
}

fn sorted(mut names: Vec<String>) -> Vec<String> {
    names.sort();
    names
}

#[test]
fn a_drawing_is_xml_that_has_what_the_frame_has_and_nothing_else() {
    let plans = plans();
    assert!(plans.len() > 30, "only {} different frames", plans.len());
    for (name, plan, edges) in plans {
        let text = draw("<a & b>", plan, edges);
        let document = roxmltree::Document::parse(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let passes = PassDescription::all(plan, edges);
        let drawn = groups(&document, "pass");
        assert_eq!(sorted(drawn), sorted(passes.iter().map(|pass| pass.name.to_string()).collect()), "{name}");
        let subpasses: usize = passes.iter().map(|pass| pass.subpasses.len()).sum();
        assert_eq!(groups(&document, "subpass").len(), subpasses, "{name}");
        let maps = plan.shadow.as_ref().map_or(0, |own| 1 + usize::from(own.tinted));
        let images = plan.targets().count() + maps;
        assert_eq!(groups(&document, "image").len(), images, "{name}");
        let rows: Vec<String> = edges.iter().map(|edge| edge.name.to_string()).collect();
        assert_eq!(sorted(groups(&document, "dependency")), sorted(rows), "{name}");
        for edge in edges.iter() {
            let group = document.descendants().find(|node| node.attribute("data-dependency") == Some(edge.label));
            let group = group.expect("drawn");
            let words: String =
                group.descendants().filter(|node| node.is_text()).filter_map(|node| node.text()).collect();
            let words: String = words.split_whitespace().collect();
            let masks = [edge.before, edge.after].map(|side| [side.stages(), side.accesses()]);
            for mask in masks.as_flattened().iter().map(String::as_str).chain([edge.why.as_str()]) {
                let mask: String = mask.split_whitespace().collect();
                assert!(words.contains(&mask), "{name}: {} lacks {mask}: {words}", edge.name);
            }
            assert_eq!(words.contains("byregion"), edge.by_region, "{name}: {}", edge.name);
            let dashed =
                group.descendants().filter(|node| node.attribute("class").is_some_and(|c| c.contains("by-region")));
            assert_eq!(dashed.count(), usize::from(edge.by_region), "{name}: {}", edge.name);
        }
        assert!(!text.contains("<script") && !text.contains("href"), "{name}: not self-contained");
    }
}

#[test]
fn no_text_lies_on_another_or_outside_of_the_page() {
    for (name, plan, edges) in plans() {
        let (svg, width, height) = layout::paint("builtin:hall", plan, &Graph::of(plan, edges));
        for (index, (text, words)) in svg.texts.iter().enumerate() {
            assert!(text.x >= 0.0 && text.x + text.width <= width, "{name}: {words} is wider than the page");
            assert!(text.y >= 0.0 && text.y + text.height <= height, "{name}: {words} is below the page");
            for (other, others) in &svg.texts[..index] {
                assert!(!text.overlaps(other), "{name}: '{words}' lies on '{others}'");
            }
        }
    }
}

/// Marks agree with the references of the render passes.
#[test]
fn every_reference_of_a_subpass_is_a_mark() {
    for (name, plan, edges) in plans() {
        let graph = Graph::of(plan, edges);
        for subpass in PassDescription::all(plan, edges).into_iter().flat_map(|pass| pass.subpasses) {
            let stop = graph.stops.iter().find(|stop| stop.place == subpass.place).expect("a stop");
            let used = |list: &[ash::vk::AttachmentReference]| {
                list.iter().filter(|reference| reference.attachment != ash::vk::ATTACHMENT_UNUSED).count()
            };
            let references = used(&subpass.input)
                + used(&subpass.color)
                + used(&subpass.resolve)
                + usize::from(subpass.depth.is_some())
                + subpass.preserve.len();
            let marks = stop.touches.iter().filter(|touch| touch.attached).count();
            assert_eq!(marks, references, "{name}: {}", stop.name);
        }
        for image in 0..graph.images.len() {
            assert!(graph.life(image).is_some(), "{name}: nobody touches {}", graph.images[image].name);
        }
    }
}

#[test]
fn a_view_is_not_called_lighting() {
    let settings = Settings { view: View::Normal, ..Settings::default() };
    let scene = samples::scene(vec![samples::emissive()], vec![samples::sun()]);
    let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
    assert!(draw("x", &plan, &rows::table(&plan)).contains("shows a buffer"));
}

fn strips(plan: &FramePlan, rows: &Rows) -> Vec<hazards::Strip> {
    rows.iter().map(|row| hazards::Strip::of(plan, rows, row)).collect()
}

#[test]
#[ignore = "test-all: a drawing for each kind of plan"]
fn every_row_is_a_strip_with_its_reason_and_a_hazard_or_why_it_stays() {
    for (name, plan, edges) in plans() {
        let rows: Vec<_> = edges.iter().collect();
        let text = draw_hazards("<a & b>", plan, edges, &rows);
        let document = roxmltree::Document::parse(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(
            groups(&document, "dependency"),
            rows.iter().map(|row| row.name.name()).collect::<Vec<_>>(),
            "{name}"
        );
        for (strip, row) in strips(plan, edges).iter().zip(&rows) {
            let kinds: Vec<_> = strip.pairs.iter().flat_map(|pair| &pair.arrows).map(|arrow| arrow.kind).collect();
            let stays = row.carrier.stays().is_some();
            let is_covered = strip.below_says("other dependencies order the same");
            assert_eq!(kinds.is_empty(), is_covered, "{name}: {}", row.name);
            assert!(kinds.iter().all(|kind| kind.is_none() == stays), "{name}: {}: {kinds:?}", row.name);
            assert_eq!(stays, strip.below_says("cannot be dropped"), "{name}: {}", row.name);
            assert!(strip.below_says(&row.why), "{name}: {}", row.name);
        }
    }
}

#[test]
fn no_text_of_the_hazards_lies_on_another_or_outside_of_the_page() {
    for (name, plan, edges) in plans() {
        let (svg, height) = hazards::paint("builtin:hall", &strips(plan, edges));
        for (index, (text, words)) in svg.texts.iter().enumerate() {
            assert!(text.x >= 0.0 && text.x + text.width <= 900.0, "{name}: {words} is wider than the page");
            assert!(text.y >= 0.0 && text.y + text.height <= height, "{name}: {words} is below the page");
            // Texts are set from top to bottom, but for the columns of a pair of boxes.
            for (other, others) in &svg.texts[index.saturating_sub(60)..index] {
                assert!(!text.overlaps(other), "{name}: '{words}' lies on '{others}'");
            }
        }
    }
}

/// Resources that frames in flight share are named with the frame, and an access that a layout change overtook in place of the change.
#[test]
fn a_strip_shows_the_earlier_use_of_another_frame() {
    let scene = samples::scene(vec![samples::emissive()], vec![samples::sun()]);
    let settings = Settings { light_path: LightPath::Loop, ..Settings::default() };
    let plan = FramePlan::of(&scene, &settings, &samples::device()).expect("a plan");
    let edges = rows::table(&plan);
    let drawn = |name| draw_hazards("x", &plan, &edges, &[edges.named(name, |_| true).expect("a row")]);
    let reuse = drawn("geometry-reuse");
    assert!(reuse.contains("LIGHTING of the last frame") && reuse.contains("(store operation)"), "{reuse}");
    let lighting = drawn("geometry-to-lighting");
    assert!(lighting.contains("read after write") && !lighting.contains("use after layout change"), "{lighting}");
}
