//! Names of gaits against footfalls as they were published, written down by hand.

use gaitwright_learning::gait::{Classified, Leg, Side, classify, templates};
use proptest::prelude::*;

use super::leg;

fn named(timings: &[(&str, f64)], duty_factor: f64) -> Classified {
    let rows = timings.len() / 2;
    let feet: Vec<(Leg, f64)> =
        timings.iter().map(|&(name, at)| (super::leg_called(name, rows), at.rem_euclid(1.0))).collect();
    classify(&feet, duty_factor).unwrap()
}

/// Orders of footfalls as published, with timings by hand that no table has: the walk in lateral sequence of Hildebrand
/// (1965) and Muybridge (1887), and its even form with a lateral phase of 0.22 (the horse's); trot and pace of
/// Hildebrand 1965 with legs up to 0.04 apart; canter (three beats), transverse gallop and rotary gallop of Hildebrand
/// 1977 ("Analysis of asymmetrical gaits") and 1989, bound and pronk of the same.
#[test]
fn published_footfalls_have_their_names() {
    type Case = (&'static str, Option<&'static str>, f64, [(&'static str, f64); 4]);
    let cases: [Case; 14] = [
        ("walk", None, 0.62, [("LH", 0.0), ("LF", 0.22), ("RH", 0.5), ("RF", 0.72)]),
        ("walk", None, 0.7, [("LH", 0.1), ("LF", 0.36), ("RH", 0.61), ("RF", 0.84)]),
        // In diagonal couplets, as far from the even walk as it goes.
        ("walk", None, 0.6, [("LH", 0.0), ("LF", 0.37), ("RH", 0.5), ("RF", 0.87)]),
        ("trot", None, 0.45, [("LF", 0.0), ("RH", 0.02), ("RF", 0.5), ("LH", 0.53)]),
        ("trot", None, 0.4, [("RH", 0.0), ("LF", 0.04), ("LH", 0.51), ("RF", 0.53)]),
        ("pace", None, 0.45, [("LH", 0.0), ("LF", 0.05), ("RH", 0.5), ("RF", 0.55)]),
        // Left lead: RH, then LH and RF together, then LF; and the right lead.
        ("canter", None, 0.4, [("RH", 0.0), ("LH", 0.31), ("RF", 0.34), ("LF", 0.66)]),
        ("canter", None, 0.4, [("LH", 0.0), ("RH", 0.34), ("LF", 0.31), ("RF", 0.66)]),
        // Left lead: RH LH RF LF; right lead: LH RH LF RF.
        ("gallop", Some("transverse"), 0.25, [("RH", 0.0), ("LH", 0.07), ("RF", 0.6), ("LF", 0.67)]),
        ("gallop", Some("transverse"), 0.25, [("LH", 0.0), ("RH", 0.06), ("LF", 0.61), ("RF", 0.67)]),
        // LH LF RF RH goes round the body; so does RH RF LF LH.
        ("gallop", Some("rotary"), 0.25, [("RH", 0.0), ("LH", 0.06), ("LF", 0.63), ("RF", 0.69)]),
        ("gallop", Some("rotary"), 0.25, [("LH", 0.0), ("RH", 0.06), ("RF", 0.63), ("LF", 0.69)]),
        ("bound", None, 0.3, [("LH", 0.0), ("RH", 0.01), ("RF", 0.48), ("LF", 0.5)]),
        ("pronk", None, 0.3, [("LH", 0.0), ("RH", 0.02), ("RF", 0.98), ("LF", 0.99)]),
    ];
    for (name, variant, duty, timings) in cases {
        let found = named(&timings, duty);
        assert_eq!((found.name, found.variant), (name, variant), "{timings:?}: {found:?}");
    }
}

/// What the same sources call otherwise, or what nobody names: the diagonal-sequence walk of primates, three feet
/// together, the half-bound (hind feet together, fore feet apart), a trot and a walk whose one leg comes late.
#[test]
fn other_footfalls_have_none_of_these_names() {
    let cases: [(&str, [(&str, f64); 4]); 5] = [
        ("diagonal sequence", [("LH", 0.0), ("RF", 0.25), ("RH", 0.5), ("LF", 0.75)]),
        ("three together", [("LF", 0.0), ("LH", 0.0), ("RF", 0.0), ("RH", 0.5)]),
        ("half-bound", [("LH", 0.0), ("RH", 0.0), ("LF", 0.45), ("RF", 0.6)]),
        ("limping trot", [("LF", 0.0), ("RH", 0.15), ("RF", 0.5), ("LH", 0.5)]),
        ("limping walk", [("LH", 0.0), ("LF", 0.25), ("RH", 0.5), ("RF", 0.9)]),
    ];
    for (called, timings) in cases {
        let found = named(&timings, 0.5);
        assert_eq!(found.name, "unclassified", "{called}: {found:?}");
    }
    // One leg of a trot 0.15 late is only 0.05 off in the mean of all legs: the mean alone would name it.
    let limping = named(&cases[3].1, 0.5);
    assert!(limping.distance < 0.05 && limping.greatest_distance > limping.tolerance, "{limping:?}");
}

proptest! {
    /// Hildebrand's distinction of the gallops: the fore feet have the lead of the hind feet (transverse) or the other one
    /// (rotary).
    #[test]
    fn the_lead_of_both_pairs_tells_the_gallops_apart(
        lags in (0.03..0.07_f64, 0.03..0.07_f64),
        fore_left in any::<bool>(),
        hind_left in any::<bool>(),
        between in -0.02..0.02_f64,
    ) {
        let pair = |lag: f64, left_leads: bool| if left_leads { (lag, 0.0) } else { (0.0, lag) };
        let ((lf, rf), (lh, rh)) = (pair(lags.0, fore_left), pair(lags.1, hind_left));
        // The middle of the hind pair comes some 0.4 of a stride after that of the fore pair where the lead is the same,
        // and 0.35 where it is not.
        let after = between + if fore_left == hind_left { 0.4 } else { 0.35 };
        let found = named(&[("LF", lf), ("RF", rf), ("LH", lh + after), ("RH", rh + after)], 0.3);
        let variant = if fore_left == hind_left { "transverse" } else { "rotary" };
        prop_assert_eq!((found.name, found.variant), ("gallop", Some(variant)), "{:?}", found);
    }

    #[test]
    fn a_name_depends_neither_on_the_reference_foot_nor_on_the_order_nor_on_the_leading_side(
        phases in prop::array::uniform4(0.0..1.0_f64),
        turn in 0.0..1.0_f64,
        duty in 0.1..0.9,
    ) {
        let feet: Vec<(Leg, f64)> = (0..4).map(|index| (leg(index), phases[index])).collect();
        let found = classify(&feet, duty).unwrap();
        let turned: Vec<(Leg, f64)> =
            (0..4).rev().map(|index| (leg(index), (phases[index] + turn).rem_euclid(1.0))).collect();
        let mirrored: Vec<(Leg, f64)> = (0..4).map(|index| (leg(index), phases[(index + 2) % 4])).collect();
        for other in [classify(&turned, duty).unwrap(), classify(&mirrored, duty).unwrap()] {
            prop_assert!((found.greatest_distance - other.greatest_distance).abs() < 1e-9);
            // Rounding may decide which of two equally near gaits it is, and whether one at its very limit has its name.
            let close = (found.greatest_distance - found.tolerance).abs() < 1e-9;
            prop_assert!(found.name == other.name || close, "{:?} {:?}", found, other);
        }
        prop_assert_eq!(found.name == "unclassified", found.greatest_distance > found.tolerance);
    }

    /// The greatest distance by trying every shift, and what it says: with the best shift no leg is farther.
    #[test]
    fn the_distance_is_that_of_the_leg_that_fits_least(phases in prop::array::uniform2(0.0..1.0_f64)) {
        let feet = [(Leg { side: Side::Left, row: 0, rows: 1 }, phases[0]),
                    (Leg { side: Side::Right, row: 0, rows: 1 }, phases[1])];
        let found = classify(&feet, 0.6).unwrap();
        let circle = |x: f64| (x - x.round()).abs();
        let least = |wanted: [f64; 2]| {
            (0..10_000).map(|step| {
                let shift = f64::from(step) / 10_000.0;
                circle(phases[0] - wanted[0] - shift).max(circle(phases[1] - wanted[1] - shift))
            }).fold(f64::INFINITY, f64::min)
        };
        let expected = least([0.0, 0.5]).min(least([0.0, 0.0]));
        prop_assert!((found.greatest_distance - expected).abs() < 1e-4, "{} {}", found.greatest_distance, expected);
    }
}

/// No phases are within the tolerance of two names: tried over a grid of the whole circle, one leg held.
#[test]
fn no_gait_has_two_names() {
    let circle = |x: f64| (x - x.round()).abs();
    let fits = |phases: &[f64; 4], template: &[f64], tolerance: f64| {
        // The shift that makes the greatest distance least lies half-way between two of the differences.
        let apart: Vec<f64> = phases.iter().zip(template).map(|(a, b)| a - b).collect();
        apart.iter().any(|a| {
            apart.iter().any(|b| {
                let away = (b - a) - (b - a).round();
                let middle = a + 0.5 * away;
                apart.iter().all(|c| circle(c - middle) <= tolerance - 1e-9)
            })
        })
    };
    let steps = 40;
    let tolerances: Vec<f64> = templates(4).iter().map(|template| template.tolerance()).collect();
    let mut names_found = std::collections::BTreeSet::new();
    for index in 0..steps * steps * steps {
        let at = |divisor: usize| (index / divisor % steps) as f64 / steps as f64;
        let phases = [0.0, at(1), at(steps), at(steps * steps)];
        let mirrored = [phases[2], phases[3], phases[0], phases[1]];
        let mut names: Vec<&str> = templates(4)
            .iter()
            .zip(&tolerances)
            .filter(|(template, tolerance)| {
                [phases, mirrored].iter().any(|phases| fits(phases, template.phases, **tolerance))
            })
            .map(|(template, _)| template.name)
            .collect();
        names.dedup();
        assert!(names.len() <= 1, "{phases:?}: {names:?}");
        names_found.extend(names);
    }
    assert_eq!(names_found.len(), 7, "{names_found:?}");
}

/// Wilson 1966: on each side steps run from hind to fore, each leg 1 − β of a stride after the one behind it; the sides
/// are half a stride apart.
#[test]
fn six_legs_step_in_waves() {
    for (name, duty) in [("tripod", 0.5), ("tripod", 0.54), ("ripple", 0.67), ("wave", 0.83), ("wave", 0.8)] {
        let lag = 1.0 - duty;
        let timings = [
            ("LH", 0.0),
            ("LM", lag),
            ("LF", 2.0 * lag),
            ("RH", 0.5),
            ("RM", 0.5 + lag),
            ("RF", 0.5 + 2.0 * lag),
        ];
        assert_eq!(named(&timings, duty).name, name, "duty factor {duty}");
    }
    // From fore to hind it is no gait of insects.
    let backward = [("LF", 0.0), ("LM", 0.17), ("LH", 0.33), ("RF", 0.5), ("RM", 0.67), ("RH", 0.83)];
    assert_eq!(named(&backward, 0.83).name, "unclassified");
}

/// Wilson's rule for six legs carried over to eight, up to the alternating tetrapod of tarantulas (Wilson 1967), in which the first and
/// third leg of one side step with the second and fourth of the other.
#[test]
fn eight_legs_step_in_waves() {
    for (name, duty) in
        [("tetrapod", 0.5), ("tetrapod", 0.52), ("ripple", 0.75), ("ripple", 0.73), ("wave", 0.875)]
    {
        let lag = 1.0 - duty;
        let sides = [(Side::Left, 0.0), (Side::Right, 0.5)];
        let legs = sides.iter().flat_map(|&(side, later)| {
            (0..4).map(move |row| (Leg { side, row, rows: 4 }, later + (3 - row) as f64 * lag))
        });
        let legs: Vec<(Leg, f64)> = legs.collect();
        assert_eq!(classify(&legs, duty).expect("a name").name, name, "duty factor {duty}");
    }
    let together = ["L1", "L3", "R2", "R4"];
    let tetrapod = templates(8).iter().find(|template| template.name == "tetrapod").expect("it");
    for (index, phase) in tetrapod.phases.iter().enumerate() {
        let side = if index < 4 { Side::Left } else { Side::Right };
        let leg = Leg { side, row: index % 4, rows: 4 }.to_string();
        assert_eq!(*phase == 0.0, together.contains(&leg.as_str()), "{leg}");
    }
}

#[test]
fn two_legs_walk_run_and_hop_and_other_numbers_have_no_names() {
    let name = |left: f64, right: f64, duty| named(&[("L", left), ("R", right)], duty).name;
    assert_eq!(name(0.0, 0.5, 0.6), "walk");
    assert_eq!(name(0.2, 0.72, 0.4), "run");
    assert_eq!(name(0.0, 0.03, 0.4), "hop");
    assert_eq!(name(0.0, 0.25, 0.4), "unclassified");
    let ten: Vec<(Leg, f64)> =
        (0..10).map(|index| (Leg { side: Side::Left, row: index, rows: 5 }, 0.0)).collect();
    assert_eq!(classify(&ten, 0.5), None);
    assert_eq!(classify(&[], 0.5), None);
}

#[test]
fn legs_are_written_as_they_are_called() {
    let names = |rows: usize| -> Vec<String> {
        (0..rows).map(|row| Leg { side: Side::Right, row, rows }.to_string()).collect()
    };
    assert_eq!(names(1), ["R"]);
    assert_eq!(names(2), ["RF", "RH"]);
    assert_eq!(names(3), ["RF", "RM", "RH"]);
    assert_eq!(names(4), ["R1", "R2", "R3", "R4"]);
}
