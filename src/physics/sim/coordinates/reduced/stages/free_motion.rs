//! The velocities that the step would end with if no row acted.

use super::Stages;
use crate::model::Model;
use crate::sim::actuator::ActuatorMode;
use crate::sim::bodies::BodyMotion;
use crate::sim::coordinates::reduced::articulated::{self, JointLoad, Singular};
use crate::sim::failure::{Failure, FailureCause};
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::SpatialMotion;
use crate::sim::state::State;
use crate::sim::tracking::implicit_damper_weight;

impl Stages<'_> {
    /// Acceleration of the root in the directions in which it is not free: a lock stops its rotation.
    pub(super) fn prescribed(&self) -> SpatialMotion {
        match self.root_freedom {
            RootFreedom::Translating => SpatialMotion {
                angular: -self.state.root.angular_velocity / self.step,
                linear: nalgebra::Vector3::zeros(),
            },
            RootFreedom::Fixed | RootFreedom::Free => SpatialMotion::ZERO,
        }
    }

    /// Acceleration of a frame at rest less gravity, −g: given to the root instead of weights to all bodies
    /// (Featherstone 2008, section 5.3).
    pub(super) fn minus_gravity(&self) -> SpatialMotion {
        SpatialMotion { angular: nalgebra::Vector3::zeros(), linear: -self.plan.gravity }
    }

    /// The mass matrix under the loads of the joints.
    pub(super) fn factorise(&mut self) -> Result<(), Failure> {
        self.loads();
        self.friction_loads();
        self.factorise_under_loads()
    }

    /// The loads of the joints but for their dry friction.
    pub(super) fn loads(&mut self) {
        let step = self.step;
        let Self { model, plan, state, work, midpoint, .. } = self;
        for joint in 0..work.loads.len() {
            let rate = state.velocities[joint];
            let mut load = JointLoad { torque: 0.0, inertia: model.armature[joint], held: None };
            if let Some(damping) = &plan.damping {
                let whole = step * damping[joint];
                let share = if *midpoint {
                    implicit_damper_weight(whole / work.composite_inertia[joint])
                } else {
                    1.0
                };
                load.torque -= damping[joint] * rate;
                load.inertia += share * whole;
            }
            if work.actuators[joint] == ActuatorMode::Line {
                let drive = JointLoad::of_drive(work.springs[joint], rate, step);
                load.torque += drive.torque;
                load.inertia += drive.inertia;
            }
            work.loads[joint] = load;
        }
    }

    /// The mass matrix under the `loads`.
    pub(super) fn factorise_under_loads(&mut self) -> Result<(), Failure> {
        let Self { model, state, work, root_freedom, .. } = self;
        articulated::factorise(&mut work.articulated, model, &work.bodies, &work.loads, *root_freedom)
            .map_err(|cause| singular(model, state, cause))?;
        Ok(())
    }

    /// Velocities after the step if no row acted.
    pub(super) fn free_velocities(&mut self) {
        let (prescribed, minus_gravity, step) = (self.prescribed(), self.minus_gravity(), self.step);
        let Self { model, plan, state, work, root_freedom, .. } = self;
        let root = articulated::accelerate(
            &mut work.articulated,
            model,
            &work.bodies,
            &work.loads,
            *root_freedom,
            minus_gravity,
            prescribed,
            &mut work.joint_acceleration,
        );
        work.free[0] = after(state, root, &work.bodies[0], plan.velocity_forces, step);
        for joint in 0..work.free_rates.len() {
            let rate = state.velocities[joint] + step * work.joint_acceleration[joint];
            work.free_rates[joint] = rate;
            let parent = work.free[model.bodies[joint + 1].parent];
            work.free[joint + 1] = parent.plus_scaled(work.bodies[joint + 1].motion_subspace, rate);
        }
    }
}

/// Velocity of the root after a step at spatial acceleration `acceleration`.
///
/// The velocity kept in a state is that of the root's origin, which moves: its rate of change is the
/// spatial acceleration plus ω × v (Featherstone 2008, section 2.11), with the same ω and v as in the
/// velocity-dependent forces.
pub(super) fn after(
    state: &State,
    acceleration: SpatialMotion,
    root: &BodyMotion,
    velocity_forces: bool,
    step: f64,
) -> SpatialMotion {
    let mut acceleration = acceleration;
    if velocity_forces {
        acceleration.linear += root.velocity.angular.cross(&root.velocity.linear);
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
