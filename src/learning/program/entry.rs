//! The entry of a gait: from the standing pose at rest into its cycle.

use std::f64::consts::TAU;

use crate::learn::Posture;

/// Fewest strides of an entry, and its greatest mean acceleration, as a share of gravity.
pub(super) const LEAST_STRIDES: f64 = 2.0;
const ACCELERATION: f64 = 0.2;

/// Strides within which a gait that balances by its feedback comes to step on the spot. Feet that are lifted too little cannot be placed
/// where the trunk leans to: with the lift growing as slowly as the way, searches for a walk of `bolt` ended at costs of 43 to 264 (four
/// of 60 generations each, of one seed), with this at 19 to 39.
pub(super) const STEPPING_STRIDES: usize = 1;

/// A cycle that is entered, and in how many strides.
#[derive(Debug, Clone, Copy)]
pub struct Entered<'a> {
    /// Its postures.
    pub cycle: &'a [Posture],
    /// Strides in which it grows from what was there before it.
    pub strides: usize,
}

/// Strides of `period` seconds in which a gait is entered at whose end it goes at `speed` (m/s) under `gravity` (m/s²).
pub fn strides(speed: f64, gravity: f64, period: f64) -> usize {
    (speed / (ACCELERATION * gravity * period)).ceil().max(LEAST_STRIDES) as usize
}

/// From the standing pose at rest into the last of `cycles`, `duration` seconds between two postures: each cycle grows from the one before
/// it, the first from standing, all of them from the beginning on.
pub fn entry(standing: &[f64], cycles: &[Entered<'_>], duration: f64) -> Vec<Posture> {
    let Some(last) = cycles.last() else { return Vec::new() };
    let count = last.strides * last.cycle.len();
    (1..count).map(|index| posture(standing, cycles, duration, index)).collect()
}

/// The posture of this index from the standing pose on.
fn posture(standing: &[f64], cycles: &[Entered<'_>], duration: f64, index: usize) -> Posture {
    let mut entered = Posture::resting(standing);
    let mut before = entered.clone();
    for Entered { cycle, strides } in cycles {
        let count = strides * cycle.len();
        let part = (index as f64 / count as f64).min(1.0);
        let grown = 0.5 - 0.5 * (0.5 * TAU * part).cos();
        let growing = 0.25 * TAU * (0.5 * TAU * part).sin() / (count as f64 * duration);
        let now = &cycle[index % cycle.len()];
        for joint in 0..standing.len() {
            let away = now.angles[joint] - before.angles[joint];
            let faster = now.velocities[joint] - before.velocities[joint];
            entered.angles[joint] += grown * away;
            entered.velocities[joint] += grown * faster + growing * away;
        }
        before.clone_from(now);
    }
    entered
}
