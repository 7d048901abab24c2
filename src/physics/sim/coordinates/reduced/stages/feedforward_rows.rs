//! Feedforward where loops or passive joints leave the motion of some joints open.
//!
//! The target's velocities then do not prescribe the motion of every joint. The driven joints are given them by rows e,
//! beside the rows of the loops and, if the feedforward is contact-aware, of the contacts (velocity control, Tokizaki &
//! Hasegawa eq. 17 and figure 2); the other joints move as they result. The forces of those rows are the offset torques
//! f₀. Of joints that the loops couple to others, the first get their velocities; a row that depends on those before it
//! has the torque 0.

use super::Stages;
use crate::scene::{DrivePlan, Feedforward};
use crate::sim::coordinates::reduced::response;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::lcp::Solver;
use crate::sim::rows::{Recovery, RowOwner, Rows, contact, drive, loops};

impl Stages<'_> {
    /// Fills the offset torques for the motions of the targets in `reference`, while no joint is driven yet.
    pub(super) fn prescribe_velocity(&mut self, drive: &DrivePlan) -> Result<(), Failure> {
        // The pass is a step of its own.
        let step = self.step;
        self.velocity_after(drive);
        self.step = drive.horizon(self.work.feedforward_period, step);
        self.loads();
        self.factorise_under_loads()?;
        self.free_velocities();
        let mut rows = std::mem::take(&mut self.work.control_rows);
        rows.clear();
        self.velocity_rows(&mut rows, drive);
        rows.assemble(self.step);
        self.step = step;
        let (problem, force) = rows.problem(self.plan.circular_friction());
        let solution = self.work.solver.solve(&problem, force);
        self.work.feedforward.fill(0.0);
        for (owner, force) in rows.owner.iter().zip(&rows.force) {
            if let RowOwner::Drive(joint) = *owner {
                self.work.feedforward[joint] = *force;
            }
        }
        self.work.control_rows = rows;
        fail_unless_usable(solution.status, self.model, self.state)
    }

    /// Fills `joint_rates` with the velocities that the driven joints are to have at the end of the pass.
    fn velocity_after(&mut self, drive: &DrivePlan) {
        let Self { state, work, step, .. } = self;
        let extent = drive.horizon(work.feedforward_period, *step) / *step;
        for (joint, reference) in work.reference.iter().enumerate() {
            let rate = state.velocities[joint];
            let change = reference.rate_after(rate, work.feedforward_period, *step) - rate;
            work.joint_rates[joint] = rate + change * extent;
        }
    }

    /// The rows that give the driven joints the velocities of their targets, and those of contacts and loops.
    fn velocity_rows(&self, rows: &mut Rows, drive: &DrivePlan) {
        let Self { model, plan, state, work, step, .. } = self;
        let (bodies, articulated) = (&work.bodies, &work.articulated);
        if drive.feedforward == Feedforward::ContactAware {
            contact::add(
                rows,
                &work.candidates[..work.detected],
                &work.free,
                plan.friction,
                *step,
                Recovery::of_unilateral(plan),
                &state.memory.feedforward_contacts,
                contact::compliance(model.mass, *step),
                |candidate, forces, numbers| {
                    let other = candidate.against.body();
                    response::of_bodies(model, bodies, articulated, candidate.body, other, forces, numbers)
                },
            );
        }
        loops::add(
            rows,
            model,
            bodies,
            &work.mean_rates,
            &work.free,
            *step,
            plan.has_joint_bias(),
            Recovery::of_loops(plan),
            None,
            |[child, parent], wrench, numbers| {
                response::of_bodies(model, bodies, articulated, child, Some(parent), &[wrench], numbers)
            },
        );
        for joint in (0..work.reference.len()).filter(|joint| model.driven[*joint]) {
            let wanted = work.joint_rates[joint];
            drive::prescribe_velocity(rows, joint, wanted, work.free_rates[joint], |joint, numbers| {
                response::of_joint(model, bodies, articulated, joint, numbers)
            });
        }
    }
}
