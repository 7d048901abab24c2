//! The gait report of a simulated loop.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Vector3};

use super::footfall::{Detection, Footing};
use super::legs::{self, Leg, Side};
use super::name::{apart, classify};
use super::report::{Foot, GaitFormat, GaitReport, Pair, Regime, Spread};
use gaitwright_physics::character::Character;
use gaitwright_physics::playback::Trace;

/// Strides whose period differs from the median by more than this share of it are left out: the foot stumbled, or a
/// touch-down was missed.
const ODD_STRIDE: f64 = 0.3;

/// What a gait is measured with, beside its trace.
#[derive(Debug, Clone, Copy)]
pub struct GaitContext<'a> {
    /// The character that moved.
    pub character: &'a Character,
    /// Indices of the links that carry it.
    pub support: &'a [usize],
    /// World frames of all links in the standing pose, m.
    pub standing: &'a [Isometry3<f64>],
    /// Height of the ground, m.
    pub ground: f64,
    /// Total mass, kg.
    pub mass: f64,
    /// Magnitude of the gravitational acceleration, m/s².
    pub gravity: f64,
    /// The task's direction of travel in the world frame, of any length; z is ignored.
    pub direction: [f64; 3],
}

/// Measures the gait in `trace`, which should consist of at least ten cycles of a looping motion. A trace without steps
/// gives a report without phases.
pub fn measure(trace: &Trace, setting: &GaitContext<'_>) -> GaitReport {
    let detection = Detection::for_weight(setting.mass * setting.gravity);
    let legs = legs::place(setting.character, setting.support, setting.standing);
    let footings: Vec<Footing> =
        legs.iter().map(|&(link, _)| Footing::detect(trace, link, detection)).collect();
    let times: Vec<f64> = trace.samples.iter().map(|sample| sample.time).collect();
    let steps: Vec<Vec<f64>> =
        footings.iter().map(|footing| footing.touch_downs.iter().map(|&at| times[at]).collect()).collect();

    let periods = stride_periods(&steps);
    let stride_period = mean(&periods);
    let phases: Vec<Option<Phase>> = match steps.iter().find(|steps| steps.len() >= 2) {
        Some(reference) => steps.iter().map(|steps| phase(steps, reference)).collect(),
        None => vec![None; steps.len()],
    };
    let duties: Vec<f64> = footings.iter().map(duty_factor).collect();
    let duty = mean(&duties);

    let feet: Vec<Foot> = legs
        .iter()
        .enumerate()
        .map(|(index, &(link, leg))| Foot {
            link: link_name(setting.character, link),
            leg: leg.map(|leg| leg.to_string()),
            duty_factor: duties[index],
            phase: phases[index].map(|phase| phase.mean),
            strides: steps[index].len().saturating_sub(1) as u32,
            stances: stances(&footings[index], &times),
        })
        .collect();
    let placed: Option<Vec<(Leg, f64)>> =
        legs.iter().zip(&phases).map(|(&(_, leg), phase)| Some((leg?, phase.as_ref()?.mean))).collect();
    let named = placed.as_ref().and_then(|feet| classify(feet, duty.unwrap_or(1.0)));
    let has_names = !super::name::templates(legs.len()).is_empty();

    let travel = Travel::of(trace, setting.direction);
    let hip_height = legs::hip_height(setting.character, setting.support, setting.standing, setting.ground);
    let froude = hip_height
        .filter(|&height| height * setting.gravity > 0.0)
        .map(|height| travel.horizontal_speed.powi(2) / (setting.gravity * height));
    let cost = |work: f64| {
        let least = 0.1 * hip_height.unwrap_or(0.1);
        let resistance = setting.mass * setting.gravity * travel.distance;
        (travel.distance > least && resistance > 0.0).then(|| work / resistance)
    };
    GaitReport {
        format: GaitFormat::V1,
        gait: named
            .map(|named| named.name.to_owned())
            .or_else(|| has_names.then(|| "unclassified".to_owned())),
        distance: named.map(|named| named.distance),
        regime: duty
            .filter(|_| stride_period.is_some())
            .map(|duty| if duty >= 0.5 { Regime::Walk } else { Regime::Run }),
        stride_period,
        strides: feet.iter().filter(|foot| foot.phase.is_some()).map(|foot| foot.strides).min().unwrap_or(0),
        pairs: pairs(setting.character, &legs, &phases),
        aerial_fraction: aerial_fraction(&footings, times.len()),
        spread: spread(&periods, &phases),
        speed: travel.speed,
        sideways_speed: travel.sideways_speed,
        froude,
        cost_of_transport: cost(trace.joint_work),
        positive_cost_of_transport: cost(trace.positive_work),
        stance_slip: stance_slip(trace),
        hip_height,
        fell_at: trace.fell_at,
        span: [times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0)],
        feet,
    }
}

/// When a foot touches down within the reference foot's strides.
#[derive(Debug, Clone, Copy)]
struct Phase {
    /// Circular mean, share of a stride, 0 up to 1.
    mean: f64,
    /// Circular standard deviation, share of a stride.
    deviation: f64,
}

