//! Random characters, scenes, settings and drives.

use std::fmt;
use std::sync::Arc;

use gaitwright_physics::character::{self, Options, Source};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{
    Accuracy, Coordinates, Effect, Feedforward, FrictionCone, Gains, Ground, Integrator, Scene, SolverChoice,
    SolverKind, StepPlan, Switch, Terrain,
};
use gaitwright_physics::sim::State;
use gaitwright_physics::stance;
use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Greatest number of links; small numbers are as likely as large ones on a scale of logarithms.
const LINKS: f64 = 60.0;

/// Greatest number of links that have a shape: contact with all of sixty would be a test of patience.
const SHAPES: usize = 6;

/// Greatest number of links with which the solver that pivots is tried.
const PIVOTED: usize = 6;

/// What the joints are to follow.
#[derive(Debug, Clone, PartialEq)]
pub struct Targets {
    /// Where each joint swings about, rad or m.
    pub middle: Vec<f64>,
    /// How far each joint swings, rad or m; 0 for targets that stand still.
    pub swing: f64,
}

impl Targets {
    /// Targets at a time.
    pub fn at(&self, time: f64) -> Vec<f64> {
        let phase = |joint: usize| 10.0 * time + joint as f64;
        self.middle.iter().enumerate().map(|(joint, at)| at + self.swing * phase(joint).sin()).collect()
    }
}

/// A case as it was drawn.
#[derive(Debug, Clone)]
pub struct Drawing {
    pub model: Arc<Model>,
    pub scene: Scene,
    pub accuracy: Accuracy,
    pub gains: Option<Gains>,
    pub targets: Targets,
    pub start: State,
}

impl Drawing {
    /// The step plan of the case.
    pub fn plan(&self) -> Arc<StepPlan> {
        let plan = StepPlan::compile(&self.scene, &self.accuracy, self.gains.as_ref(), &self.model);
        Arc::new(plan.unwrap_or_else(|error| panic!("{self}: {error}")))
    }
}

impl fmt::Display for Drawing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Accuracy { step, solver, friction_cone, integrator, coordinates, .. } = self.accuracy;
        write!(
            f,
            "{} bodies, {} contact slots, step {step:e}, {:?}, {friction_cone:?}, {integrator:?}, {coordinates:?}, \
             friction {}, {}",
            self.model.bodies.len(),
            self.model.ground_slots,
            solver.kind,
            self.scene.friction,
            match &self.gains {
                None => "passive".to_owned(),
                Some(gains) => format!(
                    "K {:?}, D {:?}, limit {:?}, {:?}",
                    gains.stiffness.first(),
                    gains.damping.first(),
                    gains.max_torque.first(),
                    gains.feedforward
                ),
            }
        )
    }
}

/// A character in the air, passive.
pub fn flying(rng: &mut ChaCha8Rng) -> Drawing {
    let gravity = if rng.random_bool(0.5) { [0.0; 3] } else { [1.0, -2.0, -9.81] };
    let mut scene = Scene { gravity, ground: None, ..Scene::default() };
    toggle(rng, &mut scene);
    drawing(rng, scene, None)
}

/// A character that starts above the ground, passive.
pub fn falling(rng: &mut ChaCha8Rng) -> Drawing {
    let mut scene = Scene { friction: friction(rng), ..Scene::default() };
    toggle(rng, &mut scene);
    drawing(rng, scene, None)
}

/// A character whose joints are driven, in the air or above the ground.
pub fn driven(rng: &mut ChaCha8Rng) -> Drawing {
    let ground = rng.random_bool(0.5).then(Ground::default);
    let mut scene = Scene { ground, friction: friction(rng), ..Scene::default() };
    toggle(rng, &mut scene);
    let stiffness = decades(rng, 0.0, 6.0);
    let damping = if rng.random_bool(0.2) { 0.0 } else { decades(rng, -2.0, 3.0) };
    let max_torque = rng.random_bool(0.5).then(|| decades(rng, -1.0, 3.0));
    let feedforward = match rng.random_range(0..4) {
        0 => Feedforward::ContactFree,
        1 => Feedforward::ContactAware,
        _ => Feedforward::None,
    };
    let drive = move |joints: usize| Gains {
        stiffness: vec![stiffness; joints],
        damping: vec![damping; joints],
        max_torque: vec![max_torque; joints],
        feedforward,
        ..Gains::default()
    };
    drawing(rng, scene, Some(&drive))
}

