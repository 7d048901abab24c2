//! Verifies a pose: holds it in the simulator until it is at rest.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::anatomy::Posed;
use super::standing::Stance;
use crate::model::Model;
use crate::scene::{Accuracy, Effect, Gains, STANDARD_GRAVITY, Scene, StepPlan, Switch, Terrain, usual_step};
use crate::sim::contact::ground::{CORNERS_KEPT_WHOLE, SurfacePoint};
use crate::sim::{Command, Simulator, State};

/// For how many of the character's usual steps a pose is held on Earth: 3 s of a dog. Under another gravity everything takes longer or
/// shorter by the root of what it is to ours.
const STEPS: f64 = 1500.0;
/// Where gravity is next to nothing, a pose is held for so many times as long as on Earth at most.
const LONGEST: f64 = 20.0;

/// Bound on the cost of verifying, as the sum over all substeps of the cube of their number of rows; a pose that exceeds it
/// counts as not stable. About ten seconds of computing: a quadruped takes a thousandth of it, a chain of hundreds of
/// boxes that lie on the ground would take hours.
const WORK: f64 = 2e10;

/// The least that a substep counts: its kinematics and the rest take as long as the solver takes for some thirty rows.
const LEAST_WORK: f64 = 3e4;

/// The first step may cost as much as so many others: no forces are known to begin with, and the solver may have to try every method
/// that it has.
const FIRST_STEP: f64 = 10.0;

/// A pose that leaves more steps unsolved than this, as of a body that stands in an obstacle, counts as not stable: each of them tries
/// every method that the solver has.
const MOST_UNSOLVED: u64 = 20;

/// How many times as stiff the springs may be that hold a pose, the softest first: where weight bends the joints between small feet
/// and a high trunk, soft ones let the centre of mass wander beyond the feet.
const STIFFER: [f64; 3] = [1.0, 2.0, 4.0];

/// A surface point no farther from the ground than this touches it, in sizes of the character ([`Model::size`]).
const TOUCHING: f64 = 0.01;

/// Greatest tilt of the root against its first orientation, rad, of a character that stands.
const GREATEST_TILT: f64 = 0.35;
/// How far a character that stands may sink at most, as a share of its height: the mean of what its root and its centre of mass (above
/// its lowest point) do.
const GREATEST_SINKING: f64 = 0.175;

/// A standing character moves no faster than this many heights of its centre of mass in a usual step at the end, on Earth.
const REST: f64 = 1e-4;

/// Holds `angles` with `gains` in `scene` and reports how the character stands. If `stop` returns true before it is at
/// rest, it counts as not stable.
pub fn verify(
    model: &Arc<Model>,
    scene: &Scene,
    angles: Vec<f64>,
    given: bool,
    gains: Gains,
    stop: &dyn Fn() -> bool,
) -> Stance {
    let posed = Posed::new(model, &angles);
    let ground = scene.ground.as_ref().map(Terrain::new);
    let mut state = State::new(model);
    state.angles.copy_from_slice(&angles);
    let mut stance =
        Stance { state, angles, root_height: 0.0, support: Vec::new(), stable: false, given, gains };
    let (Some(ground), false) = (ground, model.fixed_base || posed.surface.is_empty()) else {
        stance.stable = model.fixed_base;
        return stance;
    };
    let height = posed.resting_height(&ground);
    stance.state.root.position.z = height;
    let touches = |point: &&SurfacePoint| {
        height + point.at.z - ground.height(point.at.x, point.at.y) < TOUCHING * model.size
    };
    let mut touching = vec![0; model.ground_shapes.len()];
    posed.surface.iter().filter(touches).for_each(|point| touching[point.shape] += 1);
    let rows = 3 * touching.into_iter().map(|points: usize| points.min(CORNERS_KEPT_WHOLE)).sum::<usize>();
    let springs = stance.gains.clone();
    let affordable = FIRST_STEP * work_of(rows) <= WORK;
    for stiffer in STIFFER.into_iter().filter(|_| affordable) {
        stance.gains = springs.clone();
        stance.gains.stiffness.iter_mut().for_each(|stiffness| *stiffness *= stiffer);
        stance.gains.damping.iter_mut().for_each(|damping| *damping *= stiffer.sqrt());
        match hold(model, scene, &stance, stop) {
            Some(Held::Standing(settled)) => {
                (stance.state, stance.stable) = (*settled, true);
                break;
            }
            Some(Held::Fallen) => {}
            None => break,
        }
    }
    if !stance.stable {
        stance.gains = springs;
    }
    let root = stance.state.root.position;
    stance.root_height = root.z - ground.height(root.x, root.y);
    stance.support = support(model, &stance.state, &ground);
    stance
}

