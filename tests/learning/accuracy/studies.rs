//! Whole studies, with few settings.

use gaitwright_learning::accuracy::scenes::{ClosedForm, SCENES};
use gaitwright_learning::accuracy::{
    Engine, Pieces, RowStatus, StudyObserver, Sweep, Table, TableRow, reference, study,
};
use gaitwright_learning::scenario::{NoFiles, Scenario, ScenarioSetup};
use gaitwright_physics::scene::{Accuracy, Coordinates, Feedforward, Integrator};
use serde_json::json;

use super::Unwatched;

fn small() -> Sweep {
    Sweep { steps: vec![8e-3, 4e-3, 2e-3, 1e-3], step_tolerances: vec![1e-3, 1e-4, 1e-5, 1e-6], repeats: 1 }
}

fn of_scene(name: &str) -> Table {
    ClosedForm::named(name).unwrap().study(&small(), &mut Unwatched).unwrap().unwrap()
}

/// Errors of a method, by falling step.
fn errors(table: &Table, method: &str) -> Vec<f64> {
    let rows = table.rows.iter().filter(|row| row.method == method);
    rows.map(|row| row.figures.as_ref().unwrap_or_else(|| panic!("{row:?}")).error).collect()
}

/// The order of convergence between the first and the last error, each at half the step of the one before.
fn order(errors: &[f64]) -> f64 {
    (errors[0] / errors[errors.len() - 1]).log2() / (errors.len() - 1) as f64
}

#[test]
fn methods_show_their_order_in_smooth_scenes() {
    for name in ["ballistic", "tumbling", "pendulum", "double-pendulum"] {
        let table = of_scene(name);
        let first = order(&errors(&table, "semi-implicit Euler"));
        assert!((0.85..1.15).contains(&first), "{name}: order {first}");
        let second = errors(&table, "Moreau-Jean");
        if name == "ballistic" {
            assert!(second.iter().all(|error| *error < 1e-12), "a parabola is met exactly: {second:?}");
        } else {
            assert!((1.8..2.3).contains(&order(&second)), "{name}: {second:?}");
        }
    }
}

/// A first-order method is off by no more than a few steps' way when a contact changes its mind.
#[test]
fn methods_stay_within_a_few_steps_way_in_contact_scenes() {
    for name in ["sliding-block", "rolling-ball"] {
        let table = of_scene(name);
        for (error, step) in errors(&table, "semi-implicit Euler").iter().zip(small().steps) {
            assert!(*error < 2.0 * 2.0 * step, "{name}: {error} at {step}");
        }
    }
}

#[test]
fn scenes_can_be_asked_for_by_name() {
    for scene in SCENES {
        assert_eq!(ClosedForm::named(scene.name).unwrap().about, scene.about);
    }
    assert!(ClosedForm::named("nothing").is_none());
}

/// A quadruped that holds its stance after a drop of a few centimetres, in a scene that both engines can simulate.
fn quadruped() -> ScenarioSetup {
    let urdf = include_str!("../../../examples/quadruped.urdf");
    let scenario = json!({
        "character": { "urdf": urdf },
        "scene": { "effects": { "self_collision": "off" } },
        "start": { "root": { "position": [0, 0, 0.4] } },
        "drive": { "kind": "hold", "feedforward": "none" },
        "duration": 0.4
    });
    Scenario::parse(scenario.to_string().as_bytes()).unwrap().set_up(&NoFiles).unwrap()
}

const FEW: Pieces = Pieces { count: 3, span: 1.0, length: 0.032, finest: 5e-4, finer: 64.0 };

#[test]
fn finer_steps_come_closer_to_the_reference() {
    let table = study("drop", &quadruped(), &FEW, &small(), &mut Unwatched).unwrap().unwrap();
    assert_eq!((table.subject.compared, table.subject.unit.as_str()), (3, "m"));
    assert!((table.subject.seconds - 0.096).abs() < 1e-12);
    let base = errors(&table, "semi-implicit Euler");
    assert!(base[3] < base[0] / 4.0, "three halvings at first order make an eighth: {base:?}");
    let uncertainty = table.truth.uncertainty.unwrap();
    assert!(uncertainty < base[3] / 8.0, "the reference is no better than what it judges: {uncertainty:e}");
    for row in &table.rows {
        judged(row);
    }
    // In contact the engines stand for different laws.
    let [own] = &table.others[..] else { panic!("{:?}", table.others) };
    assert!(own.engine == Engine::Rapier && own.apart > 0.0 && own.uncertainty > 0.0, "{own:?}");
    let variants: Vec<_> = table.rows.iter().filter_map(|row| row.feedforward).collect();
    assert!(variants.contains(&Feedforward::ContactFree) && variants.contains(&Feedforward::ContactAware));
    let front: Vec<&TableRow> = table.rows.iter().filter(|row| row.front).collect();
    assert!(!front.is_empty() && front.iter().all(|row| row.feedforward.is_none()));
}

