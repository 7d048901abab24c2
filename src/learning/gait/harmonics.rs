//! Smoothness: how much of a joint's motion lies in the first harmonics of the stride.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};

use gaitwright_physics::playback::Trace;

use super::limits::SMOOTHNESS;

/// Fewest harmonics of a stride in which a motion is to lie.
const FEWEST_HARMONICS: usize = 3;
/// Greatest duty factor for whose sake more harmonics count: that of the slowest named gait, the wave of six legs.
const LONGEST_STANCE: f64 = 5.0 / 6.0;
/// What [`harmonics`] is at most: as many as the longest stance has.
pub(crate) const MOST_HARMONICS: usize = 6;
/// A joint is judged where its standard deviation is at least this share of the greatest of its kind; what hardly moves
/// has no motion that could be smooth.
pub(crate) const MOVING: f64 = 0.1;

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

/// Share of the variance of each joint's angle that so many harmonics of a stride of `period` seconds explain, 0 to 1: least
/// squares over the whole trace. Joints that move by less than a tenth of the one that moves most are left out; a joint
/// slides where `slides` says so, and is compared with those that slide.
pub(super) fn smooth_shares(trace: &Trace, (period, harmonics): (f64, usize), slides: &[bool]) -> Vec<f64> {
    let variances: Vec<f64> = (0..slides.len()).map(|joint| variance(trace, joint)).collect();
    let greatest = |kind: bool| {
        let of_kind = variances.iter().zip(slides).filter(|(_, slides)| **slides == kind);
        of_kind.map(|(variance, _)| *variance).fold(0.0, f64::max)
    };
    let greatest = [greatest(false), greatest(true)];
    let judged = (0..slides.len()).filter(|&joint| {
        let most = greatest[usize::from(slides[joint])];
        most > 0.0 && variances[joint] >= MOVING * MOVING * most
    });
    judged
        .filter_map(|joint| {
            Some((explained(trace, (period, harmonics), joint)? / variances[joint]).clamp(0.0, 1.0))
        })
        .collect()
}

fn angle(trace: &Trace, joint: usize) -> impl Iterator<Item = (f64, f64)> {
    trace.samples.iter().filter_map(move |sample| Some((sample.time, *sample.angles.get(joint)?)))
}

fn variance(trace: &Trace, joint: usize) -> f64 {
    let count = trace.samples.len().max(1) as f64;
    let mean = angle(trace, joint).map(|(_, angle)| angle).sum::<f64>() / count;
    angle(trace, joint).map(|(_, angle)| (angle - mean).powi(2)).sum::<f64>() / count
}

/// Variance less the mean square of what the harmonics leave over; `None` where the trace is too short to tell them apart.
fn explained(trace: &Trace, (period, harmonics): (f64, usize), joint: usize) -> Option<f64> {
    // A constant, and sine and cosine of each harmonic.
    let count = 2 * harmonics + 1;
    let terms = |time: f64| {
        DVector::from_fn(count, |row, _| {
            let angle = TAU * row.div_ceil(2) as f64 * time / period;
            if row % 2 == 1 { angle.sin() } else { angle.cos() }
        })
    };
    let (mut square, mut side) = (DMatrix::zeros(count, count), DVector::zeros(count));
    for (time, angle) in angle(trace, joint) {
        let terms = terms(time);
        square.ger(1.0, &terms, &terms, 1.0);
        side.axpy(angle, &terms, 1.0);
    }
    let weights = square.cholesky()?.solve(&side);
    let count = trace.samples.len().max(1) as f64;
    let left =
        angle(trace, joint).map(|(time, angle)| (angle - weights.dot(&terms(time))).powi(2)).sum::<f64>();
    Some(variance(trace, joint) - left / count)
}
