//! Animations as keys. A channel that cannot be played is left out with a warning that names it.

use std::collections::BTreeSet;

use super::accessor::Accessors;
use super::json::{Animation, AnimationChannel, AnimationSampler, AnimationTarget, Document, Whole, entry, named};
use super::material_keys;
use super::pointer::{self, Aim};
use crate::scene::Interpolation;

/// The largest number that keys can have.
const MOST_VALUE: f64 = 1e18;

/// An animation of the file.
pub(super) struct Take {
    pub name: String,
    pub keys: Vec<Keys>,
}

/// Keys of one value of something of the file.
pub(super) struct Keys {
    pub aim: Aim,
    pub times: Vec<f64>,
    pub values: Vec<f64>,
    pub interpolation: Interpolation,
}

/// Reads all animations.
pub(super) fn read(document: &Document, accessors: &Accessors, warnings: &mut Vec<String>) -> Vec<Take> {
    let mut names = BTreeSet::new();
    let take = |(index, animation): (usize, &Animation)| {
        let own = animation.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("clip {index}"));
        // Users pick clips by their names.
        let mut name = own.clone();
        let mut number = 2;
        while !names.insert(name.clone()) {
            name = format!("{own} ({number})");
            number += 1;
        }
        let mut keys: Vec<Keys> = Vec::new();
        let mut aims = BTreeSet::new();
        for (number, channel) in animation.channels.iter().enumerate() {
            let place = || format!("{}, channel {number}", named("animation", index, animation.name.as_ref()));
            match read_channel(document, accessors, animation, channel) {
                Ok(Some(read)) if aims.insert(read.aim) => keys.push(read),
                Ok(Some(_)) => warnings.push(format!("{}: moves what another channel moves, left out", place())),
                Ok(None) => {}
                Err(what) => warnings.push(format!("{}: {what}, left out", place())),
            }
        }
        material_keys::rewrite(document, &mut keys);
        // Products of a file's values may exceed the limit of values.
        let all = keys.iter_mut().flat_map(|keys| &mut keys.values);
        all.for_each(|value| *value = value.clamp(-MOST_VALUE, MOST_VALUE));
        Take { name, keys }
    };
    document.animations.iter().enumerate().map(take).collect()
}

/// `None` for a channel whose target is nothing.
fn read_channel(
    document: &Document,
    accessors: &Accessors,
    animation: &Animation,
    channel: &AnimationChannel,
) -> Result<Option<Keys>, String> {
    let Some(aim) = aim(document, &channel.target)? else { return Ok(None) };
    let sampler = channel.sampler.ok_or("has no sampler")?;
    let sampler = entry("sampler", &animation.samplers, sampler)?;
    let interpolation = match sampler.interpolation.as_deref().unwrap_or("LINEAR") {
        "LINEAR" => Interpolation::Linear,
        "STEP" => Interpolation::Step,
        "CUBICSPLINE" => Interpolation::CubicSpline,
        other => return Err(format!("its interpolation is `{}`", other.escape_debug())),
    };
    let times = times(accessors, sampler)?;
    let width = aim.width(document);
    let values = values(accessors, sampler, aim)?;
    let of_key = width * if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    if of_key == 0 || values.len() != times.len() * of_key {
        let (found, keys) = (values.len(), times.len());
        return Err(format!("has {found} numbers for {keys} keys of {of_key} each"));
    }
    if let Some(key) = values.iter().position(|value| !value.is_finite() || value.abs() > MOST_VALUE) {
        return Err(format!("a value of key {} is not from -1e18 to 1e18", key / of_key));
    }
    if aim.is_rotation() && !rotations_turn(&values, interpolation) {
        return Err("a rotation is 0".into());
    }
    Ok(Some(Keys { aim, times, values, interpolation }))
}

fn aim(document: &Document, target: &AnimationTarget) -> Result<Option<Aim>, String> {
    if let Some(own) = &target.extensions.pointer {
        let of = |what: String| format!("the pointer `{}` {what}", own.pointer.escape_debug());
        return pointer::aim(document, &own.pointer).map(Some).map_err(of);
    }
    let Some(node) = target.node else { return Ok(None) };
    entry("node", &document.nodes, node)?;
    match target.path.as_deref() {
        Some("translation") => Ok(Some(Aim::Translation(node.0))),
        Some("rotation") => Ok(Some(Aim::Rotation(node.0))),
        Some("scale") => Ok(Some(Aim::Scale(node.0))),
        Some("weights") => Ok(Some(Aim::Weights(node.0))),
        Some(other) => Err(format!("its path is `{}`", other.escape_debug())),
        None => Err("has no path".into()),
    }
}

fn times(accessors: &Accessors, sampler: &AnimationSampler) -> Result<Vec<f64>, String> {
    let input = sampler.input.ok_or("its sampler has no times")?;
    let times: Vec<f64> = accessors.numbers::<1>(input, &["SCALAR"])?.into_iter().map(|[time]| time).collect();
    if let Some(key) = times.iter().position(|time| !time.is_finite()) {
        return Err(format!("the time of key {key} is not finite"));
    }
    if let Some(key) = times.windows(2).position(|pair| pair[0] >= pair[1]) {
        return Err(format!("the time of key {} is not after that of key {key}", key + 1));
    }
    Ok(times)
}

fn values(accessors: &Accessors, sampler: &AnimationSampler, aim: Aim) -> Result<Vec<f64>, String> {
    let output: Whole = sampler.output.ok_or("its sampler has no values")?;
    let flat = |values: Vec<f64>| Ok(values);
    match aim.kind() {
        "VEC2" => flat(accessors.numbers::<2>(output, &["VEC2"])?.into_flattened()),
        "VEC3" => flat(accessors.numbers::<3>(output, &["VEC3"])?.into_flattened()),
        "VEC4" => flat(accessors.numbers::<4>(output, &["VEC4"])?.into_flattened()),
        _ => flat(accessors.numbers::<1>(output, &["SCALAR"])?.into_flattened()),
    }
}

/// Returns true if each key of a rotation turns to somewhere.
fn rotations_turn(values: &[f64], interpolation: Interpolation) -> bool {
    let (step, first) = if interpolation == Interpolation::CubicSpline { (12, 4) } else { (4, 0) };
    let length = |key: &[f64]| key[first..first + 4].iter().map(|part| part * part).sum::<f64>();
    values.chunks_exact(step).all(|key| length(key) > 1e-24)
}
