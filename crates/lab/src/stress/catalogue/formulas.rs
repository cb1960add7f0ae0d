//! Single formulas of the shaders, each on tens of thousands of inputs for a value.
//!
//! Unless a case says otherwise, its limits follow from the rounding of the inputs and of each operation to 6e-8. A cosine near 1 tells nothing of
//! its angle, so sharp lobes go by sines; a highlight as wide as `alpha` errs by about four times the rounding of a direction over `alpha`, and by
//! more where light and eye are nearly opposite, since unequal lengths then turn the half vector. A cone's edge of a thousandth (`spot-cone`)
//! multiplies each rounding of its cosine by 1000. Along the horizon (`grazing`) the cosine is nothing but its rounding.

use glam::DVec3;

use super::super::formula::inputs::{self, COUNT, REFLECTION, filled, rng, share};
use super::super::formula::{Formula, FormulaTruth, Input, Judge, Trial, truth};
use super::super::{Bound, Case, Check, SweepValues, case};
use afterlight::gpu_scene::FrameUniform;
use afterlight::scene::Falloff;

const ROUGHNESS: SweepValues = SweepValues::List(&[0.0, 1e-4, 1e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0]);
const POWERS: SweepValues = SweepValues::List(&[0.0, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6]);

pub const CASES: &[Case] = &[
    case(
        "formulas/cook-torrance",
        "the whole reflection model, from a matt wall to a highlight narrower than directions can tell; \
         light along and against the view",
    )
    .over(ROUGHNESS, "")
    .claim([0.0, 1.0], Bound { worst: 2e-2, mean: 4e-4 })
    .check(Check::Formula(|roughness| {
        reflection(Formula::CookTorrance, truth::cook_torrance, roughness, roughness.max(0.01).powi(2))
    })),
    case(
        "formulas/cook-torrance-grazing",
        "light and eye both at this cosine to the surface, half of the time opposite",
    )
    .over(SweepValues::Decades(-7, 0), "")
    .claim([1e-3, 1.0], Bound { worst: 1e-4, mean: 2e-5 })
    .check(Check::Formula(|cosine| {
        each(Formula::CookTorrance, REFLECTION, truth::anywhere, inputs::grazing(cosine, 0.5))
    })),
    case(
        "formulas/cook-torrance-opposite",
        "the eye where light goes to, but for this much, behind a surface that the light falls on",
    )
    .over(SweepValues::Decades(-9, 0), "")
    .claim([1e-4, 1.0], Bound { worst: 3e-6, mean: 6e-7 })
    .check(Check::Formula(|apart| {
        each(Formula::CookTorrance, REFLECTION, truth::anywhere, inputs::opposite(apart, 1.0))
    })),
    case("formulas/phong", "the whole model, by its specular power")
        .over(POWERS, "")
        .claim([0.0, 1e6], Bound { worst: 3e-3, mean: 1e-4 })
        .check(Check::Formula(|power| reflection(Formula::Phong, truth::phong, power, lobe_width(power)))),
    case("formulas/blinn-phong", "the whole model, by its specular power")
        .over(POWERS, "")
        .claim([0.0, 1e6], Bound { worst: 3e-3, mean: 1e-4 })
        .check(Check::Formula(|power| reflection(Formula::BlinnPhong, truth::blinn_phong, power, lobe_width(power)))),
    case("formulas/sheen", "the lobe of a sheen, by its roughness")
        .over(ROUGHNESS, "")
        .claim([0.0, 1.0], Bound { worst: 1e-3, mean: 1e-5 })
        .check(Check::Formula(|roughness| reflection(Formula::Sheen, truth::sheen, roughness, 1.0))),
    case("formulas/thin-film", "the reflectance of a thin film over any surface, from any angle, by its thickness")
        .over(SweepValues::List(&[0.0, 1e-3, 0.02, 1.0, 100.0, 250.0, 400.0, 700.0, 1200.0, 1e4, 1e6]), "nm")
        .claim([0.0, 1e6], Bound { worst: 1e-4, mean: 2e-6 })
        .check(Check::Formula(thin_film)),
    case("formulas/anisotropy", "a highlight that grooves stretch, by its roughness along them; of any strength and direction")
        .over(ROUGHNESS, "")
        .claim([0.0, 1.0], Bound { worst: 2e-2, mean: 4e-4 })
        .check(Check::Formula(|roughness| {
            each(Formula::Grooves, GROOVES, truth::grooves, inputs::reflection(roughness, roughness.max(0.01).powi(2)))
        })),
    case("formulas/diffuse-transmission", "light that comes through a surface, by the share of the base that lets it")
        .over(ROUGHNESS, "")
        // A highlight that reflects nearly all leaves the rounding of 1.
        .claim([0.0, 1.0], Bound { worst: 1e-4, mean: 3e-7 })
        .check(Check::Formula(|share| each(Formula::Through, THROUGH, truth::through, inputs::reflection(share, 1.0)))),
    case(
        "formulas/furnace-through",
        "all that a white surface without a highlight gets from white furnaces on both sides, by the share that comes through: no more than 1",
    )
    .over(ROUGHNESS, "")
    .claim([0.0, 1.0], Bound { worst: 1e-6, mean: 3e-7 })
    .check(Check::Formula(|share| {
        let judge = Judge::Sums { of: inputs::SAMPLES, truth: truth::both_sides, weight: truth::cosine_weight };
        Trial { judge, ..each(Formula::Leaf, THROUGH, truth::both_sides, inputs::leaf(share)) }
    })),
    case("formulas/furnace-sheen", "all that a white sheen of this roughness gets from a white furnace: as the truth has it, and no more than 1")
        .over(ROUGHNESS, "")
        .claim([0.0, 1.0], Bound { worst: 3e-5, mean: 4e-6 })
        .check(Check::Formula(|roughness| {
            let judge = Judge::Sums { of: inputs::SAMPLES, truth: truth::sheen, weight: truth::cosine_weight };
            Trial { judge, ..each(Formula::Sheen, REFLECTION, truth::sheen, inputs::leaf(roughness)) }
        })),
    case("formulas/furnace-grooves", "all that a white mirror with grooves of this roughness gets from a white furnace, likewise")
        .over(ROUGHNESS, "")
        .claim([0.0, 1.0], Bound { worst: 5e-5, mean: 1e-5 })
        .check(Check::Formula(|roughness| {
            let judge = Judge::Sums { of: inputs::SAMPLES, truth: truth::grooves, weight: truth::groove_weight };
            Trial { judge, ..each(Formula::Grooves, GROOVES, truth::grooves, inputs::grooved(roughness)) }
        })),
    case("formulas/ggx-distribution", "D alone, by roughness, in and around its peak")
        .over(ROUGHNESS, "")
        .claim([0.0, 1.0], Bound { worst: 3e-3, mean: 1e-4 })
        .check(Check::Formula(distribution)),
    case("formulas/smith-masking", "V alone, by one cosine, for any other and any roughness")
        .over(SweepValues::List(&[0.0, 1e-40, 1e-20, 1e-7, 1e-4, 1e-2, 0.1, 0.5, 1.0]), "")
        .claim([0.0, 1.0], Bound { worst: 1e-6, mean: 2e-7 })
        .check(Check::Formula(masking)),
    case("formulas/fresnel", "Schlick's, by the cosine between view and half vector")
        .over(
            SweepValues::List(&[0.0, 6e-8, 1e-4, 1e-2, 0.1, 0.5, 0.9, 0.99, 1.0 - f32::EPSILON as f64 / 2.0, 1.0]),
            "",
        )
        .claim([0.0, 1.0], Bound { worst: 1e-6, mean: 2e-7 })
        .check(Check::Formula(fresnel)),
    case("formulas/ambient", "share of light from everywhere, by roughness")
        .over(ROUGHNESS, "")
        // A dielectric that reflects little grazing is the difference of two larger terms.
        .claim([0.0, 1.0], Bound { worst: 1e-5, mean: 5e-7 })
        .check(Check::Formula(|roughness| {
            each(Formula::Ambient, REFLECTION, truth::ambient, inputs::reflection(roughness, 1.0))
        })),
    case(
        "formulas/furnace-in",
        "all that a white mirror of this roughness gets from a white furnace: as the truth has it, and no more than 1",
    )
    .over(ROUGHNESS, "")
    .claim([0.0, 1.0], Bound { worst: 5e-5, mean: 1e-5 })
    .check(Check::Formula(|roughness| furnace(roughness, truth::furnace_in, false))),
    case("formulas/furnace-out", "all that it sends out of what one light brings")
        .over(ROUGHNESS, "")
        .claim([0.0, 1.0], Bound { worst: 5e-5, mean: 1.5e-5 })
        .check(Check::Formula(|roughness| furnace(roughness, truth::furnace_out, true))),
    case("formulas/reciprocity", "light and eye change places, by roughness")
        .over(ROUGHNESS, "")
        .claim([0.0, 1.0], Bound { worst: 5e-6, mean: 2e-7 })
        .check(Check::Formula(|roughness| exchanged(Formula::CookTorrance, roughness, roughness.max(0.01).powi(2)))),
    case("formulas/reciprocity-phong", "light and eye change places, by specular power")
        .over(POWERS, "")
        .claim([0.0, 1e6], Bound { worst: 3e-3, mean: 1e-4 })
        .check(Check::Formula(|power| exchanged(Formula::Phong, power, lobe_width(power)))),
    case("formulas/fall-off", "inverse square, quadratic and polynomial, by distance")
        .over(SweepValues::Decades(-6, 6), "m")
        .claim([1e-6, 1e6], Bound { worst: 1e-6, mean: 2e-7 })
        .check(Check::Formula(fall_off)),
    case("formulas/to-light", "direction to a light, by distance")
        .over(SweepValues::Decades(-12, 18), "m")
        .claim([1e-6, 1e6], Bound { worst: 5e-7, mean: 2e-7 })
        .check(Check::Formula(|metres| each(Formula::ToLight, inputs::LAMP, truth::to_light, fall_off(metres).inputs))),
    case("formulas/range", "window and fall-off, by range, from inside of it to a thousand times as far")
        .over(SweepValues::Decades(-18, 18), "m")
        .claim([1e-6, 1e6], Bound { worst: 1e-6, mean: 2e-7 })
        .check(Check::Formula(range)),
    case("formulas/spot-cone", "by the outer angle, half of the time the same as the inner one")
        .over(SweepValues::List(&[0.0, 1e-6, 1e-3, 0.1, 1.0, 10.0, 45.0, 89.999, 90.0, 135.0, 179.9, 180.0]), "degrees")
        .claim([0.0, 180.0], Bound { worst: 1e-3, mean: 2e-5 })
        .check(Check::Formula(cone)),
    case("formulas/octahedral", "normals to the octahedral map and back, by how far they are from an axis or a fold")
        .over(SweepValues::Decades(-8, 0), "")
        .claim([1e-8, 1.0], Bound { worst: 6e-7, mean: 2e-7 })
        .check(Check::Formula(|off| each(Formula::Octahedral, NORMAL, truth::normal, normals(off)))),
    case("formulas/octahedral-16", "the same through two codes of 16 bits")
        .over(SweepValues::Decades(-8, 0), "")
        .claim([1e-8, 1.0], Bound { worst: 6.5e-5, mean: 4e-5 })
        .check(Check::Formula(|off| each(Formula::Octahedral16, NORMAL, truth::normal, normals(off)))),
    case("formulas/tone-neutral", "by the light of the brightest channel")
        .over(LIGHT, "")
        .claim([1e-8, 65000.0], Bound { worst: 2e-6, mean: 3e-7 })
        .check(Check::Formula(|light| tone(light, 0))),
    case("formulas/tone-agx", "by the light of the brightest channel")
        .over(LIGHT, "")
        .claim([1e-8, 65000.0], Bound { worst: 6e-5, mean: 2e-5 })
        .check(Check::Formula(|light| tone(light, 1))),
    case("formulas/tone-aces", "by the light of the brightest channel")
        .over(LIGHT, "")
        .claim([1e-8, 65000.0], Bound { worst: 2e-6, mean: 5e-7 })
        .check(Check::Formula(|light| tone(light, 2))),
    case("formulas/srgb", "encoding, by the brightest channel")
        .over(SweepValues::Decades(-10, 0), "")
        .claim([1e-10, 1.0], Bound { worst: 3e-6, mean: 1e-6 })
        .check(Check::Formula(|light| each(Formula::EncodeSrgb, COLOR, truth::encoded, colors(light, 0)))),
    case(
        "formulas/position",
        "rebuilt from depth over a picture of 1920 x 1080, by distance; the near plane is at 1 cm",
    )
    .over(SweepValues::Decades(-2, 12), "m")
    .claim([1e-2, 1e12], Bound { worst: 6e-7, mean: 2e-7 })
    .check(Check::Formula(position)),
    case("formulas/shininess", "a specular power through its encoding and back")
        .over(SweepValues::List(&[0.0, 1e-4, 1e-2, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6]), "")
        .claim([0.0, 1e6], Bound { worst: 1e-5, mean: 2e-6 })
        .check(Check::Formula(shininess)),
];

