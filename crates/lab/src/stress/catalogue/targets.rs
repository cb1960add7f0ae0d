//! Pictures of odd, tiny and very long sizes, by every light path, of several samples and of many frames.

use glam::{DVec3, Vec3};

use super::super::{Bound, Case, Check, Subject, SweepValues, case};
use super::stage::{float32, lamp, sphere_on_floor};
use afterlight::scene::builtin::shapes;
use afterlight::scene::builtin::stage::SceneBuilder;
use afterlight::scene::{Brdf, Camera, LightKind, LightPath, Material, SettingsPatch};

const EXACT: Bound = Bound { worst: 1e-3, mean: 5e-6 };

/// Pictures that no tile of 8 or 16 pixels divides, and such that one does.
const EDGES: SweepValues = SweepValues::List(&[1.0, 7.0, 8.0, 17.0, 65.0]);

const fn path(name: &'static str, extreme: &'static str, subject: fn(f64) -> Subject) -> Case {
    let check = Check::Picture(subject);
    Case { name, extreme, unit: "px", values: EDGES, claim: [1.0, 65.0], bound: EXACT, check }
}

pub const CASES: &[Case] = &[
    case("targets/width", "pictures of nine rows, from a single pixel wide to as wide as any device draws")
        .over(SweepValues::List(&[1.0, 2.0, 3.0, 7.0, 31.0, 33.0, 127.0, 1021.0, 4096.0, 16384.0, 32768.0]), "px")
        .claim([1.0, 4096.0], Bound { worst: 0.05, mean: 5e-3 })
        .check(Check::Picture(width)),
    case("targets/height", "pictures of a single column, so high")
        .over(
            SweepValues::List(&[1.0, 2.0, 3.0, 7.0, 31.0, 33.0, 127.0, 1021.0, 4096.0, 8192.0, 16384.0, 32768.0]),
            "px",
        )
        // Normals in 16 bits tell most where light grazes.
        .claim([1.0, 4096.0], Bound { worst: 0.2, mean: 0.01 })
        .check(Check::Picture(height)),
    path("targets/loop", "squares of so many pixels under forty lamps, lit by loop", |edge| {
        lit_by(LightPath::Loop, edge)
    }),
    path("targets/per-light", "the same by per-light", |edge| lit_by(LightPath::PerLight, edge)),
    path("targets/volumes", "the same by volumes", |edge| lit_by(LightPath::Volumes, edge)),
    path("targets/clustered", "the same by clustered", |edge| lit_by(LightPath::Clustered, edge)),
    path("targets/compute", "the same by compute", |edge| lit_by(LightPath::Compute, edge)),
    path("targets/visibility", "the same by visibility", |edge| lit_by(LightPath::Visibility, edge)),
    path("targets/forward", "the same by forward", |edge| lit_by(LightPath::Forward, edge)),
    path("targets/forward-naive", "the same by forward-naive", |edge| lit_by(LightPath::ForwardNaive, edge)),
    case("targets/msaa", "a wall of even light in so many samples a pixel")
        // The sample counts that every device has.
        .over(SweepValues::List(&[1.0, 4.0]), "")
        .claim([1.0, 4.0], Bound { worst: 1e-5, mean: 1e-6 })
        .check(Check::Picture(msaa)),
    case("targets/msaa-forward", "the same by forward")
        .over(SweepValues::List(&[1.0, 4.0]), "")
        .claim([1.0, 4.0], Bound { worst: 1e-5, mean: 1e-6 })
        .check(Check::Picture(msaa_forward)),
    case("targets/frames", "a wall of even light in the mean of so many frames")
        .over(SweepValues::List(&[1.0, 2.0, 16.0, 256.0, 4096.0]), "")
        .claim([1.0, 4096.0], Bound { worst: 1e-6, mean: 1e-6 })
        .check(Check::Picture(frames)),
];

fn long(size: [u32; 2]) -> Subject {
    let mut stage = sphere_on_floor();
    stage.light(lamp(DVec3::new(1.2, 2.0, 1.0), 4000.0));
    Subject::with(stage.scene, SettingsPatch { size: Some(size), ..SettingsPatch::default() })
}

fn width(pixels: f64) -> Subject {
    long([pixels as u32, 9])
}

fn height(pixels: f64) -> Subject {
    long([1, pixels as u32])
}

fn lit_by(path: LightPath, edge: f64) -> Subject {
    let mut stage = sphere_on_floor();
    for index in 0..40 {
        let place = DVec3::new(f64::from(index % 8) - 3.5, 0.75, f64::from(index / 8) - 3.0);
        let mut lamp = lamp(place, 100.0);
        if let LightKind::Point { range, .. } = &mut lamp.kind {
            *range = Some(1.5);
        }
        lamp.color = Vec3::new(1.0, 0.5 + 0.01 * index as f32, 0.3);
        stage.light(lamp);
    }
    let size = Some([edge as u32; 2]);
    Subject::with(stage.scene, SettingsPatch { size, light_path: Some(path), ..float32() })
}

/// As bright in every place, so that it does not matter where in a pixel it is looked at.
fn wall(settings: SettingsPatch) -> Subject {
    let mut stage = SceneBuilder::default();
    let matt =
        stage.material(Material { base_color: Vec3::new(0.7, 0.5, 0.1), brdf: Brdf::Lambert, ..Material::default() });
    stage.add("wall", shapes::plane([40.0; 2]), matt);
    stage.sun(DVec3::new(0.3, -1.0, 0.2), 777.0, Vec3::ONE, false);
    stage.scene.camera = Camera::looking_at(DVec3::new(0.0, 2.0, 1.0), DVec3::ZERO, DVec3::Y);
    Subject::with(stage.scene, settings)
}

fn msaa(samples: f64) -> Subject {
    wall(SettingsPatch { msaa: Some(samples as u32), ..float32() })
}

fn msaa_forward(samples: f64) -> Subject {
    let msaa = Some(samples as u32);
    wall(SettingsPatch { msaa, light_path: Some(LightPath::Forward), ..float32() })
}

fn frames(count: f64) -> Subject {
    wall(SettingsPatch { samples: Some(count as u32), size: Some([1, 2]), ..float32() })
}
