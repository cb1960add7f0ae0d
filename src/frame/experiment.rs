//! Frames with other dependencies than the plan's, for the layer to look at.

use std::sync::Arc;

use super::edges::Edges;
use super::{Error, Renderer};
use crate::gpu::Device;
use crate::scene::{Scene, Settings};

/// Draws so much that each dependency has something to order: frames in flight, in each of whose places another one follows, and copies of
/// pictures under way while the next is drawn. Waits until all of it is done and destroyed, so that the layer has said all it has to say.
///
/// # Errors
/// As [`Renderer::with_edges`] and [`Renderer::render`].
pub fn draw(device: &Arc<Device>, scene: &Scene, settings: &Settings, edges: Edges) -> Result<(), Error> {
    let mut renderer = Renderer::with_edges(device, scene, settings, edges)?;
    for frame in 0..4 {
        renderer.render(&scene.camera)?;
        if frame == 1 || frame == 2 {
            renderer.start_read_back()?;
        }
    }
    drop(renderer);
    Ok(device.wait_idle()?)
}
