//! Cameras. Their aspect ratio and far plane are left out: the picture has the one, and no camera of [`Scene`](crate::scene::Scene) has the other.

use glam::{DQuat, DVec3};

use super::json::{Camera as JsonCamera, named};
use crate::scene::{Camera, Projection};

/// A camera that looks along -Z from zero, as its node has it.
///
/// # Errors
/// A value with which the camera would see nothing.
pub(super) fn camera(index: usize, json: &JsonCamera) -> Result<Camera, String> {
    let within = |what: String| format!("{}: {what}", named("camera", index, json.name.as_ref()));
    let (projection, near) = match (&json.perspective, &json.orthographic) {
        (Some(own), _) => (Projection::perspective(own.yfov.to_degrees()), own.znear),
        (None, Some(own)) => (Projection::orthographic(2.0 * own.ymag.abs()), own.znear),
        (None, None) => return Err(within("is neither perspective nor orthographic".into())),
    };
    // An orthographic one may begin at its place.
    let near = if near == 0.0 && json.perspective.is_none() { 1e-6 } else { near };
    let camera = Camera { position: DVec3::ZERO, rotation: DQuat::IDENTITY, projection, near, ..Camera::default() };
    camera.fault().map_or(Ok(camera), |fault| Err(within(fault)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_become_degrees_and_half_heights_heights() {
        let of = |json: &str| camera(0, &serde_json::from_str(json).unwrap());
        let seen = of(r#"{"type":"perspective","perspective":{"yfov":0.7853981633974483,"znear":0.5}}"#).unwrap();
        assert_eq!((seen.projection, seen.near), (Projection::perspective(45.0), 0.5));
        let flat = of(r#"{"orthographic":{"xmag":1,"ymag":1.5,"znear":0,"zfar":9}}"#).unwrap();
        assert_eq!(flat.projection, Projection::orthographic(3.0));
        for json in [r#"{"name":"c"}"#, r#"{"name":"c","perspective":{"yfov":4,"znear":1}}"#] {
            assert!(of(json).unwrap_err().starts_with("camera 0 (`c`): "));
        }
    }
}
