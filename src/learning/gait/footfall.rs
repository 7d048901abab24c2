//! When each foot is on the ground: stances and footfalls from contact forces.

use gaitwright_physics::playback::{Sample, Trace};

/// How stances are detected from contact forces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// Normal force above which a foot is in stance, N.
    pub threshold: f64,
    /// Stances and swings shorter than this are ignored as chatter, s.
    pub debounce: f64,
}

impl Detection {
    /// For a character of `weight` newtons with the unit of time √(h / g) seconds of its hip height: a hundredth of its weight,
    /// and a tenth of that time, which is a tenth of the quickest strides.
    pub fn of(weight: f64, unit_time: f64) -> Self {
        Self { threshold: 0.01 * weight, debounce: 0.1 * unit_time }
    }
}

/// When one foot is on the ground, sample by sample, with chatter removed.
#[derive(Debug, Clone, PartialEq)]
pub struct Footing {
    /// Indices of the character's links that are the foot.
    pub links: Vec<usize>,
    /// Whether it is in stance, one entry a sample.
    pub stance: Vec<bool>,
    /// Indices of the samples at which a stance begins after a swing, in order.
    pub touch_downs: Vec<usize>,
}

impl Footing {
    /// The stances on the ground in `trace` of the foot made of `links`; what they touch of obstacles and of the character is no ground.
    ///
    /// First swings shorter than the debounce time become stance, so that a foot that chatters while it lands is down
    /// from its first contact; then stances that are still shorter become swing. A stance or swing at the start or the
    /// end of the trace may be longer than what the trace shows and is kept.
    pub fn detect(trace: &Trace, links: &[usize], detection: Detection) -> Self {
        let mut stance: Vec<bool> =
            trace.samples.iter().map(|sample| load(sample, links) > detection.threshold).collect();
        let shortest = (detection.debounce / interval(trace)).round() as usize;
        remove_short_runs(&mut stance, false, shortest);
        remove_short_runs(&mut stance, true, shortest);
        let touch_downs = (1..stance.len()).filter(|&at| stance[at] && !stance[at - 1]).collect();
        Self { links: links.to_vec(), stance, touch_downs }
    }

    /// First sample of every stance and the one after its last, in order; the first and the last stance may be cut off by
    /// the trace.
    pub(super) fn stances(&self) -> Vec<[usize; 2]> {
        let mut stances = Vec::new();
        let mut start = 0;
        for run in self.stance.chunk_by(|a, b| a == b) {
            if run.first() == Some(&true) {
                stances.push([start, start + run.len()]);
            }
            start += run.len();
        }
        stances
    }
}

/// With how much force the ground carries `links` in a sample, N.
pub(super) fn load(sample: &Sample, links: &[usize]) -> f64 {
    links.iter().filter_map(|&link| sample.loads.get(link)).sum()
}

/// Time between two samples, s; infinite where there are fewer than two.
pub(super) fn interval(trace: &Trace) -> f64 {
    match trace.samples.as_slice() {
        [first, .., last] => (last.time - first.time) / (trace.samples.len() - 1) as f64,
        _ => f64::INFINITY,
    }
}

/// Inverts every run of `value` that is shorter than `shortest` and has a neighbour on both sides.
fn remove_short_runs(samples: &mut [bool], value: bool, shortest: usize) {
    let mut start = 0;
    while start < samples.len() {
        let length = samples[start..].iter().take_while(|&&sample| sample == samples[start]).count();
        let end = start + length;
        if samples[start] == value && length < shortest && start > 0 && end < samples.len() {
            samples[start..end].fill(!value);
        }
        start = end;
    }
}
