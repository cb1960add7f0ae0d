//! Parameters of lobes that materials have beside base and highlight, as `shaders/shared/lobes.wgsl` has them.

use std::f64::consts::PI;
use std::sync::OnceLock;

use glam::Vec4;
use rayon::prelude::*;

use crate::gpu::{Buffer, SetWriter};
use crate::plan::FramePlan;
use crate::scene::{MIN_SHEEN_ROUGHNESS, Material};
use crate::shaders::shared::lobes as wgsl;
use crate::visible::World;

/// The binding in set 0.
const LOBES: u32 = 11;
/// The picture behind glass (`shaders/shared/refraction.wgsl`).
const BACKDROP: u32 = 13;

/// The bindings of set 0.
pub(super) fn bindings(plan: &FramePlan) -> impl Iterator<Item = u32> {
    plan.effects.lobes.iter().flat_map(|_| [LOBES, BACKDROP])
}

/// Names both buffers. Without glass the rows take the place of the picture behind it, which nobody reads there.
pub(super) fn write(rows: &Buffer, backdrop: Option<&Buffer>, writer: SetWriter) -> SetWriter {
    let backdrop = backdrop.unwrap_or(rows);
    writer.storage_buffer(LOBES, rows, rows.size).storage_buffer(BACKDROP, backdrop, backdrop.size)
}

/// The place of the first row in the buffer.
pub(super) const ROWS_AT: u64 = 4 * wgsl::SHEEN_SHARES as u64;

const _: () = {
    use crate::shaders::forward::structs::lobe_row;
    assert!(size_of::<LobeRow>() == lobe_row::SIZE);
    assert!(wgsl::SHEEN_SHARES == wgsl::SHEEN_EDGE * wgsl::SHEEN_EDGE);
    assert!(wgsl::MIN_SHEEN_ROUGHNESS == MIN_SHEEN_ROUGHNESS);
};

/// `LobeRow` of the shader.
type LobeRow = [Vec4; 7];

/// The rows of a frame's materials, in the plan's order.
pub(super) fn rows(world: &World, plan: &FramePlan) -> Vec<LobeRow> {
    let materials = plan.effects.lobes.iter().flat_map(|own| &own.materials);
    let row = |&material: &usize| {
        let Material { sheen, film, anisotropy, diffuse_transmission, refraction, .. } = &world.materials[material];
        let glass = refraction.unwrap_or_default();
        let [least, most] = film.nanometres;
        let (sin, cos) = f64::from(anisotropy.rotation).sin_cos();
        [
            sheen.color.extend(sheen.roughness),
            Vec4::new(film.strength, film.ior, least, most),
            Vec4::new(anisotropy.strength, cos as f32, sin as f32, 0.0),
            diffuse_transmission.color.extend(diffuse_transmission.strength),
            Vec4::new(glass.ior, glass.thickness, glass.iors()[2] - glass.ior, 0.0),
            glass.absorption().extend(0.0),
            (world.environment.background * world.exposure).min(glam::Vec3::splat(plan.largest_light())).extend(0.0),
        ]
    };
    materials.map(row).collect()
}

/// Steps of the sums along each angle: twice as many change a share by less than 1e-4.
const STEPS: usize = 48;

/// The share of even light that a white sheen scatters in a direction: a row for each roughness, and in it a number for each root of the cosine.
pub(super) fn sheen_shares() -> &'static [f32] {
    static SHARES: OnceLock<Vec<f32>> = OnceLock::new();
    SHARES.get_or_init(|| {
        let (edge, last) = (wgsl::SHEEN_EDGE, (wgsl::SHEEN_EDGE - 1) as f32);
        let row = |row: u32| {
            let alpha = (row as f32 / last).max(MIN_SHEEN_ROUGHNESS).powi(2);
            (0..edge)
                .map(move |column| sheen_share((column as f32 / last).max(0.01).powi(2), alpha))
                .collect::<Vec<_>>()
        };
        (0..edge).into_par_iter().flat_map(row).collect()
    })
}

/// The integral of D V (n.l) of the sheen over all directions l.
fn sheen_share(n_dot_v: f32, alpha: f32) -> f32 {
    let sine = (1.0 - n_dot_v * n_dot_v).max(0.0).sqrt();
    let at_view = hidden(n_dot_v, alpha);
    let (count, inverse) = (STEPS as f32, 1.0 / alpha);
    let around: [[f32; 2]; STEPS] = std::array::from_fn(|step| {
        let (sin, cos) = ((step as f32 + 0.5) / count * PI as f32).sin_cos();
        [cos, sin]
    });
    let ring = |step: usize| {
        // Rings are denser at grazing angles, where most of the sheen is.
        let root = (step as f32 + 0.5) / count;
        let n_dot_l = root * root;
        let level = (1.0 - n_dot_l * n_dot_l).sqrt();
        let up = (n_dot_l + n_dot_v).powi(2);
        let scattered = |[x, y]: [f32; 2]| {
            let flat = (level * x + sine).powi(2) + (level * y).powi(2);
            (flat / (flat + up)).powf(0.5 * inverse)
        };
        let sum: f32 = around.into_iter().map(scattered).sum();
        // n.l of the visibility and of the light are the same. The solid angle is 2 root / count by 2 pi / count.
        sum * root / (1.0 + at_view + hidden(n_dot_l, alpha))
    };
    let sum: f32 = (0..STEPS).map(ring).sum();
    (2.0 + inverse) * sum * 0.5 / (n_dot_v * count * count)
}

/// Lambda of its visibility, as the shader has it.
fn hidden(cosine: f32, alpha: f32) -> f32 {
    let smooth = (1.0 - alpha).powi(2);
    let fitted = |at_rough: f32, at_smooth: f32| at_rough + (at_smooth - at_rough) * smooth;
    let curve = |x: f32| {
        let (a, b, c) = (fitted(21.5473, 25.3245), fitted(3.82987, 3.32435), fitted(0.19823, 0.16801));
        a / (1.0 + b * x.max(1e-6).powf(c)) + fitted(-1.97760, -1.27393) * x + fitted(-4.32054, -4.85967)
    };
    if cosine < 0.5 { curve(cosine).exp() } else { (2.0 * curve(0.5) - curve(1.0 - cosine)).exp() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_a_sheen_are_those_of_a_finer_sum_and_fall_towards_the_normal() {
        let shares = sheen_shares();
        let edge = wgsl::SHEEN_EDGE as usize;
        assert_eq!(shares.len(), edge * edge);
        // Sums of 300 by 300 steps in 64 bits, by row and column.
        for (row, column, expected) in FINE {
            let found = f64::from(shares[row * edge + column]);
            assert!((found - expected).abs() < 2e-4 + 1e-3 * expected, "{row} {column}: {found}, not {expected}");
        }
        for row in shares.chunks(edge) {
            assert!(row[edge / 3..].windows(2).all(|pair| pair[1] <= pair[0]), "{row:?}");
        }
    }

    const FINE: [(usize, usize, f64); 7] = [
        (3, 4, 1.75488),
        (6, 10, 0.54487),
        (15, 8, 0.63337),
        (15, 31, 0.02332),
        (24, 16, 0.47577),
        (31, 2, 0.93102),
        (31, 31, 0.16378),
    ];
}
