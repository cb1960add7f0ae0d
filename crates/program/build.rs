//! Tells the program its target, features, compiler and commit, for `afterlight --version`, and gives its file on Windows an icon.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// The file in which `cargo package` notes the commit. A checkout has none: there the program would be compiled anew after each commit.
const COMMIT_OF_PACKAGE: &str = ".cargo_vcs_info.json";

fn main() -> ExitCode {
    println!("cargo::rerun-if-changed=build.rs");
    let Some(out) = std::env::var_os("OUT_DIR").map(PathBuf::from) else {
        eprintln!("error: OUT_DIR is not set: this is cargo's build script");
        return ExitCode::FAILURE;
    };
    tell_what_is_built();
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "windows")
        && let Err(error) = windows_resources(&out)
    {
        println!("cargo::warning=the program gets no icon, and no paths of over 260 characters: {error}");
    }
    ExitCode::SUCCESS
}

/// Sets the variables that `src/version.rs` is compiled with. One whose value cannot be found out stays unset.
fn tell_what_is_built() {
    for (variable, of_cargo) in [("AFTERLIGHT_TARGET", "TARGET"), ("AFTERLIGHT_FEATURES", "CARGO_CFG_FEATURE")] {
        if let Ok(value) = std::env::var(of_cargo) {
            println!("cargo::rustc-env={variable}={value}");
        }
    }
    // Where the project lies, for tests and for its own shaders in development.
    let folder = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).unwrap_or_default();
    if let Some(root) = folder.ancestors().nth(2) {
        println!("cargo::rustc-env=AFTERLIGHT_ROOT={}", root.display());
    }
    let rustc = std::env::var_os("RUSTC").and_then(|rustc| Command::new(rustc).arg("--version").output().ok());
    if let Some(version) = rustc.as_ref().and_then(|told| std::str::from_utf8(&told.stdout).ok()?.lines().next()) {
        println!("cargo::rustc-env=AFTERLIGHT_RUSTC={version}");
    }
    // Whoever builds from several packages (scripts/package) knows more than the note in one of them.
    println!("cargo::rerun-if-env-changed=AFTERLIGHT_COMMIT");
    if std::env::var_os("AFTERLIGHT_COMMIT").is_some() {
        return;
    }
    // Cargo runs a build script each time whose file is missing.
    if Path::new(COMMIT_OF_PACKAGE).exists() {
        println!("cargo::rerun-if-changed={COMMIT_OF_PACKAGE}");
    }
    if let Some(commit) = std::fs::read_to_string(COMMIT_OF_PACKAGE).ok().and_then(|info| commit_of_package(&info)) {
        println!("cargo::rustc-env=AFTERLIGHT_COMMIT={commit}");
    }
}

/// Returns the commit, with a word for files that differed from it.
fn commit_of_package(info: &str) -> Option<String> {
    let commit = info.split_once("\"sha1\": \"")?.1.split('"').next()?;
    let changed = if info.contains("\"dirty\": true") { " and changes that are in no commit" } else { "" };
    Some(format!("{commit}{changed}"))
}

/// Gives the program on Windows its icon, and a manifest: paths may be long, and pixels are the screen's own.
fn windows_resources(out: &Path) -> std::io::Result<()> {
    const MANIFEST: &str = r#"<assembly xmlns="urn:schemas-microsoft-com:asm.v1" manifestVersion="1.0">
  <application xmlns="urn:schemas-microsoft-com:asm.v3">
    <windowsSettings>
      <longPathAware xmlns="http://schemas.microsoft.com/SMI/2016/WindowsSettings">true</longPathAware>
      <dpiAwareness xmlns="http://schemas.microsoft.com/SMI/2016/WindowsSettings">PerMonitorV2</dpiAwareness>
    </windowsSettings>
  </application>
</assembly>"#;
    println!("cargo::rerun-if-changed=icon.png");
    let icon = out.join("icon.ico");
    std::fs::write(&icon, icon_file(&std::fs::read("icon.png")?))?;
    winresource::WindowsResource::new().set_icon(&icon.to_string_lossy()).set_manifest(MANIFEST).compile()
}

/// An icon file that holds one PNG of 256 x 256 pixels, which it writes as 0: a header of 6 bytes, an entry of 16, the picture.
/// <https://learn.microsoft.com/en-us/previous-versions/ms997538(v=msdn.10)>
fn icon_file(png: &[u8]) -> Vec<u8> {
    const BEFORE: u32 = 22;
    let mut bytes = vec![0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1, 0, 32, 0];
    bytes.extend((png.len() as u32).to_le_bytes());
    bytes.extend(BEFORE.to_le_bytes());
    bytes.extend(png);
    bytes
}
