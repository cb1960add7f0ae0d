//! A perspective camera in f64.

use std::ops::RangeInclusive;
use std::str::FromStr;

use glam::{DMat3, DQuat, DVec3};

use super::Error;

/// The fields of view that a projection in f32 holds.
pub const FOV_Y_DEGREES: RangeInclusive<f64> = 0.001..=179.999;

/// A pinhole camera that looks along its local -Z, +Y up. The far plane is infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    pub position: DVec3,
    /// From camera space to world space.
    pub rotation: DQuat,
    /// Vertical field of view, within [`FOV_Y_DEGREES`].
    pub fov_y_degrees: f64,
    /// Distance of the near plane, above 0.
    pub near: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self { position: DVec3::new(0.0, 0.0, 5.0), rotation: DQuat::IDENTITY, fov_y_degrees: 60.0, near: 0.1 }
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

    pub fn forward(&self) -> DVec3 {
        self.rotation * DVec3::NEG_Z
    }

    pub fn right(&self) -> DVec3 {
        self.rotation * DVec3::X
    }

    pub fn up(&self) -> DVec3 {
        self.rotation * DVec3::Y
    }
}

impl FromStr for Camera {
    type Err = Error;

    /// `x,y,z/tx,ty,tz` or `x,y,z/tx,ty,tz/fov`: where it stands, what it looks at, and the vertical field of view in degrees
    /// (60 when left out). Up is +Y. `near` is the default: whoever knows the scene sets it.
    fn from_str(text: &str) -> Result<Self, Error> {
        let wrong = |what: String| Error::Setting(format!("camera \"{text}\": {what}, as in \"0,1.7,8/0,1,0/60\""));
        let parts: Vec<&str> = text.split('/').collect();
        if !(2..=3).contains(&parts.len()) {
            return Err(wrong("expected position/target or position/target/fov".into()));
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
            return Err(wrong("position and target are the same point".into()));
        }
        let mut camera = Self::looking_at(position, target, DVec3::Y);
        if let Some(fov) = parts.get(2) {
            camera.fov_y_degrees = number(fov)?;
            if !FOV_Y_DEGREES.contains(&camera.fov_y_degrees) {
                return Err(wrong(format!("a field of view of {fov} is not from 0.001 to 179.999 degrees")));
            }
        }
        Ok(camera)
    }
}

impl Camera {
    /// The camera that a command line describes: see its `FromStr`.
    pub fn parse(text: &str) -> Result<Self, Error> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_parses_with_and_without_a_field_of_view() {
        let camera = Camera::parse("1, 2,3 / 1,2,-4/35.5").unwrap();
        assert_eq!((camera.position, camera.fov_y_degrees), (DVec3::new(1.0, 2.0, 3.0), 35.5));
        assert!((camera.forward() - DVec3::NEG_Z).length() < 1e-12);
        assert_eq!(Camera::parse("0,0,1/0,0,0").unwrap().fov_y_degrees, 60.0);
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
