//! The table of settings holds everywhere: the command line, `--vary`, scene files, docs/SETTINGS.md and the plan agree with its rows.

use std::fs;
use std::path::Path;

use afterlight::plan::{Capabilities, FramePlan};
use afterlight::scene::file::parse_settings;
use afterlight::scene::{
    AlphaMode, Emitter, OpenOptions, SETTINGS, Scene, Setting, SettingsPatch, SkyChoice, ValueKind, open, put_sky,
};

use super::docs::{document, help_of, project};
use crate::common::capabilities;
use crate::common::program::program;

/// Returns values that a setting refuses.
fn wrong_values(setting: &Setting) -> Vec<String> {
    let mut wrong = match setting.values {
        ValueKind::OnOff | ValueKind::Names(_) | ValueKind::Layout | ValueKind::Parts => Vec::new(),
        ValueKind::Whole(from, to) => {
            let beside =
                [from.checked_sub(1), to.checked_add(1)].into_iter().flatten().map(|number| number.to_string());
            beside.chain(["-1", "1.5"].map(str::to_owned)).collect()
        }
        ValueKind::Among(numbers) => vec![(numbers.iter().max().map_or(0, |most| most + 1)).to_string()],
        ValueKind::Number(from, to) => vec![(from - 1.0).to_string(), (to + 1.0).to_string(), "nan".to_owned()],
        ValueKind::Size => ["0x9", "9x0", "9x"].map(str::to_owned).to_vec(),
        ValueKind::Grid([across, down, deep], _) => {
            vec!["0x9x9".to_owned(), "9x9".to_owned(), format!("{}x1x1", across + 1), format!("{across}x{down}x{deep}")]
        }
        ValueKind::Aperture => ["f/0", "-1", "nan", "1e7", "inf", "f/-2.8"].map(str::to_owned).to_vec(),
    };
    wrong.push("nonsense".into());
    wrong
}

/// The line of `[settings]` that gives a setting this value.
fn line_of_toml(setting: &Setting, value: &str) -> String {
    let value = if value.parse::<f64>().is_ok() { value.to_owned() } else { format!("\"{value}\"") };
    format!("[settings]\n{} = {value}\n", setting.toml)
}

#[test]
fn a_wrong_value_is_refused_in_the_same_words_wherever_it_is_written() {
    for setting in SETTINGS {
        for (index, value) in wrong_values(setting).iter().enumerate() {
            let sentence = setting.read(value).expect_err(setting.key);
            let said = format!("{}={value}", setting.key).parse::<SettingsPatch>().expect_err(setting.key).to_string();
            assert_eq!(said, format!("{}={value}: {sentence}", setting.key));
            // TOML has different words for these.
            let in_file = if setting.values == ValueKind::OnOff { "must be true or false" } else { &sentence };
            let text = line_of_toml(setting, value);
            let error = parse_settings(&text, Path::new("tuned.toml")).expect_err(&text).to_string();
            assert!(error.starts_with(&format!("tuned.toml:2: settings.{} = ", setting.toml)), "{error}");
            assert!(error.ends_with(&format!(": {in_file}")), "{error}");
            // The program takes a while to start.
            if index == 0 {
                let option = format!("--{}", setting.key);
                let output = program().args(["render", "builtin:quad", &option, value]).output().expect("it starts");
                let error = String::from_utf8_lossy(&output.stderr);
                assert_eq!(output.status.code(), Some(2), "{error}");
                // The option `--view` takes `all` besides, so its list is one longer.
                let sentence =
                    if setting.key == "view" { sentence.split(" (").next().unwrap_or_default() } else { &sentence };
                assert!(error.contains(&option) && error.contains(sentence), "{error}");
            }
        }
    }
}

#[test]
fn help_has_every_setting_with_its_values_and_its_default() {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    for command in ["render", "bench", "inspect", "reference", "report", "tune", "view"] {
        let help = words(&help_of(command));
        for setting in SETTINGS.iter().filter(|setting| setting.only.is_empty()) {
            let Setting { key, help: what, .. } = setting;
            let told = format!(
                "--{key} <{}> {what} [{}; default: {}]",
                setting.value_name(),
                setting.range(),
                setting.default()
            );
            assert!(help.contains(&words(&told)), "{command} --help lacks: {told}");
        }
    }
    for setting in SETTINGS {
        assert!(help_of("bench").contains(setting.key), "{} is not in the help of --vary", setting.key);
        for command in setting.only.split(", ").filter(|command| !command.is_empty()) {
            let help = words(&help_of(command));
            assert!(help.contains(&format!("--{} <", setting.key)), "{command} lacks --{}", setting.key);
            let default = format!("[default: {}]", setting.option_default);
            assert!(setting.option_default.is_empty() || help.contains(&default), "{command} lacks {default}");
        }
    }
}

