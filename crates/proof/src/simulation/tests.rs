use ash::vk;
use glam::Vec3;

use super::*;
use afterlight::passes::Tile;
use afterlight::plan::samples;
use afterlight::scene::{AmbientOcclusion, LightPath, Material, Settings};

fn plan(settings: &Settings) -> FramePlan {
    let mut scene = samples::scene(vec![Material::default(), samples::glass()], vec![samples::sun()]);
    scene.environment.ambient = Vec3::splat(0.1);
    FramePlan::of(&scene, settings, &samples::device()).expect("a plan")
}

/// The rows that have pictures, each with their names.
fn pictured(plan: &FramePlan) -> Vec<(&'static str, String)> {
    let of = |row: &Row| {
        let all = HazardPicture::NAMES.iter().filter(|&&(_, how)| simulation(plan, row.name, how).is_ok());
        let names: Vec<_> = all.map(|&(name, _)| name).collect();
        (!names.is_empty()).then(|| (row.label, names.join(" ")))
    };
    rows::table(plan).iter().filter_map(of).collect()
}

fn reason(plan: &FramePlan, row: &str, how: HazardPicture) -> String {
    let name = rows::table(plan).named(row, |_| true).unwrap_or_else(|error| panic!("{error}")).name;
    simulation(plan, name, how).expect_err(row).to_string()
}

#[test]
fn rows_between_two_passes_have_the_pictures_that_change_nobody_else() {
    let of = |settings: &Settings| {
        let all = pictured(&plan(settings));
        all.iter().map(|(row, names)| format!("{row}: {names}")).collect::<Vec<_>>()
    };
    assert_eq!(
        of(&samples::deferred()),
        [
            "geometry-to-lighting: stale torn cleared",
            "shadow-to-readers: torn cleared",
            "lighting-to-transparent: stale torn cleared",
            "transparent-to-tonemap: stale torn cleared",
        ]
    );
    let compute = Settings { light_path: LightPath::Compute, ..samples::deferred() };
    let opaque = samples::scene(vec![Material::default()], vec![samples::sun()]);
    let tiled = FramePlan::of(&opaque, &compute, &samples::device()).expect("a plan");
    assert_eq!(
        pictured(&tiled),
        [("geometry-to-tiled", "stale torn cleared".to_owned()), ("shadow-to-tiled", "torn cleared".to_owned())]
    );
}

#[test]
fn a_row_without_a_picture_says_why() {
    use HazardPicture::{Cleared, Stale};
    let plain = plan(&samples::deferred());
    for (row, how, why) in [
        ("upload-to-vertices", Stale, "work that is done once"),
        ("clear-to-shadow-maps", Stale, "work that is done once"),
        ("geometry-reuse", Stale, "on its way to the screen"),
        ("host-to-frame", Stale, "not between two passes"),
        ("read-back", Cleared, "no pass of the frame waits by it, but OUTSIDE"),
        ("shadow-to-readers", Stale, "do not depend on it"),
    ] {
        let told = reason(&plain, row, how);
        assert!(told.starts_with("no picture: ") && told.contains(why), "{row}: {told}");
    }
    // The pass writes its results into the albedo, and LIGHTING needs this frame's albedo.
    let occluded = plan(&Settings { ao: AmbientOcclusion::Bitmask, ..samples::deferred() });
    let told = reason(&occluded, "ao-denoise-to-lighting", Cleared);
    assert!(told.contains("AO_DENOISE is no draw"), "{told}");
    let smoothed = plan(&Settings { fxaa: true, ..samples::deferred() });
    let told = reason(&smoothed, "tonemap-to-fxaa", Cleared);
    assert!(told.contains("TONEMAP draws every pixel"), "{told}");
}

#[test]
fn passes_that_a_stale_result_depends_on_are_of_the_last_frame_and_no_others() {
    let plan = plan(&samples::deferred());
    let of = |row: &str| {
        let name = rows::table(&plan).named(row, |_| true).unwrap_or_else(|error| panic!("{error}")).name;
        simulation(&plan, name, HazardPicture::Stale).unwrap_or_else(|error| panic!("{row}: {error}"))
    };
    let names = |own: &Simulation| own.earlier.iter().map(|place| place.name()).collect::<Vec<_>>();
    assert_eq!(names(&of("geometry-to-lighting")), ["GEOMETRY"]);
    assert_eq!(names(&of("transparent-to-tonemap")), ["TRANSPARENT", "LIGHTING", "GEOMETRY"]);
    assert!(of("geometry-to-lighting").to_string().contains("LIGHTING reads what GEOMETRY wrote in the last frame"));
}

#[test]
fn torn_tiles_are_every_second_one_and_all_tiles_cover_an_area_once() {
    let plan = plan(&samples::deferred());
    let name = rows::table(&plan).named("geometry-to-lighting", |_| true).expect("a row").name;
    let torn = simulation(&plan, name, HazardPicture::Torn).expect("a picture");
    let tiles = torn.tiles(torn.producer).expect("some");
    let [across, down] = tiles[0].of;
    assert_eq!(tiles.len() as u32, across * down / 2);
    assert!(
        tiles.iter().all(|tile| (tile.at[0] + tile.at[1]).is_multiple_of(2)) && torn.tiles(torn.readers[0]).is_none()
    );
    let area = vk::Rect2D { offset: vk::Offset2D { x: 5, y: 7 }, extent: vk::Extent2D { width: 101, height: 53 } };
    let mut covered = vec![0; 101 * 53];
    for at in (0..down).flat_map(|y| (0..across).map(move |x| [x, y])) {
        let own = Tile { at, of: [across, down] }.within(area);
        for row in 0..own.extent.height {
            for column in 0..own.extent.width {
                let [x, y] = [own.offset.x as u32 - 5 + column, own.offset.y as u32 - 7 + row];
                covered[(y * 101 + x) as usize] += 1;
            }
        }
    }
    assert!(covered.iter().all(|&times| times == 1));
}
