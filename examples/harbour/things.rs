//! Things on the quay, trees behind it, and parts that clips move.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3};

use super::model::{Dice, Model, at, colour, smooth, turned};
use super::paint::wide_clouds;

/// Boards between corner posts, as large as `size`, about its foot.
pub fn crate_of(model: &mut Model, size: DVec3, tint: DVec3) {
    let half = size * 0.5;
    model.within(at(0.0, half.y, 0.0), |model| {
        model.tint = tint * 0.9;
        model.block_at("wood", DVec3::ZERO, size - 0.05);
        model.tint = tint;
        for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
            model.grain = Some(DVec3::Y);
            model.block_at(
                "wood",
                DVec3::new(x * (half.x - 0.05), 0.0, z * (half.z - 0.05)),
                DVec3::new(0.1, size.y, 0.1),
            );
        }
        for y in [-1.0, 1.0] {
            model.grain = None;
            for side in [-1.0, 1.0] {
                let place = y * (half.y - 0.05);
                model.block_at(
                    "wood",
                    DVec3::new(0.0, place, side * (half.z - 0.02)),
                    DVec3::new(size.x - 0.2, 0.1, 0.04),
                );
                model.block_at(
                    "wood",
                    DVec3::new(side * (half.x - 0.02), place, 0.0),
                    DVec3::new(0.04, 0.1, size.z - 0.2),
                );
            }
        }
        for side in [-1.0, 1.0] {
            let (a, b) = (
                DVec3::new(-half.x + 0.1, -half.y + 0.1, side * (half.z - 0.015)),
                DVec3::new(half.x - 0.1, half.y - 0.1, side * (half.z - 0.015)),
            );
            model.beam("wood", a, b, 0.02, 0.09);
        }
    });
}

pub fn barrel(model: &mut Model, tint: DVec3) {
    model.tint = tint;
    let bulge = |y: f64| 0.31 + 0.075 * (y / 0.95 * PI).sin();
    model.grain = Some(DVec3::Y);
    let staves: Vec<(f64, f64)> = (0..=6).map(|i| f64::from(i) / 6.0 * 0.95).map(|y| (bulge(y), y)).collect();
    model.lathe("wood", &staves, 18);
    model.lathe(
        "wood",
        &[
            (bulge(0.95), 0.95),
            (bulge(0.95) - 0.03, 0.95),
            (bulge(0.95) - 0.03, 0.95),
            (bulge(0.95) - 0.03, 0.91),
            (bulge(0.95) - 0.03, 0.91),
            (0.0, 0.91),
        ],
        18,
    );
    model.tint = DVec3::splat(0.35);
    for y in [0.1, 0.3, 0.62, 0.83] {
        model.lathe("iron", &[(bulge(y) + 0.008, y - 0.025), (bulge(y + 0.05) + 0.008, y + 0.025)], 18);
    }
}

/// The height of a lamp's light over its foot.
pub const LAMP: f64 = 3.72;

pub fn lamp_post() -> Model {
    let mut model = Model::new();
    model.tint = DVec3::splat(0.28);
    model.lathe(
        "iron",
        &[
            (0.2, 0.0),
            (0.2, 0.25),
            (0.2, 0.25),
            (0.12, 0.32),
            (0.1, 0.8),
            (0.1, 0.8),
            (0.13, 0.84),
            (0.13, 0.9),
            (0.065, 1.0),
            (0.05, 3.2),
            (0.05, 3.2),
            (0.1, 3.26),
            (0.1, 3.32),
            (0.05, 3.36),
            (0.06, 3.45),
            (0.06, 3.45),
            (0.17, 3.5),
            (0.17, 3.54),
        ],
        12,
    );
    model.tube("iron", &[DVec3::new(-0.35, 3.1, 0.0), DVec3::new(0.35, 3.1, 0.0)], (0.02, 0.02), 6);
    for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        model.tube(
            "iron",
            &[DVec3::new(x * 0.11, 3.52, z * 0.11), DVec3::new(x * 0.17, 3.98, z * 0.17)],
            (0.014, 0.014),
            4,
        );
    }
    model.lathe(
        "iron",
        &[(0.29, 3.98), (0.27, 4.02), (0.12, 4.16), (0.12, 4.16), (0.05, 4.2), (0.05, 4.28), (0.0, 4.34)],
        8,
    );
    model.tint = DVec3::ONE;
    model.lathe("glow", &[(0.05, 3.56), (0.085, 3.62), (0.09, 3.75), (0.05, 3.86), (0.0, 3.9)], 10);
    model
}

