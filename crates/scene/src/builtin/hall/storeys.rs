//! The hall's architecture: floor, arcades, gallery, roof and end walls.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DVec3};

use super::masonry::{Arch, Column, band, face};
use super::{AISLE, BAY, EAVES, GALLERY, Hall, LOWER_SPRINGING, NAVE_HALF, UPPER_FLOOR, UPPER_SPRINGING, WALL_HALF};
use crate::builtin::shapes::{MeshBuilder, cuboid};
use crate::builtin::stage::turned;

/// The lower arcade's arch, one a bay.
const LOWER: Arch =
    Arch { width: BAY, radius: 1.36, springing: LOWER_SPRINGING, top: GALLERY, thickness: WALL_HALF * 2.0 };
/// The gallery's, two a bay.
const UPPER: Arch = Arch { width: BAY * 0.5, radius: 0.68, springing: UPPER_SPRINGING, top: EAVES, thickness: 0.5 };
/// Across the aisle from each column.
const TRANSVERSE: Arch =
    Arch { width: AISLE - WALL_HALF, radius: 1.3, springing: LOWER_SPRINGING, top: 5.75, thickness: 0.5 };
/// The portal in each end wall.
const PORTAL: Arch = Arch { width: NAVE_HALF * 2.0, radius: 2.1, springing: 3.0, top: GALLERY, thickness: 0.7 };

pub(super) fn build(hall: &mut Hall) {
    floors(hall);
    arcade(hall);
    gallery(hall);
    aisles(hall);
    roof(hall);
    ends(hall);
    shell(hall);
}

fn floors(hall: &mut Hall) {
    let floor = hall.surfaces.floor;
    let mut tiles = MeshBuilder::new();
    let (x, z) = (BAY * 0.5, NAVE_HALF + AISLE);
    tiles.quad_metric([(-x, z), (x, z), (x, -z), (-x, -z)].map(|(x, z)| DVec3::new(x, 0.0, z)));
    let mesh = hall.stage.mesh("floor", tiles.scale_uvs(1.0 / 1.8), floor);
    for (index, frame) in hall.bay_frames() {
        // One side's frames do: the floor runs from wall to wall.
        if index < hall.bays && frame.translation.z < 0.0 {
            hall.stage.place(mesh, floor, turned(0.0, frame.translation.x, 0.0, 0.0));
        }
    }
}

fn arcade(hall: &mut Hall) {
    let (stone, trim, marble, frieze) =
        (hall.surfaces.stone, hall.surfaces.trim, hall.surfaces.marble, hall.surfaces.frieze);
    let bays = hall.bay_frames();
    let piers = hall.pier_frames();
    let wall = hall.stage.mesh("arch", LOWER.wall().scale_uvs(0.5), stone);
    hall.place_all(wall, stone, &bays);
    let archivolt = hall.stage.mesh("archivolt", LOWER.archivolt(), trim);
    hall.place_all(archivolt, trim, &bays);
    // A keystone, and the course that carries the gallery.
    let mut courses = MeshBuilder::new();
    courses.at(&cuboid([0.3, 0.52, 0.2]), 0.0, LOWER.springing + LOWER.radius + 0.2, WALL_HALF + 0.06);
    let section = [
        (GALLERY, 0.35),
        (GALLERY, 0.42),
        (GALLERY + 0.07, 0.42),
        (GALLERY + 0.12, 0.5),
        (GALLERY + 0.2, 0.5),
        (GALLERY + 0.24, 0.56),
        (UPPER_FLOOR, 0.56),
        (UPPER_FLOOR, 0.1),
    ];
    courses.append(&band(BAY, &section), &DAffine3::IDENTITY);
    courses.append(&band(BAY, &[(5.44, 0.35), (5.44, 0.4), (5.5, 0.4), (5.5, 0.35)]), &DAffine3::IDENTITY);
    let courses = hall.stage.mesh("string course", courses, trim);
    hall.place_all(courses, trim, &bays);
    let key = band(BAY, &[(5.5, 0.37), (GALLERY, 0.37)]).scale_uvs(2.0);
    let key = hall.stage.mesh("frieze", key, frieze);
    hall.place_all(key, frieze, &bays);
    let column = Column { height: LOWER_SPRINGING, radius: 0.33, segments: hall.segments };
    let shaft = hall.stage.mesh("lower shaft", column.shaft().scale_uvs(0.6), marble);
    hall.place_all(shaft, marble, &piers);
    let mouldings = hall.stage.mesh("lower base and capital", column.mouldings(), trim);
    hall.place_all(mouldings, trim, &piers);
}

