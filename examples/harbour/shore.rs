//! The shore: hills, the quay, the mole, the pier and the water.

use glam::{DVec2, DVec3};

use super::model::{Dice, Model, at, colour, smooth};
use super::paint::wide_clouds;

/// The top of the quay; the sea is at 0.
pub const QUAY: f64 = 1.7;
/// The x at which the quay ends in the east and the mole begins.
pub const EAST: f64 = 30.0;
/// The lighthouse's foot.
pub const LIGHT: DVec3 = DVec3::new(49.0, 2.6, -11.0);

/// Height of the land.
pub fn land(x: f64, z: f64) -> f64 {
    // The coast turns back in the east.
    let bays = 6.0 * (wide_clouds(DVec2::new(x / 26.0, 7.0), 3, 3) - 0.5);
    let coast = if x > EAST { -17.0 - (x - EAST) * 1.15 + bays * smooth(EAST, EAST + 20.0, x) } else { -17.0 };
    let inland = coast - z;
    if inland < 0.0 {
        return (inland * 0.45).max(-6.0);
    }
    let shelf = 1.4 * smooth(-1.0, 3.0, inland);
    let slope = 0.17 * (inland - 4.0).clamp(0.0, 120.0);
    let rough = wide_clouds(DVec2::new(x / 95.0 + 40.0, z / 95.0 + 90.0), 3, 13);
    let east = 1.0 - 0.85 * smooth(20.0, 230.0, x);
    let hills = smooth(30.0, 330.0, inland) * 62.0 * (0.3 + 1.0 * rough) * east;
    let west = smooth(-40.0, -230.0, x) * smooth(10.0, 150.0, inland) * 38.0;
    shelf + slope * (0.6 + 0.7 * rough) * east + hills + west
}

pub fn hills() -> Model {
    let mut model = Model::new();
    // Columns and rows lie closer where one looks.
    let x_of = |u: f64| {
        let s = u * 2.0 - 1.0;
        90.0 * s + 500.0 * s * s * s
    };
    let z_of = |v: f64| -16.5 - 120.0 * v - 460.0 * v * v * v;
    model.sheet("ground", (96, 72), |u, v| {
        let (x, z) = (x_of(u), z_of(v));
        let y = land(x, z);
        let e = 2.0;
        let steep = DVec2::new(land(x + e, z) - land(x - e, z), land(x, z + e) - land(x, z - e)).length() / (2.0 * e);
        let field = wide_clouds(DVec2::new(x / 35.0 + 5.0, z / 35.0 + 70.0), 4, 23);
        let grass = colour(0x8a9a50).lerp(colour(0xb8a868), smooth(0.42, 0.62, field));
        let bare = colour(0xa8937c);
        let beach = colour(0xa8997c);
        let tint = grass.lerp(bare, smooth(0.55, 0.9, steep)).lerp(beach, 1.0 - smooth(0.5, 1.6, y));
        // Far off, air would take the contrast.
        (DVec3::new(x, y, z), tint)
    });
    model
}

