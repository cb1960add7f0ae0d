use super::*;

const SUBPASSES: &str = r#"
frames = 1

[[step]]
pass = "GEOMETRY"
render_pass = 1
uses = [{ of = "albedo", stage = "COLOR_ATTACHMENT_OUTPUT", access = "COLOR_ATTACHMENT_WRITE", layout = "COLOR_ATTACHMENT_OPTIMAL", own_pixel = true }]

[[step]]
row = "geometry-to-lighting"
of = ["albedo"]
before = { stage = "COLOR_ATTACHMENT_OUTPUT", access = "COLOR_ATTACHMENT_WRITE" }
after = { stage = "FRAGMENT_SHADER", access = "INPUT_ATTACHMENT_READ" }
layouts = ["COLOR_ATTACHMENT_OPTIMAL", "SHADER_READ_ONLY_OPTIMAL"]
by_region = true

[[step]]
pass = "LIGHTING"
render_pass = 1
uses = [{ of = "albedo", stage = "FRAGMENT_SHADER", access = "INPUT_ATTACHMENT_READ", layout = "SHADER_READ_ONLY_OPTIMAL", own_pixel = true }]
"#;

/// The hazards that a text's rows leave, and what of them is more than needed.
fn judged(text: &str) -> (usize, Vec<String>) {
    let sequence = parse(text).unwrap_or_else(|(at, why)| panic!("at {at}: {why}"));
    (sequence.hazards().len(), sequence.superfluous().iter().map(in_a_line).collect())
}

#[test]
fn a_row_is_enough_or_says_what_is_missing_or_too_much() {
    assert_eq!(judged(SUBPASSES), (0, Vec::new()));
    // LIGHTING samples its neighbours: by region is too little.
    let neighbours = SUBPASSES.replace("SHADER_READ_ONLY_OPTIMAL\", own_pixel = true", "SHADER_READ_ONLY_OPTIMAL\"");
    assert!(judged(&neighbours).0 > 0);
    let late =
        SUBPASSES.replace("before = { stage = \"COLOR_ATTACHMENT_OUTPUT\"", "before = { stage = \"TOP_OF_PIPE\"");
    assert!(judged(&late).0 > 0);
    let wide =
        SUBPASSES.replace("after = { stage = \"FRAGMENT_SHADER\"", "after = { stage = \"FRAGMENT_SHADER | TRANSFER\"");
    assert_eq!(judged(&wide), (0, vec!["geometry-to-lighting: TRANSFER after it".to_owned()]));
    // Nothing lets the next frame's GEOMETRY wait for LIGHTING, nor brings the layout back.
    assert!(judged(&SUBPASSES.replace("frames = 1", "frames = 2")).0 > 0);
}

#[test]
fn frames_that_follow_each_other_need_a_row_for_what_they_share() {
    let reuse = r#"frames = 3

[[step]]
row = "reuse"
of = ["picture"]
before = { stage = "TRANSFER" }
after = { stage = "COLOR_ATTACHMENT_OUTPUT", access = "COLOR_ATTACHMENT_WRITE" }
layouts = ["UNDEFINED", "COLOR_ATTACHMENT_OPTIMAL"]

[[step]]
pass = "TONEMAP"
uses = [{ of = "picture", stage = "COLOR_ATTACHMENT_OUTPUT", access = "COLOR_ATTACHMENT_WRITE", layout = "COLOR_ATTACHMENT_OPTIMAL" }]

[[step]]
row = "read-back"
of = ["picture"]
before = { stage = "COLOR_ATTACHMENT_OUTPUT", access = "COLOR_ATTACHMENT_WRITE" }
after = { stage = "TRANSFER", access = "TRANSFER_READ" }
layouts = ["COLOR_ATTACHMENT_OPTIMAL", "TRANSFER_SRC_OPTIMAL"]

[[step]]
pass = "COPY"
uses = [{ of = "picture", stage = "TRANSFER", access = "TRANSFER_READ", layout = "TRANSFER_SRC_OPTIMAL" }]
"#;
    assert_eq!(judged(reuse), (0, Vec::new()));
    assert!(judged(&reuse.replace("before = { stage = \"TRANSFER\" }", "before = { stage = \"TOP_OF_PIPE\" }")).0 > 0);
}

