//! Feedforward, the first of the two passes of tracking: the torque that would bring the joints to the target's velocity
//! within a period of its own.
//!
//! The paper asks for the target's velocity after one step. With the period T in place of the step the pass asks for the
//! acceleration a* + (r − q̇) / T, of which r is the target's velocity and a* its acceleration: an error of velocity
//! decays as e^(−t/T) at any step, so that motions converge as the step falls (derived at
//! [`Reference::rate_after`](crate::sim::tracking::Reference::rate_after)). With T = h the pass is the paper's. Contacts (in
//! the contact-aware form) are stopped within T as well: their velocities after T, not after h, are what the rows ask for,
//! so that an impact does not put a torque in proportion to 1/h into f₀. All points take part that may close within T, as
//! far ahead as that at any step: a force that begins one or two steps before the touch-down would begin earlier the longer the step
//! is. So f₀ is that of one step of length T and stays bounded as h falls. Where nothing touches down
//! it errs as the state does, O(h). At a touch-down the time of the impact is known to O(h) and f₀
//! is bounded, so that its impulse errs by O(h) as well: motions converge at first order.
//!
//! The pass is a step of its own, in which the driven joints are held at the velocity that this gives by rows e, beside the rows
//! of loops, of what holds the character together and, if the feedforward is contact-aware, of contacts (velocity control, Tokizaki &
//! Hasegawa eq. 17 and figure 2). Other joints move as they result. The forces of those rows are the offset torques f₀, with
//! what rotor and damping of the joint take at that velocity. Of joints that loops couple to others, the first get their
//! velocities; a row that depends on those before it has the torque 0. In joint coordinates that are all driven no row is
//! needed but those of contacts (`coordinates/reduced/velocity_control.rs`).

use super::Stages;
use crate::scene::{DrivePlan, Feedforward};
use crate::sim::contact::ContactCandidate;
use crate::sim::coordinates::CoordinateSystem;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::lcp::{SolveStatus, Solver};
use crate::sim::rows::{RowOwner, Rows, contact, drive};
use crate::sim::step_data::StepData;
use crate::sim::workspace::Workspace;

impl<C: CoordinateSystem> Stages<'_, C> {
    /// Offset torques f₀ that would bring the joints to the target's velocity within the feedforward's period, with contacts or
    /// without, while no joint is driven yet.
    pub(super) fn feedforward(&mut self, drive: &DrivePlan) -> Result<(), Failure> {
        if drive.feedforward == Feedforward::None {
            self.data.work.feedforward.torque.fill(0.0);
            return Ok(());
        }
        let step = self.data.step;
        self.data.work.feedforward.ask(&self.data.state.velocities, step);
        if self.system.feedforward(&mut self.data, drive)? {
            return Ok(());
        }
        self.data.step = drive.horizon(self.data.work.feedforward.period, step);
        self.loads();
        self.system.factorise(&mut self.data)?;
        self.system.free_motion(&mut self.data);
        let mut rows = std::mem::take(&mut self.data.work.feedforward.rows);
        rows.clear();
        self.velocity_rows(&mut rows, drive, step);
        rows.assemble(self.data.step);
        self.data.step = step;
        let StepData { model, plan, state, work, .. } = &mut self.data;
        let (problem, force) = rows.problem(plan.circular_friction());
        let solution = work.problem.solver.solve(&problem, force);
        let Workspace { feedforward, .. } = &mut **work;
        feedforward.torque.fill(0.0);
        for (owner, force) in rows.owner.iter().zip(&rows.force) {
            if let RowOwner::Drive(joint) = *owner {
                feedforward.torque[joint] = *force;
                if C::JOINTS_BY_ROWS {
                    let damping = plan.damping.as_ref().map_or(0.0, |damping| damping[joint]);
                    feedforward.torque[joint] += model.armature[joint] * feedforward.acceleration[joint]
                        + damping * feedforward.rates[joint];
                }
            }
        }
        feedforward.rows = rows;
        feedforward.unsolved = solution.status != SolveStatus::Solved;
        fail_unless_usable(solution.status, model, state, &feedforward.rows)
    }

    /// The rows that give the driven joints what the targets ask for in a step of `step` seconds, at the end of the pass, and those of
    /// contacts and loops.
    fn velocity_rows(&self, rows: &mut Rows, drive: &DrivePlan, step: f64) {
        let StepData { model, plan, state, work, .. } = &self.data;
        if drive.feedforward == Feedforward::ContactAware {
            let candidates = &work.detection.candidates[..work.detection.first];
            let law = contact::of_feedforward(plan, model.mass, self.data.step);
            let guess =
                |candidate: &ContactCandidate| contact::feedforward_guess(candidate, &state.memory.contacts);
            self.contacts(rows, candidates, law, guess);
        }
        self.loops(rows);
        let extent = self.data.step / step;
        self.system.hold_together(&self.data, rows, |rows, joint| {
            if !model.driven[joint] {
                return;
            }
            let rate = state.velocities[joint];
            let wanted = rate + (work.feedforward.rates[joint] - rate) * extent;
            drive::prescribe_velocity(rows, joint, wanted, work.free.rates[joint], |joint, numbers| {
                self.system.of_joint(model, &work.placed.bodies, joint, numbers)
            });
        });
    }
}
