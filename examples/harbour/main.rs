//! Writes the harbour of `assets/harbour.toml`, all of whose shapes and textures are made here:
//!
//!     cargo run --package afterlight --example harbour -- assets/harbour

#[path = "scene.rs"]
mod scene;

fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "assets/harbour".into());
    let folder = std::path::Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    for (name, bytes) in scene::files() {
        std::fs::write(folder.join(name), &bytes)?;
        println!("{name}: {} bytes", bytes.len());
    }
    Ok(())
}
