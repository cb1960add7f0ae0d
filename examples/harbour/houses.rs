//! Houses, the church and the lighthouse.

use glam::{DAffine3, DVec3};

use super::model::{Model, at, colour, smooth};

/// A house before its front at z = 0: it stands on y = 0, is `width` wide about x = 0, and goes back to z = -depth.
pub struct House {
    pub width: f64,
    pub depth: f64,
    /// Up to the eaves.
    pub height: f64,
    /// Height of the roof over the eaves.
    pub rise: f64,
    /// True where the front ends in a gable, false where the eaves are in front.
    pub gable: bool,
    pub wall: (&'static str, DVec3),
    pub trim: DVec3,
    pub shutters: Option<DVec3>,
    pub storeys: u32,
    pub bays: u32,
    /// The bay of the ground floor with the door, counted from the left.
    pub door: u32,
    /// Bays beside the door's are a shop with an awning of this colour.
    pub awning: Option<DVec3>,
    pub balcony: bool,
    pub roof: DVec3,
    /// Along the ridge, -1 to 1.
    pub chimney: f64,
    /// One in so many windows is lit in the evening.
    pub lit: u32,
}

const OVERHANG: f64 = 0.38;

/// A wall in the plane z = 0 with openings (x0, y0, x1, y1), whose reveals go in by `deep`.
fn wall(
    model: &mut Model,
    material: &'static str,
    (x0, x1): (f64, f64),
    height: f64,
    openings: &[[f64; 4]],
    deep: f64,
) {
    let mut xs = vec![x0, x1];
    let mut ys = vec![0.0, height];
    for [a, b, c, d] in openings {
        xs.extend([*a, *c]);
        ys.extend([*b, *d]);
    }
    for list in [&mut xs, &mut ys] {
        list.sort_by(f64::total_cmp);
        list.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    }
    for x in xs.windows(2) {
        for y in ys.windows(2) {
            let middle = ((x[0] + x[1]) * 0.5, (y[0] + y[1]) * 0.5);
            let open = |[a, b, c, d]: &[f64; 4]| middle.0 > *a && middle.0 < *c && middle.1 > *b && middle.1 < *d;
            if !openings.iter().any(open) {
                model.face(
                    material,
                    &[(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])].map(|(x, y)| DVec3::new(x, y, 0.0)),
                );
            }
        }
    }
    for &[a, b, c, d] in openings {
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, -z);
        model.face(material, &[p(a, b, 0.0), p(a, b, deep), p(a, d, deep), p(a, d, 0.0)]);
        model.face(material, &[p(c, b, deep), p(c, b, 0.0), p(c, d, 0.0), p(c, d, deep)]);
        model.face(material, &[p(a, d, deep), p(c, d, deep), p(c, d, 0.0), p(a, d, 0.0)]);
        model.face(material, &[p(a, b, 0.0), p(c, b, 0.0), p(c, b, deep), p(a, b, deep)]);
    }
}

