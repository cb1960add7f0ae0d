use egui::Shape;

use super::content::{described, reasons};
use super::*;
use crate::overlay::context;
use afterlight::gpu::Validation;
use afterlight::plan::samples;
use afterlight::scene::Material;

fn plan() -> FramePlan {
    let scene = samples::scene(vec![Material::default()], vec![samples::sun()]);
    FramePlan::of(&scene, &samples::deferred(), &samples::device()).expect("a plan")
}

fn name(plan: &FramePlan, label: &str) -> RowName {
    table(plan).named(label, |_| true).unwrap_or_else(|error| panic!("{error}")).name
}

/// All texts of the panel in a window that has room for them.
fn texts(own: &Dependencies) -> Vec<String> {
    let context = context();
    let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::Vec2::new(1200.0, 8000.0));
    let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
    let output = context.run(input, |context| {
        egui::CentralPanel::default().show(context, |ui| _ = own.content(ui, Validation::Off, None));
    });
    let text = |own: &egui::epaint::ClippedShape| match &own.shape {
        Shape::Text(text) => Some(text.galley.text().to_owned()),
        _ => None,
    };
    output.shapes.iter().filter_map(text).collect()
}

#[test]
fn the_panel_lists_each_row_in_the_order_of_the_table_with_its_masks_and_its_reason() {
    let plan = plan();
    let mut own = Dependencies::new(true, &[], None);
    own.follow(&plan);
    let shown = texts(&own);
    let rows = table(&plan);
    let mut rest = shown.iter();
    for row in rows.iter() {
        assert!(rest.any(|text| text == row.label), "{} is missing or too early in {shown:?}", row.label);
        for line in described(row) {
            assert!(rest.any(|text| *text == line), "{}: {line:?} is not in {shown:?}", row.label);
        }
    }
    assert!(rows.iter().count() > 8);
}

#[test]
fn a_row_that_is_off_is_told_with_its_hazards_and_its_picture_until_it_is_on_again() {
    let plan = plan();
    let mut own = Dependencies::new(true, &[], None);
    own.follow(&plan);
    let row = name(&plan, "geometry-to-lighting");
    own.ask(Request::Switch(row));
    assert_eq!((own.has_change, own.pictured), (true, Some((row, HazardPicture::Stale))));
    own.follow(&plan);
    assert!(own.hazards.iter().any(|own| own.starts_with("LIGHTING may read ")), "{:?}", own.hazards);
    assert!(
        own.label
            .as_ref()
            .is_some_and(|label| label.starts_with("simulation of a missing geometry-to-lighting, stale: "))
    );
    let shown = texts(&own);
    assert!(own.hazards.iter().all(|sentence| shown.contains(sentence)), "{shown:?}");
    assert!(["stale", "torn", "cleared"].iter().all(|how| shown.iter().any(|text| text == how)), "{shown:?}");
    own.ask(Request::Switch(row));
    own.follow(&plan);
    assert_eq!((own.hazards.len(), own.pictured, own.is_simulated()), (0, None, false));
}

#[test]
fn rows_that_are_asked_for_are_off_and_a_row_without_a_picture_says_why() {
    let plan = plan();
    let mut own = Dependencies::new(true, &["geometry-to-lighting".to_owned()], Some(HazardPicture::Torn));
    own.follow(&plan);
    assert_eq!((own.has_change, own.off.len()), (true, 1));
    assert_eq!(own.pictured.map(|(_, how)| how), Some(HazardPicture::Torn));
    let upload = name(&plan, "upload-to-vertices");
    assert!(own.is_once(upload) && !own.is_once(name(&plan, "geometry-to-lighting")));
    own.ask(Request::Switch(upload));
    own.follow(&plan);
    assert_eq!((own.pictured, own.is_simulated()), (None, false));
    let listed = own.listed.iter().find(|listed| listed.row.label == "upload-to-vertices").expect("listed");
    let told = reasons(&listed.pictures);
    assert_eq!(told, ["no picture: it orders work that is done once, before the first frame"]);
    assert!(texts(&own).contains(&told[0]));
    own.ask(Request::AllOn);
    own.follow(&plan);
    assert!(own.off.is_empty() && own.hazards.is_empty());
}

#[test]
fn a_row_that_is_asked_for_and_not_there_is_told_once() {
    let plan = plan();
    let mut own = Dependencies::new(true, &["ao-to-ao-denoise".to_owned(), "geometry-to-lighting".to_owned()], None);
    own.follow(&plan);
    assert_eq!(own.off.len(), 1);
    assert_eq!(own.take_lacking(), ["ao-to-ao-denoise"]);
    own.follow(&plan);
    assert!(own.take_lacking().is_empty());
}

#[test]
fn frames_on_a_gpu_keep_their_rows_until_the_user_asks_otherwise() {
    let mut own = Dependencies::new(false, &[], None);
    assert!(!own.records && Dependencies::new(true, &[], None).records);
    own.ask(Request::Records(true));
    assert!(own.records && own.has_change());
}

#[test]
fn the_panel_stays_in_a_small_window_below_the_label() {
    let plan = plan();
    let mut own = Dependencies::new(true, &["geometry-to-lighting".to_owned()], Some(HazardPicture::Torn));
    own.follow(&plan);
    for size in [[400.0, 260.0], [640.0, 400.0], [1280.0, 800.0]].map(egui::Vec2::from) {
        let (context, screen) = (context(), egui::Rect::from_min_size(egui::Pos2::ZERO, size));
        // The panel's size is known after the first frame that shows it.
        for _ in 0..3 {
            let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
            let _ = context.run(input, |context| {
                own.show_panel(context, &mut true, (Validation::Off, None));
                show_label(context, own.label.as_deref().expect("a label"));
            });
        }
        let rectangle = |name: &str| {
            let rectangle = context.memory(|memory| memory.area_rect(egui::Id::new(name)));
            rectangle.unwrap_or_else(|| panic!("{name} is not shown"))
        };
        let [panel, label] = ["Dependencies", "simulation"].map(rectangle);
        assert!(screen.contains_rect(panel) && screen.contains_rect(label), "{panel:?} and {label:?} in {size:?}");
        assert!(!panel.intersect(label).is_positive(), "{panel:?} and {label:?} in {size:?}");
    }
}
