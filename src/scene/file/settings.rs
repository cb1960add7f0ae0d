//! `[camera]`, `[environment]` and `[settings]`.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::node::{EV100, FACTOR, FIELD_OF_VIEW, LENGTH, Node, SHARE, STRENGTH, Table};
use super::place::rotation;
use super::schema;
use crate::scene::{
    Camera, Environment, Error, MAX_SHADOW_SIZE, MIN_SHADOW_SIZE, Projection, SettingsPatch, parse_size,
};

/// What the file says of the camera, over what there was.
pub(super) fn camera(node: &Node, before: Camera) -> Result<Camera, Error> {
    let table = node.table(schema::CAMERA)?;
    let camera = camera_of(&table, before)?;
    Ok(Camera { near: table.read("near", |node| node.number(LENGTH))?.unwrap_or(camera.near), ..camera })
}

/// Where a camera is, how it is turned, and its lens: what `[camera]` and a key of a camera path have in common.
pub(super) fn camera_of(table: &Table, mut camera: Camera) -> Result<Camera, Error> {
    camera.position = table.read("position", Node::point)?.unwrap_or(camera.position);
    let up = table.read("up", Node::direction)?;
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

/// `camera.exposure`: the same as `settings.exposure`, for who thinks of it as the camera's.
pub(super) fn camera_exposure(node: &Node) -> Result<Option<f32>, Error> {
    node.table(schema::CAMERA)?.read("exposure", |node| node.number_f32(EV100))
}

pub(super) fn environment(node: &Node, environment: Environment) -> Result<Environment, Error> {
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
        // One colour is that of both; a strength alone leaves the base's two as they are to each other.
        None if says(&["ambient"]).is_some() => (even(environment.ambient)?, None),
        None => (even(environment.ambient)?, environment.ground.map(even).transpose()?),
    };
    Ok(Environment { ambient, ground, background: light("background", "background_strength", environment.background)? })
}

pub(super) fn settings(node: &Node) -> Result<SettingsPatch, Error> {
    let table = node.table(schema::SETTINGS)?;
    let mut patch = SettingsPatch {
        size: table.read("size", size)?,
        exposure: table.read("exposure", |node| node.number_f32(EV100))?,
        tonemap: table.read("tonemap", Node::name)?,
        brdf: table.read("brdf", Node::name)?,
        gbuffer: table.read("gbuffer", Node::name)?,
        view: table.read("view", Node::name)?,
        light_path: table.read("light_path", Node::name)?,
        light_cutoff: table.read("light_cutoff", Node::boolean)?,
        depth_prepass: table.read("depth_prepass", Node::boolean)?,
        textbook: table.read("textbook", Node::boolean)?,
        samples: table.read("samples", |node| node.integer(1..=crate::scene::MAX_SAMPLES))?,
        resolve: table.read("resolve", Node::name)?,
        fxaa: table.read("fxaa", Node::boolean)?,
        hdr_format: table.read("hdr_format", Node::name)?,
        transparency: table.read("transparency", Node::name)?,
        msaa: table.read("msaa", |node| node.integer(1..=8))?,
        anisotropy: table.read("anisotropy", |node| node.integer(1..=crate::scene::MAX_ANISOTROPY))?,
        keep: table.read("plan", Node::name)?,
        ..SettingsPatch::default()
    };
    if let Some(node) = table.get("shadows") {
        shadows(&node, &mut patch)?;
    }
    patch.check().map_err(|error| node.wrong(error))?;
    Ok(patch)
}

/// The settings of the file that `from` names, which is added to `files`.
pub(super) fn from(node: &Node, folder: &Path, files: &mut Vec<PathBuf>) -> Result<Option<SettingsPatch>, Error> {
    node.table(schema::SETTINGS)?.read("from", |node| {
        let path = folder.join(node.string()?);
        files.push(path.clone());
        super::load_settings(&path).map_err(|error| super::from_another(node, error))
    })
}

/// `[1280, 720]` or `"1280x720"`.
fn size(node: &Node) -> Result<[u32; 2], Error> {
    if node.is_string() {
        return parse_size(node.string()?).map_err(|error| node.wrong(error));
    }
    let [width, height] = node.items("[width, height] in pixels")?;
    Ok([width.integer(1..=u32::MAX)?, height.integer(1..=u32::MAX)?])
}

/// `true`, `false`, or a table.
fn shadows(node: &Node, patch: &mut SettingsPatch) -> Result<(), Error> {
    if node.is_boolean() {
        patch.shadows = Some(node.boolean()?);
        return Ok(());
    }
    let table = node.table(schema::SHADOWS)?;
    let bias = |name: &str| -> Result<Option<f32>, Error> {
        let Some(node) = table.get(name) else { return Ok(None) };
        let bias = node.number_f32(FACTOR)?;
        if (0.0..=1000.0).contains(&bias) { Ok(Some(bias)) } else { Err(node.wrong("must be 0 to 1000")) }
    };
    patch.shadows = table.read("enabled", Node::boolean)?;
    patch.shadow_size = table.read("size", |node| node.integer(MIN_SHADOW_SIZE..=MAX_SHADOW_SIZE))?;
    patch.shadow_filter = table.read("filter", Node::name)?;
    patch.cascades = table.read("cascades", |node| node.integer(1..=4))?;
    patch.shadow_lambda = table.read("lambda", |node| node.number_f32(SHARE))?;
    patch.shadow_budget = table.read("budget", |node| node.integer(1..=u32::MAX))?;
    patch.shadow_cache = table.read("cache", Node::boolean)?;
    patch.shadow_normal_offset = bias("normal_offset")?;
    patch.shadow_slope_bias = bias("slope_bias")?;
    Ok(())
}
