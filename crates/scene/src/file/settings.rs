//! `[camera]`, `[environment]` and `[settings]`.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::node::{FIELD_OF_VIEW, KeyedValue, LENGTH, STRENGTH, Table};
use super::place::rotation;
use super::schema;
use crate::{Camera, Environment, Error, Projection, SETTINGS, Setting, SettingsPatch, ValueKind};

/// Reads the file's values of the camera; the others come from the camera `before`.
pub(super) fn camera(node: &KeyedValue, before: Camera) -> Result<Camera, Error> {
    let table = node.table(schema::CAMERA)?;
    let camera = camera_of(&table, before)?;
    Ok(Camera { near: table.read("near", |node| node.number(LENGTH))?.unwrap_or(camera.near), ..camera })
}

/// Reads a camera's place, rotation and lens: the keys that `[camera]` and a key of a camera path share.
pub(super) fn camera_of(table: &Table, mut camera: Camera) -> Result<Camera, Error> {
    camera.position = table.read("position", KeyedValue::point)?.unwrap_or(camera.position);
    let up = table.read("up", KeyedValue::direction)?;
    match (table.get("target"), table.get("rotation")) {
        (Some(target), None) => {
            let place = target.point()?;
            if place == camera.position {
                return Err(target.wrong("must not be the camera's own position"));
            }
            camera.rotation = Camera::looking_at(camera.position, place, up.unwrap_or(DVec3::Y)).rotation;
        }
        (None, Some(node)) => camera.rotation = rotation(&node)?,
        (Some(_), Some(node)) => return Err(node.wrong("a camera has either target or rotation")),
        (None, None) => {}
    }
    if let (Some(up), None) = (table.get("up"), table.get("target")) {
        return Err(up.wrong("up goes with target"));
    }
    match (table.get("fov_y_degrees"), table.get("orthographic_height")) {
        (Some(node), None) => camera.projection = Projection::perspective(node.number(FIELD_OF_VIEW)?),
        (None, Some(node)) => camera.projection = Projection::orthographic(node.number(LENGTH)?),
        (Some(_), Some(node)) => return Err(node.wrong("a camera has either fov_y_degrees or orthographic_height")),
        (None, None) => {}
    }
    Ok(camera)
}

/// `camera.exposure`: the same as `settings.exposure`, for users who look for it at the camera.
pub(super) fn camera_exposure(node: &KeyedValue) -> Result<SettingsPatch, Error> {
    let mut patch = SettingsPatch::default();
    if let Some(node) = node.table(schema::CAMERA)?.get("exposure") {
        SETTINGS.iter().filter(|setting| setting.key == "exposure").try_for_each(|own| said(own, &node, &mut patch))?;
    }
    Ok(patch)
}

pub(super) fn environment(node: &KeyedValue, environment: Environment) -> Result<Environment, Error> {
    let table = node.table(schema::ENVIRONMENT)?;
    let light = |color: &str, strength: &str, before: Vec3| -> Result<Vec3, Error> {
        let nits = table.read(strength, |node| node.number_f32(STRENGTH))?.unwrap_or(1.0);
        Ok(table.read(color, |node| node.color(STRENGTH))?.unwrap_or(before) * nits)
    };
    let says = |keys: &[&str]| keys.iter().find_map(|key| table.get(key));
    let halves = says(&["sky", "sky_strength", "ground", "ground_strength"]);
    if let (Some(node), Some(_)) = (&halves, says(&["ambient", "ambient_strength"])) {
        return Err(node.wrong("an environment has either ambient, or sky and ground"));
    }
    let even = |before| light("ambient", "ambient_strength", before);
    let (ambient, ground) = match halves {
        Some(_) => {
            let ground = light("ground", "ground_strength", environment.ground())?;
            (light("sky", "sky_strength", environment.ambient)?, Some(ground))
        }
        // One colour is for both halves; a strength alone keeps the ratio of the base's two colours.
        None if says(&["ambient"]).is_some() => (even(environment.ambient)?, None),
        None => (even(environment.ambient)?, environment.ground.map(even).transpose()?),
    };
    Ok(Environment { ambient, ground, background: light("background", "background_strength", environment.background)? })
}

pub(super) fn settings(node: &KeyedValue) -> Result<SettingsPatch, Error> {
    let mut patch = SettingsPatch::default();
    rows(node)?.into_iter().try_for_each(|(setting, node)| said(setting, &node, &mut patch))?;
    Ok(patch)
}

/// The settings that a table says, each with its key.
fn rows<'a>(node: &KeyedValue<'a>) -> Result<Vec<(&'static Setting, KeyedValue<'a>)>, Error> {
    let table = node.table(schema::SETTINGS)?;
    // `true`, `false`, or a table.
    let (on, shadows) = match table.get("shadows") {
        Some(node) if node.is_boolean() => (Some(node), None),
        Some(node) => (None, Some(node.table(schema::SHADOWS)?)),
        None => (None, None),
    };
    let row = |setting: &'static Setting| {
        let node = match setting.toml.split_once('.') {
            None => table.get(setting.toml),
            Some((_, "enabled")) if on.is_some() => on.clone(),
            Some((_, key)) => shadows.as_ref().and_then(|shadows| shadows.get(key)),
        };
        Some((setting, node?))
    };
    Ok(SETTINGS.iter().filter_map(row).collect())
}

/// Returns the place of each of them in the file, by the settings' keys.
pub(super) fn lines(node: &KeyedValue) -> Vec<(&'static str, String)> {
    let rows = rows(node).unwrap_or_default();
    rows.into_iter().map(|(setting, node)| (setting.key, node.place())).collect()
}

/// Puts the file's value of a setting into the patch.
fn said(setting: &Setting, node: &KeyedValue, patch: &mut SettingsPatch) -> Result<(), Error> {
    let text = match setting.values {
        ValueKind::OnOff => if node.boolean()? { "on" } else { "off" }.to_owned(),
        // A value that is no number gives an empty text, which is refused.
        ValueKind::Whole(..) | ValueKind::Among(_) | ValueKind::Number(..) => node.digits().unwrap_or_default(),
        // `[1280, 720]` or `"1280x720"`.
        ValueKind::Size if !node.is_string() => {
            let [width, height] = node.items("[width, height] in pixels")?;
            format!("{}x{}", width.integer(1..=u32::MAX)?, height.integer(1..=u32::MAX)?)
        }
        // `[160, 90, 64]` or `"160x90x64"`.
        ValueKind::Grid(..) if !node.is_string() => {
            let [across, down, deep] = node.items("[columns, rows, slices]")?;
            let [across, down, deep] = [across, down, deep].map(|own| own.integer(1..=u32::MAX));
            format!("{}x{}x{}", across?, down?, deep?)
        }
        ValueKind::Aperture if !node.is_string() => node.digits().unwrap_or_default(),
        ValueKind::Size
        | ValueKind::Grid(..)
        | ValueKind::Aperture
        | ValueKind::Names(_)
        | ValueKind::Layout
        | ValueKind::Parts => node.string()?.to_owned(),
    };
    setting.set(patch, Some(&text)).map_err(|why| node.wrong(why))
}

/// The settings of the file that `from` names, which is added to `files`.
pub(super) fn from(node: &KeyedValue, folder: &Path, files: &mut Vec<PathBuf>) -> Result<Option<SettingsPatch>, Error> {
    node.table(schema::SETTINGS)?.read("from", |node| {
        let path = folder.join(node.string()?);
        files.push(path.clone());
        let read = super::read_file(&path).and_then(|text| super::parse_settings(&text, &path));
        read.map_err(|error| super::from_another(node, error))
    })
}
