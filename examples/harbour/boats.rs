//! Boats: a fishing boat, a sailing boat, and a dinghy. The bow is at +X, the water line at y = 0.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};

use super::model::{Model, at, colour, smooth};

/// A hull's lines.
#[derive(Clone, Copy)]
struct Hull {
    length: f64,
    half_beam: f64,
    /// The depth of the keel below the water line.
    draught: f64,
    /// The height of the rail over the water line amidships.
    board: f64,
    bottom: DVec3,
    side: DVec3,
    stripe: DVec3,
}

impl Hull {
    fn rail(&self, s: f64) -> DVec3 {
        let wide =
            self.half_beam * (0.74 + 0.26 * smooth(0.0, 0.45, s)) * (1.0 - smooth(0.5, 1.02, s).powf(1.25)).max(0.0);
        let high =
            self.board * (1.0 + 0.85 * (s - 0.35).max(0.0).powi(2) * 2.2 + 0.35 * (0.35 - s).max(0.0).powi(2) * 4.0);
        DVec3::new((s - 0.5) * self.length + 0.06 * self.length * smooth(0.7, 1.0, s), high, wide)
    }

    /// s from stern to bow, t from the keel up one side.
    fn point(&self, s: f64, t: f64, side: f64) -> DVec3 {
        let rail = self.rail(s);
        let keel = -self.draught * (1.0 - smooth(0.72, 1.0, s)) * (0.55 + 0.45 * smooth(0.0, 0.3, s));
        let round = (t * PI * 0.5).sin().powf(0.62);
        let x = (s - 0.5) * self.length + 0.06 * self.length * smooth(0.7, 1.0, s) * t;
        DVec3::new(x, keel + (rail.y - keel) * t.powf(1.35), side * rail.z * round)
    }

    fn build(&self, model: &mut Model, inside: bool) {
        let hull = *self;
        for side in [1.0, -1.0] {
            let tint = move |p: DVec3, rail: f64| {
                let up = p.y;
                if up < 0.12 {
                    hull.bottom
                } else if up > rail - 0.16 {
                    hull.stripe
                } else {
                    hull.side
                }
            };
            // The front is where u x v points: on the other side u runs back.
            let along = move |u: f64| if side > 0.0 { u } else { 1.0 - u };
            model.sheet("paint", (28, 14), |u, v| {
                let s = along(u);
                let p = hull.point(s, v, side);
                (p, tint(p, hull.rail(s).y))
            });
            if inside {
                let wood = colour(0xb08a5c);
                model.sheet("wood", (20, 8), |u, v| {
                    let s = 0.015 + 0.955 * along(1.0 - u);
                    (
                        hull.point(s, 0.12 + 0.88 * v, side) * DVec3::new(1.0, 1.0, 0.95) + DVec3::Y * 0.05 * (1.0 - v),
                        wood,
                    )
                });
            }
            model.tint = self.stripe * 0.8;
            let rail: Vec<DVec3> =
                (0..=24).map(|i| hull.rail(f64::from(i) / 24.0)).map(|p| p * DVec3::new(1.0, 1.0, side)).collect();
            model.tube("paint", &rail, (0.055, 0.055), 6);
            model.tint = DVec3::ONE;
        }
        // The stern.
        model.tint = self.side;
        let mut corners: Vec<DVec3> = (0..=8).map(|i| hull.point(0.0, f64::from(i) / 8.0, 1.0)).collect();
        corners.extend((0..8).rev().map(|i| hull.point(0.0, f64::from(i) / 8.0, -1.0)));
        let middle = hull.point(0.0, 0.6, 0.0);
        for pair in corners.windows(2) {
            model.face("paint", &[middle, pair[1], pair[0]]);
            model.face("paint", &[middle, pair[0], pair[1]]);
        }
        model.tint = DVec3::ONE;
    }

