//! Searches for gaits: where they begin, which parameters they change, what they ask for on the way, and their determinism.

use gaitwright_learning::learn::{Cancel, Stop};
use gaitwright_learning::program::candidate::evaluate;
use gaitwright_learning::program::cost::{HOLDS, undisturbed};
use gaitwright_learning::program::figures::RolloutFigures;
use gaitwright_learning::program::gaits::gaits;
use gaitwright_learning::program::refine::Refinement;
use gaitwright_learning::program::ring::{PARAMETERS, Ring, SIDEWAYS, TURN, Wanted};
use gaitwright_learning::program::rollout::STRIDES;
use gaitwright_learning::program::searched::searched;
use gaitwright_learning::program::starts::Starts;
use gaitwright_learning::program::subject::Subject;

use crate::program::{GRAVITY, brisk, subject, trot};

#[test]
fn a_search_changes_just_what_changes_the_gait() {
    let mut checked = 0;
    for name in ["quadruped.urdf", "biped.urdf", "hexapod.json"] {
        let subject = subject(name, [1.0, 0.0, 0.0]);
        let legs = &subject.legs;
        for gait in gaits(legs.legs.len()) {
            let wanted = Wanted::at_froude(legs, gait, gait.froude[1], GRAVITY);
            let all = searched(legs, &wanted, PARAMETERS);
            // Not at zero, where what belongs to a trunk that does not pitch or heave might do nothing either; but straight on,
            // or legs of a pair would have different ways.
            let base = |index: usize| {
                if all.contains(&index) && ![SIDEWAYS, TURN].contains(&index) { -0.5 } else { 0.0 }
            };
            let base: Vec<f64> = (0..PARAMETERS).map(base).collect();
            let (ring, gains) = subject.ring(&wanted, &base);
            for index in 0..PARAMETERS {
                let mut changed = base.clone();
                changed[index] += 0.3;
                let (other, other_gains) = subject.ring(&wanted, &changed);
                let off = |a: &Ring, b: &Ring| {
                    let postures = a.cycle.iter().zip(&b.cycle);
                    let joints = postures.flat_map(|(a, b)| a.angles.iter().zip(&b.angles));
                    joints.map(|(a, b)| (a - b).abs()).fold((a.period - b.period).abs(), f64::max)
                };
                let changes = off(&ring, &other) > 1e-12 || gains != other_gains;
                let place = format!("parameter {index} of the {} of {name}", gait.name);
                assert_eq!(changes, all.contains(&index), "{place}");
                checked += usize::from(!changes);
            }
            // What sets a way straight is left out where that is done in the end.
            let straightened = searched(legs, &wanted.straightened_later(), PARAMETERS);
            let left = all.iter().filter(|index| ![SIDEWAYS, TURN].contains(index));
            assert!(left.eq(&straightened));
        }
    }
    assert!(checked > 30, "{checked} parameters that do nothing");
}

#[test]
fn what_is_set_straight_in_the_end_costs_nothing_until_then() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let wanted = trot(&subject.legs);
    let (arena, parameters) = (subject.arena().unwrap(), brisk());
    let (ring, gains) = subject.ring(&wanted, &parameters);
    let figures = arena.run(&ring, &gains, STRIDES);
    let later = wanted.clone().straightened_later();
    let cost = |wanted: &Wanted, yaw: f64, sideways: f64| {
        let figures = RolloutFigures { yaw, sideways, ..figures.clone() };
        undisturbed(wanted, ring.period, &subject.legs, &figures)
    };
    let straight = cost(&wanted, 0.0, 0.0);
    assert!(cost(&wanted, 0.04, 0.0) > straight && cost(&wanted, 0.0, -0.04) > straight);
    assert_eq!(cost(&later, 0.04, -0.04), straight);
    // More than can be mended costs what is left of it.
    assert!((cost(&later, -0.15, 0.0) - cost(&wanted, -0.1, 0.0)).abs() < 1e-9);
    assert!(cost(&later, 0.0, 0.15) > HOLDS);
}

#[test]
fn starts_are_ranked_by_what_they_cost_and_the_last_stands_for_all_beyond() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let wanted = trot(&subject.legs);
    let arena = subject.arena().unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let stop = Stop::default();
    let seeds = subject.seeds(&wanted.gait);
    let starts = Starts::new((&pool, &stop), &subject, &arena, &wanted, &seeds, STRIDES).unwrap();
    let cost = |rank| Refinement::new(&subject, &wanted, (&starts, rank), (STRIDES, 0, 1)).best().cost;
    let costs: Vec<f64> = (0..seeds.len() + 1).map(cost).collect();
    // What hardly breaks a constraint is not behind all that hold them.
    let promise = |cost: f64| if cost < HOLDS { cost } else { cost - HOLDS };
    assert!(costs.iter().copied().map(promise).is_sorted(), "{costs:?}");
    let each =
        seeds.iter().map(|seed| promise(evaluate(&subject, &arena, &wanted, &seed.parameters, STRIDES).cost));
    assert_eq!(promise(costs[0]), each.fold(f64::INFINITY, f64::min));
    assert!(costs[0] < costs[1], "{costs:?}");
    assert_eq!(costs[seeds.len()], costs[seeds.len() - 1]);
}

/// A few generations with this many threads.
fn refined(subject: &Subject, threads: usize) -> Refinement {
    let wanted = trot(&subject.legs);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let arena = subject.arena().unwrap();
    let stop = Stop::new(&Cancel::default(), None);
    let starts = &subject.seeds(&wanted.gait)[..4];
    let starts = Starts::new((&pool, &stop), subject, &arena, &wanted, starts, STRIDES).unwrap();
    let mut refinement = Refinement::new(subject, &wanted, (&starts, 0), (STRIDES, 1, 7));
    for _ in 0..2 {
        refinement.generation((&pool, &stop), subject, &arena, &wanted).unwrap();
    }
    refinement
}

#[test]
fn a_refinement_gives_the_same_bits_with_any_threads() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let (alone, together) = (refined(&subject, 1), refined(&subject, 3));
    assert_eq!(alone.best(), together.best());
    assert_eq!(alone.evaluations, 2 * 16);
    // A cancelled generation leaves everything as it was.
    let cancel = Cancel::default();
    cancel.cancel();
    let mut stopped = alone.clone();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (arena, wanted) = (subject.arena().unwrap(), trot(&subject.legs));
    let stop = Stop::new(&cancel, None);
    assert!(stopped.generation((&pool, &stop), &subject, &arena, &wanted).is_err());
    assert_eq!(stopped.best(), alone.best());
}
