//! `afterlight -V` prints the version in a line; `--version` the facts that a report of a fault needs: the build, and the Vulkan that it meets.

use super::doctor;
use super::failure::Failure;
use super::output;

/// The version as `clap` prints it for `--version`. It has a second line, by which [`fn@print`] tells it from `-V`, and
/// which it replaces.
pub const LONG: &str = concat!(env!("CARGO_PKG_VERSION"), "\n...");

/// Set by the build script of a package, or by whoever builds.
const COMMIT: Option<&str> = option_env!("AFTERLIGHT_COMMIT");

/// Prints the line of `-V`, and for `--version` the build and the system after it. `of_clap` is the text of clap's own.
pub fn print(of_clap: &str) -> Result<(), Failure> {
    let mut text = of_clap.lines().take(1).map(|line| format!("{line}\n")).collect::<String>();
    if of_clap.trim_end().contains('\n') {
        text.push_str(&build());
        text.push_str(&doctor::versions());
    }
    output::print(&text, false)
}

/// Commit, features, target and compiler, a line each.
fn build() -> String {
    let commit = COMMIT.unwrap_or("unknown, built from a working tree without AFTERLIGHT_COMMIT");
    let target = option_env!("AFTERLIGHT_TARGET").unwrap_or("unknown");
    let rustc = option_env!("AFTERLIGHT_RUSTC").unwrap_or("rustc of unknown version");
    format!("commit: {commit}\nfeatures: {}\ntarget: {target}, {rustc}\n", features().join(", "))
}

fn features() -> Vec<&'static str> {
    let all = option_env!("AFTERLIGHT_FEATURES").unwrap_or_default();
    all.split(',').filter(|feature| !feature.is_empty() && *feature != "default").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_feature_that_is_compiled_in_is_told_and_no_other() {
        let known = [
            ("ci", cfg!(feature = "ci")),
            ("hot-reload", cfg!(feature = "hot-reload")),
            ("report", cfg!(feature = "report")),
            ("window", cfg!(feature = "window")),
        ];
        let manifest: toml::Table = include_str!("../Cargo.toml").parse().expect("TOML");
        let mut declared: Vec<&str> =
            manifest["features"].as_table().expect("a table").keys().map(String::as_str).collect();
        declared.retain(|name| *name != "default");
        assert_eq!(declared, known.map(|(name, _)| name));
        let expected: Vec<&str> = known.into_iter().filter_map(|(name, is_in)| is_in.then_some(name)).collect();
        assert_eq!(features(), expected);
    }
}
