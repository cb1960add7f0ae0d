//! The settings that are swept, and their values.

use super::Base;
use afterlight::plan::effects;
use afterlight::scene::{
    GbufferChoice, GbufferPreset, SETTINGS, Setting, SettingsPatch, ShadowFilter, SweepMode, TARGETS, ValueKind,
};

/// A setting with its values.
pub struct SweepAxis {
    pub key: String,
    pub title: String,
    pub candidates: Vec<Candidate>,
    /// Why the scene has no use for it at all.
    pub without: Option<&'static str>,
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

/// The settings that have axes; the size of shadow maps has an axis for each filter, as `shadow-size/none`.
pub fn swept() -> impl Iterator<Item = &'static Setting> {
    SETTINGS.iter().filter(|setting| setting.sweep != SweepMode::No)
}

impl SweepAxis {
    /// Returns true if it is of the family that somebody asks for by `key`: `shadow-size/none` is of `shadow-size`.
    pub fn is_of(&self, key: &str) -> bool {
        self.key == key || self.key.split_once('/').is_some_and(|(family, _)| family == key)
    }
}

impl Candidate {
    fn of(setting: &Setting, text: &str) -> Option<Self> {
        let is_number = matches!(setting.values, ValueKind::Whole(..) | ValueKind::Among(_) | ValueKind::Number(..));
        Some(Self {
            label: text.to_owned(),
            value: text.parse().ok().filter(|_| is_number),
            patch: setting.read(text).ok()?,
            joint: setting.sweep == SweepMode::Joint,
        })
    }

    fn alone(label: impl ToString, patch: SettingsPatch) -> Self {
        Self { label: label.to_string(), value: None, patch, joint: false }
    }
}

/// All axes, in the order in which families are shown.
pub fn all(base: &Base, quick: bool) -> Vec<SweepAxis> {
    let mut axes = Vec::new();
    for setting in swept().filter(|setting| !quick || setting.sweep == SweepMode::Joint) {
        let axis = axis(base, setting, quick);
        let sized = if setting.key == "shadow-size" && !quick { sizes_by_filter(base, &axis) } else { Vec::new() };
        axes.push(axis);
        axes.extend(sized);
    }
    axes
}

/// The values of a setting, as its row has them.
fn axis(base: &Base, setting: &Setting, quick: bool) -> SweepAxis {
    let listed = [setting.quick, setting.tried].into_iter().skip(usize::from(!quick)).find(|listed| !listed.is_empty());
    let texts = match (listed, setting.values) {
        (Some(listed), _) => listed.iter().map(|text| (*text).to_owned()).collect(),
        (None, ValueKind::Layout) => GbufferPreset::NAMES.iter().map(|(name, _)| (*name).to_owned()).collect(),
        (None, values) => values.all(),
    };
    let mut candidates: Vec<_> = texts.iter().filter_map(|text| Candidate::of(setting, text)).collect();
    add_candidates_for(base, setting, quick, &mut candidates);
    let mut title = setting.label();
    if let Some(first) = title.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    SweepAxis { key: setting.key.into(), title, candidates, without: without(base, setting.key), as_given: false }
}

/// Adapts the values of some settings to the scene, to `--quick` and to the settings as given.
fn add_candidates_for(base: &Base, setting: &Setting, quick: bool, candidates: &mut Vec<Candidate>) {
    match setting.key {
        "gbuffer" if !quick => candidates.extend(single_targets()),
        // The plan's own choice is one of the others.
        "light-path" => candidates.retain(|one| one.label != "auto"),
        "shadow-filter" => {
            let sized = base.scene.lights.iter().any(|light| light.casts_shadow && light.size > 0.0);
            candidates.retain(|one| sized || one.label != "pcss");
            // Drawn forward it takes lavapipe seconds a frame, and many to compile.
            candidates.iter_mut().for_each(|one| one.joint &= !quick || one.label != "pcss");
            let off = SettingsPatch { shadows: Some(false), ..SettingsPatch::default() };
            candidates.insert(0, Candidate::alone("off", off));
        }
        // A picture of many takes so long that combinations with it would take most of the time.
        "samples" | "msaa" => {
            let most = if quick { 1.0 } else { 16.0 };
            candidates.iter_mut().for_each(|one| one.joint &= one.value.is_some_and(|count| count <= most));
        }
        _ => {}
    }
    // As `render` has it: another kind of anti-aliasing takes the place of the samples.
    if setting.smooths && setting.key != "samples" && base.settings.samples > 1 {
        let smooth = candidates.iter_mut().filter(|one| !matches!(one.label.as_str(), "1" | "off"));
        smooth.for_each(|one| one.patch.samples = Some(1));
    }
}

