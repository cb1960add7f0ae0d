//! Cameras. A camera's aspect ratio is ignored, because the picture's size gives it, and so is its far plane, because depth is infinite here.

use glam::{DQuat, DVec3};

use super::json::{Camera as JsonCamera, named};
use crate::{Camera, Projection};

/// The near plane of a perspective camera that has none, as a share of a metre.
const NEAR: f64 = 0.01;
/// The near plane of an orthographic camera that begins at its place or behind it.
const NEAREST: f64 = 1e-6;

/// A camera that looks along -Z from zero, as its node has it, and its oddity. A near plane that cannot be is replaced: it hides nothing that was meant to
/// be seen.
///
/// # Errors
/// A value with which the camera would see nothing.
pub(super) fn camera(index: usize, json: &JsonCamera) -> Result<(Camera, Option<String>), String> {
    let within = |what: String| format!("{}: {what}", named("camera", index, json.name.as_ref()));
    let lacks = |what: &str| within(format!("has no {what}"));
    let (projection, near, instead) = match (&json.perspective, &json.orthographic) {
        (Some(own), _) => {
            (Projection::perspective(own.yfov.ok_or_else(|| lacks("yfov"))?.to_degrees()), own.znear, NEAR)
        }
        (None, Some(own)) => {
            (Projection::orthographic(2.0 * own.ymag.ok_or_else(|| lacks("ymag"))?.abs()), own.znear, NEAREST)
        }
        (None, None) => return Err(within("is neither perspective nor orthographic".into())),
    };
    // An orthographic one may begin at its place.
    let is_fit = |near: f64| near > 0.0 || near == 0.0 && instead == NEAREST;
    let odd = match near {
        Some(near) if is_fit(near) => None,
        Some(near) => Some(within(format!("its znear is {near}, taken for {instead}"))),
        None => Some(within(format!("has no znear, taken for {instead}"))),
    };
    let near = near.filter(|near| *near > 0.0).unwrap_or(instead);
    let camera = Camera { position: DVec3::ZERO, rotation: DQuat::IDENTITY, projection, near, ..Camera::default() };
    camera.fault().map_or(Ok((camera, odd)), |fault| Err(within(fault)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_become_degrees_and_half_heights_heights() {
        let whole = |json: &str| camera(0, &serde_json::from_str(json).unwrap());
        let of = |json: &str| whole(json).map(|(camera, _)| camera);
        let seen = of(r#"{"type":"perspective","perspective":{"yfov":0.7853981633974483,"znear":0.5}}"#).unwrap();
        assert_eq!((seen.projection, seen.near), (Projection::perspective(45.0), 0.5));
        let flat = of(r#"{"orthographic":{"xmag":1,"ymag":1.5,"znear":0,"zfar":9}}"#).unwrap();
        assert_eq!(flat.projection, Projection::orthographic(3.0));
        for (json, near) in [
            (r#"{"perspective":{"yfov":1,"znear":0}}"#, NEAR),
            (r#"{"perspective":{"yfov":1,"znear":-3}}"#, NEAR),
            (r#"{"perspective":{"yfov":1}}"#, NEAR),
            (r#"{"orthographic":{"ymag":1,"znear":-3}}"#, NEAREST),
        ] {
            let (camera, odd) = whole(json).unwrap();
            assert!(camera.near == near && odd.is_some_and(|odd| odd.contains("znear")), "{json}");
        }
        for json in [
            r#"{"name":"c"}"#,
            r#"{"name":"c","perspective":{"yfov":4,"znear":1}}"#,
            r#"{"name":"c","perspective":{"yfov":0,"znear":1}}"#,
            r#"{"name":"c","perspective":{"znear":1}}"#,
            r#"{"name":"c","orthographic":{"ymag":0,"znear":1}}"#,
        ] {
            assert!(of(json).unwrap_err().starts_with("camera 0 (`c`): "));
        }
    }
}