pub fn bollard() -> Model {
    let mut model = Model::new();
    model.tint = DVec3::splat(0.22);
    model.lathe(
        "iron",
        &[
            (0.27, 0.0),
            (0.27, 0.06),
            (0.27, 0.06),
            (0.17, 0.1),
            (0.15, 0.38),
            (0.23, 0.46),
            (0.25, 0.54),
            (0.2, 0.62),
            (0.0, 0.66),
        ],
        14,
    );
    model
}

/// The part of the crane that turns, about its mast's foot; its jib points along +Z.
pub fn crane() -> Model {
    let mut model = Model::new();
    let paint = colour(0x3c5a50);
    model.tint = paint;
    model.tube("paint", &[DVec3::Y * 0.5, DVec3::Y * 5.2], (0.2, 0.15), 12);
    let tip = DVec3::new(0.0, 6.4, 5.2);
    for side in [-1.0, 1.0] {
        let (a, b) = (DVec3::new(side * 0.3, 1.5, 0.25), tip + DVec3::X * side * 0.12);
        model.beam("paint", a, b, 0.1, 0.16);
        model.beam("paint", DVec3::new(side * 0.14, 5.1, 0.0), b, 0.05, 0.05);
    }
    for i in 0..9 {
        let t = f64::from(i) / 9.0 + 0.04;
        let place = |t: f64, side: f64| DVec3::new(side * (0.3 - 0.18 * t), 1.5 + 4.9 * t, 0.25 + 4.95 * t);
        model.beam("paint", place(t, -1.0), place(t + 0.1, 1.0), 0.04, 0.05);
        model.beam("paint", place(t, 1.0), place(t + 0.1, -1.0), 0.04, 0.05);
    }
    // The winch's house and its counterweight.
    model.block("paint", DVec3::new(-0.75, 0.9, -1.7), DVec3::new(0.75, 2.3, -0.1));
    model.tint = DVec3::splat(0.3);
    model.block("iron", DVec3::new(-0.9, 2.3, -1.85), DVec3::new(0.9, 2.4, 0.05));
    model.block("iron", DVec3::new(-0.6, 0.6, -2.1), DVec3::new(0.6, 1.7, -1.7));
    model.lathe("iron", &[(0.8, 0.42), (0.8, 0.6), (0.8, 0.6), (0.0, 0.62)], 20);
    model.tint = DVec3::ONE;
    model.block("pane", DVec3::new(0.2, 1.5, -0.1), DVec3::new(0.68, 2.15, -0.08));
    model.tint = DVec3::splat(0.1);
    model.tube("rope", &[tip, tip - DVec3::Y * 3.2], (0.022, 0.022), 5);
    model.tube("rope", &[DVec3::new(0.0, 2.0, -0.6), DVec3::new(0.0, 5.3, 0.0), tip], (0.018, 0.018), 4);
    model.tint = DVec3::splat(0.25);
    model.within(at(0.0, tip.y, tip.z) * DAffine3::from_mat3(DMat3::from_rotation_z(PI * 0.5)), |model| {
        model.lathe("iron", &[(0.0, -0.1), (0.25, -0.1), (0.25, -0.1), (0.25, 0.1), (0.25, 0.1), (0.0, 0.1)], 14);
    });
    // A crate hangs in a sling.
    let hook = tip - DVec3::Y * 3.2;
    for (x, z) in [(-0.5, -0.4), (-0.5, 0.4), (0.5, -0.4), (0.5, 0.4)] {
        model.tube("rope", &[hook, hook + DVec3::new(x, -0.8, z)], (0.014, 0.014), 4);
    }
    model.within(at(0.0, hook.y - 1.6, hook.z), |model| crate_of(model, DVec3::new(1.05, 0.8, 0.85), colour(0xd0a878)));
    model
}

