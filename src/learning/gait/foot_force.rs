//! How hard feet land.

use std::f64::consts::FRAC_PI_2;

use super::footfall::{Footing, interval, load};
use gaitwright_physics::playback::Trace;

/// Forces are averaged over this share of √(h / g) before their peak is taken: what rigid contact gives within one step
/// depends on the step, and no sensor would show it.
pub(crate) const IMPACT: f64 = 0.05;

/// Peak force of each foot that stands, over the peak of a half-sine of the same duty factor β and the same mean over the
/// stride, that is π / (2 β) times the share of the weight that the foot carries. 1 is a half-sine, 2 / π a constant
/// force. The ground's forces in `trace` are averaged with a memory of [`IMPACT`] `unit_time`, s.
pub(super) fn peak_forces(trace: &Trace, footings: &[Footing], unit_time: f64) -> Vec<f64> {
    let memory = (-interval(trace) / (IMPACT * unit_time)).exp();
    footings
        .iter()
        .filter_map(|footing| {
            let forces = trace.samples.iter().map(|sample| load(sample, &footing.links));
            let (mut smooth, mut peak, mut sum) = (0.0, 0.0_f64, 0.0);
            for force in forces {
                smooth = memory * smooth + (1.0 - memory) * force;
                peak = peak.max(smooth);
                sum += force;
            }
            let count = trace.samples.len().max(1) as f64;
            let duty = footing.stance.iter().filter(|stands| **stands).count() as f64 / count;
            let usual = sum / count * FRAC_PI_2 / duty;
            (usual > 0.0 && usual.is_finite()).then(|| peak / usual)
        })
        .collect()
}
