//! What a scene does not call for changes nothing and costs nothing.
//!
//! Two facts about every effect: switched on where it never acts, it leaves the trajectory as it is to the last
//! bit; switched off where it would act, it adds no row to any step.

use crate::common;

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Effect, Feedforward, Gains, Ground, Scene, Switch};
use gaitwright_physics::sim::rows::RowOwner;
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;

const STEPS: usize = 400;

/// A scene in which one effect may be on without acting.
struct Idle {
    scene: Scene,
    gains: Gains,
    start: State,
    /// How far the targets swing about the standing pose, rad.
    swing: f64,
}

/// The bundled quadruped with dry friction in its joints, so that every effect has something to act on.
fn quadruped() -> Arc<Model> {
    let mut model = Model::clone(&common::example("quadruped.urdf"));
    model.friction.fill(0.3);
    model.damping.fill(0.1);
    Arc::new(model)
}

fn stance(model: &Arc<Model>) -> Stance {
    Stance::find(model, &Scene::default())
}

/// Targets that swing by `swing` rad about `angles` at time `time`, s.
fn targets(angles: &[f64], swing: f64, time: f64) -> Vec<f64> {
    let phase = (8.0 * time).sin();
    angles.iter().enumerate().map(|(joint, angle)| angle + swing * phase * (joint % 3) as f64).collect()
}

/// Steps `simulator` along the swinging targets and calls `seen` after each step.
fn run(simulator: &mut Simulator, angles: &[f64], swing: f64, mut seen: impl FnMut(&Simulator)) {
    let step = simulator.plan().step();
    for index in 0..STEPS {
        let now = targets(angles, swing, index as f64 * step);
        let next = targets(angles, swing, (index + 1) as f64 * step);
        simulator.step(Command::Track { now: &now, next: &next }).unwrap();
        seen(simulator);
    }
}

/// Every number of a trajectory, as bits.
fn bits(state: &State) -> impl Iterator<Item = u64> {
    let root = &state.root;
    let numbers = root.position.coords.iter().chain(&root.orientation.coords);
    let numbers = numbers.chain(&root.linear_velocity).chain(&root.angular_velocity);
    numbers.chain(&state.angles).chain(&state.velocities).map(|number| number.to_bits())
}

fn trajectory(model: &Arc<Model>, idle: &Idle, effect: Effect, switch: Switch) -> Vec<u64> {
    let mut scene = idle.scene.clone();
    scene.effects.insert(effect, switch);
    let plan = common::plan(model, &scene, &Accuracy::default(), Some(&idle.gains));
    let mut simulator = Simulator::new(plan, idle.start.clone());
    let mut all = Vec::new();
    run(&mut simulator, &idle.start.angles, idle.swing, |simulator| all.extend(bits(simulator.state())));
    all
}

/// A scene in which `effect` does not act, or `None` for those that need a second shape to be idle beside.
fn idle(effect: Effect, stance: &Stance) -> Option<Idle> {
    let standing = Idle {
        scene: Scene::default(),
        gains: stance.gains.clone(),
        start: stance.state.clone(),
        swing: 0.1,
    };
    let mut flying = Idle {
        scene: Scene { ground: Some(Ground::Plane { height: -1e3 }), ..Scene::default() },
        gains: stance.gains.clone(),
        start: stance.state.clone(),
        swing: 0.1,
    };
    flying.start.forget();
    flying.start.velocities.fill(0.0);
    flying.start.root.linear_velocity.fill(0.0);
    flying.start.root.angular_velocity.fill(0.0);
    // It falls without turning or moving a joint, so that nothing but its weight acts.
    let falling = |flying: Idle| Idle { swing: 0.0, ..flying };
    Some(match effect {
        Effect::Gravity => Idle { scene: Scene { gravity: [0.0; 3], ..flying.scene.clone() }, ..flying },
        Effect::GroundContact | Effect::Friction | Effect::Stabilization => flying,
        Effect::JointLimits | Effect::SpeedLimits => standing,
        Effect::TorqueLimits => {
            let mut standing = standing;
            standing.gains.max_torque.fill(Some(1e6));
            standing
        }
        Effect::Feedforward => {
            let mut falling = falling(flying);
            falling.gains.feedforward = Feedforward::ContactFree;
            falling
        }
        Effect::VelocityForces | Effect::TrunkRotationLock | Effect::JointDamping | Effect::JointFriction => {
            falling(flying)
        }
        Effect::SelfCollision | Effect::Obstacles => return None,
    })
}

