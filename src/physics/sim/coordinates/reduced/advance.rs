//! Positions after the step, and the momentum of a flight.

use super::ReducedCoordinates;
use crate::sim::energy::kinetic_energy_at;
use crate::sim::integrate::advance;
use crate::sim::momentum::Momentum;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_data::StepData;
use crate::sim::workspace::Placement;

impl ReducedCoordinates {
    /// Moves the positions, and gives the state the momentum that a step in flight ends with.
    pub(super) fn move_positions(&mut self, data: &mut StepData<'_>) {
        let momentum = self.momentum_of_flight(data);
        self.energy = momentum.and_then(|_| self.energy_of_whirl(data));
        let StepData { model, state, work, step, midpoint, .. } = data;
        let root = if model.fixed_base { SpatialMotion::ZERO } else { work.moving().bodies.at(0) };
        advance(state, root, &work.moving().rates, if *midpoint { 0.5 * *step } else { *step });
        if let Some(momentum) = momentum {
            // A step of Moreau and Jean's begins elsewhere.
            self.flight.end(model, state, momentum, self.energy, !*midpoint);
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

    /// The kinetic energy against the centre of mass, J, that a step in flight ends with: that of its beginning and the work of what
    /// acts along the joints, which is taken at the mean of old and new velocities. `None` where no body rotates fast; where rows or
    /// actuators act or joints stick, whose work is not known as well; and in Moreau and Jean's step, which is symmetric.
    fn energy_of_whirl(&mut self, data: &StepData<'_>) -> Option<f64> {
        let StepData { model, state, work, step, midpoint, .. } = data;
        let loads = &work.drives.loads;
        let driven = work.drives.torque.iter().any(|torque| *torque != 0.0);
        let known = !driven && work.problem.rows.is_empty() && loads.iter().all(|load| load.held.is_none());
        if *midpoint || !self.whirls || !known {
            return None;
        }
        let Placement { bodies, old, .. } = &work.placed;
        // The state's velocities are already the new ones, those of the beginning were kept.
        let rates = self.flight.rates();
        let before = kinetic_energy_at(model, bodies, old.iter(), rates);
        let joints = rates.iter().zip(&state.velocities).zip(loads).zip(&model.armature);
        let twice_power: f64 = joints
            .map(|(((old, new), load), armature)| {
                (load.torque - (load.inertia - armature) * (new - old) / *step) * (old + new)
            })
            .sum();
        let of_center = self.flight.momentum(model).energy_of_center(model.mass);
        Some(before - of_center + 0.5 * *step * twice_power)
    }
}
