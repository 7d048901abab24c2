//! The catalogue of hard cases: every bound of every case, at its step and at four times that step.

use crate::common;

use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, LazyLock, Mutex, OnceLock};

use gaitwright_learning::accuracy::catalogue::{
    Case, CaseBound, CaseVerdict, Quantity, cases, compare, judge, named, to_csv, to_markdown,
};
use gaitwright_learning::scenario::Scenario;
use gaitwright_physics::scene::Accuracy;

/// Parts of the catalogue that are run side by side, by the first word of a case's name.
const PARTS: [&[&str]; 5] = [
    &["chain", "ratio", "links", "inertia", "gimbal", "heavy", "light", "four", "conflicting"],
    &["spring", "damper", "tumbling", "spin", "gyroscope", "limit", "torque"],
    &["step"],
    &["random"],
    &["deep", "drop", "redundant", "rows", "rest", "painleve", "friction", "sunk", "straight"],
];

fn first_word(case: &Case) -> &str {
    case.name.split('-').next().unwrap_or_default()
}

/// The verdict on a case of the catalogue at its step times `factor`. Each is judged once for all tests.
fn judged(case: &Case, factor: f64) -> CaseVerdict {
    type Once = Arc<OnceLock<CaseVerdict>>;
    static JUDGED: LazyLock<Mutex<HashMap<(String, u64), Once>>> = LazyLock::new(Mutex::default);
    let once = JUDGED.lock().unwrap().entry((case.name.clone(), factor.to_bits())).or_default().clone();
    let judge = || judge(case, factor).unwrap_or_else(|error| panic!("{}: {error}", case.name));
    once.get_or_init(judge).clone()
}

/// Runs a part of the catalogue, prints every figure and fails with those that are out of bounds.
fn all_bounds_hold(part: usize) {
    let cases = cases().into_iter().filter(|case| PARTS[part].contains(&first_word(case)));
    let runs: Vec<(Case, f64)> = cases
        .flat_map(|case| {
            let factors: &[f64] = if case.own_step { &[1.0] } else { &[1.0, 4.0] };
            factors.iter().map(move |factor| (case.clone(), *factor))
        })
        .collect();
    assert!(!runs.is_empty());
    let mut broken = Vec::new();
    for verdict in common::in_parallel(&runs, |(case, factor)| judged(case, *factor)) {
        let place = format!("{} at {} s", verdict.case, verdict.accuracy.step);
        println!("{place}: {} ({:.2} s)", verdict.status, verdict.step_seconds);
        if !verdict.finished {
            broken.push(format!("{place}: {}", verdict.status));
        }
        for row in &verdict.rows {
            let figures =
                format!("{:?}: {:.3e} of {:.3e} {}", row.quantity, row.measured, row.bound, row.unit);
            println!("    {figures}");
            if !row.holds {
                broken.push(format!("{place}: {figures}"));
            }
        }
    }
    assert!(broken.is_empty(), "{} bounds broken:\n{}", broken.len(), broken.join("\n"));
}

#[test]
fn chains() {
    all_bounds_hold(0);
}

#[test]
fn springs_rotation_and_limits() {
    all_bounds_hold(1);
}

#[test]
fn steps_of_every_length() {
    all_bounds_hold(2);
}

#[test]
fn random_characters() {
    all_bounds_hold(3);
}

#[test]
fn contacts_and_robots() {
    all_bounds_hold(4);
}

/// What four times the step may gain is five times what the step may.
#[test]
fn whips_gain_less_at_the_default_step() {
    for name in ["chain-released", "chain-released-in-space"] {
        let verdict = judged(&named(name).unwrap(), 1.0);
        assert!(verdict.finished && !verdict.rows.is_empty(), "{name}: {}", verdict.status);
        for row in &verdict.rows {
            assert!(row.measured <= 0.2 * row.bound, "{name}: {row:?}");
        }
    }
}

