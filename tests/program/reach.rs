//! How far an effect reaches: the files that name it and are not its own.
//!
//! An effect is declared in its own files, and tables above them list it. That is six files at most.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The most files that may name an effect and are not its own.
const MOST: usize = 6;

/// The tables that list effects. A message about an effect that reaches too far names the other files.
const TABLES: [&str; 6] = [
    "src/frame/deferred.rs",
    "src/plan/effects.rs",
    "src/passes/mod.rs",
    "crates/scene/src/settings/table.rs",
    "crates/truth/src/reference/mod.rs",
    "crates/lab/src/stress/catalogue/mod.rs",
];

/// An effect by the words of its files and of its code.
struct Reach {
    /// The name of the effect's file in `src/plan/effects` or in `src/passes`.
    name: &'static str,
    /// A file belongs to the effect if one of these is the name of the file or of a folder that it lies in.
    files: &'static [&'static str],
    /// Parts of identifiers that name the effect: `fog` of `has_fog` and `FogPlan`.
    parts: &'static [&'static str],
    /// Whole identifiers that name the effect.
    whole: &'static [&'static str],
}

const EFFECTS: &[Reach] = &[
    Reach {
        name: "fog",
        files: &["fog", "froxels", "air", "scatter", "integrate", "fogged"],
        parts: &["fog", "froxels"],
        whole: &[],
    },
    Reach { name: "bloom", files: &["bloom", "spread"], parts: &["bloom"], whole: &[] },
    Reach { name: "ao", files: &["ao", "ao_denoise", "occlusion", "depth_march"], parts: &["ao"], whole: &[] },
    Reach {
        name: "taa",
        files: &["taa", "sharpen", "velocity", "history"],
        parts: &["taa", "sharpen"],
        whole: &["VELOCITY", "has_velocity"],
    },
    Reach {
        name: "reflections",
        files: &["reflect", "reflections", "reflection", "reflect_resolve", "hiz", "screen_march"],
        parts: &["reflections", "hiz"],
        whole: &["reflects", "REFLECT", "REFLECT_RESOLVE", "reflect_resolve", "ReflectionPlan"],
    },
    Reach {
        name: "particles",
        files: &["particles", "simulate", "sort", "emitter", "emitters", "weights"],
        parts: &["particle", "particles"],
        whole: &[],
    },
    Reach {
        name: "sky",
        files: &["sky", "ambient", "prefilter", "atmosphere"],
        parts: &[],
        // The sky itself is a part of a scene, as lights are: only its passes are looked for. AMBIENT is also the base light of every frame.
        whole: &["SKY", "PREFILTER", "SkyPlan", "has_sky"],
    },
    Reach {
        name: "lobes",
        files: &["lobes"],
        parts: &[],
        // Lobes are a part of materials: only the pass and its plan are looked for.
        whole: &["LobesPlan", "LobesPass"],
    },
    // They are a part of shadow maps, whose files are their own.
    Reach {
        name: "tints",
        files: &["tint", "tints", "shadow", "shadows", "glass"],
        parts: &["veil"],
        whole: &["TINT", "TINTED", "TINT_LAYOUT", "SHADOW_TINTS", "Tints", "tinted_shadows"],
    },
    Reach { name: "refraction", files: &["refraction", "backdrop"], parts: &["backdrop"], whole: &["RefractionPlan"] },
    Reach { name: "fxaa", files: &["fxaa"], parts: &["fxaa"], whole: &[] },
    Reach { name: "aberration", files: &["aberration"], parts: &["aberration"], whole: &[] },
    Reach { name: "tone", files: &["tone"], parts: &["vignette"], whole: &["TONE"] },
];

fn project() -> &'static Path {
    Path::new(env!("AFTERLIGHT_ROOT"))
}

/// The files of code below a folder, without tests.
fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        let is_code = path.extension().is_some_and(|end| end == "rs" || end == "wgsl");
        if path.is_dir() && !path.ends_with("tests") {
            sources(&path, into);
        } else if is_code && !path.ends_with("tests.rs") {
            into.push(path);
        }
    }
}

