//! Quantities from plain numbers: each takes one number from 0 up to 1, and 0 always makes the plainest of it, so that shrinking
//! numbers simplifies scenes.

use glam::Vec3;

/// A source of random numbers.
pub struct RandomSource<'a>(pub &'a mut dyn FnMut() -> f64);

impl RandomSource<'_> {
    fn number(&mut self) -> f64 {
        (self.0)()
    }

    /// True in this share of all draws.
    pub fn chance(&mut self, share: f64) -> bool {
        self.number() > 1.0 - share
    }

    /// One of them; the first is the plainest.
    pub fn pick<T: Copy>(&mut self, all: &[T]) -> T {
        let index = (self.number() * all.len() as f64) as usize;
        all[index.min(all.len() - 1)]
    }

    /// A number between two values; the first is the plainest.
    pub fn between(&mut self, plain: f64, other: f64) -> f64 {
        plain + (other - plain) * self.number()
    }

    /// A power of ten, half of them from 1 up to `10^last`, the others from 1 down to `10^first`.
    pub fn decades(&mut self, first: f64, last: f64) -> f64 {
        let number = 2.0 * self.number();
        10f64.powf(if number < 1.0 { number * last } else { (number - 1.0) * first })
    }

    /// A share from 0 to 1, as often as not one of the ends, or next to nothing.
    pub fn share(&mut self, plain: f32) -> f32 {
        let number = 6.0 * self.number();
        match number as u32 {
            0 => plain,
            1 => 0.0,
            2 => 1.0,
            3 => 10f64.powf(-6.0 * number.fract()) as f32,
            _ => (0.5 * (number - 4.0)) as f32,
        }
    }

    pub fn color(&mut self, plain: f32) -> Vec3 {
        Vec3::new(self.share(plain), self.share(plain), self.share(plain))
    }

    /// Returns the value in this share of all draws; takes its numbers in any case, so that later values do not change.
    pub fn sometimes<T>(&mut self, share: f64, value: impl FnOnce(&mut Self) -> T) -> Option<T> {
        let is_there = self.chance(share);
        let value = value(self);
        is_there.then_some(value)
    }
}