#[test]
fn faults_of_a_file_name_their_place() {
    for (from, to, why) in [
        ("frames = 1", "frames = 9", "frames are 1 to 8, and not 9"),
        ("pass = \"GEOMETRY\"\n", "", "it has one of the keys `pass` and `row`"),
        (
            "\"FRAGMENT_SHADER\", access = \"INPUT",
            "\"FRAGMENT_SHADERS\", access = \"INPUT",
            "did you mean FRAGMENT_SHADER?",
        ),
        ("of = [\"albedo\"]", "of = [\"normal\"]", "which no pass uses"),
        ("of = [\"albedo\"]\n", "", "`of` must name its images"),
        ("render_pass = 1\n", "", "needs a render_pass"),
        ("\"SHADER_READ_ONLY_OPTIMAL\"]", "\"SHADER\"]", "is none of the layouts UNDEFINED, "),
        ("\"INPUT_ATTACHMENT_READ\", layout", "\"UNIFORM_READ\", layout", "unknown to the proof"),
        (
            "pass = \"LIGHTING\"\nrender_pass = 1",
            "pass = \"LIGHTING\"\nrender_pass = 2",
            "two passes of one render_pass",
        ),
        ("of = [\"albedo\"]", "of = []", "is empty"),
        ("of = [\"albedo\"]", "of = [\"albedo\", \"albedo\"]", "twice"),
        ("by_region", "by_regions", "unknown field `by_regions`"),
    ] {
        assert!(SUBPASSES.contains(from), "{from}");
        let (at, told) = parse(&SUBPASSES.replacen(from, to, 1)).expect_err(why);
        assert!(told.contains(why), "{told}");
        // The step that has the fault, or its line.
        let changed = SUBPASSES.replacen(from, to, 1);
        let line = changed.lines().nth(line_of(&changed, at) - 1).unwrap_or_default();
        assert!(
            ["[[step]]", "row = "].iter().any(|own| line.starts_with(own))
                || line.contains(to.trim_end()) && !to.is_empty(),
            "{told}: {line}"
        );
    }
}

#[test]
fn contents_that_are_read_must_not_be_discarded() {
    let discards = SUBPASSES.replace("layouts = [\"COLOR_ATTACHMENT_OPTIMAL\"", "layouts = [\"UNDEFINED\"");
    let sequence = parse(&discards).unwrap_or_else(|(at, why)| panic!("at {at}: {why}"));
    assert_eq!(sequence.discarded(), [["geometry-to-lighting", "albedo", "LIGHTING"]]);
    let kept = parse(SUBPASSES).unwrap_or_else(|(at, why)| panic!("at {at}: {why}"));
    assert!(kept.discarded().is_empty());
}

#[test]
fn a_first_layout_change_is_needed_and_long_files_are_refused() {
    let step = "[[step]]\nrow = \"first\"\nof = [\"a\"]\nbefore = { stage = \"TOP_OF_PIPE\" }\n\
                after = { stage = \"COMPUTE_SHADER\", access = \"SHADER_WRITE\" }\nlayouts = [\"UNDEFINED\", \"GENERAL\"]\n\
                [[step]]\npass = \"A\"\nuses = [{ of = \"a\", stage = \"COMPUTE_SHADER\", access = \"SHADER_WRITE\", layout = \"GENERAL\" }]\n";
    assert_eq!(judged(step), (0, Vec::new()));
    let (_, why) = parse(&step.repeat(40)).expect_err("it is long");
    assert_eq!(why, "a file has at most 64 steps, and not 80");
}
