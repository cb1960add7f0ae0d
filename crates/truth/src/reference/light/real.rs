//! The numbers that the model is evaluated in: the same formulas in single and in double precision.

use glam::{DVec3, Vec3};
use nalgebra::{Scalar, Vector3};
use num_traits::{Float, FloatConst, NumAssign};

/// [`f32`] or [`f64`].
pub trait Real: Float + FloatConst + NumAssign + Scalar + Send + Sync {
    /// The nearest number of this type.
    fn of(value: f64) -> Self;

    /// Exact.
    fn wide(self) -> f64;
}

impl Real for f32 {
    fn of(value: f64) -> Self {
        value as Self
    }

    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn wide(self) -> f64 {
        self
    }
}

/// Rounded to the arithmetic's precision.
pub(in crate::reference) fn vector<R: Real>(wide: DVec3) -> Vector3<R> {
    Vector3::new(R::of(wide.x), R::of(wide.y), R::of(wide.z))
}

/// A scene's own value, exact in both precisions.
pub(in crate::reference) fn color<R: Real>(single: Vec3) -> Vector3<R> {
    vector(single.as_dvec3())
}

pub(in crate::reference) fn widened<R: Real>(vector: Vector3<R>) -> DVec3 {
    DVec3::new(vector.x.wide(), vector.y.wide(), vector.z.wide())
}

/// Length without overflow or underflow of the squares.
pub(super) fn length<R: Real>(vector: &Vector3<R>) -> R {
    let largest = vector.x.abs().max(vector.y.abs()).max(vector.z.abs());
    if largest == R::zero() {
        return largest;
    }
    let scaled = vector.map(|part| part / largest);
    scaled.dot(&scaled).sqrt() * largest
}

/// Returns the vector at unit length; `None` for the zero vector.
pub(super) fn unit<R: Real>(vector: &Vector3<R>) -> Option<Vector3<R>> {
    let length = length(vector);
    (length > R::zero()).then(|| vector.map(|part| part / length))
}