fn gallery(hall: &mut Hall) {
    let (trim, plaster, marble, stone) =
        (hall.surfaces.trim, hall.surfaces.plaster, hall.surfaces.marble, hall.surfaces.stone);
    let bays = hall.bay_frames();
    let piers = hall.pier_frames();
    let (mut wall, mut mouldings) = (MeshBuilder::new(), MeshBuilder::new());
    for x in [-BAY * 0.25, BAY * 0.25] {
        wall.at(&UPPER.wall(), x, 0.0, 0.0);
        mouldings.at(&UPPER.archivolt(), x, 0.0, 0.0);
    }
    let wall = hall.stage.mesh("upper arches", wall, plaster);
    hall.place_all(wall, plaster, &bays);
    let eaves = [
        (9.72, 0.25),
        (9.72, 0.31),
        (9.82, 0.31),
        (9.9, 0.4),
        (EAVES, 0.42),
        (EAVES + 0.06, 0.55),
        (EAVES + 0.2, 0.58),
        (EAVES + 0.25, 0.7),
        (EAVES + 0.4, 0.74),
        (EAVES + 0.4, 0.0),
    ];
    mouldings.append(&band(BAY, &eaves), &DAffine3::IDENTITY);
    for index in 0..9 {
        let x = (f64::from(index) + 0.5) * BAY / 9.0 - BAY * 0.5;
        mouldings.at(&cuboid([0.16, 0.14, 0.22]), x, EAVES - 0.02, 0.42);
    }
    let mouldings = hall.stage.mesh("cornice", mouldings, trim);
    hall.place_all(mouldings, trim, &bays);
    let height = UPPER_SPRINGING - UPPER_FLOOR;
    let segments = hall.segments.div_ceil(2).max(6);
    let thick = Column { height, radius: 0.17, segments };
    let thin = Column { height, radius: 0.13, segments };
    for (name, column, frames) in [("pier column", thick, &piers), ("bay column", thin, &bays)] {
        let mut shaft = MeshBuilder::new();
        shaft.at(&column.shaft(), 0.0, UPPER_FLOOR, 0.0);
        let shaft = hall.stage.mesh(&format!("{name} shaft"), shaft, marble);
        hall.place_all(shaft, marble, frames);
        let mut ends = MeshBuilder::new();
        ends.at(&column.mouldings(), 0.0, UPPER_FLOOR, 0.0);
        let ends = hall.stage.mesh(&format!("{name} base and capital"), ends, trim);
        hall.place_all(ends, trim, frames);
    }
    let mut floor = MeshBuilder::new();
    let x = BAY * 0.5;
    floor.quad_metric([(-x, 0.1), (x, 0.1), (x, -AISLE), (-x, -AISLE)].map(|(x, z)| DVec3::new(x, UPPER_FLOOR, z)));
    let floor = hall.stage.mesh("gallery floor", floor.scale_uvs(0.5), stone);
    hall.place_all(floor, stone, &bays);
}

