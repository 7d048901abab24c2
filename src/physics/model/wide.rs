//! Numbers of several bodies, or of several rows, side by side.
//!
//! A quantity of four bodies is kept component by component, each component of the four together. A loop over the lanes whose
//! body is the arithmetic of one of them then compiles to instructions that do the same for all four, where
//! the processor has them; the arithmetic is written once, for one body.
//!
//! The compiler finds that by itself if the loop is the whole of a function, and everything that it reads or writes an argument by
//! reference: then it knows that nothing overlaps. Inlined into another function, the same loop stays one of single numbers.

// Plain loops over indices unroll before the compiler looks for lanes; iterators over arrays do not.
#![allow(clippy::needless_range_loop)]

use std::marker::PhantomData;

use nalgebra::{Matrix3, Vector3};

/// How many stand side by side.
pub const LANES: usize = 4;

/// One number of each.
pub type Lanes = [f64; LANES];

/// What consists of `N` numbers.
pub trait Numbers<const N: usize>: Copy {
    /// Its numbers, in an order of its own.
    fn numbers(self) -> [f64; N];

    /// What has the numbers `numbers`.
    fn from_numbers(numbers: [f64; N]) -> Self;
}

/// A quantity of [`LANES`] bodies.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub struct Wide<T, const N: usize> {
    numbers: [Lanes; N],
    of: PhantomData<T>,
}

/// A vector of each.
pub type WideVector = Wide<Vector3<f64>, 3>;

/// A matrix of each.
pub type WideMatrix = Wide<Matrix3<f64>, 9>;

impl<T: Numbers<N>, const N: usize> Wide<T, N> {
    /// Nothing but zeros.
    pub const ZERO: Self = Self { numbers: [[0.0; LANES]; N], of: PhantomData };

    /// `value` in all lanes.
    #[inline(always)] // part of the kernels
    pub fn all(value: T) -> Self {
        Self { numbers: value.numbers().map(|number| [number; LANES]), of: PhantomData }
    }

    /// That of lane `lane`.
    #[inline(always)] // part of the kernels
    pub fn at(&self, lane: usize) -> T {
        let mut numbers = [0.0; N];
        for number in 0..N {
            numbers[number] = self.numbers[number][lane];
        }
        T::from_numbers(numbers)
    }

    /// Sets that of lane `lane`.
    #[inline(always)] // part of the kernels
    pub fn set(&mut self, lane: usize, value: T) {
        let numbers = value.numbers();
        for number in 0..N {
            self.numbers[number][lane] = numbers[number];
        }
    }

    /// Adds the numbers of `other`, lane by lane.
    #[inline(always)] // part of the kernels
    pub fn add(&mut self, other: &Self) {
        for (own, other) in self.numbers.iter_mut().zip(&other.numbers) {
            *own = std::array::from_fn(|lane| own[lane] + other[lane]);
        }
    }

    /// Becomes the sum of `one` and `other`, lane by lane.
    #[inline(always)] // part of the kernels
    pub fn set_sum(&mut self, one: &Self, other: &Self) {
        for (own, (one, other)) in self.numbers.iter_mut().zip(one.numbers.iter().zip(&other.numbers)) {
            *own = std::array::from_fn(|lane| one[lane] + other[lane]);
        }
    }

    /// The sum of all lanes.
    #[inline(always)] // part of the kernels
    pub fn sum(&self) -> T {
        let mut sums = [0.0; N];
        for number in 0..N {
            let [a, b, c, d] = self.numbers[number];
            sums[number] = (a + b) + (c + d);
        }
        T::from_numbers(sums)
    }

    /// Adds the numbers of lane `from` of `other` to those of lane `lane`.
    #[inline(always)] // part of the kernels
    pub fn add_lane(&mut self, lane: usize, other: &Self, from: usize) {
        for (own, other) in self.numbers.iter_mut().zip(&other.numbers) {
            own[lane] += other[from];
        }
    }

    /// Takes into lane `lane` the numbers of lane `from` of `other`.
    #[inline(always)] // part of the kernels
    pub fn copy_lane(&mut self, lane: usize, other: &Self, from: usize) {
        for (own, other) in self.numbers.iter_mut().zip(&other.numbers) {
            own[lane] = other[from];
        }
    }
}

impl Numbers<3> for Vector3<f64> {
    #[inline(always)] // part of the kernels
    fn numbers(self) -> [f64; 3] {
        self.into()
    }

    #[inline(always)] // part of the kernels
    fn from_numbers(numbers: [f64; 3]) -> Self {
        numbers.into()
    }
}

impl Numbers<9> for Matrix3<f64> {
    #[inline(always)] // part of the kernels
    fn numbers(self) -> [f64; 9] {
        [self.m11, self.m21, self.m31, self.m12, self.m22, self.m32, self.m13, self.m23, self.m33]
    }

    #[inline(always)] // part of the kernels
    fn from_numbers([xx, yx, zx, xy, yy, zy, xz, yz, zz]: [f64; 9]) -> Self {
        Self::new(xx, xy, xz, yx, yy, yz, zx, zy, zz)
    }
}
