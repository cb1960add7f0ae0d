//! Reports that tests make up: figures that look like measured ones, from a fixed seed.

use std::collections::BTreeMap;
use std::io::Cursor;

use image::{ImageFormat, Rgb, RgbImage};

use crate::report::sweep::model::*;

/// A setting: its key, its title, and its members, each with its factors of time and of shadow or other error.
struct SampleFamily {
    key: &'static str,
    title: &'static str,
    members: &'static [(&'static str, f64, f64)],
    is_number: bool,
}

const SETTINGS: &[SampleFamily] = &[
    SampleFamily {
        key: "gbuffer",
        title: "G-buffer formats",
        members: &[("lean", 1.0, 1.0), ("fat", 1.31, 0.42), ("float32", 1.62, 0.0)],
        is_number: false,
    },
    SampleFamily {
        key: "shadow-size",
        title: "Shadow map size",
        members: &[
            ("256", 0.82, 8.0),
            ("512", 0.88, 4.1),
            ("1024", 1.0, 2.0),
            ("2048", 1.25, 1.02),
            ("4096", 2.1, 0.54),
        ],
        is_number: true,
    },
    SampleFamily {
        key: "shadow-filter",
        title: "Shadow filter",
        members: &[
            ("none", 0.86, 1.9),
            ("2x2", 0.91, 1.4),
            ("3x3", 1.0, 1.0),
            ("5x5", 1.3, 0.9),
            ("poisson", 1.36, 1.1),
        ],
        is_number: false,
    },
    SampleFamily {
        key: "light-cutoff",
        title: "Light cut-off",
        members: &[("0.1", 0.7, 9.0), ("0.01", 0.9, 2.0), ("0.001", 1.0, 1.0), ("0", 1.8, 0.9)],
        is_number: true,
    },
    SampleFamily {
        key: "hdr",
        title: "HDR format",
        members: &[("rgba16f", 1.0, 1.0), ("rgba32f", 1.12, 0.97), ("r11g11b10f", 0.94, 1.6)],
        is_number: false,
    },
    SampleFamily {
        key: "msaa",
        title: "Samples a pixel",
        members: &[("1", 1.0, 1.0), ("4", 2.7, 0.45)],
        is_number: true,
    },
];

/// Two scenes on a CPU device.
pub fn report() -> Report {
    Report {
        layout: LAYOUT,
        version: "0.1.0".to_owned(),
        machine: Machine {
            device: "llvmpipe (LLVM 15.0.6, 256 bits)".to_owned(),
            driver: "lavapipe, Mesa 22.3.6".to_owned(),
            software: true,
            os: "Linux 6.1".to_owned(),
            cpu: "AMD EPYC 9R14".to_owned(),
            threads: 2,
            driver_threads: Some(2),
        },
        shard: Some(Shard { index: 1, count: 4 }),
        scenes: vec![scene("hall", 1), scene("field lights=64", 2)],
    }
}

/// Every setting on its own, and all of three settings together.
pub fn scene(name: &str, seed: u64) -> SceneReport {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut points = vec![point("default", (1.0, 1.0), &mut random)];
    let families = SETTINGS.iter().map(|setting| {
        let members = setting.members.iter().map(|(label, time, error)| {
            let index = if (*time, *error) == (1.0, 1.0) {
                0
            } else {
                points.push(point(&format!("{}={label}", setting.key), (*time, *error), &mut random));
                points.len() - 1
            };
            Member { point: index, label: (*label).to_owned(), value: label.parse().ok().filter(|_| setting.is_number) }
        });
        family(setting, members.collect())
    });
    let families: Vec<Family> = families.collect();
    for size in SETTINGS[1].members {
        for filter in SETTINGS[2].members {
            for samples in SETTINGS[5].members {
                let name = format!("shadow-size={} shadow-filter={} msaa={}", size.0, filter.0, samples.0);
                let factors = (size.1 * filter.1 * samples.1, size.2 * filter.2 * samples.2 * 0.7);
                points.push(point(&name, factors, &mut random));
            }
        }
    }
    for (index, shows) in [(0, "default"), (1, "fat"), (4, "512")] {
        let files = ["picture", "difference"].map(|kind| (kind.to_owned(), format!("{shows}-{kind}.png")));
        points[index].pictures = BTreeMap::from(files);
    }
    let kinds = [
        (Metric::RelMse, Against::Converged),
        (Metric::Rmse, Against::Converged),
        (Metric::Flip, Against::Converged),
        (Metric::RelMse, Against::Point),
    ];
    SceneReport {
        name: name.to_owned(),
        size: [640, 360],
        moving: true,
        triangles: 12_480,
        lights: 9,
        truth: TruthInfo {
            samples: 256,
            noise_rmse: 0.0011,
            noise_rel_mse: 0.000_021,
            sky: 0.12,
            other_triangle: Some(0.0013),
            size: None,
        },
        fronts: kinds.map(|(metric, truth)| front(&points, metric, truth)).into(),
        points,
        families,
        default: 0,
        clocks_moving: [0, 3],
        attributions: vec![attribution()],
        left_out: vec![
            LeftOut { name: "msaa=8".to_owned(), reason: "the device has no more than 4 samples a pixel".to_owned() },
            LeftOut { name: "msaa=16".to_owned(), reason: "the device has no more than 4 samples a pixel".to_owned() },
            LeftOut { name: "cascades=4".to_owned(), reason: "no directional light casts shadows".to_owned() },
        ],
    }
}

