//! The book is never wrong: its commands print the output that it shows, the program draws its pictures, its listings are code that is compiled, its
//! exercises have answers that were tried, its links lead somewhere, and its words are spelled. book/README.md says how chapters are written.
//!
//! `AFTERLIGHT_BLESS=1 cargo test --test book sessions::` writes the output of commands into the chapters, and takes their pictures.
//! `AFTERLIGHT_BOOK=shadows,light` names the chapters that are tried.

// The book's sessions are typed into bash, in folders with symbolic links.
#![cfg(unix)]

#[path = "../common/mod.rs"]
mod common;

mod browser;
mod chapter;
mod pages;
mod patches;
mod sessions;
mod text;
mod words;
