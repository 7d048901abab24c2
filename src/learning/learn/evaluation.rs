//! The physical world in which behaviours are tried: the one place where learning uses the simulator.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Rotation3, Unit, UnitQuaternion, Vector3};

use super::objective::{Terms, reference_gravity};
use super::parameters::Parameters;
use super::stop::{Interrupted, Stop};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{DofKind, Model};
use gaitwright_physics::motion::ahead;
use gaitwright_physics::scene::{Accuracy, Scene, StepPlan};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::{Stance, Upright};

/// Width of a cell of the trunk's roll or pitch, rad.
const CELL_TILT: f64 = 0.2;
/// Each of the two components, along and across, of the speed of the pushes of [`World::disturbed`], as a share of √(g h) (the speed at
/// Froude number 1).
const PUSH: f64 = 0.03;
/// Number of steps between two checks whether to stop: a step of the largest characters takes milliseconds.
const STEPS_BETWEEN_CHECKS: u64 = 16;

/// The result of tracking targets for a while.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackingOutcome<S> {
    /// The terms of the reward, summed over the steps.
    pub terms: Terms,
    /// Simulated time, s: all that was asked for, or less if the character fell.
    pub seconds: f64,
    /// Heading at the start against the standing pose's, rad, counter-clockwise seen from above.
    pub heading: f64,
    /// The physical state at the end; `None` if the character fell, or the simulation failed, which counts as a fall.
    pub after: Option<S>,
}

/// Joint targets as a function of time: writes the angles (rad or m) at a time (s).
pub type Targets<'a> = &'a dyn Fn(f64, &mut [f64]);

/// What the learner needs of a physical world.
pub trait World: Clone + Send + Sync {
    /// The physical state, on which everything after it depends.
    type State: Clone + Send + Sync;
    /// The character at rest in its standing pose.
    fn standing(&self) -> &Self::State;
    /// The same, slightly disturbed: starts from which a behaviour must stay upright, too, to pass the check.
    fn disturbed(&self) -> &[Self::State];
    /// Simulates from `state`, tracking `targets` over `steps`, numbered from time 0 of the targets. The outcome
    /// depends on the arguments alone.
    ///
    /// # Errors
    /// The reason of `stop` to break off.
    fn track(
        &mut self,
        state: &Self::State,
        targets: Targets<'_>,
        steps: Range<u64>,
        stop: &Stop,
    ) -> Result<TrackingOutcome<Self::State>, Interrupted>;
    /// The mirror image of `state`. Worlds whose grid has no symmetry are never asked.
    fn mirrored(&self, state: &Self::State) -> Self::State;
    /// Number of cells into which the trunk's roll and pitch are divided; 1 if they are not.
    fn cells(&self) -> usize;
    /// Cell of the trunk in `state`, below [`World::cells`].
    fn cell(&self, state: &Self::State) -> usize;
}

/// The plane that mirrors a character's world.
#[derive(Debug, Clone)]
struct Mirror {
    /// Unit normal in the world frame, and in the root's.
    normal: [Vector3<f64>; 2],
    /// Where each joint takes its angle from, and with which sign.
    sources: Arc<[(usize, i8)]>,
}

impl Mirror {
    /// The vertical plane along `direction`, for a root that stands as in `stance`.
    fn new(direction: [f64; 3], stance: &Stance, sources: &[(usize, i8)]) -> Self {
        let left = Vector3::z().cross(&ahead(direction));
        let own = stance.state.root.orientation.inverse() * left;
        Self { normal: [left, own], sources: sources.into() }
    }