/// A character that falls on ground that throws it back. In joint coordinates, since bodies by themselves whip with more energy than they
/// have, with and without rebounds; and by a solver that solves, since a budget of sweeps leaves the work of an impact to chance (see the
/// guide's chapter on limits).
pub fn bouncing(rng: &mut ChaCha8Rng) -> Drawing {
    let restitution = if rng.random_bool(0.2) { 1.0 } else { rng.random_range(0.0..1.0) };
    let mut scene = Scene { friction: friction(rng), restitution, ..Scene::default() };
    toggle(rng, &mut scene);
    let drawing = drawing(rng, scene, None);
    let mut accuracy = Accuracy { coordinates: Coordinates::Reduced, ..drawing.accuracy };
    if accuracy.solver.kind == SolverKind::Pgs {
        accuracy.solver.kind = SolverKind::Newton;
    }
    Drawing { accuracy, ..drawing }
}

/// A character whose actuators have less torque the faster they turn.
pub fn motorised(rng: &mut ChaCha8Rng) -> Drawing {
    let mut drawing = driven(rng);
    let mut model = Model::clone(&drawing.model);
    model.speed =
        (0..model.joint_count()).map(|_| rng.random_bool(0.8).then(|| decades(rng, -1.0, 2.0))).collect();
    drawing.model = Arc::new(model);
    drawing.scene.effects.remove(&Effect::TorqueLimits);
    let torque = decades(rng, -1.0, 2.0);
    drawing.gains.iter_mut().for_each(|gains| gains.max_torque.fill(Some(torque)));
    drawing
}

fn decades(rng: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    10.0_f64.powf(rng.random_range(from..to))
}

fn friction(rng: &mut ChaCha8Rng) -> f64 {
    match rng.random_range(0..4) {
        0 => 0.0,
        1 => 10.0,
        _ => rng.random_range(0.0..1.5),
    }
}

/// Switches some effects off that a scene can do without and stay as physical as it was.
fn toggle(rng: &mut ChaCha8Rng, scene: &mut Scene) {
    for effect in [
        Effect::JointLimits,
        Effect::JointDamping,
        Effect::JointFriction,
        Effect::Friction,
        Effect::TorqueLimits,
    ] {
        if rng.random_bool(0.2) {
            scene.effects.insert(effect, Switch::Off);
        }
    }
    if rng.random_bool(0.1) {
        scene.effects.insert(Effect::TrunkRotationLock, Switch::On);
    }
}

fn drawing(rng: &mut ChaCha8Rng, scene: Scene, drive: Option<&dyn Fn(usize) -> Gains>) -> Drawing {
    let document = character(rng);
    // Links thrown together at random stand in each other.
    let mut scene = scene;
    scene.effects.insert(Effect::SelfCollision, Switch::Off);
    let reading = character::read(document.to_string().as_bytes(), Source::Json, Options::default())
        .unwrap_or_else(|error| panic!("{document}: {error}"));
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::fixed_if(rng.random_bool(0.2))));
    let mut start = State::new(&model);
    let pace = decades(rng, -1.0, 1.0);
    for joint in 0..model.joint_count() {
        let [lower, upper] = model.limits[joint].unwrap_or([-1.0, 1.0]);
        start.angles[joint] = rng.random_range(lower..=upper);
        start.velocities[joint] = pace * rng.random_range(-1.0..1.0);
    }
    if !model.fixed_base {
        start.root.linear_velocity = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        start.root.angular_velocity = Vector3::from_fn(|_, _| pace * rng.random_range(-1.0..1.0));
    }
    let gap = rng.random_range(0.0..0.5);
    start.root.position.z =
        stance::resting_height(&model, &start.angles, &Terrain::Plane { height: 0.0 }) + gap;
    let targets = Targets {
        middle: (0..model.joint_count()).map(|_| rng.random_range(-1.0..1.0)).collect(),
        swing: if rng.random_bool(0.5) { 0.0 } else { rng.random_range(0.0..0.5) },
    };
    let gains = drive.map(|drive| drive(model.joint_count()));
    Drawing { accuracy: accuracy(rng, &model), model, scene, gains, targets, start }
}

