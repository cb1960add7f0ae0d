//! Light sources, in the units of KHR_lights_punctual. Only this module distinguishes the kinds of lights; the rest of the program asks a light for
//! its [`LightForm`].

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::{OptionalPart, luminance};

/// A light. The radiometric strength is `color * intensity`.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// The name in messages and reports.
    pub name: String,
    /// The shape and place of the light.
    pub kind: LightKind,
    /// Linear RGB, not negative.
    pub color: Vec3,
    /// Lux for a directional light and a beam, candela for point and spot. Not negative.
    pub intensity: f32,
    /// True if objects block its light.
    pub casts_shadow: bool,
    /// The size of the source, for soft shadows: the angular diameter in degrees if rays are parallel, else the radius in metres. 0 for a light
    /// without a size.
    pub size: f64,
}

/// The shape and place of a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// Parallel light from infinitely far away.
    Directional {
        /// The direction in which the light travels, of any length but 0.
        direction: DVec3,
    },
    /// Light to all sides.
    Point {
        /// The position in world space, in metres.
        position: DVec3,
        /// Metres beyond which the light is zero; `None` reaches everywhere.
        range: Option<f64>,
        /// The fall-off with distance.
        falloff: Falloff,
    },
    /// Light within a cone, which fades out between its two angles.
    Spot {
        /// The apex of the cone, in world space, metres.
        position: DVec3,
        /// The direction in which the light travels, of any length but 0.
        direction: DVec3,
        /// The angle from the axis up to which the light is full. 0 to `outer_angle_degrees`.
        inner_angle_degrees: f64,
        /// The angle from the axis, at most 180, beyond which there is no light.
        outer_angle_degrees: f64,
        /// Metres beyond which the light is zero; `None` reaches everywhere.
        range: Option<f64>,
        /// The fall-off with distance.
        falloff: Falloff,
    },
    /// Parallel light from a disc; distance does not weaken it.
    Beam {
        /// The middle of the disc, in world space, metres.
        position: DVec3,
        /// The direction in which the light travels, of any length but 0.
        direction: DVec3,
        /// The radius of the disc, in metres.
        radius: f64,
        /// The share of the radius, 0 to 1, over which the light fades out towards the rim.
        edge: f64,
        /// Metres beyond which the light is zero; `None` reaches everywhere.
        range: Option<f64>,
    },
}

/// The properties of a light that the program needs, independent of its kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightForm {
    /// The kind's number in fingerprints of truths.
    pub number: u64,
    /// The kind's name in scene files and reports.
    pub name: &'static str,
    /// The unit of its intensity.
    pub unit: &'static str,
    /// The position; `None` for a light that is infinitely far away.
    pub place: Option<DVec3>,
    /// The direction in which its light travels, of any length but 0; `None` for a point light.
    pub direction: Option<DVec3>,
    /// The space that its rays fill.
    pub outline: Outline,
    /// Metres beyond which it is exactly zero.
    pub range: Option<f64>,
    /// The fall-off; `None` if distance does not weaken the light.
    pub falloff: Option<Falloff>,
}

/// The space that a light's rays fill.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    /// All space.
    Space,
    /// A cone of these half angles.
    Cone {
        /// The angle in degrees up to which the light is full.
        inner: f64,
        /// The angle in degrees beyond which there is no light.
        outer: f64,
    },
    /// A cylinder around the axis, from the light's position on.
    Cylinder {
        /// The radius in metres.
        radius: f64,
        /// The soft share of the radius, 0 to 1.
        edge: f64,
    },
}

/// A light's view of the scene in its shadow maps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShadowProjection {
    /// Parallel rays from infinitely far away, wherever the camera looks.
    Far,
    /// One view from the light's position along its direction. The number is half the view's width in metres, at a distance of 1 m, or everywhere if
    /// rays are parallel.
    Ahead(f64),
    /// Six views, to all sides.
    Around,
}

/// The solid of which a light's volume is the image: a unit sphere, or a cone with its apex at zero, its axis +Z and its base of radius 1 at 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solid {
    /// A unit sphere around zero.
    Sphere,
    /// A cone along +Z.
    Cone,
}

