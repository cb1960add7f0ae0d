//! A camera's lens: its aperture and its focus distance.

use std::fmt::{self, Display};
use std::str::FromStr;

use glam::DVec2;

use super::{Camera, Error, Settings};

/// Height in metres of the sensor that f-numbers refer to: full frame, 36 x 24 mm, for which photographers name focal lengths.
const SENSOR_HEIGHT: f64 = 0.024;
/// The widest lens, in metres.
const WIDEST: f32 = 1e6;
/// The least f-number; lenses that are sold begin at 0.95.
const LEAST_F_NUMBER: f32 = 0.01;

/// The aperture of a lens.
///
/// A scene is in metres and its camera need not be one that could be bought, so the diameter is the plain measure, as in other renderers (PBRT and
/// Mitsuba take the radius of a thin lens). Photographers say f/2.8. A camera here has a field of view but neither a focal length nor a sensor, so an
/// f-number refers to the focal length with the same field of view on full frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Aperture {
    /// The diameter of the lens in metres. 0 is a pinhole, with which everything is sharp.
    Diameter(f32),
    /// The f-number: the focal length over the diameter.
    FNumber(f32),
}

impl Aperture {
    /// A pinhole: everything is sharp.
    pub const PINHOLE: Self = Self::Diameter(0.0);

    /// The diameter of the lens on a camera, in metres.
    pub fn diameter(self, camera: &Camera) -> f64 {
        match self {
            Self::Diameter(metres) => f64::from(metres),
            Self::FNumber(number) => 0.5 * SENSOR_HEIGHT / camera.half_height() / f64::from(number),
        }
    }

    /// Returns true if it has no width.
    pub fn is_pinhole(self) -> bool {
        self == Self::PINHOLE
    }
}

impl FromStr for Aperture {
    type Err = Error;

    /// Metres, or an f-number as `f/2.8`.
    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = || Error::Setting(format!("must be {}", Self::RANGE));
        let number = |text: &str, least: f32| {
            text.trim().parse().ok().filter(|number: &f32| (least..=WIDEST).contains(number)).ok_or_else(wrong)
        };
        match text.trim().strip_prefix("f/") {
            Some(text) => number(text, LEAST_F_NUMBER).map(Self::FNumber),
            // -0 is the same pinhole.
            None => number(text, 0.0).map(|metres| Self::Diameter(metres.abs())),
        }
    }
}

impl Display for Aperture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diameter(metres) => write!(f, "{metres}"),
            Self::FNumber(number) => write!(f, "f/{number}"),
        }
    }
}

impl Aperture {
    /// The valid values of its text, in words.
    pub const RANGE: &'static str =
        "a diameter from 0 to 1000000 metres, or an f-number from f/0.01 to f/1000000, as f/2.8";
}

/// A thin lens: all light from a point in the plane of focus meets in one point of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThinLens {
    /// The radius of the lens in metres, above 0.
    pub radius: f64,
    /// The distance of the plane of focus along the view, in metres.
    pub focus: f64,
}

impl ThinLens {
    /// Returns the lens of the settings; `None` for a pinhole, and for parallel rays, which no lens makes.
    pub fn of(settings: &Settings, camera: &Camera) -> Option<Self> {
        let radius = 0.5 * settings.aperture.diameter(camera);
        let focus = f64::from(settings.focus?);
        (radius > 0.0 && !camera.is_orthographic()).then_some(Self { radius, focus })
    }

    /// The camera that looks through a point of the lens, given right and up from its centre in radii. It is moved to that point and keeps its
    /// direction; its picture is shifted so that the plane of focus stays in place.
    #[must_use]
    pub fn through(&self, camera: &Camera, [right, up]: [f64; 2]) -> Camera {
        let beside = [right, up].map(|along| along * self.radius);
        let position = camera.position + camera.right() * beside[0] + camera.up() * beside[1];
        Camera { position, shift: camera.shift - DVec2::from(beside) / self.focus, ..*camera }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::Projection;

    /// Returns a point's place in the picture: slopes to the right and up of its middle.
    fn seen(camera: &Camera, place: DVec3) -> [f64; 2] {
        let offset = place - camera.position;
        let along = offset.dot(camera.forward());
        [offset.dot(camera.right()) / along - camera.shift[0], offset.dot(camera.up()) / along - camera.shift[1]]
    }

    #[test]
    fn what_lies_in_the_sharp_plane_stays_and_else_a_disc_opens_by_the_formula() {
        let camera = Camera::looking_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(-4.0, 0.5, 2.0), DVec3::Y);
        let lens = ThinLens { radius: 0.3, focus: 5.0 };
        for (distance, point) in [(5.0, [0.6, -0.8]), (2.0, [1.0, 0.0]), (50.0, [0.0, -1.0]), (0.1, [-0.5, 0.5])] {
            let place =
                camera.position + camera.forward() * distance + (camera.right() * 0.2 - camera.up() * 0.1) * distance;
            let (sharp, own) = (seen(&camera, place), seen(&lens.through(&camera, point), place));
            // Similar triangles: the lens over the distance, less the lens over the focus.
            for axis in 0..2 {
                let expected = sharp[axis] - point[axis] * lens.radius * (1.0 / distance - 1.0 / lens.focus);
                assert!((own[axis] - expected).abs() < 1e-12, "{distance}: {own:?}");
            }
        }
    }

    #[test]
    fn an_f_number_is_of_the_focal_length_of_full_frame() {
        // 24 mm of sensor and 50 mm of focal length see 2 atan(12 / 50).
        let fov = 2.0 * (12.0f64 / 50.0).atan().to_degrees();
        let camera = Camera { projection: Projection::perspective(fov), ..Camera::default() };
        assert!((Aperture::FNumber(2.0).diameter(&camera) - 0.025).abs() < 1e-12);
        assert_eq!(Aperture::Diameter(0.5).diameter(&camera), 0.5);
    }

    #[test]
    fn apertures_are_read_as_they_are_written_and_others_refused() {
        for text in ["0", "0.05", "1000000", "f/2.8", "f/0.95", "f/22"] {
            assert_eq!(text.parse::<Aperture>().map(|own| own.to_string()).ok().as_deref(), Some(text));
        }
        for text in ["", "-1", "nan", "inf", "2e6", "f/0", "f/-2", "f/nan", "f2.8", "f/", "wide"] {
            let error = text.parse::<Aperture>().expect_err(text).to_string();
            assert!(error.starts_with("must be a diameter"), "{text}: {error}");
        }
        assert!("-0".parse::<Aperture>().is_ok_and(Aperture::is_pinhole));
    }
}