pub fn crane_foot() -> Model {
    let mut model = Model::new();
    model.tint = DVec3::splat(0.95);
    model.lathe("stone", &[(1.25, 0.0), (1.15, 0.42), (1.15, 0.42), (0.0, 0.42)], 20);
    model
}

/// An arrow with a tail, and a cock on it, about a vertical axis; it points along +X.
pub fn vane() -> Model {
    let mut model = Model::new();
    model.tint = colour(0xe0b040);
    model.tube("gold", &[DVec3::new(-0.9, 0.0, 0.0), DVec3::new(0.9, 0.0, 0.0)], (0.035, 0.035), 6);
    let plate = |model: &mut Model, outline: &[(f64, f64)]| {
        for (z, order) in [(0.012, false), (-0.012, true)] {
            let mut corners: Vec<DVec3> = outline.iter().map(|&(x, y)| DVec3::new(x, y, z)).collect();
            if order {
                corners.reverse();
            }
            model.face("gold", &corners);
        }
    };
    plate(&mut model, &[(0.85, -0.17), (1.25, 0.0), (0.85, 0.17)]);
    plate(&mut model, &[(-1.1, -0.2), (-0.7, -0.06), (-0.7, 0.06), (-1.1, 0.2)]);
    plate(&mut model, &[(-0.2, 0.1), (0.3, 0.3), (0.2, 0.55), (-0.25, 0.4)]);
    plate(&mut model, &[(0.2, 0.4), (0.36, 0.5), (0.3, 0.78), (0.14, 0.74)]);
    plate(&mut model, &[(-0.25, 0.3), (-0.2, 0.45), (-0.55, 0.85), (-0.62, 0.5)]);
    plate(&mut model, &[(0.3, 0.62), (0.44, 0.66), (0.3, 0.72)]);
    model.blob("gold", (DVec3::Y * -0.12, DVec3::splat(0.1)), (10, 8), |_| 0.0, |_| DVec3::ONE);
    model
}

/// The lens that turns in the lighthouse: four panes of bright glass.
pub fn lens() -> Model {
    let mut model = Model::new();
    model.tint = colour(0xd8c070);
    model.lathe("gold", &[(0.5, -0.7), (0.5, -0.6), (0.5, -0.6), (0.0, -0.6)], 16);
    model.lathe("gold", &[(0.0, 0.66), (0.5, 0.66), (0.5, 0.66), (0.5, 0.76), (0.5, 0.76), (0.0, 0.8)], 16);
    model.tint = DVec3::ONE;
    model.lathe("glow", &[(0.12, -0.6), (0.2, -0.2), (0.2, 0.2), (0.12, 0.66)], 10);
    for turn in [0.0, 180.0] {
        model.within(turned(0.0, 0.0, 0.0, turn), |model| {
            model.tint = colour(0xd8c070);
            for ring in 1..=4 {
                let radius = 0.12 * f64::from(ring);
                let path: Vec<DVec3> = (0..=18)
                    .map(|i| (f64::from(i) / 18.0 * TAU).sin_cos())
                    .map(|(a, b)| DVec3::new(a * radius, b * radius * 1.2, 0.55))
                    .collect();
                model.tube("gold", &path, (0.014, 0.014), 4);
            }
        });
    }
    model
}

