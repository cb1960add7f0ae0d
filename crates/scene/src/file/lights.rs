//! `[[lights]]`.

use std::fmt::Write as _;

use glam::{DVec3, Vec3};
use toml::Value;

use super::node::{
    CONE_ANGLE, COORDINATE, KELVIN, KeyedValue, LENGTH, NumberRange, RADIUS, SHARE, STRENGTH, SUN_ANGLE, Table,
};
use super::schema::{self, Schema};
use crate::{Error, Falloff, Light, LightKind, black_body_color, luminance, unit};

pub(super) const LIGHT: Schema = Schema {
    table: "lights",
    keys: &[
        "name",
        "kind",
        "color",
        "temperature",
        "intensity",
        "casts_shadow",
        "radius",
        "angular_diameter_degrees",
        "direction",
        "position",
        "target",
        "range",
        "falloff",
        "inner_angle_degrees",
        "outer_angle_degrees",
        "edge",
    ],
};

/// Keys that every light takes.
const COMMON: [&str; 6] = ["name", "kind", "color", "temperature", "intensity", "casts_shadow"];

/// The keys of a kind of light.
struct LightSchema {
    word: &'static str,
    /// Keys besides the common ones.
    keys: &'static [&'static str],
    /// The key of [`Light::size`].
    size: (&'static str, NumberRange),
    casts_shadow: bool,
    /// Reads the kind, given the light's luminous intensity in candela, colour included.
    read: fn(&Table, f64) -> Result<LightKind, Error>,
}

static KINDS: [LightSchema; 4] = [
    LightSchema {
        word: "directional",
        keys: &["direction", "angular_diameter_degrees"],
        size: ("angular_diameter_degrees", SUN_ANGLE),
        casts_shadow: true,
        read: directional,
    },
    LightSchema {
        word: "point",
        keys: &["position", "range", "falloff", "radius"],
        size: ("radius", RADIUS),
        casts_shadow: false,
        read: point,
    },
    LightSchema {
        word: "spot",
        keys: &[
            "position",
            "direction",
            "target",
            "inner_angle_degrees",
            "outer_angle_degrees",
            "range",
            "falloff",
            "radius",
        ],
        size: ("radius", RADIUS),
        casts_shadow: false,
        read: spot,
    },
    LightSchema {
        word: "beam",
        keys: &["position", "direction", "target", "radius", "edge", "range", "angular_diameter_degrees"],
        size: ("angular_diameter_degrees", SUN_ANGLE),
        casts_shadow: false,
        read: beam,
    },
];

pub(super) fn light(node: &KeyedValue, index: usize) -> Result<Light, Error> {
    let table = node.table(LIGHT)?;
    let words = KINDS.each_ref().map(|kind| kind.word);
    let [others @ .., last] = &words;
    let needs_kind = || table.wrong(&format!("needs kind: {} or {last}", others.join(", ")));
    let word = table.get("kind").ok_or_else(needs_kind)?.word(&words)?;
    let kind = KINDS.iter().find(|kind| kind.word == word).ok_or_else(needs_kind)?;
    // A key that this kind of light does not look at is a slip.
    let foreign = LIGHT.keys.iter().filter(|key| !COMMON.contains(key) && !kind.keys.contains(key));
    if let Some(node) = foreign.filter_map(|key| table.get(key)).next() {
        return Err(node.wrong(format!("a {word} light has no such key")));
    }
    let intensity = table.get("intensity").ok_or_else(|| table.wrong("needs intensity, in lux or candela"))?;
    let intensity = intensity.number_f32(STRENGTH)?;
    let color = color(&table)?;
    let (size, limit) = kind.size;
    Ok(Light {
        name: table.read("name", KeyedValue::string)?.map_or_else(|| format!("light {index}"), str::to_owned),
        color,
        intensity,
        size: table.read(size, |node| node.number(limit))?.unwrap_or(0.0),
        casts_shadow: table.read("casts_shadow", KeyedValue::boolean)?.unwrap_or(kind.casts_shadow),
        kind: (kind.read)(&table, f64::from(luminance(color)) * f64::from(intensity))?,
    })
}

/// A light as [`light`] reads it.
pub(super) fn to_toml(light: &Light) -> String {
    let Light { name, kind, color, intensity, casts_shadow, size } = light;
    let form = match kind {
        LightKind::Directional { .. } => &KINDS[0],
        LightKind::Point { .. } => &KINDS[1],
        LightKind::Spot { .. } => &KINDS[2],
        LightKind::Beam { .. } => &KINDS[3],
    };
    let name = Value::String(name.clone());
    let mut text = format!("name = {name}\nkind = \"{}\"\ncolor = {:?}\n", form.word, color.to_array());
    let _ = writeln!(text, "intensity = {intensity:?}\ncasts_shadow = {casts_shadow}\n{} = {size:?}", form.size.0);
    let mut point = |key: &str, point: &DVec3| _ = writeln!(text, "{key} = {:?}", point.to_array());
    let falloff = match kind {
        LightKind::Directional { direction } => {
            point("direction", direction);
            None
        }
        LightKind::Point { position, range, falloff } => {
            point("position", position);
            Some((range, *falloff))
        }
        LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, range, falloff } => {
            point("position", position);
            point("direction", direction);
            let _ = writeln!(text, "inner_angle_degrees = {inner_angle_degrees:?}");
            let _ = writeln!(text, "outer_angle_degrees = {outer_angle_degrees:?}");
            Some((range, *falloff))
        }
        LightKind::Beam { position, direction, radius, edge, range } => {
            point("position", position);
            point("direction", direction);
            let _ = writeln!(text, "radius = {radius:?}\nedge = {edge:?}");
            Some((range, Falloff::InverseSquare))
        }
    };
    if let Some((Some(range), _)) = falloff {
        let _ = writeln!(text, "range = {range:?}");
    }
    let _ = match falloff {
        None | Some((_, Falloff::InverseSquare)) => Ok(()),
        Some((_, Falloff::Quadratic)) => writeln!(text, "falloff = \"quadratic\""),
        Some((_, Falloff::Polynomial { constant, linear, quadratic })) => {
            writeln!(text, "falloff = {{ constant = {constant:?}, linear = {linear:?}, quadratic = {quadratic:?} }}")
        }
    };
    text
}

