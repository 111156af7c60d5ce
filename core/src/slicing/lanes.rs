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
    /// Whether it is single precision.
    const IS_SINGLE: bool;
    /// 1.
    const ONE: Self;
    /// A pivot is never smaller than this.
    const LEAST_PIVOT: Self;

    /// Rounds a number.
    fn rounded(value: f64) -> Self;

    /// Returns the same number in double precision.
    fn double(self) -> f64;

    /// Returns the number, or [`Real::LEAST_PIVOT`] when it is closer to 0.
    fn away_from_zero(self) -> Self;
}

impl Real for f32 {
    const IS_SINGLE: bool = true;
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

    #[inline(always)]
    fn away_from_zero(self) -> Self {
        if self.abs() < Self::LEAST_PIVOT { Self::LEAST_PIVOT } else { self }
    }
}

impl Real for f64 {
    const IS_SINGLE: bool = false;
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

    #[inline(always)]
    fn away_from_zero(self) -> Self {
        if self.abs() < Self::LEAST_PIVOT { Self::LEAST_PIVOT } else { self }
    }
}

/// Takes the product of two lanes away from a third.
#[inline(always)]
pub fn subtract_product<T: Real>(from: &mut Lanes<T>, a: &Lanes<T>, b: &Lanes<T>) {
    for lane in 0..LANES {
        from[lane] = from[lane] - a[lane] * b[lane];
    }
}

/// Adds the product of two lanes to a third.
#[inline(always)]
pub fn add_product<T: Real>(to: &mut Lanes<T>, a: &Lanes<T>, b: &Lanes<T>) {
    for lane in 0..LANES {
        to[lane] = to[lane] + a[lane] * b[lane];
    }
}

/// Returns the product of two lanes.
#[inline(always)]
pub fn product<T: Real>(a: &Lanes<T>, b: &Lanes<T>) -> Lanes<T> {
    let mut product = *a;
    for lane in 0..LANES {
        product[lane] = product[lane] * b[lane];
    }
    product
}

/// Returns the sum of all lanes.
#[inline(always)]
pub fn sum(mut lanes: Lanes<f64>) -> f64 {
    for half in [8, 4, 2, 1] {
        for lane in 0..half {
            lanes[lane] += lanes[lane + half];
        }
    }
    lanes[0]
}

/// Returns the same numbers in double precision.
#[inline(always)]
pub fn double<T: Real>(lanes: &Lanes<T>) -> Lanes<f64> {
    let mut double = [0.0; LANES];
    for lane in 0..LANES {
        double[lane] = lanes[lane].double();
    }
    double
}

/// Rounds numbers.
#[inline(always)]
pub fn rounded<T: Real>(lanes: &Lanes<f64>) -> Lanes<T> {
    let mut rounded = [T::default(); LANES];
    for lane in 0..LANES {
        rounded[lane] = T::rounded(lanes[lane]);
    }
    rounded
}

/// Keeps the compiler from vectorising a loop over rows, whose numbers for a lane are far apart in
/// memory, instead of the lanes of a row.
#[inline(always)]
pub fn one_row_at_a_time() {
    std::hint::black_box(());
}

/// Applies `f` to every item, and to the last one in the remaining lanes.
#[inline(always)]
pub fn spread<T, U>(items: &[T], f: impl Fn(&T) -> U) -> Lanes<U> {
    std::array::from_fn(|lane| f(&items[lane.min(items.len() - 1)]))
}
