//! Tables made by hand: their front, what they recommend, their forms.

use gaitwright_learning::accuracy::Table;

use crate::tables::{readable, table};

#[test]
fn the_front_is_what_nothing_beats() {
    let front: Vec<bool> = table().rows.iter().map(|row| row.front).collect();
    assert_eq!(front, [true, false, false, false, false, true, false, true]);
}

#[test]
fn the_cheapest_setting_within_the_tolerance_is_recommended() {
    let table = table();
    let step = |tolerance| table.recommend(tolerance).accuracy.map(|accuracy| accuracy.step);
    assert_eq!(step(1.0), Some(0.008));
    assert_eq!(step(1e-2), Some(0.008), "a tolerance that is just met is met");
    assert_eq!(step(6e-3), Some(0.004));
    assert_eq!(step(1e-3), Some(0.004), "of two equally exact settings the faster");
    assert_eq!(step(1e-5), Some(0.001), "another engine is not recommended, nor a variant of the subject");
    let recommended = table.recommend(1e-3);
    assert_eq!((recommended.error, recommended.seconds), (Some(2e-4), Some(0.004)));
    assert!(recommended.because.contains("fine"), "{}", recommended.because);
}

#[test]
fn a_setting_that_leaves_steps_unsolved_is_not_recommended() {
    let mut table = table();
    let coarse = table.rows[1].figures.as_mut().unwrap();
    assert_eq!(coarse.error, 5e-3);
    coarse.unsolved_steps = Some(1);
    assert_eq!(table.recommend(6e-3).accuracy.map(|accuracy| accuracy.step), Some(0.004));
    assert!(table.recommend(6e-3).because.contains("fine"));
}

#[test]
fn a_tolerance_that_nothing_meets_is_told() {
    let none = table().recommend(1e-6);
    assert_eq!((none.accuracy, none.error, none.seconds), (None, None, None));
    assert!(none.because.contains("2.0e-6 m"), "{}", none.because);
    let unknowable = table().recommend(1e-8);
    assert!(unknowable.because.contains("1.0e-7 m"), "{}", unknowable.because);
}

#[test]
fn tables_can_be_read_back() {
    let table = table();
    let text = serde_json::to_string(&table).unwrap();
    assert!(text.starts_with(r#"{"format":"gaitwright/accuracy@1""#));
    assert_eq!(serde_json::from_str::<Table>(&text).unwrap(), table);
    readable(&table.to_csv(), table.rows.len());
}