const LIGHT: SweepValues =
    SweepValues::List(&[1e-8, 1e-6, 1e-4, 1e-3, 1e-2, 0.08, 0.1, 0.76, 1.0, 10.0, 100.0, 1e3, 1e4, 65000.0]);
const GROOVES: &[(&str, usize)] =
    &[("normal", 3), ("roughness", 1), ("view", 3), ("strength", 1), ("light", 3), ("", 1), ("across", 3)];
const THROUGH: &[(&str, usize)] = &[
    ("normal", 3),
    ("share", 1),
    ("view", 3),
    ("metallic", 1),
    ("opposite to the light", 3),
    ("reflectance facing", 1),
    ("colour", 3),
    ("reflectance grazing", 1),
];
const NORMAL: &[(&str, usize)] = &[("normal", 3)];
const COLOR: &[(&str, usize)] = &[("colour", 3)];

type InputNames = &'static [(&'static str, usize)];

fn each(formula: Formula, names: InputNames, truth: fn(&Input) -> FormulaTruth, inputs: Vec<Input>) -> Trial {
    let signed = matches!(formula, Formula::Octahedral | Formula::Octahedral16 | Formula::Position | Formula::ToLight);
    Trial { formula, inputs, names, frame: None, judge: Judge::Each { truth, signed }, planted: false }
}