/// Each format of each target, the others as `lean` has them.
fn single_targets() -> impl Iterator<Item = Candidate> {
    TARGETS.iter().flat_map(|&(target, formats)| formats.iter().map(move |format| (target, format))).filter_map(
        |(target, format)| {
            let gbuffer = format!("{target}={format}").parse::<GbufferChoice>().ok()?;
            let patch = SettingsPatch { gbuffer: Some(gbuffer), ..SettingsPatch::default() };
            Some(Candidate::alone(format!("{target} {format}"), patch))
        },
    )
}

/// Filters whose maps are swept in size, beside the one that is given.
const SIZED_FILTERS: [ShadowFilter; 2] = [ShadowFilter::None, ShadowFilter::Box5];

fn sizes_by_filter(base: &Base, sizes: &SweepAxis) -> Vec<SweepAxis> {
    let filters = SIZED_FILTERS.into_iter().filter(|filter| *filter != base.settings.shadows.filter);
    let axis = |filter: ShadowFilter| SweepAxis {
        key: format!("{}/{filter}", sizes.key),
        title: format!("{}, filter {filter}", sizes.title),
        candidates: sizes.candidates.iter().map(|one| filtered(one, filter)).collect(),
        ..*sizes
    };
    filters.map(axis).collect()
}

fn filtered(size: &Candidate, filter: ShadowFilter) -> Candidate {
    let patch = SettingsPatch { shadow_filter: Some(filter), ..size.patch.clone() };
    Candidate { patch, joint: false, ..size.clone() }
}

/// Why a scene has no use for a setting, if it has none.
fn without(base: &Base, key: &str) -> Option<&'static str> {
    let (scene, shadows) = (base.scene, key.starts_with("shadow") || key == "cascades");
    let transparent = || scene.objects.iter().any(|object| scene.materials[object.material].is_transparent());
    match key {
        _ if shadows && base.plan.shadow.is_none() => Some("no shadow map is looked up in this scene"),
        "cascades" | "shadow-lambda" if !base.has_sun_shadow() => Some("no directional light casts a shadow"),
        "shadow-lambda" if !base.has_cascades() => Some("a directional light has one map"),
        "light-path" | "textbook" if scene.lights.is_empty() => Some("the scene has no light"),
        "light-cutoff" if !scene.lights.iter().any(unbounded) => {
            Some("all lights have a range, or none grows weaker with distance")
        }
        "hdr-format" if base.plan.hdr.is_none() => {
            Some("the frame has no HDR target: light is tone-mapped as it is computed")
        }
        "transparency" if !transparent() && effects::of(&base.plan).all(|effect| effect.blended.is_none()) => {
            Some("nothing in this scene is transparent")
        }
        _ => effects::unswept(key, scene, &base.plan),
    }
}

fn unbounded(light: &afterlight::scene::Light) -> bool {
    use afterlight::scene::Falloff;
    let form = light.kind.form();
    let constant = |falloff| matches!(falloff, Falloff::Polynomial { linear: 0.0, quadratic: 0.0, .. });
    form.range.is_none() && form.falloff.is_some_and(|falloff| !constant(falloff))
}
