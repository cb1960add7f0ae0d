//! What glTF has no words for and this program's export writes beside it, in `scenes[0].extras.afterlight`: light from everywhere, the background, the
//! exposure and the settings that were said. Files of other programs have none of it.

use glam::Vec3;
use serde_json::Value;

use super::json::Document;
use crate::{Environment, SettingsPatch, Surroundings};

/// Reads the surroundings of the scene that is shown. A value that cannot be is left out, with a warning.
pub(super) fn read(document: &Document, scene: usize, warnings: &mut Vec<String>) -> Option<Surroundings> {
    let own = document.scenes.get(scene)?.extras.get("afterlight")?.as_object()?;
    let mut odd = |key: &str, value: &Value, expected: &str| {
        warnings.push(format!("scenes[{scene}].extras.afterlight.{key} is {value}, not {expected}: left out"));
    };
    let mut color = |key: &str| {
        let value = own.get(key)?;
        let numbers: Option<Vec<f32>> = value
            .as_array()
            .filter(|list| list.len() == 3)
            .and_then(|list| list.iter().map(|number| number.as_f64().map(|number| number as f32)).collect());
        let color = numbers.map(|numbers| Vec3::from_slice(&numbers));
        let color = color.filter(|color| color.is_finite() && color.min_element() >= 0.0);
        if color.is_none() {
            odd(key, value, "three numbers from 0");
        }
        color
    };
    let [ambient, ground, background] = ["ambient_nits", "ambient_from_below_nits", "background_nits"].map(&mut color);
    let is_lit = ambient.is_some() || ground.is_some();
    let environment =
        Environment { ambient: ambient.unwrap_or_default(), ground, background: background.unwrap_or_default() };
    let mut settings = SettingsPatch::default();
    let said = own.get("settings").and_then(Value::as_object).into_iter().flatten();
    let exposure = own.get("exposure_ev100").map(|value| ("exposure", value));
    for (key, value) in exposure.into_iter().chain(said.map(|(key, value)| (key.as_str(), value))) {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        if let Err(why) = settings.set(key, &text) {
            odd(key, value, &why.to_string());
        }
    }
    Some(Surroundings { environment, is_lit, settings })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(extras: &str) -> (Option<Surroundings>, Vec<String>) {
        let document: Document = serde_json::from_str(&format!(r#"{{"scenes":[{{"extras":{extras}}}]}}"#)).unwrap();
        let mut warnings = Vec::new();
        (read(&document, 0, &mut warnings), warnings)
    }

    #[test]
    fn extras_of_this_program_are_read_and_others_passed_over() {
        let (own, warnings) =
            of(r#"{"afterlight":{"ambient_nits":[1,2,3],"background_nits":[0,0,0.5],"exposure_ev100":7.25,
            "exposure_scale":0.005,"size":[16,9],"settings":{"tonemap":"aces","size":"32x32"}}}"#);
        let own = own.unwrap();
        assert_eq!(warnings, Vec::<String>::new());
        assert_eq!((own.environment.ambient, own.environment.background), (Vec3::new(1.0, 2.0, 3.0), Vec3::Z * 0.5));
        assert_eq!((own.is_lit, own.settings.exposure, own.settings.size), (true, Some(7.25), Some([32, 32])));
        assert_eq!(own.settings, "size=32x32 exposure=7.25 tonemap=aces".parse().unwrap());
        for extras in ["null", "7", "[1]", r#"{"other":{}}"#, r#"{"afterlight":3}"#] {
            assert_eq!(of(extras), (None, Vec::new()), "{extras}");
        }
    }

    #[test]
    fn values_that_cannot_be_are_left_out_by_name() {
        for (key, value) in [
            ("ambient_nits", "[1,2]"),
            ("ambient_nits", "[1,-2,3]"),
            ("background_nits", "\"blue\""),
            ("exposure_ev100", "1e9"),
            ("settings", r#"{"tonemap":"none of them"}"#),
        ] {
            let (own, warnings) = of(&format!(r#"{{"afterlight":{{"{key}":{value}}}}}"#));
            assert_eq!(own, Some(Surroundings::default()), "{key}");
            assert!(warnings.len() == 1 && warnings[0].contains("extras.afterlight."), "{key}: {warnings:?}");
        }
    }
}
