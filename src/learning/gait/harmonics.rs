//! Smoothness: how much of a joint's motion lies in the first harmonics of the stride.

use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;

use super::limits::SMOOTHNESS;

/// Fewest harmonics of a stride in which a motion is to lie.
const FEWEST_HARMONICS: usize = 3;
/// Greatest duty factor for whose sake more harmonics count: that of the slowest named gait, the wave of six legs.
const LONGEST_STANCE: f64 = 5.0 / 6.0;
/// What [`harmonics`] is at most: as many as the longest stance has.
pub(crate) const MOST_HARMONICS: usize = 6;
/// A joint is judged where its standard deviation is at least this share of the greatest of its kind; what hardly moves
/// has no motion that could be smooth.
const MOVING: f64 = 0.1;

/// How many harmonics of the stride hold a smooth motion of feet with this greatest duty factor: the fewest, three or more, in
/// which a swing of 1 − `duty` of the stride has as much of its variance as is asked ([`SMOOTHNESS`]) where it is as
/// smooth as it can be, a raised cosine.
///
/// The n-th Fourier coefficient of a raised cosine of width w is w / 2 · sinc(n w) / (1 − (n w)²): three harmonics hold 97 % of it where a
/// foot stands for .65 of the stride, 92 % at .7, 73 % at .8.
pub(crate) fn harmonics(duty: f64) -> usize {
    let width = 1.0 - duty.clamp(0.0, LONGEST_STANCE);
    let variance = 3.0 / 8.0 * width - width * width / 4.0;
    let half_square = |order: usize| {
        let turns = order as f64 * width;
        // At one turn both sinc and the denominator are 0; their ratio is one half.
        let shape = if (turns - 1.0).abs() < 1e-6 {
            0.5
        } else {
            (PI * turns).sin() / (PI * turns) / (1.0 - turns * turns)
        };
        2.0 * (0.5 * width * shape).powi(2)
    };
    let held = |count: usize| (1..=count).map(half_square).sum::<f64>() / variance;
    (FEWEST_HARMONICS..MOST_HARMONICS).find(|&count| held(count) >= SMOOTHNESS).unwrap_or(MOST_HARMONICS)
}

/// Least squares of joint angles by the harmonics of a stride, from sums over moments of it. These need be neither whole strides nor
/// evenly spaced.
#[derive(Debug, Clone)]
pub(crate) struct HarmonicFit {
    moments: f64,
    /// 1, and sine and cosine of each harmonic, at the moment taken in last.
    terms: Vec<f64>,
    /// Sums of the products of the terms with each other, and with each joint's angle.
    terms_by_terms: DMatrix<f64>,
    terms_by_angles: DMatrix<f64>,
    /// Sums of the squared angles.
    squares: Vec<f64>,
}

impl HarmonicFit {
    /// Of so many joints by at most so many harmonics.
    pub(crate) fn new(joints: usize, harmonics: usize) -> Self {
        let count = 2 * harmonics + 1;
        Self {
            moments: 0.0,
            terms: vec![1.0; count],
            terms_by_terms: DMatrix::zeros(count, count),
            terms_by_angles: DMatrix::zeros(count, joints),
            squares: vec![0.0; joints],
        }
    }

    /// Takes in the joints' `angles` at a moment of the stride, `turns` strides after any fixed one.
    pub(crate) fn add(&mut self, turns: f64, angles: &[f64]) {
        self.moments += 1.0;
        for (order, pair) in self.terms[1..].chunks_exact_mut(2).enumerate() {
            let (sine, cosine) = (TAU * (order + 1) as f64 * turns).sin_cos();
            pair.copy_from_slice(&[sine, cosine]);
        }
        for (column, &term) in self.terms.iter().enumerate() {
            for (row, &other) in self.terms.iter().enumerate().skip(column) {
                self.terms_by_terms[(row, column)] += term * other;
            }
        }
        for (joint, &angle) in angles.iter().enumerate() {
            self.squares[joint] += angle * angle;
            for (row, &term) in self.terms.iter().enumerate() {
                self.terms_by_angles[(row, joint)] += term * angle;
            }
        }
    }

    /// Share of the variance of each joint's angle that the first so many harmonics explain, 0 to 1; nothing where there were too few moments
    /// to tell them apart. Joints that move by less than a tenth of the one that moves most are left out; a joint slides where `slides`
    /// says so, and is compared with those that slide.
    pub(crate) fn shares(&self, harmonics: usize, slides: &[bool]) -> Vec<f64> {
        let count = 2 * harmonics + 1;
        let Some(factor) = self.terms_by_terms.view((0, 0), (count, count)).clone_owned().cholesky() else {
            return Vec::new();
        };
        // Sums of the angles are their products with the first term, 1.
        let mean_part = |joint: usize| self.terms_by_angles[(0, joint)].powi(2) / self.moments;
        let variances: Vec<f64> =
            self.squares.iter().enumerate().map(|(joint, square)| square - mean_part(joint)).collect();
        let greatest = |kind: bool| {
            let of_kind = variances.iter().zip(slides).filter(|(_, slides)| **slides == kind);
            of_kind.map(|(variance, _)| *variance).fold(0.0, f64::max)
        };
        let greatest = [greatest(false), greatest(true)];
        let judged = (0..slides.len()).filter(|&joint| {
            let most = greatest[usize::from(slides[joint])];
            most > 0.0 && variances[joint] >= MOVING * MOVING * most
        });
        let sides = self.terms_by_angles.rows(0, count);
        judged
            .map(|joint| {
                let side = sides.column(joint);
                let explained = side.dot(&factor.solve(&side)) - mean_part(joint);
                (explained / variances[joint]).clamp(0.0, 1.0)
            })
            .collect()
    }
}