    /// A floor between the sides, below the rail by `down`, from one place along to another.
    fn deck(&self, model: &mut Model, (from, to): (f64, f64), down: f64, tint: DVec3) {
        let hull = *self;
        model.sheet("wood", (16, 2), |u, v| {
            let s = from + (to - from) * u;
            let rail = hull.rail(s);
            // Across from the starboard side, so that it faces up.
            (DVec3::new(rail.x, rail.y - down, rail.z * 0.96 * (1.0 - 2.0 * v)), tint)
        });
    }
}

fn line(model: &mut Model, from: DVec3, to: DVec3, radius: f64) {
    model.tube("rope", &[from, to], (radius, radius), 4);
}

/// A wooden boat, blue and white, with a wheelhouse aft and a mast with a boom.
pub fn fishing_boat() -> Model {
    let mut model = Model::new();
    let hull = Hull {
        length: 10.5,
        half_beam: 1.75,
        draught: 0.95,
        board: 1.05,
        bottom: colour(0x8a2a20),
        side: colour(0x2a5a8c),
        stripe: colour(0xf0ede4),
    };
    hull.build(&mut model, false);
    hull.deck(&mut model, (0.02, 0.95), 0.32, colour(0xc0a078));
    model.sheet("paint", (24, 1), |u, v| {
        let s = 0.02 + 0.94 * u;
        let rail = hull.rail(s);
        (DVec3::new(rail.x, rail.y - 0.34 * v, rail.z * 0.965), colour(0xd8d4c8))
    });
    model.sheet("paint", (24, 1), |u, v| {
        let s = 0.96 - 0.94 * u;
        let rail = hull.rail(s);
        (DVec3::new(rail.x, rail.y - 0.34 * v, -rail.z * 0.965), colour(0xd8d4c8))
    });
    // The wheelhouse.
    model.within(at(-2.6, 0.75, 0.0), |model| {
        model.tint = colour(0xf2efe6);
        model.block("paint", DVec3::new(-1.25, 0.0, -0.95), DVec3::new(1.15, 1.25, 0.95));
        for (a, b) in [
            ((-1.25, -0.95), (-1.15, -0.85)),
            ((-1.25, 0.85), (-1.15, 0.95)),
            ((1.05, -0.95), (1.15, -0.85)),
            ((1.05, 0.85), (1.15, 0.95)),
            ((-0.1, 0.87), (0.02, 0.95)),
            ((-0.1, -0.95), (0.02, -0.87)),
            ((1.07, -0.05), (1.15, 0.05)),
        ] {
            model.block("paint", DVec3::new(a.0, 1.25, a.1), DVec3::new(b.0, 2.0, b.1));
        }
        model.tint = DVec3::ONE;
        model.block("pane", DVec3::new(-1.2, 1.25, -0.9), DVec3::new(1.1, 2.0, 0.9));
        model.tint = colour(0x2a5a8c);
        model.block("paint", DVec3::new(-1.45, 2.0, -1.1), DVec3::new(1.45, 2.1, 1.1));
        model.tint = colour(0xf2efe6);
        model.block("paint", DVec3::new(-1.3, 2.1, -0.95), DVec3::new(1.2, 2.16, 0.95));
        model.tint = DVec3::splat(0.06);
        model.within(at(-0.7, 2.1, 0.4), |model| {
            model.lathe("iron", &[(0.13, 0.0), (0.13, 0.9), (0.13, 0.9), (0.0, 0.9)], 10)
        });
        model.tint = colour(0xe07820);
        model.within(at(0.2, 1.0, 0.99), |model| {
            let ring: Vec<DVec3> = (0..=14)
                .map(|i| (f64::from(i) / 14.0 * 2.0 * PI).sin_cos())
                .map(|(a, b)| DVec3::new(a, b, 0.0) * 0.24 + DVec3::new(-0.55, -0.35, 0.0))
                .collect();
            model.tube("paint", &ring, (0.06, 0.06), 6);
        });
    });
    let mast = DVec3::new(1.3, 0.7, 0.0);
    model.tint = colour(0xd8b070);
    model.tube("wood", &[mast, mast + DVec3::Y * 6.3], (0.1, 0.06), 8);
    let boom = mast + DVec3::new(-0.1, 1.5, 0.0);
    model.tube("wood", &[boom, boom + DVec3::new(-3.0, 1.5, 0.4)], (0.06, 0.045), 6);
    model.tint = DVec3::splat(0.08);
    line(&mut model, mast + DVec3::Y * 6.1, DVec3::new(5.7, 1.95, 0.0), 0.014);
    line(&mut model, mast + DVec3::Y * 6.1, DVec3::new(-4.9, 1.35, 0.0), 0.014);
    line(&mut model, mast + DVec3::Y * 6.1, boom + DVec3::new(-2.9, 1.5, 0.4), 0.012);
    for side in [-1.0, 1.0] {
        line(&mut model, mast + DVec3::Y * 6.0, DVec3::new(0.9, 1.1, side * 1.7), 0.014);
        line(&mut model, mast + DVec3::Y * 6.0, DVec3::new(2.0, 1.2, side * 1.5), 0.014);
    }
    // Nets, a box of fish, and floats.
    let lumps = |out: DVec3| 0.25 * (out.x * 7.0).sin() * (out.z * 6.0).sin();
    model.blob("cloth", (DVec3::new(0.1, 0.85, 0.45), DVec3::new(0.75, 0.4, 0.55)), (16, 8), lumps, |_| {
        colour(0x3a6a4c)
    });
    model.tint = colour(0xd8742c);
    for (x, z) in [(3.0, 0.4), (3.25, -0.1), (2.9, -0.45)] {
        model.blob("paint", (DVec3::new(x, 1.15, z), DVec3::splat(0.19)), (10, 6), |_| 0.0, |_| DVec3::ONE);
    }
    model.tint = colour(0xb89868);
    model.block("wood", DVec3::new(-0.9, 0.7, -0.95), DVec3::new(-0.1, 1.05, -0.35));
    model.tint = DVec3::splat(0.05);
    for side in [-1.0, 1.0] {
        for s in [0.3, 0.55] {
            let rail = hull.rail(s);
            model.blob(
                "paint",
                (DVec3::new(rail.x, rail.y - 0.45, side * (rail.z + 0.1)), DVec3::new(0.13, 0.3, 0.13)),
                (8, 6),
                |_| 0.0,
                |_| DVec3::ONE,
            );
        }
    }
    model
}

