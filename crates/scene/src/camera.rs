//! A camera in f64, perspective or orthographic.

use std::fmt::{self, Display};
use std::ops::RangeInclusive;
use std::str::FromStr;

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

use super::Error;

/// The fields of view that a projection in f32 holds.
pub const FOV_Y_DEGREES: RangeInclusive<f64> = 0.001..=179.999;
/// Heights of an orthographic picture, in metres, that a projection in f32 holds.
pub const HEIGHT: RangeInclusive<f64> = 1e-12..=1e15;

/// A camera's projection of the scene onto its picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// All rays go through the camera's place: objects twice as far away are half as large.
    Perspective {
        /// Vertical field of view, within [`FOV_Y_DEGREES`].
        fov_y_degrees: f64,
    },
    /// All rays are parallel: objects are equally large at any distance.
    Orthographic {
        /// Metres from the picture's top to its bottom, within [`HEIGHT`]: twice the `ymag` of glTF.
        height: f64,
    },
}

impl Projection {
    /// All rays go through one point.
    pub const fn perspective(fov_y_degrees: f64) -> Self {
        Self::Perspective { fov_y_degrees }
    }

    /// All rays are parallel.
    pub const fn orthographic(height: f64) -> Self {
        Self::Orthographic { height }
    }
}

/// A camera that looks along its local -Z, +Y up. A perspective one has no far plane, and neither has an orthographic one: its depth ends behind
/// the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Position in the world.
    pub position: DVec3,
    /// Rotation from camera space to world space.
    pub rotation: DQuat,
    /// Projection of the scene onto the picture.
    pub projection: Projection,
    /// Distance of the near plane, above 0.
    pub near: f64,
    /// The offset of the picture's middle from the camera's direction, to the right and up, as slopes: frames that look through points of a lens
    /// have shifted pictures. 0 for an orthographic camera.
    pub shift: DVec2,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            position: DVec3::new(0.0, 0.0, 5.0),
            rotation: DQuat::IDENTITY,
            projection: Projection::perspective(60.0),
            near: 0.1,
            shift: DVec2::ZERO,
        }
    }
}

impl Camera {
    /// A camera at `position` that looks at `target`. An `up` parallel to the view, and a target at the position, are mended
    /// by the nearest sensible axis.
    pub fn looking_at(position: DVec3, target: DVec3, up: DVec3) -> Self {
        let back = (position - target).try_normalize().unwrap_or(DVec3::Z);
        let right = up
            .cross(back)
            .try_normalize()
            .filter(|_| up.normalize_or_zero().cross(back).length() > 1e-9)
            .unwrap_or_else(|| back.any_orthonormal_vector());
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back)).normalize();
        Self { position, rotation, ..Self::default() }
    }

    /// The camera moved and turned; a transform's scale moves it and changes nothing else.
    #[must_use]
    pub fn transformed(self, transform: &DAffine3) -> Self {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| transform.transform_vector3(self.rotation * axis));
        let position = transform.transform_point3(self.position);
        let turned =
            Self::looking_at(position, position - z, if z.cross(y).length_squared() > 0.0 { y } else { z.cross(x) });
        Self { position, rotation: turned.rotation, ..self }
    }

    /// Returns the direction in which it looks, of length 1.
    pub fn forward(&self) -> DVec3 {
        self.rotation * DVec3::NEG_Z
    }

    /// Returns the direction of the picture's right side, of length 1.
    pub fn right(&self) -> DVec3 {
        self.rotation * DVec3::X
    }

    /// Returns the direction of the picture's upper side, of length 1.
    pub fn up(&self) -> DVec3 {
        self.rotation * DVec3::Y
    }

    /// From the place that it looks at to the middle of its picture, where [`Camera::w`] is 1.
    pub fn aside(&self) -> DVec3 {
        self.right() * self.shift.x + self.up() * self.shift.y
    }

    /// Returns true if its rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. })
    }

    /// Half the picture's height, in metres, where [`Camera::w`] is 1.
    pub fn half_height(&self) -> f64 {
        match self.projection {
            Projection::Perspective { fov_y_degrees } => (fov_y_degrees.to_radians() * 0.5).tan(),
            Projection::Orthographic { height } => height * 0.5,
        }
    }

    /// The w of clip space at a distance along the view, by which places are divided to come to the picture: that distance, or 1.
    pub fn w(&self, distance: f64) -> f64 {
        match self.projection {
            Projection::Perspective { .. } => distance,
            Projection::Orthographic { .. } => 1.0,
        }
    }

    /// Orders places from near to far as rays meet them: by the squared distance from the eye, which stays when a perspective camera turns, or by
    /// the distance along parallel rays.
    pub fn order(&self, place: DVec3) -> f64 {
        let offset = place - self.position;
        match self.projection {
            Projection::Perspective { .. } => offset.length_squared(),
            Projection::Orthographic { .. } => offset.dot(self.forward()),
        }
    }
}

