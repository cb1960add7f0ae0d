//! The harbour of `assets/harbour`: everything that lies in it is made here, out of formulas. The same numbers make the same bytes.

mod boats;
mod glb;
mod houses;
mod model;
mod moving;
mod paint;
mod shore;
mod things;

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};
use serde_json::json;

use glb::{Glb, NodeChannel, Target};
use houses::House;
use model::{Dice, Model, at, colour, turned};
use moving::Clips;
use shore::{LANDING, LIGHT, PIER, PIER_DECK, QUAY, land};

/// The files of `assets/harbour`: the harbour, and its surroundings, which need to cast no shadows.
pub fn files() -> [(&'static str, Vec<u8>); 2] {
    std::thread::scope(|scope| {
        let around = scope.spawn(surroundings);
        [("harbour.glb", harbour()), ("surroundings.glb", around.join().expect("the surroundings"))]
    })
}

fn harbour() -> Vec<u8> {
    let mut file = Glb::default();
    file.pictures(&paint::of_the_harbour());
    materials(&mut file);
    put_shore(&mut file);
    put_houses(&mut file);
    put_things(&mut file);
    put_trees(&mut file);
    let mut clips = Clips::default();
    moving::put_boats(&mut file, &mut clips);
    moving::put_flags(&mut file, &mut clips);
    moving::put_machines(&mut file, &mut clips);
    moving::put_gulls(&mut file, &mut clips);
    for (name, channels) in clips.0 {
        file.clip(name, channels);
    }
    file.finish("harbour")
}

fn surroundings() -> Vec<u8> {
    let mut file = Glb::default();
    file.pictures(&paint::of_the_surroundings());
    let (ground, normals, ripples) =
        (file.texture("ground"), file.texture("ground normals"), file.texture("water normals"));
    for name in ["ground", "scrub"] {
        file.material(
            name,
            json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": ground}, "metallicFactor": 0.0, "roughnessFactor": 0.95},
                "normalTexture": {"index": normals}}),
        );
    }
    file.material(
        "water",
        json!({
            "pbrMetallicRoughness": {"baseColorFactor": [0.004, 0.02, 0.024, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.1},
            "normalTexture": {"index": ripples, "scale": 0.075, "extensions": {"KHR_texture_transform": {"offset": [0.0, 0.0]}}},
            "extensions": {"KHR_materials_ior": {"ior": 1.33}},
        }),
    );
    put(&mut file, "sea", &shore::sea(), DAffine3::IDENTITY);
    put(&mut file, "hills", &shore::hills(), DAffine3::IDENTITY);
    put_scrub(&mut file);
    // The ripples run with the wind: after so many seconds they have moved by a whole image.
    let pointer =
        format!("/materials/{}/normalTexture/extensions/KHR_texture_transform/offset", file.material_number("water"));
    file.clip(
        "ripples",
        vec![NodeChannel {
            target: Target::Pointer(pointer),
            times: vec![0.0, 30.0],
            values: vec![0.0, 0.0, 1.0, 1.0],
        }],
    );
    file.finish("surroundings")
}

