//! Animations as keys. A channel that cannot be played, and a key that cannot be, are left out with a warning that names them.

use std::collections::BTreeSet;

use super::accessor::Accessors;
use super::json::{Animation, AnimationChannel, AnimationSampler, AnimationTarget, Document, Whole, entry, named};
use super::material_keys;
use super::pointer::{self, Aim};
use crate::Interpolation;

/// The largest number that keys can have.
const MOST_VALUE: f64 = 1e18;

/// An animation of the file.
pub(super) struct FileAnimation {
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
pub(super) fn read(document: &Document, accessors: &Accessors, warnings: &mut Vec<String>) -> Vec<FileAnimation> {
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
            let mut odd = Vec::new();
            let read = read_channel((document, accessors), animation, channel, &mut odd);
            warnings.extend(odd.iter().map(|what| format!("{}: {what}", place())));
            match read {
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
        FileAnimation { name, keys }
    };
    document.animations.iter().enumerate().map(take).collect()
}

/// `None` for a channel whose target is nothing.
fn read_channel(
    (document, accessors): (&Document, &Accessors),
    animation: &Animation,
    channel: &AnimationChannel,
    odd: &mut Vec<String>,
) -> Result<Option<Keys>, String> {
    let Some(aim) = aim(document, &channel.target)? else { return Ok(None) };
    let sampler = channel.sampler.ok_or("has no sampler")?;
    let sampler = entry("sampler", &animation.samplers, sampler)?;
    let times = times(accessors, sampler)?;
    let values = values(accessors, sampler, aim)?;
    let width = aim.width(document);
    let interpolation = match sampler.interpolation.as_deref().unwrap_or("LINEAR") {
        "LINEAR" => Interpolation::Linear,
        "STEP" => Interpolation::Step,
        "CUBICSPLINE" => Interpolation::CubicSpline,
        other => {
            odd.push(format!("its interpolation is `{}`, played as LINEAR", other.escape_debug()));
            Interpolation::Linear
        }
    };
    if width == 0 {
        return Err("moves weights of a mesh that has no shapes".into());
    }
    let of_value = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
    let mut keys = Keys { aim, times, values, interpolation };
    if matches!(aim, Aim::Weights(_)) {
        keys.fit_weights(width, of_value, odd);
    }
    keys.keep_pairs(width * of_value, odd)?;
    keys.keep_finite(width, odd);
    keys.keep_order(width * of_value, odd);
    match keys.times.is_empty() {
        true => Err("has no key that can be played".into()),
        false => Ok(Some(keys)),
    }
}

impl Keys {
    /// Makes as many weights of each key as its mesh has shapes, where the file has weights for more or fewer.
    fn fit_weights(&mut self, shapes: usize, of_value: usize, odd: &mut Vec<String>) {
        let rows = self.times.len() * of_value;
        let Some(found) = self.values.len().checked_div(rows).filter(|found| *found > 0 && *found != shapes) else {
            return;
        };
        if found * rows != self.values.len() {
            return;
        }
        odd.push(format!(
            "has weights for {found} shapes, but its mesh has {shapes}: more are left out, and others stay 0"
        ));
        let fitted = |row: &[f64]| -> Vec<f64> {
            (0..shapes).map(|shape| row.get(shape).copied().unwrap_or_default()).collect()
        };
        self.values = self.values.chunks_exact(found).flat_map(fitted).collect();
    }

    /// Keeps the keys that have both a time and a value.
    fn keep_pairs(&mut self, of_key: usize, odd: &mut Vec<String>) -> Result<(), String> {
        let (found, keys) = (self.values.len(), self.times.len());
        if found == keys * of_key {
            return Ok(());
        }
        let words = format!("has {found} numbers for {keys} keys of {of_key} each");
        let count = keys.min(found / of_key);
        if count == 0 {
            return Err(words);
        }
        odd.push(format!("{words}: the first {count} keys play"));
        self.times.truncate(count);
        self.values.truncate(count * of_key);
        Ok(())
    }

