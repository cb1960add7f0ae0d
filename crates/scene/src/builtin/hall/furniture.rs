//! The furniture of the hall: cloth, plants, iron, lanterns, urns and a fountain.

use glam::{DAffine3, DVec2, DVec3};

use super::{AISLE, BAY, Hall, LANTERN, UPPER_FLOOR};
use crate::builtin::shapes::{MeshBuilder, WHOLE_IMAGE, cuboid, sphere};
use crate::builtin::stage::{translation, turned};

pub(super) fn build(hall: &mut Hall) {
    curtains(hall);
    banners(hall);
    balustrade(hall);
    plants(hall);
    lanterns(hall);
    urns(hall);
    fountain(hall);
}

/// Cloth `width` wide and `height` high that hangs from its upper edge in `folds`, gathered towards `gather` (0: left, 1: right).
fn cloth(size: [f64; 2], folds: f64, depth: f64, gather: f64) -> MeshBuilder {
    let [width, height] = size;
    let mut mesh = MeshBuilder::new();
    mesh.grid_smooth([96, 32], |u, v| {
        let fall = 1.0 - v;
        // A tie at two thirds of the way down draws the cloth to one side.
        let tie = gather.signum() * (-((fall - 0.62) / 0.2).powi(2)).exp() * gather.abs();
        let drawn = if tie >= 0.0 { u * (1.0 - 0.72 * tie) } else { 1.0 - (1.0 - u) * (1.0 + 0.72 * tie) };
        let angle = u * folds * std::f64::consts::TAU;
        let sway = depth * (0.35 + 0.65 * fall) * (angle.sin() + 0.35 * (angle * 2.3 + 1.1 + fall * 2.0).sin());
        let x = (drawn - 0.5) * width;
        let hem = 0.03 * (angle * 0.5).cos() * fall;
        (DVec3::new(x, -height * fall + hem, sway), DVec2::new(u, fall * height / width))
    });
    mesh
}

/// Curtains in every other arch, behind the columns, drawn to one side.
fn curtains(hall: &mut Hall) {
    let bays = hall.bay_frames();
    let iron = hall.surfaces.iron;
    let fabrics = hall.surfaces.fabrics;
    let mut rod = MeshBuilder::new();
    rod.at(&cuboid([BAY - 0.3, 0.05, 0.05]), 0.0, 4.66, -0.62);
    let rod = hall.stage.mesh("curtain rod", rod, iron);
    let meshes = [1.0, -1.0].map(|gather| {
        let mut curtain = MeshBuilder::new();
        curtain.at(&cloth([2.9, 4.5], 9.0, 0.09, gather), 0.0, 4.64, -0.62);
        hall.stage.mesh("curtain", curtain, fabrics[0])
    });
    for (number, (index, frame)) in bays.into_iter().enumerate() {
        if (index + number % 2) % 2 == 0 {
            hall.stage.place(rod, iron, frame);
            hall.stage.place(meshes[(index / 2) % 2], fabrics[(index + number) % 3], frame);
        }
    }
}

/// Banners over the gallery's edge, at each pier but the first and the last.
fn banners(hall: &mut Hall) {
    let piers = hall.pier_frames();
    let (fabrics, bays) = (hall.surfaces.fabrics, hall.bays);
    let mut banner = MeshBuilder::new();
    banner.at(&cloth([0.86, 2.3], 1.5, 0.03, 0.0), 0.0, UPPER_FLOOR + 0.9, 0.64);
    let banner = hall.stage.mesh("banner", banner, fabrics[0]);
    for (index, frame) in piers.into_iter().filter(|(index, _)| (1..bays).contains(index)) {
        hall.stage.place(banner, fabrics[(index + usize::from(frame.translation.z > 0.0)) % 3], frame);
    }
}

