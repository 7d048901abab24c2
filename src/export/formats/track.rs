//! Several quantities over time, each a cubic Hermite spline through the same knots.

use gaitwright_physics::motion::{hermite, hermite_rate};

/// The values and rates of all quantities at one time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Knot {
    /// s.
    pub(super) time: f64,
    /// In the units of the quantities.
    pub(super) values: Vec<f64>,
    /// In those units per second.
    pub(super) rates: Vec<f64>,
}

/// Knots in the order of their times, at least one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Track(Vec<Knot>);

impl Track {
    /// Joins knots whose rates are known.
    pub(super) fn new(knots: Vec<Knot>) -> Self {
        debug_assert!(!knots.is_empty(), "a track needs a knot");
        Self(knots)
    }

    /// Joins samples of something that repeats itself: the last one is replaced by the first, each quantity times its
    /// factor in `repeat`, which is 1, or −1 for what comes back with the other sign. The rates are those of the
    /// straight line between the neighbours, so that value and rate are continuous across the seam. There are at least
    /// three samples.
    pub(super) fn closed(mut samples: Vec<(f64, Vec<f64>)>, repeat: &[f64]) -> Self {
        let last = samples.len() - 1;
        let period = samples[last].0 - samples[0].0;
        let again = |(time, values): &(f64, Vec<f64>), sign: f64| {
            let values: Vec<f64> = values.iter().zip(repeat).map(|(value, repeat)| value * repeat).collect();
            (time + sign * period, values)
        };
        samples[last].1 = again(&samples[0], 1.0).1;
        let (before, after) = (again(&samples[last - 1], -1.0), again(&samples[1], 1.0));
        let knot = |index: usize| {
            let before = if index == 0 { &before } else { &samples[index - 1] };
            let after = if index == last { &after } else { &samples[index + 1] };
            let between = after.0 - before.0;
            let rates = after.1.iter().zip(&before.1).map(|(after, before)| (after - before) / between);
            Knot { time: samples[index].0, values: samples[index].1.clone(), rates: rates.collect() }
        };
        Self((0..=last).map(knot).collect())
    }

    /// Joins samples of something that is gone through once, of which there are at least two. The rates are those of the
    /// straight line between the neighbours, at the ends of that to the one neighbour.
    pub(super) fn open(samples: Vec<(f64, Vec<f64>)>) -> Self {
        let last = samples.len() - 1;
        let knot = |index: usize| {
            let (before, after) = (&samples[index.saturating_sub(1)], &samples[(index + 1).min(last)]);
            let between = after.0 - before.0;
            let rates = after.1.iter().zip(&before.1).map(|(after, before)| (after - before) / between);
            Knot { time: samples[index].0, values: samples[index].1.clone(), rates: rates.collect() }
        };
        Self((0..=last).map(knot).collect())
    }

    /// The knot at the start.
    pub(super) fn first(&self) -> &Knot {
        &self.0[0]
    }

    /// From the first knot to the last, s.
    pub(super) fn duration(&self) -> f64 {
        self.0[self.0.len() - 1].time - self.0[0].time
    }

    /// Values and rates `time` seconds after the first knot, which is at least 0; after the last knot those of the
    /// last.
    pub(super) fn at(&self, time: f64) -> Knot {
        let time = self.0[0].time + time;
        let after = self.0.partition_point(|knot| knot.time <= time);
        let (Some(from), Some(to)) = (after.checked_sub(1).map(|before| &self.0[before]), self.0.get(after))
        else {
            return Knot { time, ..self.0[after.saturating_sub(1)].clone() };
        };
        let (duration, since) = (to.time - from.time, time - from.time);
        let ends =
            |index: usize| ((from.values[index], from.rates[index]), (to.values[index], to.rates[index]));
        let value = |index| {
            let (from, to) = ends(index);
            hermite(from, to, duration, since)
        };
        let rate = |index| {
            let (from, to) = ends(index);
            hermite_rate(from, to, duration, since)
        };
        let all = 0..from.values.len();
        Knot { time, values: all.clone().map(value).collect(), rates: all.map(rate).collect() }
    }
}