/// A part of the shaders' code that only some lights need. It is compiled if a light of the plan needs it.
#[derive(Debug, Clone, Copy)]
pub struct LightTrait {
    /// The bit in the shaders' constant `TRAITS`.
    pub bit: u32,
    /// The part's entry in `--plan`.
    pub part: OptionalPart,
    /// The name in reports.
    pub name: &'static str,
}

/// All light traits, in the order of reports.
pub const TRAITS: &[LightTrait] = &[
    LightTrait { bit: CONES, part: OptionalPart::SpotCones, name: "spot cones" },
    LightTrait { bit: BEAMS, part: OptionalPart::Beams, name: "beams" },
    LightTrait { bit: RANGES, part: OptionalPart::LightRanges, name: "ranges of lights" },
];
const RANGES: u32 = 1;
const CONES: u32 = 2;
const BEAMS: u32 = 4;

/// The value in a light's record for a light without a fall-off.
pub const NO_FALLOFF: u32 = 3;

/// A cone that is wider than this, measured from its axis in degrees, gets the six shadow maps of a point light, and the volume of one: one
/// perspective map would spend most of its texels on its rim, and a cone's mesh would be mostly base.
const WIDEST_CONE: f64 = 60.0;

/// The excess width of a cone's volume over the cone, for the rounding of f32, as a share of its length.
const SLACK: f64 = 1e-3;

/// Least difference of a cone's cosines, part of the model (KHR_lights_punctual's own).
const LEAST_CONE: f64 = 0.001;
/// Least soft edge of a beam as a share of its radius, part of the model.
const LEAST_EDGE: f64 = 0.001;

/// Scales a direction to a length of 1; `None` for a zero vector. It handles vectors whose squared components overflow or underflow f64. A direction
/// whose length is 1 but for rounding is returned unchanged.
pub fn unit(direction: DVec3) -> Option<DVec3> {
    match (direction.length_squared() - 1.0).abs() < 1e-14 {
        true => Some(direction),
        false => (direction / direction.abs().max_element()).try_normalize(),
    }
}

impl LightKind {
    /// Returns all properties of the light. The patterns name every field, so a new field does not compile until it has a place here, and with it in
    /// the checks of scenes and in the fingerprints of truths.
    pub fn form(&self) -> LightForm {
        let (place, direction, outline, range, falloff) = (None, None, Outline::Space, None, None);
        let form = |number, name, unit| LightForm { number, name, unit, place, direction, outline, range, falloff };
        match *self {
            Self::Directional { direction } => LightForm { direction: Some(direction), ..form(0, "directional", "lx") },
            Self::Point { position, range, falloff } => {
                LightForm { place: Some(position), range, falloff: Some(falloff), ..form(1, "point", "cd") }
            }
            Self::Spot { position, direction, inner_angle_degrees, outer_angle_degrees, range, falloff } => LightForm {
                place: Some(position),
                direction: Some(direction),
                outline: Outline::Cone { inner: inner_angle_degrees, outer: outer_angle_degrees },
                range,
                falloff: Some(falloff),
                ..form(2, "spot", "cd")
            },
            Self::Beam { position, direction, radius, edge, range } => LightForm {
                place: Some(position),
                direction: Some(direction),
                outline: Outline::Cylinder { radius, edge },
                range,
                ..form(3, "beam", "lx")
            },
        }
    }

    /// Returns true if the light is infinitely far away.
    pub fn is_directional(&self) -> bool {
        self.form().place.is_none()
    }

    /// The position, to be changed.
    pub fn place_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Self::Directional { .. } => None,
            Self::Point { position, .. } | Self::Spot { position, .. } | Self::Beam { position, .. } => Some(position),
        }
    }

    /// The direction, to be changed.
    pub fn direction_mut(&mut self) -> Option<&mut DVec3> {
        match self {
            Self::Point { .. } => None,
            Self::Directional { direction } | Self::Spot { direction, .. } | Self::Beam { direction, .. } => {
                Some(direction)
            }
        }
    }
}

