//! Feedforward of characters with loops and passive joints.

use std::f64::consts::TAU;
use std::sync::Arc;

use gaitwright_physics::character::{Character, LoopKind};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Coordinates, Effect, Feedforward, Gains, Scene, Switch};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;

use super::{BOTH, accuracy, common, documents, in_the_air, uneven};

/// Nothing but the offset torque.
fn feedforward_alone(model: &Model, feedforward: Feedforward) -> Gains {
    let joints = model.joint_count();
    Gains {
        stiffness: vec![0.0; joints],
        damping: vec![0.0; joints],
        max_torque: vec![None; joints],
        feedforward,
        // The paper's pass: the target's velocity after one step, from the first on.
        feedforward_period: 0.0,
        ..Gains::default()
    }
}

/// `model` with actuators at the joints called `driven` alone.
pub fn driven_at(model: &Model, driven: &[&str]) -> Arc<Model> {
    let mut character = Character::clone(&model.character);
    for joint in character.links.iter_mut().filter_map(|link| link.joint.as_mut()) {
        joint.driven = driven.contains(&joint.name.as_str());
    }
    Arc::new(Model::new(Arc::new(character), Base::fixed_if(model.fixed_base)))
}

/// The left elbow and the right shoulder of the uneven four-bar with its left shoulder at `crank`, rad: the end
/// of the right crank is where a circle about its shoulder meets one about the left elbow.
fn closed_form(crank: f64) -> [f64; 2] {
    let (left, right, along, across) = (0.3, 0.25, 0.4, 0.05);
    let elbow = [-0.2 - left * crank.sin(), -left * crank.cos()];
    let reach = f64::hypot(along, across);
    let [dx, dz] = [0.2 - elbow[0], -elbow[1]];
    let apart = f64::hypot(dx, dz);
    // From the elbow towards the right shoulder, and across, downward.
    let foot = (apart * apart + reach * reach - right * right) / (2.0 * apart);
    let off = (reach * reach - foot * foot).sqrt();
    let end = [elbow[0] + (foot * dx + off * dz) / apart, elbow[1] + (foot * dz - off * dx) / apart];
    let shoulder = (-(end[0] - 0.2)).atan2(-end[1]);
    let coupler = across.atan2(along) - (end[1] - elbow[1]).atan2(end[0] - elbow[0]);
    [coupler - crank, shoulder]
}

/// The crank's target, rad: to 0.5 and back in a second, from rest.
fn crank(time: f64) -> f64 {
    0.25 * (1.0 - (TAU * time).cos())
}

#[test]
fn a_four_bar_follows_its_driven_crank() {
    assert!(closed_form(0.0).iter().all(|angle| angle.abs() < 1e-12));
    let model = driven_at(&uneven(LoopKind::Revolute, true), &["left_shoulder"]);
    let joint = |name: &str| model.joint(name).unwrap();
    let (left, elbow, right) = (joint("left_shoulder"), joint("left_elbow"), joint("right_shoulder"));
    let gains = feedforward_alone(&model, Feedforward::ContactFree);
    for coordinates in BOTH {
        for forces in [Switch::Off, Switch::On] {
            // Without forces of velocity the torque is exact. With them, the two passes take them at mean velocities
            // that they agree on to 1e-6 rad a step. Bodies by themselves leave their circles by (ω h)² / 2 of their
            // radius in a step, while the torque is meant for joints that do not.
            let bound = match (coordinates, forces) {
                (Coordinates::Maximal, _) => 1e-4,
                (Coordinates::Reduced, Switch::Off) => 1e-9,
                (Coordinates::Reduced, _) => 1e-5,
            };
            let mut scene = in_the_air();
            scene.effects.insert(Effect::VelocityForces, forces);
            let settings = accuracy(coordinates);
            let plan = common::plan(&model, &scene, &settings, Some(&gains));
            let mut simulator = Simulator::new(plan, State::new(&model));
            for step in 0..500 {
                let [now, next] = [step, step + 1].map(|step| {
                    let mut targets = [0.0; 3];
                    targets[left] = crank(f64::from(step) * settings.step);
                    targets
                });
                simulator.step(Command::Track { now: &now, next: &next }).unwrap();
                let angles = &simulator.state().angles;
                let place = format!("{coordinates:?}, {forces:?}, {} s", simulator.state().time);
                let astray = (angles[left] - next[left]).abs();
                assert!(astray <= bound, "{place}: astray by {astray:e}");
                let follows = closed_form(angles[left]);
                let open = (angles[elbow] - follows[0]).abs().max((angles[right] - follows[1]).abs());
                // At up to 2 rad/s a link leaves its circle by (ω h)² / 2 of its radius in a step, of which a fifth
                // is taken back.
                assert!(open <= 1e-4, "{place}: {angles:?} for {follows:?}");
                let passive = simulator.torques()[elbow].abs() + simulator.torques()[right].abs();
                assert_eq!(passive, 0.0, "{place}");
            }
        }
    }
}