impl FromStr for Camera {
    type Err = Error;

    /// Reads `x,y,z/tx,ty,tz`, `x,y,z/tx,ty,tz/fov` or `x,y,z/tx,ty,tz/<height>m`: the camera's place, its target, and the vertical field of view
    /// in degrees (60 when left out), or the height in metres of an orthographic camera's picture. Up is +Y. `near` is the default: a caller that
    /// knows the scene sets it.
    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = |what: String| {
            Error::Setting(format!("camera \"{text}\": {what}, as in \"0,1.7,8/0,1,0/60\", or \"0,1.7,8/0,1,0/4m\""))
        };
        let parts: Vec<&str> = text.split('/').collect();
        if !(2..=3).contains(&parts.len()) {
            return Err(wrong("expected position/target, position/target/fov or position/target/<height>m".into()));
        }
        let number = |text: &str| {
            let parsed = text.trim().parse::<f64>().ok().filter(|number| number.abs() <= 1e15);
            parsed.ok_or_else(|| wrong(format!("\"{}\" is not a number from -1e15 to 1e15", text.trim())))
        };
        let point = |text: &str| {
            let numbers = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
            let array: Result<[f64; 3], _> = numbers.try_into();
            array.map(DVec3::from).map_err(|_| wrong(format!("\"{text}\" should be three numbers")))
        };
        let (position, target) = (point(parts[0])?, point(parts[1])?);
        if position == target {
            return Err(Error::Setting(format!("camera \"{text}\": it looks at the point where it stands")));
        }
        let mut camera = Self::looking_at(position, target, DVec3::Y);
        match parts.get(2).map(|lens| (lens, lens.trim().strip_suffix('m'))) {
            None => {}
            Some((_, Some(metres))) => {
                let height = number(metres)?;
                if !HEIGHT.contains(&height) {
                    return Err(wrong(format!("a height of {} m is not from 1e-12 to 1e15 metres", metres.trim())));
                }
                camera.projection = Projection::orthographic(height);
            }
            Some((fov, None)) => {
                let fov_y_degrees = number(fov)?;
                if !FOV_Y_DEGREES.contains(&fov_y_degrees) {
                    return Err(wrong(format!("a field of view of {fov} is not from 0.001 to 179.999 degrees")));
                }
                camera.projection = Projection::perspective(fov_y_degrees);
            }
        }
        Ok(camera)
    }
}

/// As [`Camera::from_str`] reads it: seven digits of the place, and a target far enough away for as many of the direction. A roll is left out,
/// see [`Camera::is_level`].
impl Display for Camera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reach = self.position.length().max(10.0 * self.near).log10().ceil();
        let decimals = (6.0 - reach).max(0.0) as usize;
        let point = |point: DVec3| point.to_array().map(|own| decimal(own, decimals)).join(",");
        write!(f, "{}/{}", point(self.position), point(self.position + self.forward() * 10f64.powf(reach)))?;
        match self.projection {
            Projection::Perspective { fov_y_degrees } => write!(f, "/{}", decimal(fov_y_degrees, 6)),
            Projection::Orthographic { height } => write!(f, "/{height}m"),
        }
    }
}

