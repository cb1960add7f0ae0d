//! The panels: the frame's parts and costs, and the settings that can be changed.

mod figures;

use egui::{
    CollapsingHeader, ComboBox, Context, Grid, Id, Response, ScrollArea, Slider, SliderClamping, Ui, Vec2, pos2,
};

use glam::DVec3;

use self::figures::{frame, graph, memory, plan_parts};
use super::clock::Interval;
use super::keys::HELP;
use super::oracle::ErrorMap;
use super::player::Player;
use afterlight::frame::FrameTimes;
use afterlight::gpu::MemoryReport;
use afterlight::plan::{FramePlan, Part};
use afterlight::scene::{
    Aabb, GbufferChoice, GbufferPreset, Light, Motion, SETTINGS, Setting, Settings, ValueKind, View, decimal,
};

/// Figures of the frames so far.
pub struct Facts<'a> {
    pub device: &'a str,
    /// Intervals of the last frames, the newest at the end.
    pub intervals: &'a [Interval],
    /// Times of the last frame that is known to be done.
    pub times: FrameTimes,
    pub plan: Option<&'a FramePlan>,
    /// Parts of the plan, and parts drawn over the picture.
    pub parts: Vec<Part>,
    /// The scene's.
    pub lights: &'a [Light],
    /// The scene's.
    pub motion: &'a Motion,
    pub memory: MemoryReport,
    /// Why the last change was not made.
    pub refused: Option<&'a str>,
    /// Frames are being made for settings other than the shown ones.
    pub is_pending: bool,
    /// The picture's difference from the truth, as far as it is known.
    pub error: Option<&'a ErrorMap>,
    pub is_comparing: bool,
    pub selected: Option<Selected>,
    /// The panel of the frame's steps is open.
    pub is_stepping: bool,
    /// As `--camera` takes it.
    pub camera: String,
    /// Around all that is drawn.
    pub bounds: Aabb,
}

/// The object that was clicked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Selected {
    pub object: String,
    pub material: String,
    pub triangles: usize,
    /// Along the view, in metres.
    pub distance: f64,
    /// World-space bounding box.
    pub bounds: Aabb,
}

/// The values that panels can change, before and after they were shown.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelValues {
    pub settings: Settings,
    /// EV100.
    pub exposure: f32,
    /// Lights that were changed, by their index in the scene.
    pub lights: Vec<(usize, Light)>,
    /// Roughness of every material; `None` for each material's own.
    pub roughness: Option<f32>,
}

/// The panels that are open.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Controls {
    /// The main one.
    pub shown: bool,
    /// The keys.
    pub keys: bool,
    /// The frame's dependencies.
    pub dependencies: bool,
    /// The picture is to be compared with the truth, or not any more.
    pub asks_truth: bool,
    /// The view right of a divider, where the window is split.
    pub beside: Option<View>,
}

/// Intensities reach from a light's own by this factor to either side.
const FACTOR: f32 = 1e3;
/// Lux or candela up to which a light can be set that was dark at first, where no other tells how strong lights are.
const DARK_MOST: f32 = 1e3;

/// Points that the main panel takes from the left, and the selection from the right.
const BESIDE: [f32; 2] = [420.0, 300.0];
/// Points that the longest line of the keys takes.
const KEYS_WIDTH: f32 = 480.0;
/// Points around the content of a panel, with its title.
const AROUND: f32 = 80.0;
/// Points below which the main panel has a bar to go aside by.
const NARROW: f32 = 360.0;

/// Returns true if panels have no room beside each other: then the selection gives way to the steps of the frame.
pub fn is_small(context: &Context) -> bool {
    let size = context.content_rect().size();
    size.x < 960.0 || size.y < 600.0
}

/// Returns true if the keys have no room between the main panel and the selection: then they are shown alone.
pub fn has_keys_alone(context: &Context) -> bool {
    let size = context.content_rect().size();
    size.x < BESIDE[0] + KEYS_WIDTH + BESIDE[1] || size.y < 640.0
}

impl Controls {
    pub fn is_any_shown(self) -> bool {
        self.shown || self.keys || self.dependencies || self.beside.is_some()
    }

