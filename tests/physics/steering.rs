//! Feedback through cells of the trunk: what is measured of it, what is added to the targets, and that limits are kept.

use gaitwright_physics::motion::{
    KeyframeChange, Player, Playing, Steering, SteeringTable, TargetLimits, TrunkMeasure, hermite,
};
use gaitwright_physics::sim::Root;
use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;

fn root(orientation: UnitQuaternion<f64>, angular_velocity: Vector3<f64>) -> Root {
    Root {
        position: Point3::new(0.3, -0.2, 0.4),
        orientation,
        linear_velocity: Vector3::new(0.4, 0.1, -0.2),
        angular_velocity,
    }
}

fn about(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(axis * angle)
}

proptest! {
    /// A root that turns about the vertical and leans toward a level axis of its own, however it was placed at first.
    #[test]
    fn heading_lean_and_its_rate_are_those_that_were_put_in(
        placed in prop::array::uniform3(-2.0..2.0_f64),
        heading in -3.0..3.0_f64,
        lean in -1.2..1.2_f64,
        toward in -3.0..3.0_f64,
        way in -3.0..3.0_f64,
        rates in prop::array::uniform3(-2.0..2.0_f64),
    ) {
        let start = root(UnitQuaternion::from_scaled_axis(Vector3::from(placed)), Vector3::zeros());
        let direction = [way.cos(), way.sin()];
        // Leaning toward a bearing is turning about the level axis to its left.
        let leaning = about(Vector3::new(-toward.sin(), toward.cos(), 0.0), lean);
        let turning = about(Vector3::z(), heading);
        let forward = Vector3::new(direction[0], direction[1], 0.0);
        let left = Vector3::z().cross(&forward);
        // Turning about the left leans forward, and against the way leans to the left.
        let spin = left * rates[0] - forward * rates[1] + Vector3::z() * rates[2];
        let now = root(turning * leaning * start.orientation, turning * spin);
        let measured = |measure: TrunkMeasure| measure.of(&now, &start, direction);
        prop_assert!((measured(TrunkMeasure::Heading) - heading).abs() < 1e-9);
        prop_assert!((measured(TrunkMeasure::ForwardTiltRate) - rates[0]).abs() < 1e-9);
        prop_assert!((measured(TrunkMeasure::LeftTiltRate) - rates[1]).abs() < 1e-9);
        let along = (lean.sin() * (toward - way).cos()).atan2(lean.cos());
        let aside = (lean.sin() * (toward - way).sin()).atan2(lean.cos());
        prop_assert!((measured(TrunkMeasure::ForwardTilt) - along).abs() < 1e-9);
        prop_assert!((measured(TrunkMeasure::LeftTilt) - aside).abs() < 1e-9);
    }
}

/// One joint, from 0 through an entry of one posture into a loop of two, half a second apart.
fn player() -> Player {
    let entry = [([0.5], [0.0])];
    let cycle = [([1.0], [0.2]), ([-1.0], [0.0])];
    let parts = |postures: &[([f64; 1], [f64; 1])]| postures.to_vec();
    let (entry, cycle) = (parts(&entry), parts(&cycle));
    Player::from_postures(
        &[0.0],
        entry.iter().map(|(q, v)| (&q[..], &v[..])),
        cycle.iter().map(|(q, v)| (&q[..], &v[..])),
        0.5,
    )
}

fn change(angle: f64, velocity: f64) -> KeyframeChange {
    KeyframeChange { angles: vec![angle], velocities: vec![velocity] }
}

/// Adds 0.1 and 0.2 at the two keyframes where the heading is to the right, nothing near 0, and takes as much away to the left.
fn by_heading() -> Steering {
    let ring = |times: f64| vec![change(0.1 * times, 0.0), change(0.2 * times, 0.3 * times)];
    Steering {
        direction: [1.0, 0.0],
        tables: vec![SteeringTable {
            measure: TrunkMeasure::Heading,
            bounds: vec![-0.1, 0.1],
            rings: vec![ring(1.0), ring(0.0), ring(-1.0)],
        }],
    }
}

fn headed(heading: f64) -> Root {
    root(about(Vector3::z(), heading), Vector3::zeros())
}

#[test]
fn the_ring_is_chosen_at_a_keyframe_and_met_at_the_next() {
    let player = player().steered(Some(by_heading()));
    let mut playing = Playing::new(&player, &headed(0.0));
    let mut at = |t: f64, heading: f64| {
        let mut target = [f64::NAN];
        playing.targets(&player, t, &headed(heading), &mut target);
        target[0]
    };
    let spline = |from: (f64, f64), to: (f64, f64)| hermite(from, to, 0.5, 0.2);
    // The standing pose is left as it is. The entry's keyframe counts as the loop's second.
    assert_eq!(at(0.0, -0.3), 0.0);
    assert!((at(0.2, 0.0) - spline((0.0, 0.0), (0.5 + 0.2, 0.3))).abs() < 1e-12);
    // What the heading is between keyframes does not matter.
    assert!((at(0.5, -0.2) - 0.7).abs() < 1e-12);
    assert!((at(0.7, 0.9) - spline((0.7, 0.3), (1.0 + 0.1, 0.2))).abs() < 1e-12);
    // Straight on: nothing is added.
    assert!((at(1.0, 0.05) - 1.1).abs() < 1e-12);
    assert!((at(1.2, 0.0) - spline((1.1, 0.2), (-1.0, 0.0))).abs() < 1e-12);
    assert!((at(1.5, -0.05) + 1.0).abs() < 1e-12);
    assert!((at(1.7, 0.4) - spline((-1.0, 0.0), (1.0, 0.2))).abs() < 1e-12);
    // To the left, in the second round of the loop.
    assert!((at(2.0, 0.3) - 1.0).abs() < 1e-12);
    assert!((at(2.2, 0.3) - spline((1.0, 0.2), (-1.0 - 0.2, -0.3))).abs() < 1e-12);
}

