//! Which velocities the forces of velocity are taken at: the mean of old and new ones, which they help to make.

use super::Stages;
use crate::sim::reduced::kinematics::move_along;
use crate::sim::spatial::{Force, Motion};
use crate::sim::{Command, Failure};

/// Forces of velocity are settled when another pass would move no body farther than this in the step,
/// rad or m.
const SETTLED: f64 = 1e-6;

/// The same in the middle of a step, whose own error is smaller.
const SETTLED_IN_THE_MIDDLE: f64 = 1e-9;

/// Greatest number of passes until then. Each has to halve what is left, or the step is too long.
const MOST_PASSES: usize = 20;

/// New velocities as far as they are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ahead {
    /// As if no row acted.
    Free,
    /// With all rows.
    Rows,
}

/// Passes over the forces of velocity, which depend on the new velocities that they help to make.
#[derive(Debug)]
struct Passes {
    count: usize,
    /// Change that the last pass brought, rad or m a step.
    last: f64,
    /// Change that is next to nothing.
    settled: f64,
}

/// What a pass leaves to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Left {
    Nothing,
    Something,
    /// The passes do not approach anything.
    Everything,
}

impl Passes {
    pub(super) fn until(settled: f64) -> Self {
        Self { count: 0, last: f64::INFINITY, settled }
    }

    /// What is left after a pass that brought `change`, where a body turns by `turn` (rad) in the step, which is
    /// about the share of a change that the next pass brings.
    pub(super) fn left(&mut self, change: f64, turn: f64) -> Left {
        let share = turn.max(change / self.last);
        self.count += 1;
        self.last = change;
        if change * share <= self.settled {
            Left::Nothing
        } else if share <= 0.5 && self.count < MOST_PASSES {
            Left::Something
        } else {
            Left::Everything
        }
    }
}

impl Stages<'_> {
    /// The paper's step takes forces of velocity at the mean of the old velocities and those to be expected if every
    /// row acts as in the last step: at the old ones alone they would feed every rotation by half the square
    /// of its turn in a step. Whether they settled.
    pub(super) fn expected_mean(&mut self) -> Result<bool, Failure> {
        if !self.plan.velocity_forces {
            return Ok(true);
        }
        self.expectation();
        let mut passes = Passes::until(SETTLED);
        loop {
            self.free_velocities(true);
            let change = self.mean_motion(Ahead::Free);
            match passes.left(change, self.turn) {
                Left::Nothing => return Ok(true),
                Left::Something => {}
                Left::Everything => return Ok(false),
            }
        }
    }

    /// The forces of the last step's rows, where they would act now.
    fn expectation(&mut self) {
        let Self { model, state, work, .. } = self;
        let memory = &state.memory;
        work.expected.bodies.fill(Force::ZERO);
        for touch in &work.touches {
            let force = Force::at(touch.at, touch.force(&memory.contact[touch.slot]));
            let bodies = &mut work.expected.bodies;
            bodies[touch.body] = bodies[touch.body].plus(force);
            if let Some(other) = touch.against.body() {
                bodies[other] = bodies[other].plus(force.scaled(-1.0));
            }
        }
        for (closing, force) in model.loops.iter().zip(&memory.loops) {
            let [parent, child] = closing.bodies;
            let bodies = &mut work.expected.bodies;
            bodies[child] = bodies[child].plus(*force);
            bodies[parent] = bodies[parent].plus(force.scaled(-1.0));
        }
        for (joint, push) in work.expected.joints.iter_mut().enumerate() {
            let torque = if work.saturated[joint] { memory.saturated[joint] } else { 0.0 };
            *push = memory.limit[joint] + memory.dry_friction[joint] + torque;
        }
    }

    /// In the middle of a step, repeats all with the forces of velocity of the mean of old and new velocities;
    /// whether they settled.
    pub(super) fn mean_velocities(&mut self, command: Command<'_>) -> Result<bool, Failure> {
        if !(self.middle && self.plan.velocity_forces) {
            return Ok(true);
        }
        let mut passes = Passes::until(SETTLED_IN_THE_MIDDLE);
        loop {
            let change = self.mean_motion(Ahead::Rows);
            self.drives(command)?;
            self.velocities()?;
            match passes.left(change, self.turn) {
                Left::Nothing => return Ok(true),
                Left::Something => {}
                Left::Everything => return Ok(false),
            }
        }
    }

    /// Lets the bodies move with the mean of old and new velocities, as far as forces of velocity see
    /// them, and gives how much farther that moves one of them in the step, rad or m, than before.
    fn mean_motion(&mut self, ahead: Ahead) -> f64 {
        let Self { model, state, work, step, .. } = self;
        let root = &state.root;
        let old = Motion { angular: root.angular_velocity, linear: root.linear_velocity };
        let (new, new_rates) = match ahead {
            Ahead::Free => (work.free[0], &work.free_rates),
            Ahead::Rows => (work.free[0].plus(work.changes[0]), &work.joint_rates),
        };
        let mean = if model.fixed_base { Motion::ZERO } else { old.plus(new).scaled(0.5) };
        let before = work.bodies[0].velocity;
        let mut change = (mean.angular - before.angular).amax().max((mean.linear - before.linear).amax());
        for joint in 0..work.mean_rates.len() {
            let mean = 0.5 * (state.velocities[joint] + new_rates[joint]);
            change = change.max((mean - work.mean_rates[joint]).abs());
            work.mean_rates[joint] = mean;
        }
        move_along(model, mean, &work.mean_rates, &mut work.bodies);
        work.articulated.prepare(model, &work.bodies, &work.mean_rates, true);
        change * *step
    }
}