fn balustrade(hall: &mut Hall) {
    let bays = hall.bay_frames();
    let (lattice, wood) = (hall.surfaces.lattice, hall.surfaces.wood);
    let mut rail = MeshBuilder::new();
    let (x, low, high) = (BAY * 0.5, UPPER_FLOOR, UPPER_FLOOR + 0.92);
    let corners = [(-x, low), (x, low), (x, high), (-x, high)].map(|(x, y)| DVec3::new(x, y, 0.36));
    let uvs = WHOLE_IMAGE.map(|uv| DVec2::new(uv.x * 2.0, uv.y));
    rail.quad(corners, uvs);
    let rail = hall.stage.mesh("balustrade", rail, lattice);
    hall.place_all(rail, lattice, &bays);
    let mut top = MeshBuilder::new();
    top.at(&cuboid([BAY, 0.07, 0.14]), 0.0, high + 0.02, 0.36);
    let top = hall.stage.mesh("handrail", top, wood);
    hall.place_all(top, wood, &bays);
}

/// Ivy over the string course in some bays, and pots with shrubs beside the columns.
fn plants(hall: &mut Hall) {
    let (ivy, terracotta) = (hall.surfaces.ivy, hall.surfaces.terracotta);
    let bays = hall.bay_frames();
    let piers = hall.pier_frames();
    let mut hanging = MeshBuilder::new();
    for layer in 0..3 {
        let shift = f64::from(layer);
        hanging.grid_smooth([24, 12], |u, v| {
            let fall = 1.0 - v;
            let bulge = 0.58 + 0.05 * shift + 0.10 * (fall * 3.0).sin() + 0.05 * (u * 11.0 + shift * 2.0).sin();
            let place = DVec3::new((u - 0.5) * 2.5 + 0.06 * shift, UPPER_FLOOR + 0.22 - fall * 1.75, bulge);
            (place, DVec2::new(u * 1.5 + shift * 0.31, fall))
        });
    }
    let hanging = hall.stage.mesh("hanging ivy", hanging, ivy);
    for (number, (index, frame)) in bays.into_iter().enumerate() {
        if (index * 2 + number % 2) % 3 == 1 {
            hall.stage.place(hanging, ivy, frame);
        }
    }
    let mut pot = MeshBuilder::new();
    let profile = [
        (0.0, 0.0),
        (0.17, 0.0),
        (0.2, 0.04),
        (0.26, 0.3),
        (0.27, 0.42),
        (0.31, 0.42),
        (0.31, 0.5),
        (0.26, 0.5),
        (0.25, 0.44),
        (0.0, 0.44),
    ];
    pot.lathe(&profile, hall.segments);
    let pot = hall.stage.mesh("pot", pot.scale_uvs(0.8), terracotta);
    let mut shrub = MeshBuilder::new();
    for blade in 0..7 {
        let angle = f64::from(blade) * 360.0 / 7.0;
        let mut leaf = MeshBuilder::new();
        leaf.grid_smooth([6, 8], |u, v| {
            // Upright near the pot, arching out above; the dense end of the image is at the foot.
            let out = 0.06 + 0.38 * v * v;
            let half = 0.34 * (1.0 - 0.3 * v);
            let place = DVec3::new((u - 0.5) * 2.0 * half, 0.42 + 0.95 * v - 0.25 * v * v, out);
            (place, DVec2::new(u * 0.6 + f64::from(blade) * 0.17, v * 0.62))
        });
        shrub.append(&leaf, &turned(angle, 0.0, 0.0, 0.0));
    }
    let shrub = hall.stage.mesh("shrub", shrub, ivy);
    for (_, frame) in piers.into_iter().filter(|(index, _)| index % 2 == 1) {
        let beside = frame * translation(0.0, 0.0, 0.95);
        hall.stage.place(pot, terracotta, beside);
        hall.stage.place(shrub, ivy, beside);
    }
}

/// One under each aisle ceiling, on a chain.
fn lanterns(hall: &mut Hall) {
    let bays = hall.bay_frames();
    let (iron, glow) = (hall.surfaces.iron, hall.surfaces.glow);
    let mut frame = MeshBuilder::new();
    let profile = [(0.0, -0.24), (0.05, -0.24), (0.13, -0.17), (0.13, -0.15), (0.0, -0.15)];
    frame.lathe(&profile, 12);
    frame.lathe(&[(0.0, 0.15), (0.15, 0.15), (0.15, 0.17), (0.05, 0.27), (0.02, 0.34), (0.0, 0.34)], 12);
    frame.at(&cuboid([0.02, 2.2, 0.02]), 0.0, 1.43, 0.0);
    for (x, z) in [(0.11, 0.0), (-0.11, 0.0), (0.0, 0.11), (0.0, -0.11)] {
        frame.at(&cuboid([0.015, 0.32, 0.015]), x, 0.0, z);
    }
    let mut bulb = MeshBuilder::new();
    bulb.append(&sphere(0.08, 16), &DAffine3::from_scale(DVec3::new(1.0, 1.4, 1.0)));
    let frame = hall.stage.mesh("lantern", frame, iron);
    let bulb = hall.stage.mesh("lamp glass", bulb, glow);
    for (_, bay) in bays {
        let place = bay * translation(0.0, LANTERN, -AISLE * 0.52);
        hall.stage.place(frame, iron, place);
        hall.stage.place(bulb, glow, place);
    }
}

