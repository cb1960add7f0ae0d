//! Keys of material values, rewritten in the numbers of the materials that are made: emission times its strength, and the alpha that is drawn.

use std::collections::BTreeSet;

use super::animation::Keys;
use super::json::{Document, Material};
use super::materials::held_back;
use super::pointer::Aim;
use crate::{Interpolation, MaterialValue};

/// Rewrites the keys of one animation.
pub(super) fn rewrite(document: &Document, keys: &mut [Keys]) {
    let aims: BTreeSet<Aim> = keys.iter().map(|keys| keys.aim).collect();
    for keys in keys {
        let Aim::Material(index, value) = keys.aim else { continue };
        let Some(material) = document.materials.get(index) else { continue };
        let moves = |value| aims.contains(&Aim::Material(index, value));
        match value {
            // Either is multiplied by the file's value of the other, unless that moves too.
            MaterialValue::Emissive if !moves(MaterialValue::EmissiveStrength) => {
                keys.values = keys.values.iter().map(|channel| channel * strength(material)).collect();
            }
            MaterialValue::EmissiveStrength if !moves(MaterialValue::Emissive) => {
                let color = material.emissive_factor.map(|channel| channel.clamp(0.0, 1.0));
                keys.aim = Aim::Material(index, MaterialValue::Emissive);
                keys.values = keys.values.iter().flat_map(|strength| color.map(|channel| channel * strength)).collect();
            }
            MaterialValue::BaseColor => cover(material, keys),
            _ => {}
        }
    }
}

/// Kept small enough that its product with a key is one.
fn strength(material: &Material) -> f64 {
    let own = material.extensions.emissive.as_ref().and_then(|own| own.emissive_strength);
    own.unwrap_or(1.0).clamp(0.0, 1e18)
}

/// Alpha counts where the material blends or is masked, and glass holds back a share of the light on top of that.
fn cover(material: &Material, keys: &mut Keys) {
    let mode = material.alpha_mode.as_deref();
    let glass = material.extensions.transmission.as_ref().filter(|_| mode != Some("MASK"));
    let held = glass.map_or(1.0, held_back);
    let is_spline = keys.interpolation == Interpolation::CubicSpline;
    for (number, color) in keys.values.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        color[3] = match mode {
            Some("MASK" | "BLEND") => color[3] * held,
            // The tangents of a constant value are 0.
            _ if is_spline && number % 3 != 1 => 0.0,
            _ => held,
        };
    }
}
