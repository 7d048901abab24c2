//! What a gait costs: constraints first, then the limits of natural motion, then how well it goes.

use std::f64::consts::{FRAC_PI_2, TAU};

use gaitwright_physics::motion::MeasureLimit;

use super::figures::RolloutFigures;
use super::gaits::NamedGait;
use super::leg_watch::LegFigures;
use super::legs::Legs;
use super::ring::Wanted;
use crate::gait::limits::{self, GaitLimits};

/// What a gait that holds all constraints costs at most before it is disturbed (see [`cost`]).
pub const HOLDS: f64 = 1000.0;
/// How far inside the limits a gait should stay, as a share of them: what holds for a few strides by a hair does not hold
/// for long.
const MARGIN: f64 = 0.05;
/// Contact of anything but a foot has 0 as its limit, of which there is no share: its excess is this times the share of the time.
const SCUFFED: f64 = 20.0;
/// A turn (rad in a stride) and a drift to the side (share of the way ahead) up to this cost nothing in the search: the way is set
/// straight at its end.
const MENDED: f64 = 0.05;
/// A turn in a stride beyond this breaks the constraint of the heading, rad.
const HEADING: f64 = 0.05;
/// What a disturbance changes of the turn in a stride costs so much a rad, up to the most that counts, rad.
const TURNED: f64 = 3.0;
const MOST_TURNED: f64 = 0.2;

/// Whether and how well a gait does what is wanted of it: less is better. Undisturbed, what breaks a constraint costs at least
/// [`HOLDS`], and more than all that holds them. A fall under a disturbance adds [`HOLDS`] to twice that, of which the mean over all
/// disturbances counts: a gait that falls in one of two costs less than one that breaks a constraint, and one that falls in both about
/// as much.
pub fn cost(
    wanted: &Wanted,
    period: f64,
    legs: &Legs,
    plain: &RolloutFigures,
    disturbed: &[RolloutFigures],
) -> f64 {
    undisturbed(wanted, period, legs, plain) + when_disturbed(plain, disturbed)
}

/// What is known before a gait is disturbed: the least that [`cost`] can be.
pub fn undisturbed(wanted: &Wanted, period: f64, legs: &Legs, figures: &RolloutFigures) -> f64 {
    if wanted.straightened_later {
        let left = |off: f64| (off.abs() - MENDED).max(0.0).copysign(off);
        let mended =
            RolloutFigures { yaw: left(figures.yaw), sideways: left(figures.sideways), ..figures.clone() };
        return undisturbed(&wanted.as_it_goes(), period, legs, &mended);
    }
    let natural =
        effort(wanted, period, legs, figures) + wanted.strictness * beyond(wanted, legs, figures, MARGIN);
    // What holds the constraints costs less than this; both parts keep their slope.
    natural.min(0.9 * HOLDS) + broken(violation(wanted, figures))
}

/// Whether a gait holds all constraints and keeps the limits of natural motion, undisturbed, over the strides of `figures`, as far as
/// the search knows them: not those of tilt, height, phase spread and Froude number, which only a judged motion has to keep.
pub fn within_limits(wanted: &Wanted, legs: &Legs, figures: &RolloutFigures) -> bool {
    violation(wanted, figures) <= 0.0 && beyond(wanted, legs, figures, 0.0) <= 0.0
}

/// How much disturbances take from a gait on average, from 0.
pub fn when_disturbed(plain: &RolloutFigures, disturbed: &[RolloutFigures]) -> f64 {
    let taken = disturbed.iter().map(|disturbed| taken(plain, disturbed));
    taken.sum::<f64>() / disturbed.len().max(1) as f64
}

/// How much one disturbance takes.
fn taken(plain: &RolloutFigures, disturbed: &RolloutFigures) -> f64 {
    let fallen = 1.0 - disturbed.upright;
    let lost = (disturbed.speed / plain.speed.abs().max(1e-6) - 1.0).abs().min(1.0);
    let turned = (disturbed.yaw - plain.yaw).abs().min(MOST_TURNED);
    let unsteady = lost * lost + TURNED * turned + 0.2 * (disturbed.roll + disturbed.pitch).min(1.0) + fallen;
    broken(fallen) + 2.0 * unsteady
}

/// The cost of breaking constraints by so much.
fn broken(violation: f64) -> f64 {
    if violation > 0.0 { HOLDS + HOLDS * violation } else { 0.0 }
}

/// By how much the constraints are broken: upright, speed within a tenth, heading.
fn violation(wanted: &Wanted, figures: &RolloutFigures) -> f64 {
    let off = (figures.speed / wanted.speed - 1.0).abs();
    let sideways = figures.sideways.abs() - limits::DRIFT;
    let yaw = figures.yaw.abs() - HEADING;
    3.0 * (1.0 - figures.upright) + (off - 0.1).max(0.0) + sideways.clamp(0.0, 1.0) + yaw.clamp(0.0, 1.0)
}

