//! The physical world the learner acts in: the one place where learning meets the simulator.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Unit, UnitQuaternion, Vector3};

use super::observer::{Interrupted, Stop};
use super::parameters::{Parameters, Trunk};
use super::task::{STANDARD_GRAVITY, Terms};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Effect, Scene, StepPlan, Switch};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::{Stance, Upright};

/// Roll or pitch from the middle of one trunk cell to the next, rad.
const CELL_TILT: f64 = 0.2;
/// Speed of the pushes that a behaviour has to survive, as a share of √(g h) (Froude number 1).
const PUSH: f64 = 0.03;
/// Steps between two looks at whether to go on: a step of the largest characters takes milliseconds.
const STEPS_UNASKED: u64 = 16;

/// What tracking targets did to the character.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome<S> {
    /// The terms of its reward.
    pub terms: Terms,
    /// s simulated: all that was asked for, or less if the character fell.
    pub seconds: f64,
    /// The physical state after it; `None` if the character fell, or the simulation failed (which
    /// counts as a fall).
    pub after: Option<S>,
}

/// Joint targets as a function of time: writes the angles (rad or m) at a time (s).
pub type Targets<'a> = &'a dyn Fn(f64, &mut [f64]);

/// What the learner needs of a physical world.
pub trait World: Clone + Send + Sync {
    /// Everything the future depends on.
    type State: Clone + Send + Sync;
    /// The character at rest in its standing pose.
    fn standing(&self) -> &Self::State;
    /// The same, slightly disturbed: where a behaviour has to come through as well before it counts.
    fn disturbed(&self) -> &[Self::State];
    /// Goes on from `state`, tracking `targets` over the given steps of the simulation, counted from
    /// time 0 of the targets. The outcome depends on the arguments alone.
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    fn track(
        &mut self,
        state: &Self::State,
        targets: Targets<'_>,
        steps: Range<u64>,
        stop: &Stop,
    ) -> Result<Outcome<Self::State>, Interrupted>;
    /// Number of cells of the trunk's state; 1 for none.
    fn cells(&self) -> usize;
    /// Cell of the trunk in `state`, below [`World::cells`].
    fn cell(&self, state: &Self::State) -> usize;
}

/// A character in the simulator.
#[derive(Debug, Clone)]
pub struct SimulatedWorld {
    simulator: Simulator,
    standing: Arc<State>,
    disturbed: Arc<[State]>,
    /// World's vertical in the root's frame when standing.
    up: Unit<Vector3<f64>>,
    upright: Upright,
    /// Levels of roll and of pitch.
    cell_levels: u8,
    now: Vec<f64>,
    next: Vec<f64>,
}

impl SimulatedWorld {
    /// `model` in `scene`, driven with the stance's gains, its trunk locked if the parameters say so.
    ///
    /// # Errors
    /// Every fault of scene and accuracy ([`StepPlan::compile`]).
    pub fn new(
        model: &Arc<Model>,
        stance: &Stance,
        scene: &Scene,
        accuracy: &Accuracy,
        parameters: &Parameters,
    ) -> Result<Self, InputError> {
        let mut scene = scene.clone();
        if parameters.learning.trunk == Trunk::Locked {
            scene.effects.insert(Effect::TrunkRotationLock, Switch::On);
        }
        let plan = StepPlan::compile(&scene, accuracy, Some(&stance.gains), model)?;
        Ok(Self {
            upright: Upright::new(model, stance, &scene),
            simulator: Simulator::new(Arc::new(plan), stance.state.clone()),
            up: Unit::new_normalize(stance.state.root.orientation.inverse() * Vector3::z()),
            standing: Arc::new(stance.state.clone()),
            disturbed: pushes(model, stance).into(),
            cell_levels: parameters.learning.trunk_cells,
            now: vec![0.0; model.joint_count()],
            next: vec![0.0; model.joint_count()],
        })
    }

    /// ∫ Σ |τ q̇| dt of the last step, J.
    fn work(&self) -> f64 {
        let powers = self.simulator.torques().iter().zip(&self.simulator.state().velocities);
        powers.map(|(torque, velocity)| (torque * velocity).abs()).sum::<f64>() * self.simulator.plan().step()
    }