impl Outline {
    /// Returns the fault of its numbers, in words.
    pub(super) fn fault(&self) -> Option<String> {
        match *self {
            Self::Space => None,
            Self::Cone { inner, outer } if !(inner.is_finite() && outer.is_finite()) => {
                Some("cone is not finite".into())
            }
            Self::Cone { inner, outer } if 0.0 <= inner && inner <= outer && outer <= 180.0 => None,
            Self::Cone { inner, outer } => {
                Some(format!("its cone is {inner} to {outer} degrees: expected 0 <= inner <= outer <= 180"))
            }
            Self::Cylinder { radius, edge } if !(radius.is_finite() && edge.is_finite()) => {
                Some("disc is not finite".into())
            }
            Self::Cylinder { radius, .. } if radius <= 0.0 => {
                Some(format!("its disc has a radius of {radius} m: expected more than 0"))
            }
            Self::Cylinder { edge, .. } if (0.0..=1.0).contains(&edge) => None,
            Self::Cylinder { edge, .. } => Some(format!("its soft edge is {edge} of its radius: expected 0 to 1")),
        }
    }
}

impl LightForm {
    /// All numbers of the light by name, except the fall-off.
    pub fn numbers(&self) -> Vec<(&'static str, Vec<f64>)> {
        let vector = |vector: DVec3| vector.to_array().to_vec();
        let outline = match self.outline {
            Outline::Space => None,
            Outline::Cone { inner, outer } => Some(("cone", vec![inner, outer])),
            Outline::Cylinder { radius, edge } => Some(("disc", vec![radius, edge])),
        };
        let range = self.place.map(|_| ("range", vec![self.range.unwrap_or(-1.0)]));
        let place = self.place.map(|place| ("position", vector(place)));
        let direction = self.direction.map(|direction| ("direction", vector(direction)));
        [place, direction, outline, range].into_iter().flatten().collect()
    }

    /// The bits of [`TRAITS`] that it needs.
    pub fn traits(&self) -> u32 {
        let outline = match self.outline {
            Outline::Space => 0,
            Outline::Cone { .. } => CONES,
            Outline::Cylinder { .. } => BEAMS,
        };
        outline | if self.range.is_some() { RANGES } else { 0 }
    }

    /// Scale and offset by which `shaders/shared/lights.wgsl` cuts the outline: for a cone `saturate(scale cos(angle) + offset)^2`
    /// (KHR_lights_punctual, "Inner and Outer Cone Angles"), for a cylinder the same formula of the distance from the axis in metres.
    pub fn edge(&self) -> [f64; 2] {
        match self.outline {
            Outline::Space => [0.0, 1.0],
            Outline::Cone { inner, outer } => {
                let (inner, outer) = (inner.to_radians().cos(), outer.to_radians().cos());
                let scale = 1.0 / (inner - outer).max(LEAST_CONE);
                [scale, -outer * scale]
            }
            Outline::Cylinder { radius, edge } => {
                let share = 1.0 / edge.max(LEAST_EDGE);
                [-share / radius, share]
            }
        }
    }

    /// A sphere around the space that the light reaches within `reach` metres: its centre and radius. A narrow cone gets a smaller sphere than one
    /// around the light: through the apex and the rim of its base, or around the rim alone if the cone is wider than 45 degrees.
    pub fn sphere(&self, reach: f64) -> (DVec3, f64) {
        let Some(place) = self.place else { return (DVec3::ZERO, f64::INFINITY) };
        match (self.outline, self.unit_direction()) {
            (Outline::Cone { outer, .. }, Some(direction)) if reach.is_finite() && outer < 90.0 => {
                let angle = outer.to_radians();
                if angle <= std::f64::consts::FRAC_PI_4 {
                    let radius = reach / (2.0 * angle.cos());
                    (place + direction * radius, radius)
                } else {
                    (place + direction * (reach * angle.cos()), reach * angle.sin())
                }
            }
            (Outline::Cylinder { radius, .. }, Some(direction)) if reach.is_finite() => {
                (place + direction * (0.5 * reach), radius.hypot(0.5 * reach))
            }
            _ => (place, reach),
        }
    }

    /// The greatest distance from its position, in metres, at which it lights anything within `reach` metres.
    pub fn extent(&self, reach: f64) -> f64 {
        match self.outline {
            Outline::Space | Outline::Cone { .. } => reach,
            Outline::Cylinder { radius, .. } => reach.hypot(radius),
        }
    }

