//! The surfaces of the hall: painted textures and the materials that wear them.

use glam::Vec3;

use crate::builtin::paint::{Painted, Texel, bricks, fractal, hash, mix, noise, paint, scaled, smoothstep};
use crate::builtin::stage::SceneBuilder;
use crate::{AlphaMode, Material};

/// Indices of the hall's materials.
pub(super) struct HallMaterials {
    pub stone: usize,
    pub trim: usize,
    pub plaster: usize,
    pub marble: usize,
    pub floor: usize,
    pub frieze: usize,
    pub roof: usize,
    pub wood: usize,
    pub fabrics: [usize; 3],
    pub ivy: usize,
    pub lattice: usize,
    pub terracotta: usize,
    pub bronze: usize,
    pub gold: usize,
    pub iron: usize,
    pub water: usize,
    pub glow: usize,
}

/// Edge of the textures in texels.
const EDGE: usize = 512;
const SMALL_EDGE: usize = 256;

impl HallMaterials {
    pub fn new(stage: &mut SceneBuilder) -> Self {
        let fabric = |stage: &mut SceneBuilder, name: &str, color: [f32; 3]| {
            let painted = paint(name, SMALL_EDGE, move |u, v| fabric(u, v, color));
            let material = dressed(stage, name, painted);
            stage.scene.materials[material].two_sided = true;
            material
        };
        Self {
            stone: painted(stage, "sandstone", EDGE, stone),
            trim: painted(stage, "trim", SMALL_EDGE, trim),
            plaster: painted(stage, "plaster", SMALL_EDGE, plaster),
            marble: painted(stage, "marble", EDGE, marble),
            floor: painted(stage, "floor", EDGE, floor),
            frieze: painted(stage, "frieze", SMALL_EDGE, frieze),
            roof: painted(stage, "roof tiles", SMALL_EDGE, roof),
            wood: painted(stage, "wood", SMALL_EDGE, wood),
            fabrics: [
                fabric(stage, "red cloth", [0.62, 0.07, 0.06]),
                fabric(stage, "blue cloth", [0.08, 0.20, 0.52]),
                fabric(stage, "green cloth", [0.07, 0.36, 0.16]),
            ],
            ivy: masked(stage, "ivy", ivy),
            lattice: masked(stage, "iron lattice", lattice),
            terracotta: painted(stage, "terracotta", SMALL_EDGE, terracotta),
            bronze: metal(stage, "bronze", Vec3::new(0.72, 0.43, 0.20), 0.32),
            gold: metal(stage, "gold", Vec3::new(1.0, 0.77, 0.34), 0.16),
            iron: metal(stage, "iron", Vec3::new(0.16, 0.15, 0.15), 0.55),
            water: plain(stage, "water", Vec3::new(0.01, 0.035, 0.04), 0.06),
            glow: {
                let glow = plain(stage, "lamp glass", Vec3::new(0.9, 0.8, 0.6), 0.4);
                stage.scene.materials[glow].emissive = Vec3::new(1.0, 0.62, 0.28) * 40_000.0;
                glow
            },
        }
    }
}

fn painted(stage: &mut SceneBuilder, name: &str, edge: usize, at: impl Fn(f32, f32) -> Texel + Sync) -> usize {
    dressed(stage, name, paint(name, edge, at))
}

/// A material that wears all three images as they are.
fn dressed(stage: &mut SceneBuilder, name: &str, painted: Painted) -> usize {
    let material = Material {
        name: name.into(),
        base_color: Vec3::ONE,
        metallic: 1.0,
        roughness: 1.0,
        base_color_texture: stage.texture(painted.color),
        normal_texture: stage.texture(painted.normal),
        metallic_roughness_texture: stage.texture(painted.surface),
        ..Material::default()
    };
    stage.material(material)
}

fn masked(stage: &mut SceneBuilder, name: &str, at: impl Fn(f32, f32) -> Texel + Sync) -> usize {
    let material = painted(stage, name, EDGE, at);
    stage.scene.materials[material].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    stage.scene.materials[material].two_sided = true;
    material
}

fn metal(stage: &mut SceneBuilder, name: &str, base_color: Vec3, roughness: f32) -> usize {
    stage.material(Material { name: name.into(), base_color, metallic: 1.0, roughness, ..Material::default() })
}

fn plain(stage: &mut SceneBuilder, name: &str, base_color: Vec3, roughness: f32) -> usize {
    stage.material(Material { name: name.into(), base_color, roughness, ..Material::default() })
}

/// Ashlar: two blocks by four courses in different shades, with weathered edges.
fn stone(u: f32, v: f32) -> Texel {
    let wobble = (fractal(u, v, 8, 3, 3) - 0.5) * 0.01;
    let (edge, column, row) = bricks(u + wobble, v + wobble, 2, 4);
    let grain = fractal(u, v, 16, 4, 11);
    let joint = smoothstep(0.012, 0.05, edge);
    let shade = 0.86 + 0.2 * hash(column, row, 5) + 0.22 * (grain - 0.5) + 0.14 * (fractal(u, v, 3, 3, 21) - 0.5);
    let tint = mix([0.80, 0.70, 0.56], [0.78, 0.64, 0.47], hash(column, row, 9));
    let color = mix([0.42, 0.36, 0.29], scaled(tint, shade), joint);
    Texel::new(color, joint * 0.006 + grain * 0.004, 0.88 - 0.1 * grain)
}