fn reflection(formula: Formula, truth: fn(&Input) -> FormulaTruth, stiffness: f64, width: f64) -> Trial {
    each(formula, REFLECTION, truth, inputs::reflection(stiffness, width))
}

/// The angle at which a power of its cosine has fallen to about a third.
fn lobe_width(power: f64) -> f64 {
    (2.0 / power.max(1.0)).sqrt()
}

fn furnace(roughness: f64, weight: fn(&Input) -> f64, out: bool) -> Trial {
    let judge = Judge::Sums { of: inputs::SAMPLES, truth: truth::anywhere, weight };
    let inputs = inputs::furnace(roughness, out);
    Trial { formula: Formula::CookTorrance, inputs, names: REFLECTION, frame: None, judge, planted: false }
}

fn exchanged(formula: Formula, stiffness: f64, width: f64) -> Trial {
    let judge = Judge::Pairs { cosine: truth::light_cosine };
    let inputs = inputs::exchanged(stiffness, width);
    Trial { formula, inputs, names: REFLECTION, frame: None, judge, planted: false }
}

fn distribution(roughness: f64) -> Trial {
    let mut rng = rng(roughness);
    let alpha = roughness.max(0.01).powi(2);
    let inputs = (0..COUNT).map(|_| {
        let normal = inputs::direction(&mut rng).as_vec3();
        let angle = (alpha * 10f64.powf(6.0 * rng.f64() - 4.0)).min(1.5);
        let half = inputs::around(normal.as_dvec3(), angle.cos(), 6.0 * rng.f64());
        // As l + v: of any length up to 2.
        let half = (half * f64::from(2.0 * rng.f32()).max(0.1)).as_vec3();
        filled([normal.x, normal.y, normal.z, roughness as f32, half.x, half.y, half.z])
    });
    let names = &[("normal", 3), ("roughness", 1), ("half vector", 3)];
    each(Formula::Distribution, names, truth::distribution, inputs.collect())
}

