//! Whether a motion is natural: measures of a continuous simulation beside limits that animals keep to.
//!
//! Limits are ours unless a source is named. What a measure means and which motions have it stands in the guide (*judging*).

use std::collections::BTreeMap;

use super::foot_force::peak_forces;
use super::footfall::Footing;
use super::harmonics::{HarmonicFit, harmonics};
use super::limb::Limb;
use super::limits::{self, GaitLimits};
use super::measure::GaitContext;
use super::name::UNCLASSIFIED;
use super::report::GaitReport;
use super::trunk::TrunkMotion;
use super::validity::torque_saturation;
use gaitwright_physics::model::DofKind;
use gaitwright_physics::motion::{MeasureLimit, NaturalnessMeasure};
use gaitwright_physics::playback::Trace;
use gaitwright_physics::scene::ActuatorLimits;
use gaitwright_physics::stance;

/// What a motion is judged with, beside its trace and its gait.
#[derive(Debug, Clone, Copy)]
pub struct NaturalnessContext<'a> {
    /// What its gait was measured with.
    pub gait: GaitContext<'a>,
    /// What the actuators can do, in the order of the trace's joints.
    pub actuators: &'a [ActuatorLimits],
    /// Speed that was asked for, m/s; `None` where any will do.
    pub speed: Option<f64>,
    /// Gait that was asked for; `None` where any will do.
    pub asked: Option<&'a str>,
    /// Time of one round of the loop, s.
    pub period: f64,
}

/// The least speed along the direction, m/s, at which a character whose hips (or root) are `height` metres above the ground
/// travels at all: a Froude number of 10⁻⁴. At that speed a dog takes some 45 s for a metre.
pub fn least_travel(height: f64, gravity: f64) -> f64 {
    limits::TRAVEL * (gravity * height.max(0.0)).sqrt()
}

/// Whether the motion whose gait is `report` goes along the task's direction at all: faster than [`least_travel`] for the hip
/// height, or for the height of the root where there are no legs.
pub fn travels(report: &GaitReport, setting: &GaitContext<'_>) -> bool {
    report.speed > least_travel(setting.size(), setting.gravity)
}

/// Judges the motion in `trace`, whose gait is `report`, and writes the measures and the verdict into it. A trace of fewer
/// than two samples is not judged and not natural.
pub fn judge(trace: &Trace, report: &mut GaitReport, context: &NaturalnessContext<'_>) {
    let measures =
        if trace.samples.len() < 2 { Measures::default() } else { measures(trace, report, context) };
    report.natural = !measures.0.is_empty() && measures.0.values().all(|measure| measure.holds);
    report.naturalness = measures.0;
}

/// Measures by name.
#[derive(Debug, Default)]
struct Measures(BTreeMap<String, NaturalnessMeasure>);

impl Measures {
    /// The one of `values` that is farthest beyond the limit, or nearest to it; nothing where there are none.
    fn worst(&mut self, name: &str, limit: MeasureLimit, values: impl IntoIterator<Item = f64>) {
        let worst = values.into_iter().max_by(|a, b| limit.excess(*a).total_cmp(&limit.excess(*b)));
        if let Some(value) = worst {
            self.0.insert(name.to_owned(), limit.judge(value));
        }
    }

    fn one(&mut self, name: &str, limit: MeasureLimit, value: f64) {
        self.worst(name, limit, [value]);
    }
}

fn measures(trace: &Trace, report: &GaitReport, context: &NaturalnessContext<'_>) -> Measures {
    let gait = &context.gait;
    let mut found = Measures::default();
    let footed = gait.has_feet();
    let allowed = GaitLimits::of(report, footed);
    let stride = stride(report.stride_period.filter(|_| footed), context.period);

    let ended = trace.fell_at.is_some() || trace.failure.is_some();
    found.one("upright", MeasureLimit::at_least(1.0), f64::from(u8::from(!ended)));
    whole_character(&mut found, report, context, &allowed);
    trunk(&mut found, trace, report, context, (footed, &allowed, stride));
    if footed {
        feet(&mut found, trace, report, context, &allowed);
    } else {
        let cycles = report.span[1] - report.span[0];
        found.one("strides", MeasureLimit::at_least(limits::STRIDES), cycles / context.period);
        let spread = cycle_spread(trace, gait.direction, context.period);
        found.worst("travel_spread", MeasureLimit::AtMost(limits::PERIOD_SPREAD), spread);
    }
    let longest_stance = report.feet.iter().map(|foot| foot.duty_factor).fold(0.0, f64::max);
    joints(&mut found, trace, context, (stride, harmonics(longest_stance)));
    found
}