    /// A volume around the space that the light reaches within `reach` metres, which is finite: a solid, the columns of the matrix that transforms
    /// it, and the offset of the transformed origin from the light's position.
    pub fn volume(&self, reach: f64) -> (Solid, DMat3, DVec3) {
        match (self.outline, self.unit_direction()) {
            (Outline::Cone { outer, .. }, Some(direction)) if outer <= WIDEST_CONE => {
                let base = reach * (outer.to_radians().tan() + SLACK);
                let (side, up) = direction.any_orthonormal_pair();
                (Solid::Cone, DMat3::from_cols(side * base, up * base, direction * reach), DVec3::ZERO)
            }
            (Outline::Cylinder { radius, .. }, Some(direction)) => {
                // The smallest ellipsoid around the cylinder, widened by the share by which a beam's range is lengthened for rounding.
                let (along, across) = (0.75f64.sqrt() * reach, 1.5f64.sqrt() * radius * (1.0 + SLACK));
                let (side, up) = direction.any_orthonormal_pair();
                let columns = DMat3::from_cols(side * across, up * across, direction * along);
                (Solid::Sphere, columns, direction * (0.5 * reach))
            }
            _ => (Solid::Sphere, DMat3::from_diagonal(DVec3::splat(reach)), DVec3::ZERO),
        }
    }

    /// Returns true if its rays are parallel; [`Light::size`] is then an angle.
    pub fn is_parallel(&self) -> bool {
        self.place.is_none() || matches!(self.outline, Outline::Cylinder { .. })
    }

    /// Returns true if its rays start on a plane: the disc of a beam.
    pub fn starts_at_plane(&self) -> bool {
        self.place.is_some() && self.is_parallel()
    }

    /// The number of its fall-off in shaders.
    pub fn formula(&self) -> u32 {
        let without = if self.place.is_some() { NO_FALLOFF } else { 0 };
        self.falloff.map_or(without, |falloff| falloff.index())
    }

    /// Returns its view of the scene in its shadow maps.
    pub fn shadow_projection(&self) -> ShadowProjection {
        match self.outline {
            _ if self.place.is_none() => ShadowProjection::Far,
            Outline::Cone { outer, .. } if outer <= WIDEST_CONE => ShadowProjection::Ahead(outer.to_radians().tan()),
            Outline::Cylinder { radius, .. } => ShadowProjection::Ahead(radius),
            Outline::Cone { .. } | Outline::Space => ShadowProjection::Around,
        }
    }

    fn unit_direction(&self) -> Option<DVec3> {
        self.direction.map(|direction| unit(direction).unwrap_or(direction))
    }
}

impl Light {
    /// A white light of intensity 1, without a size or shadows.
    pub fn of(kind: LightKind) -> Self {
        Self { name: String::new(), kind, color: Vec3::ONE, intensity: 1.0, casts_shadow: false, size: 0.0 }
    }

    /// Returns the light with its direction, if it has one, scaled to a length of 1, as formulas need it.
    pub fn aimed(&self) -> Self {
        let mut light = self.clone();
        if let Some(direction) = light.kind.direction_mut() {
            *direction = unit(*direction).unwrap_or(*direction);
        }
        light
    }

    /// Moves and rotates the light. A transform's scale affects its position only (KHR_lights_punctual, "Light Shared Properties").
    pub fn transformed(mut self, transform: &DAffine3) -> Self {
        if let Some(place) = self.kind.place_mut() {
            *place = transform.transform_point3(*place);
        }
        if let Some(direction) = self.kind.direction_mut() {
            *direction = unit(transform.transform_vector3(*direction)).unwrap_or(*direction);
        }
        self
    }

    /// Returns true if it emits any light.
    pub fn shines(&self) -> bool {
        self.intensity > 0.0 && self.color.max_element() > 0.0
    }

    /// Half the size of the source: the radius in metres, or, if rays are parallel, the tangent of half the angle.
    pub fn half_size(&self) -> f64 {
        if self.kind.form().is_parallel() { (0.5 * self.size).to_radians().tan() } else { self.size }
    }

