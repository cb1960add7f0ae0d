//! Textures out of formulas. All repeat without a seam.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::model::smooth;

/// An image file in memory.
pub struct EncodedImage {
    pub name: String,
    pub mime: &'static str,
    pub bytes: Vec<u8>,
}

fn hash(x: i64, y: i64, seed: u32) -> f64 {
    let mut mixed =
        (x as u32).wrapping_mul(0x85eb_ca6b) ^ (y as u32).wrapping_mul(0xc2b2_ae35) ^ seed.wrapping_mul(0x27d4_eb2f);
    mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d);
    mixed = (mixed ^ (mixed >> 12)).wrapping_mul(0x297a_2d39);
    f64::from(mixed ^ (mixed >> 15)) / f64::from(u32::MAX)
}

/// Values at the corners of so many cells along an image's edges, smooth between: 0 to 1.
fn noise(at: DVec2, cells: (i64, i64), seed: u32) -> f64 {
    let scaled = at * DVec2::new(cells.0 as f64, cells.1 as f64);
    let low = scaled.floor();
    let part = scaled - low;
    let part = part * part * (3.0 - 2.0 * part);
    let (x, y) = (low.x as i64, low.y as i64);
    let corner = |i: i64, j: i64| hash((x + i).rem_euclid(cells.0), (y + j).rem_euclid(cells.1), seed);
    let low = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * part.x;
    let high = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * part.x;
    low + (high - low) * part.y
}

/// Noise in octaves, each twice as fine and half as strong: 0 to 1.
fn clouds(at: DVec2, cells: (i64, i64), octaves: u32, seed: u32) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for octave in 0..octaves {
        let share = 0.5_f64.powi(octave as i32);
        sum += share * noise(at, (cells.0 << octave, cells.1 << octave), seed + octave);
        weight += share;
    }
    sum / weight
}

/// Noise that does not repeat, for terrain and lumps: 0 to 1.
pub fn wide_clouds(at: DVec2, octaves: u32, seed: u32) -> f64 {
    clouds(at / 4096.0, (4096, 4096), octaves, seed)
}

/// Scattered points: how far the nearest is, how much farther the second, and a number of the nearest; distances in cells.
fn pebbles(at: DVec2, cells: i64, seed: u32) -> (f64, f64, f64) {
    let scaled = at * cells as f64;
    let (x, y) = (scaled.x.floor() as i64, scaled.y.floor() as i64);
    let (mut first, mut second, mut which) = (9.0, 9.0, 0.0);
    for j in y - 1..=y + 1 {
        for i in x - 1..=x + 1 {
            let (wrapped, row) = (i.rem_euclid(cells), j.rem_euclid(cells));
            let shift = DVec2::new(hash(wrapped, row, seed), hash(wrapped, row, seed + 1)) * 0.7 + 0.15;
            let distance = (DVec2::new(i as f64, j as f64) + shift - scaled).length();
            if distance < first {
                (second, first, which) = (first, distance, hash(wrapped, row, seed + 2));
            } else if distance < second {
                second = distance;
            }
        }
    }
    (first, second - first, which)
}

/// A pattern of courses: `rows` of them, each of so many pieces, every other one shifted by half. Returns the place in its piece (0 to 1 each way),
/// the distance to its border in parts of the image, and a number of the piece.
fn courses(at: DVec2, rows: i64, pieces: i64, seed: u32) -> (DVec2, f64, f64) {
    let row = (at.y * rows as f64).floor() as i64;
    let shift = 0.5 * (row & 1) as f64 + 0.3 * (hash(0, row.rem_euclid(rows), seed) - 0.5);
    let x = at.x * pieces as f64 + shift;
    let piece = x.floor() as i64;
    let inside = DVec2::new(x - x.floor(), at.y * rows as f64 - row as f64);
    let edge = DVec2::new(inside.x.min(1.0 - inside.x) / pieces as f64, inside.y.min(1.0 - inside.y) / rows as f64);
    (inside, edge.min_element(), hash(piece.rem_euclid(pieces), row.rem_euclid(rows), seed + 9))
}

fn mix(from: DVec3, to: DVec3, part: f64) -> DVec3 {
    from + (to - from) * part
}

