//! egui in the window: events go in, triangles for [`afterlight::passes::overlay`] come out. The panels themselves are [`super::controls`]'s.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use std::time::Duration;

use egui::epaint::{ClippedPrimitive, Primitive};
use egui::{ColorImage, FontData, FontDefinitions, FontFamily, ImageData, TextureId, TexturesDelta, ViewportId};
use epaint_default_fonts::{HACK_REGULAR, UBUNTU_LIGHT};
use winit::event::WindowEvent;
use winit::window::Window;

use afterlight::gpu::vk;
use afterlight::passes::overlay::{PanelDraw, PanelTexture, PanelVertex, Panels};

/// The user interface of one window.
pub struct Overlay {
    context: egui::Context,
    state: egui_winit::State,
    /// The textures with all changes so far, which the device may not have yet: egui only hands over changes.
    textures: HashMap<u64, ColorImage>,
    /// The textures whose changes are not on the device yet.
    changed: BTreeSet<u64>,
    /// Position of the pointer, in points.
    pointer: egui::Pos2,
    /// Textures that are not needed when the next frame is drawn.
    spent: Vec<u64>,
}

/// The effect of an event on the panels.
pub struct PanelResponse {
    /// Nobody else should act on it.
    pub consumed: bool,
    /// True if the panels may look different.
    pub changes: bool,
}

impl Overlay {
    pub fn new(window: &Window, largest_texture: u32) -> Self {
        let context = context();
        let scale = Some(window.scale_factor() as f32);
        let largest = Some(largest_texture as usize);
        let state = egui_winit::State::new(context.clone(), ViewportId::ROOT, window, scale, None, largest);
        Self {
            context,
            state,
            textures: HashMap::new(),
            changed: BTreeSet::new(),
            pointer: egui::Pos2::ZERO,
            spent: Vec::new(),
        }
    }

    /// Returns egui's context of the window.
    pub fn context(&self) -> &egui::Context {
        &self.context
    }

    /// Hands an event of the window on, which is forgotten if nothing is shown.
    pub fn event(&mut self, window: &Window, event: &WindowEvent, shown: bool) -> PanelResponse {
        let response = self.state.on_window_event(window, event);
        let consumed = match event {
            // A key that no text field waits for is the window's own.
            WindowEvent::KeyboardInput { .. } => self.context.wants_keyboard_input(),
            WindowEvent::CursorMoved { position, .. } => {
                let pixel = egui::pos2(position.x as f32, position.y as f32);
                self.pointer = pixel / self.context.pixels_per_point();
                false
            }
            // egui's own answer is of the last frame, which may be long ago.
            WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. } => self.is_over_a_panel(),
            _ => response.consumed,
        };
        if !shown {
            self.state.egui_input_mut().events.clear();
        }
        // A frame that is drawn is none that must be drawn again, as egui-winit says of each.
        let changes = response.repaint && !matches!(event, WindowEvent::RedrawRequested);
        PanelResponse { consumed: consumed && shown, changes: changes && shown }
    }

    fn is_over_a_panel(&self) -> bool {
        let layer = self.context.layer_id_at(self.pointer);
        layer.is_some_and(|layer| layer.order != egui::Order::Background)
    }

    /// Lets `show` build the panels, and returns them without their textures, with the time after which they must be shown anew.
    pub fn run(&mut self, window: &Window, show: impl FnMut(&egui::Context)) -> (Panels, Duration) {
        let input = self.state.take_egui_input(window);
        let output = self.context.run(input, show);
        self.state.handle_platform_output(window, output.platform_output);
        let delay = output.viewport_output.get(&ViewportId::ROOT).map_or(Duration::MAX, |root| root.repaint_delay);
        let primitives = self.context.tessellate(output.shapes, output.pixels_per_point);
        let size = window.inner_size();
        let mut panels = triangles(&primitives, output.pixels_per_point, [size.width, size.height]);
        self.take_textures(output.textures_delta);
        panels.spent = self.spent.clone();
        (panels, delay)
    }

    /// Nothing is shown: the mouse looks as it does over the picture.
    pub fn rest(&mut self, window: &Window) {
        self.state.handle_platform_output(window, egui::PlatformOutput::default());
    }

    /// The textures that are new or have changed since the last call, or all of them for a device that has none.
    pub fn textures(&mut self, anew: bool) -> Vec<PanelTexture> {
        let changed = std::mem::take(&mut self.changed);
        let sent = self.textures.iter().filter(|(id, _)| anew || changed.contains(id));
        sent.map(|(&id, image)| texture(id, image)).collect()
    }

    /// Notes that the output of [`Overlay::run`] was drawn.
    pub fn drawn(&mut self) {
        self.spent.clear();
    }

    /// Takes note of changes of the textures.
    fn take_textures(&mut self, mut delta: TexturesDelta) {
        for (id, delta) in std::mem::take(&mut delta.set) {
            let id = number(id);
            let ImageData::Color(image) = delta.image;
            match (delta.pos, self.textures.get_mut(&id)) {
                (Some(corner), Some(own)) => patch(own, corner, &image),
                _ => _ = self.textures.insert(id, (*image).clone()),
            }
            self.changed.insert(id);
        }
        self.spent.extend(std::mem::take(&mut delta.free).into_iter().map(number));
        for id in &self.spent {
            self.textures.remove(id);
        }
    }
}

