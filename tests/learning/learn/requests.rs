//! Tasks and parameters.

use super::bundled;
use gaitwright_learning::learn::{
    AskedSpeed, Budget, Learning, Mutation, Objective, Repair, Repairs, SearchMethod, Seeds, Task, Terms,
    Weights,
};
use gaitwright_physics::scene::Scene;
use gaitwright_physics::stance::Stance;

#[test]
fn fitness_is_progress_less_costs() {
    // Of the usual 0.02, 0.5, 2 and 0.1.
    let weights = Weights { energy: 5.0, drift: 1.0, turn: 1.0, slip: 2.5, ..Weights::default() };
    let task = Task { direction: [0.0, -3.0, 9.0], weights, ..Task::default() };
    let objective = Objective::of(&task, 10.0, 0.5, 9.81).unwrap();
    let known = Terms { displacement: [1.0, -4.0], turn: -0.3, work: 98.1, slip: 2.0, ..Terms::default() };
    let terms = Terms { impact: 0.1, torque_variation: 8.0, sway: 0.7, ..known };
    // 4 m forward; 1 m aside; 0.3 rad; 98.1 J of 10 kg: one metre's weight; 2 m slid.
    let plain = (4.0 - 0.1 * 1.0 - 0.5 * 1.0 - 2.0 * 0.5 * 0.3 - 0.25 * 2.0) / 2.0;
    // 0.1 s of twice the weight at a Froude speed of √(9.81 · 0.5) m/s; eight times the torque of the weight at half a metre; 0.7 rad there.
    let natural = (0.5 * 0.1 * (9.81f64 * 0.5).sqrt() + 0.02 * 0.5 * 8.0 + 0.1 * 0.5 * 0.7) / 2.0;
    let expected = plain - natural;
    assert!((objective.fitness(&terms, 2.0) - expected).abs() < 1e-12);
    let published = objective.as_published();
    assert!((published.fitness(&terms, 2.0) - plain).abs() < 1e-12);
    let at_speed = |speed| {
        let task = Task { speed: Some(AskedSpeed::Number(speed)), ..task.clone() };
        Objective::of(&task, 10.0, 0.5, 9.81).unwrap().fitness(&terms, 2.0)
    };
    // At a speed a quarter of what is unnatural is charged.
    let expected = plain - 0.25 * natural;
    assert!((at_speed(2.0) - expected).abs() < 1e-12, "at the wanted speed nothing is charged");
    assert!((at_speed(1.5) - (expected - 1.0)).abs() < 1e-12, "0.5 m/s too fast: 1.5 − 0.5 instead of 2");
    assert!((at_speed(3.0) - expected).abs() < 1e-12, "too slow: 3 − 1");
}

#[test]
fn impossible_parameters_are_named() {
    let stance = Stance::find(&bundled("quadruped.urdf"), &Scene::default());
    let pointers = |learning: &Learning| -> Vec<String> {
        let error = learning.resolve(&stance, 9.81, 0.002).unwrap_err();
        error.faults().iter().map(|fault| fault.pointer.clone()).collect()
    };
    let bad = Learning {
        population: 4,
        elite: 5,
        islands: 0,
        seconds: Some(-1.0),
        transition_time: Some(f64::NAN),
        states: 0,
        angle_levels: 4,
        mutation: Mutation { angle: 2.0, ..Mutation::default() },
        ..Learning::default()
    };
    let found = pointers(&bad);
    for pointer in
        ["/seconds", "/elite", "/islands", "/states", "/transition_time", "/angle_levels", "/mutation/angle"]
    {
        assert!(found.iter().any(|found| found == pointer), "{pointer} is not among {found:?}");
    }
    // What depends on a population that cannot be is no fault of its own.
    assert_eq!(pointers(&Learning { population: 1, ..Learning::default() }), ["/population"]);
    assert_eq!(pointers(&Learning { generations: Some(0), ..Learning::default() }), ["/generations"]);
    let resolved =
        Learning { transition_time: Some(0.1013), ..Learning::default() }.resolve(&stance, 9.81, 0.002);
    let resolved = resolved.unwrap();
    assert_eq!((resolved.transition_steps, resolved.budget), (50, Budget::Seconds(180.0)));
    assert!((resolved.transition_time - 0.1).abs() < 1e-12, "two beats, each a whole number of steps");
    assert_eq!((resolved.beat_steps(), resolved.greatest_beats()), (25, 6));
    let one = Learning {
        transition_time: Some(0.1013),
        repairs: Repairs::default().without(Repair::TransitionTimes),
        ..Learning::default()
    };
    let one = one.resolve(&stance, 9.81, 0.002).unwrap();
    assert_eq!((one.transition_steps, one.beat_steps(), one.greatest_beats()), (51, 51, 1));

    let paper = Learning { search: SearchMethod::Paper, islands: 7, ..Learning::default() };
    let paper = paper.resolve(&stance, 9.81, 0.002).unwrap();
    assert_eq!((paper.seeds, paper.refine, paper.islands), (Seeds::None, false, 1));
    assert_eq!((paper.crossover.limb, paper.mutation.limb), (0.0, 0.0));
    assert_eq!((paper.repairs, paper.greatest_beats()), (Repairs::NONE, 1));

    let task = Task { direction: [0.0, 0.0, 1.0], speed: Some(AskedSpeed::Number(0.0)), ..Task::default() };
    let faults: Vec<String> = task.faults().into_iter().map(|fault| fault.pointer).collect();
    assert_eq!(faults, ["/direction", "/speed"]);
    let unknown = serde_json::from_str::<Learning>(r#"{"populaton": 3}"#).unwrap_err();
    assert!(unknown.to_string().contains("populaton"));
}