/// White, with a low cabin, her sails furled.
pub fn sailing_boat() -> Model {
    let mut model = Model::new();
    let hull = Hull {
        length: 8.6,
        half_beam: 1.3,
        draught: 0.8,
        board: 0.78,
        bottom: colour(0x1c3444),
        side: colour(0xf2efe8),
        stripe: colour(0x8a3024),
    };
    hull.build(&mut model, false);
    hull.deck(&mut model, (0.0, 0.96), 0.05, colour(0xd0a878));
    model.tint = colour(0xf4f1ea);
    model.within(at(0.4, 0.75, 0.0), |model| {
        model.sheet("paint", (14, 10), |u, v| {
            let x = -1.8 + 3.7 * u;
            let taper = 1.0 - 0.45 * smooth(0.4, 1.0, u);
            let (sin, cos) = ((v - 0.5) * PI).sin_cos();
            let flat = |value: f64| value.signum() * value.abs().powf(0.45);
            (DVec3::new(x, 0.5 * flat(cos) * (1.0 - 0.35 * u), -0.78 * taper * flat(sin)), DVec3::ONE)
        });
        model.tint = colour(0x2a3238);
        for side in [-1.0, 1.0] {
            for x in [-1.2, -0.5, 0.2] {
                let z = side * (0.785 - 0.06 * smooth(-0.4, 1.0, x));
                model.block_at("pane", DVec3::new(x, 0.28, z), DVec3::new(0.45, 0.16, 0.05));
            }
        }
    });
    let mast = DVec3::new(0.9, 0.8, 0.0);
    model.tint = colour(0xe0b878);
    model.tube("wood", &[mast, mast + DVec3::Y * 10.2], (0.085, 0.05), 8);
    let boom = mast + DVec3::Y * 1.15;
    model.tube("wood", &[boom, boom + DVec3::new(-3.7, 0.1, 0.0)], (0.06, 0.05), 8);
    // The furled sail in its cover.
    model.tint = colour(0x9c3c2c);
    let path: Vec<DVec3> = (0..=14)
        .map(|i| f64::from(i) / 14.0)
        .map(|t| boom + DVec3::new(-3.55 * t - 0.05, 0.16 + 0.1 * t + 0.02 * (t * 40.0).sin(), 0.02 * (t * 25.0).cos()))
        .collect();
    model.tube("cloth", &path, (0.2, 0.1), 8);
    model.tint = DVec3::splat(0.25);
    let top = mast + DVec3::Y * 10.0;
    line(&mut model, top, DVec3::new(4.75, 1.35, 0.0), 0.012);
    line(&mut model, top, DVec3::new(-4.2, 0.95, 0.0), 0.012);
    line(&mut model, top, boom + DVec3::new(-3.65, 0.1, 0.0), 0.01);
    let cross = mast + DVec3::Y * 6.3;
    for side in [-1.0, 1.0] {
        let tip = cross + DVec3::Z * side * 0.75;
        model.beam("iron", cross, tip, 0.05, 0.04);
        line(&mut model, top, tip, 0.01);
        line(&mut model, tip, DVec3::new(0.8, 0.85, side * 1.25), 0.01);
    }
    // Rails at bow and stern.
    model.tint = DVec3::splat(0.8);
    for side in [-1.0, 1.0] {
        let posts: Vec<DVec3> =
            (0..=7).map(|i| hull.rail(0.06 + 0.9 * f64::from(i) / 7.0) * DVec3::new(1.0, 1.0, side * 0.93)).collect();
        for post in &posts {
            model.tube("iron", &[*post, *post + DVec3::Y * 0.55], (0.014, 0.014), 4);
        }
        for pair in posts.windows(2) {
            line(&mut model, pair[0] + DVec3::Y * 0.54, pair[1] + DVec3::Y * 0.54, 0.008);
        }
    }
    model.tint = colour(0xd0a878);
    model.tube("wood", &[DVec3::new(-3.9, 0.9, 0.0), DVec3::new(-2.9, 1.35, 0.1)], (0.035, 0.03), 6);
    model
}