/// Values that make frames as different as a setting can.
fn telling_values(setting: &Setting) -> Vec<String> {
    let tried = setting.tried.iter().map(|text| (*text).to_owned()).chain(setting.values.all());
    let ends = match setting.values {
        ValueKind::Whole(from, to) => vec![from.to_string(), to.to_string()],
        ValueKind::Number(from, to) => vec![from.to_string(), to.to_string()],
        ValueKind::Size => vec!["640x360".to_owned()],
        ValueKind::Grid(..) => vec!["1x1x1".to_owned(), "16x9x200".to_owned()],
        ValueKind::Aperture => vec!["0.1".to_owned(), "f/2.8".to_owned()],
        ValueKind::Layout => vec!["fat".to_owned()],
        ValueKind::Parts => vec!["full".to_owned()],
        ValueKind::OnOff | ValueKind::Names(_) | ValueKind::Among(_) => Vec::new(),
    };
    tried.chain(ends).collect()
}

fn scenes() -> Vec<Scene> {
    let scene = |spec: &str| open(spec, &OpenOptions::default()).expect("it is built in");
    let (hall, mut veiled) = (scene("builtin:hall?bays=1&detail=6"), scene("builtin:spheres"));
    let material = veiled.objects[0].material;
    veiled.materials[material].alpha_mode = AlphaMode::Blend;
    veiled.lights.iter_mut().for_each(|light| light.casts_shadow = true);
    let mut layers = scene("builtin:layers?count=2");
    put_sky(&mut layers, &SkyChoice::Atmosphere(None)).expect("a sky");
    let smoke = Scene { emitters: vec![Emitter::default()], ..scene("builtin:layers?count=1") };
    vec![hall, veiled, layers, smoke]
}

#[test]
#[ignore = "test-all: the program and its window at length"]
fn a_row_says_whether_its_setting_changes_the_plan() {
    let (scenes, device) = (scenes(), Capabilities { msaa: 1 | 2 | 4 | 8, ..capabilities() });
    // Some settings act only on parts that other settings bring.
    let others: Vec<SettingsPatch> = [
        "",
        "samples=4",
        "light-path=forward",
        "bloom=0.5",
        "ao=bitmask",
        "taa=on",
        "reflections=screen",
        "fog=height",
        "fog=froxels",
    ]
    .map(|text| text.parse().expect("settings"))
    .into();
    for setting in SETTINGS {
        let values = telling_values(setting);
        let changes =
            scenes.iter().flat_map(|scene| others.iter().map(move |other| (scene, other))).any(|(scene, other)| {
                let plan = |patch: &SettingsPatch| FramePlan::of(scene, &patch.or(other).decide(), &device);
                let before = plan(&SettingsPatch::default()).expect("a plan");
                let mut patches = values.iter().map(|text| setting.read(text).expect(setting.key));
                patches.any(|patch| plan(&patch).is_ok_and(|after| !after.has_structure_of(&before)))
            });
        assert_eq!(changes, setting.changes_plan, "{}: tried {values:?}", setting.key);
    }
}

/// The table of docs/SETTINGS.md.
fn table() -> String {
    let mut text = "| Option | In `[settings]` | Default | Values | What it does | Changes the plan |\n|---|---|---|---|---|---|\n".to_owned();
    for setting in SETTINGS {
        let Setting { key, toml, help, .. } = setting;
        let quoted = |name: &String| format!("`{name}`");
        let names: Vec<_> = setting.values.all().iter().map(quoted).collect();
        let values = if names.is_empty() { setting.range() } else { names.join(", ") };
        let default = match (setting.option_default, setting.unset) {
            ("", "") => quoted(&setting.default()),
            ("", phrase) | (phrase, _) => phrase.to_owned(),
        };
        let only = if setting.only.is_empty() { String::new() } else { format!(" (of {})", setting.only) };
        let changes = if setting.changes_plan { "yes" } else { "" };
        text += &format!("| `--{key}`{only} | `{toml}` | {default} | {values} | {help} | {changes} |\n");
    }
    text
}

/// The table is written anew by `AFTERLIGHT_BLESS=1 cargo test --test program settings::`.
#[test]
fn the_document_has_the_table_of_settings() {
    let name = "docs/SETTINGS.md";
    let text = document(name);
    let start = text.find("| Option |").expect("a table");
    let length = text[start..].find("\n\n").map_or(text.len() - start, |end| end + 1);
    if std::env::var("AFTERLIGHT_BLESS").is_ok_and(|value| value == "1") {
        let text = format!("{}{}{}", &text[..start], table(), &text[start + length..]);
        fs::write(project().join(name), text).expect("it can be written");
    } else {
        assert!(
            text[start..][..length] == table(),
            "{name} is old: AFTERLIGHT_BLESS=1 makes its table anew:\n{}",
            table()
        );
    }
}