fn masking(cosine: f64) -> Trial {
    let mut rng = rng(cosine);
    // The other is that to the eye, which has a least value.
    let inputs = (0..COUNT).map(|_| filled([cosine as f32, share(&mut rng).max(1e-4), share(&mut rng)]));
    let names = &[("n.l", 1), ("n.v", 1), ("roughness", 1)];
    each(Formula::Masking, names, truth::masking, inputs.collect())
}

fn fresnel(cosine: f64) -> Trial {
    let mut rng = rng(cosine);
    let inputs = (0..COUNT).map(|_| {
        let [red, green, blue] = [0; 3].map(|_| share(&mut rng));
        filled([red, green, blue, cosine as f32, share(&mut rng)])
    });
    each(Formula::Fresnel, &[("facing", 3), ("v.h", 1), ("grazing", 1)], truth::fresnel, inputs.collect())
}

fn thin_film(nanometres: f64) -> Trial {
    let mut rng = rng(nanometres);
    let inputs = (0..COUNT).map(|_| {
        let [red, green, blue, cosine] = [0; 4].map(|_| share(&mut rng));
        filled([red, green, blue, cosine, 1.0 + 2.0 * share(&mut rng), nanometres as f32])
    });
    let names = &[("facing below", 3), ("v.h", 1), ("index", 1), ("thickness", 1)];
    each(Formula::Film, names, truth::film, inputs.collect())
}

