//! Levels of detail of a mesh: the same surface with ever fewer triangles, drawn at distances from which nobody sees the difference.
//!
//! A level has vertices of its mesh alone, so that it costs indices and nothing else (but where triangles are told by their vertices, one for each of its
//! triangles).

mod make;

use std::sync::{Arc, Mutex, PoisonError};

/// More than halve any mesh down to nothing.
pub const MOST_LEVELS: usize = 16;

/// A mesh with fewer triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Three a triangle, of the mesh's vertices.
    pub indices: Vec<u32>,
    /// The largest distance between it and the mesh, from any point of either, in metres of mesh space; never less than that of the level before.
    pub error: f64,
}

/// The levels of a mesh, as soon as a plan has asked for them, with a hash of what they were made of.
#[derive(Debug, Default)]
pub struct Levels(Mutex<Option<(blake3::Hash, Arc<[Level]>)>>);

impl Levels {
    fn made(&self) -> Option<(blake3::Hash, Arc<[Level]>)> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Clone for Levels {
    fn clone(&self) -> Self {
        Self(Mutex::new(self.made()))
    }
}