    /// The illuminance in lux on a receptor at `point` that faces the light, in a scene of `radius` metres, for metering.
    ///
    /// A light with a range counts by its lux at half its range, times the share of the scene that it reaches: a scene of many
    /// short-ranged lamps is lit although none of them reaches the centre. Cones of spots count as open; a beam counts by its share of the
    /// scene's cross-section.
    pub(super) fn illuminance(&self, point: DVec3, radius: f64) -> f64 {
        let intensity = f64::from(luminance(self.color)) * f64::from(self.intensity);
        let form = self.kind.form();
        let Some(place) = form.place else { return intensity };
        let distance = place.distance(point).max(if radius > 0.0 { radius * 0.25 } else { 1.0 });
        let is_short = |range: &f64| *range < distance * 2.0;
        let reached = form.range.filter(is_short).map_or(1.0, |range| (range / radius).powi(3).min(1.0));
        let reached = match form.outline {
            Outline::Space | Outline::Cone { .. } => reached,
            Outline::Cylinder { radius: own, .. } => reached * (own / radius).powi(2).min(1.0),
        };
        intensity * (form.falloff.map_or(1.0, |falloff| falloff.metered(form.range, distance)) * reached)
    }
}

/// The fall-off of light with the distance d, in metres; r is the range.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Falloff {
    /// 1 / max(d^2, 1 cm^2), windowed by `sat(1 - (d/r)^4)^2` when there is a range (Karis 2013, "Real Shading in Unreal
    /// Engine 4"; the window that KHR_lights_punctual recommends is its square root).
    #[default]
    InverseSquare,
    /// max(1 - (d/r)^2, 0); needs a range.
    Quadratic,
    /// 1 / (constant + linear d + quadratic d^2), cut at the range when there is one.
    Polynomial {
        /// Not negative, as the others.
        constant: f32,
        /// Per metre.
        linear: f32,
        /// Per square metre.
        quadratic: f32,
    },
}

impl Falloff {
    /// Returns the fall-off's number in shaders.
    pub const fn index(&self) -> u32 {
        match self {
            Self::InverseSquare => 0,
            Self::Quadratic => 1,
            Self::Polynomial { .. } => 2,
        }
    }

    /// Constant, linear and quadratic coefficient of a polynomial; zeros for other fall-offs.
    pub fn terms(&self) -> [f32; 3] {
        match *self {
            Self::InverseSquare | Self::Quadratic => [0.0; 3],
            Self::Polynomial { constant, linear, quadratic } => [constant, linear, quadratic],
        }
    }

    /// The fall-off at `distance` metres, or at half the range if that is nearer.
    fn metered(&self, range: Option<f64>, distance: f64) -> f64 {
        let distance = range.map_or(distance, |range| distance.min(range * 0.5));
        let ratio = range.map_or(0.0, |range| distance / range);
        match self {
            Self::InverseSquare => (1.0 - ratio.powi(4)).clamp(0.0, 1.0).powi(2) / (distance * distance).max(1e-12),
            Self::Quadratic => (1.0 - ratio * ratio).clamp(0.0, 1.0),
            Self::Polynomial { .. } => {
                let [c, l, q] = self.terms().map(f64::from);
                1.0 / (c + l * distance + q * distance * distance).max(1e-12)
            }
        }
    }