/// Lights this far away, in any direction, that shine everywhere.
fn fall_off(metres: f64) -> Trial {
    let mut rng = rng(metres);
    let inputs = (0..COUNT).map(|_| {
        let falloff = match rng.u32(0..3) {
            0 => Falloff::InverseSquare,
            1 => Falloff::Quadratic,
            _ => Falloff::Polynomial { constant: share(&mut rng), linear: rng.f32(), quadratic: share(&mut rng) },
        };
        let place = inputs::direction(&mut rng) * metres;
        let range = if falloff == Falloff::Quadratic { Some((metres * 2.0) as f32) } else { None };
        inputs::lamp(place, None, range, falloff)
    });
    each(Formula::Strength, inputs::LAMP, truth::strength, inputs.collect())
}

fn range(metres: f64) -> Trial {
    let mut rng = rng(metres);
    let inputs = (0..COUNT).map(|_| {
        let falloff = if rng.bool() { Falloff::InverseSquare } else { Falloff::Quadratic };
        let share = [0.0, 1.0, 1.0 - 6e-8, 1.0 + 1.2e-7, rng.f64(), 10f64.powf(3.0 * rng.f64())][rng.usize(0..6)];
        let place = inputs::direction(&mut rng) * (metres * share);
        inputs::lamp(place, None, Some(metres as f32), falloff)
    });
    each(Formula::Strength, inputs::LAMP, truth::strength, inputs.collect())
}