/// Time of the fundamental by which smoothness is judged, s: the share of the loop that is nearest to the stride, which is
/// exact where footfalls are only sampled; the stride itself where the gait does not repeat with the loop.
fn stride(stride: Option<f64>, period: f64) -> f64 {
    let Some(stride) = stride.filter(|stride| *stride > 0.0) else { return period };
    let share = period / (period / stride).round().max(1.0);
    if (share / stride - 1.0).abs() < 0.1 { share } else { stride }
}

/// Name, way, speed, heading and energy.
fn whole_character(
    found: &mut Measures,
    report: &GaitReport,
    context: &NaturalnessContext<'_>,
    allowed: &GaitLimits,
) {
    let gait = &context.gait;
    if let Some(name) = &report.gait {
        let named = f64::from(u8::from(name != UNCLASSIFIED));
        found.one("named", MeasureLimit::at_least(1.0), named);
        if let Some(asked) = context.asked {
            found.one("asked_gait", MeasureLimit::at_least(1.0), f64::from(u8::from(name == asked)));
        }
    }
    let least = least_travel(gait.size(), gait.gravity);
    if least > 0.0 {
        let froude_speed = limits::TRAVEL * report.speed / least;
        found.one("travel", MeasureLimit::at_least(limits::TRAVEL), froude_speed);
    }
    if let Some(asked) = context.speed.filter(|asked| *asked > 0.0) {
        found.one("speed", MeasureLimit::within(limits::SPEED), report.speed / asked);
    }
    // What is related to the way means nothing without one; then `travel` fails.
    if travels(report, gait) {
        let drift = report.sideways_speed.abs() / report.speed;
        found.one("drift", MeasureLimit::AtMost(limits::DRIFT), drift);
        let cost = MeasureLimit::AtMost(allowed.cost_of_transport);
        found.worst("cost_of_transport", cost, report.cost_of_transport);
    }
    if let Some(range) = allowed.froude {
        found.worst("froude", MeasureLimit::Between(range), report.froude);
    }
}

/// Tilt, height, pitch, roll and heave.
fn trunk(
    found: &mut Measures,
    trace: &Trace,
    report: &GaitReport,
    context: &NaturalnessContext<'_>,
    (footed, allowed, stride): (bool, &GaitLimits, f64),
) {
    let gait = &context.gait;
    let Some(standing) = gait.standing.first() else { return };
    let moved = TrunkMotion::of(trace, (standing, gait.ground), gait.direction, gait.model, stride);
    found.one("tilt", MeasureLimit::AtMost(limits::TILT), moved.tilt);
    if !footed {
        return;
    }
    found.one("height", MeasureLimit::at_least(limits::HEIGHT), moved.least_height);
    found.one("pitch", MeasureLimit::AtMost(allowed.rotation), moved.pitch);
    found.one("roll", MeasureLimit::AtMost(allowed.rotation), moved.roll);
    if let Some(height) = report.hip_height.filter(|height| *height > 0.0) {
        found.one("heave", MeasureLimit::AtMost(allowed.heave), moved.heave / height);
    }
}

