//! Contact: deep starts, drops, redundant points, rods that jam, ice and rubber, and rest.

use serde_json::{Value, json};

use super::case::Case;
use super::quantity::Quantity;
use super::sketch::{GRAVITY, LONGEST, block, body, character, resting, scenario, turning, with};
use crate::scenario::Scenario;
use gaitwright_physics::motion::RootMotion;
use gaitwright_physics::scene::Scene;

/// Edge of the block, m, and its mass, kg.
const EDGE: f64 = 0.2;
const MASS: f64 = 2.0;

/// Greatest penetration, m: a contact may be approached but not crossed.
const PENETRATION: f64 = 1e-4;

/// Share of a resting weight by which the contact forces may differ from it: the solver's tolerance is a velocity, and
/// over a step of 1e-5 s a velocity of 1e-9 m/s is a force of 1e-5 of the weight at every contact.
const WEIGHT_ERROR: f64 = 1e-3;

/// Greatest speed of a block whose penetration is corrected, m/s: the correction leaves no velocity, so it has what it gains in a
/// step without contact.
const RECOVERING: f64 = GRAVITY * LONGEST;

/// The cases of contact.
pub fn cases() -> Vec<Case> {
    vec![
        deep_start(),
        dropped_block("drop-tilted", "a tilted block dropped from 1 m comes to rest"),
        rest("redundant-4-points", "a block rests on its four corners", block("block", MASS, [EDGE; 3])),
        rest("redundant-100-points", "a plate rests on 100 balls", plate()),
        rest("rows-twice", "a block with every corner twice rests", doubled()),
        on_a_slope(),
        painleve(),
        ice(),
        rubber(),
    ]
}

/// A block in `scene`, its root as given.
fn one(link: Value, scene: Scene, root: RootMotion) -> Scenario {
    let mut scenario = scenario(character("block", &[link], &[]), scene);
    scenario.start.root = Some(root);
    scenario
}

fn deep_start() -> Case {
    let root = resting([0.0, 0.0, -0.05]);
    let scenario = one(block("block", MASS, [EDGE; 3]), Scene::default(), root);
    Case::new("deep-start", "a block that starts three quarters in the ground rises and rests", scenario)
        .at_most(RECOVERING, Quantity::RootSpeed { after: 0.0 })
        // A block that leaves the ground at this speed rises by v²/2g.
        .at_most(RECOVERING * RECOVERING / (2.0 * GRAVITY), Quantity::Rise { over: 0.5 * EDGE })
        .at_most(1e-3, Quantity::FinalPosition { wanted: [0.0, 0.0, 0.5 * EDGE] })
        .at_most(1e-6, Quantity::RootSpeed { after: 5.0 })
}

/// A block that falls 1 m on one of its corners, and is at rest on a face after five seconds.
pub fn dropped_block(name: &str, about: &str) -> Case {
    let root =
        RootMotion { orientation: [0.8, 0.36, 0.48, 0.0], ..turning([0.0, 0.0, 1.0], [1.0, -2.0, 0.5]) };
    let scenario = one(block("block", MASS, [EDGE; 3]), Scene::default(), root);
    let available = MASS * GRAVITY * (1.0 - 0.5 * EDGE);
    Case::new(name, about, scenario)
        .at_most(0.01 * available, Quantity::EnergyGain)
        .at_most(PENETRATION, Quantity::Penetration)
        .at_most(1e-6, Quantity::Creep { after: 5.0 })
        .at_most(1e-6, Quantity::RootSpeed { after: 5.0 })
        .at_most(WEIGHT_ERROR * MASS * GRAVITY, Quantity::FinalWeight { wanted: MASS * GRAVITY })
}

/// `link` on level ground: nothing moves.
fn rest(name: &str, about: &str, link: Value) -> Case {
    let scenario = one(link, Scene::default(), resting([0.0, 0.0, 0.5 * EDGE]));
    Case::new(name, about, scenario)
        .at_most(PENETRATION, Quantity::Penetration)
        // Ten times the solver's tolerance.
        .at_most(1e-8, Quantity::RootSpeed { after: 0.0 })
        .at_most(1e-7, Quantity::Creep { after: 0.0 })
        .at_most(WEIGHT_ERROR * MASS * GRAVITY, Quantity::FinalWeight { wanted: MASS * GRAVITY })
}