/// Settings, of those that the simulator offers.
fn accuracy(rng: &mut ChaCha8Rng, model: &Model) -> Accuracy {
    let step = [1e-5, 1e-4, 5e-4, 2e-3, 2e-3, 8e-3][rng.random_range(0..6)];
    let kinds = [SolverKind::Newton, SolverKind::Pgs, SolverKind::Lemke];
    let most = if model.bodies.len() <= PIVOTED { 3 } else { 2 };
    let kind = kinds[rng.random_range(0..most)];
    let cone = rng.random_bool(0.5) && kind != SolverKind::Lemke;
    let iterations = if kind == SolverKind::Lemke { 10_000 } else { 100 };
    let plain = Accuracy {
        step,
        solver: SolverChoice { kind, iterations, ..SolverChoice::default() },
        friction_cone: if cone { FrictionCone::Cone } else { FrictionCone::Pyramid },
        ..Accuracy::default()
    };
    let fancy = Accuracy {
        integrator: if rng.random_bool(0.3) { Integrator::MoreauJean } else { Integrator::default() },
        coordinates: if rng.random_bool(0.2) { Coordinates::Maximal } else { Coordinates::default() },
        ..plain
    };
    if fancy.faults().is_empty() { fancy } else { plain }
}

/// A tree of links whose masses span up to six decades, and whose inertias are those of their shapes or up
/// to three decades away from them.
fn character(rng: &mut ChaCha8Rng) -> Value {
    let count = LINKS.powf(rng.random_range(0.0..=1.0)).round() as usize;
    let spread = rng.random_range(0.0..3.0);
    let consistent = rng.random_bool(0.5);
    let branching = rng.random_bool(0.5);
    let (mut links, mut joints) = (Vec::new(), Vec::new());
    for index in 0..count {
        links.push(link(rng, index, spread, consistent));
        if index > 0 {
            let parent = if branching { rng.random_range(0..index) } else { index - 1 };
            joints.push(joint(rng, index, parent));
        }
    }
    json!({ "format": "gaitwright/character@1", "name": "drawn", "links": links, "joints": joints })
}

fn link(rng: &mut ChaCha8Rng, index: usize, spread: f64, consistent: bool) -> Value {
    let size = rng.random_range(0.03..0.15);
    let mass = decades(rng, -spread - 1e-9, spread);
    let scale = if consistent { 1.0 } else { decades(rng, -3.0, 3.0) };
    let mut moment = || scale * mass * size * size * rng.random_range(0.3..0.5);
    let (xx, yy, zz) = (moment(), moment(), moment());
    let center = [0, 1, 2].map(|_| size * rng.random_range(-0.3..0.3));
    let shape = match rng.random_range(0..4) {
        0 => json!({ "kind": "sphere", "radius": size }),
        1 => json!({ "kind": "box", "size": [size, 2.0 * size, 1.5 * size] }),
        2 => json!({ "kind": "capsule", "radius": 0.5 * size, "length": size }),
        _ => json!({ "kind": "cylinder", "radius": 0.5 * size, "length": size }),
    };
    let shapes = if index < SHAPES { vec![shape] } else { Vec::new() };
    json!({ "name": format!("link_{index}"), "mass": mass, "center_of_mass": center, "shapes": shapes,
            "inertia": { "xx": xx, "yy": yy, "zz": zz } })
}

fn joint(rng: &mut ChaCha8Rng, index: usize, parent: usize) -> Value {
    let slides = rng.random_bool(0.2);
    let limited = slides || rng.random_bool(0.5);
    let reach = if slides { 0.2 } else { 1.5 };
    let limits = json!({ "lower": -rng.random_range(0.0..reach), "upper": rng.random_range(0.01..reach) });
    let position = [0, 1, 2].map(|_| rng.random_range(-0.2..0.2));
    let turn = [0, 1, 2].map(|_| rng.random_range(-3.0..3.0));
    let axis = [rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0), 1.0];
    let mut rare = |most: f64| if rng.random_bool(0.2) { rng.random_range(0.0..most) } else { 0.0 };
    let (damping, friction, armature) = (rare(0.5), rare(0.5), rare(0.01));
    let kind = match (slides, limited) {
        (true, _) => "prismatic",
        (false, true) => "revolute",
        (false, false) => "continuous",
    };
    let mut joint = json!({
        "name": format!("joint_{index}"), "kind": kind, "parent": format!("link_{parent}"),
        "child": format!("link_{index}"), "origin": { "position": position, "rpy": turn }, "axis": axis,
        "damping": damping, "friction": friction, "armature": armature });
    if limited {
        joint["limits"] = limits;
    }
    joint
}
