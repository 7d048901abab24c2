//! Positions after the step, and the momentum of a flight.

use super::ReducedCoordinates;
use crate::sim::integrate::advance;
use crate::sim::momentum::Momentum;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_data::StepData;

impl ReducedCoordinates {
    /// Moves the positions, and gives the state the momentum that a step in flight ends with.
    pub(super) fn move_positions(&mut self, data: &mut StepData<'_>) {
        let momentum = self.momentum_of_flight(data);
        let StepData { model, state, work, step, midpoint, .. } = data;
        let root = if model.fixed_base { SpatialMotion::ZERO } else { work.recovery.bodies[0] };
        advance(state, root, &work.recovery.rates, if *midpoint { 0.5 * *step } else { *step });
        if let Some(momentum) = momentum {
            // A step of Moreau and Jean's begins elsewhere.
            self.flight.end(model, state, momentum, !*midpoint);
        }
    }

    /// The momentum that a step in flight ends with; `None` where momentum is not kept.
    fn momentum_of_flight(&mut self, data: &StepData<'_>) -> Option<Momentum> {
        let StepData { model, plan, work, step, midpoint, .. } = data;
        // Under error control a symmetric step must stay symmetric: its trials are corrected instead (step_within).
        let by_trial = *midpoint && plan.accuracy.step_tolerance.is_some();
        if by_trial || !RootFreedom::keeps_momentum(model, plan) || !work.is_in_flight(plan) {
            return None;
        }
        let momentum = self.flight.momentum(model);
        Some(momentum.after_flight(model.mass, plan.gravity, *step))
    }
}