/// The paved quay with its wall to the sea, coping, ladder and steps.
pub fn quay() -> Model {
    let mut model = Model::new();
    let west = -75.0;
    let corners = [(west, -0.6), (EAST, -0.6), (EAST, -20.0), (west, -20.0)];
    model.face("cobble", &corners.map(|(x, z)| DVec3::new(x, QUAY - 0.02, z)));
    // The wall leans back a little, in lengths that its coping marks.
    model.tint = colour(0xf0ece4);
    model.face(
        "stone",
        &[
            DVec3::new(west, -4.0, 0.25),
            DVec3::new(EAST, -4.0, 0.25),
            DVec3::new(EAST, QUAY - 0.3, 0.0),
            DVec3::new(west, QUAY - 0.3, 0.0),
        ],
    );
    model.face(
        "stone",
        &[
            DVec3::new(EAST, -4.0, 0.25),
            DVec3::new(EAST, -4.0, -20.0),
            DVec3::new(EAST, QUAY - 0.3, -20.0),
            DVec3::new(EAST, QUAY - 0.3, 0.0),
        ],
    );
    // Weed and wet stone at the water's edge.
    model.tint = colour(0x4a5238);
    model.face(
        "stone",
        &[
            DVec3::new(west, -0.5, 0.27),
            DVec3::new(EAST + 0.04, -0.5, 0.27),
            DVec3::new(EAST + 0.04, 0.22, 0.2),
            DVec3::new(west, 0.22, 0.2),
        ],
    );
    model.tint = colour(0x9a937c);
    model.face(
        "stone",
        &[
            DVec3::new(west, 0.22, 0.2),
            DVec3::new(EAST + 0.04, 0.22, 0.2),
            DVec3::new(EAST + 0.04, 0.62, 0.145),
            DVec3::new(west, 0.62, 0.145),
        ],
    );
    let mut dice = Dice::new(2);
    let mut x = west;
    while x < EAST {
        let length = dice.between(1.3, 1.9).min(EAST + 0.1 - x);
        model.tint = DVec3::splat(dice.between(0.78, 1.0)) * colour(0xf6efe2);
        let y = QUAY + dice.between(-0.012, 0.012);
        model.block("stone", DVec3::new(x + 0.012, QUAY - 0.32, -0.62), DVec3::new(x + length - 0.012, y, 0.1));
        x += length;
    }
    // Gutters along the houses.
    model.tint = colour(0xb0a898);
    model.block("stone", DVec3::new(west, QUAY - 0.1, -7.75), DVec3::new(EAST, QUAY + 0.05, -7.3));
    model.block("cobble", DVec3::new(west, QUAY - 0.1, -9.4), DVec3::new(EAST, QUAY + 0.12, -7.75));
    // A ladder down to the water.
    model.tint = DVec3::splat(0.6);
    for ladder in [-9.0, 7.0, 24.0] {
        for side in [-0.22, 0.22] {
            model.tube(
                "iron",
                &[
                    DVec3::new(ladder + side, QUAY + 0.5, 0.0),
                    DVec3::new(ladder + side, QUAY + 0.45, 0.3),
                    DVec3::new(ladder + side, -1.0, 0.45),
                ],
                (0.03, 0.03),
                6,
            );
        }
        for rung in 0..8 {
            let y = QUAY + 0.1 - f64::from(rung) * 0.3;
            model.beam("iron", DVec3::new(ladder - 0.22, y, 0.38), DVec3::new(ladder + 0.22, y, 0.38), 0.03, 0.03);
        }
    }
    // Rubber tyres that keep boats off.
    for x in [-22.0, -19.0, -14.0, -11.0, 2.5, 5.0] {
        model.within(at(x, 0.75, 0.25), |model| {
            model.tint = DVec3::splat(0.025);
            let ring: Vec<DVec3> = (0..=16)
                .map(|i| (f64::from(i) / 16.0 * std::f64::consts::TAU).sin_cos())
                .map(|(sin, cos)| DVec3::new(sin, cos, 0.0) * 0.36)
                .collect();
            model.tube("paint", &ring, (0.13, 0.13), 8);
            model.tint = colour(0x9a8a68);
            model.tube("rope", &[DVec3::new(0.0, 0.4, 0.0), DVec3::new(0.0, 0.95, -0.1)], (0.02, 0.02), 5);
        });
    }
    model
}

/// The corner of a landing of stone across the water, where one stands and looks at the quay.
pub const LANDING: DVec3 = DVec3::new(-7.4, QUAY, 20.5);

pub fn landing() -> Model {
    let mut model = Model::new();
    let (w, e, n, s) = (LANDING.x - 12.0, LANDING.x, LANDING.z, LANDING.z + 26.0);
    model.face(
        "cobble",
        &[(w, s), (e - 0.5, s), (e - 0.5, n + 0.5), (w, n + 0.5)].map(|(x, z)| DVec3::new(x, QUAY - 0.02, z)),
    );
    model.tint = colour(0xf0ece4);
    model.block("stone", DVec3::new(w, -4.0, n + 0.06), DVec3::new(e - 0.06, QUAY - 0.3, s));
    let mut dice = Dice::new(41);
    let mut coping = |model: &mut Model, from: DVec3, to: DVec3| {
        let steps = (from.distance(to) / 1.45).round();
        for i in 0..steps as u32 {
            let (a, b) = (from.lerp(to, f64::from(i) / steps), from.lerp(to, f64::from(i + 1) / steps));
            model.tint = DVec3::splat(dice.between(0.78, 1.0)) * colour(0xf6efe2);
            let lift = DVec3::Y * dice.between(-0.012, 0.012);
            let along = (b - a).normalize() * 0.012;
            let half = (b - a).cross(DVec3::Y).normalize().abs() * 0.3;
            let (a, b) = (a + along, b - along);
            model.block("stone", (a.min(b)) - half - DVec3::Y * 0.32, a.max(b) + half + lift);
        }
    };
    coping(&mut model, DVec3::new(w, QUAY, n + 0.3), DVec3::new(e, QUAY, n + 0.3));
    coping(&mut model, DVec3::new(e - 0.3, QUAY, n + 0.6), DVec3::new(e - 0.3, QUAY, s));
    model
}

