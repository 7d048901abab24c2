//! Settings chosen for a tolerance: the words for it, what is chosen, and who says so.

use gaitwright_learning::accuracy::scenes::ClosedForm;
use gaitwright_learning::accuracy::{
    Engine, Pieces, StudyError, TrialOutcome, TrialSettings, check, prepare, reference, settle,
};
use gaitwright_learning::scenario::{Line, NoFiles, Scenario, ScenarioEnd};
use gaitwright_physics::scene::{Accuracy, AskedAccuracy, Integrator};
use serde_json::{Value, json};

/// The faults of a scenario with this `accuracy`, as `place: reason`.
fn faults(accuracy: &Value) -> Vec<String> {
    let document = json!({ "character": "nobody.urdf", "accuracy": accuracy });
    match Scenario::parse(document.to_string().as_bytes()) {
        Ok(scenario) => scenario.faults().iter().map(ToString::to_string).collect(),
        Err(error) => error.faults().iter().map(ToString::to_string).collect(),
    }
}

#[test]
fn both_words_are_understood_and_given_back() {
    for document in [json!({ "tolerance": 1e-3 }), json!(Accuracy::default()), json!({ "step": 0.001 })] {
        let asked: AskedAccuracy = serde_json::from_value(document.clone()).unwrap();
        let back: AskedAccuracy = serde_json::from_value(json!(asked)).unwrap();
        assert_eq!(asked, back, "{document}");
        assert!(faults(&document).is_empty());
    }
    let settings: AskedAccuracy = serde_json::from_value(json!({ "solver": { "iterations": 7 } })).unwrap();
    // The step that is left out follows from the size of the character.
    for (size, step) in [(0.12, 0.002), (0.0012, 0.0002), (12.0, 0.02)] {
        let accuracy = settings.settings(size).unwrap();
        assert_eq!((accuracy.solver.iterations, accuracy.step), (7, step));
    }
    let given: AskedAccuracy = serde_json::from_value(json!({ "step": 0.004 })).unwrap();
    assert_eq!(given.settings(12.0).unwrap().step, 0.004);
    assert_eq!(json!(settings).get("step"), None);
    assert_eq!(json!(AskedAccuracy::Tolerance(0.5)), json!({ "tolerance": 0.5 }));
}

#[test]
fn faults_are_named_with_their_place() {
    for (accuracy, place, word) in [
        (json!({ "tolerence": 1 }), "/accuracy/tolerence", "unknown field"),
        (json!({ "solver": { "sweeps": 1 } }), "/accuracy/solver/sweeps", "unknown field"),
        (json!({ "step": "small" }), "/accuracy/step", "invalid type"),
        (json!({ "tolerance": "small" }), "/accuracy/tolerance", "invalid type"),
        (json!({ "tolerance": 1e-3, "step": 0.001 }), "/accuracy", "either"),
        (json!({ "tolerance": 1e-3, "step": Accuracy::default().step }), "/accuracy", "`step`"),
        (json!({ "tolerance": 0 }), "/accuracy/tolerance", "positive"),
        (json!({ "step": 7 }), "/accuracy/step", "between"),
    ] {
        let faults = faults(&accuracy);
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].starts_with(&format!("{place}: ")) && faults[0].contains(word), "{faults:?}");
    }
}

/// On pieces of its own, spread otherwise, the setting chosen is within three times the tolerance, and the same
/// method with steps four times as long is not.
#[test]
fn the_settings_chosen_keep_the_tolerance_and_no_more() {
    let exact = ClosedForm::named("pendulum").unwrap().problem().unwrap();
    let pieces = Pieces { count: 9, span: 3.0, length: 0.064, finest: 5e-4, finer: 64.0 };
    let (other, _) = reference(&exact.setup, &pieces, &|| false).unwrap().unwrap();
    let tried = |accuracy| {
        let point = TrialSettings { engine: Engine::Gaitwright, accuracy };
        match other.try_out(&point, 0, &|| false) {
            Some(TrialOutcome::Measured(figures)) => (figures.error, figures.evaluations.unwrap()),
            outcome => panic!("{outcome:?}"),
        }
    };
    let mut last = 0.0;
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let asked = AskedAccuracy::Tolerance(tolerance);
        let (accuracy, choice) = settle(&exact.setup, &asked, &|| false).unwrap().unwrap();
        let choice = choice.unwrap();
        assert_eq!(choice.tolerance, tolerance);
        assert!(choice.error <= tolerance && !choice.because.is_empty());
        let (error, work) = tried(accuracy);
        assert!(work >= last, "a smaller tolerance never takes less work");
        last = work;
        assert!(error < 3.0 * tolerance);
        let longer = Accuracy { step: 4.0 * accuracy.step, ..accuracy };
        let divided = accuracy.step_tolerance.is_some();
        let too_much = divided || longer.step > 0.008 || tried(longer).0 > tolerance / 3.0;
        assert!(too_much, "{accuracy:?} is finer than is asked for");
        let again = settle(&exact.setup, &asked, &|| false).unwrap().unwrap();
        assert_eq!(again, (accuracy, Some(choice)), "the choice is the same every time");
    }
    let fine = Accuracy { step: 0.001, integrator: Integrator::SemiImplicitEuler, ..Accuracy::default() };
    assert_eq!(settle(&exact.setup, &fine.into(), &|| false).unwrap(), Some((fine, None)));
    assert_eq!(settle(&exact.setup, &AskedAccuracy::Tolerance(1e-3), &|| true).unwrap(), None);
}