/// A cloth of `size` from its pole along +X, in the air of a moment; `wave` is the size of its waves and where they are.
pub fn flag(size: DVec2, stripes: &[DVec3], (amount, phase): (f64, f64)) -> Model {
    let mut model = Model::new();
    for back in [false, true] {
        let count = stripes.len() as f64;
        let stripes = stripes.to_vec();
        model.sheet("cloth", (16, 9), |u, v| {
            let along = if back { 1.0 - u } else { u };
            let out = amount * along.powf(0.8) * (along * 7.5 - phase).sin() * (1.0 + 0.3 * (v * 3.0).sin());
            let drop = 0.16 * along * along;
            // A hair's breadth between front and back: neither fights for the depth of the other.
            let skin = if back { -0.004 } else { 0.004 };
            let tint = stripes[((v * count * 0.999) as usize).min(stripes.len() - 1)];
            (DVec3::new(along * size.x * (1.0 - 0.05 * amount), (v - 1.0) * size.y - drop, out * size.y + skin), tint)
        });
    }
    model
}

/// A gull that looks along +X; `lift` raises the tips of its wings by so many metres.
pub fn gull(lift: f64) -> Model {
    let mut model = Model::new();
    let (white, grey, black) = (colour(0xf4f4f0), colour(0xb4b8bc), colour(0x2a2a2c));
    model.blob(
        "feather",
        (DVec3::ZERO, DVec3::new(0.27, 0.075, 0.085)),
        (12, 8),
        |out| 0.25 * out.x.max(0.0) - 0.2 * (-out.x).max(0.0),
        move |_| white,
    );
    model.blob(
        "feather",
        (DVec3::new(0.31, 0.035, 0.0), DVec3::new(0.075, 0.06, 0.055)),
        (10, 6),
        |_| 0.0,
        move |_| white,
    );
    model.tint = colour(0xe0a030);
    model.tube("feather", &[DVec3::new(0.37, 0.03, 0.0), DVec3::new(0.45, 0.015, 0.0)], (0.018, 0.004), 5);
    model.tint = white;
    model.face(
        "feather",
        &[
            DVec3::new(-0.2, 0.01, 0.05),
            DVec3::new(-0.2, 0.01, -0.05),
            DVec3::new(-0.42, 0.0, -0.1),
            DVec3::new(-0.42, 0.0, 0.1),
        ]
        .map(|p| DVec3::new(p.x, p.y, -p.z)),
    );
    model.tint = DVec3::ONE;
    for side in [-1.0, 1.0] {
        for below in [false, true] {
            // Turned inside out for the other side, and for sheets that are seen from below.
            let flip = (side > 0.0) == below;
            model.sheet("feather", (10, 3), |u, v| {
                let (out, chord) = (u, if flip { 1.0 - v } else { v });
                let bend = 1.0 - 2.2 * (out - 0.42).abs();
                let width = 0.21 * (1.0 - out.powi(3)) + 0.02;
                let front = 0.11 + 0.1 * bend * out.min(0.5) - 0.26 * (out - 0.42).max(0.0);
                let y = 0.03 + lift * (0.35 * out + 0.65 * out * out) + 0.05 * bend.max(0.0) * out
                    - if below { 0.008 } else { 0.0 };
                let tint = if out > 0.88 {
                    black
                } else if below {
                    white
                } else {
                    grey
                };
                (DVec3::new(front - width * (1.0 - chord), y, side * (0.04 + 0.62 * out)), tint)
            });
        }
    }
    model
}