    /// Builds the panels that are open.
    pub fn show(&mut self, context: &Context, facts: &Facts, (values, player): (&mut PanelValues, &mut Player)) {
        let is_small = is_small(context);
        if self.keys && has_keys_alone(context) {
            return self.show_keys(context);
        }
        if self.shown {
            let window = egui::Window::new("Afterlight").default_pos(pos2(12.0, 12.0)).default_size([330.0, 560.0]);
            let mut shown = true;
            window.open(&mut shown).show(context, |ui| {
                let size = context.content_rect().size();
                let is_narrow = size.x < NARROW;
                ScrollArea::new([is_narrow, true]).max_height(size.y - AROUND).show(ui, |ui| {
                    if is_narrow {
                        ui.set_max_width(NARROW - 50.0);
                    }
                    panels(ui, facts, (values, player));
                    choose_beside(ui, &mut self.beside);
                    self.asks_truth |= ui.button("compare with the truth (T)").clicked();
                    if ui.button("dependencies (B)").clicked() {
                        self.dependencies = !self.dependencies;
                    }
                });
            });
            self.shown = shown;
        }
        if let Some(selected) = facts.selected.as_ref().filter(|_| !(is_small && facts.is_stepping)) {
            let place = (egui::Align2::RIGHT_TOP, [-12.0, 12.0]);
            egui::Window::new("Selected").anchor(place.0, place.1).resizable(false).show(context, |ui| {
                show_selected(ui, selected);
            });
        }
        if facts.is_comparing || facts.error.is_some() {
            let place = (egui::Align2::RIGHT_BOTTOM, [-12.0, -12.0]);
            egui::Window::new("Error").anchor(place.0, place.1).resizable(false).show(context, |ui| {
                show_error(ui, facts.error);
            });
        }
        if self.keys {
            self.show_keys(context);
        }
    }

    fn show_keys(&mut self, context: &Context) {
        let [left, right] = if has_keys_alone(context) { [12.0, 40.0] } else { BESIDE };
        let room = (context.content_rect().size() - Vec2::new(left + right, AROUND)).max(Vec2::splat(60.0));
        let spacing = context.style().spacing.clone();
        let height = HELP.len() as f32 * (spacing.interact_size.y + spacing.item_spacing.y);
        // A window that is low and wide has room for two columns. One that is low and narrow gets a bar.
        let columns = if height > room.y && room.x >= 2.0 * KEYS_WIDTH { 2 } else { 1 };
        let rows = HELP.len().div_ceil(columns);
        let window = egui::Window::new("Keys").default_pos(pos2(left, 12.0)).resizable(false);
        window.open(&mut self.keys).show(context, |ui| {
            // A window that cannot be resized would be as high as egui's default, whatever room there is.
            let area = ScrollArea::both().min_scrolled_width(room.x).min_scrolled_height(room.y);
            area.max_width(room.x).max_height(room.y).show(ui, |ui| {
                Grid::new("keys").num_columns(2 * columns).show(ui, |ui| {
                    for row in 0..rows {
                        for (keys, what) in HELP.iter().skip(row).step_by(rows) {
                            ui.strong(*keys);
                            ui.label(*what);
                        }
                        ui.end_row();
                    }
                });
            });
        });
    }
}

fn show_selected(ui: &mut Ui, selected: &Selected) {
    let Selected { object, material, triangles, distance, bounds } = selected;
    let rows = [
        ("object", object.clone()),
        ("material", material.clone()),
        ("triangles", triangles.to_string()),
        ("distance", format!("{distance:.3} m")),
        ("middle", place(bounds.center())),
        ("size", place(bounds.size())),
    ];
    // Long names have several lines: the main panel is beside them.
    let screen = ui.ctx().content_rect().size();
    let widest = (screen.x - BESIDE[0] - 40.0).clamp(80.0, 260.0);
    ScrollArea::vertical().max_height((screen.y - AROUND).max(60.0)).show(ui, |ui| {
        Grid::new("selected").num_columns(2).max_col_width(widest).show(ui, |ui| {
            for (what, value) in rows {
                ui.label(what);
                ui.label(value);
                ui.end_row();
            }
        });
    });
}

/// Metres, as lights are placed by them.
fn place(at: DVec3) -> String {
    at.to_array().map(|own| decimal(own, 3)).join(", ")
}

/// Shows the picture's difference from the light through the middle of each pixel, in 64 bits.
fn show_error(ui: &mut Ui, map: Option<&ErrorMap>) {
    // Reserves the final size of the contents, so that the panel does not move.
    ui.set_min_size(Vec2::new(250.0, 60.0));
    let Some(map) = map else {
        ui.label("the truth is computed...");
        return;
    };
    ui.label(format!("{:.2} of 255 codes off in the mean", map.mean()));
    ui.label(format!("{:.1}% of the pixels by more than 8 codes", 100.0 * map.share_above(8)));
    let step = map.step;
    ui.label(match step {
        1 => "every pixel compared".to_owned(),
        _ => format!("every {step} by {step} pixels so far"),
    });
}

