//! The settings that are swept, and their values.

use super::Base;
use crate::scene::{
    GbufferChoice, GbufferPreset, HdrFormat, LightPath, MSAA, SettingsPatch, ShadowFilter, TARGETS, Transparency,
};

/// A setting with its values.
pub struct Axis {
    pub key: String,
    pub title: String,
    pub candidates: Vec<Candidate>,
    /// Why the scene has no use for it at all.
    pub without: Option<String>,
    /// The settings as given are a member although no value says the same.
    pub as_given: bool,
}

/// A value.
#[derive(Debug, Clone)]
pub struct Candidate {
    pub label: String,
    pub value: Option<f64>,
    pub patch: SettingsPatch,
    /// Takes part in the joint family.
    pub joint: bool,
}

/// The keys of the axes; that of shadow map sizes has one for each filter, as `shadow-size/none`.
pub const KEYS: &[&str] = &[
    "gbuffer",
    "shadow-size",
    "shadow-filter",
    "shadow-normal-offset",
    "shadow-slope-bias",
    "cascades",
    "shadow-lambda",
    "light-path",
    "light-cutoff",
    "depth-prepass",
    "textbook",
    "hdr-format",
    "transparency",
    "msaa",
    "samples",
    "fxaa",
    "anisotropy",
];

impl Axis {
    fn new(key: &str, title: &str, candidates: Vec<Candidate>) -> Self {
        Self { key: key.into(), title: title.into(), candidates, without: None, as_given: false }
    }

    /// Left out for this reason, where there is one.
    fn unless(self, without: Option<&str>) -> Self {
        Self { without: without.map(str::to_owned), ..self }
    }

    /// Whether it is of the family that somebody asks for by `key`: `shadow-size/none` is of `shadow-size`.
    pub fn is_of(&self, key: &str) -> bool {
        self.key == key || self.key.split_once('/').is_some_and(|(family, _)| family == key)
    }
}

impl Candidate {
    fn named(label: impl ToString, patch: SettingsPatch) -> Self {
        Self { label: label.to_string(), value: None, patch, joint: true }
    }

    fn number(value: impl ToString, patch: SettingsPatch) -> Self {
        // The digits of its own type: 0.7 of 32 bits has many more in 64.
        let label = value.to_string();
        Self { value: label.parse().ok(), label, patch, joint: true }
    }

    fn alone(self) -> Self {
        Self { joint: false, ..self }
    }
}

/// Nothing said yet.
fn patch() -> SettingsPatch {
    SettingsPatch::default()
}

/// All axes, in the order in which families are shown.
pub fn all(base: &Base, quick: bool) -> Vec<Axis> {
    let mut axes = vec![gbuffer(quick)];
    axes.extend(shadow_axes(base, quick));
    axes.extend(light_axes(base, quick));
    axes.extend(sampling_axes(quick));
    debug_assert!(axes.iter().all(|axis| KEYS.iter().any(|key| axis.is_of(key))));
    axes
}

fn gbuffer(quick: bool) -> Axis {
    let choice = |text: &str, gbuffer| Candidate::named(text, SettingsPatch { gbuffer: Some(gbuffer), ..patch() });
    let presets = GbufferPreset::NAMES.iter();
    let presets =
        presets.map(|&(name, preset)| choice(name, GbufferChoice { preset, ..GbufferChoice::default() })).collect();
    let mut axis = Axis::new("gbuffer", "Formats of the G-buffer", presets);
    for &(target, formats) in TARGETS {
        for &format in formats {
            let mut lean = GbufferChoice::default();
            let slot = match target {
                "position" => &mut lean.position,
                "normal" => &mut lean.normal,
                "albedo" => &mut lean.albedo,
                _ => &mut lean.material,
            };
            *slot = Some(format);
            if !quick {
                axis.candidates.push(choice(&format!("{target} {format}"), lean).alone());
            }
        }
    }
    axis
}

/// Filters whose maps are swept in size, beside the one that is given.
const SIZED_FILTERS: [ShadowFilter; 2] = [ShadowFilter::None, ShadowFilter::Box5];