fn aisles(hall: &mut Hall) {
    let (trim, plaster, stone, wood) =
        (hall.surfaces.trim, hall.surfaces.plaster, hall.surfaces.stone, hall.surfaces.wood);
    let bays = hall.bay_frames();
    let piers = hall.pier_frames();
    let x = BAY * 0.5;
    let mut walls = face([-x, 1.1], [x, 5.75], -AISLE);
    walls.append(&face([-x, UPPER_FLOOR], [x, EAVES], -AISLE), &DAffine3::IDENTITY);
    let walls = hall.stage.mesh("outer wall", walls, plaster);
    hall.place_all(walls, plaster, &bays);
    let dado = face([-x, 0.0], [x, 1.1], -AISLE + 0.08).scale_uvs(0.5);
    let dado = hall.stage.mesh("dado", dado, stone);
    hall.place_all(dado, stone, &bays);
    let rail = [(1.04, 0.08), (1.04, 0.14), (1.14, 0.14), (1.14, 0.0)].map(|(y, z)| (y, z - AISLE));
    let skirting = [(0.0, 0.13), (0.2, 0.13), (0.24, 0.08)].map(|(y, z)| (y, z - AISLE));
    let mut mouldings = band(BAY, &rail);
    mouldings.append(&band(BAY, &skirting), &DAffine3::IDENTITY);
    let mouldings = hall.stage.mesh("rail", mouldings, trim);
    hall.place_all(mouldings, trim, &bays);
    let mut beams = MeshBuilder::new();
    for (y, from, to) in [(5.75, -AISLE, -WALL_HALF), (EAVES, -AISLE, -0.25)] {
        beams.quad_metric([(-x, from), (x, from), (x, to), (-x, to)].map(|(x, z)| DVec3::new(x, y, z)));
        for index in 0..4 {
            let x = (f64::from(index) + 0.5) * BAY / 4.0 - BAY * 0.5;
            beams.at(&cuboid([0.16, 0.2, to - from]), x, y - 0.1, (from + to) * 0.5);
        }
    }
    let beams = hall.stage.mesh("ceiling", beams.scale_uvs(0.7), wood);
    hall.place_all(beams, wood, &bays);
    let across = DAffine3::from_rotation_translation(
        glam::DQuat::from_rotation_y(FRAC_PI_2),
        DVec3::new(0.0, 0.0, -(WALL_HALF + TRANSVERSE.width * 0.5)),
    );
    let mut arch = MeshBuilder::new();
    arch.append(&TRANSVERSE.wall(), &across);
    let arch = hall.stage.mesh("transverse arch", arch.scale_uvs(0.5), stone);
    hall.place_all(arch, stone, &piers);
    let mut pilaster = MeshBuilder::new();
    let depth = 0.36;
    pilaster.at(&cuboid([0.5, LOWER_SPRINGING, depth]), 0.0, LOWER_SPRINGING * 0.5, -AISLE + depth * 0.5);
    pilaster.at(&cuboid([0.66, 0.16, depth + 0.16]), 0.0, LOWER_SPRINGING - 0.08, -AISLE + depth * 0.5);
    pilaster.at(&cuboid([0.62, 0.3, depth + 0.12]), 0.0, 0.15, -AISLE + depth * 0.5);
    let pilaster = hall.stage.mesh("pilaster", pilaster.scale_uvs(0.5), stone);
    hall.place_all(pilaster, stone, &piers);
}

fn roof(hall: &mut Hall) {
    let tiles = hall.surfaces.roof;
    let bays = hall.bay_frames();
    let x = BAY * 0.5;
    let mut slope = MeshBuilder::new();
    let (low, high) = ((EAVES + 0.42, 0.78), (EAVES + 1.7, -AISLE - 0.5));
    slope.quad_metric([
        DVec3::new(-x, low.0, low.1),
        DVec3::new(x, low.0, low.1),
        DVec3::new(x, high.0, high.1),
        DVec3::new(-x, high.0, high.1),
    ]);
    let slope = hall.stage.mesh("roof", slope, tiles);
    hall.place_all(slope, tiles, &bays);
}