fn panels(ui: &mut Ui, facts: &Facts, (values, player): (&mut PanelValues, &mut Player)) {
    ui.horizontal_wrapped(|ui| {
        ui.label(facts.device);
        if facts.is_pending {
            ui.weak("new frames are being made");
        }
    });
    graph(ui, facts.intervals, &facts.times);
    if let Some(refused) = facts.refused {
        ui.colored_label(ui.visuals().error_fg_color, refused);
    }
    CollapsingHeader::new("Picture").default_open(true).show(ui, |ui| picture(ui, facts, values));
    if !facts.motion.clips.is_empty() {
        let title = format!("Clips ({})", facts.motion.clips.len());
        CollapsingHeader::new(title).default_open(true).show(ui, |ui| player.panel(ui, facts.motion));
    }
    CollapsingHeader::new("Shadows").show(ui, |ui| rows(ui, &mut values.settings, true));
    let own = facts.lights;
    CollapsingHeader::new(format!("Lights ({})", own.len())).show(ui, |ui| lights(ui, own, &mut values.lights));
    CollapsingHeader::new("Frame").default_open(true).show(ui, |ui| frame(ui, &facts.times));
    CollapsingHeader::new("Memory").show(ui, |ui| memory(ui, &facts.memory));
    CollapsingHeader::new("Camera and scene").show(ui, |ui| {
        ui.label(format!("--camera {}", facts.camera));
        ui.label(format!("--exposure {:.2}", values.exposure));
        let Aabb { min, max } = facts.bounds;
        ui.label(format!("the scene, in metres: from {} to {}", place(min), place(max)));
    });
    if facts.plan.is_some() {
        let parts = &facts.parts;
        let out = parts.iter().filter(|part| !part.included).count();
        CollapsingHeader::new(format!("Plan: {} parts in, {out} left out", parts.len() - out)).show(ui, |ui| {
            plan_parts(ui, parts);
        });
    }
}

fn picture(ui: &mut Ui, facts: &Facts, values: &mut PanelValues) {
    if facts.plan.is_some_and(|plan| plan.exposes) {
        // A scene may have one beyond, which stays until it is changed.
        let slider = Slider::new(&mut values.exposure, -6.0..=20.0).clamping(SliderClamping::Edits);
        ui.add(slider.text("exposure, EV100"));
    }
    roughness(ui, &mut values.roughness);
    rows(ui, &mut values.settings, false);
}

/// Builds the rows of the settings table: of shadows, or of everything else.
fn rows(ui: &mut Ui, settings: &mut Settings, of_shadows: bool) {
    for setting in SETTINGS.iter().filter(|own| own.in_panel && own.toml.starts_with("shadows.") == of_shadows) {
        if setting.values == ValueKind::Layout {
            layout(ui, setting, &mut settings.gbuffer);
        } else if let Some(chosen) = row(ui, setting, setting.text(&settings.patch())) {
            let mut patch = settings.patch();
            // Panels offer no value that the setting cannot have.
            let _ = setting.set(&mut patch, chosen.as_deref());
            *settings = Settings { output: settings.output, ..patch.decide() };
        }
    }
}

/// Shows a setting and returns its new value, if it is changed: a slider for numbers that are not counted, else a box or a menu of all values.
fn row(ui: &mut Ui, setting: &Setting, text: Option<String>) -> Option<Option<String>> {
    let id = ui.id().with(setting.key);
    if let (ValueKind::Number(from, to), Some(number)) =
        (setting.values, text.as_ref().and_then(|text| text.parse().ok()))
    {
        let slider = |ui: &mut Ui, number: &mut f32| {
            let slider = Slider::new(number, from..=to).logarithmic(to - from > 10.0);
            ui.add(slider.text(setting.label())).on_hover_text(setting.help)
        };
        return settled(ui, id, number, slider).map(|number| Some(number.to_string()));
    }
    let mut chosen = text.clone();
    if let (ValueKind::OnOff, Some(now)) = (setting.values, &text) {
        let mut on = now == "on";
        ui.checkbox(&mut on, setting.title).on_hover_text(setting.help);
        chosen = Some(if on { "on" } else { "off" }.to_owned());
    } else {
        let tried = setting.tried.iter().map(|number| (*number).to_owned());
        let mut all = if setting.tried.is_empty() { setting.values.all() } else { tried.collect() };
        // A file may set a value that the panel does not offer.
        all.extend(text.clone().filter(|text| !all.contains(text)));
        let unset = Some((setting.unset.to_owned(), None)).filter(|(name, _)| !name.is_empty());
        let names: Vec<_> = unset.into_iter().chain(all.into_iter().map(|text| (text.clone(), Some(text)))).collect();
        choose(ui, &setting.label(), &mut chosen, &names).on_hover_text(setting.help);
    }
    (chosen != text).then_some(chosen)
}

