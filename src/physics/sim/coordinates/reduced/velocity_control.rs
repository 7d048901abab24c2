//! Feedforward in joint coordinates whose joints are all driven and independent (see `sim/step/feedforward.rs`).
//!
//! The pass prescribes every joint's acceleration and leaves only the root to move: the character is one rigid body whose shape is
//! changing, and contacts (in the contact-aware form) act on that body.

use super::ReducedCoordinates;
use super::articulated::{Articulated, Singular};
use super::free_motion::{after, minus_gravity, prescribed, singular};
use super::response;
use super::root::RootFactor;
use crate::model::Model;
use crate::scene::{DrivePlan, Feedforward};
use crate::sim::bodies::BodyMotion;
use crate::sim::contact::ContactCandidate;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::lcp::Solver;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::rows::{ROOT, Recovery, contact};
use crate::sim::spatial::{ArticulatedInertia, RigidInertia, SpatialForce, SpatialMotion};
use crate::sim::step_data::StepData;
use crate::sim::workspace::Workspace;

impl ReducedCoordinates {
    /// Offset torques f₀ of `drive`, if the joints are all driven and independent; whether they are.
    pub(super) fn velocity_control(
        &mut self,
        data: &mut StepData<'_>,
        drive: &DrivePlan,
    ) -> Result<bool, Failure> {
        let Self { control: Some(control), articulated, .. } = self else { return Ok(false) };
        let horizon = drive.horizon(data.work.feedforward.period, data.step);
        let (prescribed, minus_gravity) = (prescribed(data).scaled(data.step / horizon), minus_gravity(data));
        let StepData { model, plan, state, work, root_freedom, .. } = data;
        let Workspace { placed, free, detection, feedforward, problem, .. } = &mut **work;
        let bodies = &placed.bodies;
        let root = control
            .prescribe(
                model,
                bodies,
                articulated,
                &feedforward.acceleration,
                *root_freedom,
                minus_gravity,
                prescribed,
            )
            .ok_or_else(|| singular(model, state, Singular::Root))?;
        let candidates = &detection.candidates[..detection.first];
        if drive.feedforward == Feedforward::ContactAware && !candidates.is_empty() {
            free.bodies[0] = after(state, root, &bodies[0], plan.velocity_forces, horizon);
            for index in 1..bodies.len() {
                let parent = free.bodies[model.bodies[index].parent];
                let rate = state.velocities[index - 1] + horizon * feedforward.acceleration[index - 1];
                free.bodies[index] = parent.plus_scaled(bodies[index].motion_subspace, rate);
            }
            contact::add(
                &mut feedforward.rows,
                candidates,
                &free.bodies,
                plan.friction,
                horizon,
                Recovery::of_unilateral(plan),
                &state.memory.feedforward_contacts,
                contact::compliance(model.mass, horizon),
                |candidate, forces, numbers| {
                    // Contact forces between two bodies of the rigid whole cancel.
                    let forces = if candidate.against.body().is_none() { forces } else { &[] };
                    numbers.extend(control.root.half_solve(response::side_by_side(forces)));
                    ROOT..ROOT
                },
            );
            feedforward.rows.assemble(horizon);
            let (problem_of_contacts, force) = feedforward.rows.problem(plan.circular_friction());
            let solution = problem.solver.solve(&problem_of_contacts, force);
            fail_unless_usable(solution.status, model, state)?;
            let mut half = [0.0; ROOT];
            feedforward.rows.impulse(1.0, &mut half);
            control.accelerate_root(control.root.finish(half));
            push_contacts(candidates, &feedforward.rows.force, plan.friction, |body, force| {
                control.push(model, body, force);
            });
        }
        for joint in 0..feedforward.torque.len() {
            let damping = plan.damping.as_ref().map_or(0.0, |damping| damping[joint]);
            feedforward.torque[joint] = control.torque(bodies, joint)
                + model.armature[joint] * feedforward.acceleration[joint]
                + damping * feedforward.rates[joint];
        }
        Ok(true)
    }
}