    /// The image of `state` against that of `standing`, which is its own.
    fn image(&self, state: &State, standing: &State) -> State {
        let across =
            |normal: &Vector3<f64>, vector: Vector3<f64>| vector - normal * (2.0 * normal.dot(&vector));
        let reflection = |normal: &Vector3<f64>| Matrix3::identity() - normal * normal.transpose() * 2.0;
        let [world, own] = &self.normal;
        let mut image = state.clone();
        image.root.position = Point3::from(across(world, state.root.position.coords));
        image.root.linear_velocity = across(world, state.root.linear_velocity);
        // What turns is a pseudovector.
        image.root.angular_velocity = -across(world, state.root.angular_velocity);
        let turned =
            reflection(world) * state.root.orientation.to_rotation_matrix().matrix() * reflection(own);
        image.root.orientation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turned));
        for (joint, &(from, sign)) in self.sources.iter().enumerate() {
            let sign = f64::from(sign);
            image.angles[joint] =
                standing.angles[joint] + sign * (state.angles[from] - standing.angles[from]);
            image.velocities[joint] = sign * state.velocities[from];
        }
        image.forget();
        image
    }
}

/// A character in the simulator.
#[derive(Debug, Clone)]
pub struct SimulatedWorld {
    simulator: Simulator,
    standing: Arc<State>,
    disturbed: Arc<[State]>,
    /// The world's vertical in the root's frame in the standing pose.
    up: Unit<Vector3<f64>>,
    upright: Upright,
    /// Number of levels of roll, and of pitch; odd.
    cell_levels: u8,
    mirror: Option<Mirror>,
    /// m g, N.
    weight: f64,
    /// What a torque of each joint counts by: 1 / (m g h), or 1 / (m g) where it slides.
    torque_shares: Arc<[f64]>,
    /// Force on each link in the last step, N, and torques of the step before it.
    loads: Vec<f64>,
    torques: Vec<f64>,
    /// Targets at the beginning and at the end of a step, rad or m, one a joint.
    now: Vec<f64>,
    next: Vec<f64>,
}

impl SimulatedWorld {
    /// `model` in a scene at an accuracy, driven with the stance's gains, to go along a direction of which the vertical
    /// plane mirrors it; `mirror` says where each joint takes its angle from in the mirror, and with which sign.
    ///
    /// # Errors
    /// Every fault of scene and accuracy ([`StepPlan::compile`]).
    pub fn new(
        model: &Arc<Model>,
        stance: &Stance,
        (scene, accuracy, direction): (&Scene, &Accuracy, [f64; 3]),
        mirror: Option<&[(usize, i8)]>,
        parameters: &Parameters,
    ) -> Result<Self, InputError> {
        let plan = StepPlan::compile(scene, accuracy, Some(&stance.gains), model)?;
        let weight = model.mass * reference_gravity(scene);
        let torque_share = |joint: usize| match model.bodies[joint + 1].dof {
            DofKind::Revolute => 1.0 / (weight * model.height_scale(stance.root_height)),
            DofKind::Prismatic => 1.0 / weight,
        };
        Ok(Self {
            upright: Upright::new(model, stance, scene),
            simulator: Simulator::new(Arc::new(plan), stance.state.clone()),
            up: Unit::new_normalize(stance.state.root.orientation.inverse() * Vector3::z()),
            standing: Arc::new(stance.state.clone()),
            disturbed: pushes(model, stance, reference_gravity(scene), direction).into(),
            cell_levels: parameters.trunk_cells,
            mirror: mirror.map(|sources| Mirror::new(direction, stance, sources)),
            weight,
            torque_shares: (0..model.joint_count()).map(torque_share).collect(),
            loads: vec![0.0; model.links.len()],
            torques: vec![0.0; model.joint_count()],
            now: vec![0.0; model.joint_count()],
            next: vec![0.0; model.joint_count()],
        })
    }

    /// ∫ Σ |τ q̇| dt of the last step, J.
    fn work(&self) -> f64 {
        let powers = self.simulator.torques().iter().zip(&self.simulator.state().velocities);
        powers.map(|(torque, velocity)| (torque * velocity).abs()).sum::<f64>() * self.simulator.plan().step()
    }

    /// By how much the links carried more than the weight in the last step, times its length, s.
    fn impact(&mut self) -> f64 {
        self.loads.fill(0.0);
        for contact in self.simulator.contacts() {
            self.loads[contact.link] += contact.normal.dot(&contact.force);
        }
        let beyond = self.loads.iter().map(|load| (load / self.weight - 1.0).max(0.0));
        beyond.sum::<f64>() * self.simulator.plan().step()
    }

