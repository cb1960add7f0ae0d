//! The examples work as described. The windowed example is tested with the windows.

use std::path::Path;

use crate::common::program::example;

fn run(name: &str, folder: &Path, arguments: &[&str]) -> String {
    let output = example(name)
        .env("AFTERLIGHT_CACHE", folder.join("cache"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the example starts");
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn picture(path: &Path) -> image::RgbaImage {
    image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())).into_rgba8()
}

/// Readers paste exactly the code that is compiled here.
#[test]
fn the_program_of_the_readme_is_an_example_and_draws() {
    let root = Path::new(env!("AFTERLIGHT_ROOT"));
    let text = |name: &str| std::fs::read_to_string(root.join(name)).expect("a text");
    let example = text("examples/readme.rs");
    let (_, code) = example.split_once("\n\n").expect("a head");
    assert!(
        text("README.md").contains(&format!("```rust\n{code}```")),
        "README.md has another program than examples/readme.rs"
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    assert_eq!(run("readme", folder.path(), &[]), "[1280, 720]\n");
}

#[test]
fn the_triangle_is_lit_before_a_dark_background() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    run("triangle", folder.path(), &["here.png"]);
    let picture = picture(&folder.path().join("here.png"));
    let [red, green, blue, _] = picture.get_pixel(160, 90).0;
    assert!(red > green && green > blue && red > 100, "{red} {green} {blue}");
    assert_eq!(picture.get_pixel(5, 5).0, [0, 0, 0, 255]);
}

#[test]
fn the_object_that_moves_is_elsewhere_in_each_frame() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    run("moving_object", folder.path(), &["."]);
    let frames: Vec<_> = (0..6).map(|frame| picture(&folder.path().join(format!("frame-{frame}.png")))).collect();
    for pair in frames.windows(2) {
        // The left half has the sphere that moves. Right of both spheres nothing does.
        let changed = |x: u32| (0..180).filter(|&y| pair[0].get_pixel(x, y) != pair[1].get_pixel(x, y)).count();
        assert!((60..160).map(changed).sum::<usize>() > 100);
        assert_eq!((300..320).map(changed).sum::<usize>(), 0);
    }
}

#[cfg(feature = "report")]
#[test]
fn settings_are_chosen_of_those_that_were_tried() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let told = run("tuned_settings", folder.path(), &[]);
    let count = told.strip_prefix("chosen of ").and_then(|rest| rest.split(':').next()?.parse::<usize>().ok());
    // How many a search tries before times say that it has found the fastest depends on the machine.
    assert!(count.is_some_and(|count| count >= 1), "{told}");
}
