//! The rows of a step in maximal coordinates, in their order.

use std::ops::Range;

use super::response;
use super::stages::Stages;
use crate::sim::actuator::ActuatorMode;
use crate::sim::memory::ContactForces;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::rows::joint::Coupling;
use crate::sim::rows::{
    Lanes, Recovery, RowOwner, Rows, contact, drive, dry_friction, joint, limit, lock, loops, torque,
};
use crate::sim::spatial::{SpatialForce, SpatialMotion};
use crate::sim::tracking::Spring;

impl Stages<'_> {
    /// The line and the box of joint `joint`'s actuator, if it has a row: wherever it has a greatest torque.
    fn actuator_row(&self, joint: usize) -> Option<(Spring, [f64; 2])> {
        let (spring, limits) = (self.work.springs[joint], self.plan.actuator_limits(joint));
        match self.work.actuators[joint] {
            ActuatorMode::Line if limits.torque.is_infinite() || spring.is_prescribed() => None,
            ActuatorMode::Line => ActuatorMode::Boxed.row(spring, limits),
            mode => mode.row(spring, limits),
        }
    }

    /// All rows: contacts first, then what has bounds, then the joints from the leaves to the root, an
    /// order in which their factor fills in least.
    pub(super) fn rows(&mut self) {
        let (plan, step) = (self.plan, self.step);
        let mut rows = std::mem::take(&mut self.work.rows);
        rows.clear();
        self.contacts(&mut rows, &self.state.memory.contacts, 0.0);
        let (state, work) = (&*self.state, &*self.work);
        let (memory, rates) = (&state.memory, &work.free_rates);
        let of_joint = |joint: usize, numbers: &mut Vec<Lanes>| self.of_joint(joint, numbers);
        if let Some(limits) = &plan.limits {
            limit::add(
                &mut rows,
                limits,
                &work.near_limit,
                &state.angles,
                rates,
                step,
                |joint| Recovery::of_unilateral(plan).along(self.model.bodies[joint + 1].dof),
                &memory.limit,
                of_joint,
            );
        }
        if let Some(friction) = &plan.dry_friction {
            dry_friction::add(&mut rows, friction, |_| true, rates, &memory.dry_friction, of_joint);
        }
        for (joint, rate) in rates.iter().enumerate() {
            if let Some((line, bounds)) = self.actuator_row(joint) {
                let warm_start = memory.saturated[joint];
                torque::add(&mut rows, joint, line, bounds, *rate, warm_start, of_joint);
            }
        }
        for joint in (0..rates.len()).rev() {
            self.joint(&mut rows, joint);
            let line = self.line(joint);
            if !line.is_prescribed() {
                drive::add(&mut rows, joint, line, rates[joint], of_joint);
            }
        }
        self.lock(&mut rows);
        loops::add(
            &mut rows,
            self.model,
            &work.bodies,
            &work.mean_rates,
            &work.free,
            step,
            plan.has_joint_bias(),
            Recovery::of_loops(plan),
            Some(&self.own.forecast.work.rows),
            |[child, parent], wrench, numbers| self.of_bodies(child, Some(parent), &[wrench], numbers),
        );
        self.work.rows = rows;
    }

    /// Everything along joint `joint` that is linear in its velocity and has no bounds.
    fn line(&self, joint: usize) -> Spring {
        let mut line = drive::rotor(self.model.armature[joint], self.state.velocities[joint], self.step);
        if let Some(damping) = &self.plan.damping {
            line.resistance += damping[joint];
        }
        let spring = self.work.springs[joint];
        if !spring.is_prescribed() && self.actuator_row(joint).is_none() {
            line = line.plus(spring);
        }
        line
    }

    /// Adds the rows of contacts, whose solve starts from `warm_start`; for both see
    /// [`contact::add`].
    pub(super) fn contacts(&self, rows: &mut Rows, warm_start: &ContactForces, compliance: f64) {
        let Self { plan, work, step, .. } = self;
        contact::add(
            rows,
            &work.candidates,
            &work.free,
            plan.friction,
            *step,
            Recovery::of_unilateral(plan),
            warm_start,
            compliance,
            |candidate, forces, numbers| {
                self.of_bodies(candidate.body, candidate.against.body(), forces, numbers)
            },
        );
    }

    /// Adds the rows that hold joint `joint` together.
    pub(super) fn joint(&self, rows: &mut Rows, joint: usize) {
        let coupling = Coupling::of_joint(self.model, &self.work.bodies, joint);
        // The next step may correct the separation of this one at once, at any speed.
        let recovery = if self.plan.stabilization { Recovery::UNBOUNDED } else { Recovery::NONE };
        let (owner, free, step) = (RowOwner::Joint(joint), &self.work.free, self.step);
        joint::add(rows, owner, &coupling, free, SpatialMotion::ZERO, step, recovery, |wrench, numbers| {
            self.of_bodies(coupling.child, Some(coupling.parent), &[wrench], numbers)
        });
    }

    /// Adds the rows that lock the root's rotation, if it is to be locked.
    pub(super) fn lock(&self, rows: &mut Rows) {
        if RootFreedom::new(self.model, self.plan) == RootFreedom::Translating {
            lock::add(rows, self.work.free[0], |wrench, numbers| self.of_bodies(0, None, &[wrench], numbers));
        }
    }

    fn of_bodies(
        &self,
        body: usize,
        other: Option<usize>,
        forces: &[SpatialForce],
        numbers: &mut Vec<Lanes>,
    ) -> Range<usize> {
        response::of_bodies(&self.own.factors, &self.work.bodies, body, other, forces, numbers)
    }

    /// Half-solves a unit of force along joint `joint`.
    pub(super) fn of_joint(&self, joint: usize, numbers: &mut Vec<Lanes>) -> Range<usize> {
        let wrench = response::along(&self.work.bodies[joint + 1]);
        self.of_bodies(joint + 1, Some(self.model.bodies[joint + 1].parent), &[wrench], numbers)
    }
}
