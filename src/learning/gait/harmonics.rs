//! Smoothness: how much of a joint's motion lies in the first harmonics of the stride.

use std::f64::consts::TAU;

use nalgebra::{SMatrix, SVector};

use gaitwright_physics::playback::Trace;

/// A constant, and cosine and sine of three harmonics.
const TERMS: usize = 7;
/// A joint is judged where its standard deviation is at least this share of the greatest of its kind; what hardly moves
/// has no motion that could be smooth.
const MOVING: f64 = 0.1;

/// Share of the variance of each joint's angle that three harmonics of a stride of `period` seconds explain, 0 to 1: least
/// squares over the whole trace. Joints that move by less than a tenth of the one that moves most are left out; a joint
/// slides where `slides` says so, and is compared with those that slide.
pub(super) fn smooth_shares(trace: &Trace, period: f64, slides: &[bool]) -> Vec<f64> {
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
        .filter_map(|joint| Some((explained(trace, period, joint)? / variances[joint]).clamp(0.0, 1.0)))
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
fn explained(trace: &Trace, period: f64, joint: usize) -> Option<f64> {
    let terms = |time: f64| {
        SVector::<f64, TERMS>::from_fn(|row, _| {
            let angle = TAU * row.div_ceil(2) as f64 * time / period;
            if row % 2 == 1 { angle.sin() } else { angle.cos() }
        })
    };
    let (mut square, mut side) = (SMatrix::<f64, TERMS, TERMS>::zeros(), SVector::<f64, TERMS>::zeros());
    for (time, angle) in angle(trace, joint) {
        let terms = terms(time);
        square += terms * terms.transpose();
        side += terms * angle;
    }
    let weights = square.cholesky()?.solve(&side);
    let count = trace.samples.len().max(1) as f64;
    let left =
        angle(trace, joint).map(|(time, angle)| (angle - weights.dot(&terms(time))).powi(2)).sum::<f64>();
    Some(variance(trace, joint) - left / count)
}