fn shadow_axes(base: &Base, quick: bool) -> Vec<Axis> {
    let without = base.plan.shadow.is_none().then_some("no shadow map is looked up in this scene");
    let of_sun = without.or((!base.has_sun_shadow()).then_some("no directional light casts a shadow"));
    let sizes: &[u32] = if quick { &[512, 2048, 4096] } else { &[256, 512, 1024, 2048, 4096, 8192] };
    let sized = |filter: Option<ShadowFilter>| {
        let patch = |&size| SettingsPatch { shadow_size: Some(size), shadow_filter: filter, ..patch() };
        sizes.iter().map(|size| Candidate::number(*size, patch(size))).collect::<Vec<_>>()
    };
    let mut axes = vec![Axis::new("shadow-size", "Texels along an edge of a shadow map", sized(None)).unless(without)];
    let swept = SIZED_FILTERS.iter().filter(|filter| !quick && **filter != base.settings.shadows.filter);
    for filter in swept {
        let (key, title) = (format!("shadow-size/{filter}"), format!("Texels of a shadow map, filter {filter}"));
        let candidates = sized(Some(*filter)).into_iter().map(Candidate::alone).collect();
        axes.push(Axis::new(&key, &title, candidates).unless(without));
    }
    axes.push(shadow_filters(base, quick).unless(without));
    if !quick {
        let offset = |&value: &f32| {
            Candidate::number(value, SettingsPatch { shadow_normal_offset: Some(value), ..patch() }).alone()
        };
        let slope = |&value: &f32| {
            Candidate::number(value, SettingsPatch { shadow_slope_bias: Some(value), ..patch() }).alone()
        };
        let offsets = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0].iter().map(offset).collect();
        let slopes = [0.0, 0.5, 0.75, 1.5, 3.0, 6.0].iter().map(slope).collect();
        let title = "Bias of shadows along the normal, in texels";
        axes.push(Axis::new("shadow-normal-offset", title, offsets).unless(without));
        axes.push(Axis::new("shadow-slope-bias", "Bias of shadows by slope", slopes).unless(without));
    }
    let cascades: &[u32] = if quick { &[1] } else { &[1, 2, 3, 4] };
    let cascades =
        cascades.iter().map(|&count| Candidate::number(count, SettingsPatch { cascades: Some(count), ..patch() }));
    axes.push(Axis::new("cascades", "Shadow maps of a directional light", cascades.collect()).unless(of_sun));
    if !quick {
        let lambda =
            |&value: &f32| Candidate::number(value, SettingsPatch { shadow_lambda: Some(value), ..patch() }).alone();
        let lambdas = [0.0, 0.25, 0.5, 0.7, 0.85, 1.0].iter().map(lambda).collect();
        let single = of_sun.or((!base.has_cascades()).then_some("a directional light has one map"));
        axes.push(Axis::new("shadow-lambda", "How cascades part the view", lambdas).unless(single));
    }
    axes
}

/// All filters, and no shadows at all.
fn shadow_filters(base: &Base, quick: bool) -> Axis {
    let sized = base.scene.lights.iter().any(|light| light.casts_shadow && light.size > 0.0);
    let filters = ShadowFilter::NAMES.iter().filter(|(_, filter)| sized || *filter != ShadowFilter::Pcss);
    let middling = [ShadowFilter::Box2, ShadowFilter::Box3, ShadowFilter::Poisson];
    let filters = filters.filter(|(_, filter)| !quick || !middling.contains(filter));
    let off = Candidate::named("off", SettingsPatch { shadows: Some(false), ..patch() }).alone();
    let filters = filters.map(|&(name, filter)| {
        let one = Candidate::named(name, SettingsPatch { shadow_filter: Some(filter), ..patch() });
        // Drawn forward it takes lavapipe seconds a frame, and many to compile.
        Candidate { joint: !quick || filter != ShadowFilter::Pcss, ..one }
    });
    Axis::new("shadow-filter", "Filters of shadows", std::iter::once(off).chain(filters).collect())
}

