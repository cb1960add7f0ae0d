//! `[[emitters]]`.

use glam::{DVec3, Vec3};

use super::materials::Textures;
use super::node::{KeyedValue, NumberRange, SHARE, STRENGTH, Table};
use super::schema::Schema;
use crate::emitter::{Emitter, MOST_FRAMES, MOST_KEYS};
use crate::{ColorSpace, Error, Filter, Sampler, Scene, Wrap};

pub(super) const TABLE: Schema = Schema {
    table: "emitters",
    keys: &[
        "name",
        "position",
        "extent",
        "rate",
        "life",
        "start",
        "end",
        "velocity",
        "spread",
        "gravity",
        "drag",
        "size",
        "color",
        "emission",
        "lit",
        "turn_degrees",
        "spin_degrees",
        "softness",
        "texture",
        "frames",
        "frame",
        "seed",
    ],
};

const RATE: NumberRange = NumberRange::new("from 1e-6 to 1e9 particles a second", |x| (1e-6..=1e9).contains(&x));
const LIFE: NumberRange = NumberRange::new("from 1e-6 to 1e6 seconds", |x| (1e-6..=1e6).contains(&x));
const MOMENT: NumberRange = NumberRange::new("from -1e9 to 1e9 seconds", |x| x.abs() <= 1e9);
const EXTENT: NumberRange = NumberRange::new("from 0 to 1e9 metres", |x| (0.0..=1e9).contains(&x));
const SPEED: NumberRange = NumberRange::new("a number from -1e6 to 1e6", |x| x.abs() <= 1e6);
const SPREAD: NumberRange = NumberRange::new("from 0 to 1e6", |x| (0.0..=1e6).contains(&x));
const TURN: NumberRange = NumberRange::new("from 0 to 360 degrees", |x| (0.0..=360.0).contains(&x));
const SPIN: NumberRange = NumberRange::new("from 0 to 36000 degrees", |x| (0.0..=36e3).contains(&x));

/// The sampler of particles' textures: no filter reaches over the edge of a cell.
const SAMPLER: Sampler =
    Sampler { wrap: [Wrap::Clamp; 2], magnify: Filter::Linear, minify: Filter::Linear, levels: Some(Filter::Linear) };

/// Adds an emitter to the scene.
pub(super) fn emitter(
    node: &KeyedValue,
    index: usize,
    scene: &mut Scene,
    textures: &mut Textures,
) -> Result<(), Error> {
    let table = node.table(TABLE)?;
    let usual = Emitter::default();
    let needed = |key: &str| table.get(key).ok_or_else(|| table.wrong(&format!("needs {key}")));
    let number = |key: &str, limit| table.read(key, |node| node.number(limit));
    let vector = |key: &str, limit| table.read(key, |node| node.numbers(limit, "[x, y, z]").map(DVec3::from));
    let frames = |node: &KeyedValue| {
        let [columns, rows]: [KeyedValue; 2] = node.items("[columns, rows]")?;
        Ok([columns.integer(1..=MOST_FRAMES)?, rows.integer(1..=MOST_FRAMES)?])
    };
    let emitter = Emitter {
        name: table
            .read("name", |node| node.string().map(str::to_owned))?
            .unwrap_or_else(|| format!("emitter {index}")),
        position: needed("position")?.point()?,
        extent: vector("extent", EXTENT)?.unwrap_or(usual.extent),
        rate: needed("rate")?.number(RATE)?,
        life: needed("life")?.number(LIFE)?,
        start: number("start", MOMENT)?,
        end: number("end", MOMENT)?,
        velocity: vector("velocity", SPEED)?.unwrap_or(usual.velocity),
        spread: vector("spread", SPREAD)?.unwrap_or(usual.spread),
        gravity: vector("gravity", SPEED)?.unwrap_or(usual.gravity),
        drag: number("drag", SPREAD)?.unwrap_or(usual.drag),
        size: over_life(&table, "size", |node| node.number_f32(EXTENT), |node| node.is_number())?.unwrap_or(usual.size),
        color: over_life(&table, "color", color, is_color)?.unwrap_or(usual.color),
        emission: over_life(&table, "emission", |node| node.color(STRENGTH), is_color)?.unwrap_or(usual.emission),
        lit: table.read("lit", KeyedValue::boolean)?.unwrap_or(usual.lit),
        turn_degrees: number("turn_degrees", TURN)?.unwrap_or(usual.turn_degrees),
        spin_degrees: number("spin_degrees", SPIN)?.unwrap_or(usual.spin_degrees),
        softness: number("softness", SPREAD)?.unwrap_or(usual.softness),
        texture: table.read("texture", |node| textures.image(node, (ColorSpace::Srgb, SAMPLER), scene))?,
        frames: table.read("frames", frames)?.unwrap_or(usual.frames),
        picks_frame: table.read("frame", |node| node.word(&["life", "random"]))? == Some("random"),
        seed: table.read("seed", |node| node.integer(0..=u32::MAX))?.unwrap_or(index as u32),
    };
    if let Some(fault) = emitter.fault(scene) {
        return Err(table.wrong(&fault));
    }
    scene.emitters.push(emitter);
    Ok(())
}

/// All of them together, told where the last one stands.
pub(super) fn check(scene: &Scene, last: &KeyedValue) -> Result<(), Error> {
    scene.emitters_fault().map_or(Ok(()), |fault| Err(last.table(TABLE)?.wrong(&fault)))
}

/// One value, or a list of some.
fn over_life<T>(
    table: &Table,
    key: &str,
    read: impl Fn(&KeyedValue) -> Result<T, Error>,
    is_one: fn(&KeyedValue) -> bool,
) -> Result<Option<Vec<T>>, Error> {
    table.read(key, |node| match is_one(node) {
        true => Ok(vec![read(node)?]),
        false => {
            let values = node.list()?.iter().map(&read).collect::<Result<Vec<_>, _>>()?;
            match (1..=MOST_KEYS).contains(&values.len()) {
                true => Ok(values),
                false => Err(node.wrong(format!("must be one value, or up to {MOST_KEYS} over life"))),
            }
        }
    })
}

/// Not a list of several.
fn is_color(node: &KeyedValue) -> bool {
    node.is_string() || node.list().is_ok_and(|items| items.first().is_some_and(KeyedValue::is_number))
}

/// As any colour, and with alpha as a fourth number.
fn color(node: &KeyedValue) -> Result<[f32; 4], Error> {
    if node.list().is_ok_and(|items| items.len() == 4) {
        return Ok(node.numbers(SHARE, "linear [r, g, b, alpha]")?.map(|own: f64| own as f32));
    }
    let Vec3 { x, y, z } = node.color(SHARE)?;
    Ok([x, y, z, 1.0])
}