/// How much a substep of `rows` rows adds to [`WORK`].
fn work_of(rows: usize) -> f64 {
    (rows as f64).powi(3).max(LEAST_WORK)
}

/// What came of holding a pose.
enum Held {
    /// The state at rest.
    Standing(Box<State>),
    /// It fell, or did not come to rest.
    Fallen,
}

/// Holds the pose of `stance`; `None` where that cannot be simulated, exceeds [`WORK`] or [`MOST_UNSOLVED`], or `stop`
/// returns true.
fn hold(model: &Arc<Model>, scene: &Scene, stance: &Stance, stop: &dyn Fn() -> bool) -> Option<Held> {
    let mut scene = scene.clone();
    scene.effects.insert(Effect::TrunkRotationLock, Switch::Off);
    let accuracy = Accuracy { step: usual_step(model.size), ..Accuracy::default() };
    let plan = StepPlan::compile(&scene, &accuracy, Some(&stance.gains), model).ok()?;
    let mut simulator = Simulator::new(Arc::new(plan), stance.state.clone());
    let targets = Command::Track { now: &stance.angles, next: &stance.angles };
    let gravity = scene.acting_gravity().norm();
    let slower = if gravity > 0.0 { (STANDARD_GRAVITY / gravity).sqrt().min(LONGEST) } else { 1.0 };
    let mut work = 0.0;
    for _ in 0..(STEPS * slower).ceil() as usize {
        if stop() {
            return None;
        }
        let before = simulator.substeps();
        simulator.step(targets).ok()?;
        work += (simulator.substeps() - before) as f64 * work_of(simulator.rows().len());
        if work > WORK || simulator.record().unsolved_steps > MOST_UNSOLVED {
            return None;
        }
    }
    let mut state = simulator.state().clone();
    let height = posed_height(model, &stance.state);
    // Whoever has turned about the vertical has not tipped.
    let vertical = |state: &State| state.root.orientation.inverse_transform_vector(&Vector3::z());
    let tilt = vertical(&state).angle(&vertical(&stance.state));
    let at = state.root.position;
    let ground = scene.ground.as_ref().map(Terrain::new);
    let rise = ground.map_or(0.0, |ground| ground.height(at.x, at.y) - ground.height(0.0, 0.0));
    let root_sunk = stance.state.root.position.z - (at.z - rise);
    let sunk = 0.5 * (height - posed_height(model, &state) + root_sunk);
    let moving = state.root.linear_velocity.norm() + height * state.root.angular_velocity.norm();
    let rests = moving * slower * accuracy.step < REST * height;
    let stands = tilt < GREATEST_TILT && sunk < GREATEST_SINKING * height && rests;
    state.time = 0.0;
    state.root.position = Point3::new(0.0, 0.0, at.z - rise);
    state.root.linear_velocity.fill(0.0);
    state.root.angular_velocity.fill(0.0);
    state.velocities.fill(0.0);
    Some(if stands { Held::Standing(Box::new(state)) } else { Held::Fallen })
}

/// Height of the centre of mass above the lowest point, m.
fn posed_height(model: &Model, state: &State) -> f64 {
    let posed = Posed::of(model, state);
    posed.center_of_mass.z - posed.lowest()
}

/// Of every body within a fiftieth of the character's height of the ground, the link that is lowest.
fn support(model: &Model, state: &State, ground: &Terrain) -> Vec<usize> {
    let posed = Posed::of(model, state);
    let root = state.root.position;
    let below = |at: Vector3<f64>| ground.height(root.x + at.x, root.y + at.y) - root.z;
    let near = 0.02 * (posed.center_of_mass.z - below(posed.center_of_mass)).abs();
    let lowest = |body: usize| {
        let points = posed.surface.iter().filter(move |point| point.body == body);
        let close = points.filter(|point| point.at.z < below(point.at) + near);
        close.min_by(|a, b| a.at.z.total_cmp(&b.at.z)).map(|point| point.link)
    };
    let mut links: Vec<usize> = (0..model.bodies.len()).filter_map(lowest).collect();
    links.sort_unstable();
    links
}