/// The phase of touch-downs at `steps` (s) within the strides between those at `reference` (s); averaged as unit
/// vectors (Batschelet 1981, *Circular Statistics in Biology*), since phases just below 1 and just above 0 are
/// neighbours. `None` where no touch-down falls into a stride of the reference foot.
fn phase(steps: &[f64], reference: &[f64]) -> Option<Phase> {
    let angles: Vec<f64> = steps
        .iter()
        .filter_map(|&step| {
            let after = reference.partition_point(|&touch_down| touch_down <= step);
            let (from, to) = (reference.get(after.checked_sub(1)?)?, reference.get(after)?);
            Some(TAU * (step - from) / (to - from))
        })
        .collect();
    if angles.is_empty() {
        return None;
    }
    let count = angles.len() as f64;
    let (sine, cosine) = angles
        .iter()
        .fold((0.0, 0.0), |(sine, cosine), angle| (sine + angle.sin() / count, cosine + angle.cos() / count));
    let length = sine.hypot(cosine).clamp(f64::MIN_POSITIVE, 1.0);
    let fraction = (sine.atan2(cosine) / TAU).rem_euclid(1.0);
    // Just below 1 by rounding alone is 0.
    let mean = if 1.0 - fraction < 1e-9 { 0.0 } else { fraction };
    Some(Phase { mean, deviation: (-2.0 * length.ln()).sqrt() / TAU })
}

/// Periods of all strides of all feet, s, ascending, without those that [`ODD_STRIDE`] leaves out.
fn stride_periods(steps: &[Vec<f64>]) -> Vec<f64> {
    let mut periods: Vec<f64> =
        steps.iter().flat_map(|steps| steps.windows(2).map(|pair| pair[1] - pair[0])).collect();
    periods.sort_by(f64::total_cmp);
    let Some(&median) = periods.get(periods.len() / 2) else { return periods };
    periods.retain(|period| (period - median).abs() <= ODD_STRIDE * median);
    periods
}

/// Share of the time in stance over all whole strides, 0 to 1; over all samples where there is no stride.
fn duty_factor(footing: &Footing) -> f64 {
    let whole = match footing.touch_downs.as_slice() {
        [first, .., last] => &footing.stance[*first..*last],
        _ => &footing.stance[..],
    };
    whole.iter().filter(|&&stands| stands).count() as f64 / whole.len().max(1) as f64
}

/// Beginning and end of every stance, s.
fn stances(footing: &Footing, times: &[f64]) -> Vec<[f64; 2]> {
    let mut stances = Vec::new();
    let mut start = None;
    for (&time, &stands) in times.iter().zip(&footing.stance) {
        match (start, stands) {
            (None, true) => start = Some(time),
            (Some(from), false) => {
                stances.push([from, time]);
                start = None;
            }
            _ => {}
        }
    }
    if let (Some(from), Some(&end)) = (start, times.last()) {
        stances.push([from, end]);
    }
    stances
}

/// Share of the samples in which no foot is in stance, 0 to 1.
fn aerial_fraction(footings: &[Footing], samples: usize) -> f64 {
    let aerial = (0..samples).filter(|&at| footings.iter().all(|footing| !footing.stance[at])).count();
    aerial as f64 / samples.max(1) as f64
}

/// The left and right legs of each row that both step.
fn pairs(character: &Character, legs: &[(usize, Option<Leg>)], phases: &[Option<Phase>]) -> Vec<Pair> {
    let find = |side: Side, row: usize| {
        let index =
            legs.iter().position(|(_, leg)| leg.is_some_and(|leg| leg.side == side && leg.row == row))?;
        Some((link_name(character, legs[index].0), phases[index]?.mean))
    };
    (0..legs.len() / 2)
        .filter_map(|row| {
            let ((left, of_left), (right, of_right)) = (find(Side::Left, row)?, find(Side::Right, row)?);
            Some(Pair { left, right, asymmetry: apart(of_left - of_right - 0.5) })
        })
        .collect()
}

/// How much strides differ; `None` with fewer than two strides.
fn spread(periods: &[f64], phases: &[Option<Phase>]) -> Option<Spread> {
    let mean = mean(periods).filter(|_| periods.len() >= 2)?;
    let variance = periods.iter().map(|period| (period - mean).powi(2)).sum::<f64>() / periods.len() as f64;
    let phase = phases.iter().flatten().map(|phase| phase.deviation).fold(0.0, f64::max);
    Some(Spread { period: variance.sqrt() / mean, phase })
}

/// Mean tangential speed of the contacts, weighted by their normal force, m/s.
pub(super) fn stance_slip(trace: &Trace) -> f64 {
    let (mut slip, mut load) = (0.0, 0.0);
    for contact in trace.samples.iter().flat_map(|sample| &sample.contacts) {
        let force = contact.force.dot(&contact.normal).max(0.0);
        let along = contact.velocity - contact.normal * contact.velocity.dot(&contact.normal);
        slip += force * along.norm();
        load += force;
    }
    if load > 0.0 { slip / load } else { 0.0 }
}

/// Travel of the centre of mass over a trace.
struct Travel {
    /// Horizontal distance from the first sample to the last, m.
    distance: f64,
    /// Mean horizontal speed, m/s.
    horizontal_speed: f64,
    /// Mean speed along the task's direction, m/s.
    speed: f64,
    /// Mean speed to the left of it, m/s.
    sideways_speed: f64,
}

impl Travel {
    fn of(trace: &Trace, direction: [f64; 3]) -> Self {
        let (mut way, mut duration) = (Vector3::zeros(), 0.0);
        if let (Some(first), Some(last)) = (trace.samples.first(), trace.samples.last()) {
            way = last.center_of_mass - first.center_of_mass;
            duration = last.time - first.time;
        }
        way.z = 0.0;
        let rate = if duration > 0.0 { way / duration } else { Vector3::zeros() };
        let forward =
            Vector3::new(direction[0], direction[1], 0.0).try_normalize(0.0).unwrap_or_else(Vector3::x);
        let left = Vector3::z().cross(&forward);
        Self {
            distance: way.norm(),
            horizontal_speed: rate.norm(),
            speed: rate.dot(&forward),
            sideways_speed: rate.dot(&left),
        }
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn link_name(character: &Character, link: usize) -> String {
    character.links.get(link).map_or_else(String::new, |link| link.name.clone())
}