/// `HasFog2D` and `has_fog` as words: `has`, `fog`.
fn parts(identifier: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    let mut was_lower = false;
    for letter in identifier.chars() {
        if letter == '_' || letter.is_uppercase() && was_lower {
            parts.push(String::new());
        }
        if letter != '_' {
            parts.last_mut().expect("never empty").extend(letter.to_lowercase());
        }
        was_lower = letter.is_lowercase();
    }
    parts
}

impl Reach {
    fn owns(&self, file: &Path) -> bool {
        file.components().any(|part| {
            let name = Path::new(part.as_os_str()).file_stem().unwrap_or_default();
            self.files.iter().any(|own| name == *own)
        })
    }

    /// Returns true if a line of code names the effect; comments and inline tests do not count.
    fn is_named_in(&self, text: &str) -> bool {
        let lines: Vec<&str> = text.lines().collect();
        // A file's tests are its last module.
        let is_test =
            |pair: &[&str]| pair[0].trim() == "#[cfg(test)]" && pair[1].contains("mod ") && pair[1].ends_with('{');
        let end = lines.windows(2).position(is_test).unwrap_or(lines.len());
        let code = lines[..end].iter().filter(|line| !line.trim_start().starts_with("//"));
        let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
        code.flat_map(|line| line.split(move |letter| !is_word(letter))).any(|identifier| {
            self.whole.contains(&identifier) || parts(identifier).iter().any(|part| self.parts.contains(&&**part))
        })
    }
}

/// The foreign files of each effect, relative to the project.
fn foreign() -> BTreeMap<&'static str, BTreeSet<String>> {
    let mut files = Vec::new();
    ["src", "shaders", "crates"].iter().for_each(|root| sources(&project().join(root), &mut files));
    let texts: Vec<(PathBuf, String)> = files
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(&path).expect("sources are text");
            (path.strip_prefix(project()).expect("it lies in the project").to_owned(), text)
        })
        .collect();
    let of = |effect: &'static Reach| {
        let named = texts.iter().filter(|(path, text)| !effect.owns(path) && effect.is_named_in(text));
        (effect.name, named.map(|(path, _)| path.display().to_string()).collect())
    };
    EFFECTS.iter().map(of).collect()
}

#[test]
fn few_foreign_files_name_an_effect() {
    let mut wrong = Vec::new();
    for (effect, files) in foreign().into_iter().filter(|(_, files)| files.len() > MOST) {
        let others = files.iter().filter(|file| !TABLES.contains(&file.as_str()));
        let others = others.map(|file| format!("\n  {file} names it, and is neither its own nor a table of effects"));
        wrong.push(format!("{effect} is named in {} foreign files:{}", files.len(), others.collect::<String>()));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Each effect of the table has its words here.
#[test]
fn every_effect_of_the_table_is_looked_for() {
    let table = fs::read_to_string(project().join("src/plan/effects.rs")).expect("the table of effects");
    let names: Vec<&str> =
        table.lines().filter_map(|line| line.trim().strip_prefix('&')?.strip_suffix("::EFFECT,")).collect();
    assert!(names.len() >= 8, "{names:?}");
    for name in names {
        assert!(EFFECTS.iter().any(|own| own.name == name), "{name} has no row in tests/program/reach.rs");
    }
}

#[test]
fn a_file_that_names_an_effect_is_found() {
    let fog = &EFFECTS[0];
    assert!(fog.is_named_in("let x = plan.has_fog();") && fog.is_named_in("use FogPlan;"));
    assert!(!fog.is_named_in("// fog\nlet foggy = 1;\n#[cfg(test)]\nmod tests {\n use fog; }"));
    assert!(fog.is_named_in("#[cfg(test)]\nmod tests;\nuse fog;"));
    assert!(fog.owns(Path::new("src/plan/effects/fog.rs")) && fog.owns(Path::new("shaders/fog/air.wgsl")));
    assert!(!fog.owns(Path::new("src/plan/effects/sky.rs")));
}
