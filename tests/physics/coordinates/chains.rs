//! Chains in maximal coordinates: whether their joints hold together, and at what cost in energy.

use std::sync::Arc;

use gaitwright_physics::character::{self, Options, Source};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{
    Accuracy, Effect, Feedforward, Gains, JointBias, Scene, SolverChoice, SolverKind, Switch,
};
use gaitwright_physics::sim::{Command, Simulator, State};

use super::{common, maximal, reduced};

/// A hanging chain of links of 0.1 m, hinged about y and x in turn; `mass` gives each its mass, kg.
fn chain(links: usize, mass: impl Fn(usize) -> f64) -> Arc<Model> {
    let link = |index: usize| {
        let mass = mass(index);
        let inertia = mass * 0.1 * 0.1 / 12.0;
        format!(
            r#"{{"name": "link_{index}", "mass": {mass:e}, "center_of_mass": [0, 0, -0.05],
                "inertia": {{"xx": {inertia:e}, "yy": {inertia:e}, "zz": {:e}}}}}"#,
            0.1 * inertia
        )
    };
    let joint = |index: usize| {
        let axis = if index.is_multiple_of(2) { "[0, 1, 0]" } else { "[1, 0, 0]" };
        let height = if index == 1 { 0.0 } else { -0.1 };
        format!(
            r#"{{"name": "joint_{index}", "kind": "continuous", "parent": "link_{}", "child": "link_{index}",
                "origin": {{"position": [0, 0, {height}]}}, "axis": {axis}}}"#,
            index - 1
        )
    };
    let all =
        |each: &dyn Fn(usize) -> String, from: usize| (from..=links).map(each).collect::<Vec<_>>().join(",");
    let document = format!(
        r#"{{"format": "gaitwright/character@1", "name": "chain", "links": [{}], "joints": [{}]}}"#,
        all(&link, 0),
        all(&joint, 1)
    );
    let reading = character::read(document.as_bytes(), Source::Json, Options::default()).unwrap();
    Arc::new(Model::new(Arc::new(reading.character), Base::Fixed))
}

#[test]
fn a_chain_of_any_mass_ratio_holds_together_behind_every_solver() {
    let links = 10;
    for (name, heavy_end) in [("light to heavy", true), ("heavy to light", false)] {
        let model = chain(links, |index| {
            let share = index as f64 / links as f64;
            1e6_f64.powf(if heavy_end { share } else { 1.0 - share })
        });
        let greatest_torque = 1e-3 * model.mass * 9.81 * 0.1;
        // Torque limits leave boxed rows to the solver behind the equalities.
        let gains = Gains {
            stiffness: vec![greatest_torque; links],
            damping: vec![0.0; links],
            max_torque: vec![Some(greatest_torque); links],
            feedforward: Feedforward::None,
            ..Gains::default()
        };
        let targets = vec![0.0; links];
        for kind in [SolverKind::Pgs, SolverKind::Newton] {
            // The heavy end swings the light links at √(10⁶ g / 0.1 m) = 10⁴ rad/s: steps short of that period.
            let accuracy = Accuracy {
                step: 5e-5,
                solver: SolverChoice { kind, ..SolverChoice::default() },
                ..maximal(JointBias::Consistent)
            };
            let mut state = State::new(&model);
            state.angles[0] = 0.5;
            let plan = common::plan(&model, &Scene::default(), &accuracy, Some(&gains));
            let mut simulator = Simulator::new(plan, state);
            let total = |simulator: &Simulator| {
                let energy = simulator.energy();
                energy.kinetic + energy.potential
            };
            let start = total(&simulator);
            for _ in 0..6000 {
                simulator.step(Command::Track { now: &targets, next: &targets }).unwrap();
                // Links below 10³ rad/s leave their circle of 0.1 m by (10³ h)² / 2 of its radius in a step, of
                // which a fifth is taken back in each; the axis likewise.
                let apart = simulator.joint_separation();
                assert!(
                    apart <= 5.0 * 0.5 * (1e3_f64 * 5e-5).powi(2),
                    "{name}, {kind:?}: apart by {apart:e}"
                );
            }
            // The drives add at most their springs' energy; h ω of the fastest link is the method's own share.
            let gained = total(&simulator) - start;
            let swing = model.mass * 9.81 * 0.1;
            assert!(gained <= 0.01 * swing, "{name}, {kind:?}: gained {gained:e} of {swing:e}");
        }
    }
}

#[test]
fn joints_drift_apart_unless_stabilised() {
    let model = chain(3, |_| 1.0);
    let run = |accuracy: Accuracy, stabilization: Switch| {
        let mut scene = Scene::default();
        scene.effects.insert(Effect::Stabilization, stabilization);
        let mut state = State::new(&model);
        state.angles[0] = 1.5;
        let plan = common::plan(&model, &scene, &accuracy, None);
        let mut simulator = Simulator::new(plan, state);
        let (mut apart, mut fastest) = (0.0_f64, 0.0_f64);
        for _ in 0..1000 {
            simulator.step(Command::Passive).unwrap();
            apart = apart.max(simulator.joint_separation());
            fastest = fastest.max(simulator.state().velocities.iter().map(|rate| rate.abs()).sum());
        }
        (apart, fastest)
    };
    let accuracy = maximal(JointBias::Consistent);
    let (held, fastest) = run(accuracy, Switch::Auto);
    let (drifting, _) = run(accuracy, Switch::Off);
    // In a step of h a link leaves its circle, and its axis its plane, by (ω h)² / 2 at most; a fifth of what
    // has gathered is taken back.
    let bound = 5.0 * 0.5 * (fastest * accuracy.step).powi(2);
    assert!(held <= bound, "apart by {held:e} at {fastest} rad/s");
    assert!(drifting >= 5.0 * held, "{drifting:e} against {held:e}");
    assert_eq!(run(reduced(accuracy), Switch::Auto).0, 0.0);
}
