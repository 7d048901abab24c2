//! The rows of a step, their solution and the bodies' response.

use super::Stages;
use crate::sim::actuator::ActuatorMode;
use crate::sim::coordinates::reduced::response;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::joint_friction::FrictionMode;
use crate::sim::lcp::SolveStatus;
use crate::sim::rows::{Lanes, Recovery, contact, dry_friction, limit, loops, torque};
use crate::sim::workspace::Workspace;

impl Stages<'_> {
    /// The rows of contacts, limits, dry friction, saturated actuators and loops.
    pub(super) fn rows(&mut self) {
        let step = self.step;
        let Self { model, plan, state, work, .. } = self;
        let Workspace {
            bodies,
            candidates,
            springs,
            actuators,
            near_limit,
            friction_modes,
            articulated,
            mean_rates,
            free_rates,
            free,
            rows,
            ..
        } = &mut **work;
        let memory = &state.memory;
        rows.clear();
        let of_joint = |joint: usize, numbers: &mut Vec<Lanes>| {
            response::of_joint(model, bodies, articulated, joint, numbers)
        };
        contact::add(
            rows,
            candidates,
            free,
            plan.friction,
            step,
            Recovery::of_unilateral(plan),
            &memory.contacts,
            0.0,
            |candidate, forces, numbers| {
                let other = candidate.against.body();
                response::of_bodies(model, bodies, articulated, candidate.body, other, forces, numbers)
            },
        );
        if let Some(limits) = &plan.limits {
            let angles = &state.angles;
            for (joint, near) in near_limit.iter_mut().enumerate() {
                let [lower, upper] = limit::near(limits[joint], angles[joint], free_rates[joint], step);
                *near = [near[0] || lower, near[1] || upper];
            }
            limit::add(
                rows,
                limits,
                near_limit,
                angles,
                free_rates,
                step,
                |joint| Recovery::of_unilateral(plan).along(model.bodies[joint + 1].dof),
                &memory.limit,
                of_joint,
            );
        }
        if let Some(friction) = &plan.dry_friction {
            let has_row = |joint: usize| friction_modes[joint] == FrictionMode::Row;
            dry_friction::add(rows, friction, has_row, free_rates, &memory.dry_friction, of_joint);
        }
        for (joint, mode) in actuators.iter().enumerate() {
            if *mode == ActuatorMode::Line {
                continue;
            }
            if let Some((line, bounds)) = mode.row(springs[joint], plan.actuator_limits(joint)) {
                let warm_start = memory.saturated[joint];
                torque::add(rows, joint, line, bounds, free_rates[joint], warm_start, of_joint);
            }
        }
        loops::add(
            rows,
            model,
            bodies,
            mean_rates,
            free,
            step,
            plan.has_joint_bias(),
            Recovery::of_loops(plan),
            None,
            |[child, parent], wrench, numbers| {
                response::of_bodies(model, bodies, articulated, child, Some(parent), &[wrench], numbers)
            },
        );
    }

    /// Solves the complementarity problem; whether to its tolerance.
    pub(super) fn solve(&mut self) -> Result<bool, Failure> {
        let Self { model, plan, state, work, step, .. } = self;
        let status = work.solve(plan, *step);
        if status == SolveStatus::Ray && work.friction_modes.contains(&FrictionMode::Stuck) {
            return Ok(false);
        }
        fail_unless_usable(status, model, state)?;
        Ok(status == SolveStatus::Solved)
    }

    /// New velocities.
    pub(super) fn response(&mut self) {
        let Self { model, work, step, .. } = self;
        work.joint_rates.copy_from_slice(&work.free_rates);
        if work.rows.is_empty() {
            work.new.copy_from_slice(&work.free);
            return;
        }
        work.rows.impulse(*step, &mut work.half);
        response::finish(
            model,
            &work.bodies,
            &work.articulated,
            &work.half,
            &mut work.joint_rates,
            &mut work.changes,
        );
        work.take_changes();
    }

    /// Whether a joint without a row for its limit would cross it in this step; a row is added.
    pub(super) fn crosses_limit(&mut self) -> bool {
        self.plan
            .limits
            .as_ref()
            .is_some_and(|limits| self.work.mark_crossed_limits(limits, &self.state.angles, self.step))
    }

    /// Whether an impact in this step, which changes the velocities after the detection, brings about other
    /// contacts; rows are added for them.
    pub(super) fn impact_contacts(&mut self) -> bool {
        let Self { model, plan, state, work, step, .. } = self;
        let found = work.is_impact(plan, *step) && work.detect_again(model, plan, Some(&state.angles), *step);
        work.add_driven_in(model, plan, *step) || found
    }
}
