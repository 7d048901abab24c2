//! Where searches for gaits begin: what the template and the seeds do before any search, and how a way is set straight.

use gaitwright_learning::learn::Stop;
use gaitwright_learning::program::candidate::evaluate;
use gaitwright_learning::program::cost::{HOLDS, undisturbed};
use gaitwright_learning::program::gaits::named;
use gaitwright_learning::program::ring::{SIDEWAYS, SWAY, Wanted};
use gaitwright_learning::program::rollout::STRIDES;
use gaitwright_learning::program::seeds::Seed;
use gaitwright_learning::program::steer;
use gaitwright_learning::program::straightening::{Straightened, Straightening};
use gaitwright_learning::program::subject::Subject;
use gaitwright_physics::scene::Accuracy;

use super::program::{GRAVITY, brisk, subject, trot};

#[test]
fn the_template_walks_before_any_search() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let wanted = Wanted::at_froude(&subject.legs, named("walk", &subject.legs).unwrap(), 0.1, GRAVITY);
    let arena = subject.arena().unwrap();
    // More than half of the seeds stay up over twenty strides, and more than without the sway.
    let upright = |sway: f64| {
        subject
            .seeds(&wanted.gait)
            .iter()
            .filter(|seed| {
                let mut parameters = seed.parameters.clone();
                parameters[SWAY] = sway;
                let (ring, gains) = subject.ring(&wanted, &parameters);
                arena.run(&ring, &gains, 4 * STRIDES).upright >= 1.0
            })
            .count()
    };
    let (swaying, stiff) = (upright(0.0), upright(-2.5));
    assert!(
        2 * swaying > subject.seeds(&wanted.gait).len() && swaying > stiff,
        "{swaying} with the sway, {stiff} without"
    );
}

#[test]
fn leaps_hold_their_constraints_before_any_search() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let arena = subject.arena().unwrap();
    for (gait, froude) in [("bound", 1.0), ("transverse gallop", 2.0)] {
        let wanted = Wanted::at_froude(&subject.legs, named(gait, &subject.legs).unwrap(), froude, GRAVITY);
        let cost = |seed: &Seed| {
            let (ring, gains) = subject.ring(&wanted, &seed.parameters);
            undisturbed(&wanted, ring.period, &subject.legs, &arena.run(&ring, &gains, STRIDES))
        };
        let least = subject.seeds(&wanted.gait).iter().map(cost).fold(f64::INFINITY, f64::min);
        assert!(least < HOLDS, "{gait}: {least}");
    }
}

/// Leaps promise more where searches for them ended than at the template: half of what speaks against them is gone.
#[test]
fn leaps_begin_where_searches_for_them_ended() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let arena = subject.arena().unwrap();
    for (gait, froude) in
        [("canter", 1.0), ("bound", 1.0), ("transverse gallop", 2.0), ("rotary gallop", 2.0)]
    {
        let wanted = Wanted::at_froude(&subject.legs, named(gait, &subject.legs).unwrap(), froude, GRAVITY);
        let seeds = subject.seeds(&wanted.gait);
        let farthest = seeds.iter().map(|seed| seed.reach).fold(0.0, f64::max);
        let least = |near: bool| {
            let own = seeds.iter().filter(|seed| (seed.reach < farthest) == near);
            let cost = |seed: &Seed| {
                let cost = evaluate(&subject, &arena, &wanted, &seed.parameters, STRIDES).cost;
                if cost < HOLDS { cost } else { cost - HOLDS }
            };
            own.map(cost).fold(f64::INFINITY, f64::min)
        };
        let (near, far) = (least(true), least(false));
        assert!(near < 0.5 * far, "{gait}: {near} where others ended, {far} at the template");
    }
}

#[test]
fn a_way_is_set_straight_though_feedback_holds_the_heading() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let wanted = trot(&subject.legs);
    let arena = subject.arena().unwrap();
    let stop = Stop::default();
    let straightening =
        Straightening { subject: &subject, arena: &arena, wanted: &wanted, strides: 40, stop: &stop };
    let sideways = |parameters: &[f64]| {
        let crooked = straightening.disturbed(parameters).unwrap();
        let Straightened { candidate: straight, evaluations, seconds } =
            straightening.straightened(crooked.clone()).unwrap();
        assert!(evaluations > 0 && seconds > straight.figures.seconds);
        assert_eq!(straight.parameters.len(), parameters.len());
        assert!(straight.cost < crooked.cost, "{} after {}", straight.cost, crooked.cost);
        [&crooked, &straight].map(|tried| tried.figures.sideways.abs())
    };
    // Sent aside by 18 % of its way; a twentieth is what a constraint allows.
    let mut parameters = brisk();
    parameters[SIDEWAYS] = 6.0;
    let [before, after] = sideways(&parameters);
    assert!(before > 0.05 && after < 0.05, "{before} before, {after} after");
    // With feedback the way jumps where another cell is chosen, at about half of what it was.
    for parameters in steer::by_heading(&parameters) {
        let [before, after] = sideways(&parameters);
        assert!(before > 0.05 && after < 0.55 * before, "{before} before, {after} after");
    }
}

#[test]
fn the_template_trots_before_any_search() {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let wanted = trot(&subject.legs);
    let arena = subject.arena().unwrap();
    let (ring, gains) = subject.ring(&wanted, &brisk());
    let figures = arena.run(&ring, &gains, 4 * STRIDES);
    assert_eq!(figures.upright, 1.0);
    assert!((figures.speed / wanted.speed - 1.0).abs() < 0.2, "{} m/s", figures.speed);
    // Diagonal legs push together, half a stride after the others.
    let apart = |a: usize, b: usize| {
        let apart = figures.legs[a].phase - figures.legs[b].phase;
        (apart - apart.round()).abs()
    };
    assert!(apart(0, 3) < 0.08 && apart(1, 2) < 0.08, "{:?}", figures.legs);
    assert!(apart(0, 1) > 0.4 && apart(0, 2) > 0.4, "{:?}", figures.legs);
    // The same motion at half the step.
    let finer = Subject { accuracy: Accuracy { step: 0.001, ..subject.accuracy }, ..subject.clone() };
    let again = finer.arena().unwrap().run(&ring, &gains, 4 * STRIDES);
    assert!((again.speed / figures.speed - 1.0).abs() < 0.05, "{} and {} m/s", figures.speed, again.speed);
}