/// Frame, bars, pane and sill in an opening.
fn window(model: &mut Model, [x0, y0, x1, y1]: [f64; 4], house: &House, lit: bool, deep: f64) {
    let white = house.trim;
    let (bar, z) = (0.07, -deep);
    model.within(DAffine3::IDENTITY, |model| {
        let pane = if lit { "pane, lit" } else { "pane" };
        model.face(pane, &[(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| DVec3::new(x, y, z)));
        model.tint = white;
        let mut strip = |a: f64, b: f64, c: f64, d: f64, thick: f64| {
            model.panel("paint", DVec3::new(a, b, z), DVec3::new(c, d, z + thick));
        };
        strip(x0, y0, x0 + bar, y1, 0.07);
        strip(x1 - bar, y0, x1, y1, 0.07);
        strip(x0 + bar, y1 - bar, x1 - bar, y1, 0.07);
        strip(x0 + bar, y0, x1 - bar, y0 + bar, 0.07);
        let (mx, my) = ((x0 + x1) * 0.5, y0 + (y1 - y0) * 0.62);
        strip(mx - 0.03, y0 + bar, mx + 0.03, y1 - bar, 0.05);
        strip(x0 + bar, my - 0.025, mx - 0.03, my + 0.025, 0.05);
        strip(mx + 0.03, my - 0.025, x1 - bar, my + 0.025, 0.05);
        model.tint = colour(0xb8b0a4);
        model.block("plaster", DVec3::new(x0 - 0.08, y0 - 0.09, -0.05), DVec3::new(x1 + 0.08, y0, 0.1));
    });
    if let Some(shade) = house.shutters {
        model.within(DAffine3::IDENTITY, |model| {
            model.tint = shade;
            let half = (x1 - x0) * 0.5;
            for left in [x0 - half - 0.03, x1 + 0.03] {
                model.grain = Some(DVec3::Y);
                model.panel("wood", DVec3::new(left, y0, 0.0), DVec3::new(left + half, y1, 0.05));
                model.tint = shade * 0.8;
                for y in [y0 + 0.16, y1 - 0.26] {
                    model.panel("wood", DVec3::new(left, y, 0.05), DVec3::new(left + half, y + 0.1, 0.075));
                }
                model.tint = shade;
            }
        });
    }
}

fn door(model: &mut Model, [x0, _, x1, y1]: [f64; 4], house: &House, deep: f64) {
    model.within(DAffine3::IDENTITY, |model| {
        model.grain = Some(DVec3::Y);
        model.tint = house.shutters.unwrap_or(colour(0x7a5a3c)) * 0.8;
        model.block("wood", DVec3::new(x0 + 0.1, 0.0, -deep), DVec3::new(x1 - 0.1, y1 - 0.55, -deep + 0.08));
        model.face(
            "pane",
            &[(x0 + 0.1, y1 - 0.5), (x1 - 0.1, y1 - 0.5), (x1 - 0.1, y1 - 0.08), (x0 + 0.1, y1 - 0.08)]
                .map(|(x, y)| DVec3::new(x, y, -deep + 0.02)),
        );
        model.tint = house.trim;
        model.block("paint", DVec3::new(x0, 0.0, -deep), DVec3::new(x0 + 0.1, y1, -deep + 0.12));
        model.block("paint", DVec3::new(x1 - 0.1, 0.0, -deep), DVec3::new(x1, y1, -deep + 0.12));
        model.block("paint", DVec3::new(x0 + 0.1, y1 - 0.08, -deep), DVec3::new(x1 - 0.1, y1, -deep + 0.12));
        model.block("paint", DVec3::new(x0 + 0.1, y1 - 0.57, -deep), DVec3::new(x1 - 0.1, y1 - 0.49, -deep + 0.12));
        model.tint = DVec3::ONE;
        model.block("iron", DVec3::new(x1 - 0.3, 1.0, -deep + 0.08), DVec3::new(x1 - 0.22, 1.06, -deep + 0.14));
        model.block("stone", DVec3::new(x0 - 0.2, 0.0, -0.1), DVec3::new(x1 + 0.2, 0.16, 0.45));
    });
}

impl House {
    pub fn build(&self) -> Model {
        let mut model = Model::new();
        let (half, deep) = (self.width * 0.5, 0.22);
        let storey = self.height / f64::from(self.storeys);
        let bay = self.width / f64::from(self.bays);
        let (mut openings, mut windows) = (Vec::new(), Vec::new());
        let mut way_in = None;
        for floor in 0..self.storeys {
            for i in 0..self.bays {
                let x = -half + bay * (f64::from(i) + 0.5);
                if floor == 0 && i == self.door {
                    let opening = [x - 0.6, 0.0, x + 0.6, 2.55];
                    way_in = Some(opening);
                    openings.push(opening);
                    continue;
                }
                let shop = floor == 0 && self.awning.is_some();
                let wide = if shop { bay * 0.36 } else { 0.5 };
                let y = f64::from(floor) * storey + if shop { 0.75 } else { storey * 0.34 };
                let tall = if shop { 1.7 } else { (storey * 0.5).min(1.5) };
                let opening = [x - wide, y, x + wide, y + tall];
                openings.push(opening);
                windows.push(opening);
            }
        }
        let (material, shade) = self.wall;
        model.tint = shade;
        wall(&mut model, material, (-half, half), self.height, &openings, deep);
        // The other three walls: two windows on either side.
        let side_windows: Vec<[f64; 4]> = (0..self.storeys)
            .flat_map(|floor| {
                let y = f64::from(floor) * storey + storey * 0.34;
                [-0.25, 0.25]
                    .map(|part| [part * self.depth - 0.45, y, part * self.depth + 0.45, y + (storey * 0.45).min(1.4)])
            })
            .collect();
        for (x, degrees) in [(half, 90.0), (-half, -90.0)] {
            model.within(super::model::turned(x, 0.0, -self.depth * 0.5, degrees), |model| {
                wall(model, material, (-self.depth * 0.5, self.depth * 0.5), self.height, &side_windows, deep);
                model.tint = DVec3::ONE;
                for (i, opening) in side_windows.iter().enumerate() {
                    window(model, *opening, self, i as u32 % self.lit == 1, deep);
                }
            });
        }
        model.within(super::model::turned(0.0, 0.0, -self.depth, 180.0), |model| {
            wall(model, material, (-half, half), self.height, &[], deep);
        });
        self.roof(&mut model);
        model.tint = DVec3::ONE;
        for (i, opening) in windows.iter().enumerate() {
            window(&mut model, *opening, self, (i as u32 + self.door).is_multiple_of(self.lit), deep);
        }
        if let Some(opening) = way_in {
            door(&mut model, opening, self, deep);
        }
        // A plinth of stone, left and right of the door.
        let gap = way_in.map_or([0.0, 0.0], |opening| [opening[0] - 0.02, opening[2] + 0.02]);
        for (a, b) in [(-half - 0.05, gap[0]), (gap[1], half + 0.05)] {
            model.block("stone", DVec3::new(a, 0.0, -0.3), DVec3::new(b, 0.55, 0.06));
        }
        for x in [-half - 0.05, half] {
            model.block("stone", DVec3::new(x, 0.0, -self.depth), DVec3::new(x + 0.05, 0.55, 0.06));
        }
        if let Some(shade) = self.awning {
            self.awning(&mut model, shade);
        }
        if self.balcony {
            self.balcony(&mut model, storey);
        }
        model
    }

    /// Two slopes of tiles with boards below, gables under their ends, a ridge and a chimney.
    fn roof(&self, model: &mut Model) {
        // In the frame of the ridge: it runs along x, slopes fall to both sides of z.
        let (along, across) = if self.gable { (self.depth, self.width) } else { (self.width, self.depth) };
        let frame = at(0.0, self.height, -self.depth * 0.5)
            * if self.gable { DAffine3::from_rotation_y(90_f64.to_radians()) } else { DAffine3::IDENTITY };
        let (length, half) = (along * 0.5 + OVERHANG, across * 0.5);
        let drop = OVERHANG * self.rise / half;
        let (low, edge, top) = (-drop, half + OVERHANG, self.rise);
        let thick = 0.14;
        model.within(frame, |model| {
            for side in [1.0, -1.0] {
                let gable = [
                    DVec3::new(side * along * 0.5, 0.0, side * half),
                    DVec3::new(side * along * 0.5, 0.0, -side * half),
                    DVec3::new(side * along * 0.5, top, 0.0),
                ];
                model.face(self.wall.0, &gable);
            }
            for turn in [0.0, 180.0] {
                model.within(super::model::turned(0.0, 0.0, 0.0, turn), |model| {
                    let lift = DVec3::Y * thick;
                    let [a, b, c, d] = [
                        DVec3::new(-length, low, edge),
                        DVec3::new(length, low, edge),
                        DVec3::new(length, top, 0.0),
                        DVec3::new(-length, top, 0.0),
                    ];
                    model.tint = self.roof;
                    model.face("roof", &[a + lift, b + lift, c + lift, d + lift]);
                    model.tint = colour(0x8a7358);
                    model.face("wood", &[b, a, d, c]);
                    model.tint = self.trim * 0.9;
                    model.face("paint", &[a, b, b + lift, a + lift]);
                    model.face("paint", &[b, c, c + lift, b + lift]);
                    model.face("paint", &[d, a, a + lift, d + lift]);
                    // A gutter.
                    model.tint = DVec3::splat(0.35);
                    model.tube(
                        "paint",
                        &[a + DVec3::new(0.0, 0.03, 0.07), b + DVec3::new(0.0, 0.03, 0.07)],
                        (0.07, 0.07),
                        6,
                    );
                });
            }
            model.tint = self.roof * 0.85;
            let ridge = [DVec3::new(-length, top + thick - 0.03, 0.0), DVec3::new(length, top + thick - 0.03, 0.0)];
            model.tube("roof", &ridge, (0.13, 0.13), 8);
            // The chimney, beside the ridge.
            model.within(at(self.chimney * along * 0.5, top - 0.6, -0.4), |model| {
                model.tint = DVec3::ONE;
                model.block("brick", DVec3::new(-0.4, -0.6, -0.3), DVec3::new(0.4, 1.7, 0.3));
                model.tint = colour(0xb0a898);
                model.block("plaster", DVec3::new(-0.47, 1.7, -0.37), DVec3::new(0.47, 1.82, 0.37));
                model.tint = colour(0xa85a3c);
                for x in [-0.2, 0.2] {
                    model.within(at(x, 1.82, 0.0), |model| {
                        model.lathe(
                            "paint",
                            &[
                                (0.13, 0.0),
                                (0.1, 0.4),
                                (0.13, 0.42),
                                (0.13, 0.47),
                                (0.08, 0.47),
                                (0.08, 0.2),
                                (0.0, 0.2),
                            ],
                            8,
                        );
                    });
                }
            });
        });
    }

    /// Striped cloth over the shop.
    fn awning(&self, model: &mut Model, shade: DVec3) {
        let (half, stripes) = (self.width * 0.42, 14);
        for i in 0..stripes {
            let (x0, x1) = (
                -half + self.width * 0.84 / f64::from(stripes) * f64::from(i),
                -half + self.width * 0.84 / f64::from(stripes) * f64::from(i + 1),
            );
            model.tint = if i % 2 == 0 { shade } else { colour(0xe8e0d0) };
            let (back, front, edge) =
                (DVec3::new(0.0, 3.05, 0.02), DVec3::new(0.0, 2.45, 1.5), DVec3::new(0.0, 2.2, 1.52));
            let along = |p: DVec3, x: f64| DVec3::new(x, p.y, p.z);
            model.face("cloth", &[along(front, x0), along(front, x1), along(back, x1), along(back, x0)]);
            model.face("cloth", &[along(edge, x0), along(edge, x1), along(front, x1), along(front, x0)]);
        }
        model.tint = DVec3::splat(0.3);
        for x in [-half + 0.05, half - 0.05] {
            model.tube("iron", &[DVec3::new(x, 2.2, 0.0), DVec3::new(x, 2.42, 1.48)], (0.02, 0.02), 5);
        }
        model.tint = DVec3::ONE;
    }

    fn balcony(&self, model: &mut Model, storey: f64) {
        let (half, out) = (self.width * 0.36, 1.1);
        model.tint = colour(0xb8b0a4);
        model.block("plaster", DVec3::new(-half, storey - 0.05, 0.0), DVec3::new(half, storey + 0.1, out));
        for x in [-half * 0.8, half * 0.8] {
            model.block("plaster", DVec3::new(x - 0.09, storey - 0.5, 0.0), DVec3::new(x + 0.09, storey - 0.05, 0.5));
        }
        model.tint = DVec3::splat(0.4);
        let rail = |model: &mut Model, a: DVec3, b: DVec3| {
            model.beam("iron", a + DVec3::Y * 1.0, b + DVec3::Y * 1.0, 0.05, 0.04);
            let count = (a.distance(b) / 0.16) as u32;
            for i in 0..=count {
                let foot = a + (b - a) * (f64::from(i) / f64::from(count));
                model.beam("iron", foot, foot + DVec3::Y * 1.0, 0.02, 0.02);
            }
        };
        let y = storey + 0.1;
        let (l, r) = (-half + 0.04, half - 0.04);
        rail(model, DVec3::new(l, y, out - 0.04), DVec3::new(r, y, out - 0.04));
        rail(model, DVec3::new(l, y, 0.05), DVec3::new(l, y, out - 0.04));
        rail(model, DVec3::new(r, y, 0.05), DVec3::new(r, y, out - 0.04));
        // Flowers over the rail.
        for i in 0..7 {
            let x = l + (r - l) * (f64::from(i) + 0.5) / 7.0;
            flowers(model, DVec3::new(x, y + 0.78, out + 0.06), i);
        }
        model.tint = DVec3::ONE;
    }
}

/// A pot of geraniums.
pub fn flowers(model: &mut Model, place: DVec3, kind: u32) {
    let bloom = [colour(0xc8242c), colour(0xd85a8a), colour(0xe8b030)][kind as usize % 3];
    model.within(DAffine3::from_translation(place), |model| {
        model.tint = colour(0xa0583a);
        model.block("paint", DVec3::new(-0.26, -0.1, -0.1), DVec3::new(0.26, 0.08, 0.1));
        model.tint = DVec3::ONE;
        let lumps = |out: DVec3| 0.35 * (out.x * 9.0).sin() * (out.y * 8.0).sin() * (out.z * 10.0).sin();
        let green = colour(0x4c6a2c);
        let shade = move |out: DVec3| {
            let speck = smooth(0.1, 0.3, (out.x * 14.0).sin() * (out.z * 17.0).sin() * (out.y * 11.0).cos());
            green + (bloom - green) * speck
        };
        model.blob("paint", (DVec3::Y * 0.16, DVec3::new(0.3, 0.16, 0.18)), (14, 8), lumps, shade);
    });
}

/// A small church: a nave with its gable to the front, a tower beside it with a pointed roof. The weather vane is not part of it; it turns at this height.
pub const VANE: DVec3 = DVec3::new(-5.2, 23.0, -3.0);

pub fn church() -> Model {
    let nave = House {
        width: 8.5,
        depth: 16.0,
        height: 7.0,
        rise: 4.6,
        gable: true,
        wall: ("plaster", colour(0xf0e8da)),
        trim: colour(0x9a8f80),
        shutters: None,
        storeys: 1,
        bays: 3,
        door: 1,
        awning: None,
        balcony: false,
        roof: DVec3::ONE,
        chimney: -0.9,
        lit: 3,
    };
    let mut model = nave.build();
    model.within(at(VANE.x, 0.0, VANE.z), |model| {
        model.tint = colour(0xf0e8da);
        let (w, h) = (2.0, 14.5);
        for turn in [0.0, 90.0, 180.0, 270.0] {
            model.within(super::model::turned(0.0, 0.0, 0.0, turn) * at(0.0, 0.0, w), |model| {
                let openings = [[-0.7, 10.6, 0.7, 13.2], [-0.35, 4.0, 0.35, 5.6]];
                wall(model, "plaster", (-w, w), h, &openings, 0.4);
                model.tint = DVec3::splat(0.05);
                for [a, b, c, d] in openings {
                    model.face("paint", &[(a, b), (c, b), (c, d), (a, d)].map(|(x, y)| DVec3::new(x, y, -0.4)));
                }
                model.tint = colour(0x8a6a4a);
                for i in 0..8 {
                    let y = 10.75 + f64::from(i) * 0.31;
                    model.block("wood", DVec3::new(-0.7, y, -0.36), DVec3::new(0.7, y + 0.16, -0.2));
                }
                model.tint = colour(0xb0a898);
                model.block("plaster", DVec3::new(-w - 0.12, h - 0.3, -0.2), DVec3::new(w + 0.12, h, 0.12));
                model.block("plaster", DVec3::new(-w - 0.1, 9.6, -0.2), DVec3::new(w + 0.1, 9.85, 0.1));
                model.tint = colour(0x6a7a70);
                // A spire of copper that has gone green.
                let (a, b) = (DVec3::new(-w - 0.25, h, 0.25), DVec3::new(w + 0.25, h, 0.25));
                let (c, d) = (DVec3::new(w * 0.45, h + 2.6, -w * 0.55), DVec3::new(-w * 0.45, h + 2.6, -w * 0.55));
                model.face("paint", &[a, b, c, d]);
                model.face("paint", &[d, c, DVec3::new(0.0, h + 7.4, -w)]);
            });
        }
        model.tint = DVec3::splat(0.5);
        model.beam("iron", DVec3::new(0.0, 21.6, 0.0), DVec3::new(0.0, 23.6, 0.0), 0.05, 0.05);
    });
    model
}

/// Over the lighthouse's foot: the lens that turns.
pub const LENS: f64 = 15.6;

/// The lighthouse without its lens: white with red bands, a gallery, a lamp room of glass and an iron roof.
pub fn lighthouse() -> Model {
    let mut model = Model::new();
    model.lathe("stone", &[(3.6, -0.4), (3.4, 1.2), (3.4, 1.2), (2.9, 1.3)], 40);
    let radius = |y: f64| 2.65 - 0.055 * y - 0.35 * smooth(0.0, 6.0, y) * (1.0 - y / 30.0);
    let bands: [(f64, f64, u32); 5] = [
        (1.2, 4.2, 0xf2efe8),
        (4.2, 6.6, 0xb02a22),
        (6.6, 9.0, 0xf2efe8),
        (9.0, 11.4, 0xb02a22),
        (11.4, 13.6, 0xf2efe8),
    ];
    for (low, high, hex) in bands {
        model.tint = colour(hex);
        let profile: Vec<(f64, f64)> =
            (0..=4).map(|i| low + (high - low) * f64::from(i) / 4.0).map(|y| (radius(y), y)).collect();
        model.lathe("plaster", &profile, 40);
    }
    // Windows up the stairs, and a door.
    for (y, turn) in [(5.0, 20.0), (8.0, -15.0), (11.0, 30.0)] {
        model.within(super::model::turned(0.0, y, 0.0, turn) * at(0.0, 0.0, radius(y) - 0.12), |model| {
            model.tint = colour(0xd8d2c4);
            model.block("paint", DVec3::new(-0.42, -0.1, 0.0), DVec3::new(0.42, 1.2, 0.16));
            model.tint = DVec3::ONE;
            model.face(
                "pane",
                &[(-0.3, 0.0), (0.3, 0.0), (0.3, 1.08), (-0.3, 1.08)].map(|(x, y)| DVec3::new(x, y, 0.165)),
            );
        });
    }
    model.within(super::model::turned(0.0, 1.25, 0.0, -28.0) * at(0.0, 0.0, radius(1.3) - 0.3), |model| {
        model.tint = colour(0xd8d2c4);
        model.block("paint", DVec3::new(-0.75, 0.0, 0.0), DVec3::new(0.75, 2.4, 0.42));
        model.tint = colour(0x2c5a6a);
        model.grain = Some(DVec3::Y);
        model.block("wood", DVec3::new(-0.55, 0.0, 0.0), DVec3::new(0.55, 2.2, 0.46));
    });
    model.tint = colour(0xd8d2c4);
    model.lathe(
        "plaster",
        &[(radius(13.6), 13.5), (2.3, 14.0), (2.55, 14.0), (2.55, 14.0), (2.55, 14.2), (2.55, 14.2), (0.0, 14.2)],
        40,
    );
    // The rail of the gallery.
    model.tint = DVec3::splat(0.3);
    for height in [0.5, 1.05] {
        let ring: Vec<DVec3> = (0..=32)
            .map(|i| f64::from(i) / 32.0 * std::f64::consts::TAU)
            .map(|t| DVec3::new(t.sin() * 2.45, 14.2 + height, t.cos() * 2.45))
            .collect();
        model.tube("iron", &ring, (0.03, 0.03), 5);
    }
    for i in 0..16 {
        let (sin, cos) = (f64::from(i) / 16.0 * std::f64::consts::TAU).sin_cos();
        let foot = DVec3::new(sin * 2.45, 14.2, cos * 2.45);
        model.tube("iron", &[foot, foot + DVec3::Y * 1.05], (0.025, 0.025), 5);
    }
    model.tint = colour(0xb02a22);
    model.lathe("paint", &[(1.45, 14.2), (1.45, 14.8), (1.45, 14.8), (1.3, 14.85)], 24);
    model.lathe(
        "paint",
        &[
            (1.2, 16.75),
            (1.75, 16.8),
            (1.75, 16.8),
            (1.7, 16.95),
            (1.0, 17.6),
            (0.3, 18.0),
            (0.3, 18.0),
            (0.22, 18.15),
            (0.28, 18.3),
            (0.15, 18.5),
            (0.0, 18.5),
        ],
        24,
    );
    model.tint = DVec3::splat(0.3);
    model.tube("iron", &[DVec3::new(0.0, 18.4, 0.0), DVec3::new(0.0, 20.0, 0.0)], (0.03, 0.015), 5);
    for i in 0..8 {
        let (sin, cos) = (f64::from(i) / 8.0 * std::f64::consts::TAU).sin_cos();
        let foot = DVec3::new(sin * 1.3, 14.8, cos * 1.3);
        model.tube("iron", &[foot, foot + DVec3::Y * 2.0], (0.04, 0.04), 5);
    }
    model.tint = DVec3::ONE;
    model
}
