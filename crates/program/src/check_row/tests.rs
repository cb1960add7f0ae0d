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
        ("by_region", "by_regions", "unknown field `by_regions`"),
    ] {
        assert!(SUBPASSES.contains(from), "{from}");
        let (at, told) = parse(&SUBPASSES.replacen(from, to, 1)).expect_err(why);
        assert!(told.contains(why), "{told}");
        assert!(at <= SUBPASSES.len(), "{told}");
    }
}