    /// By how much the torques of the last step differ from the ones before ([`Terms::torque_variation`]), which they take the place of.
    fn torque_variation(&mut self) -> f64 {
        let changes = self.simulator.torques().iter().zip(&mut self.torques).zip(&*self.torque_shares);
        let change = |((now, before), share): ((&f64, &mut f64), &f64)| {
            let change = (now - *before).abs() * share;
            *before = *now;
            change
        };
        changes.map(change).sum()
    }

    /// Mean distance by which the contacts of the last step slid, m.
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
    ) -> Result<TrackingOutcome<State>, Interrupted> {
        self.simulator.set_state(state);
        let step = self.simulator.plan().step();
        let start = self.simulator.center_of_mass();
        let mut terms = Terms::default();
        let mut upright = true;
        let mut done = steps.start;
        targets(done as f64 * step, &mut self.next);
        while upright && done < steps.end {
            if done.is_multiple_of(STEPS_BETWEEN_CHECKS) {
                stop.check()?;
            }
            done += 1;
            std::mem::swap(&mut self.now, &mut self.next);
            targets(done as f64 * step, &mut self.next);
            let before = self.simulator.state().root.orientation;
            upright = self.simulator.step(Command::Track { now: &self.now, next: &self.next }).is_ok();
            if upright {
                let turned = self.simulator.state().root.orientation * before.inverse();
                terms.turn += heading_change(&turned);
                terms.sway += tilt_change(&turned);
                terms.work += self.work();
                terms.slip += self.slip();
                terms.impact += self.impact();
                let variation = self.torque_variation();
                // Of the first step it is not known what the torques were before.
                if done > steps.start + 1 {
                    terms.torque_variation += variation;
                }
                upright = self.upright.holds(self.simulator.state());
            }
        }
        let travel = self.simulator.center_of_mass() - start;
        // After a failed step the position may not be finite.
        if travel.iter().all(|d| d.is_finite()) {
            terms.displacement = [travel.x, travel.y];
        }
        let after = upright.then(|| self.simulator.state().clone());
        let heading = heading(&state.root.orientation) - heading(&self.standing.root.orientation);
        Ok(TrackingOutcome { terms, seconds: (done - steps.start) as f64 * step, heading, after })
    }

    fn mirrored(&self, state: &State) -> State {
        self.mirror.as_ref().map_or_else(|| state.clone(), |mirror| mirror.image(state, &self.standing))
    }

    fn cells(&self) -> usize {
        usize::from(self.cell_levels).pow(2)
    }

    fn cell(&self, state: &State) -> usize {
        // The root-fixed vertical of the standing pose, in axes along and across the present heading.
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

/// The standing state with the root given a small velocity backward and to the left of `direction`, and the same to the right; none
/// for a root that is fixed to the world.
fn pushes(model: &Model, stance: &Stance, gravity: f64, direction: [f64; 3]) -> Vec<State> {
    if model.fixed_base {
        return Vec::new();
    }
    let speed = PUSH * (gravity * model.height_scale(stance.root_height)).sqrt();
    let ahead = ahead(direction);
    let left = Vector3::z().cross(&ahead);
    let pushed = [-1.0, 1.0].map(|side| {
        let mut state = stance.state.clone();
        state.root.linear_velocity += (left * side - ahead) * speed;
        state
    });
    pushed.to_vec()
}

/// Heading of the root's x axis, rad, counter-clockwise from the world's x axis seen from above.
fn heading(orientation: &UnitQuaternion<f64>) -> f64 {
    let forward = orientation * Vector3::x();
    forward.y.atan2(forward.x)
}

/// The part about the vertical of how a root turned in one step, rad.
fn heading_change(change: &UnitQuaternion<f64>) -> f64 {
    // The quaternion and its negative are the same rotation; this takes the shorter of the two.
    2.0 * (change.k * change.w.signum()).atan2(change.w.abs())
}

/// The part about horizontal axes of how a root turned in one step, rad.
fn tilt_change(change: &UnitQuaternion<f64>) -> f64 {
    2.0 * change.i.hypot(change.j).atan2(change.w.abs())
}