/// A step that is longer than a segment passes over keyframes: what is added at the beginning of the segment in which it ends is
/// that keyframe's change all the same.
#[test]
fn a_keyframe_that_was_stepped_over_has_its_change() {
    let player = player().steered(Some(by_heading()));
    let mut playing = Playing::new(&player, &headed(0.0));
    let mut target = [0.0];
    for t in [0.0, 0.2, 1.2] {
        playing.targets(&player, t, &headed(-0.2), &mut target);
    }
    let wanted = hermite((1.0 + 0.1, 0.2), (-1.0 + 0.2, 0.3), 0.5, 0.2);
    assert!((target[0] - wanted).abs() < 1e-12, "{} is not {wanted}", target[0]);
}

#[test]
fn changes_of_several_measures_add_up() {
    let mut steering = by_heading();
    steering.tables.push(SteeringTable { measure: TrunkMeasure::LeftTilt, ..steering.tables[0].clone() });
    let player = player().steered(Some(steering));
    let start = headed(0.0);
    let mut playing = Playing::new(&player, &start);
    let tilted = root(about(Vector3::z(), -0.2) * about(Vector3::x(), 0.2), Vector3::zeros());
    let mut target = [0.0];
    playing.targets(&player, 0.0, &tilted, &mut target);
    playing.targets(&player, 0.2, &tilted, &mut target);
    // To the right adds what leaning to the right adds, too: a turn about the way leans to the right.
    let wanted = hermite((0.0, 0.0), (0.5 + 0.4, 0.6), 0.5, 0.2);
    assert!((target[0] - wanted).abs() < 1e-12, "{} is not {wanted}", target[0]);
}

#[test]
fn without_steering_it_plays_what_the_player_gives() {
    let player = player();
    let mut playing = Playing::new(&player, &headed(0.0));
    for index in 0..5000 {
        let t = 0.0017 * f64::from(index);
        let (mut own, mut plain) = ([0.0], [0.0]);
        playing.targets(&player, t, &headed(t), &mut own);
        player.targets(t, &mut plain);
        assert_eq!(own[0].to_bits(), plain[0].to_bits(), "{t}");
    }
}

/// Angle and rate.
type Knot = (f64, f64);

/// Angles, rates and two tables of changes at three keyframes, and limits that the keyframes keep.
fn drawn() -> impl Strategy<Value = (Vec<Knot>, Vec<Vec<Knot>>, TargetLimits)> {
    let knot = || (-1.0..1.0_f64, -2.0..2.0_f64);
    let knots = prop::collection::vec(knot(), 3);
    let rings = prop::collection::vec(prop::collection::vec(knot(), 3), 4);
    (knots, rings, 0.0..1.0_f64, 0.0..4.0_f64).prop_map(|(knots, rings, wide, fast)| {
        let limits = TargetLimits { range: Some([-1.6 - wide, 1.6 + wide]), speed: Some(12.0 + fast) };
        (knots, rings, limits)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// Whatever cells the trunk falls into, targets keep to their limits.
    #[test]
    fn targets_keep_to_their_limits_in_every_cell(
        (knots, rings, limits) in drawn(),
        headings in prop::collection::vec(-0.3..0.3_f64, 12),
    ) {
        let ring = |changes: &[(f64, f64)]| changes.iter().map(|&(angle, rate)| change(angle, rate)).collect();
        let table = |measure, rings: &[Vec<(f64, f64)>]| SteeringTable {
            measure,
            bounds: vec![0.0],
            rings: rings.iter().map(|changes| ring(changes)).collect(),
        };
        let tables =
            vec![table(TrunkMeasure::Heading, &rings[..2]), table(TrunkMeasure::LeftTilt, &rings[2..])];
        let steering = Steering { direction: [1.0, 0.0], tables };
        let columns: Vec<([f64; 1], [f64; 1])> = knots.iter().map(|(q, v)| ([*q], [*v])).collect();
        let start = columns[0].0;
        let parts = columns.iter().map(|(q, v)| (q.as_slice(), v.as_slice()));
        let plain = Player::from_postures(&start, [], parts, 0.5);
        let steering = plain.kept_within(steering, &[limits]);
        let player = plain.steered(Some(steering));
        // From the pose in which play starts into the loop, and round it.
        let mut path = vec![(start[0], 0.0)];
        path.extend(knots.iter().chain(&knots[..1]));
        // Keyframes may lie beyond the limits; then nothing is added.
        let keeps = path.windows(2).all(|pair| limits.hold(pair[0], pair[1], 0.5, 0.0));
        let mut playing = Playing::new(&player, &headed(0.0));
        let (mut last, h) = (None, 0.5 / 64.0);
        for step in 0..64 * 12 {
            let heading = headings[step / 64];
            let tilted = root(about(Vector3::z(), heading) * about(Vector3::x(), -heading), Vector3::zeros());
            let mut target = [0.0];
            playing.targets(&player, step as f64 * h, &tilted, &mut target);
            if keeps {
                let [lower, upper] = limits.range.unwrap();
                prop_assert!(target[0] >= lower - 1e-9 && target[0] <= upper + 1e-9, "{}", target[0]);
                if let Some(last) = last {
                    let rate: f64 = (target[0] - last) / h;
                    prop_assert!(rate.abs() <= limits.speed.unwrap() + 1e-6, "{rate}");
                }
            }
            last = Some(target[0]);
        }
    }
}