/// A context with the fonts and the style of all panels.
pub(super) fn context() -> egui::Context {
    let context = egui::Context::default();
    context.set_fonts(fonts());
    // egui's own bars appear under the mouse only: nothing would tell that a panel goes on below.
    context.all_styles_mut(|style| style.spacing.scroll = egui::style::ScrollStyle::solid());
    context
}

/// Letters, and letters of one width. egui's own choice adds 0.7 MB of emoji, which nothing here shows.
fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::empty();
    let faces = [("letters", UBUNTU_LIGHT, FontFamily::Proportional), ("code", HACK_REGULAR, FontFamily::Monospace)];
    for (name, bytes, family) in faces {
        fonts.font_data.insert(name.to_owned(), Arc::new(FontData::from_static(bytes)));
        fonts.families.insert(family, vec![name.to_owned()]);
    }
    fonts
}

/// Textures that are not egui's own are not used.
fn number(id: TextureId) -> u64 {
    match id {
        TextureId::Managed(id) | TextureId::User(id) => id,
    }
}

/// Puts a smaller image into a larger one.
fn patch(image: &mut ColorImage, [left, top]: [usize; 2], part: &ColorImage) {
    let [width, height] = image.size;
    for (row, pixels) in part.pixels.chunks_exact(part.size[0].max(1)).enumerate().take(height.saturating_sub(top)) {
        let start = (top + row) * width + left;
        let length = pixels.len().min(width.saturating_sub(left));
        image.pixels[start..start + length].copy_from_slice(&pixels[..length]);
    }
}

fn texture(id: u64, image: &ColorImage) -> PanelTexture {
    let rgba = image.pixels.iter().flat_map(|pixel| pixel.to_array()).collect();
    PanelTexture { id, size: image.size.map(|edge| edge as u32), rgba }
}

/// All meshes as one, each with the part of the window that it may cover.
fn triangles(primitives: &[ClippedPrimitive], pixels_per_point: f32, size: [u32; 2]) -> Panels {
    let mut panels = Panels { pixels_per_point, ..Panels::default() };
    for ClippedPrimitive { clip_rect, primitive } in primitives {
        // Callbacks would be Vulkan of somebody else's.
        let Primitive::Mesh(mesh) = primitive else { continue };
        let Some(scissor) = scissor(*clip_rect, pixels_per_point, size) else { continue };
        let (base, first) = (panels.vertices.len() as u32, panels.indices.len() as u32);
        panels.vertices.extend(mesh.vertices.iter().map(|vertex| PanelVertex {
            position: [vertex.pos.x, vertex.pos.y],
            uv: [vertex.uv.x, vertex.uv.y],
            color: vertex.color.to_array(),
        }));
        panels.indices.extend(mesh.indices.iter().map(|index| base + index));
        let indices = first..panels.indices.len() as u32;
        panels.draws.push(PanelDraw { texture: number(mesh.texture_id), scissor, indices });
    }
    panels
}

/// A rectangle in points as pixels within the window; none if nothing is left of it.
fn scissor(clip: egui::Rect, pixels_per_point: f32, [width, height]: [u32; 2]) -> Option<vk::Rect2D> {
    let pixel = |points: f32, most: u32| (points * pixels_per_point).round().clamp(0.0, most as f32) as u32;
    let (left, top) = (pixel(clip.min.x, width), pixel(clip.min.y, height));
    let (right, bottom) = (pixel(clip.max.x, width), pixel(clip.max.y, height));
    (right > left && bottom > top).then(|| vk::Rect2D {
        offset: vk::Offset2D { x: left as i32, y: top as i32 },
        extent: vk::Extent2D { width: right - left, height: bottom - top },
    })
}

#[cfg(test)]
mod tests {
    use egui::{Color32, Pos2, Rect};

    use super::*;

    #[test]
    fn a_clip_rectangle_stays_within_the_window() {
        let rect = |a: [f32; 2], b: [f32; 2]| Rect { min: Pos2::from(a), max: Pos2::from(b) };
        let inside = scissor(rect([-5.0, 2.0], [f32::INFINITY, 3.6]), 2.0, [20, 10]).expect("is seen");
        assert_eq!((inside.offset.x, inside.offset.y, inside.extent.width, inside.extent.height), (0, 4, 20, 3));
        assert_eq!(scissor(rect([30.0, 0.0], [40.0, 5.0]), 1.0, [20, 10]), None);
        assert_eq!(scissor(rect([5.0, 5.0], [2.0, 8.0]), 1.0, [20, 10]), None);
    }

    #[test]
    fn a_patch_changes_what_it_covers_and_nothing_else() {
        let mut image = ColorImage::filled([3, 2], Color32::BLACK);
        patch(&mut image, [1, 1], &ColorImage::filled([2, 1], Color32::WHITE));
        let white: Vec<usize> = (0..6).filter(|&index| image.pixels[index] == Color32::WHITE).collect();
        assert_eq!(white, [4, 5]);
    }
}