/// A square plate on ten by ten balls.
fn plate() -> Value {
    let (count, pitch, radius) = (10, 0.02, 0.01);
    let ball = |index: usize| {
        let place = |at: usize| pitch * (at as f64 - 0.5 * (count as f64 - 1.0));
        let position = [place(index % count), place(index / count), radius - 0.5 * EDGE];
        json!({ "kind": "sphere", "radius": radius, "pose": { "position": position } })
    };
    let balls: Vec<Value> = (0..count * count).map(ball).collect();
    with(block("plate", MASS, [EDGE; 3]), &json!({ "shapes": balls }))
}

/// A block with two identical shapes at the same place.
fn doubled() -> Value {
    let shape = json!({ "kind": "box", "size": [EDGE, EDGE, EDGE] });
    with(block("block", MASS, [EDGE; 3]), &json!({ "shapes": [shape.clone(), shape] }))
}

/// A minute on a slope within the cone of friction, modelled as level ground with inclined gravity.
fn on_a_slope() -> Case {
    let lean = 0.5_f64;
    let scene = Scene { gravity: [GRAVITY * lean.sin(), 0.0, -GRAVITY * lean.cos()], ..Scene::default() };
    let mut scenario = one(block("block", MASS, [EDGE; 3]), scene, resting([0.0, 0.0, 0.5 * EDGE]));
    scenario.duration = 60.0;
    scenario.sample_every = 0.08;
    Case::new("rest-60-s", "a block rests on a slope of 29 degrees for a minute", scenario)
        .at_most(1e-6, Quantity::Creep { after: 0.0 })
        .at_most(1e-6, Quantity::RootSpeed { after: 0.0 })
        .at_most(PENETRATION, Quantity::Penetration)
}

/// A thin rod, inclined forward, pushed along the ground: beyond a friction of 4/3 rigid bodies jam without an impact
/// (Painlevé's paradox), and the accelerations have no solution with finite forces.
fn painleve() -> Case {
    let (length, radius, mass, speed): (f64, f64, f64, f64) = (1.0, 0.01, 1.0, 3.0);
    let across = mass * length * length / 12.0;
    let end = |side: f64| json!({ "kind": "sphere", "radius": radius, "pose": { "position": [side * 0.5 * length, 0.0, 0.0] } });
    let rod = with(
        body("rod", mass, [0.0; 3], [1e-4, across, across]),
        &json!({ "shapes": [end(1.0), end(-1.0)] }),
    );
    // The foot ahead of the centre, so that friction on the foot turns the rod up over it.
    let lean: f64 = 0.9;
    let height = radius + 0.5 * length * lean.sin();
    let root = RootMotion {
        orientation: [(0.5 * lean).cos(), 0.0, (0.5 * lean).sin(), 0.0],
        linear_velocity: [speed, 0.0, 0.0],
        ..resting([0.0, 0.0, height])
    };
    let scenario = one(rod, Scene { friction: 2.0, ..Scene::default() }, root);
    let available = mass * GRAVITY * height + 0.5 * mass * speed * speed;
    Case::new("painleve", "a leaning rod slides foot first with a friction at which it jams", scenario)
        .at_most(0.01 * available, Quantity::EnergyGain)
        .at_most(PENETRATION, Quantity::Penetration)
        .at_most((2.0 * available / mass).sqrt(), Quantity::RootSpeed { after: 0.0 })
}

fn ice() -> Case {
    let (speed, scene) = (2.0, Scene { friction: 0.0, ..Scene::default() });
    let root = RootMotion { linear_velocity: [speed, 0.0, 0.0], ..resting([0.0, 0.0, 0.5 * EDGE]) };
    let scenario = one(block("block", MASS, [EDGE; 3]), scene, root);
    let wanted = [speed * scenario.duration, 0.0, 0.5 * EDGE];
    Case::new("friction-0", "a block slides on ice for ever", scenario)
        .at_most(1e-6, Quantity::FinalPosition { wanted })
        .at_most(1e-6, Quantity::MomentumChange)
        .at_most(PENETRATION, Quantity::Penetration)
}

fn rubber() -> Case {
    let (speed, scene) = (2.0, Scene { friction: 10.0, ..Scene::default() });
    let root = RootMotion { linear_velocity: [speed, 0.0, 0.0], ..resting([0.0, 0.0, 0.5 * EDGE]) };
    let scenario = one(block("block", MASS, [EDGE; 3]), scene, root);
    let available = 0.5 * MASS * speed * speed;
    Case::new("friction-10", "a block thrown along rubber turns over or stops, and rests", scenario)
        .at_most(0.01 * available, Quantity::EnergyGain)
        // A corner about which the block tips moves on a circle within a step: by at most h²ω²r/2 = 0.7 mm into the
        // ground.
        .at_most(1e-3, Quantity::Penetration)
        .at_most(1e-6, Quantity::RootSpeed { after: 5.0 })
}