/// End walls, in a frame whose +Z looks into the nave.
fn ends(hall: &mut Hall) {
    let end = hall.length() * 0.5;
    let frames = [(0, turned(90.0, -end, 0.0, 0.0)), (0, turned(-90.0, end, 0.0, 0.0))];
    let (trim, stone, plaster, wood) =
        (hall.surfaces.trim, hall.surfaces.stone, hall.surfaces.plaster, hall.surfaces.wood);
    let mut wall = PORTAL.wall();
    let jamb = (PORTAL.width * 0.5 - PORTAL.radius, PORTAL.springing);
    for side in [-1.0, 1.0] {
        let x = (PORTAL.radius + jamb.0 * 0.5) * side;
        wall.at(&cuboid([jamb.0, jamb.1, PORTAL.thickness]), x, jamb.1 * 0.5, 0.0);
    }
    let wall = hall.stage.mesh("portal", wall.scale_uvs(0.5), stone);
    hall.place_all(wall, stone, &frames);
    let mut mouldings = PORTAL.archivolt();
    let x = PORTAL.radius;
    for side in [-1.0, 1.0] {
        mouldings.at(&cuboid([0.5, 0.22, 0.9]), (x + 0.22) * side, PORTAL.springing - 0.11, 0.0);
    }
    let string = [(GALLERY, 0.35), (GALLERY, 0.5), (GALLERY + 0.2, 0.5), (UPPER_FLOOR, 0.56), (UPPER_FLOOR, -0.3)];
    mouldings.append(&band(PORTAL.width, &string), &DAffine3::IDENTITY);
    let eaves =
        [(9.72, 0.25), (9.72, 0.31), (EAVES, 0.42), (EAVES + 0.06, 0.55), (EAVES + 0.4, 0.74), (EAVES + 0.4, -0.6)];
    mouldings.append(&band(PORTAL.width, &eaves), &DAffine3::IDENTITY);
    let mut upper = MeshBuilder::new();
    let column =
        Column { height: UPPER_SPRINGING - UPPER_FLOOR, radius: 0.15, segments: hall.segments.div_ceil(2).max(6) };
    for index in 0..4 {
        let x = (f64::from(index) - 1.5) * UPPER.width;
        upper.at(&UPPER.wall(), x, 0.0, 0.0);
        mouldings.at(&UPPER.archivolt(), x, 0.0, 0.0);
        mouldings.at(&column.mouldings(), x + UPPER.width * 0.5, UPPER_FLOOR, 0.0);
        mouldings.at(&column.shaft(), x + UPPER.width * 0.5, UPPER_FLOOR, 0.0);
    }
    let mouldings = hall.stage.mesh("end mouldings", mouldings, trim);
    hall.place_all(mouldings, trim, &frames);
    // Behind the loggia and at the aisles' ends.
    let half = NAVE_HALF + AISLE;
    upper.append(&face([-NAVE_HALF, UPPER_FLOOR], [NAVE_HALF, EAVES + 0.4], -0.9), &DAffine3::IDENTITY);
    upper.append(&face([-half, 0.0], [-NAVE_HALF + 0.3, EAVES], 0.0), &DAffine3::IDENTITY);
    upper.append(&face([NAVE_HALF - 0.3, 0.0], [half, EAVES], 0.0), &DAffine3::IDENTITY);
    let upper = hall.stage.mesh("end wall", upper, plaster);
    hall.place_all(upper, plaster, &frames);
    let door = face([-PORTAL.radius, 0.0], [PORTAL.radius, PORTAL.springing + PORTAL.radius], -0.2).scale_uvs(0.45);
    let door = hall.stage.mesh("door", door, wood);
    hall.place_all(door, wood, &frames);
}

/// Outer faces: they keep the sun out where a shadow pass draws fronts only.
fn shell(hall: &mut Hall) {
    let stone = hall.surfaces.stone;
    let (x, z) = (hall.length() * 0.5 + 1.0, NAVE_HALF + AISLE + 0.4);
    let mut shell = MeshBuilder::new();
    for (half, distance, turn) in [(x, z, 0.0), (x, z, 180.0), (z, x, 90.0), (z, x, 270.0)] {
        shell.append(&face([-half, 0.0], [half, EAVES + 1.6], distance), &turned(turn, 0.0, 0.0, 0.0));
    }
    hall.stage.add("shell", shell.scale_uvs(0.5), stone);
}