    /// Distance in metres beyond which a polynomial light of `intensity` candela brings less than `cutoff` lux: the greatest root of
    /// intensity / (c + l d + q d^2) = cutoff. The light's volume is drawn with this radius.
    ///
    /// 0 when it is never that bright; infinity when it never falls below (no linear and no quadratic term, or a cut-off that is
    /// not above 0); `None` for the other fall-offs, whose reach is their range. Never NaN.
    pub fn polynomial_radius(&self, intensity: f64, cutoff: f64) -> Option<f64> {
        let Self::Polynomial { constant, linear, quadratic } = *self else { return None };
        let [c, l, q] = [constant, linear, quadratic].map(|term| f64::from(term).max(0.0));
        if cutoff.is_nan() || cutoff <= 0.0 {
            return Some(f64::INFINITY);
        }
        // q d^2 + l d = excess
        let excess = intensity / cutoff - c;
        if excess.is_nan() || excess <= 0.0 {
            return Some(0.0);
        }
        // The form that does not cancel: 2 excess / (l + sqrt(l^2 + 4 q excess)), right for q = 0 as well. Roots are taken apart
        // so that neither square overflows.
        let root = l.hypot(2.0 * q.sqrt() * excess.sqrt());
        let radius = 2.0 * (excess / (l + root));
        Some(if radius.is_nan() { f64::INFINITY } else { radius })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn radius(constant: f32, linear: f32, quadratic: f32, intensity: f64, cutoff: f64) -> f64 {
        Falloff::Polynomial { constant, linear, quadratic }.polynomial_radius(intensity, cutoff).unwrap()
    }

    #[test]
    fn at_the_radius_the_light_is_as_bright_as_the_cutoff() {
        for (c, l, q) in [(1.0, 0.7, 1.8), (0.0, 0.0, 1.0), (1.0, 0.5, 0.0), (0.0, 2.0, 1e-6), (1e-3, 0.0, 1e6)] {
            let (intensity, cutoff) = (100.0, 0.02);
            let d = radius(c, l, q, intensity, cutoff);
            let there = intensity / (f64::from(c) + f64::from(l) * d + f64::from(q) * d * d);
            assert!((there / cutoff - 1.0).abs() < 1e-9, "{c} {l} {q}: {d} {there}");
        }
    }

    proptest! {
        /// Checks points on the rims of both ends, the farthest points of a beam.
        #[test]
        fn all_that_a_beam_lights_lies_in_its_sphere_and_in_its_volume(
            place in [-9.0..9.0f64, -9.0..9.0, -9.0..9.0], to in [-1.0..1.0f64, -1.0..1.0, -1.0..1.0], radius in 1e-3..9.0f64,
            reach in 1e-3..9.0f64, turn in 0.0..6.2f64, far: bool,
        ) {
            let (position, direction) = (DVec3::from(place), DVec3::from(to));
            prop_assume!(direction.length() > 0.1);
            let form = LightKind::Beam { position, direction, radius, edge: 0.5, range: Some(reach) }.form();
            let (side, up) = direction.normalize().any_orthonormal_pair();
            let rim = (side * turn.cos() + up * turn.sin()) * radius + direction.normalize() * if far { reach } else { 0.0 };
            let (center, around) = form.sphere(reach);
            prop_assert!((position + rim).distance(center) <= around * (1.0 + 1e-12));
            prop_assert!(rim.length() <= form.extent(reach) * (1.0 + 1e-12));
            let (solid, columns, zero) = form.volume(reach);
            let within = columns.inverse() * (rim - zero);
            prop_assert!(solid == Solid::Sphere && within.length() <= 1.0, "{within}");
        }
    }

    #[test]
    fn a_direction_of_any_length_but_none_has_a_unit_vector() {
        let along = DVec3::new(-0.35, -0.9, 0.3).normalize();
        assert_eq!(unit(along), Some(along));
        for length in [5e-324, 1e-310, 1e-300, 1e-160, 1e-3, 7.0, 1e160, 1e300] {
            let found = unit(along * length).expect("it has a length");
            // A direction too short for its digits still points roughly along its largest component.
            assert!(found.distance(along) < if length < 1e-300 { 1.0 } else { 1e-15 }, "{length}: {found}");
            assert!((found.length() - 1.0).abs() < 1e-15);
        }
        assert_eq!([DVec3::ZERO, DVec3::NAN, DVec3::INFINITY].map(unit), [None; 3]);
    }

    #[test]
    fn the_limits_of_the_polynomial_radius_are_not_nan() {
        assert_eq!(radius(1.0, 0.0, 0.0, 5.0, 0.1), f64::INFINITY);
        assert_eq!(radius(1.0, 1.0, 1.0, 0.01, 0.1), 0.0);
        assert_eq!(radius(1.0, 1.0, 1.0, 5.0, 0.0), f64::INFINITY);
        assert_eq!(radius(0.0, 0.0, 0.0, 0.0, 0.0), f64::INFINITY);
        for term in [0.0, f32::MIN_POSITIVE, 1.0, f32::MAX] {
            for intensity in [0.0, f64::MIN_POSITIVE, 1.0, f64::MAX] {
                assert!(!radius(term, term, term, intensity, 1e-300).is_nan());
            }
        }
        assert_eq!(Falloff::InverseSquare.polynomial_radius(1.0, 1.0), None);
    }
}