fn cone(degrees: f64) -> Trial {
    let mut rng = rng(degrees);
    let inputs = (0..COUNT).map(|_| {
        let outer = degrees as f32;
        let inner = if rng.bool() { outer } else { outer * rng.f32() };
        let axis = inputs::direction(&mut rng).as_vec3().as_dvec3();
        // Around the edges of the cone, or anywhere.
        let edge = f64::from(if rng.bool() { inner } else { outer }).to_radians();
        let angle = if rng.bool() { edge * (1.0 + 1e-3 * (rng.f64() - 0.5)) } else { 3.15 * rng.f64() };
        let place = -inputs::around(axis, angle.cos(), 6.0 * rng.f64());
        inputs::lamp(place, Some((axis, [inner, outer])), None, Falloff::InverseSquare)
    });
    each(Formula::Strength, inputs::LAMP, truth::strength, inputs.collect())
}

/// Normals of which one or two components are this small, or 0.
fn normals(off: f64) -> Vec<Input> {
    let mut rng = rng(off);
    let small = |rng: &mut fastrand::Rng| [0.0, off, -off, off * rng.f64()][rng.usize(0..4)];
    let mut any = super::super::formula::inputs::rng(off + 1.0);
    (0..COUNT)
        .map(|_| {
            let mut parts = inputs::direction(&mut any).to_array();
            for _ in 0..any.usize(1..3) {
                parts[any.usize(0..3)] = small(&mut rng);
            }
            let normal = DVec3::from_array(parts).try_normalize().unwrap_or(DVec3::Z).as_vec3();
            filled(normal.to_array())
        })
        .collect()
}

/// Colours whose brightest channel is `brightest`, each with `fourth` as its fourth number's bits.
fn colors(brightest: f64, fourth: u32) -> Vec<Input> {
    let mut rng = rng(brightest);
    let color = |rng: &mut fastrand::Rng| {
        let mut color = [0; 3].map(|_| share(rng) * brightest as f32);
        color[rng.usize(0..3)] = brightest as f32;
        filled([color[0], color[1], color[2], f32::from_bits(fourth)])
    };
    (0..COUNT).map(|_| color(&mut rng)).collect()
}

fn tone(light: f64, curve: u32) -> Trial {
    each(Formula::ToneMap, COLOR, truth::tone_mapped, colors(light, curve))
}

fn position(metres: f64) -> Trial {
    let mut rng = rng(metres);
    let [width, height] = truth::PICTURE;
    let inputs = (0..COUNT).map(|_| {
        let [x, y] = [width, height].map(|edge| (rng.f64() * edge) as f32);
        filled([x, y, (f64::from(truth::NEAR) / metres) as f32])
    });
    let inputs = inputs.collect();
    let frame = Some(frame());
    Trial { frame, ..each(Formula::Position, &[("pixel", 2), ("depth", 1)], truth::position, inputs) }
}

/// As a frame has it for the picture of [`truth::position`].
fn frame() -> FrameUniform {
    let [width, height] = truth::PICTURE;
    let tan_y = 30f64.to_radians().tan();
    FrameUniform {
        ray_center: glam::Vec3::NEG_Z,
        near: truth::NEAR,
        ray_x: glam::Vec3::X * (tan_y * width / height) as f32,
        ray_y: glam::Vec3::NEG_Y * tan_y as f32,
        pixel_width: (2.0 / width) as f32,
        pixel_height: (2.0 / height) as f32,
        ..bytemuck::Zeroable::zeroed()
    }
}

fn shininess(power: f64) -> Trial {
    let mut rng = rng(power);
    let inputs = (0..COUNT).map(|_| filled([(power * (1.0 - 0.5 * rng.f64())) as f32]));
    each(Formula::Shininess, &[("power", 1)], truth::shininess, inputs.collect())
}
