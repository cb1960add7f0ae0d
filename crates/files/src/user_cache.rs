//! The folder in which the user's system keeps data that can be computed anew.

use std::env;
use std::ffi::OsString;
use std::path::PathBuf;

/// Returns `afterlight` in the first of these that is set: `XDG_CACHE_HOME`; on Windows `%LOCALAPPDATA%`; on macOS `~/Library/Caches`; elsewhere
/// `~/.cache`. `None` for a user without a home, who has no cache.
pub fn user_cache() -> Option<PathBuf> {
    user_cache_of(env::consts::OS, |name| env::var_os(name))
}

fn user_cache_of(system: &str, variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    // The XDG base directory specification: a path that is not absolute is to be ignored.
    let absolute = |name: &str| variable(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let usual = || match system {
        // Shells of Unix tools set HOME there too, to the user's profile: not a place for caches.
        "windows" => absolute("LOCALAPPDATA"),
        "macos" => Some(absolute("HOME")?.join("Library/Caches")),
        _ => Some(absolute("HOME")?.join(".cache")),
    };
    Some(absolute("XDG_CACHE_HOME").or_else(usual)?.join("afterlight"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_system_has_its_place() {
        // Absolute where the test runs, too.
        let root = std::path::absolute("root").expect("a current folder");
        let of = |system: &str, set: &[&str]| {
            user_cache_of(system, |name| set.contains(&name).then(|| root.join(name).into_os_string()))
        };
        let all = ["XDG_CACHE_HOME", "LOCALAPPDATA", "HOME"];
        let place = |below: &str| Some(root.join(below).join("afterlight"));
        for system in ["linux", "macos", "windows"] {
            assert_eq!(of(system, &all), place("XDG_CACHE_HOME"), "{system}");
            assert_eq!(of(system, &[]), None, "{system}");
        }
        assert_eq!(of("linux", &all[1..]), place("HOME/.cache"));
        assert_eq!(of("macos", &all[1..]), place("HOME/Library/Caches"));
        assert_eq!(of("windows", &all[1..]), place("LOCALAPPDATA"));
        assert_eq!((of("windows", &["HOME"]), of("linux", &["LOCALAPPDATA"])), (None, None));
    }

    #[test]
    fn a_path_that_is_not_absolute_is_ignored() {
        let relative = |name: &str| (name == "XDG_CACHE_HOME").then(|| "cache".into());
        assert_eq!(user_cache_of("linux", relative), None);
    }
}