/// Smooth carved stone for mouldings and arches.
fn trim(u: f32, v: f32) -> Texel {
    let grain = fractal(u, v, 8, 5, 31);
    let stain = fractal(u, v, 2, 3, 35);
    let color = scaled([0.88, 0.82, 0.71], 0.84 + 0.18 * grain + 0.08 * stain);
    Texel::new(color, grain * 0.003, 0.75)
}

fn plaster(u: f32, v: f32) -> Texel {
    let grain = fractal(u, v, 12, 4, 41);
    let patches = smoothstep(0.35, 0.7, fractal(u, v, 3, 4, 45));
    let color = scaled(mix([0.86, 0.70, 0.50], [0.82, 0.62, 0.41], patches), 0.92 + 0.12 * grain);
    Texel::new(color, grain * 0.004, 0.92)
}

/// Pale polished marble with warped grey veins.
fn marble(u: f32, v: f32) -> Texel {
    let warp = fractal(u, v, 3, 5, 51) * 1.6;
    let turns = |shift: f32| ((u + v) * 2.0 + warp * 2.0 + shift) * std::f32::consts::TAU;
    let vein = (1.0 - (turns(0.0) * 0.5).sin().abs()).powi(6) + 0.5 * (1.0 - (turns(0.31)).sin().abs()).powi(10);
    let cloud = fractal(u, v, 4, 4, 57);
    let color = mix(scaled([0.91, 0.87, 0.81], 0.9 + 0.14 * cloud), [0.52, 0.46, 0.42], (vein * 0.75).min(1.0));
    Texel::new(color, 0.0, 0.28 + 0.2 * cloud)
}

/// Squares of light and dark marble set on the diagonal within bands, worn unevenly; roughness is where feet have been.
fn floor(u: f32, v: f32) -> Texel {
    let (x, y) = ((u * 2.0).fract() - 0.5, (v * 2.0).fract() - 0.5);
    let diamond = x.abs() + y.abs();
    let cell = ((u * 2.0) as i32, (v * 2.0) as i32);
    let seam = (diamond - 0.5).abs().min((0.5 - x.abs()).min(0.5 - y.abs()));
    let joint = smoothstep(0.004, 0.016, seam);
    let warp = fractal(u, v, 4, 5, 61);
    let vein = (1.0 - ((u * 3.0 + v * 2.0 + warp * 2.5) * std::f32::consts::TAU).sin().abs()).powi(8);
    let inside = diamond < 0.5;
    let stone = match (inside, (cell.0 + cell.1) % 2) {
        (true, 0) => mix([0.47, 0.17, 0.12], [0.66, 0.42, 0.34], vein * 0.8),
        (true, _) => mix([0.20, 0.24, 0.22], [0.46, 0.50, 0.46], vein * 0.7),
        _ => mix([0.84, 0.78, 0.68], [0.62, 0.55, 0.46], vein * 0.6),
    };
    let color = mix([0.30, 0.26, 0.22], scaled(stone, 0.86 + 0.2 * fractal(u, v, 16, 3, 67)), joint);
    let worn = smoothstep(0.3, 0.75, fractal(u, v, 3, 4, 71));
    Texel::new(color, joint * 0.0025, if joint < 0.5 { 0.8 } else { 0.16 + 0.3 * worn })
}

/// A Greek key in relief, two to the metre.
fn frieze(u: f32, v: f32) -> Texel {
    const KEY: [&[u8; 8]; 8] =
        [b"########", b"........", b"#######.", b"#.....#.", b"#.###.#.", b"#.#...#.", b"#.#####.", b"#......."];
    let grain = fractal(u, v, 8, 4, 81);
    let (x, y) = ((u * 16.0) as usize % 8, ((v - 0.25) * 16.0).floor() as i32);
    let raised = (0..8).contains(&y) && KEY[y as usize][x] == b'#';
    let band = !(0.2..0.8).contains(&v);
    let height = if raised || band { 0.012 } else { 0.0 };
    let color = scaled(if raised { [0.90, 0.82, 0.66] } else { [0.76, 0.66, 0.52] }, 0.86 + 0.2 * grain);
    Texel::new(color, height + grain * 0.003, 0.72)
}

fn roof(u: f32, v: f32) -> Texel {
    let (_, column, row) = bricks(u, v, 6, 4);
    let bulge = ((u * 6.0 + if row % 2 == 1 { 0.5 } else { 0.0 }).fract() * std::f32::consts::PI).sin();
    let color = scaled([0.66, 0.32, 0.20], 0.7 + 0.3 * hash(column, row, 91) + 0.15 * bulge);
    Texel::new(color, bulge * 0.03 + (v * 4.0).fract() * 0.02, 0.85)
}