    /// Leaves out keys whose time or value is no number, too large, or a rotation of length 0.
    fn keep_finite(&mut self, width: usize, odd: &mut Vec<String>) {
        let of_key = self.values.len() / self.times.len().max(1);
        let middle = if self.interpolation == Interpolation::CubicSpline { width } else { 0 };
        let fault = |key: usize| {
            let value = &self.values[key * of_key..][..of_key];
            if !self.times[key].is_finite() {
                return Some(format!("the time of key {key} is not finite"));
            }
            if value.iter().any(|value| !value.is_finite() || value.abs() > MOST_VALUE) {
                return Some(format!("a value of key {key} is not from -1e18 to 1e18"));
            }
            let length: f64 = value[middle..][..width].iter().map(|part| part * part).sum();
            (self.aim.is_rotation() && length <= 1e-24).then(|| format!("the rotation of key {key} is 0"))
        };
        let faults: Vec<Option<String>> = (0..self.times.len()).map(fault).collect();
        let kept: Vec<usize> = (0..faults.len()).filter(|&key| faults[key].is_none()).collect();
        self.keep(&kept, of_key, faults.iter().flatten().next(), odd);
    }

    /// Leaves out as few keys as can be so that no time goes back. Of several keys at one time the first and the last stay, a jump, which a time as
    /// little later as can be told; where the first key's time repeats, the last of them.
    fn keep_order(&mut self, of_key: usize, odd: &mut Vec<String>) {
        let times = &self.times;
        let Some(first) = times.windows(2).position(|pair| pair[0] >= pair[1]) else { return };
        let fault = format!("the time of key {} is not after that of key {first}", first + 1);
        let mut kept = Vec::new();
        for run in rising(times).chunk_by(|&a, &b| times[a] == times[b]) {
            match run {
                [first, .., last] if !kept.is_empty() => kept.extend([*first, *last]),
                [.., last] => kept.push(*last),
                [] => {}
            }
        }
        self.keep(&kept, of_key, Some(&fault), odd);
        for key in 1..self.times.len() {
            if self.times[key] <= self.times[key - 1] {
                self.times[key] = self.times[key - 1].next_up();
            }
        }
    }

    /// Keeps these keys, and tells how many are left out and the first fault.
    fn keep(&mut self, kept: &[usize], of_key: usize, fault: Option<&String>, odd: &mut Vec<String>) {
        let left_out = self.times.len() - kept.len();
        if left_out > 0 {
            self.values = kept.iter().flat_map(|&key| self.values[key * of_key..][..of_key].to_vec()).collect();
            self.times = kept.iter().map(|&key| self.times[key]).collect();
        }
        if let Some(fault) = fault {
            odd.push(match left_out {
                0 => format!("{fault}: both play, one at once after the other"),
                1 => format!("{fault}: a key is left out, the others play"),
                _ => format!("{fault}: {left_out} keys are left out, the others play"),
            });
        }
    }
}

/// The longest list of keys, in order, whose times never go back.
fn rising(times: &[f64]) -> Vec<usize> {
    // At place n, the key with the earliest time that ends a list of n + 1 keys (C. Schensted, "Longest Increasing and Decreasing Subsequences", 1961).
    let mut ends: Vec<usize> = Vec::new();
    let mut before: Vec<Option<usize>> = vec![None; times.len()];
    for key in 0..times.len() {
        let place = ends.partition_point(|&end| times[end] <= times[key]);
        before[key] = place.checked_sub(1).map(|place| ends[place]);
        if place == ends.len() {
            ends.push(key);
        } else {
            ends[place] = key;
        }
    }
    let mut kept: Vec<usize> = std::iter::successors(ends.last().copied(), |&key| before[key]).collect();
    kept.reverse();
    kept
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
    Ok(accessors.numbers::<1>(input, &["SCALAR"])?.into_iter().map(|[time]| time).collect())
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
