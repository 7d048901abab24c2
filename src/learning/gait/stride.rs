//! When feet step: stride periods, phases, duty factors, and how regular they are.

use std::f64::consts::TAU;

use super::footfall::Footing;
use super::report::Spread;

/// Strides whose period differs from the median by more than this share of it are odd: the foot stumbled, or a touch-down was missed.
/// A gait is named without them, by means over the others; how regular it is counts every stride.
const ODD_STRIDE: f64 = 0.3;
/// A touch-down farther than this share of a stride from the mean phase of its foot belongs to a stumble, too.
const ODD_STEP: f64 = 0.5 * ODD_STRIDE;

/// When a foot touches down within the reference foot's strides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Phase {
    /// Circular mean, share of a stride, 0 up to 1.
    pub(super) mean: f64,
    /// Circular standard deviation of all touch-downs, share of a stride.
    deviation: f64,
    /// The same of those that [`ODD_STEP`] leaves.
    usual_deviation: f64,
    /// Number of touch-downs, and of those that [`ODD_STEP`] leaves out.
    steps: [usize; 2],
}

/// The strides of all feet.
#[derive(Debug, Clone)]
pub(super) struct Strides {
    /// Mean time from a touch-down to the next of the same foot, s; `None` without strides.
    pub(super) period: Option<f64>,
    /// Phase of each foot after the first that steps; `None` for one that never does within its strides.
    pub(super) phases: Vec<Option<Phase>>,
    /// Share of the time in stance of each foot over its whole strides.
    pub(super) duties: Vec<f64>,
    /// How much all strides differ, stumbles as well; `None` with fewer than two.
    pub(super) spread: Option<Spread>,
    /// The same without odd ones.
    pub(super) usual_spread: Option<Spread>,
    /// Share of the strides, or of the touch-downs if that is more, that are odd and left out, 0 to 1.
    pub(super) odd: f64,
}

impl Strides {
    /// Of feet with these stances, sampled at `times` (s).
    pub(super) fn of(footings: &[Footing], times: &[f64]) -> Self {
        let steps: Vec<Vec<f64>> = footings
            .iter()
            .map(|footing| footing.touch_downs.iter().map(|&at| times[at]).collect())
            .collect();
        let all = periods(&steps);
        let periods = usual(&all);
        let phases = match steps.iter().find(|steps| steps.len() >= 2) {
            Some(reference) => steps.iter().map(|steps| phase(steps, reference)).collect(),
            None => vec![None; steps.len()],
        };
        let [steps, odd] = phases
            .iter()
            .flatten()
            .fold([0, 0], |sum, phase| [sum[0] + phase.steps[0], sum[1] + phase.steps[1]]);
        let odd_steps = odd as f64 / steps.max(1) as f64;
        Self {
            period: mean(&periods),
            duties: footings.iter().map(duty_factor).collect(),
            spread: spread(&all, &phases, |phase| phase.deviation),
            usual_spread: spread(&periods, &phases, |phase| phase.usual_deviation),
            odd: if all.is_empty() {
                0.0
            } else {
                (1.0 - periods.len() as f64 / all.len() as f64).max(odd_steps)
            },
            phases,
        }
    }
}

/// The phase of touch-downs at `steps` (s) within the strides between those at `reference` (s), without those far from all
/// others. `None` where no touch-down falls into a stride of the reference foot.
fn phase(steps: &[f64], reference: &[f64]) -> Option<Phase> {
    let shares: Vec<f64> = steps
        .iter()
        .filter_map(|&step| {
            let after = reference.partition_point(|&touch_down| touch_down <= step);
            let (from, to) = (reference.get(after.checked_sub(1)?)?, reference.get(after)?);
            Some((step - from) / (to - from))
        })
        .collect();
    let (rough, deviation) = circular_mean(&shares)?;
    let usual: Vec<f64> = shares.iter().copied().filter(|share| apart(share - rough) <= ODD_STEP).collect();
    let (mean, usual_deviation) = circular_mean(&usual).or_else(|| circular_mean(&shares))?;
    let steps = [shares.len(), shares.len() - usual.len()];
    Some(Phase { mean, deviation, usual_deviation, steps })
}

/// Mean and standard deviation of shares of a stride, averaged as unit vectors (Batschelet 1981, *Circular Statistics in
/// Biology*), since phases just below 1 and just above 0 are neighbours; `None` of none.
fn circular_mean(shares: &[f64]) -> Option<(f64, f64)> {
    let count = shares.len() as f64;
    let (sine, cosine) = shares.iter().fold((0.0, 0.0), |(sine, cosine), share| {
        let angle = TAU * share;
        (sine + angle.sin() / count, cosine + angle.cos() / count)
    });
    let length = sine.hypot(cosine).clamp(f64::MIN_POSITIVE, 1.0);
    let fraction = (sine.atan2(cosine) / TAU).rem_euclid(1.0);
    // Just below 1 by rounding alone is 0.
    let mean = if 1.0 - fraction < 1e-9 { 0.0 } else { fraction };
    (!shares.is_empty()).then_some((mean, (-2.0 * length.ln()).sqrt() / TAU))
}

/// Distance of a phase from 0 on the circle, share of a stride, 0 to ½.
pub(super) fn apart(phase: f64) -> f64 {
    (phase - phase.round()).abs()
}

/// Periods of all strides of all feet, s, ascending.
fn periods(steps: &[Vec<f64>]) -> Vec<f64> {
    let mut periods: Vec<f64> =
        steps.iter().flat_map(|steps| steps.windows(2).map(|pair| pair[1] - pair[0])).collect();
    periods.sort_by(f64::total_cmp);
    periods
}

/// Those of `periods` (ascending) that [`ODD_STRIDE`] leaves.
fn usual(periods: &[f64]) -> Vec<f64> {
    let Some(&median) = periods.get(periods.len() / 2) else { return Vec::new() };
    periods.iter().copied().filter(|period| (period - median).abs() <= ODD_STRIDE * median).collect()
}

/// Share of the time in stance over all whole strides, 0 to 1; over all samples where there is no stride.
fn duty_factor(footing: &Footing) -> f64 {
    let whole = match footing.touch_downs.as_slice() {
        [first, .., last] => &footing.stance[*first..*last],
        _ => &footing.stance[..],
    };
    whole.iter().filter(|&&stands| stands).count() as f64 / whole.len().max(1) as f64
}

/// How much strides differ in their `periods` and in what `deviation` gives of their phases; `None` with fewer than two strides.
fn spread(periods: &[f64], phases: &[Option<Phase>], deviation: fn(&Phase) -> f64) -> Option<Spread> {
    let mean = mean(periods).filter(|_| periods.len() >= 2)?;
    let variance = periods.iter().map(|period| (period - mean).powi(2)).sum::<f64>() / periods.len() as f64;
    let phase = phases.iter().flatten().map(deviation).fold(0.0, f64::max);
    Some(Spread { period: variance.sqrt() / mean, phase })
}

/// Mean of `values`; `None` of none.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
