//! What people read about a frame, made from the values that the frame itself is made from.

pub mod graph;
