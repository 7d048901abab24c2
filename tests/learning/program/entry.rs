//! What leads from the standing pose into a gait.

use std::f64::consts::TAU;

use gaitwright_learning::learn::Posture;
use gaitwright_learning::program::entry::{Entered, entry, strides};
use gaitwright_learning::program::gaits::named;
use gaitwright_learning::program::legs::LegChain;
use gaitwright_learning::program::ring::{KEYFRAMES, Ring, Wanted};
use gaitwright_learning::program::steer;
use gaitwright_physics::motion::TrunkMeasure;
use nalgebra::Vector3;

use super::subject;

/// A joint that swings about `middle` by `size` once in 0.8 s, at `count` moments of its cycle.
fn swinging(middle: f64, size: f64, count: usize) -> Vec<Posture> {
    let posture = |index: usize| {
        let angle = TAU * index as f64 / count as f64;
        Posture {
            angles: vec![middle + size * angle.sin()],
            velocities: vec![size * TAU / 0.8 * angle.cos()],
        }
    };
    (0..count).map(posture).collect()
}

/// Of cycles that are sampled finely the velocities are the slopes of the angles, and the entry leads from rest into the last cycle.
#[test]
fn an_entry_moves_as_its_velocities_say() {
    let count = 1000;
    let (on_the_spot, cycle) = (swinging(0.3, 0.2, count), swinging(-0.1, 0.5, count));
    let duration = 0.8 / count as f64;
    for first in [None, Some(Entered { cycle: &on_the_spot, strides: 1 })] {
        let entered: Vec<Entered<'_>> =
            first.into_iter().chain([Entered { cycle: &cycle, strides: 2 }]).collect();
        let postures = entry(&[0.7], &entered, duration);
        assert_eq!(postures.len(), 2 * count - 1);
        for (index, around) in postures.windows(3).enumerate() {
            let slope = (around[2].angles[0] - around[0].angles[0]) / (2.0 * duration);
            // The third derivative of both, at most 2000 rad/s³, times a sixth of the square of the spacing; and where the first has grown
            // to its size, a quarter of the spacing times the acceleration with which it grew, 0.5 (π / 0.8 s)² times at most 0.6 rad.
            let jump = if index + 2 == count {
                0.25 * duration * 0.5 * (0.5 * TAU / 0.8).powi(2) * 0.6
            } else {
                0.0
            };
            let bound = 2000.0 / 6.0 * duration.powi(2) + jump;
            assert!((slope - around[1].velocities[0]).abs() < bound, "{slope}, {}", around[1].velocities[0]);
        }
        let [start, end] = [&postures[0], &postures[2 * count - 2]];
        assert!((start.angles[0] - 0.7).abs() < 1e-5 && start.velocities[0].abs() < 0.02);
        let [angle, rate] = [cycle[count - 1].angles[0], cycle[count - 1].velocities[0]];
        assert!((end.angles[0] - angle).abs() < 1e-5 && (end.velocities[0] - rate).abs() < 0.02);
        // Half-way it steps on the spot with all its size already, or with half of the cycle's.
        let half = &postures[count - 1].angles[0];
        let expected = if entered.len() == 2 { 0.5 * (0.3 - 0.1) } else { 0.5 * (0.7 - 0.1) };
        assert!((half - expected).abs() < 1e-9, "{half}");
    }
    assert!(entry(&[0.7], &[], duration).is_empty());
}

/// What balances lifts its feet as high as in the gait before it goes anywhere; what only keeps its heading grows into the gait evenly.
#[test]
fn what_balances_steps_before_it_goes() {
    let subject = subject("biped.urdf", [1.0, 0.0, 0.0]);
    let legs = &subject.legs;
    let wanted = Wanted::at_froude(legs, named("walk", legs).unwrap(), 0.05, subject.gravity());
    let seed = &subject.seeds(&wanted.gait)[0];
    let balancing = &steer::starts(seed, true)[0].parameters;
    let heading = &steer::by_heading(&seed.parameters)[0];
    assert!(steer::balances(balancing) && !steer::balances(heading) && !steer::balances(&seed.parameters));
    let rings = [&seed.parameters, heading, balancing].map(|parameters| subject.ring(&wanted, parameters).0);
    let [plain, heading, balancing] = &rings;
    assert_eq!(plain.entry, heading.entry);
    assert_eq!(plain.cycle, balancing.cycle);
    assert_eq!(plain.entry.len(), balancing.entry.len());
    let measures = |ring: &Ring| {
        ring.steering
            .as_ref()
            .map_or(0, |it| it.tables.iter().filter(|table| table.measure != TrunkMeasure::Heading).count())
    };
    assert_eq!(rings.each_ref().map(measures), [0, 0, 4]);
    let count = strides(wanted.speed, wanted.gravity, plain.period);
    assert_eq!(plain.entry.len(), count * KEYFRAMES - 1);
    // How far feet go up and down, or back and forth, against the trunk: of the leg that does so least.
    let spread = |postures: &[Posture], axis: usize| {
        let of_leg = |leg: &LegChain| {
            let place = |posture: &Posture| {
                let own: Vec<f64> = leg.joints.iter().map(|&joint| posture.angles[joint]).collect();
                let foot: Vector3<f64> = leg.place(&own).foot;
                foot[axis]
            };
            let [least, greatest] = postures
                .iter()
                .map(place)
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[least, greatest], at| {
                    [least.min(at), greatest.max(at)]
                });
            greatest - least
        };
        legs.legs.iter().map(of_leg).fold(f64::INFINITY, f64::min)
    };
    // A stride that begins half-way through the first. A foot is highest in the middle of its swing, the first at three quarters of the
    // first stride, where steps have grown to 0.85 of their size, and the way to 0.31; at the end of this stride to 0.69.
    let early = |ring: &Ring| ring.entry[KEYFRAMES / 2..KEYFRAMES + KEYFRAMES / 2].to_vec();
    let [lift_of_plain, lift_of_balancing, lift] =
        [&early(plain), &early(balancing), &plain.cycle].map(|postures| spread(postures, 2));
    assert!(lift_of_balancing > 0.8 * lift, "{lift_of_balancing} m of {lift} m");
    assert!(lift_of_plain < 0.5 * lift, "{lift_of_plain} m of {lift} m");
    let [way_of_balancing, way] = [&early(balancing), &plain.cycle].map(|postures| spread(postures, 0));
    assert!(way_of_balancing < 0.75 * way, "{way_of_balancing} m of {way} m");
}
