//! The library stays in its process once a loader has opened it: its counts are those of the process, also where a loader closes it after each
//! command that is called before there is an instance.

fn main() {
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
    println!("cargo::rerun-if-changed=build.rs");
}