/// Targets that were chosen one by one go with the preset that they were chosen over.
fn layout(ui: &mut Ui, setting: &Setting, gbuffer: &mut GbufferChoice) {
    let mut preset = gbuffer.preset;
    choose(ui, setting.title, &mut preset, GbufferPreset::NAMES).on_hover_text(setting.help);
    if preset != gbuffer.preset {
        *gbuffer = GbufferChoice { preset, ..GbufferChoice::default() };
    }
}

/// A number that is changed by `widget`, as soon as it is let go: frames are made anew for another.
fn settled(ui: &mut Ui, id: Id, number: f32, widget: impl FnOnce(&mut Ui, &mut f32) -> Response) -> Option<f32> {
    let mut dragged = ui.data(|data| data.get_temp(id)).unwrap_or(number);
    let response = widget(ui, &mut dragged);
    let is_held = response.dragged() && !response.drag_stopped();
    ui.data_mut(|data| if is_held { data.insert_temp(id, dragged) } else { data.remove::<f32>(id) });
    Some(dragged).filter(|_| !is_held && dragged != number)
}

fn roughness(ui: &mut Ui, roughness: &mut Option<f32>) {
    ui.horizontal(|ui| {
        let mut overrides = roughness.is_some();
        ui.checkbox(&mut overrides, "all roughness");
        if overrides != roughness.is_some() {
            *roughness = overrides.then_some(0.5);
        }
        let Some(value) = roughness else { return };
        let slider = |ui: &mut Ui, number: &mut f32| ui.add(Slider::new(number, 0.0..=1.0));
        *value = settled(ui, ui.id().with("roughness"), *value, slider).unwrap_or(*value);
    });
}

/// A slider for each light's intensity.
fn lights(ui: &mut Ui, lights: &[Light], changed: &mut Vec<(usize, Light)>) {
    ScrollArea::vertical().id_salt("lights").max_height(160.0).show(ui, |ui| {
        for (index, light) in lights.iter().enumerate() {
            // Around the light's intensity when its slider was first shown.
            let id = ui.id().with(index);
            let own: f32 = ui.data_mut(|data| *data.get_temp_mut_or(id, light.intensity));
            let name = if light.name.is_empty() { format!("light {index}") } else { light.name.clone() };
            let mut intensity = light.intensity;
            let slider = match own > 0.0 {
                true => Slider::new(&mut intensity, own / FACTOR..=own * FACTOR).logarithmic(true),
                false => Slider::new(&mut intensity, 0.0..=most_of_dark(lights, index)),
            };
            // Others may have become weaker than this one is.
            ui.add(slider.clamping(SliderClamping::Edits).text(name));
            if intensity != light.intensity {
                changed.push((index, Light { intensity, ..light.clone() }));
            }
        }
    });
}

/// Returns the greatest intensity to which a light can be set that was dark at first: the strongest of the others in its unit.
fn most_of_dark(lights: &[Light], index: usize) -> f32 {
    let unit = |light: &Light| light.kind.form().unit;
    let others =
        lights.iter().enumerate().filter(|&(other, light)| other != index && unit(light) == unit(&lights[index]));
    let most = others.map(|(_, light)| light.intensity).fold(0.0, f32::max);
    if most > 0.0 { most } else { DARK_MOST }
}

/// Offers the views to show right of the divider.
fn choose_beside(ui: &mut Ui, beside: &mut Option<View>) {
    let views = View::NAMES.iter().map(|&(name, view)| (name, Some(view)));
    let names: Vec<_> = std::iter::once(("nothing", None)).chain(views).collect();
    choose(ui, "right of a divider (X)", beside, &names);
}