fn family(setting: &SampleFamily, members: Vec<Member>) -> Family {
    let convergence = (setting.key == "shadow-size").then(|| Convergence {
        metric: Metric::Rmse,
        truth: Against::Converged,
        order: 0.97,
        low: 0.91,
        high: 1.04,
        floor: 0.0031,
        expected:
            "the edge of a shadow is off by half a texel, so that the wrong area falls as the size to the power of 1"
                .to_owned(),
    });
    Family {
        key: setting.key.to_owned(),
        title: setting.title.to_owned(),
        members,
        convergence,
        floor: (setting.key == "gbuffer").then(|| "Shadows floor it: they are 71% of what remains.".to_owned()),
    }
}

/// A point whose time and error are the defaults' times these factors, with a little chance.
pub fn point(name: &str, (time, error): (f64, f64), random: &mut fastrand::Rng) -> Point {
    let median = 14.2 * time * (0.99 + 0.02 * random.f64());
    let spread = if random.f64() < 0.1 { 0.09 } else { 0.012 };
    let wall =
        Interval { median, low: median * (1.0 - spread), high: median * (1.0 + spread * random.f64()), count: 40 };
    let errors = |floor: f64, scale: f64| ErrorMetrics {
        rel_mse: scale * scale * (error * error) * 0.0009 + floor * floor,
        rmse: scale * error * 0.021 + floor * 0.3,
        max: 3.2 * error + floor,
        p99_9: 0.31 * error + floor,
        flip: scale * error * 0.034 + floor * 0.4,
        psnr_db: Some(31.0 - 8.0 * (error + floor).log10()),
        not_finite: 0,
    };
    Point {
        name: name.to_owned(),
        errors: ErrorsByTruth { point: errors(0.0, 0.4), converged: errors(0.008, 1.0) },
        time: Timing {
            wall,
            gpu: None,
            cpu: Some(Interval { median: median * 1.8, low: median * 1.79, high: median * 1.81, ..wall }),
            ratio: Interval { median: 1.0, low: 1.0 - spread, high: 1.0 + spread, ..wall },
            confirmed: true,
        },
        memory: 48 << 20,
        gbuffer_bytes_per_pixel: 16,
        pictures: BTreeMap::new(),
    }
}

fn front(points: &[Point], metric: Metric, truth: Against) -> Front {
    let figures = |index: usize| {
        let point: &Point = &points[index];
        (point.time.decisive().median, point.errors.against(truth).by(metric))
    };
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| figures(*a).0.total_cmp(&figures(*b).0));
    let mut best = f64::INFINITY;
    let on_front = order.into_iter().filter(|index| {
        let better = figures(*index).1 < best;
        best = best.min(figures(*index).1);
        better
    });
    let on_front: Vec<usize> = on_front.collect();
    let probability = (0..points.len()).map(|index| match on_front.contains(&index) {
        true => 0.6 + 0.39 * (index as f64 * 0.7).sin().abs(),
        false => 0.07 * (index as f64 * 1.3).sin().powi(8),
    });
    Front { metric, truth, probability: probability.collect(), points: on_front }
}

fn attribution() -> Attribution {
    let parts = [
        ("shadows", -0.0021, 0.0180, 0.71, "Shadow maps against exact shadow rays."),
        (
            "coverage and filtering",
            0.0002,
            0.0110,
            0.29,
            "One sample a pixel against many, textures at level 0 against their footprint.",
        ),
        ("G-buffer", 0.0004, 0.0040, 0.06, "What the formats of its targets round off."),
        ("other triangles", -0.0001, 0.0031, 0.03, "Pixels on which rasterizer and truth see different triangles."),
        ("BRDF arithmetic", 0.0, 0.0001, 0.0004, "32-bit against 64-bit light."),
        ("HDR format", 0.0011, 0.0042, -0.0904, "16-bit sums; they are too bright where shadows are too dark."),
        ("whole", -0.0005, 0.0209, 1.0, "All of it."),
    ];
    let part = |(name, mean, rms, share, note): (&str, f64, f64, f64, &str)| AttributedPart {
        name: name.to_owned(),
        mean,
        rms,
        share,
        note: note.to_owned(),
    };
    Attribution { point: 0, parts: parts.map(part).into(), light_rms: 0.0123, pixels: 20_000, of_pixels: 230_400 }
}

/// A PNG for every name that the report has.
pub fn picture(file: &str) -> Option<Vec<u8>> {
    let is_difference = file.contains("difference");
    let image = RgbImage::from_fn(160, 90, |x, y| match is_difference {
        true => Rgb([(x * y / 90) as u8, 12, ((x ^ y) / 2) as u8]),
        false => Rgb([(x + 60) as u8, (y * 2) as u8, 120]),
    });
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).ok()?;
    Some(bytes.into_inner())
}
