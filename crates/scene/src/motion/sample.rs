//! The value of a channel at a time, in f64 (glTF 2.0, appendix C).

use glam::{DQuat, DVec4};

use super::{Channel, ChannelTarget, Clip, Interpolation};

/// Between rotations closer than this, in radians on the sphere of quaternions, a chord is an arc to the last bit of f64: its error is the
/// angle's cube over 16.
const SAME: f64 = 1e-6;

/// Scales a quaternion of any finite length but 0 to a length of 1; squares of its components may overflow or underflow f64.
pub(super) fn unit_rotation(rotation: DQuat) -> DQuat {
    let parts = DVec4::from(rotation);
    match (parts / parts.abs().max_element()).try_normalize() {
        Some(unit) => DQuat::from_vec4(unit),
        None => DQuat::IDENTITY,
    }
}

/// Interpolates between two rotations of length 1 along the shorter way, at an even speed.
///
/// The angle comes from the chord and its opposite by atan2: the arc cosine of a dot product loses half the digits where rotations nearly agree.
/// Rotations half a turn apart have two ways of the same length, and the way without a change of sign is taken.
pub(super) fn slerp(from: DQuat, to: DQuat, share: f64) -> DQuat {
    // A rotation and its negative are the same.
    let to = if from.dot(to) < 0.0 { -to } else { to };
    let angle = 2.0 * (from - to).length().atan2((from + to).length());
    if angle < SAME {
        return unit_rotation(from * (1.0 - share) + to * share);
    }
    // The angle is at most a right one, so the sine is no smaller than its share of it.
    unit_rotation((from * ((1.0 - share) * angle).sin() + to * (share * angle).sin()) / angle.sin())
}

/// A time's place among keys.
enum KeyPosition {
    /// The time is at a key, or clamped to the first or the last one.
    Key(usize),
    /// After this key, at a share of the way to the next one; the last number is the seconds between the two keys.
    Between(usize, f64, f64),
}

fn key_position(times: &[f64], time: f64) -> Option<KeyPosition> {
    let last = times.len().checked_sub(1)?;
    let next = times.partition_point(|key| *key <= time);
    if next == 0 || next > last {
        return Some(KeyPosition::Key(next.saturating_sub(1)));
    }
    let (from, to) = (times[next - 1], times[next]);
    let (past, seconds) = (time - from, to - from);
    if past <= 0.0 || seconds.is_nan() {
        return Some(KeyPosition::Key(next - 1));
    }
    Some(KeyPosition::Between(next - 1, past / seconds, seconds))
}

impl Channel {
    /// The number of values of the target: 3 for a translation, 4 for a rotation, one for each shape for weights.
    pub fn width(&self) -> usize {
        let each = self.stride();
        if self.interpolation == Interpolation::CubicSpline { each / 3 } else { each }
    }

    /// The number of values for each key.
    fn stride(&self) -> usize {
        self.values.len().checked_div(self.times.len()).unwrap_or_default()
    }

    /// Writes the value at a time in seconds of the clip, clamped to the first and the last key. Returns false, and writes nothing, if there are no
    /// keys or if they have fewer values than `out`.
    pub fn sample(&self, time: f64, out: &mut [f64]) -> bool {
        if out.is_empty() || self.width() < out.len() || time.is_nan() {
            return false;
        }
        match key_position(&self.times, time) {
            None => false,
            Some(KeyPosition::Key(key)) => {
                out.copy_from_slice(self.value(key, out.len()));
                self.straighten(out);
                true
            }
            Some(KeyPosition::Between(key, share, seconds)) => {
                match self.interpolation {
                    Interpolation::Step => {
                        out.copy_from_slice(self.value(key, out.len()));
                        self.straighten(out);
                    }
                    Interpolation::Linear => self.line(key, share, out),
                    Interpolation::CubicSpline => {
                        self.cubic(key, share, seconds, out);
                        self.straighten(out);
                    }
                }
                true
            }
        }
    }

    /// The value at a key.
    fn value(&self, key: usize, count: usize) -> &[f64] {
        let middle = if self.interpolation == Interpolation::CubicSpline { self.width() } else { 0 };
        &self.values[key * self.stride() + middle..][..count]
    }

    /// Gives rotations a length of 1.
    fn straighten(&self, out: &mut [f64]) {
        if let (ChannelTarget::Rotation(_), Ok(parts)) = (self.target, <[f64; 4]>::try_from(&*out)) {
            out.copy_from_slice(&unit_rotation(DQuat::from_array(parts)).to_array());
        }
    }

    fn line(&self, key: usize, share: f64, out: &mut [f64]) {
        let (from, to) = (self.value(key, out.len()), self.value(key + 1, out.len()));
        if let (ChannelTarget::Rotation(_), Ok(from), Ok(to)) = (self.target, <[f64; 4]>::try_from(from), to.try_into())
        {
            let [from, to] = [from, to].map(|parts| unit_rotation(DQuat::from_array(parts)));
            out.copy_from_slice(&slerp(from, to, share).to_array());
            return;
        }
        for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
            // The sum is exact at both ends; a form based on `from` alone would not be exact at the other.
            *out = from * (1.0 - share) + to * share;
        }
    }

    /// The cubic Hermite spline. Tangents are in units a second; the seconds between the keys convert them to units of the stretch.
    fn cubic(&self, key: usize, share: f64, seconds: f64, out: &mut [f64]) {
        let (width, stride) = (self.width(), self.stride());
        let (here, next) = (&self.values[key * stride..][..stride], &self.values[(key + 1) * stride..][..stride]);
        let (square, cube) = (share * share, share * share * share);
        for (index, out) in out.iter_mut().enumerate() {
            let (from, leaving) = (here[width + index], here[2 * width + index]);
            let (arriving, to) = (next[index], next[width + index]);
            *out = from * (2.0 * cube - 3.0 * square + 1.0)
                + seconds * leaving * (cube - 2.0 * square + share)
                + to * (3.0 * square - 2.0 * cube)
                + seconds * arriving * (cube - square);
        }
    }
}

impl Clip {
    /// The time of the last key of its channels, counted from 0, in seconds.
    pub fn duration(&self) -> f64 {
        let ends = self.channels.iter().filter_map(|channel| channel.times.last().copied());
        ends.fold(0.0, f64::max)
    }
}