/// Linear RGB as it is written, or the colour of heat; white without either.
fn color(table: &Table) -> Result<Vec3, Error> {
    match (table.get("color"), table.get("temperature")) {
        (Some(_), Some(node)) => Err(node.wrong("a light has either color or temperature")),
        (Some(color), None) => color.color(STRENGTH),
        (None, Some(kelvin)) => kelvin.number(KELVIN).map(black_body_color),
        (None, None) => Ok(Vec3::ONE),
    }
}

fn position(table: &Table) -> Result<DVec3, Error> {
    table.read("position", KeyedValue::point)?.ok_or_else(|| table.wrong("needs position"))
}

/// Reads a light's place and direction.
fn aim(table: &Table) -> Result<(DVec3, DVec3), Error> {
    let position = position(table)?;
    let direction = match (table.get("direction"), table.get("target")) {
        (Some(direction), None) => direction.direction()?,
        (None, Some(target)) => {
            unit(target.point()? - position).ok_or_else(|| target.wrong("must not be the light's own position"))?
        }
        _ => return Err(table.wrong("needs either direction or target")),
    };
    Ok((position, direction))
}

fn directional(table: &Table, _: f64) -> Result<LightKind, Error> {
    let direction = table.read("direction", KeyedValue::direction)?.ok_or_else(|| table.wrong("needs direction"))?;
    Ok(LightKind::Directional { direction })
}

fn point(table: &Table, candela: f64) -> Result<LightKind, Error> {
    let (range, falloff) = reach(table, candela)?;
    Ok(LightKind::Point { position: position(table)?, range, falloff })
}

fn spot(table: &Table, candela: f64) -> Result<LightKind, Error> {
    let (position, direction) = aim(table)?;
    let outer = table.read("outer_angle_degrees", |node| node.number(CONE_ANGLE))?.unwrap_or(45.0);
    let inner = table.get("inner_angle_degrees");
    let inner_angle_degrees = match &inner {
        Some(node) => node.number(CONE_ANGLE)?,
        None => 0.0,
    };
    if let Some(node) = inner.filter(|_| inner_angle_degrees > outer) {
        return Err(node.wrong(format!("must not be above outer_angle_degrees, which is {outer}")));
    }
    let (range, falloff) = reach(table, candela)?;
    Ok(LightKind::Spot { position, direction, inner_angle_degrees, outer_angle_degrees: outer, range, falloff })
}

fn beam(table: &Table, _: f64) -> Result<LightKind, Error> {
    let (position, direction) = aim(table)?;
    let radius =
        table.get("radius").ok_or_else(|| table.wrong("needs radius, of the disc in metres"))?.number(LENGTH)?;
    let edge = table.read("edge", |node| node.number(SHARE))?.unwrap_or(0.1);
    let range = table.read("range", |node| node.number(LENGTH))?;
    Ok(LightKind::Beam { position, direction, radius, edge, range })
}

/// Range and fall-off, which must fit each other. `candela` is the light's luminous intensity, colour and all.
pub(super) fn reach(table: &Table, candela: f64) -> Result<(Option<f64>, Falloff), Error> {
    let range = table.read("range", |node| node.number(LENGTH))?;
    let Some(node) = table.get("falloff") else { return Ok((range, Falloff::InverseSquare)) };
    if node.is_table() {
        let (falloff, cutoff) = polynomial(&node)?;
        return match (cutoff, range) {
            (Some(_), Some(_)) => Err(node.wrong("a light has either range or falloff.cutoff")),
            (Some(lux), None) => Ok((cut(falloff, candela, lux), falloff)),
            (None, range) => Ok((range, falloff)),
        };
    }
    match node.word(&["inverse-square", "quadratic"])? {
        "quadratic" if range.is_none() => Err(node.wrong("a quadratic fall-off needs a range")),
        "quadratic" => Ok((range, Falloff::Quadratic)),
        _ => Ok((range, Falloff::InverseSquare)),
    }
}

/// The range at whose end the light brings `lux`. A light that never does, since it is brighter everywhere, has no limit; one that is
/// nowhere as bright has the least range that there is, and lights nothing.
fn cut(falloff: Falloff, candela: f64, lux: f64) -> Option<f64> {
    falloff.polynomial_radius(candela, lux).filter(|radius| *radius <= 1e15).map(|radius| radius.max(1e-12))
}

/// The fall-off and the brightness in lux at which it ends.
fn polynomial(node: &KeyedValue) -> Result<(Falloff, Option<f64>), Error> {
    let table = node.table(schema::FALLOFF)?;
    let term = |name: &str| -> Result<f32, Error> {
        let Some(term) = table.get(name) else { return Ok(0.0) };
        let value = term.number_f32(COORDINATE)?;
        if value < 0.0 { Err(term.wrong("must not be negative")) } else { Ok(value) }
    };
    let (constant, linear, quadratic) = (term("constant")?, term("linear")?, term("quadratic")?);
    if constant + linear + quadratic <= 0.0 {
        return Err(node.wrong("needs at least one of constant, linear, quadratic above 0"));
    }
    let cutoff = table.read("cutoff", |node| node.number(STRENGTH))?;
    Ok((Falloff::Polynomial { constant, linear, quadratic }, cutoff))
}
