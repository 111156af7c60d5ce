//! Lanes: the numbers of 16 shifts side by side, which the compiler turns into vector instructions.
//!
//! No operation is fused and every sum has a fixed order, so that all instruction sets give the
//! same bits.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Shifts of a batch: one register of AVX-512 in single precision, two in double precision.
pub const LANES: usize = 16;

/// One number for every shift.
pub type Lanes<T> = [T; LANES];

/// The precision of a factorisation.
pub trait Real:
    Copy
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 1.
    const ONE: Self;
    /// A pivot is never smaller than this.
    const LEAST_PIVOT: Self;

    /// Rounds a number.
    fn rounded(value: f64) -> Self;

    /// Returns the same number in double precision.
    fn double(self) -> f64;
}

impl Real for f32 {
    const ONE: Self = 1.0;
    const LEAST_PIVOT: Self = 1e-12;

    #[inline(always)]
    fn rounded(value: f64) -> Self {
        value as f32
    }

    #[inline(always)]
    fn double(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    const ONE: Self = 1.0;
    const LEAST_PIVOT: Self = 1e-30;

    #[inline(always)]
    fn rounded(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn double(self) -> f64 {
        self
    }
}

/// Takes the product of two lanes away from a third.
#[inline(always)]
pub fn subtract_product<T: Real>(from: &mut Lanes<T>, a: &Lanes<T>, b: &Lanes<T>) {
    for lane in 0..LANES {
        from[lane] = from[lane] - a[lane] * b[lane];
    }
}

/// Applies `f` to every item, and to the last one in the remaining lanes.
#[inline(always)]
pub fn spread<T, U>(items: &[T], f: impl Fn(&T) -> U) -> Lanes<U> {
    std::array::from_fn(|lane| f(&items[lane.min(items.len() - 1)]))
}
