//! A character a hundred times smaller or larger moves alike: lengths by s, masses by s³, torques by s⁴, times by √s.

use std::sync::Arc;

use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Gains, Integrator, Scene, SolverChoice, usual_step};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;
use nalgebra::Vector3;

use crate::common;

/// Greatest difference of two motions in rad or in lengths of the character as shipped. In contact the solver leaves up to
/// 1e-9 m/s, which is 1e-11 m in a step; in this motion a difference grows by a factor of 1000 up to step 150.
/// (After step 170 it is chaotic: a start that is 1e-14 m higher then has other steps divided.)
const APART: f64 = 1e-6;

/// Steps of 8 ms for the character as shipped, some of which are divided in this motion.
const STEP: f64 = 0.008;
const STEPS: usize = 150;

/// Where the quadruped is after each step in units of its size, rad and 1, and how many substeps it took.
fn thrown(s: f64, integrator: Integrator) -> Vec<(Vec<f64>, u64)> {
    let own = common::example("quadruped.urdf");
    let stance = Stance::find(&own, &Scene::default());
    let model = Arc::new(Model::new(Arc::new(common::scaled(&own.character, s)), Base::Floating));
    let gains = Gains {
        stiffness: stance.gains.stiffness.iter().map(|it| it * s.powi(4)).collect(),
        damping: stance.gains.damping.iter().map(|it| it * s.powf(4.5)).collect(),
        max_torque: stance.gains.max_torque.iter().map(|it| it.map(|it| it * s.powi(4))).collect(),
        ..stance.gains.clone()
    };
    let time = s.sqrt();
    let usual = SolverChoice::default();
    let accuracy = Accuracy {
        step: STEP * time,
        integrator,
        solver: SolverChoice { tolerance: usual.tolerance * time, ..usual },
        ..Accuracy::default()
    };
    let plan = common::plan(&model, &Scene::default(), &accuracy, Some(&gains));
    let mut start = State::new(&model);
    start.angles.clone_from(&stance.angles);
    start.root.position.z = 0.7 * s;
    start.root.linear_velocity = Vector3::new(1.0, 0.3, 0.0) * time;
    start.root.angular_velocity = Vector3::new(8.0, 30.0, 12.0) / time;
    let mut simulator = Simulator::new(plan, start);
    let target = |step: usize| -> Vec<f64> {
        let phase = 25.0 * STEP * step as f64;
        let joints = stance.angles.iter().enumerate();
        joints.map(|(joint, angle)| angle + 0.3 * (phase + joint as f64).sin()).collect()
    };
    let mut before = 0;
    (0..STEPS)
        .map(|step| {
            simulator.step(Command::Track { now: &target(step), next: &target(step + 1) }).unwrap();
            let state = simulator.state();
            let place = state.root.position.coords / s;
            let turned = state.root.orientation.scaled_axis();
            let pose = state.angles.iter().chain(&place).chain(&turned).copied().collect();
            let substeps = simulator.substeps() - before;
            before = simulator.substeps();
            (pose, substeps)
        })
        .collect()
}

#[test]
fn a_character_of_any_size_moves_alike_with_as_many_substeps() {
    for integrator in [Integrator::SemiImplicitEuler, Integrator::MoreauJean] {
        let shipped = thrown(1.0, integrator);
        let divided = shipped.iter().filter(|(_, substeps)| *substeps > 1).count();
        assert!(divided > 10 && divided < STEPS, "{divided} of {STEPS} steps are divided");
        for s in [0.01, 100.0] {
            for (step, ((own, parts), (other, others))) in
                shipped.iter().zip(&thrown(s, integrator)).enumerate()
            {
                assert_eq!(parts, others, "{integrator:?}, 1:{s}, step {step}");
                let apart = own.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart < APART, "{integrator:?}, 1:{s}, step {step}: {apart} apart");
            }
        }
    }
}

#[test]
fn the_usual_step_follows_the_size_and_the_character_stands_at_it() {
    for name in ["quadruped.urdf", "biped.urdf", "hexapod.json", "snake.json"] {
        assert_eq!(usual_step(common::example(name).size), 0.002, "{name}");
    }
    let own = common::example("quadruped.urdf");
    for (s, step) in [(0.01, 0.0002), (100.0, 0.02)] {
        let model = Arc::new(Model::new(Arc::new(common::scaled(&own.character, s)), Base::Floating));
        assert!((model.size / own.size / s - 1.0).abs() < 1e-12);
        assert_eq!(usual_step(model.size), step);
        let (stance, usual) =
            (Stance::find(&model, &Scene::default()), Stance::find(&own, &Scene::default()));
        assert!(stance.stable, "1:{s}");
        // The search for a pose may end elsewhere by its own tolerance.
        assert!((stance.root_height / usual.root_height / s - 1.0).abs() < 0.01);
    }
}