/// Calls `push` with the force of every contact on each body that it acts on.
fn push_contacts(
    candidates: &[ContactCandidate],
    forces: &[f64],
    friction: Option<f64>,
    mut push: impl FnMut(usize, SpatialForce),
) {
    for (candidate, forces) in candidates.iter().zip(forces.chunks_exact(contact::rows_per_contact(friction)))
    {
        let force = SpatialForce::at(candidate.at, candidate.force(forces));
        push(candidate.body, force);
        if let Some(other) = candidate.against.body() {
            push(other, force.scaled(-1.0));
        }
    }
}

/// The character as one rigid body of changing shape.
#[derive(Debug, Clone)]
pub struct VelocityControl {
    /// Composite-rigid-body inertia of each body with all beyond it. (prescribe)
    composite: Vec<RigidInertia>,
    /// Force that each body with all beyond it requires when the root does not accelerate. (prescribe, push)
    taken: Vec<SpatialForce>,
    /// Acceleration of each body besides its bias acceleration, when the root does not accelerate. (prescribe)
    acceleration: Vec<SpatialMotion>,
    /// The root's factor, of the whole character's inertia.
    pub root: RootFactor,
    /// Acceleration of the root less gravity: without contacts (prescribe), then with them (accelerate_root).
    root_minus_gravity: SpatialMotion,
}

impl VelocityControl {
    /// Room for a model of `bodies` bodies.
    pub fn new(bodies: usize) -> Self {
        Self {
            composite: vec![RigidInertia::ZERO; bodies],
            taken: vec![SpatialForce::ZERO; bodies],
            acceleration: vec![SpatialMotion::ZERO; bodies],
            root: RootFactor::EMPTY,
            root_minus_gravity: SpatialMotion::ZERO,
        }
    }

    /// Prescribes `joint_acceleration` and returns the root's acceleration without contacts, or
    /// `None` if the character has no inertia.
    #[allow(clippy::too_many_arguments)] // one call a step; every argument is a stage's result
    pub fn prescribe(
        &mut self,
        model: &Model,
        bodies: &[BodyMotion],
        articulated: &Articulated,
        joint_acceleration: &[f64],
        freedom: RootFreedom,
        minus_gravity: SpatialMotion,
        prescribed: SpatialMotion,
    ) -> Option<SpatialMotion> {
        self.acceleration[0] = SpatialMotion::ZERO;
        for index in 0..bodies.len() {
            let body = &bodies[index];
            if index > 0 {
                self.acceleration[index] = self.acceleration[model.bodies[index].parent]
                    .plus_scaled(body.motion_subspace, joint_acceleration[index - 1]);
            }
            self.composite[index] = body.inertia;
            self.taken[index] =
                articulated.bias_force(index).plus(body.inertia.times(self.acceleration[index]));
        }
        for &index in model.outward.iter().rev() {
            let parent = model.bodies[index].parent;
            self.composite[parent] = self.composite[parent].plus(self.composite[index]);
            self.taken[parent] = self.taken[parent].plus(self.taken[index]);
        }
        let whole = ArticulatedInertia::from(self.composite[0]);
        self.root = RootFactor::new(freedom, &whole)?;
        let prescribed = if freedom == RootFreedom::Fixed { minus_gravity } else { prescribed };
        self.root_minus_gravity = self.root.accelerate(&whole, self.taken[0].scaled(-1.0), prescribed);
        Some(self.root_minus_gravity.plus(minus_gravity.scaled(-1.0)))
    }

    /// Adds a contact force on `body`, which changes what it and the bodies between it and the root require.
    pub fn push(&mut self, model: &Model, mut body: usize, force: SpatialForce) {
        loop {
            self.taken[body] = self.taken[body].plus(force.scaled(-1.0));
            if body == 0 {
                return;
            }
            body = model.bodies[body].parent;
        }
    }

    /// Takes the change of the root's acceleration that the contacts bring.
    pub fn accelerate_root(&mut self, change: SpatialMotion) {
        self.root_minus_gravity = self.root_minus_gravity.plus(change);
    }

    /// Torque of joint `joint` that goes with the prescribed motion, N m or N, apart from armature
    /// and damping.
    #[inline]
    pub fn torque(&self, bodies: &[BodyMotion], joint: usize) -> f64 {
        let index = joint + 1;
        let of_root = self.composite[index].times(self.root_minus_gravity);
        bodies[index].motion_subspace.dot(self.taken[index].plus(of_root))
    }
}
