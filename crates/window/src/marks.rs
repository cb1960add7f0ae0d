//! Marks over the picture itself: the box of the object that was picked, and where the picture is wrong.

use egui::{Color32, ColorImage, Context, LayerId, Pos2, Rect, Stroke, TextureHandle, TextureOptions, Vec2, pos2};
use glam::DVec3;

use super::oracle::ErrorMap;
use afterlight::scene::{Camera, Scene};

const BOX: Color32 = Color32::from_rgb(255, 190, 40);
/// Codes from which on a pixel is as red as it gets.
const MOST: f32 = 32.0;

/// The box of an object, around it as it lies, and its name.
pub fn draw_box(context: &Context, scene: &Scene, camera: &Camera, object: usize) {
    let Some(object) = scene.objects.get(object) else { return };
    let Some(mesh) = scene.meshes.get(object.mesh) else { return };
    let painter = context.layer_painter(LayerId::background());
    let screen = context.content_rect();
    let bounds = mesh.bounds;
    let corner = |index: usize| {
        let pick = |bit: usize, low: f64, high: f64| if index >> bit & 1 == 0 { low } else { high };
        let place = DVec3::new(
            pick(0, bounds.min.x, bounds.max.x),
            pick(1, bounds.min.y, bounds.max.y),
            pick(2, bounds.min.z, bounds.max.z),
        );
        object.transform.transform_point3(place)
    };
    for from in 0..8 {
        for to in [from | 1, from | 2, from | 4].into_iter().filter(|&to| to != from) {
            if let Some(line) = project(camera, [corner(from), corner(to)], screen.size()) {
                painter.line_segment(line.map(|point| screen.min + point.to_vec2()), Stroke::new(1.5_f32, BOX));
            }
        }
    }
}

/// A line as it is seen, in points from the upper left corner of a picture of this size; none if it is behind the near plane.
fn project(camera: &Camera, ends: [DVec3; 2], size: Vec2) -> Option<[Pos2; 2]> {
    let inverse = camera.rotation.inverse();
    let [mut from, mut to] = ends.map(|end| inverse * (end - camera.position));
    // Along -Z.
    let depth = |place: DVec3| -place.z - camera.near;
    if depth(from) <= 0.0 && depth(to) <= 0.0 {
        return None;
    }
    if depth(from) <= 0.0 {
        (from, to) = (to, from);
    }
    if depth(to) <= 0.0 {
        to = from + (to - from) * (depth(from) / (depth(from) - depth(to)));
    }
    let (width, height) = (f64::from(size.x), f64::from(size.y));
    let point = |place: DVec3| {
        // Half the picture's height is 1.
        let place_on = place.truncate() / (camera.w(-place.z) * camera.half_height());
        pos2(((width + place_on.x * height) * 0.5) as f32, ((1.0 - place_on.y) * 0.5 * height) as f32)
    };
    Some([point(from), point(to)])
}

/// The errors of a picture: red, and the more opaque the more codes a pixel is off.
#[derive(Default)]
pub struct HeatMap {
    texture: Option<TextureHandle>,
}

impl HeatMap {
    /// Shows nothing any more.
    pub fn clear(&mut self) {
        self.texture = None;
    }

    pub fn set(&mut self, context: &Context, map: &ErrorMap) {
        let color = |&code: &u8| {
            let share = (f32::from(code) / MOST).min(1.0);
            Color32::from_rgba_unmultiplied(255, (200.0 * (1.0 - share)) as u8, 0, (share.sqrt() * 230.0) as u8)
        };
        let size = map.size.map(|edge| edge as usize);
        let image = ColorImage::new(size, map.codes.iter().map(color).collect());
        self.texture = Some(context.load_texture("error", image, TextureOptions::NEAREST));
    }

    /// Draws the map over a picture; each value of the map stands for `step` by `step` pixels.
    pub fn draw(&self, context: &Context, map: &ErrorMap) {
        let Some(texture) = &self.texture else { return };
        let size = Vec2::new(map.size[0] as f32, map.size[1] as f32) * map.step as f32 / context.pixels_per_point();
        let uv = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
        let rect = Rect::from_min_size(context.content_rect().min, size);
        context.layer_painter(LayerId::background()).image(texture.id(), rect, uv, Color32::WHITE);
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use afterlight::scene::Projection;

    const SIZE: Vec2 = Vec2::new(200.0, 100.0);

    fn near(point: Pos2, x: f32, y: f32) {
        assert!((point - pos2(x, y)).length() < 1e-3, "{point:?}");
    }

    #[test]
    fn lines_are_where_the_camera_sees_them() {
        let camera = Camera {
            position: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            projection: Projection::perspective(90.0),
            near: 0.5,
            ..Camera::default()
        };
        let [from, to] =
            project(&camera, [DVec3::NEG_Z, DVec3::new(2.0, 1.0, -2.0)], SIZE).expect("is before the camera");
        near(from, 100.0, 50.0);
        near(to, 150.0, 25.0);
        // Cut where the near plane is.
        let [_, cut] = project(&camera, [DVec3::new(0.0, 1.0, -1.5), DVec3::Y], SIZE).expect("begins before it");
        near(cut, 100.0, -50.0);
        assert_eq!(project(&camera, [DVec3::Z, DVec3::new(0.0, 0.0, -0.4)], SIZE), None);
        let flat = Camera { projection: Projection::orthographic(4.0), ..camera };
        let [_, far] = project(&flat, [DVec3::NEG_Z, DVec3::new(1.0, 1.0, -1e6)], SIZE).expect("is before it");
        near(far, 125.0, 25.0);
    }
}
