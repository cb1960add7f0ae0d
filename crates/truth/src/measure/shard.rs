//! Work that is dealt to several processes or machines.

use serde::{Deserialize, Serialize};

/// One of `count` equal parts of some work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// The part's number, from 1 to `count`.
    pub index: u32,
    /// The number of parts, 1 or more.
    pub count: u32,
}

impl Shard {
    /// Returns true if a piece of the work belongs to this part, which takes every `count`-th piece: neighbouring pieces, which cost about the same,
    /// go to different parts.
    pub fn owns(&self, piece: usize) -> bool {
        piece % self.count as usize == self.index as usize - 1
    }
}