/// Legs that hold the weight by the torque of the first pass alone: it has to see the ground and the loops.
#[test]
fn feedforward_that_sees_contacts_carries_four_bar_legs() {
    let whole = documents::legged();
    let hips: Vec<String> = (0..4).map(|leg| format!("front_hip_{leg}")).collect();
    let hips: Vec<&str> = hips.iter().map(String::as_str).collect();
    let model = driven_at(&whole, &hips);
    let stance = Stance::find(&whole, &Scene::default());
    for coordinates in BOTH {
        let gains = feedforward_alone(&model, Feedforward::ContactAware);
        let settings = Accuracy { coordinates, ..Accuracy::default() };
        let plan = common::plan(&model, &Scene::default(), &settings, Some(&gains));
        let mut start = stance.state.clone();
        start.forget();
        let height = start.root.position.z;
        let mut simulator = Simulator::new(plan, start);
        let held = stance.state.angles.clone();
        for _ in 0..500 {
            simulator.step(Command::Track { now: &held, next: &held }).unwrap();
        }
        let fallen = (simulator.state().root.position.z - height).abs();
        assert!(fallen <= 1e-3, "{coordinates:?}: fallen by {fallen}");
        // Were there no torque, it would be on its belly.
        let torques = hips.iter().map(|hip| simulator.torques()[model.joint(hip).unwrap()].abs());
        assert!(torques.fold(0.0, f64::max) > 1e-3, "{coordinates:?}");
    }
}

/// A passive joint of a character without loops hangs, whatever its target.
#[test]
fn a_joint_without_an_actuator_ignores_its_target() {
    let mut character = Character::clone(&uneven(LoopKind::Revolute, true).character);
    character.loops.clear();
    let model =
        driven_at(&Model::new(Arc::new(character), Base::Fixed), &["left_shoulder", "right_shoulder"]);
    let elbow = model.joint("left_elbow").unwrap();
    for feedforward in [Feedforward::None, Feedforward::ContactFree, Feedforward::ContactAware] {
        let gains = Gains {
            stiffness: vec![50.0; 3],
            damping: vec![5.0; 3],
            max_torque: vec![Some(20.0); 3],
            feedforward,
            ..Gains::default()
        };
        let ends = [0.0, 2.0].map(|target| {
            let plan = common::plan(&model, &in_the_air(), &accuracy(Coordinates::Reduced), Some(&gains));
            let mut simulator = Simulator::new(plan, State::new(&model));
            let mut targets = [0.3; 3];
            targets[elbow] = target;
            for _ in 0..300 {
                simulator.step(Command::Track { now: &targets, next: &targets }).unwrap();
                assert_eq!(simulator.torques()[elbow], 0.0);
            }
            simulator.state().clone()
        });
        assert_eq!(ends[0], ends[1], "{feedforward:?}");
        assert!(ends[0].angles[elbow].abs() > 0.1, "{feedforward:?}: it swings");
    }
}
