//! The velocities that the step would end with if no row acted.

use nalgebra::Vector3;

use super::ReducedCoordinates;
use super::articulated::{self, Singular};
use super::kinematics::move_along;
use crate::model::Model;
use crate::sim::failure::{Failure, FailureCause};
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::SpatialMotion;
use crate::sim::state::State;
use crate::sim::step_data::StepData;

impl ReducedCoordinates {
    /// The mass matrix under the loads of the joints.
    pub(super) fn factorise_under_loads(&mut self, data: &mut StepData<'_>) -> Result<(), Failure> {
        let StepData { model, state, work, root_freedom, .. } = data;
        let (bodies, loads) = (&work.placed.bodies, &work.drives.loads);
        articulated::factorise(&mut self.articulated, model, bodies, loads, *root_freedom)
            .map_err(|cause| singular(model, state, cause))
    }

    /// Velocities after the step if no row acted.
    pub(super) fn free_velocities(&mut self, data: &mut StepData<'_>) {
        let (prescribed, minus_gravity) = (prescribed(data), minus_gravity(data));
        let StepData { model, plan, state, work, root_freedom, step, .. } = data;
        let bodies = &work.placed.bodies;
        let root = articulated::accelerate(
            &mut self.articulated,
            model,
            bodies,
            *root_freedom,
            minus_gravity,
            prescribed,
            &mut self.acceleration,
        );
        let free = &mut work.free;
        for ((free, rate), acceleration) in
            free.rates.iter_mut().zip(&state.velocities).zip(&self.acceleration)
        {
            *free = rate + *step * acceleration;
        }
        let root = after(state, root, bodies.velocity.at(0), plan.velocity_forces, *step);
        move_along(model, &bodies.groups, root, &free.rates, &mut free.bodies);
    }
}

/// Acceleration of the root in the directions in which it is not free: a lock stops its rotation.
pub(super) fn prescribed(data: &StepData<'_>) -> SpatialMotion {
    match data.root_freedom {
        RootFreedom::Translating => {
            SpatialMotion { angular: -data.state.root.angular_velocity / data.step, linear: Vector3::zeros() }
        }
        RootFreedom::Fixed | RootFreedom::Free => SpatialMotion::ZERO,
    }
}

/// Acceleration of a frame at rest less gravity, −g: given to the root instead of weights to all bodies
/// (Featherstone 2008, section 5.3).
pub(super) fn minus_gravity(data: &StepData<'_>) -> SpatialMotion {
    SpatialMotion { angular: Vector3::zeros(), linear: -data.plan.gravity }
}

/// Velocity of the root after a step at spatial acceleration `acceleration`; `mean` is that at which velocity-dependent
/// forces are taken.
///
/// The velocity kept in a state is that of the root's origin, which moves: its rate of change is the
/// spatial acceleration plus ω × v (Featherstone 2008, section 2.11), with the same ω and v as in the
/// velocity-dependent forces.
pub(super) fn after(
    state: &State,
    acceleration: SpatialMotion,
    mean: SpatialMotion,
    velocity_forces: bool,
    step: f64,
) -> SpatialMotion {
    let mut acceleration = acceleration;
    if velocity_forces {
        acceleration.linear += mean.angular.cross(&mean.linear);
    }
    state.root.motion().plus_scaled(acceleration, step)
}

pub(super) fn singular(model: &Model, state: &State, cause: Singular) -> Failure {
    let place = match cause {
        Singular::Joint(joint) => format!("joint {}", model.joint_names[joint]),
        Singular::Root => format!("root link {}", model.character.links[0].name),
    };
    Failure { time: state.time, place, cause: FailureCause::SingularMass }
}
