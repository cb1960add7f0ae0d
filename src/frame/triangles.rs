//! The triangle that each pixel shows.

use std::sync::Arc;

use super::{Error, Pixels, Renderer};
use crate::gpu::Device;
use crate::plan;
use crate::scene::{Camera, Pose, Scene, Settings, TriangleId, View};

/// The triangle of each pixel of a scene, at rest or in a pose of it, `None` for the sky; nothing from a device that does not number triangles.
///
/// # Errors
/// When the settings cannot be planned, the device is lost, or it lacks the memory.
pub fn triangles(
    device: &Arc<Device>,
    (scene, pose): (&Scene, Option<&Pose>),
    camera: &Camera,
    settings: &Settings,
) -> Result<Option<Vec<Option<TriangleId>>>, Error> {
    let mut renderer = match Renderer::new(device, scene, &settings.showing(View::Triangle)) {
        Err(Error::Plan(plan::PlanError::NoTriangles)) => return Ok(None),
        made => made?,
    };
    if let Some(pose) = pose {
        renderer.pose(scene, pose)?;
    }
    Ok(match renderer.picture(camera, || {})?.pixels {
        Pixels::LinearF32(rgba) => Some(rgba.as_chunks::<4>().0.iter().map(decoded).collect()),
        Pixels::Srgb8(_) => None,
    })
}

fn decoded(&[object, triangle, ..]: &[f32; 4]) -> Option<TriangleId> {
    // 0 is the sky.
    (object > 0.0).then(|| TriangleId { object: object as u32 - 1, triangle: triangle as u32 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_counted_from_one_and_triangles_from_zero() {
        assert_eq!(decoded(&[0.0, 0.0, 0.0, 1.0]), None);
        assert_eq!(decoded(&[1.0, 0.0, 0.0, 1.0]), Some(TriangleId { object: 0, triangle: 0 }));
        assert_eq!(decoded(&[3.0, 7.0, 0.0, 1.0]), Some(TriangleId { object: 2, triangle: 7 }));
    }
}
