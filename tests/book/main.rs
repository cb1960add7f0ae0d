//! The book is never wrong: what it types prints what it says, its pictures are what the program draws, its listings are code that is compiled,
//! its exercises have answers that were tried, its links lead somewhere, and its words are spelled. book/README.md says how chapters are written.
//!
//! `AFTERLIGHT_BLESS=1 cargo test --test book sessions::` writes what commands print into the chapters, and takes their pictures.
//! `AFTERLIGHT_BOOK=shadows,light` names the chapters that are tried.

// Its sessions are typed into bash, in folders with links.
#![cfg(unix)]

#[path = "../common/mod.rs"]
mod common;

mod chapter;
mod pages;
mod patches;
mod sessions;
mod text;
mod words;
