//! A colonnaded hall in the spirit of Sponza's court: two storeys of columns and arches around a nave that is open to the sky.
//!
//! The nave runs along X. A bay is built once, in a frame whose origin lies on the floor in the middle of the arcade, with the nave at +Z
//! and the aisle at -Z, and placed along both sides.

mod furniture;
mod masonry;
mod storeys;
mod surfaces;

use glam::{DAffine3, DVec3, Vec3};

use self::surfaces::HallMaterials;
use super::Builtin;
use super::params::{Parameter, Params};
use super::stage::{Random, SceneBuilder, hue, turned};
use crate::{Camera, Environment, Falloff, Light, LightKind, Projection, Scene};

pub(super) const HALL: Builtin = Builtin {
    name: "hall",
    about: "A colonnaded hall, open to the sky, with the sun slanting in.",
    parameters: &[
        Parameter::integer("bays", [1, 64], 7, "arches on either side"),
        Parameter::integer("detail", [6, 128], 32, "segments around a column"),
        Parameter::integer("lights", [0, 100_000], 14, "point lights: lanterns first, then coloured ones in the air"),
        Parameter::number("range", [0.0, 1e6], 9.0, "reach of a point light in metres; 0: no limit"),
    ],
    build,
};

/// Length of a bay; the nave is two bays wide between the axes of its columns.
const BAY: f64 = 3.6;
const NAVE_HALF: f64 = BAY;
/// Distance from the axis of the arcade to the outer wall.
const AISLE: f64 = 3.55;
/// Half the thickness of the lower arcade.
const WALL_HALF: f64 = 0.35;
const LOWER_SPRINGING: f64 = 3.7;
const GALLERY: f64 = 6.0;
const UPPER_FLOOR: f64 = 6.3;
const UPPER_SPRINGING: f64 = 8.5;
const EAVES: f64 = 10.0;

/// The hall while it is built.
struct Hall {
    stage: SceneBuilder,
    surfaces: HallMaterials,
    bays: usize,
    segments: usize,
}

impl Hall {
    fn length(&self) -> f64 {
        self.bays as f64 * BAY
    }

    /// Frames of all bays on both sides, with their number from the -X end.
    fn bay_frames(&self) -> Vec<(usize, DAffine3)> {
        self.frames(self.bays, 0.5)
    }

    /// Frames of the piers between bays, both ends included.
    fn pier_frames(&self) -> Vec<(usize, DAffine3)> {
        self.frames(self.bays + 1, 0.0)
    }

    fn frames(&self, count: usize, shift: f64) -> Vec<(usize, DAffine3)> {
        let x = |index: usize| (index as f64 + shift) * BAY - self.length() * 0.5;
        (0..count)
            .flat_map(|i| [(i, turned(0.0, x(i), 0.0, -NAVE_HALF)), (i, turned(180.0, x(i), 0.0, NAVE_HALF))])
            .collect()
    }

    fn place_all(&mut self, mesh: usize, material: usize, frames: &[(usize, DAffine3)]) {
        for (_, frame) in frames {
            self.stage.place(mesh, material, *frame);
        }
    }
}

fn build(params: &Params) -> Scene {
    let mut stage = SceneBuilder::default();
    let surfaces = HallMaterials::new(&mut stage);
    let mut hall = Hall { stage, surfaces, bays: params.integer("bays"), segments: params.integer("detail") };
    storeys::build(&mut hall);
    furniture::build(&mut hall);
    daylight(&mut hall.stage);
    let range = params.number("range");
    lamps(&mut hall, params.integer("lights"), (range > 0.0).then_some(range));
    let end = hall.length() * 0.5;
    let eye = DVec3::new(-end + 1.3, 1.75, 1.25);
    let target = DVec3::new(end * 0.55, 3.55, -0.55);
    // For open shade beside the sun: metering, which knows no shadows, would close by a stop.
    hall.stage.scene.settings.exposure = Some(13.9);
    hall.stage.scene.camera =
        Camera { projection: Projection::perspective(66.0), near: 0.05, ..Camera::looking_at(eye, target, DVec3::Y) };
    hall.stage.scene
}

/// The sun in the afternoon, light of the sky, and light that the lit floor throws back: without the last two, everything in the shade would be
/// as flat as the ambient light.
fn daylight(stage: &mut SceneBuilder) {
    stage.sun(DVec3::new(-0.22, -1.0, 0.30), 95_000.0, Vec3::new(1.0, 0.91, 0.76), true);
    stage.sun(DVec3::new(0.25, 1.0, -0.55), 5_000.0, Vec3::new(1.0, 0.80, 0.58), false);
    stage.sun(DVec3::new(0.75, -0.2, 0.35), 2_500.0, Vec3::new(0.75, 0.85, 1.0), false);
    stage.scene.environment = Environment {
        ambient: Vec3::new(0.92, 0.95, 1.04) * 4_000.0,
        background: Vec3::new(0.42, 0.62, 1.0) * 14_000.0,
        ground: None,
    };
}

/// Height of the lanterns' flames, under the aisles' ceilings.
const LANTERN: f64 = 3.15;

fn lamps(hall: &mut Hall, count: usize, range: Option<f64>) {
    let frames = hall.bay_frames();
    let mut random = Random(7);
    for index in 0..count {
        let lantern =
            frames.get(index).map(|(_, frame)| frame.transform_point3(DVec3::new(0.0, LANTERN, -AISLE * 0.52)));
        let is_lantern = lantern.is_some();
        let position = lantern.unwrap_or_else(|| {
            let end = hall.length() * 0.5 - 0.5;
            let across = NAVE_HALF + AISLE - 0.5;
            DVec3::new(random.between(-end, end), random.between(0.4, 9.0), random.between(-across, across))
        });
        hall.stage.light(Light {
            name: if is_lantern { format!("lantern {index}") } else { format!("light {index}") },
            color: if is_lantern { Vec3::new(1.0, 0.62, 0.28) } else { Vec3::ONE.lerp(hue(random.unit()), 0.75) },
            intensity: if is_lantern { 5_000.0 } else { 1_500.0 },
            ..Light::of(LightKind::Point { position, range, falloff: Falloff::InverseSquare })
        });
    }
}