/// Sum of what the measures of natural motion are beyond their limits, or nearer to them than `margin`, each as a share of its limit.
fn beyond(wanted: &Wanted, legs: &Legs, figures: &RolloutFigures, margin: f64) -> f64 {
    let excess = |limit, value| excess(limit, value, margin);
    let allowed = GaitLimits::of_gait(wanted.gait.gait);
    let at_most = MeasureLimit::AtMost;
    let mut sum = excess(at_most(allowed.cost_of_transport), figures.cost_of_transport)
        + excess(at_most(1.0), figures.speed_used)
        + excess(at_most(limits::SATURATION), figures.saturated)
        + excess(at_most(limits::DRIFT), figures.sideways.abs())
        + excess(MeasureLimit::at_least(limits::SMOOTHNESS), figures.smoothness);
    if legs.legs.is_empty() {
        return sum;
    }
    sum += excess(at_most(limits::SLIP), figures.slip / wanted.speed)
        + excess(at_most(allowed.heave), figures.heave)
        + excess(at_most(allowed.rotation), figures.pitch)
        + excess(at_most(allowed.rotation), figures.roll);
    // By no more than what is sure to be within the tolerance, or else by half of it.
    let known = (wanted.gait.tolerance - figures.resolution).max(0.5 * wanted.gait.tolerance);
    let apart = phases_apart(&wanted.gait, figures);
    sum += excess(at_most(known), apart.iter().map(|apart| apart.abs()).fold(0.0, f64::max));
    let worst = |limit: MeasureLimit, of: fn(&LegFigures) -> f64| {
        figures.legs.iter().map(|leg| excess(limit, of(leg))).fold(0.0, f64::max)
    };
    if let Some(range) = allowed.duty_factor {
        sum += worst(MeasureLimit::within(range), |leg| leg.duty);
    }
    sum += worst(at_most(limits::PEAK_FORCE), |leg| leg.peak);
    sum += SCUFFED * figures.scuffed / (1.0 + SCUFFED * figures.scuffed);
    // Where pairs of legs push together, long strides and short ones like to alternate. The others find their beat, and would be
    // kept from long strides by what the entry leaves in the first few.
    if !wanted.gait.symmetrical() {
        sum += worst(at_most(limits::PERIOD_SPREAD), |leg| leg.spread);
    }
    sum += worst(MeasureLimit::within(limits::CLEARANCE), |leg| leg.clearance);
    if legs.legs.len() <= limits::UPRIGHT_LEGS {
        let upright = legs.legs.iter().zip(&figures.legs).filter(|(leg, _)| !leg.sprawled);
        let extended = upright.map(|(_, leg)| excess(MeasureLimit::within(limits::EXTENSION), leg.extension));
        sum += extended.fold(0.0, f64::max);
    }
    sum
}

/// How far `value` is beyond a limit, or nearer to it than `margin`, as a share of the limit; far beyond it grows ever
/// less, up to 1.
fn excess(limit: MeasureLimit, value: f64, margin: f64) -> f64 {
    let (least, greatest) = match limit {
        MeasureLimit::AtMost(greatest) => (None, Some(greatest)),
        MeasureLimit::Between([least, greatest]) => (least, greatest),
    };
    let under = least.map_or(0.0, |least| 1.0 + margin - value / least);
    let over = greatest.map_or(0.0, |greatest| value / greatest - 1.0 + margin);
    let excess = under.max(over).max(0.0);
    excess / (1.0 + excess)
}

/// Distance of the legs' phases from those of the gait, parts of a stride; the time from which phases are counted is left
/// open.
fn phases_apart(gait: &NamedGait, figures: &RolloutFigures) -> Vec<f64> {
    let apart = || figures.legs.iter().zip(gait.phases).map(|(leg, wanted)| leg.phase - wanted);
    let (sine, cosine) = apart().fold((0.0, 0.0), |(sine, cosine), apart| {
        let (s, c) = (TAU * apart).sin_cos();
        (sine + s, cosine + c)
    });
    let common = sine.atan2(cosine) / TAU;
    apart().map(|apart| apart - common - (apart - common).round()).collect()
}

/// What speaks against a gait that holds everything, from 0.
fn effort(wanted: &Wanted, period: f64, legs: &Legs, figures: &RolloutFigures) -> f64 {
    let Wanted { speed, weights, .. } = wanted;
    // In 60 √(h / g): for a dog in some ten seconds.
    let yaw = figures.yaw.abs() / period * 60.0 * (legs.hip_height / wanted.gravity).sqrt();
    let off = figures.speed / speed - 1.0;
    let energy =
        7.0 * figures.cost_of_transport + 2.0 * figures.saturated + (figures.speed_used - 0.8).max(0.0);
    20.0 * off * off
        + weights.energy * energy
        + weights.drift * 2.0 * figures.sideways.abs()
        + weights.turn * 0.5 * yaw.min(4.0)
        + weights.smoothness * (0.03 * figures.torque_rate + figures.irregular)
        + if legs.legs.is_empty() { 0.0 } else { steps(wanted, period, legs, figures) }
}

/// What speaks against the way in which the legs step.
fn steps(wanted: &Wanted, period: f64, legs: &Legs, figures: &RolloutFigures) -> f64 {
    let Wanted { gait, speed, weights, .. } = wanted;
    let count = figures.legs.len().max(1) as f64;
    let timing = phases_apart(gait, figures).iter().map(|apart| apart * apart).sum::<f64>() / count;
    let duty = figures.legs.iter().map(|leg| (leg.duty - gait.duty_factor).powi(2)).sum::<f64>() / count;
    // A half-sine of force over the stance has π / (2 β) times its share as peak.
    let usual = FRAC_PI_2 / (gait.duty_factor * count);
    let peak = (figures.peak / usual - 1.3).max(0.0);
    60.0 * timing
        + 30.0 * duty
        + 1.5 * (period / wanted.usual_period(legs.hip_height)).ln().powi(2)
        + weights.slip * 3.0 * figures.slip / speed
        + weights.impact * 1.0 * peak * peak
        + weights.posture * (figures.heave + figures.roll + figures.pitch + 2.0 * figures.scuffed)
}
