//! `[sky]`.

use std::path::{Path, PathBuf};

use super::node::{KeyedValue, NumberRange, SHARE, Table};
use super::schema::Schema;
use crate::fit::ground;
use crate::sky::{Atmosphere, Sky, Studio, put_atmosphere, read_faces, read_panorama};
use crate::{Error, Scene};

pub(super) const TABLE: Schema =
    Schema { table: "sky", keys: &["file", "faces", "atmosphere", "studio", "rotation_degrees", "strength", "lights"] };
pub(super) const ATMOSPHERE: Schema = Schema {
    table: "sky.atmosphere",
    keys: &["elevation_degrees", "azimuth_degrees", "haze", "ground", "altitude", "sun"],
};

const DEGREES: NumberRange = NumberRange::new("a number from -1e6 to 1e6", |x| x.abs() <= 1e6);
const ELEVATION: NumberRange = NumberRange::new("from -90 to 90 degrees", |x| (-90.0..=90.0).contains(&x));
const HAZE: NumberRange = NumberRange::new("from 0 to 100", |x| (0.0..=100.0).contains(&x));
const ALTITUDE: NumberRange = NumberRange::new("from 0 to 50000 metres", |x| (0.0..=50e3).contains(&x));
const NITS: NumberRange = NumberRange::new("from 0 to 1e9", |x| (0.0..=1e9).contains(&x));

/// Gives the scene the sky of its file.
pub(super) fn sky(node: &KeyedValue, scene: &mut Scene, folder: &Path) -> Result<(), Error> {
    let table = node.table(TABLE)?;
    let of_image = |image| Sky { image, rotation_degrees: 0.0, nits: 1.0, lights: true, shown: true, sun: None };
    let [file, faces, air] = ["file", "faces", "atmosphere"].map(|key| table.get(key));
    let studio = table.read("studio", KeyedValue::boolean)?.filter(|is_on| *is_on);
    match (file, faces, air, studio) {
        (None, None, None, Some(_)) => {
            ground::remove(scene);
            scene.sky = Some(Studio::get().sky(1.0));
            ground::add(scene, ground::ALBEDO);
        }
        (Some(file), None, None, None) => {
            let path = folder.join(file.string()?);
            let image = read_panorama(&path, &mut scene.warnings).map_err(|error| file.wrong(error))?;
            scene.files.push(path);
            scene.sky = Some(of_image(image.into()));
        }
        (None, Some(faces), None, None) => {
            let names: [KeyedValue; 6] = faces.items("the files of +X, -X, +Y, -Y, +Z and -Z")?;
            let mut paths: [PathBuf; 6] = Default::default();
            for (path, name) in paths.iter_mut().zip(&names) {
                *path = folder.join(name.string()?);
            }
            let read = read_faces(&paths.each_ref().map(PathBuf::as_path), &mut scene.warnings);
            let image = read.map_err(|error| faces.wrong(error))?;
            scene.files.extend(paths);
            scene.sky = Some(of_image(image.into()));
        }
        (None, None, Some(air), None) => atmosphere(&air.table(ATMOSPHERE)?, scene)?,
        (None, None, None, None) if scene.sky.is_some() => {}
        _ => return Err(table.wrong("a sky has one of file, faces, atmosphere and studio")),
    }
    let Some(sky) = &mut scene.sky else { return Ok(()) };
    sky.rotation_degrees = table.read("rotation_degrees", |node| node.number(DEGREES))?.unwrap_or(sky.rotation_degrees);
    sky.nits = table.read("strength", |node| node.number_f32(NITS))?.unwrap_or(sky.nits);
    sky.lights = table.read("lights", KeyedValue::boolean)?.unwrap_or(sky.lights);
    Ok(())
}

fn atmosphere(table: &Table, scene: &mut Scene) -> Result<(), Error> {
    let usual = Atmosphere::default();
    let elevation = table.read("elevation_degrees", |node| node.number(ELEVATION))?;
    let azimuth = table.read("azimuth_degrees", |node| node.number(DEGREES))?;
    let sun = match (elevation, azimuth) {
        (None, None) => None,
        (elevation, azimuth) => Some(Atmosphere::sun_at(elevation.unwrap_or(35.0), azimuth.unwrap_or(140.0))),
    };
    let air = Atmosphere {
        haze: table.read("haze", |node| node.number(HAZE))?.unwrap_or(usual.haze),
        ground: table.read("ground", |node| node.number(SHARE))?.unwrap_or(usual.ground),
        altitude: table.read("altitude", |node| node.number(ALTITUDE))?.unwrap_or(usual.altitude),
        ..usual
    };
    let adds = table.read("sun", KeyedValue::boolean)?.unwrap_or(false);
    put_atmosphere(scene, air, sun, adds);
    Ok(())
}