/// Open, of varnished wood, with thwarts and oars.
pub fn dinghy() -> Model {
    let mut model = Model::new();
    let hull = Hull {
        length: 3.6,
        half_beam: 0.72,
        draught: 0.18,
        board: 0.42,
        bottom: colour(0xc8c0b0),
        side: colour(0x3c7a68),
        stripe: colour(0xe8dcc0),
    };
    hull.build(&mut model, true);
    model.tint = colour(0xc09a68);
    for s in [0.12, 0.42, 0.68] {
        let rail = hull.rail(s);
        model.block(
            "wood",
            DVec3::new(rail.x - 0.14, 0.24, -rail.z * 0.93),
            DVec3::new(rail.x + 0.14, 0.28, rail.z * 0.93),
        );
    }
    for side in [-1.0, 1.0] {
        let (hand, blade) = (DVec3::new(-0.9, 0.36, side * 0.2), DVec3::new(1.0, 0.34, side * 0.34));
        model.tint = colour(0xd8b888);
        model.tube("wood", &[hand, blade], (0.025, 0.025), 6);
        model.within(DAffine3::from_translation(blade), |model| {
            model.block("wood", DVec3::new(0.0, -0.012, -0.07), DVec3::new(0.5, 0.012, 0.07))
        });
    }
    model
}