/// In the air both engines stand for the same laws: their truths are one, but for what is left of rapier's step, and its errors
/// against its own fall at first order.
#[test]
fn another_engine_is_judged_by_its_own_truth() {
    let mut document = crate::common::json(&crate::common::example_path("quadruped-passive.json"));
    document["character"] = json!({ "urdf": include_str!("../../../examples/quadruped.urdf") });
    document["duration"] = json!(0.1);
    let flying = Scenario::parse(document.to_string().as_bytes()).unwrap().set_up(&NoFiles).unwrap();
    let table = study("flight", &flying, &FEW, &small(), &mut Unwatched).unwrap().unwrap();
    let [own] = &table.others[..] else { panic!("{:?}", table.others) };
    assert_eq!((own.engine, own.step), (Engine::Rapier, 1e-3 / 8.0));
    let errors = errors(&table, "rapier");
    let order = order(&errors);
    // The reference is no more than eight times finer than the last step, of whose error an eighth is its own.
    assert!((0.85..1.35).contains(&order), "order {order}: {errors:?}");
    assert!(own.apart < 0.25 * errors[3] && own.uncertainty < 0.25 * errors[3], "{own:?}, {errors:?}");
}

/// What every row has to tell.
fn judged(row: &TableRow) {
    match row.status {
        RowStatus::Measured => {
            let figures = row.figures.as_ref().unwrap();
            assert!(
                figures.seconds > 0.0
                    && figures.spread.greatest >= figures.error
                    && figures.spread.least <= figures.error,
                "{row:?}"
            );
            if row.engine == Engine::Gaitwright {
                // A step cannot be longer than the one asked for.
                let Accuracy { step, coordinates, .. } = row.accuracy.unwrap();
                assert!(
                    figures.evaluations.unwrap() >= 0.999 / step && figures.residual.is_some(),
                    "{row:?}"
                );
                // Only bodies by themselves can come apart.
                let apart = figures.joint_separation.unwrap();
                assert_eq!(apart > 0.0, coordinates == Coordinates::Maximal, "{row:?}");
                assert!(apart < 1e-3, "{row:?}");
            } else {
                assert_eq!(figures.joint_separation, None, "{row:?}");
            }
        }
        RowStatus::Diverged | RowStatus::LeftOut => {
            assert!(row.figures.is_none() && !row.front);
            assert!(!row.because.as_deref().unwrap().is_empty());
        }
    }
}

/// The reference of the pendulum as a scenario, against Jacobi's functions at the end of its first piece.
#[test]
fn the_reference_agrees_with_the_exact_solution() {
    let scene = ClosedForm::named("pendulum").unwrap();
    let exact = scene.problem().unwrap();
    let pieces = Pieces { count: 2, span: 10.0, length: exact.interval, finest: 1e-3, finer: 64.0 };
    let (problem, truth) = reference(&exact.setup, &pieces, &|| false).unwrap().unwrap();
    let error =
        (problem.measure.of)(&exact.setup.model, &problem.pieces[0].marks[0], &exact.pieces[0].marks[0]);
    let uncertainty = truth.uncertainty.unwrap();
    // At first order the reference is off by as much as twice its step is off against it.
    assert!(error < 2.0 * uncertainty + 1e-12, "{error:e} against {uncertainty:e}");
    let second = truth.accuracy.unwrap().integrator == Integrator::MoreauJean;
    assert!(error < if second { 1e-8 } else { 1e-4 }, "{error:e}");
}

#[test]
fn what_cannot_be_studied_is_refused() {
    let document = json!({
        "character": { "json": { "format": "gaitwright/character@1", "name": "top",
            "links": [{ "name": "semi-implicit Euler", "mass": 1, "inertia": { "xx": 1, "yy": 1, "zz": 1 } },
                      { "name": "arm", "mass": 1, "inertia": { "xx": 1, "yy": 1, "zz": 1 } }],
            "joints": [{ "name": "joint", "kind": "continuous", "parent": "semi-implicit Euler", "child": "arm" }] } },
        "scene": { "ground": null },
        "drive": { "kind": "torque", "joints": { "joint": 1e300 } },
        "duration": 0.1
    });
    let setup = Scenario::parse(document.to_string().as_bytes()).unwrap().set_up(&NoFiles).unwrap();
    let refused = study("top", &setup, &FEW, &small(), &mut Unwatched);
    let reason = refused.unwrap_err().to_string();
    assert!(reason.contains("broke off"), "{reason}");
}

struct Impatient(usize);

impl StudyObserver for Impatient {
    fn progress(&mut self, _: usize, _: usize, _: &str) {
        self.0 += 1;
    }

    fn stop(&self) -> bool {
        self.0 > 3
    }
}

#[test]
fn a_study_ends_when_its_watcher_wants_it_to() {
    let mut watcher = Impatient(0);
    let table = ClosedForm::named("ballistic").unwrap().study(&small(), &mut watcher).unwrap();
    assert!(table.is_none());
    assert_eq!(watcher.0, 4);
}