    /// Mean distance slid by the contacts that touch in the last step, m.
    fn slip(&self) -> f64 {
        let (mut speed, mut count) = (0.0, 0.0);
        for contact in self.simulator.contacts() {
            speed += (contact.velocity - contact.normal * contact.normal.dot(&contact.velocity)).norm();
            count += 1.0;
        }
        if count > 0.0 { speed / count * self.simulator.plan().step() } else { 0.0 }
    }
}

impl World for SimulatedWorld {
    type State = State;

    fn standing(&self) -> &State {
        &self.standing
    }

    fn disturbed(&self) -> &[State] {
        &self.disturbed
    }

    fn track(
        &mut self,
        state: &State,
        targets: Targets<'_>,
        steps: Range<u64>,
        stop: &Stop,
    ) -> Result<Outcome<State>, Interrupted> {
        self.simulator.set_state(state);
        let step = self.simulator.plan().step();
        let start = self.simulator.center_of_mass();
        let mut terms = Terms::default();
        let mut upright = true;
        let mut done = steps.start;
        targets(done as f64 * step, &mut self.next);
        while upright && done < steps.end {
            if done.is_multiple_of(STEPS_UNASKED) {
                stop.check()?;
            }
            done += 1;
            std::mem::swap(&mut self.now, &mut self.next);
            targets(done as f64 * step, &mut self.next);
            let before = self.simulator.state().root.orientation;
            upright = self.simulator.step(Command::Track { now: &self.now, next: &self.next }).is_ok();
            if upright {
                terms.turn += heading_change(&before, &self.simulator.state().root.orientation);
                terms.work += self.work();
                terms.slip += self.slip();
                upright = self.upright.holds(self.simulator.state());
            }
        }
        let travel = self.simulator.center_of_mass() - start;
        // After a failed step the position may not be a number.
        if travel.iter().all(|d| d.is_finite()) {
            terms.displacement = [travel.x, travel.y];
        }
        let after = upright.then(|| self.simulator.state().clone());
        Ok(Outcome { terms, seconds: (done - steps.start) as f64 * step, after })
    }

    fn cells(&self) -> usize {
        usize::from(self.cell_levels).pow(2)
    }

    fn cell(&self, state: &State) -> usize {
        // The standing vertical as the root carries it, seen along the root's present heading.
        let up = state.root.orientation * self.up;
        let heading = heading(&state.root.orientation);
        let (sin, cos) = heading.sin_cos();
        let pitch = (up.x * cos + up.y * sin).atan2(up.z);
        let roll = (up.y * cos - up.x * sin).atan2(up.z);
        let half = f64::from(self.cell_levels / 2);
        let level = |tilt: f64| ((tilt / CELL_TILT).round().clamp(-half, half) + half) as usize;
        level(roll) * usize::from(self.cell_levels) + level(pitch)
    }
}

/// The standing state with the root pushed back a little and to one side, once each; none for a root
/// that is bolted to the world.
fn pushes(model: &Model, stance: &Stance) -> Vec<State> {
    if model.fixed_base {
        return Vec::new();
    }
    let speed = PUSH * (STANDARD_GRAVITY * stance.root_height.max(0.01)).sqrt();
    let pushed = [-1.0, 1.0].map(|side| {
        let mut state = stance.state.clone();
        state.root.linear_velocity += Vector3::new(-speed, side * speed, 0.0);
        state
    });
    pushed.to_vec()
}

/// Heading of the root's x axis, rad, counter-clockwise from the world's x axis seen from above.
fn heading(orientation: &UnitQuaternion<f64>) -> f64 {
    let forward = orientation * Vector3::x();
    forward.y.atan2(forward.x)
}

/// Rotation about the vertical between two orientations a step apart, rad.
fn heading_change(before: &UnitQuaternion<f64>, after: &UnitQuaternion<f64>) -> f64 {
    let change = after * before.inverse();
    // The quaternion and its negative are the same rotation; this takes the short one.
    2.0 * (change.k * change.w.signum()).atan2(change.w.abs())
}