/// Draws colours (as sRGB shows them, 0 to 1) and heights (metres) of a square of `metres`, and makes a base colour and a normal map of them.
fn surface(name: &str, size: u32, metres: f64, at: impl Fn(DVec2) -> (DVec3, f64)) -> [EncodedImage; 2] {
    let place = |i: u32| (f64::from(i) + 0.5) / f64::from(size);
    let texels: Vec<(DVec3, f64)> =
        (0..size * size).map(|i| at(DVec2::new(place(i % size), place(i / size)))).collect();
    let colours: Vec<u8> = texels.iter().flat_map(|(colour, _)| bytes(*colour)).collect();
    let height = |x: u32, y: u32| texels[((y % size) * size + x % size) as usize].1;
    let step = 2.0 * metres / f64::from(size);
    let normals: Vec<u8> = (0..size * size)
        .flat_map(|i| {
            let (x, y) = (i % size, i / size);
            let right = (height(x + 1, y) - height(x + size - 1, y)) / step;
            // Images go down, bitangents up.
            let up = (height(x, y + size - 1) - height(x, y + 1)) / step;
            bytes(DVec3::new(-right, -up, 1.0).normalize() * 0.5 + 0.5)
        })
        .collect();
    [jpeg(name, size, &colours, 84), jpeg(&format!("{name} normals"), size, &normals, 88)]
}

fn bytes(value: DVec3) -> [u8; 3] {
    value.to_array().map(|channel| (channel.clamp(0.0, 1.0) * 255.0).round() as u8)
}

fn jpeg(name: &str, size: u32, rgb: &[u8], quality: u8) -> EncodedImage {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode(rgb, size, size, ExtendedColorType::Rgb8)
        .expect("a picture of that size in memory");
    EncodedImage { name: name.into(), mime: "image/jpeg", bytes }
}

fn rgb(hex: u32) -> DVec3 {
    DVec3::new(f64::from(hex >> 16), f64::from((hex >> 8) & 255), f64::from(hex & 255)) / 255.0
}

fn stone() -> [EncodedImage; 2] {
    surface("stone", 512, 3.0, |at| {
        let bent = at + 0.008 * (clouds(at, (6, 6), 3, 5) - 0.5);
        let (_, edge, piece) = courses(bent, 6, 3, 11);
        let grain = clouds(at, (24, 24), 4, 21);
        let large = clouds(at, (3, 3), 3, 31);
        let block = smooth(0.003, 0.014, edge);
        let tone = mix(rgb(0x7d_7468), rgb(0xa8_9c88), piece) * (0.72 + 0.45 * grain) * (0.85 + 0.3 * large);
        let mortar = rgb(0x6b_6459) * (0.8 + 0.4 * grain);
        (mix(mortar, tone, block), 0.022 * block + 0.009 * grain + 0.008 * piece)
    })
}

fn cobble() -> [EncodedImage; 2] {
    surface("cobble", 512, 1.6, |at| {
        let (near, gap, piece) = pebbles(at, 9, 3);
        let grain = clouds(at, (40, 40), 3, 8);
        let top = smooth(0.02, 0.28, gap);
        let tone = mix(rgb(0x6f_6a64), rgb(0x9a_9084), piece) * (0.8 + 0.35 * grain);
        let sand = rgb(0x62_5a4c) * (0.75 + 0.5 * grain);
        (mix(sand, tone, top), 0.03 * top * (1.0 - 0.5 * near * near) + 0.006 * grain)
    })
}

/// Near white, so that tints colour it.
fn plaster() -> [EncodedImage; 2] {
    surface("plaster", 512, 4.0, |at| {
        let broad = clouds(at, (3, 3), 4, 41);
        let fine = clouds(at, (48, 48), 3, 45);
        // Rain leaves streaks.
        let streaks = clouds(at, (32, 2), 3, 51);
        let tone = 0.80 + 0.16 * broad + 0.06 * (fine - 0.5) - 0.10 * smooth(0.55, 0.85, streaks);
        let worn = smooth(0.60, 0.68, clouds(at, (4, 4), 5, 61));
        let colour = mix(DVec3::splat(tone), rgb(0xb3_a48f), 0.35 * worn);
        (colour, 0.0012 * fine + 0.006 * broad - 0.002 * worn)
    })
}