#[test]
fn a_tolerance_out_of_reach_is_refused() {
    let setup = ClosedForm::named("double-pendulum").unwrap().problem().unwrap().setup;
    let refused = settle(&setup, &AskedAccuracy::Tolerance(1e-16), &|| false);
    let Err(StudyError::Input(refused)) = refused else { panic!("{refused:?}") };
    assert_eq!(refused.faults()[0].pointer, "/accuracy/tolerance");
    assert!(refused.to_string().contains("most exact"), "{refused}");
}

#[test]
fn a_simulation_says_what_was_chosen_and_why() {
    let mut scenario = ClosedForm::named("rolling-ball").unwrap().scenario();
    scenario.accuracy = AskedAccuracy::Tolerance(2e-3);
    let mut summary = None;
    let ended = prepare(&scenario, &NoFiles).unwrap().run(|line| {
        if let Line::End { summary: last } = line {
            summary = Some(last);
        }
        true
    });
    assert_eq!(ended, ScenarioEnd::Finished);
    let summary = summary.unwrap();
    let choice = summary.accuracy_choice.unwrap();
    assert_eq!(choice.tolerance, 2e-3);
    assert!((summary.simulated_seconds / summary.accuracy.step - summary.steps as f64).abs() < 1e-6);
}

/// The bundled quadruped, driven by `drive` for a fifth of a second.
fn driven(drive: Value) -> Scenario {
    let walk = std::fs::read(crate::common::example_path("quadruped-walk.motion.json")).unwrap();
    let walk: Value = serde_json::from_slice(&walk).unwrap();
    let mut document = json!({
        "character": { "urdf": include_str!("../../../examples/quadruped.urdf") },
        "accuracy": { "tolerance": 1e-3 },
        "drive": drive,
        "duration": 0.2
    });
    if document["drive"]["kind"] == "track" {
        document["drive"]["motion"] = walk;
    }
    Scenario::parse(document.to_string().as_bytes()).unwrap()
}

/// A tolerance of a millimetre with every kind of drive: what is chosen keeps it on pieces of the same motion, and the
/// simulation runs with it to its end.
#[test]
fn a_tolerance_can_be_asked_for_with_every_drive() {
    let drives = [
        json!({ "kind": "none" }),
        json!({ "kind": "torque", "joints": { "LF_knee": 1.0, "RH_swing": -1.0 } }),
        json!({ "kind": "hold" }),
        json!({ "kind": "velocity", "joints": { "LF_knee": 0.5, "RF_swing": -1.0 } }),
        json!({ "kind": "track" }),
        json!({ "kind": "track", "feedforward": "contact_aware" }),
    ];
    let found = crate::common::in_parallel(&drives, |drive| {
        let scenario = driven(drive.clone());
        let setup = scenario.set_up(&NoFiles).unwrap();
        let (accuracy, choice) = settle(&setup, &scenario.accuracy, &|| false).unwrap().unwrap();
        let choice = choice.unwrap();
        assert!(choice.tolerance == 1e-3 && choice.error <= 1e-3, "{drive}: {choice:?}");
        let checked = check(&setup, &accuracy, choice.tolerance, &|| false).unwrap().unwrap();
        // The same pieces, of the same motion.
        assert_eq!((checked.holds, checked.error), (true, Some(choice.error)), "{drive}: {checked:?}");
        let mut steps = 0;
        let ended = prepare(&scenario, &NoFiles).unwrap().run(|line| {
            if let Line::End { summary } = line {
                steps = summary.steps;
            }
            true
        });
        assert_eq!((ended, steps), (ScenarioEnd::Finished, (0.2 / accuracy.step).round() as u64), "{drive}");
        accuracy
    });
    assert_eq!(found.len(), drives.len());
}

/// Settings that were chosen on one motion and are too coarse for another are found to be so there.
#[test]
fn a_broken_tolerance_is_told() {
    let setup = ClosedForm::named("double-pendulum").unwrap().problem().unwrap().setup;
    let coarse = Accuracy { step: 0.008, ..Accuracy::default() };
    let broken = check(&setup, &coarse, 1e-6, &|| false).unwrap().unwrap();
    let (error, spread) = (broken.error.unwrap(), broken.spread.unwrap());
    assert!(!broken.holds && error > 1e-6, "{broken:?}");
    assert!(spread.least <= spread.lower_quartile && spread.median <= spread.upper_quartile);
    assert!((spread.least..=spread.greatest).contains(&error), "{broken:?}");
    let kept = check(&setup, &coarse, 1.0, &|| false).unwrap().unwrap();
    assert!(kept.holds && kept.error == broken.error, "{kept:?}");
    assert_eq!(check(&setup, &coarse, 1.0, &|| true).unwrap(), None);
}