/// One value of a table of names.
fn choose<N: AsRef<str>, T: Clone + PartialEq>(ui: &mut Ui, label: &str, value: &mut T, names: &[(N, T)]) -> Response {
    let name = names.iter().find(|(_, own)| own == value).map_or("", |(name, _)| name.as_ref());
    let menu = ComboBox::from_label(label).selected_text(name).show_ui(ui, |ui| {
        for (name, own) in names {
            ui.selectable_value(value, own.clone(), name.as_ref());
        }
    });
    menu.response
}

#[cfg(test)]
mod tests {
    use egui::Shape;
    use glam::DVec3;

    use super::*;
    use crate::overlay::context;
    use afterlight::scene::{Falloff, LightKind, SettingsPatch};

    #[test]
    fn every_setting_of_the_panel_has_its_row_and_none_changes_by_itself() {
        let context = context();
        // No row has its default but may be anything that a file says.
        let mut settings =
            "anisotropy=5 gbuffer=fat,normal=rgb10a2 msaa=4 shadow-normal-offset=3".parse::<SettingsPatch>();
        let mut settings = settings.as_mut().map(|patch| patch.decide()).expect("settings");
        let before = settings.clone();
        let screen = egui::Rect::from_min_size(pos2(0.0, 0.0), Vec2::new(800.0, 4000.0));
        let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
        let output = context.run(input, |context| {
            egui::CentralPanel::default().show(context, |ui| {
                rows(ui, &mut settings, false);
                rows(ui, &mut settings, true);
            });
        });
        assert_eq!(settings, before);
        let shown: Vec<&str> = output
            .shapes
            .iter()
            .filter_map(|clipped| match &clipped.shape {
                Shape::Text(text) => Some(text.galley.text()),
                _ => None,
            })
            .collect();
        for setting in SETTINGS.iter().filter(|setting| setting.in_panel) {
            assert!(shown.iter().any(|text| text.starts_with(setting.title)), "{} is not in {shown:?}", setting.title);
        }
        assert!(["fat", "5", "4", "3.0"].iter().all(|value| shown.contains(value)), "{shown:?}");
    }