fn mole_line(t: f64) -> DVec2 {
    DVec2::new(
        EAST - 2.0 + (LIGHT.x - EAST + 2.0) * t,
        -5.0 + (LIGHT.z + 5.0) * t + 3.2 * (t * std::f64::consts::PI).sin(),
    )
}

/// A path between walls out to the lighthouse.
pub fn mole() -> Model {
    let mut model = Model::new();
    // The path with a wall on its seaward side.
    let steps = 24;
    for i in 0..steps {
        let (a, b) = (f64::from(i) / f64::from(steps), f64::from(i + 1) / f64::from(steps));
        let (p, q) = (mole_line(a), mole_line(b));
        let side = (q - p).perp().normalize() * 1.7;
        let rise = |t: f64| QUAY + 0.9 * smooth(0.0, 0.35, t);
        let v = |p: DVec2, y: f64| DVec3::new(p.x, y, p.y);
        model.tint = DVec3::splat(0.92);
        model.face("cobble", &[v(p + side, rise(a)), v(q + side, rise(b)), v(q - side, rise(b)), v(p - side, rise(a))]);
        for edge in [side, -side] {
            let (inner, outer) = (edge, edge * 1.25);
            let mut list =
                [v(p + outer, -3.0), v(q + outer, -3.0), v(q + outer, rise(b) + 0.25), v(p + outer, rise(a) + 0.25)];
            let mut top = [
                v(p + outer, rise(a) + 0.25),
                v(q + outer, rise(b) + 0.25),
                v(q + inner, rise(b) + 0.25),
                v(p + inner, rise(a) + 0.25),
            ];
            let mut inside = [
                v(q + inner, rise(b) - 0.1),
                v(p + inner, rise(a) - 0.1),
                v(p + inner, rise(a) + 0.25),
                v(q + inner, rise(b) + 0.25),
            ];
            if edge.y < 0.0 {
                list.reverse();
                top.reverse();
                inside.reverse();
            }
            model.face("stone", &list);
            model.face("stone", &top);
            model.face("stone", &inside);
        }
    }
    model.tint = DVec3::ONE;
    model.within(at(LIGHT.x, LIGHT.y, LIGHT.z), |model| {
        model.lathe("stone", &[(7.2, -6.0), (6.2, -0.05), (6.2, -0.05), (6.2, 0.05), (6.2, 0.05), (0.0, 0.05)], 36);
        let (low, high, radius) = (0.05, 0.75, 6.1);
        model.tint = DVec3::splat(0.9);
        model.lathe(
            "stone",
            &[
                (radius, low),
                (radius, high),
                (radius, high),
                (radius - 0.35, high),
                (radius - 0.35, high),
                (radius - 0.35, low),
            ],
            36,
        );
    });
    model
}

/// Boulders of each of so many kinds along the mole and around the lighthouse: place, turn and size.
pub fn boulders(kinds: usize) -> Vec<Vec<(DVec3, f64, f64)>> {
    let mut dice = Dice::new(8);
    let mut places = vec![Vec::new(); kinds];
    for i in 0..150 {
        let (place, out) = if i >= 92 {
            let turn = dice.between(-2.6, 2.9);
            let far = dice.between(6.4, 9.2);
            (DVec2::new(LIGHT.x + turn.sin() * far, LIGHT.z + turn.cos() * far), (far - 6.4) / 2.8)
        } else {
            let t = dice.between(0.08, 0.92);
            let away = mole_line((t + 0.01).min(1.0)) - mole_line(t);
            let off = dice.between(2.0, 4.6);
            (mole_line(t) + away.perp().normalize() * off * if i % 3 == 0 { -1.0 } else { 1.0 }, (off - 2.0) / 2.6)
        };
        let y = 0.9 - 1.5 * out + dice.between(-0.2, 0.2);
        places[i % kinds].push((
            DVec3::new(place.x, y, place.y),
            dice.between(0.0, std::f64::consts::TAU),
            dice.between(0.6, 1.35),
        ));
    }
    places
}

