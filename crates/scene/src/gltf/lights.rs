//! KHR_lights_punctual, in the same units as [`Light`]. The extension has neither shadow flags nor light sizes: this program writes and reads them in
//! `extras.afterlight`.

use glam::{DVec3, Vec3};

use super::json::named;
use super::json_extensions::Light as JsonLight;
use crate::{Falloff, Light, LightKind};

/// Reads a light that shines along -Z from the origin of its node.
///
/// # Errors
/// A value that a light cannot have.
pub(super) fn light(index: usize, json: &JsonLight) -> Result<Light, String> {
    let within = |what: String| format!("{}: {what}", named("light", index, json.name.as_ref()));
    let (position, direction, falloff) = (DVec3::ZERO, DVec3::NEG_Z, Falloff::InverseSquare);
    // A range of 0 or below would be no light at all; files that have it mean no limit.
    let range = json.range.filter(|range| *range > 0.0);
    let kind = match json.kind.as_str() {
        "directional" => LightKind::Directional { direction },
        "point" => LightKind::Point { position, range, falloff },
        "spot" => {
            let spot = json.spot.as_ref();
            let outer = spot.and_then(|spot| spot.outer_cone_angle).unwrap_or(std::f64::consts::FRAC_PI_4);
            let inner = spot.and_then(|spot| spot.inner_cone_angle).unwrap_or(0.0);
            LightKind::Spot {
                position,
                direction,
                inner_angle_degrees: inner.to_degrees().min(outer.to_degrees()),
                outer_angle_degrees: outer.to_degrees(),
                range,
                falloff,
            }
        }
        other => {
            return Err(within(format!("its type is `{}`: expected directional, point or spot", other.escape_debug())));
        }
    };
    let own = &json.extras["afterlight"];
    let light = Light {
        name: json.name.clone().unwrap_or_default(),
        kind,
        color: json.color.map_or(Vec3::ONE, |color| Vec3::from(color.map(|channel| channel as f32))),
        intensity: json.intensity.unwrap_or(1.0) as f32,
        // The defaults of scene files: directional lights and spots, of which a file has few, cast shadows. Point lights do not, since each takes six
        // maps.
        casts_shadow: own["casts_shadow"].as_bool().unwrap_or(!matches!(kind, LightKind::Point { .. })),
        size: own["size"].as_f64().unwrap_or(0.0),
    };
    light.fault().map_or(Ok(light), |fault| Err(within(fault)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(json: &str) -> Result<Light, String> {
        light(2, &serde_json::from_str(json).unwrap())
    }

    #[test]
    fn each_kind_has_the_defaults_of_the_extension() {
        let spot = of(r#"{"type":"spot","name":"s","intensity":7,"color":[1,0.5,0]}"#).unwrap();
        assert_eq!((spot.intensity, spot.color, spot.casts_shadow), (7.0, Vec3::new(1.0, 0.5, 0.0), true));
        let LightKind::Spot { inner_angle_degrees, outer_angle_degrees, range, direction, .. } = spot.kind else {
            panic!()
        };
        assert_eq!(
            (inner_angle_degrees, outer_angle_degrees.round(), range, direction),
            (0.0, 45.0, None, DVec3::NEG_Z)
        );
        let point = of(r#"{"type":"point","range":3}"#).unwrap();
        assert!(matches!(point.kind, LightKind::Point { range: Some(3.0), .. }) && point.intensity == 1.0);
        assert!(of(r#"{"type":"directional"}"#).unwrap().kind.is_directional());
    }

    #[test]
    fn extras_of_this_program_say_shadow_and_size_and_no_others_do() {
        let lamp = of(r#"{"type":"point","extras":{"afterlight":{"casts_shadow":true,"size":0.25}}}"#).unwrap();
        assert_eq!((lamp.casts_shadow, lamp.size), (true, 0.25));
        for extras in ["7", "[1]", "null", r#"{"size":-1}"#, r#"{"afterlight":{"size":"wide","casts_shadow":1}}"#] {
            let sun = of(&format!(r#"{{"type":"directional","extras":{extras}}}"#)).unwrap();
            assert_eq!((sun.casts_shadow, sun.size), (true, 0.0), "{extras}");
        }
    }

    #[test]
    fn what_cannot_be_is_named() {
        for json in [
            r#"{"type":"area"}"#,
            r#"{"type":"point","intensity":-1}"#,
            r#"{"type":"point","intensity":1e300}"#,
            r#"{"type":"spot","spot":{"outerConeAngle":9}}"#,
        ] {
            assert!(of(json).unwrap_err().starts_with("light 2: "), "{json}");
        }
    }
}