fn light_axes(base: &Base, quick: bool) -> Vec<Axis> {
    let paths = LightPath::NAMES.iter().filter(|(_, path)| *path != LightPath::Auto);
    // Those that `auto` never takes are there to be compared with.
    let slow = [LightPath::PerLight, LightPath::Volumes, LightPath::ForwardNaive];
    let paths = paths.filter(|(_, path)| !quick || !slow.contains(path));
    let paths = paths
        .map(|&(name, path)| Candidate::named(name, SettingsPatch { light_path: Some(path), ..patch() }))
        .collect();
    let on_off = |change: fn(bool) -> SettingsPatch| {
        [("off", false), ("on", true)].map(|(label, on)| Candidate::named(label, change(on)).alone()).to_vec()
    };
    let unlit = base.scene.lights.is_empty().then_some("the scene has no light");
    let mut axes = vec![Axis::new("light-path", "How pixels meet their lights", paths).unless(unlit)];
    if !quick {
        let cutoff = on_off(|on| SettingsPatch { light_cutoff: Some(on), ..patch() });
        let why = "all lights have a range, or none grows weaker with distance";
        let cut = base.scene.lights.iter().any(unbounded);
        axes.push(Axis::new("light-cutoff", "A range for lights without one", cutoff).unless((!cut).then_some(why)));
        let prepass = on_off(|on| SettingsPatch { depth_prepass: Some(on), ..patch() });
        axes.push(Axis::new("depth-prepass", "The depth of surfaces drawn first", prepass));
        let textbook = on_off(|on| SettingsPatch { textbook: Some(on), ..patch() });
        axes.push(Axis::new("textbook", "Reflection models as in textbooks", textbook).unless(unlit));
    }
    let formats = HdrFormat::NAMES.iter();
    let formats = formats
        .map(|&(name, format)| Candidate::named(name, SettingsPatch { hdr_format: Some(format), ..patch() }))
        .collect();
    let no_target = "the frame has no HDR target: light is tone-mapped as it is computed";
    let without = base.plan.hdr.is_none().then_some(no_target);
    axes.push(Axis::new("hdr-format", "The format that light is blended in", formats).unless(without));
    let blending = [Transparency::Sorted, Transparency::Oit]
        .map(|one| Candidate::named(one, SettingsPatch { transparency: Some(one), ..patch() }));
    let transparent = base.scene.objects.iter().any(|object| base.scene.materials[object.material].is_transparent());
    let without = (!transparent).then_some("nothing in this scene is transparent");
    axes.push(Axis::new("transparency", "How transparent surfaces are blended", blending.to_vec()).unless(without));
    axes
}

fn unbounded(light: &crate::scene::Light) -> bool {
    use crate::scene::{Falloff, LightKind};
    match light.kind {
        LightKind::Directional { .. } => false,
        LightKind::Point { range, falloff, .. } | LightKind::Spot { range, falloff, .. } => {
            range.is_none() && !matches!(falloff, Falloff::Polynomial { linear: 0.0, quadratic: 0.0, .. })
        }
    }
}

fn sampling_axes(quick: bool) -> Vec<Axis> {
    let counts: &[u32] = if quick { &[1, 4] } else { &[1, 2, 4, 8, 16, 32, 64] };
    // A picture of many takes so long that combinations with it would take most of the time.
    let most = if quick { 1 } else { 16 };
    let samples = counts.iter().map(|&count| {
        let one = Candidate::number(count, SettingsPatch { samples: Some(count), ..patch() });
        Candidate { joint: count <= most, ..one }
    });
    let msaa = MSAA.iter().map(|&count| {
        let one = Candidate::number(count, SettingsPatch { msaa: Some(count), ..patch() });
        Candidate { joint: count <= most, ..one }
    });
    let fxaa = [("off", false), ("on", true)]
        .map(|(label, on)| Candidate::named(label, SettingsPatch { fxaa: Some(on), ..patch() }));
    let degrees: &[u32] = if quick { &[1] } else { &[1, 2, 4, 8, 16] };
    let anisotropy =
        degrees.iter().map(|&degree| Candidate::number(degree, SettingsPatch { anisotropy: Some(degree), ..patch() }));
    vec![
        Axis::new("msaa", "Samples of the hardware in each pixel", msaa.collect()),
        Axis::new("samples", "Jittered frames a picture", samples.collect()),
        Axis::new("fxaa", "Smoothing of the finished picture", fxaa.to_vec()),
        Axis::new("anisotropy", "Anisotropy of textures", anisotropy.collect()),
    ]
}