    /// The rectangles of the panels that are open in a window of this size, with their names.
    fn open_panels(size: Vec2, keys: bool, is_stepping: bool, name: &str) -> Vec<(&'static str, egui::Rect)> {
        let context = context();
        let mut values =
            PanelValues { settings: Settings::default(), exposure: 9.0, lights: Vec::new(), roughness: None };
        let mut controls = Controls { shown: true, keys, ..Controls::default() };
        let bounds = Aabb { min: DVec3::splat(-1234.5), max: DVec3::splat(987.654) };
        // The sizes of panels are known after the first frame that shows them.
        for _ in 0..3 {
            let facts = Facts {
                device: "llvmpipe (LLVM 15.0.6, 256 bits)",
                intervals: &[],
                times: FrameTimes::default(),
                plan: None,
                parts: Vec::new(),
                lights: &[],
                motion: &Motion::default(),
                memory: MemoryReport::default(),
                refused: None,
                is_pending: false,
                error: None,
                is_comparing: !is_stepping,
                selected: Some(Selected {
                    object: name.into(),
                    material: format!("material of {name}"),
                    triangles: 123_456,
                    distance: 1234.5,
                    bounds,
                }),
                is_stepping,
                camera: "-1325.61,122.5,-38.69/8634.14,1018.87,-38.69/60".into(),
                bounds,
            };
            let input = egui::RawInput {
                screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size)),
                ..Default::default()
            };
            let _ = context.run(input, |context| controls.show(context, &facts, (&mut values, &mut Player::default())));
        }
        let found = |name: &'static str| {
            let visible = context
                .memory(|memory| memory.areas().is_visible(&egui::LayerId::new(egui::Order::Middle, Id::new(name))));
            Some((name, context.memory(|memory| memory.area_rect(Id::new(name))).filter(|_| visible)?))
        };
        ["Afterlight", "Selected", "Error", "Keys"].into_iter().filter_map(found).collect()
    }

    #[test]
    fn panels_do_not_overlap_in_a_small_window_nor_leave_it() {
        let sizes = [[640.0, 360.0], [960.0, 600.0], [1280.0, 720.0], [1280.0, 800.0], [2560.0, 1440.0]];
        for size in sizes.map(Vec2::from) {
            for (keys, is_stepping) in [(false, false), (false, true), (true, false)] {
                let panels = open_panels(size, keys, is_stepping, "a column with a long name");
                let names: Vec<&str> = panels.iter().map(|&(name, _)| name).collect();
                match (keys, is_stepping) {
                    (false, false) => assert_eq!(names, ["Afterlight", "Selected", "Error"]),
                    (true, false) if size.x < 1200.0 => assert_eq!(names, ["Keys"]),
                    (true, _) => assert_eq!(names, ["Afterlight", "Selected", "Error", "Keys"]),
                    (false, true) => assert_eq!(names.contains(&"Selected"), size.x >= 960.0, "{names:?}"),
                }
                let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, size);
                for (index, (name, own)) in panels.iter().enumerate() {
                    assert!(screen.contains_rect(*own), "{name} is at {own:?} of {size:?}");
                    for (other, next) in &panels[index + 1..] {
                        let overlap = own.intersect(*next);
                        assert!(!overlap.is_positive(), "{name} {own:?} and {other} {next:?} in {size:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn each_panel_stays_in_a_tiny_window_and_with_any_name() {
        let name = "a name of many words that an exporter has made of all the layers that were once around the object in a file ".repeat(2);
        for size in [[400.0, 260.0], [640.0, 360.0]].map(Vec2::from) {
            for (keys, is_stepping) in [(false, false), (false, true), (true, false)] {
                for (panel, own) in open_panels(size, keys, is_stepping, &name) {
                    let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, size);
                    assert!(screen.contains_rect(own), "{panel} is at {own:?} of {size:?}");
                }
            }
        }
    }

    /// The lines of the keys that are seen in a window of this size, after the wheel has gone this far down over them.
    fn seen_keys(size: Vec2, wheel: f32) -> Vec<&'static str> {
        let context = context();
        let mut controls = Controls { keys: true, ..Controls::default() };
        let mut seen = Vec::new();
        for frame in 0..30 {
            let mut events = vec![egui::Event::PointerMoved(pos2(100.0, 100.0))];
            if frame == 5 && wheel != 0.0 {
                let delta = Vec2::new(0.0, -wheel);
                let (unit, modifiers) = (egui::MouseWheelUnit::Point, egui::Modifiers::NONE);
                events.push(egui::Event::MouseWheel { unit, delta, modifiers });
            }
            let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, size);
            let time = Some(f64::from(frame) * 0.1);
            let input = egui::RawInput { screen_rect: Some(screen), time, events, ..Default::default() };
            let output = context.run(input, |context| controls.show_keys(context));
            let texts: Vec<String> = output
                .shapes
                .iter()
                .filter_map(|own| match &own.shape {
                    Shape::Text(text) if own.clip_rect.intersect(screen).contains_rect(text.visual_bounding_rect()) => {
                        Some(text.galley.text().to_owned())
                    }
                    _ => None,
                })
                .collect();
            let is_seen = |what: &&str| texts.iter().any(|text| text == what);
            seen = HELP.iter().map(|&(_, what)| what).filter(is_seen).collect();
        }
        seen
    }

    #[test]
    fn all_keys_are_seen_at_once_in_usual_windows_and_by_the_wheel_in_small_ones() {
        let all: Vec<&str> = HELP.iter().map(|&(_, what)| what).collect();
        for size in
            [[1280.0, 720.0], [1280.0, 800.0], [1024.0, 768.0], [800.0, 640.0], [1366.0, 500.0], [3840.0, 2160.0]]
        {
            assert_eq!(seen_keys(size.into(), 0.0), all, "{size:?}");
        }
        let small = Vec2::new(640.0, 360.0);
        let (first, last) = (seen_keys(small, 0.0), seen_keys(small, 2000.0));
        assert!(first.contains(&all[0]) && last.contains(&all[all.len() - 1]), "{first:?} {last:?}");
        assert!(all.iter().all(|what| {
            [seen_keys(small, 130.0), seen_keys(small, 260.0), first.clone(), last.clone()].concat().contains(what)
        }));
    }

    #[test]
    fn a_dark_light_can_be_set_to_what_others_in_its_unit_have() {
        let light = |kind: LightKind, intensity: f32| Light { intensity, ..Light::of(kind) };
        let sun = |lux| light(LightKind::Directional { direction: DVec3::NEG_Y }, lux);
        let point = LightKind::Point { position: DVec3::ZERO, range: None, falloff: Falloff::InverseSquare };
        let lights = [sun(9e4), light(point, 0.0), light(point, 30.0), light(point, 70.0), sun(0.0)];
        assert_eq!([1, 4, 0].map(|index| most_of_dark(&lights, index)), [70.0, 9e4, DARK_MOST]);
    }
}