/// With the default settings every case runs to its end as well, with all its numbers finite; which bounds then hold is for the
/// table to show.
#[test]
fn every_case_runs_to_its_end_by_default() {
    let plain: Vec<Case> = cases().iter().filter_map(Case::by_default).collect();
    assert!(!plain.is_empty());
    for verdict in common::in_parallel(&plain, |case| judge(case, 1.0).unwrap()) {
        assert!(verdict.finished, "{}: {}", verdict.case, verdict.status);
        for row in &verdict.rows {
            let figures =
                format!("{:?}: {:.3e} of {:.3e} {}", row.quantity, row.measured, row.bound, row.unit);
            println!("{} by default: {figures}{}", verdict.case, if row.holds { "" } else { " BROKEN" });
            assert!(row.measured.is_finite(), "{}: {figures}", verdict.case);
        }
    }
}

#[test]
fn a_broken_bound_is_told() {
    let mut case = named("friction-0").unwrap();
    case.bounds.push(CaseBound { quantity: Quantity::Creep { after: 0.0 }, most: 1.0 });
    let verdict = judge(&case, 1.0).unwrap();
    let (broken, kept) = verdict.rows.split_last().unwrap();
    assert!(verdict.finished && !verdict.holds() && !broken.holds && kept.iter().all(|row| row.holds));
    // The block goes 2 m/s for 10 s.
    assert!((broken.measured - 20.0).abs() < 1e-6, "{broken:?}");
}

/// Both tables show a case with the default settings beside its best ones, and what is out of bounds stands out.
#[test]
fn the_table_shows_the_default_settings_beside_the_best() {
    let mut broken = named("friction-0").unwrap();
    broken.bounds = vec![CaseBound { quantity: Quantity::Creep { after: 0.0 }, most: 1.0 }];
    let tuned = cases().into_iter().find(|case| case.name == "tumbling").unwrap();
    assert!(tuned.by_default().is_some() && broken.by_default().is_none());
    let runs = [(&broken, 1.0), (&broken, 4.0), (&tuned, 1.0)];
    let compared: Vec<_> = runs.iter().map(|(case, factor)| compare(case, *factor).unwrap()).collect();
    assert_eq!(compared[0].by_default, compared[0].best);
    let of_tuned = &compared[2];
    assert_eq!(
        of_tuned.by_default.accuracy,
        Accuracy { step: of_tuned.best.accuracy.step, ..Accuracy::default() }
    );
    let text = to_markdown(&compared);
    let lines: Vec<&str> = text.lines().skip(2).collect();
    assert_eq!(lines.len(), 1 + tuned.bounds.len(), "{text}");
    assert!(
        lines[0].starts_with("| `friction-0` | 2, 8 | creep | 1 m | **20**, **20** | the same |"),
        "{text}"
    );
    assert!(lines[1].contains("moreau_jean"), "{text}");
    let csv = to_csv(&compared);
    assert_eq!(csv.lines().count(), 1 + 2 + tuned.bounds.len(), "{csv}");
}

#[test]
fn the_catalogue_is_in_order() {
    let cases = cases();
    let names: BTreeSet<&str> = cases.iter().map(|case| case.name.as_str()).collect();
    assert_eq!(names.len(), cases.len(), "names are unique");
    for case in &cases {
        let parts = PARTS.iter().filter(|part| part.contains(&first_word(case))).count();
        assert_eq!(parts, 1, "{} is run once", case.name);
        assert!(case.scenario.duration >= 10.0, "{} takes ten seconds", case.name);
        assert!(!case.bounds.is_empty(), "{} has bounds", case.name);
        assert!(case.bounds.iter().all(|bound| bound.most.is_finite() && bound.most > 0.0), "{}", case.name);
        let document = serde_json::to_vec(&case.scenario).unwrap();
        let read = Scenario::parse(&document).unwrap_or_else(|error| panic!("{}: {error}", case.name));
        assert_eq!(read, case.scenario, "{} is a document", case.name);
        assert_eq!(named(&case.name).as_ref(), Some(case));
    }
}