/// A broad-leaved tree: a trunk that forks, and sprays of leaves about the ends.
pub fn tree(height: f64, seed: u64) -> Model {
    let mut model = Model::new();
    let mut dice = Dice::new(seed);
    model.tint = colour(0x9a8468);
    let fork = DVec3::new(dice.between(-0.2, 0.2), height * 0.36, dice.between(-0.2, 0.2));
    model.tube(
        "wood",
        &[DVec3::Y * -0.3, DVec3::new(0.0, height * 0.15, 0.05), fork],
        (0.05 * height * 0.55, 0.03 * height * 0.55),
        9,
    );
    let middle = DVec3::new(0.0, height * 0.66, 0.0);
    let radii = DVec3::new(height * 0.34, height * 0.3, height * 0.34);
    let mut ends = Vec::new();
    for i in 0..7 {
        let turn = f64::from(i) / 7.0 * TAU + dice.between(-0.3, 0.3);
        let up = dice.between(-0.2, 0.75);
        let end = middle + DVec3::new(turn.sin(), up, turn.cos()) * radii * 0.62;
        let bend = fork.lerp(end, 0.5) + DVec3::Y * 0.12 * height * 0.3;
        model.tube("wood", &[fork - DVec3::Y * 0.1, bend, end], (0.014 * height, 0.004 * height), 6);
        ends.push(end);
    }
    ends.push(middle + DVec3::Y * radii.y * 0.5);
    for end in ends {
        for _ in 0..26 {
            let away =
                DVec3::new(dice.between(-1.0, 1.0), dice.between(-0.8, 0.9), dice.between(-1.0, 1.0)) * radii * 0.5;
            let place = end + away;
            let out = ((place - middle) / radii).normalize_or(DVec3::Y);
            // Deep inside less light arrives.
            let depth = ((place - middle) / radii).length();
            model.tint = colour(0x9aa860).lerp(colour(0xc0b860), dice.next()) * (0.45 + 0.5 * smooth(0.3, 1.0, depth));
            let size = height * dice.between(0.085, 0.13);
            let x = out.any_orthonormal_vector();
            let turn = dice.between(0.0, TAU);
            let across = (x * turn.cos() + out.cross(x) * turn.sin() + out * dice.between(-0.7, 0.7)).normalize();
            let up = out.cross(across).normalize();
            leaf_card(&mut model, place, across * size, up * size, out);
        }
    }
    model.tint = DVec3::ONE;
    model
}

/// A square of leaves whose normals point out of the crown, so that it is shaded as a whole.
fn leaf_card(model: &mut Model, middle: DVec3, across: DVec3, up: DVec3, out: DVec3) {
    let part = model.parts.entry("leaves").or_default();
    let first = part.points.len() as u32;
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let point = middle + across * x + up * y;
        part.points.push(model.frame.transform_point3(point));
        part.normals.push((out + 0.35 * (across * x + up * y).normalize()).normalize());
        part.uvs.push(DVec2::new(x * 0.5 + 0.5, 0.5 - y * 0.5));
        part.tints.push(model.tint);
    }
    part.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

/// A cypress or bush for the hills: a lump without leaves, of few triangles.
pub fn bush(tall: f64, seed: u32, dark: DVec3, bright: DVec3) -> Model {
    let mut model = Model::new();
    let shift = f64::from(seed) * 17.0;
    let rough = |out: DVec3| {
        wide_clouds(
            DVec2::new(out.x * 2.2 + out.z * 0.9 + shift, out.y * 2.6 * tall.min(1.6) - out.z * 1.7 + shift),
            3,
            41 + seed,
        )
    };
    model.blob(
        "scrub",
        (DVec3::Y * tall * 0.85, DVec3::new(1.0, tall, 1.0)),
        (12, 8),
        |out| 0.85 / tall.max(1.0).sqrt() * (rough(out) - 0.55) - if tall > 1.6 { 0.25 * out.y.max(0.0) } else { 0.0 },
        |out| dark.lerp(bright, smooth(0.35, 0.7, rough(out)) * (0.6 + 0.4 * out.y)),
    );
    model
}