/// A metre or so across.
pub fn boulder(seed: u64) -> Model {
    let mut dice = Dice::new(seed + 700);
    let radii = DVec3::new(dice.between(0.8, 1.3), dice.between(0.6, 0.9), dice.between(0.8, 1.3));
    let shift = dice.between(0.0, 90.0);
    let tone = dice.between(0.75, 1.0);
    let mut model = Model::new();
    // Planes cut the ball: rocks have faces.
    let cuts: Vec<(DVec3, f64)> = (0..9)
        .map(|_| {
            let normal = DVec3::new(dice.between(-1.0, 1.0), dice.between(-0.7, 1.0), dice.between(-1.0, 1.0))
                .normalize_or(DVec3::Y);
            (normal, dice.between(0.62, 0.85))
        })
        .collect();
    let swell = |out: DVec3| {
        let reach = cuts.iter().map(|(normal, far)| far / out.dot(*normal).max(far * 0.8)).fold(1.25, f64::min);
        reach - 1.0
            + 0.12 * (wide_clouds(DVec2::new(out.x * 1.7 + out.z + shift, out.y * 2.0 - out.z + shift), 2, 33) - 0.5)
    };
    model.blob("rock", (DVec3::ZERO, radii), (12, 8), swell, |out| {
        let low = 1.0 - smooth(-0.7, -0.2, out.y);
        DVec3::splat(tone).lerp(colour(0x6a6a55), low)
    });
    model
}

/// The pier's deck, from the quay towards +Z.
pub const PIER: (f64, f64) = (14.5, 19.0);
pub const PIER_DECK: f64 = 1.35;

pub fn pier() -> Model {
    let mut model = Model::new();
    let mut dice = Dice::new(4);
    let (x, end) = PIER;
    let half = 1.45;
    let grey = colour(0xc8bcae);
    // Boards across, each a little off.
    let mut z = 0.15;
    while z < end {
        let width = dice.between(0.17, 0.21);
        model.tint = grey * dice.between(0.72, 1.1);
        model.grain = Some(DVec3::X);
        let (left, right) = (half + dice.between(-0.03, 0.05), half + dice.between(-0.03, 0.05));
        let lift = dice.between(-0.008, 0.008);
        model.block(
            "wood",
            DVec3::new(x - left, PIER_DECK - 0.06 + lift, z),
            DVec3::new(x + right, PIER_DECK + lift, z + width),
        );
        z += width + 0.018;
    }
    model.tint = grey * 0.7;
    for side in [-1.1, 0.0, 1.1] {
        model.beam(
            "wood",
            DVec3::new(x + side, PIER_DECK - 0.2, 0.1),
            DVec3::new(x + side, PIER_DECK - 0.2, end),
            0.14,
            0.26,
        );
    }
    for i in 0..7 {
        let z = 0.9 + f64::from(i) * 2.95;
        for side in [-1.0, 1.0] {
            let tall = if i % 2 == 0 { 1.05 } else { 0.35 } + dice.between(-0.08, 0.08);
            let place = x + side * (half + 0.12);
            model.tint = grey * dice.between(0.6, 0.8);
            let lean = dice.between(-0.06, 0.06);
            model.tube(
                "wood",
                &[DVec3::new(place + lean, -3.0, z), DVec3::new(place, PIER_DECK + tall, z)],
                (0.17, 0.14),
                10,
            );
            model.tint = grey * 0.95;
            model.within(at(place, PIER_DECK + tall - 0.02, z), |model| {
                model.lathe("wood", &[(0.17, 0.0), (0.17, 0.05), (0.17, 0.05), (0.0, 0.1)], 10)
            });
            model.tint = colour(0x38402c);
            model.tube(
                "wood",
                &[DVec3::new(place + lean * 0.75, -1.0, z), DVec3::new(place + lean * 0.6, 0.28, z)],
                (0.185, 0.18),
                10,
            );
        }
        model.tint = grey * 0.6;
        model.beam(
            "wood",
            DVec3::new(x - half, PIER_DECK - 0.42, z),
            DVec3::new(x + half, PIER_DECK - 0.42, z),
            0.12,
            0.2,
        );
        model.beam(
            "wood",
            DVec3::new(x - half, -0.3, z + 0.1),
            DVec3::new(x + half, PIER_DECK - 0.5, z + 0.1),
            0.06,
            0.12,
        );
    }
    // A rope from post to post, on the far side.
    model.tint = colour(0xc0a878);
    for i in 0..3 {
        let (a, b) = (0.9 + f64::from(i) * 5.9, 0.9 + f64::from(i + 1) * 5.9);
        let place = x + half + 0.12;
        let path: Vec<DVec3> = (0..=10)
            .map(|k| f64::from(k) / 10.0)
            .map(|t| DVec3::new(place + 0.02, PIER_DECK + 0.85 - 0.9 * t * (1.0 - t) * 2.0, a + (b - a) * t))
            .collect();
        model.tube("rope", &path, (0.03, 0.03), 6);
    }
    model
}

/// A flat sheet far out to the horizon.
pub fn sea() -> Model {
    let mut model = Model::new();
    let far = 2200.0;
    model.face("water", &[(-far, far), (far, far), (far, -far), (-far, -far)].map(|(x, z)| DVec3::new(x, 0.0, z)));
    model
}
