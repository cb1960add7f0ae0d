//! Combinations of light path, multisampling, transparency, sky, ambient occlusion, particles, reflections, fog, bloom, TAA, FXAA, HDR format,
//! samples and output, except for the ones that a comment leaves out: each is drawn without a message, or refused with a sentence, as the table in
//! docs/LIGHT_PATHS.md says.

use std::collections::BTreeSet;

use crate::common::gpu::{Gpu, on_gpu};
use crate::common::stage::{add, lambert, own, plane, point, rectangle, sun};
use crate::common::tries_all;
use afterlight::frame::{Error, Renderer, capabilities};
use afterlight::plan::FramePlan;
use afterlight::plan::samples;
use afterlight::scene::{
    AlphaMode, AmbientOcclusion, Emitter, Falloff, Fog, HdrFormat, LightPath, Material, Output, Reflections, Resolve,
    Scene, Settings, Transparency,
};
use glam::{DAffine3, DQuat, DVec3, Vec3};

/// Settings that the table speaks of, as it spells them.
pub type Named = Vec<(&'static str, String)>;

const AO: [AmbientOcclusion; 2] = [AmbientOcclusion::Off, AmbientOcclusion::Bitmask];

/// A scene with a share of everything that the settings act on: ambient light, lights with and without a range, a shadow, a surface that emits.
pub fn scene(transparent: bool) -> Scene {
    let mut lights = vec![sun(DVec3::new(0.3, 0.5, 1.0), 1.0)];
    let lamp = |index: u32| {
        let range = (!index.is_multiple_of(3)).then_some(1.0);
        point(DVec3::new(f64::from(index) * 0.2 - 1.0, 0.3, 0.6), 0.2, range, Falloff::InverseSquare)
    };
    lights.extend((0..9).map(lamp));
    let mut scene = plane(lambert(0.6), lights);
    scene.name = "everything".into();
    scene.environment.ambient = Vec3::splat(0.05);
    let turned = DAffine3::from_quat(DQuat::from_rotation_z(0.3));
    let glowing = Material { emissive: Vec3::new(0.2, 0.1, 0.0), roughness: 0.3, ..Material::default() };
    add(&mut scene, rectangle([-0.7, -0.3], [0.1, 0.4], 0.3), glowing, turned);
    if transparent {
        let pane = Material { alpha: 0.4, alpha_mode: AlphaMode::Blend, ..Material::default() };
        add(&mut scene, rectangle([-0.2, -0.5], [0.8, 0.5], 0.5), pane, turned);
    }
    scene
}

/// With and without something transparent; the same under a sky that lights them; and the first two with particles.
pub fn scenes() -> [Scene; 6] {
    let [opaque, glazed] = [false, true].map(scene);
    let smoking = |scene: &Scene| {
        let emitter = Emitter { life: 0.5, size: vec![0.3], color: vec![[0.5; 4]], ..Emitter::default() };
        Scene { emitters: vec![emitter], ..scene.clone() }
    };
    let smoke = [smoking(&opaque), smoking(&glazed)];
    let [smoke, hazy] = smoke;
    [
        opaque.clone(),
        glazed.clone(),
        samples::with("under a sky", opaque),
        samples::with("under a sky", glazed),
        smoke,
        hazy,
    ]
}

/// Every combination, with the index of its scene.
pub fn combinations() -> Vec<(Named, usize, Settings)> {
    let mut all = Vec::new();
    for &(path, light_path) in LightPath::NAMES {
        for msaa in [1, 4] {
            for samples in [1, 2] {
                for fxaa in [false, true] {
                    for &(hdr, hdr_format) in HdrFormat::NAMES {
                        for output in [Output::Srgb8, Output::Nits] {
                            let transparencies = [None, Some(Transparency::Sorted), Some(Transparency::Oit)];
                            let contents = transparencies.into_iter().flat_map(|own| [(own, 0), (own, 1)]);
                            for ((transparency, sky), ao) in contents.flat_map(|own| AO.map(|ao| (own, ao))) {
                                // The format of light matters to neither.
                                if hdr_format != HdrFormat::default() && (sky, ao) != (0, AO[0]) {
                                    continue;
                                }
                                let named = vec![
                                    ("path", path.to_owned()),
                                    ("msaa", msaa.to_string()),
                                    ("samples", samples.to_string()),
                                    ("fxaa", if fxaa { "on" } else { "off" }.to_owned()),
                                    ("hdr", hdr.to_owned()),
                                    ("output", if output.is_linear() { "linear" } else { "display" }.to_owned()),
                                    ("transparent", transparency.map_or("no", Transparency::name).to_owned()),
                                    ("sky", ["off", "on"][sky].to_owned()),
                                    ("ao", ao.to_string()),
                                    ("particles", "off".to_owned()),
                                    ("bloom", "off".to_owned()),
                                ];
                                let settings = Settings {
                                    light_path,
                                    msaa,
                                    samples,
                                    fxaa,
                                    hdr_format,
                                    output,
                                    ao,
                                    transparency: transparency.unwrap_or_default(),
                                    ..Settings::default()
                                };
                                all.push((named, usize::from(transparency.is_some()) + 2 * sky, settings));
                            }
                        }
                    }
                }
            }
        }
    }
    let bloomed = all.iter().filter(|(_, _, settings)| settings.hdr_format == HdrFormat::default()).cloned();
    let bloomed: Vec<_> = bloomed
        .map(|(mut named, transparent, settings)| {
            named.pop();
            named.push(("bloom", "on".to_owned()));
            // Bloom does not go with light that is averaged as shown, as the table's last sentences say.
            (named, transparent, Settings { bloom: 0.2, resolve: Resolve::Linear, ..settings })
        })
        .collect();
    let over_time = all.iter().filter(|(_, scene, settings)| {
        settings.hdr_format == HdrFormat::default() && *scene < 2 && settings.ao == AmbientOcclusion::Off
    });
    let over_time: Vec<_> = over_time
        .map(|(named, scene, settings)| {
            let mut named = named.clone();
            named.push(("taa", "on".to_owned()));
            (named, *scene, Settings { taa: true, ..settings.clone() })
        })
        .collect();
    all.extend(bloomed);
    // The format of light, the sky and FXAA matter to particles as to transparent surfaces.
    let plain = |settings: &Settings| settings.hdr_format == HdrFormat::default() && !settings.fxaa;
    let smoking = all.iter().filter(|(_, scene, settings)| *scene < 2 && plain(settings)).cloned();
    let smoking: Vec<_> = smoking
        .map(|(mut named, scene, settings)| {
            if let Some(own) = named.iter_mut().find(|(key, _)| *key == "particles") {
                own.1 = "on".to_owned();
            }
            (named, scene + 4, settings)
        })
        .collect();
    all.extend(smoking);
    all.extend(over_time);
    // Neither samples nor FXAA decide which settings reflections go with, and occlusion, sky and particles hardly do: few of their combinations are
    // repeated.
    let is_told = |settings: &Settings, scene: usize| {
        settings.samples == 1 && !settings.fxaa && scene != 4 && (settings.ao == AO[1]) == (scene >= 2)
    };
    let mirrored = all.iter().filter(|(_, scene, settings)| is_told(settings, *scene)).cloned();
    let mirrored: Vec<_> = mirrored
        .map(|(named, scene, settings)| (named, scene, Settings { reflections: Reflections::Screen, ..settings }))
        .collect();
    all.extend(mirrored);
    for (named, _, settings) in &mut all {
        named.push(("reflections", settings.reflections.to_string()));
    }
    // Repeats each combination in fog, unless it differs only in settings that fog does not meet.
    let clear = |(named, _, settings): &&(Named, usize, Settings)| {
        let is_usual = settings.hdr_format == HdrFormat::default() && settings.bloom == 0.0;
        is_usual && settings.ao == AO[0] && named.iter().all(|(key, value)| *key != "samples" || value == "1")
    };
    let fogged: Vec<_> = all.iter().filter(clear).cloned().collect();
    all.iter_mut().for_each(|(named, ..)| named.push(("fog", "off".to_owned())));
    let kinds = [Fog::Height, Fog::Froxels].into_iter().cycle();
    all.extend(fogged.into_iter().zip(kinds).map(|((mut named, scene, settings), fog)| {
        named.push(("fog", "on".to_owned()));
        (named, scene, Settings { fog, fog_froxels: [16, 9, 8], ..settings })
    }));
    all
}

/// The rows of the table: settings of which any one does not go with any one of the others.
fn rules() -> Vec<[Vec<String>; 2]> {
    let text = include_str!("../../docs/LIGHT_PATHS.md");
    let table = text.split("| Setting | Not with | Why |").nth(1).unwrap_or_else(|| panic!("no table"));
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let settings = |cell: &str| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>();
    let rules: Vec<_> = rows
        .map(|row| {
            let cells: Vec<&str> = row.split('|').collect();
            [settings(cells[1]), settings(cells[2])]
        })
        .collect();
    assert!(rules.len() > 5 && rules.iter().flatten().all(|side| !side.is_empty()), "{rules:?}");
    rules
}

fn refused_by(named: &Named, rules: &[[Vec<String>; 2]]) -> bool {
    let has =
        |side: &Vec<String>| side.iter().any(|one| named.iter().any(|(key, value)| *one == format!("{key}={value}")));
    rules.iter().any(|[one, other]| has(one) && has(other))
}

#[test]
fn the_table_names_settings_that_exist() {
    let all: BTreeSet<String> = combinations()
        .iter()
        .flat_map(|(named, ..)| named.iter().map(|(key, value)| format!("{key}={value}")))
        .collect();
    for one in rules().iter().flatten().flatten() {
        assert!(all.contains(one), "{one} is none of {all:?}");
    }
}

/// Pairs of values that have come up. Most faults of combinations are faults of two values (Kuhn, Wallace and Gallo, 2004): `make test` draws every
/// thirteenth of the frames that bring a new pair of paths, samples, transparency and outputs, `make test-all` each combination; `proof` has asked of all
/// of them whether their dependencies are enough.
#[derive(Default)]
struct Pairs(BTreeSet<[String; 2]>);

impl Pairs {
    /// Adds the pairs of these values, and returns true if one of them is new.
    fn are_new(&mut self, named: &Named) -> bool {
        let values = named.iter().filter(|(key, _)| *key != "hdr" && *key != "samples");
        let values: Vec<String> = values.map(|(key, value)| format!("{key}={value}")).collect();
        let mut are_new = false;
        for (index, one) in values.iter().enumerate() {
            for other in &values[index + 1..] {
                are_new |= self.0.insert([one.clone(), other.clone()]);
            }
        }
        are_new
    }
}

fn draw(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Result<(), Error> {
    let mut renderer = Renderer::new(&gpu.device, scene, settings)?;
    for _ in 0..3 {
        renderer.render(&scene.camera)?;
    }
    renderer.read_back()?;
    Ok(())
}

#[test]
fn every_combination_is_drawn_or_refused_as_the_table_says() {
    on_gpu(|gpu| {
        let rules = rules();
        let device = capabilities(&gpu.device.physical);
        let scenes = scenes();
        let (mut drawn, mut refused, mut pairs, mut turn) = (BTreeSet::new(), 0, Pairs::default(), 0);
        for (named, scene, settings) in combinations() {
            let scene = &scenes[scene];
            let settings = Settings { size: [33, 21], ..Settings { exposure: own(scene, 1, 1).exposure, ..settings } };
            match FramePlan::of(scene, &settings, &device) {
                Ok(plan) => {
                    assert!(!refused_by(&named, &rules), "the table refuses what can be drawn: {named:?}");
                    // Settings without effect, such as an HDR format without an HDR target, make the same frame.
                    let structure = (
                        plan.light_path,
                        plan.transparency,
                        plan.msaa,
                        plan.effects.fxaa,
                        plan.effects.sky.is_some(),
                        plan.effects.bloom.is_some(),
                        plan.effects.particles.is_some(),
                        plan.effects.taa.is_some(),
                        plan.reflects(),
                        plan.effects.fog.map(|fog| fog.kind.name()),
                    );
                    let formats = (plan.hdr, plan.output, plan.tone_mapping);
                    if drawn.insert(format!("{structure:?} {formats:?}")) && (tries_all() || pairs.are_new(&named)) {
                        turn += 1;
                        if turn % 52 != 1 && !tries_all() {
                            continue;
                        }
                        draw(gpu, scene, &settings).unwrap_or_else(|error| panic!("{named:?}: {error}"));
                    }
                }
                Err(error) => {
                    let sentence = error.to_string();
                    assert!(refused_by(&named, &rules), "not in the table: {named:?}: {sentence}");
                    assert!(sentence.len() > 30 && !sentence.contains('\n'), "{sentence}");
                    refused += 1;
                }
            }
        }
        eprintln!("{} kinds of frames, {refused} combinations refused", drawn.len());
        assert!(drawn.len() > 50 && refused > 100);
    });
}