fn wood(u: f32, v: f32) -> Texel {
    let plank = (u * 4.0).floor();
    let edge = (u * 4.0).fract().min(1.0 - (u * 4.0).fract());
    let grain = noise(u, v, 64, 95) * 0.4 + noise(u * 8.0, v * 0.5, 16, 97) * 0.6;
    let color = scaled([0.42, 0.26, 0.15], 0.7 + 0.25 * hash(plank as i32, 0, 99) + 0.25 * grain);
    let groove = smoothstep(0.02, 0.08, edge);
    Texel::new(scaled(color, 0.4 + 0.6 * groove), groove * 0.01 + grain * 0.002, 0.6)
}

/// Woven cloth with a gold border along the image's left and right and a gold lozenge pattern.
fn fabric(u: f32, v: f32, color: [f32; 3]) -> Texel {
    let weave = ((u * 128.0 * std::f32::consts::TAU).sin() * (v * 128.0 * std::f32::consts::TAU).sin()) * 0.5 + 0.5;
    let border = u.min(1.0 - u);
    let (x, y) = ((u * 4.0).fract() - 0.5, (v * 4.0).fract() - 0.5);
    let lozenge = x.abs() + y.abs();
    let is_gold = (0.03..0.055).contains(&border)
        || (0.07..0.08).contains(&border)
        || (border > 0.1 && ((0.2..0.24).contains(&lozenge) || lozenge < 0.08));
    let cloth = scaled(color, 0.78 + 0.22 * weave + 0.2 * (fractal(u, v, 4, 3, 101) - 0.5));
    if is_gold {
        let thread = scaled([0.80, 0.60, 0.26], 0.75 + 0.25 * weave);
        return Texel { metallic: 0.6, ..Texel::new(thread, 0.002 + weave * 0.001, 0.45) };
    }
    Texel::new(cloth, weave * 0.0012, 0.85)
}

fn terracotta(u: f32, v: f32) -> Texel {
    let grain = fractal(u, v, 8, 4, 111);
    let rings = (v * 40.0 * std::f32::consts::TAU).sin() * 0.5 + 0.5;
    Texel::new(scaled([0.70, 0.40, 0.26], 0.8 + 0.3 * grain), grain * 0.003 + rings * 0.0008, 0.8)
}

/// Leaves in a jittered lattice, each a pointed oval with a midrib; the gaps between them are cut out. Sparser to the bottom.
fn ivy(u: f32, v: f32) -> Texel {
    const CELLS: i32 = 9;
    let mut best: Option<(f32, [f32; 3], f32)> = None;
    for layer in 0..2u32 {
        let (x, y) = (u * CELLS as f32 + layer as f32 * 0.5, v * CELLS as f32 + layer as f32 * 0.37);
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            let (cell_x, cell_y) = (x.floor() as i32 + dx, y.floor() as i32 + dy);
            let (key_x, key_y) = (cell_x.rem_euclid(CELLS), cell_y.rem_euclid(CELLS));
            let random = |seed: u32| hash(key_x, key_y, 120 + layer * 16 + seed);
            if random(0) < 0.10 + 0.55 * smoothstep(0.35, 1.0, key_y as f32 / CELLS as f32) {
                continue;
            }
            let (to_x, to_y) = (x - cell_x as f32 - random(1), y - cell_y as f32 - random(2));
            let (sin, cos) = ((random(3) - 0.5) * 2.4).sin_cos();
            let (along, across) = (to_y * cos + to_x * sin, to_x * cos - to_y * sin);
            // Half a width of 0.36 at the stalk's end, drawn in to a point.
            let width = 0.36 * (1.0 - (along / 0.62).powi(2)).max(0.0) * (1.0 - 0.45 * along);
            if along.abs() < 0.62 && across.abs() < width {
                let rib = smoothstep(0.0, 0.05, across.abs());
                let green = mix([0.16, 0.34, 0.08], [0.34, 0.50, 0.14], random(4));
                let order = layer as f32 + random(5);
                if best.is_none_or(|(top, ..)| order > top) {
                    best = Some((order, scaled(green, 0.72 + 0.28 * rib), rib * (1.0 - across.abs() / 0.4)));
                }
            }
        }
    }
    match best {
        Some((order, color, height)) => Texel::new(color, height * 0.006 + order * 0.004, 0.55),
        None => Texel { alpha: 0.0, ..Texel::new([0.2, 0.36, 0.1], 0.0, 0.55) },
    }
}

/// Wrought iron: a rail above and below, bars, and a ring in each field.
fn lattice(u: f32, v: f32) -> Texel {
    let (x, y) = ((u * 8.0).fract() - 0.5, (v - 0.5) * 4.0);
    let bar = (0.5 - x.abs()) < 0.07;
    let rail = !(0.05..=0.95).contains(&v) || (0.22..0.26).contains(&v) || (0.74..0.78).contains(&v);
    let radius = x.hypot(y);
    let is_iron = bar || rail || (0.30..0.41).contains(&radius) || radius < 0.1;
    Texel {
        alpha: if is_iron { 1.0 } else { 0.0 },
        metallic: 1.0,
        ..Texel::new([0.33, 0.31, 0.29], if is_iron { 0.004 } else { 0.0 }, 0.5)
    }
}
