//! What each effect costs: nanoseconds of a step with every effect on, with each one off, and with all off.
//!
//! An effect that the character or the scene gives nothing to act on is off whatever the switch says, and is
//! left out.

mod common;

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Effect, Feedforward, Gains, Ground, Scene, StepPlan, Switch};
use gaitwright_physics::sim::{Simulator, State};
use gaitwright_physics::stance::Stance;

/// A character, what it does and where.
struct Case {
    name: &'static str,
    model: Arc<Model>,
    gains: Gains,
    start: State,
    targets: Vec<Vec<f64>>,
    /// Height of the ground, m.
    ground: f64,
}

/// Steps of one round.
const STEPS: usize = 250;

fn cases() -> Vec<Case> {
    let mut quadruped = Model::clone(&common::robot());
    quadruped.friction.fill(0.1);
    let quadruped = Arc::new(quadruped);
    let stance = Stance::find(&quadruped, &Scene::default());
    let of_quadruped = |name, sway, ground| Case {
        name,
        model: quadruped.clone(),
        gains: Gains { feedforward: Feedforward::ContactAware, ..stance.gains.clone() },
        start: stance.state.clone(),
        targets: common::sway(&stance.angles, sway, Accuracy::default().step, STEPS),
        ground,
    };
    vec![
        of_quadruped("quadruped, standing", 0.0, 0.0),
        of_quadruped("quadruped, swaying", 0.3, 0.0),
        of_quadruped("quadruped, flying", 0.3, -1e3),
        chain(),
    ]
}

/// A chain of 60 links that lies on five balls.
fn chain() -> Case {
    let mut model = Model::clone(&common::chain(60, Some(15), false));
    model.limits.fill(Some([-1.0, 1.0]));
    model.damping.fill(0.01);
    // Dry friction is a row for each joint at every step, so that few have it.
    model.friction[..6].fill(0.1);
    let joints = model.joint_count();
    let mut start = State::new(&model);
    start.root.position.z = 0.05;
    Case {
        name: "chain of 60 links",
        gains: Gains {
            stiffness: vec![100.0; joints],
            damping: vec![5.0; joints],
            max_torque: vec![Some(100.0); joints],
            feedforward: Feedforward::ContactAware,
            ..Gains::default()
        },
        targets: vec![start.angles.clone(); STEPS + 1],
        start,
        model: Arc::new(model),
        ground: 0.0,
    }
}

/// The case's scene with `on` switched on and all else off, if the simulator and the scene have these effects.
fn plan(case: &Case, on: &[Effect]) -> Option<StepPlan> {
    let switch = |effect| if on.contains(&effect) { Switch::On } else { Switch::Off };
    let scene = Scene {
        ground: Some(Ground::Plane { height: case.ground }),
        effects: Effect::ALL.into_iter().map(|effect| (effect, switch(effect))).collect(),
        ..Scene::default()
    };
    let plan = StepPlan::compile(&scene, &Accuracy::default(), Some(&case.gains), &case.model).ok()?;
    on.iter().all(|effect| plan.decisions[effect].on).then_some(plan)
}

fn main() {
    let rounds = if common::measuring() { 60 } else { 1 };
    for case in cases() {
        // Friction and stabilization have something to act on where the ground is on.
        let with_ground = |effect| match effect {
            Effect::Friction | Effect::Stabilization => vec![Effect::GroundContact, effect],
            _ => vec![effect],
        };
        let effects: Vec<Effect> =
            Effect::ALL.into_iter().filter(|effect| plan(&case, &with_ground(*effect)).is_some()).collect();
        let variant = |name: String, without: &dyn Fn(Effect) -> bool| {
            let on: Vec<Effect> = effects.iter().copied().filter(|effect| !without(*effect)).collect();
            let plan = plan(&case, &on)?;
            Some((name, Simulator::new(Arc::new(plan), case.start.clone())))
        };
        let one_off = effects.iter().filter_map(|effect| {
            // What needs the ground goes with it.
            let follows = |other: Effect| {
                *effect == Effect::GroundContact && matches!(other, Effect::Friction | Effect::Stabilization)
            };
            variant(format!("{} off", effect.name()), &|other| other == *effect || follows(other))
        });
        let all_on = variant("all on".into(), &|_| false);
        let all_off = variant("all off".into(), &|_| true);
        let variants: Vec<(String, Simulator)> = all_on.into_iter().chain(one_off).chain(all_off).collect();
        // In turns, so that what disturbs the machine disturbs all of them.
        let mut times = vec![f64::INFINITY; variants.len()];
        for _ in 0..rounds {
            for (least, (_, start)) in times.iter_mut().zip(&variants) {
                *least = least.min(common::nanoseconds(start, &case.targets, 1));
            }
        }
        println!("{}\n{:<24} {:>12} {:>10}", case.name, "", "ns per step", "of all on");
        for ((name, _), time) in variants.iter().zip(&times) {
            println!("{name:<24} {time:>12.0} {:>10.2}", time / times[0]);
        }
        println!();
    }
}
