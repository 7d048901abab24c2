//! Feedforward in joint coordinates whose joints are all driven and independent (see `sim/step/feedforward.rs`).
//!
//! The pass prescribes every joint's acceleration and leaves only the root to move: the character is one rigid body whose shape is
//! changing, and contacts (in the contact-aware form) act on that body.

use super::ReducedCoordinates;
use super::articulated::Singular;
use super::free_motion::{after, minus_gravity, prescribed, singular};
use super::kinematics::move_along;
use super::response;
use crate::scene::{DrivePlan, Feedforward};
use crate::sim::contact::ContactCandidate;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::lcp::{SolveStatus, Solver};
use crate::sim::rows::{ROOT, contact};
use crate::sim::spatial::SpatialForce;
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
            for ((free, rate), acceleration) in
                free.rates.iter_mut().zip(&state.velocities).zip(&feedforward.acceleration)
            {
                *free = rate + horizon * acceleration;
            }
            let root = after(state, root, bodies.velocity.at(0), plan.velocity_forces, horizon);
            move_along(model, &bodies.groups, root, &free.rates, &mut free.bodies);
            contact::add(
                &mut feedforward.rows,
                candidates,
                &free.bodies,
                plan.friction,
                horizon,
                contact::of_feedforward(plan, model.mass, horizon),
                |candidate| contact::feedforward_guess(candidate, &state.memory.contacts),
                |candidate, forces, numbers| {
                    // Contact forces between two bodies of the rigid whole cancel.
                    let forces = if candidate.against.body().is_none() { forces } else { &[] };
                    numbers.extend(control.root.half_solve(response::side_by_side(forces)));
                    ROOT..ROOT
                },
            );
            // No force between two bodies of the rigid whole changes its motion: none is asked to, and the estimate stays.
            let rows_per_contact = contact::rows_per_contact(plan.friction);
            for (index, candidate) in candidates.iter().enumerate() {
                if candidate.against.body().is_some() {
                    let first = index * rows_per_contact;
                    (first..first + rows_per_contact).for_each(|row| feedforward.rows.disable(row));
                }
            }
            feedforward.rows.assemble(horizon);
            let (problem_of_contacts, force) = feedforward.rows.problem(plan.circular_friction());
            let solution = problem.solver.solve(&problem_of_contacts, force);
            feedforward.unsolved = solution.status != SolveStatus::Solved;
            fail_unless_usable(solution.status, model, state, &feedforward.rows)?;
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