pub fn bench() -> Model {
    let mut model = Model::new();
    model.tint = colour(0xb08860);
    for (y, z) in [(0.45, -0.16), (0.45, 0.0), (0.45, 0.16), (0.7, -0.26), (0.87, -0.3)] {
        model.block_at(
            "wood",
            DVec3::new(0.0, y, z),
            DVec3::new(1.8, if y > 0.5 { 0.12 } else { 0.04 }, if y > 0.5 { 0.03 } else { 0.13 }),
        );
    }
    model.tint = DVec3::splat(0.25);
    for x in [-0.75, 0.75] {
        model.beam("iron", DVec3::new(x, 0.0, 0.2), DVec3::new(x, 0.45, 0.18), 0.05, 0.05);
        model.beam("iron", DVec3::new(x, 0.0, -0.28), DVec3::new(x, 0.95, -0.32), 0.05, 0.05);
        model.beam("iron", DVec3::new(x, 0.42, 0.2), DVec3::new(x, 0.42, -0.26), 0.05, 0.04);
    }
    model
}

/// A basket of iron with coals that glow, on three legs; the coals are at this height.
pub const COALS: f64 = 0.78;

pub fn brazier() -> Model {
    let mut model = Model::new();
    model.tint = DVec3::splat(0.12);
    for i in 0..3 {
        let (sin, cos) = (f64::from(i) / 3.0 * TAU).sin_cos();
        let out = DVec3::new(sin, 0.0, cos);
        model.tube("iron", &[out * 0.36, out * 0.22 + DVec3::Y * 0.95], (0.022, 0.022), 5);
    }
    for i in 0..12 {
        let (sin, cos) = (f64::from(i) / 12.0 * TAU).sin_cos();
        let out = DVec3::new(sin, 0.0, cos);
        model.beam("iron", out * 0.22 + DVec3::Y * 0.5, out * 0.31 + DVec3::Y * 0.98, 0.02, 0.03);
    }
    model.lathe("iron", &[(0.24, 0.5), (0.25, 0.55), (0.25, 0.55), (0.0, 0.56)], 14);
    for (radius, y) in [(0.27, 0.72), (0.325, 0.98)] {
        model.lathe(
            "iron",
            &[(radius, y - 0.02), (radius, y + 0.02), (radius, y + 0.02), (radius - 0.015, y + 0.02)],
            14,
        );
    }
    model.tint = DVec3::ONE;
    let lumps = |out: DVec3| 0.25 * (out.x * 9.0).sin() * (out.z * 8.0).cos();
    model.blob("coals", (DVec3::Y * 0.7, DVec3::new(0.24, 0.14, 0.24)), (14, 8), lumps, |_| DVec3::ONE);
    model
}

/// A heap of rope in turns.
pub fn coil(model: &mut Model) {
    model.tint = colour(0xc8b088);
    let turns: Vec<DVec3> = (0..=70)
        .map(|i| f64::from(i) / 70.0)
        .map(|t| {
            let (sin, cos) = (t * TAU * 5.0).sin_cos();
            DVec3::new(sin, 0.0, cos) * (0.34 - 0.06 * (t * 13.0).sin()) + DVec3::Y * (0.04 + 0.2 * t)
        })
        .collect();
    model.tube("rope", &turns, (0.035, 0.035), 6);
}

/// Lobster pots: a basket on a board.
pub fn pot(model: &mut Model) {
    model.tint = colour(0x9a7a52);
    model.block_at("wood", DVec3::Y * 0.03, DVec3::new(0.8, 0.05, 0.5));
    let arch = |x: f64| {
        (0..=8)
            .map(|i| f64::from(i) / 8.0 * PI)
            .map(|t| DVec3::new(x, 0.05 + 0.38 * t.sin(), 0.24 * t.cos()))
            .collect::<Vec<_>>()
    };
    for x in [-0.38, -0.13, 0.13, 0.38] {
        model.tube("wood", &arch(x), (0.018, 0.018), 5);
    }
    model.tint = colour(0x2c4a5c);
    for t in [0.15, 0.35, 0.5, 0.65, 0.85] {
        let (sin, cos) = (t * PI).sin_cos();
        let p = DVec3::new(0.0, 0.05 + 0.38 * sin, 0.24 * cos);
        model.tube("rope", &[p - DVec3::X * 0.38, p + DVec3::X * 0.38], (0.012, 0.012), 4);
    }
}
