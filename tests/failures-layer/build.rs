//! Keeps the library in its process once a loader has opened it. Its counts then cover the whole process, even if a loader closes it after each
//! command that needs no instance.

fn main() {
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
    println!("cargo::rerun-if-changed=build.rs");
}