fn roof() -> [EncodedImage; 2] {
    surface("roof", 512, 2.0, |at| {
        let (inside, _, piece) = courses(DVec2::new(at.x, at.y), 8, 9, 71);
        let grain = clouds(at, (32, 32), 3, 75);
        let moss = smooth(0.56, 0.78, clouds(at, (4, 4), 4, 81));
        // Each tile is an arch across, and lies on the one below it.
        let across = (inside.x * TAU * 0.5).sin();
        let lap = inside.y;
        let tone = mix(rgb(0x9c_4f33), rgb(0xc4_7148), piece)
            * (0.72 + 0.4 * grain)
            * (0.6 + 0.4 * across.powf(0.5))
            * (0.75 + 0.25 * lap);
        (mix(tone, rgb(0x6d_6a3c) * (0.6 + 0.6 * grain), 0.5 * moss), 0.04 * across + 0.04 * lap + 0.003 * grain)
    })
}

/// Boards along u. Near grey, so that tints colour it.
fn wood() -> [EncodedImage; 2] {
    surface("wood", 512, 1.2, |at| {
        let rows = 6.0;
        let row = (at.y * rows).floor();
        let inside = at.y * rows - row;
        let board = hash(0, row as i64, 91);
        let fibres = clouds(DVec2::new(at.x, at.y), (4, 96), 3, 95);
        let broad = clouds(at, (3, 14), 3, 101);
        let gap = smooth(0.0, 0.05, inside.min(1.0 - inside));
        let tone = (0.50 + 0.22 * board) * (0.65 + 0.5 * fibres) * (0.8 + 0.4 * broad) * (0.25 + 0.75 * gap);
        (DVec3::new(1.04, 0.94, 0.82) * tone, 0.008 * gap + 0.0012 * fibres + 0.002 * board)
    })
}

fn brick() -> [EncodedImage; 2] {
    surface("brick", 512, 1.5, |at| {
        let (_, edge, piece) = courses(at + 0.003 * (noise(at, (24, 24), 2) - 0.5), 20, 6, 111);
        let grain = clouds(at, (40, 40), 3, 115);
        let broad = clouds(at, (3, 3), 3, 121);
        let face = smooth(0.002, 0.008, edge);
        let tone = mix(rgb(0x7c_3d2c), rgb(0xb0_6245), piece) * (0.7 + 0.5 * grain) * (0.8 + 0.4 * broad);
        (mix(rgb(0xa3_9a8b) * (0.7 + 0.4 * grain), tone, face), 0.009 * face + 0.002 * grain)
    })
}

fn rock() -> [EncodedImage; 2] {
    surface("rock", 512, 3.0, |at| {
        let broad = clouds(at, (3, 3), 6, 131);
        let fine = clouds(at, (20, 20), 4, 141);
        let (_, gap, piece) = pebbles(at + 0.05 * (fine - 0.5), 5, 151);
        let crack = smooth(0.0, 0.07, gap);
        let tone =
            mix(rgb(0x5c_5852), rgb(0x96_8d7f), 0.6 * broad + 0.4 * piece) * (0.7 + 0.5 * fine) * (0.7 + 0.3 * crack);
        (tone, 0.10 * broad + 0.02 * fine + 0.03 * crack)
    })
}

/// Grass and scrub. Near grey-green, so that tints colour it.
fn ground() -> [EncodedImage; 2] {
    surface("ground", 512, 9.0, |at| {
        let broad = clouds(at, (5, 5), 4, 161);
        let fine = clouds(at, (64, 64), 3, 171);
        let tufts = smooth(0.45, 0.75, clouds(at, (18, 18), 3, 181));
        let tone = (0.55 + 0.35 * fine) * (0.75 + 0.4 * broad);
        (
            mix(DVec3::new(0.95, 0.96, 0.7), DVec3::new(0.66, 0.84, 0.5), tufts) * tone,
            0.07 * tufts * fine + 0.12 * broad,
        )
    })
}