/// Bronze and gold on marble pedestals between the plants.
fn urns(hall: &mut Hall) {
    let (marble, bronze, gold) = (hall.surfaces.marble, hall.surfaces.bronze, hall.surfaces.gold);
    let piers = hall.pier_frames();
    let bays = hall.bays;
    let mut pedestal = MeshBuilder::new();
    pedestal.at(&cuboid([0.5, 0.12, 0.5]), 0.0, 0.06, 0.0);
    pedestal.at(&cuboid([0.38, 0.6, 0.38]), 0.0, 0.42, 0.0);
    pedestal.at(&cuboid([0.48, 0.08, 0.48]), 0.0, 0.76, 0.0);
    let pedestal = hall.stage.mesh("pedestal", pedestal, marble);
    let mut urn = MeshBuilder::new();
    let profile = [
        (0.0, 0.8),
        (0.13, 0.8),
        (0.14, 0.83),
        (0.06, 0.87),
        (0.05, 0.92),
        (0.12, 0.98),
        (0.19, 1.08),
        (0.22, 1.2),
        (0.2, 1.32),
        (0.14, 1.4),
        (0.1, 1.44),
        (0.11, 1.5),
        (0.17, 1.54),
        (0.16, 1.56),
        (0.09, 1.5),
        (0.0, 1.48),
    ];
    urn.lathe(&profile, hall.segments);
    let urn = hall.stage.mesh("urn", urn, bronze);
    for (index, frame) in piers.into_iter().filter(|(index, _)| index % 2 == 0 && *index > 0 && *index < bays) {
        let place = frame * translation(0.0, 0.0, 1.05);
        hall.stage.place(pedestal, marble, place);
        hall.stage.place(urn, if index % 4 == 0 { gold } else { bronze }, place);
    }
}

/// A basin with a golden sphere in the middle of the nave.
fn fountain(hall: &mut Hall) {
    let (trim, water, gold, marble) =
        (hall.surfaces.trim, hall.surfaces.water, hall.surfaces.gold, hall.surfaces.marble);
    let segments = hall.segments.max(24) * 2;
    let mut basin = MeshBuilder::new();
    let rim = [
        (1.42, 0.0),
        (1.42, 0.08),
        (1.3, 0.14),
        (1.22, 0.2),
        (1.22, 0.36),
        (1.3, 0.42),
        (1.34, 0.46),
        (1.34, 0.54),
        (1.14, 0.54),
        (1.08, 0.5),
        (1.08, 0.1),
    ];
    basin.lathe(&rim, segments);
    hall.stage.add("basin", basin, trim);
    let mut surface = MeshBuilder::new();
    surface.lathe(&[(1.1, 0.42), (0.0, 0.42)], segments);
    hall.stage.add("water", surface, water);
    let mut stem = MeshBuilder::new();
    let profile = [
        (0.34, 0.2),
        (0.34, 0.5),
        (0.22, 0.58),
        (0.14, 0.7),
        (0.13, 1.1),
        (0.2, 1.2),
        (0.5, 1.34),
        (0.54, 1.4),
        (0.5, 1.42),
        (0.2, 1.38),
        (0.12, 1.5),
        (0.16, 1.56),
        (0.0, 1.58),
    ];
    stem.lathe(&profile, hall.segments);
    hall.stage.add("stem", stem, marble);
    let mut ball = MeshBuilder::new();
    ball.at(&sphere(0.3, hall.segments.max(24)), 0.0, 1.86, 0.0);
    hall.stage.add("golden sphere", ball, gold);
}