#[test]
fn an_effect_that_never_acts_changes_no_bit() {
    let model = quadruped();
    let stance = stance(&model);
    for effect in Effect::ALL {
        let Some(idle) = idle(effect, &stance) else { continue };
        let off = trajectory(&model, &idle, effect, Switch::Off);
        let on = trajectory(&model, &idle, effect, Switch::On);
        assert!(off == on, "{} changes the trajectory although it never acts", effect.name());
        // A scene in which nothing happens would prove nothing.
        let (first, last) = (&off[..off.len() / STEPS], &off[off.len() - off.len() / STEPS..]);
        assert_ne!(first, last, "nothing moves in the scene of {}", effect.name());
    }
}

#[test]
fn every_effect_changes_a_scene_in_which_it_acts() {
    let model = quadruped();
    let stance = stance(&model);
    let busy = busy(&model, &stance);
    for effect in Effect::ALL {
        if matches!(effect, Effect::SelfCollision | Effect::Obstacles) {
            continue;
        }
        let off = trajectory(&model, &busy, effect, Switch::Off);
        let on = trajectory(&model, &busy, effect, Switch::On);
        assert!(off != on, "{} changes nothing", effect.name());
    }
}

/// Targets beyond the limits of the joints, weak actuators, dry friction, a drop onto the ground.
fn busy(model: &Model, stance: &Stance) -> Idle {
    let mut gains = stance.gains.clone();
    gains.feedforward = Feedforward::ContactAware;
    gains.max_torque = model.effort.iter().map(|effort| effort.map(|effort| 0.5 * effort)).collect();
    let mut start = stance.state.clone();
    start.forget();
    start.root.position.z += 0.02;
    start.root.angular_velocity.x = 0.5;
    Idle { scene: Scene::default(), gains, start, swing: 3.0 }
}

/// Whether a row belongs to `effect`.
fn belongs(owner: RowOwner, effect: Effect) -> bool {
    match effect {
        Effect::GroundContact => matches!(owner, RowOwner::Contact { .. }),
        Effect::JointLimits => matches!(owner, RowOwner::LowerLimit(_) | RowOwner::UpperLimit(_)),
        Effect::TorqueLimits => matches!(owner, RowOwner::Torque(_)),
        Effect::JointFriction => matches!(owner, RowOwner::DryFriction(_)),
        _ => false,
    }
}

#[test]
fn what_is_off_has_no_rows() {
    let model = quadruped();
    let stance = stance(&model);
    let busy = busy(&model, &stance);
    let rows = |effect: Effect, switch: Switch| {
        // Contacts of links with each other are not the ground's.
        let mut scene =
            Scene { effects: common::without(&[Effect::SelfCollision]).effects, ..busy.scene.clone() };
        scene.effects.insert(effect, switch);
        let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&busy.gains));
        let mut simulator = Simulator::new(plan, busy.start.clone());
        let mut count = 0;
        run(&mut simulator, &busy.start.angles, busy.swing, |simulator| {
            count += simulator.rows().iter().filter(|owner| belongs(**owner, effect)).count();
        });
        count
    };
    for effect in [Effect::GroundContact, Effect::JointLimits, Effect::TorqueLimits, Effect::JointFriction] {
        assert_ne!(rows(effect, Switch::On), 0, "{} never acts in this scene", effect.name());
        assert_eq!(rows(effect, Switch::Off), 0, "{} is off", effect.name());
    }
}

#[test]
fn friction_adds_two_rows_to_each_of_a_contact() {
    let model = quadruped();
    let stance = stance(&model);
    let rows = |scene: &Scene| {
        let plan = common::plan(&model, scene, &Accuracy::default(), Some(&stance.gains));
        let mut simulator = Simulator::new(plan, stance.state.clone());
        simulator.step(Command::Track { now: &stance.angles, next: &stance.angles }).unwrap();
        simulator.rows().iter().filter(|owner| matches!(owner, RowOwner::Contact { .. })).count()
    };
    let without = rows(&common::without(&[Effect::Friction]));
    assert!(without >= 4, "a quadruped that stands has {without} contacts");
    assert_eq!(rows(&Scene::default()), 3 * without);
}