/// A number with at most `decimals` decimals, without trailing zeros.
pub fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let short = if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

impl Camera {
    /// Returns true if its up is +Y as far as its direction allows: only then its text describes it whole.
    pub fn is_level(&self) -> bool {
        let level = Self::looking_at(self.position, self.position + self.forward(), DVec3::Y);
        level.right().dot(self.right()) > 1.0 - 1e-9
    }

    /// The camera that a command line describes: see its `FromStr`.
    pub fn parse(text: &str) -> Result<Self, Error> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_camera_is_the_one_that_its_text_describes() {
        for (position, target, unit) in [
            ([1.0, 2.0, 3.0], [-4.0, 0.5, 2.25], 1.0),
            ([0.0; 3], [0.0, -0.3, 1.0], 1e-4),
            ([5e6, 1.0, -2e6], [5e6, 0.0, 7.0], 1e6),
        ] {
            for projection in [Projection::perspective(47.3), Projection::orthographic(0.125)] {
                let (position, target) = (DVec3::from(position), DVec3::from(target));
                let camera = Camera { projection, near: 0.01 * unit, ..Camera::looking_at(position, target, DVec3::Y) };
                let read = Camera::parse(&camera.to_string()).unwrap_or_else(|error| panic!("{error}"));
                assert_eq!(read.projection, camera.projection, "{camera}");
                assert!(
                    camera.is_level() && read.position.distance(camera.position) <= 1e-6 * position.length().max(unit),
                    "{camera}"
                );
                assert!(
                    read.forward().distance(camera.forward()) < 1e-5,
                    "{camera}: {} {}",
                    read.forward(),
                    camera.forward()
                );
            }
        }
        let camera = Camera::looking_at(DVec3::new(8.0, 1.7, 0.0), DVec3::new(-92.0, 1.7, 0.0), DVec3::Y);
        assert_eq!(camera.to_string(), "8,1.7,0/-2,1.7,0/60");
        let rolled = Camera { rotation: camera.rotation * DQuat::from_rotation_z(0.1), ..camera };
        assert!(!rolled.is_level());
    }

    #[test]
    fn a_camera_parses_with_a_field_of_view_a_height_and_neither() {
        let camera = Camera::parse("1, 2,3 / 1,2,-4/35.5").unwrap();
        assert_eq!((camera.position, camera.projection), (DVec3::new(1.0, 2.0, 3.0), Projection::perspective(35.5)));
        assert!((camera.forward() - DVec3::NEG_Z).length() < 1e-12);
        assert_eq!(Camera::parse("0,0,1/0,0,0").unwrap().projection, Projection::perspective(60.0));
        let flat = Camera::parse("0,0,1/0,0,0/2.5m").unwrap();
        assert_eq!((flat.projection, flat.half_height(), flat.w(7.0)), (Projection::orthographic(2.5), 1.25, 1.0));
    }

    #[test]
    fn a_camera_that_cannot_be_is_refused_by_name() {
        for text in [
            "",
            "1,2,3",
            "1,2/3,4,5",
            "1,2,nan/0,0,0",
            "1,2,1e300/0,0,0",
            "0,0,1/0,0,0/1e-300",
            "0,0,0/0,0,0",
            "0,0,1/0,0,0/180",
            "0,0,1/0,0,0/0",
            "0,0,1/0,0,0/1/2",
            "0,0,1/0,0,0/0m",
            "0,0,1/0,0,0/-1m",
            "0,0,1/0,0,0/m",
            "0,0,1/0,0,0/1e-13 m",
        ] {
            let error = Camera::parse(text).unwrap_err().to_string();
            assert!(error.starts_with("camera \"") && !error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn looking_straight_down_has_a_rotation() {
        let camera = Camera::looking_at(DVec3::Y, DVec3::ZERO, DVec3::Y);
        assert!((camera.forward() - DVec3::NEG_Y).length() < 1e-9 && camera.right().is_normalized());
    }
}
