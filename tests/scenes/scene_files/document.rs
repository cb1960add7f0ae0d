//! docs/SCENES.md tells all that is read, and nothing else.

use std::collections::BTreeSet;

use afterlight::scene::file::schema;
use afterlight::scene::{Brdf, GbufferPreset, HdrFormat, SETTINGS, TARGETS, TargetChoice, View, builtin};

use super::{folder, read, refusal};

const DOCUMENT: &str = include_str!("../../../docs/SCENES.md");

/// The cells of a section's table, row by row: of the one whose first column has that heading.
fn documented<'a>(section: &str, heading: &str) -> Vec<Vec<&'a str>> {
    let start = DOCUMENT.find(&format!("\n{section}\n")).unwrap_or_else(|| panic!("no section {section:?}"));
    let body = &DOCUMENT[start + section.len() + 2..];
    let end = body.find("\n## ").into_iter().chain(body.find("\n### ")).min().unwrap_or(body.len());
    let cells = |line: &'a str| line.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>();
    let rows = body[..end].lines().skip_while(move |line| !line.starts_with(&format!("| {heading} |")));
    rows.skip(2).take_while(|line| line.starts_with('|')).map(cells).collect()
}

fn unquoted(cell: &str) -> &str {
    cell.trim_matches('`')
}

#[test]
fn the_document_has_each_key_and_no_other() {
    for table in schema::TABLES {
        let rows = documented(&format!("## `{}`", table.table), "Key");
        let mut told: BTreeSet<&str> = rows.iter().map(|row| unquoted(row[0])).collect();
        // docs/SETTINGS.md lists the keys of settings.
        told.extend(SETTINGS.iter().filter_map(|setting| match (table.table, setting.toml.split_once('.')) {
            ("settings", None) => Some(setting.toml),
            ("settings.shadows", Some((_, key))) => Some(key),
            _ => None,
        }));
        assert_eq!(told, table.keys.iter().copied().collect(), "{}", table.table);
        assert!(rows.iter().all(|row| row.len() == 4), "{}: {rows:?}", table.table);
    }
    let sections = DOCUMENT.lines().filter(|line| line.starts_with("## `"));
    assert_eq!(sections.count(), schema::TABLES.len());
}

#[test]
fn the_document_has_every_name_of_a_setting() {
    let names = |names: &mut dyn Iterator<Item = &'static str>| {
        for name in names {
            assert!(DOCUMENT.contains(&format!("`{name}`")), "{name} is not in docs/SCENES.md");
        }
    };
    names(&mut Brdf::NAMES.iter().map(|(name, _)| *name));
    names(&mut HdrFormat::NAMES.iter().map(|(name, _)| *name));
    names(&mut View::NAMES.iter().map(|(name, _)| *name));
    names(&mut GbufferPreset::NAMES.iter().map(|(name, _)| *name));
    names(&mut TargetChoice::NAMES.iter().map(|(name, _)| *name));
    let rows = documented("## `settings`", "Target");
    for (row, (target, formats)) in rows.iter().zip(TARGETS) {
        assert_eq!(unquoted(row[0]), *target);
        let told: Vec<&str> = row[1].split('`').skip(1).step_by(2).collect();
        assert_eq!(told, formats.iter().map(|format| format.name()).collect::<Vec<_>>(), "{target}");
    }
}

#[test]
fn the_document_has_each_built_in_scene_with_its_parameters() {
    for builtin in builtin::CATALOGUE {
        let section = format!("### `builtin:{}`", builtin.name);
        let rows = documented(&section, "Parameter");
        let told: Vec<_> = rows.iter().map(|row| (unquoted(row[0]), row[1].to_owned())).collect();
        let taken: Vec<_> = builtin.parameters.iter().map(|known| (known.name, known.range())).collect();
        assert_eq!(told, taken, "{}", builtin.name);
    }
    let sections = DOCUMENT.lines().filter(|line| line.starts_with("### `builtin:"));
    assert_eq!(sections.count(), builtin::CATALOGUE.len());
}

fn examples() -> Vec<&'static str> {
    let blocks = DOCUMENT.split("\n```toml\n").skip(1);
    blocks.map(|block| block.split("\n```").next().unwrap_or_default()).collect()
}

#[test]
fn every_example_of_the_document_is_read() {
    let folder = folder();
    assert!(examples().len() >= 4);
    for example in examples() {
        let scene = read(&folder, example).unwrap_or_else(|error| panic!("{error}\n{example}"));
        assert!(scene.triangle_count() > 0 && !scene.lights.is_empty(), "{example}");
    }
}

#[test]
fn the_example_of_an_error_is_what_is_said() {
    let text = examples()[0].replace("fov_y_degrees", "fov_degrees");
    let error = refusal(&text).replacen("scene.toml", "doughnuts.toml", 1);
    let told = DOCUMENT.lines().find(|line| line.starts_with("doughnuts.toml:")).unwrap();
    let told = told.split('…').next().unwrap();
    assert!(error.starts_with(told), "{error}\n{told}");
}
