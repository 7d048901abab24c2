//! Whether a simulated motion keeps to what is physically possible.

use super::measure::stance_slip;
use gaitwright_physics::motion::{RootAdjustment, Validity};
use gaitwright_physics::playback::Trace;
use gaitwright_physics::scene::ActuatorLimits;

/// Judges `trace`, a continuous simulation of a loop of `period` seconds, from its samples and from the record of its steps.
///
/// `limits` are the ranges of motion (rad or m; `None` is unlimited) and `actuators` what the actuators of the joints can
/// do, in the order of the trace. The trials of [`Validity`] are other
/// simulations and are left empty, and nothing is adjusted here.
pub fn validity(
    trace: &Trace,
    limits: &[Option<[f64; 2]>],
    actuators: &[ActuatorLimits],
    period: f64,
) -> Validity {
    let samples = &trace.samples;

    let violations = samples
        .iter()
        .flat_map(|sample| sample.angles.iter().zip(limits))
        .filter_map(|(angle, limit)| limit.map(|[lower, upper]| (lower - angle).max(angle - upper)));

    let errors: Vec<f64> = samples
        .iter()
        .flat_map(|sample| sample.angles.iter().zip(&sample.targets))
        .map(|(angle, target)| (angle - target).powi(2))
        .collect();

    let upright = upright_seconds(trace);
    let record = &trace.record;
    let depths = samples.iter().flat_map(|sample| &sample.contacts).map(|contact| contact.depth);
    Validity {
        valid: trace.fell_at.is_none() && trace.failure.is_none() && record.unsolved_steps == 0,
        torque_saturation: torque_saturation(trace, actuators),
        greatest_limit_violation: violations.fold(0.0, f64::max),
        greatest_penetration: depths.fold(record.greatest_penetration, f64::max),
        greatest_residual: record.greatest_residual,
        unsolved_steps: record.unsolved_steps,
        divided_steps: record.divided_steps,
        coarse_steps: record.coarse_steps,
        greatest_substeps: record.greatest_substeps,
        foot_slip: stance_slip(trace),
        tracking_error: (errors.iter().sum::<f64>() / errors.len().max(1) as f64).sqrt(),
        upright_cycles: if period > 0.0 { (upright / period + 1e-9).floor() as u32 } else { 0 },
        root_adjustment: RootAdjustment::default(),
        trials: Vec::new(),
    }
}

/// Share of all samples of all joints with a greatest torque at which the actuator gives all that it has at its speed,
/// 0 to 1.
pub(super) fn torque_saturation(trace: &Trace, actuators: &[ActuatorLimits]) -> f64 {
    let (mut saturated, mut bounded) = (0_usize, 0_usize);
    for sample in &trace.samples {
        let driven = sample.torques.iter().zip(&sample.velocities).zip(actuators);
        for ((&torque, &rate), actuator) in driven.filter(|(_, actuator)| actuator.is_bounded()) {
            bounded += 1;
            saturated += usize::from(actuator.gives_all(torque, rate));
        }
    }
    saturated as f64 / bounded.max(1) as f64
}

/// How long the character stayed upright in `trace`, s.
fn upright_seconds(trace: &Trace) -> f64 {
    let (Some(first), Some(last)) = (trace.samples.first(), trace.samples.last()) else { return 0.0 };
    (trace.fell_at.unwrap_or(last.time).min(last.time) - first.time).max(0.0)
}