fn materials(file: &mut Glb) {
    let mut textured = |name: &str, base: [f64; 3], roughness: f64, normal_scale: f64| {
        let (colour, normals) = (file.texture(name), file.texture(&format!("{name} normals")));
        file.material(
            name,
            json!({
                "pbrMetallicRoughness": {"baseColorFactor": [base[0], base[1], base[2], 1.0], "baseColorTexture": {"index": colour},
                    "metallicFactor": 0.0, "roughnessFactor": roughness},
                "normalTexture": {"index": normals, "scale": normal_scale},
            }),
        );
    };
    textured("stone", [1.0; 3], 0.85, 1.0);
    textured("cobble", [1.0; 3], 0.7, 1.0);
    textured("plaster", [1.0; 3], 0.9, 1.0);
    textured("roof", [1.0; 3], 0.8, 1.0);
    textured("wood", [1.0; 3], 0.75, 1.0);
    textured("brick", [1.0; 3], 0.88, 1.0);
    textured("rock", [1.0; 3], 0.8, 1.0);
    let mut plain = |name: &str, metallic: f64, roughness: f64| {
        file.material(
            name,
            json!({"pbrMetallicRoughness": {"metallicFactor": metallic, "roughnessFactor": roughness}}),
        );
    };
    plain("paint", 0.0, 0.4);
    plain("iron", 0.9, 0.5);
    plain("gold", 1.0, 0.3);
    plain("rope", 0.0, 0.9);
    plain("cloth", 0.0, 0.9);
    plain("feather", 0.0, 0.7);
    let leaves = file.texture("leaves");
    file.material(
        "leaves",
        json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": leaves}, "metallicFactor": 0.0, "roughnessFactor": 0.7},
            "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": true}),
    );
    let pane = json!({"baseColorFactor": [0.012, 0.016, 0.02, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.08});
    file.material("pane", json!({"pbrMetallicRoughness": pane}));
    file.material(
        "pane, lit",
        json!({"pbrMetallicRoughness": pane, "emissiveFactor": [1.0, 0.6, 0.25],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 25.0}}}),
    );
    file.material(
        "coals",
        json!({"pbrMetallicRoughness": {"baseColorFactor": [0.02, 0.02, 0.02, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9},
            "emissiveFactor": [1.0, 0.22, 0.04], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 900.0}}}),
    );
    file.material("glow", json!({"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5}, "emissiveFactor": [1.0, 0.72, 0.4],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 600.0}}}));
}

fn put(file: &mut Glb, name: &str, model: &Model, place: DAffine3) -> usize {
    let mesh = file.mesh(name, model, &[]);
    file.put(mesh, None, place)
}

fn put_shore(file: &mut Glb) {
    let still = DAffine3::IDENTITY;
    put(file, "quay", &shore::quay(), still);
    put(file, "mole", &shore::mole(), still);
    put(file, "pier", &shore::pier(), still);
    put(file, "landing", &shore::landing(), still);
    let kinds = 6;
    for (kind, places) in shore::boulders(kinds).iter().enumerate() {
        let mesh = file.mesh(&format!("boulder {kind}"), &shore::boulder(kind as u64), &[]);
        file.scatter(mesh, places);
    }
    put(file, "lighthouse", &houses::lighthouse(), at(LIGHT.x, LIGHT.y, LIGHT.z));
}

fn put_houses(file: &mut Glb) {
    let plain = |wall: u32| House {
        width: 8.0,
        depth: 8.5,
        height: 6.2,
        rise: 3.2,
        gable: false,
        wall: ("plaster", colour(wall)),
        trim: colour(0xf2efe6),
        shutters: None,
        storeys: 2,
        bays: 3,
        door: 1,
        awning: None,
        balcony: false,
        roof: DVec3::ONE,
        chimney: 0.6,
        lit: 3,
    };
    let row = [
        (-37.5, House { width: 9.0, shutters: Some(colour(0x4a6a5a)), door: 0, ..plain(0xe6d0a4) }),
        (
            -28.4,
            House {
                width: 7.6,
                height: 8.8,
                storeys: 3,
                gable: true,
                shutters: Some(colour(0x34566e)),
                lit: 4,
                ..plain(0xf0eae0)
            },
        ),
        (
            -19.2,
            House { width: 9.4, bays: 4, door: 2, awning: Some(colour(0xa83a30)), chimney: -0.55, ..plain(0xd89a5c) },
        ),
        (
            -10.3,
            House {
                width: 7.2,
                height: 9.2,
                rise: 3.6,
                storeys: 3,
                gable: true,
                shutters: Some(colour(0x5c7a4a)),
                balcony: true,
                lit: 4,
                ..plain(0xb4604c)
            },
        ),
        (
            0.2,
            House {
                width: 8.2,
                height: 6.6,
                shutters: Some(colour(0xf0ece0)),
                door: 0,
                chimney: -0.7,
                ..plain(0x8ab0c4)
            },
        ),
        (
            8.6,
            House {
                width: 7.4,
                height: 7.4,
                rise: 4.0,
                gable: true,
                wall: ("brick", DVec3::ONE),
                trim: colour(0xe8e2d4),
                shutters: Some(colour(0x2c4a3c)),
                ..plain(0xffffff)
            },
        ),
        (
            17.9,
            House {
                width: 9.2,
                bays: 4,
                door: 3,
                awning: Some(colour(0x2c5c7c)),
                chimney: 0.4,
                roof: colour(0xe8d8d0),
                ..plain(0xf2e2b8)
            },
        ),
        (
            26.2,
            House {
                width: 5.6,
                height: 3.6,
                rise: 2.4,
                storeys: 1,
                bays: 3,
                gable: true,
                depth: 6.5,
                chimney: -0.5,
                ..plain(0xf0ece4)
            },
        ),
    ];
    let mut meshes = Vec::new();
    for (i, (x, house)) in row.iter().enumerate() {
        let mesh = file.mesh(&format!("house {i}"), &house.build(), &[]);
        meshes.push(mesh);
        file.put(mesh, None, at(*x, QUAY + 0.05, -9.3));
    }
    // Up the hill stand the same again, turned this way and that.
    let mut dice = Dice::new(12);
    let hill = [
        (-44.0, -27.0, 1),
        (-33.0, -30.0, 4),
        (-24.0, -26.5, 0),
        (-13.5, -31.0, 4),
        (-4.6, -27.5, 6),
        (5.5, -30.0, 3),
        (14.0, -27.0, 4),
        (24.0, -29.0, 0),
        (-51.0, -43.0, 6),
        (-39.0, -46.0, 4),
        (-28.0, -42.0, 5),
        (8.0, -46.0, 0),
        (18.5, -43.0, 4),
        (29.0, -47.0, 1),
        (-20.0, -60.0, 4),
        (-45.0, -63.0, 0),
        (13.0, -63.0, 6),
        (36.0, -64.0, 4),
        (-66.0, -34.0, 4),
        (-62.0, -56.0, 6),
    ];
    for (x, z, which) in hill {
        let y = (-4..=4).map(|i| land(x + f64::from(i), z - 4.0)).fold(f64::INFINITY, f64::min).min(land(x, z));
        file.put(meshes[which], None, turned(x, y - 0.3, z, dice.between(-24.0, 24.0)));
    }
    let church = file.mesh("church", &houses::church(), &[]);
    file.put(church, None, at(CHURCH.x, CHURCH.y, CHURCH.z));
}

const CHURCH: DVec3 = DVec3::new(-6.0, 8.2, -50.0);

/// Hands are warmed here when the boats come in.
const BRAZIER: DVec3 = DVec3::new(6.6, QUAY, -3.4);

fn put_things(file: &mut Glb) {
    let mut dice = Dice::new(5);
    let lamp = file.mesh("lamp post", &things::lamp_post(), &[]);
    let bollard = file.mesh("bollard", &things::bollard(), &[]);
    let bench = file.mesh("bench", &things::bench(), &[]);
    let light = |name: String| json!({"name": name, "type": "point", "color": [1.0, 0.68, 0.36], "intensity": 320.0, "range": 18.0});
    let mut lamps: Vec<DVec3> =
        [-32.0, -23.5, -14.7, -5.0, 4.6, 13.0, 22.8].map(|x| DVec3::new(x, QUAY, -6.6)).to_vec();
    lamps.push(DVec3::new(LANDING.x - 0.9, QUAY, LANDING.z + 1.0));
    lamps.push(DVec3::new(PIER.0 - 1.35, PIER_DECK, PIER.1 - 1.2));
    for (i, place) in lamps.iter().enumerate() {
        file.put(lamp, None, at(place.x, place.y, place.z));
        file.light(None, at(place.x, place.y + things::LAMP, place.z), light(format!("lamp {i}")));
    }
    for x in [-34.0, -27.0, -20.5, -12.5, -4.0, 1.0, 9.5, 20.0, 27.5] {
        file.put(bollard, None, at(x, QUAY, -0.9));
    }
    file.put(bollard, None, at(LANDING.x - 0.6, QUAY, LANDING.z + 2.6));
    for (x, turn) in [(-27.8, 0.0), (-0.2, 0.0), (9.0, 0.0), (25.9, 0.0)] {
        file.put(bench, None, turned(x, QUAY + 0.1, -8.5, turn));
    }
    put(file, "brazier", &things::brazier(), at(BRAZIER.x, BRAZIER.y, BRAZIER.z));
    let fire = json!({"name": "fire", "type": "point", "color": [1.0, 0.4, 0.12], "intensity": 90.0, "range": 10.0});
    file.light(None, at(BRAZIER.x, BRAZIER.y + things::COALS + 0.35, BRAZIER.z), fire);
    // Heaps: crates, barrels, ropes and lobster pots.
    let mut heap = Model::new();
    let wood = [0xd8b080, 0xc49c6c, 0xa88860, 0xb8a488].map(colour);
    for (x, z, kind, lift) in [
        (-17.8, -3.6, 0, 0.0),
        (-16.6, -3.3, 1, 0.0),
        (-17.2, -3.5, 0, 1.0),
        (-17.9, -2.2, 2, 0.0),
        (-16.4, -2.0, 0, 0.0),
        (-18.9, -2.9, 3, 0.0),
        (-8.6, -2.6, 3, 0.0),
        (-7.8, -2.9, 3, 0.0),
        (-8.1, -2.0, 3, 0.0),
        (-6.9, -2.2, 2, 0.0),
        (3.6, -3.0, 1, 0.0),
        (2.4, -2.6, 4, 0.0),
        (2.2, -3.3, 4, 0.0),
        (2.4, -2.9, 4, 0.45),
        (4.7, -2.6, 3, 0.0),
        (17.6, -3.0, 0, 0.0),
        (18.8, -2.8, 0, 0.0),
        (18.2, -2.9, 1, 0.95),
        (19.9, -3.2, 3, 0.0),
        (17.2, -1.8, 5, 0.0),
        (10.9, -1.6, 5, 0.0),
        (24.6, -2.6, 4, 0.0),
        (24.5, -2.0, 4, 0.0),
        (24.6, -2.3, 4, 0.45),
        (25.4, -2.4, 4, 0.0),
        (-24.5, -2.2, 5, 0.0),
        (-25.6, -2.6, 3, 0.0),
    ] {
        let tint = wood[(dice.next() * 3.99) as usize];
        heap.within(turned(x, QUAY + lift - 0.015, z, dice.between(-35.0, 35.0)), |heap| match kind {
            0 => things::crate_of(heap, DVec3::new(1.05, 0.95, 0.95), tint),
            1 => things::crate_of(heap, DVec3::new(0.8, 0.6, 0.7), tint),
            2 => things::crate_of(heap, DVec3::new(0.9, 0.35, 0.6), tint),
            3 => things::barrel(heap, tint),
            4 => things::pot(heap),
            _ => things::coil(heap),
        });
    }
    for (z, kind, side) in [
        (16.9, 0, 0.75),
        (15.7, 1, 0.9),
        (17.9, 3, 0.95),
        (9.3, 3, -0.95),
        (4.6, 2, 0.9),
        (12.4, 4, -0.9),
        (12.9, 4, -0.85),
        (7.4, 5, 0.8),
    ] {
        let tint = wood[(dice.next() * 3.99) as usize];
        heap.within(turned(PIER.0 + side, PIER_DECK - 0.01, z, dice.between(-25.0, 25.0)), |heap| match kind {
            0 => things::crate_of(heap, DVec3::new(0.95, 0.85, 0.9), tint),
            1 => things::crate_of(heap, DVec3::new(0.7, 0.5, 0.6), tint),
            2 => things::crate_of(heap, DVec3::new(0.8, 0.35, 0.55), tint),
            3 => things::barrel(heap, tint),
            4 => things::pot(heap),
            _ => things::coil(heap),
        });
    }
    for (x, z, kind, turn) in
        [(-2.6, 1.1, 4, 20.0), (-3.2, 1.7, 4, -10.0), (-2.8, 1.4, 6, 40.0), (-0.9, 2.4, 5, 0.0), (-4.3, 1.3, 3, 0.0)]
    {
        heap.within(turned(LANDING.x + x, QUAY + if kind == 6 { 0.43 } else { 0.0 }, LANDING.z + z, turn), |heap| {
            match kind {
                3 => things::barrel(heap, wood[1]),
                5 => things::coil(heap),
                _ => things::pot(heap),
            }
        });
    }
    // Nets hang over a rail to dry.
    heap.within(at(-29.0, QUAY, -3.2), |heap| {
        heap.tint = colour(0x9a8468);
        for x in [-2.0, 0.0, 2.0] {
            heap.tube("wood", &[DVec3::new(x, 0.0, 0.0), DVec3::new(x, 1.5, 0.0)], (0.06, 0.05), 7);
        }
        heap.tube("wood", &[DVec3::new(-2.3, 1.5, 0.0), DVec3::new(2.3, 1.5, 0.0)], (0.05, 0.05), 7);
        for side in [1.0, -1.0] {
            heap.sheet("cloth", (18, 6), |u, v| {
                let x = side * (u - 0.5) * 3.8;
                let sag = 0.1 * (u * 19.0).sin() * (1.0 - v);
                (
                    DVec3::new(
                        x,
                        0.35 + 1.2 * v + 0.12 * (u * 7.0).sin() * (1.0 - v),
                        side * (0.06 + 0.28 * (1.0 - v) + sag),
                    ),
                    colour(0x3c7a86) * (0.7 + 0.3 * (u * 40.0).sin().abs()),
                )
            });
        }
    });
    // Pots of flowers by the doors.
    for (x, kind) in [(-38.0, 0), (-26.9, 1), (-12.2, 2), (-8.4, 0), (-0.8, 1), (6.8, 2), (10.4, 0), (24.6, 1)] {
        heap.within(at(x, QUAY + 0.24, -8.7), |heap| houses::flowers(heap, DVec3::ZERO, kind));
    }
    put(file, "goods", &heap, DAffine3::IDENTITY);
}

fn put_trees(file: &mut Glb) {
    let trees = [file.mesh("tree 0", &things::tree(6.4, 31), &[]), file.mesh("tree 1", &things::tree(7.4, 77), &[])];
    for (x, z, kind, turn) in [
        (-33.0, -13.0, 1, 0.0),
        (-5.0, -13.4, 0, 70.0),
        (13.1, -14.5, 1, 200.0),
        (22.9, -13.8, 0, 140.0),
        (31.0, -20.0, 1, 30.0),
        (-23.6, -17.0, 0, 10.0),
        (-14.6, -19.5, 1, 300.0),
        (4.6, -19.0, 1, 250.0),
        (37.0, -27.0, 0, 90.0),
    ] {
        file.put(trees[kind], None, turned(x, land(x, z).max(QUAY - 0.1) - 0.1, z, turn));
    }
}

/// Bushes, oaks and cypresses on the hills.
fn put_scrub(file: &mut Glb) {
    let kinds = [
        file.mesh("bush", &things::bush(0.8, 1, colour(0x3c4a24), colour(0x8a8c48)), &[]),
        file.mesh("oak", &things::bush(1.1, 2, colour(0x34431f), colour(0x72803c)), &[]),
        file.mesh("cypress", &things::bush(3.4, 3, colour(0x26331c), colour(0x4c5c30)), &[]),
    ];
    let mut dice = Dice::new(21);
    let mut places: [Vec<(DVec3, f64, f64)>; 3] = Default::default();
    while places.iter().map(Vec::len).sum::<usize>() < 480 {
        let (x, z) = (dice.between(-300.0, 190.0), -22.0 - 330.0 * dice.next().powf(1.5));
        let (wood, luck) = (paint::wide_clouds(DVec2::new(x / 32.0 + 300.0, z / 32.0 + 300.0), 4, 51), dice.next());
        let y = land(x, z);
        // Not in the village, and not in the sea.
        let village = (-60.0..40.0).contains(&x) && z > -72.0;
        if y < 1.6 || (village && luck > 0.10) || (!village && wood < 0.5 && luck > 0.07) {
            continue;
        }
        let near_church = DVec2::new(x - CHURCH.x, z - CHURCH.z + 6.0).length() < 16.0;
        if near_church {
            continue;
        }
        let kind = if luck < 0.03 {
            2
        } else if luck < 0.5 {
            0
        } else {
            1
        };
        let size = [dice.between(0.9, 2.2), dice.between(2.4, 4.4), dice.between(1.0, 1.7)][kind]
            * if village { 0.7 } else { 1.0 };
        places[kind].push((DVec3::new(x, y - 0.2, z), dice.between(0.0, TAU), size));
    }
    for (kind, list) in kinds.into_iter().zip(&places) {
        file.scatter(kind, list);
    }
}