/// The sea's ripples: waves of whole numbers along both edges, steeper where they are long, mostly with the wind.
fn water() -> EncodedImage {
    const SIZE: u32 = 512;
    let waves: Vec<(DVec2, f64, f64)> = (0..34)
        .map(|i| {
            let long = 1.0 + 1.28_f64.powi(i / 2);
            let turn = (hash(i.into(), 0, 191) - 0.5) * 2.6 + 0.5;
            let number = DVec2::new((long * turn.cos()).round(), (long * turn.sin()).round());
            // The material scales this down: eight bits would make steps of waves so flat.
            let slope = 0.06 / (1.0 + 0.02 * long) * (0.6 + 0.8 * hash(i.into(), 1, 191));
            (number, slope, hash(i.into(), 2, 191) * TAU)
        })
        .filter(|(number, ..)| number.length() > 0.5)
        .collect();
    let texels: Vec<u8> = (0..SIZE * SIZE)
        .flat_map(|i| {
            let at = DVec2::new(f64::from(i % SIZE), f64::from(i / SIZE)) / f64::from(SIZE);
            let slope: DVec2 = waves
                .iter()
                .map(|(number, slope, phase)| number.normalize() * slope * (number.dot(at) * TAU + phase).cos())
                .sum();
            bytes(DVec3::new(-slope.x, slope.y, 1.0).normalize() * 0.5 + 0.5)
        })
        .collect();
    jpeg("water normals", SIZE, &texels, 90)
}

/// A spray of leaves, cut out by alpha. Near white-green, so that tints colour it.
fn leaves() -> EncodedImage {
    const SIZE: u32 = 256;
    let leaves: Vec<(DVec2, DVec2, f64, f64)> = (0..58)
        .map(|i| {
            let (turn, out) = (hash(i, 0, 201) * TAU, hash(i, 1, 201).sqrt() * 0.37);
            let lean = turn + (hash(i, 2, 201) - 0.5) * 2.0;
            let middle = DVec2::new(turn.cos(), turn.sin()) * out + 0.5;
            (middle, DVec2::new(lean.cos(), lean.sin()), 0.075 + 0.045 * hash(i, 3, 201), 0.55 + 0.45 * hash(i, 4, 201))
        })
        .collect();
    let mut texels = vec![0_u8; (SIZE * SIZE * 4) as usize];
    for (i, texel) in texels.chunks_exact_mut(4).enumerate() {
        let at = DVec2::new((i as u32 % SIZE) as f64 + 0.5, (i as u32 / SIZE) as f64 + 0.5) / f64::from(SIZE);
        // The gaps have the colour of leaves, so that filters find no dark edge.
        let (mut colour, mut alpha) = (DVec3::new(0.52, 0.60, 0.34), 0);
        for (middle, along, length, tone) in &leaves {
            let away = at - *middle;
            let (x, y) = (away.dot(*along) / length, away.dot(along.perp()) / length);
            if x.abs() < 1.0 && y.abs() < 0.42 * (1.0 - x * x) {
                let vein = 1.0 - 0.25 * (1.0 - smooth(0.0, 0.06, y.abs()));
                // Few steps of tone: a PNG packs them well.
                colour = (DVec3::new(0.70, 0.80, 0.42) * *tone * vein * 24.0).round() / 24.0;
                alpha = 255;
            }
        }
        texel[..3].copy_from_slice(&bytes(colour));
        texel[3] = alpha;
    }
    let mut packed = Vec::new();
    image::codecs::png::PngEncoder::new_with_quality(
        &mut packed,
        image::codecs::png::CompressionType::Best,
        image::codecs::png::FilterType::Adaptive,
    )
    .write_image(&texels, SIZE, SIZE, ExtendedColorType::Rgba8)
    .expect("a picture of that size in memory");
    EncodedImage { name: "leaves".into(), mime: "image/png", bytes: packed }
}

fn painted(surfaces: &[fn() -> [EncodedImage; 2]]) -> Vec<EncodedImage> {
    std::thread::scope(|scope| {
        let painting: Vec<_> = surfaces.iter().map(|paint| scope.spawn(paint)).collect();
        painting.into_iter().flat_map(|one| one.join().expect("a texture is painted")).collect()
    })
}

/// The textures of the harbour; materials find them by name.
pub fn of_the_harbour() -> Vec<EncodedImage> {
    let mut all = painted(&[stone, cobble, plaster, roof, wood, brick, rock]);
    all.push(leaves());
    all
}

/// The textures of hills and sea.
pub fn of_the_surroundings() -> Vec<EncodedImage> {
    let mut all = painted(&[ground]);
    all.push(water());
    all
}