/// Regularity, symmetry, duty, force, slip, clearance and extension of the legs.
fn feet(
    found: &mut Measures,
    trace: &Trace,
    report: &GaitReport,
    context: &NaturalnessContext<'_>,
    allowed: &GaitLimits,
) {
    let gait = &context.gait;
    found.one("strides", MeasureLimit::at_least(limits::STRIDES), f64::from(report.strides));
    if let Some(spread) = report.spread {
        found.one("period_spread", MeasureLimit::AtMost(limits::PERIOD_SPREAD), spread.period);
        found.one("phase_spread", MeasureLimit::AtMost(limits::PHASE_SPREAD), spread.phase);
    }
    if allowed.symmetrical {
        let asymmetries = report.pairs.iter().map(|pair| pair.asymmetry);
        found.worst("symmetry", MeasureLimit::AtMost(limits::ASYMMETRY), asymmetries);
    }
    if let Some(range) = allowed.duty_factor {
        let duties = report.feet.iter().map(|foot| foot.duty_factor);
        found.worst("duty_factor", MeasureLimit::within(range), duties);
    }
    found.one("scuffing", MeasureLimit::AtMost(limits::SCUFFING), report.scuffing);
    let detection = gait.detection();
    let footings: Vec<Footing> = stance::feet(gait.model, gait.support)
        .iter()
        .map(|links| Footing::detect(trace, links, detection))
        .collect();
    if let Some(height) = report.hip_height.filter(|height| *height > 0.0) {
        let clearances = report.feet.iter().filter_map(|foot| foot.clearance);
        found.worst(
            "clearance",
            MeasureLimit::within(limits::CLEARANCE),
            clearances.map(|lift| lift / height),
        );
        let unit_time = (height / gait.gravity.max(f64::MIN_POSITIVE)).sqrt();
        let peaks = peak_forces(trace, &footings, unit_time);
        found.worst("peak_force", MeasureLimit::AtMost(limits::PEAK_FORCE), peaks);
    }
    if travels(report, gait) {
        found.one("slip", MeasureLimit::AtMost(limits::SLIP), report.stance_slip / report.speed);
    }
    if report.feet.len() <= limits::UPRIGHT_LEGS {
        let extensions = footings.iter().filter_map(|footing| {
            let limb = Limb::of(gait.model, footing.links[0], gait.standing)?;
            if limb.sprawled { None } else { limb.extension(trace, footing) }
        });
        found.worst("extension", MeasureLimit::within(limits::EXTENSION), extensions);
    }
}

/// Torque, speed and smoothness of the joints.
fn joints(
    found: &mut Measures,
    trace: &Trace,
    context: &NaturalnessContext<'_>,
    (stride, harmonics): (f64, usize),
) {
    let NaturalnessContext { gait: GaitContext { model, .. }, actuators, .. } = context;
    if actuators.iter().any(|actuator| actuator.torque.is_finite()) {
        let share = torque_saturation(trace, actuators);
        found.one("torque_saturation", MeasureLimit::AtMost(limits::SATURATION), share);
    }
    let speeds = trace.samples.iter().flat_map(|sample| sample.velocities.iter().zip(&model.speed));
    let used =
        speeds.filter_map(|(rate, limit)| limit.filter(|it| *it > 0.0).map(|limit| rate.abs() / limit));
    found.worst("joint_speed", MeasureLimit::AtMost(1.0), used);
    if stride > 0.0 {
        let slides: Vec<bool> =
            model.bodies.iter().skip(1).map(|body| body.dof == DofKind::Prismatic).collect();
        let mut fit = HarmonicFit::new(slides.len(), harmonics);
        for sample in trace.samples.iter().filter(|sample| sample.angles.len() == slides.len()) {
            fit.add(sample.time / stride, &sample.angles);
        }
        let shares = fit.shares(harmonics, &slides);
        found.worst("smoothness", MeasureLimit::at_least(limits::SMOOTHNESS), shares);
    }
}

/// Standard deviation over the mean of the way along `direction` in one round of the loop of `period` seconds; `None`
/// without two rounds or without a way.
fn cycle_spread(trace: &Trace, direction: [f64; 3], period: f64) -> Option<f64> {
    let count = (period / super::footfall::interval(trace)).round() as usize;
    let along = |at: usize| {
        let center = trace.samples[at].center_of_mass;
        center.x * direction[0] + center.y * direction[1]
    };
    let marks: Vec<usize> = (0..trace.samples.len()).step_by(count.max(1)).collect();
    let ways: Vec<f64> = marks.windows(2).map(|pair| along(pair[1]) - along(pair[0])).collect();
    let mean = super::stride::mean(&ways).filter(|mean| ways.len() >= 2 && *mean > 0.0)?;
    let variance = ways.iter().map(|way| (way - mean).powi(2)).sum::<f64>() / ways.len() as f64;
    Some(variance.sqrt() / mean)
}
