//! Steps that are no gait, however well their phases fit one.

use super::name::Classified;
use super::report::UnnamedBecause;
use super::stride::{Strides, mean};

/// Greatest spread of the stride period, as a share of it, and of a phase, as a share of the stride: a leg that strays by
/// more than the greatest tolerance of a name has that name in one stride and not in the next.
const IRREGULAR: f64 = 1.0 / 16.0;
/// Greatest share of the strides that may be odd ones, left out of the means.
const ODD: f64 = 0.1;
/// Shortest stride, in √(h / g) with the hip height h. The quickest animals (gallops of dogs and cheetahs, mice) take
/// some 1 to 2 of it for a stride; half of that is a vibration.
const QUICKEST: f64 = 0.5;
/// Least height to which a foot is lifted, share of the hip height: a fifth of the least natural clearance.
const LIFTED: f64 = 0.01;
/// Greatest duty factor of a step: the slowest wave of six legs has 5/6, and a sixteenth more is no wave any more.
const SHUFFLED: f64 = 0.9;
/// Least duty factor of a leg over the mean of all: sound legs stand for much the same time, and one that stands for less
/// than half of it limps.
const LIMPING: f64 = 0.5;

/// Why the steps have no name; `None` where they have. `clearances` (m; `None` for a foot without swings) as
/// [`clearance`](super::foot::clearance) gives them, `hip_height` in m, `gravity` in m/s².
pub(super) fn unnamed(
    strides: &Strides,
    clearances: &[Option<f64>],
    (hip_height, gravity): (Option<f64>, f64),
    named: Option<&Classified>,
) -> Option<UnnamedBecause> {
    let Some(named) = named else { return Some(UnnamedBecause::NoSteps) };
    let (Some(period), Some(spread)) = (strides.period, strides.usual_spread) else {
        return Some(UnnamedBecause::TooFewStrides);
    };
    let size = hip_height.unwrap_or(0.0);
    let unit_time = if gravity > 0.0 { (size / gravity).sqrt() } else { 0.0 };
    let low = clearances.iter().any(|height| height.is_none_or(|height| height < LIFTED * size));
    let average = mean(&strides.duties).unwrap_or(0.0);
    if spread.period > IRREGULAR || spread.phase > IRREGULAR || strides.odd > ODD {
        Some(UnnamedBecause::Irregular)
    } else if period < QUICKEST * unit_time || low {
        Some(UnnamedBecause::Vibrating)
    } else if strides.duties.iter().any(|&duty| duty > SHUFFLED) {
        Some(UnnamedBecause::Shuffling)
    } else if strides.duties.iter().any(|&duty| duty < LIMPING * average) {
        Some(UnnamedBecause::Limping)
    } else {
        (named.greatest_distance > named.tolerance).then_some(UnnamedBecause::Phases)
    }
}
