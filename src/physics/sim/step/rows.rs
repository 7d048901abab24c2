//! The rows of a step, their solution and the bodies' response.

use super::Stages;
use crate::model::wide::Lanes;
use crate::sim::contact::ContactCandidate;
use crate::sim::coordinates::CoordinateSystem;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::joint_friction::FrictionMode;
use crate::sim::lcp::SolveStatus;
use crate::sim::rows::contact::ContactLaw;
use crate::sim::rows::{Recovery, Rows, contact, drive, dry_friction, limit, loops, torque};
use crate::sim::step_data::StepData;
use crate::sim::workspace::Workspace;

impl<C: CoordinateSystem> Stages<'_, C> {
    /// The rows: contacts first, then what has bounds (limits, dry friction, saturated actuators), then what holds the
    /// character together, if that has rows, and its loops.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn rows(&mut self) {
        if !C::JOINTS_BY_ROWS {
            self.near_limits();
        }
        let mut rows = std::mem::take(&mut self.data.work.problem.rows);
        rows.clear();
        let StepData { model, plan, state, work, step, .. } = &self.data;
        let (memory, rates, bodies) = (&state.memory, &work.free.rates, &work.placed.bodies);
        let of_joint =
            |joint: usize, numbers: &mut Vec<Lanes>| self.system.of_joint(model, bodies, joint, numbers);
        let rigid =
            || ContactLaw::Rigid { recovery: Recovery::of_unilateral(plan).translation, compliance: 0.0 };
        let law = plan
            .contact_time_constant
            .map_or_else(rigid, |time_constant| ContactLaw::Soft { time_constant, old: &work.placed.old });
        self.contacts(&mut rows, &work.detection.candidates, law, |candidate| {
            memory.contacts.at(candidate.slot)
        });
        if let Some(limits) = &plan.limits {
            limit::add(
                &mut rows,
                limits,
                &work.problem.near_limit,
                &state.angles,
                rates,
                *step,
                |joint| Recovery::of_unilateral(plan).along(model.bodies[joint + 1].dof),
                &memory.limit,
                of_joint,
            );
        }
        if let Some(friction) = &plan.dry_friction {
            let has_row = |joint: usize| work.friction.modes[joint] == FrictionMode::Row;
            dry_friction::add(&mut rows, friction, has_row, rates, &memory.dry_friction, of_joint);
        }
        for (joint, rate) in rates.iter().enumerate() {
            if let Some((line, bounds)) = self.actuator_row(joint) {
                let warm_start = memory.saturated[joint];
                torque::add(&mut rows, joint, line, bounds, *rate, warm_start, of_joint);
            }
        }
        if C::JOINTS_BY_ROWS {
            self.system.hold_together(&self.data, &mut rows, |rows, joint| {
                let line = work.drives.loads[joint].line(state.velocities[joint], *step);
                if !line.is_prescribed() {
                    drive::add(rows, joint, line, rates[joint], of_joint);
                }
            });
        }
        self.loops(&mut rows);
        self.data.work.problem.rows = rows;
    }

    /// Marks the ends of the joints' ranges that come near in this step if no row acts.
    fn near_limits(&mut self) {
        let StepData { plan, state, work, step, .. } = &mut self.data;
        let Workspace { problem, free, .. } = &mut **work;
        let Some(limits) = &plan.limits else { return };
        let joints = limits.iter().zip(&state.angles).zip(&free.rates).zip(&mut problem.near_limit);
        for (((range, angle), rate), near) in joints {
            let [lower, upper] = limit::near(*range, *angle, *rate, *step);
            *near = [near[0] | lower, near[1] | upper];
        }
    }

    /// Adds the rows of the contacts `candidates`, which give way by `law` and whose solve starts from the forces that `warm_start` gives; for all see
    /// [`contact::add`].
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn contacts(
        &self,
        rows: &mut Rows,
        candidates: &[ContactCandidate],
        law: ContactLaw<'_>,
        warm_start: impl Fn(&ContactCandidate) -> [f64; 3],
    ) {
        let StepData { model, plan, work, step, .. } = &self.data;
        contact::add(
            rows,
            candidates,
            &work.free.bodies,
            plan.friction,
            *step,
            law,
            warm_start,
            |candidate, forces, numbers| {
                let (body, other) = (candidate.body, candidate.against.body());
                self.system.of_bodies(model, &work.placed.bodies, body, other, forces, numbers)
            },
        );
    }

    /// Adds the rows of the loops.
    pub(super) fn loops(&self, rows: &mut Rows) {
        let StepData { model, plan, work, step, .. } = &self.data;
        let bodies = &work.placed.bodies;
        loops::add(
            rows,
            model,
            bodies,
            &work.placed.mean_rates,
            &work.free.bodies,
            *step,
            plan.has_joint_bias(),
            // Not the substep: the shorter it is, the faster and the more energetic would an open loop be closed.
            plan.step(),
            Recovery::of_loops(plan),
            self.system.rows_elsewhere(),
            |[child, parent], wrench, numbers| {
                self.system.of_bodies(model, bodies, child, Some(parent), &[wrench], numbers)
            },
        );
    }

    /// Solves the complementarity problem; whether to its tolerance.
    pub(super) fn solve(&mut self) -> Result<bool, Failure> {
        let StepData { model, plan, state, work, step, .. } = &mut self.data;
        let Workspace { problem, detection, friction, .. } = &mut **work;
        let status = problem.solve(plan, detection, *step);
        if status == SolveStatus::Ray && friction.modes.contains(&FrictionMode::Stuck) {
            return Ok(false);
        }
        fail_unless_usable(status, model, state, &problem.rows)?;
        Ok(status == SolveStatus::Solved)
    }

    /// New velocities.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn respond(&mut self) {
        let StepData { model, work, step, .. } = &mut self.data;
        let Workspace { placed, free, problem, new, changes, .. } = &mut **work;
        if problem.rows.is_empty() {
            new.copy_from(free);
            return;
        }
        new.rates.copy_from_slice(&free.rates);
        problem.rows.impulse(*step, &mut problem.half);
        self.system.respond(model, &placed.bodies, &problem.half, &mut new.rates, changes);
        new.change(&free.bodies, changes);
    }

    /// Whether a joint without a row for its limit would cross it in this step; a row is added.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn crosses_limit(&mut self) -> bool {
        let StepData { plan, state, work, step, .. } = &mut self.data;
        let Workspace { problem, new, .. } = &mut **work;
        let Some(limits) = &plan.limits else { return false };
        problem.mark_crossed_limits(limits, &state.angles, &new.rates, *step)
    }

    /// Whether an impact in this step, which changes the velocities after the detection, brings about other
    /// contacts; rows are added for them.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn impact_contacts(&mut self) -> bool {
        let StepData { model, plan, state, work, step, .. } = &mut self.data;
        let Workspace { detection, placed, new, feedforward, .. } = &mut **work;
        let (angles, period) = ((!C::JOINTS_BY_ROWS).then_some(&state.angles[..]), feedforward.period);
        let found = detection.is_impact(plan, placed, &new.bodies, *step)
            && detection.detect_again(model, plan, placed, &mut new.bodies, angles, period, *step);
        detection.add_driven_in(model, plan, placed, &new.bodies, *step) || found
    }
}
