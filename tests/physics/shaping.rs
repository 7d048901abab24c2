//! Splines that leave a joint's range or exceed its speed, shaped and refused.

use gaitwright_physics::character::{Options, read_file};
use gaitwright_physics::motion::{
    Motion, Player, TargetLimits, hermite, hermite_rate, hermite_rate_range, shape,
};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::common;

/// Angles and rates of one joint, visited one after the other.
type Course = Vec<(f64, f64)>;

/// Shapes one joint's course from `start`, of which the knots from number `cycle` on are visited over and over. Returns
/// the course and the transition time.
fn shaped(start: f64, course: &Course, cycle: usize, time: f64, limits: TargetLimits) -> (Course, f64) {
    let mut columns: Vec<([f64; 1], [f64; 1])> = course.iter().map(|(q, v)| ([*q], [*v])).collect();
    let mut postures: Vec<(&mut [f64], &mut [f64])> =
        columns.iter_mut().map(|(q, v)| (q.as_mut_slice(), v.as_mut_slice())).collect();
    let time = shape(&[start], &mut postures, cycle, time, &[limits]);
    (columns.into_iter().map(|([q], [v])| (q, v)).collect(), time)
}

/// Every segment of a course: from each knot to the next, and from the last to the first of the cycle.
fn segments(start: f64, course: &Course, cycle: usize) -> Vec<[(f64, f64); 2]> {
    let knots: Course =
        [(start, 0.0)].into_iter().chain(course.iter().copied()).chain([course[cycle]]).collect();
    knots.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// Greatest excess over the limits among dense samples, rad and rad/s.
fn excess(start: f64, course: &Course, cycle: usize, time: f64, limits: TargetLimits) -> (f64, f64) {
    let (mut outside, mut too_fast) = (f64::MIN, f64::MIN);
    for [from, to] in segments(start, course, cycle) {
        for sample in 0..=500 {
            let t = time * f64::from(sample) / 500.0;
            if let Some([lower, upper]) = limits.range {
                let value = hermite(from, to, time, t);
                outside = outside.max(lower - value).max(value - upper);
            }
            if let Some(speed) = limits.speed {
                too_fast = too_fast.max(hermite_rate(from, to, time, t).abs() - speed);
            }
        }
    }
    (outside, too_fast)
}

/// A random course with limits: its angles are within the range, so that only what is between them is not.
fn drawn() -> impl Strategy<Value = (f64, Course, usize, f64, TargetLimits)> {
    let limits = (-2.0..0.5_f64, 0.05..3.0_f64, 0.5..30.0_f64, 0u8..4);
    let shares = prop::collection::vec((0.0..=1.0_f64, -30.0..30.0_f64), 1..12);
    (limits, shares, 0.0..=1.0_f64, 0.0..1.0_f64, 0.02..1.0_f64).prop_map(
        |((lower, width, speed, given), shares, start, cycle, time)| {
            let angle = |share: f64| lower + share * width;
            let course: Course = shares.iter().map(|(share, rate)| (angle(*share), *rate)).collect();
            let cycle = (cycle * course.len() as f64) as usize;
            let limits = TargetLimits {
                range: (given & 1 == 0).then_some([lower, lower + width]),
                speed: (given & 2 == 0).then_some(speed),
            };
            (angle(start), course, cycle, time, limits)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn nothing_is_exceeded_and_no_angle_moves((start, course, cycle, time, limits) in drawn()) {
        let before = excess(start, &course, cycle, time, limits);
        let (after, slowed) = shaped(start, &course, cycle, time, limits);
        let left = excess(start, &after, cycle, slowed, limits);
        prop_assert!(left.0 < 1e-8 && left.1 < 1e-7, "{left:?} of {before:?}");
        prop_assert!(slowed >= time);
        for (asked, kept) in course.iter().zip(&after) {
            prop_assert_eq!(asked.0, kept.0);
            prop_assert!(asked.1 * kept.1 >= 0.0 && kept.1.abs() <= asked.1.abs(), "{asked:?} became {kept:?}");
        }
        // The time is longer only where knots at rest would be too far apart for the speed, and no longer than that.
        let farthest = segments(start, &course, cycle).iter().map(|[a, b]| (b.0 - a.0).abs()).fold(0.0, f64::max);
        let needed = limits.speed.map_or(0.0, |speed| 1.5 * farthest / speed);
        prop_assert!(slowed <= time.max(needed), "{slowed} of {time}, {needed}");
        let again = shaped(start, &course, cycle, time, limits);
        prop_assert_eq!(&again, &(after.clone(), slowed), "the same every time");
        // What is within the limits by the samples, with room for what they miss, stays as it is.
        if before.0 < -1e-3 && before.1 < -0.1 {
            prop_assert_eq!(&after, &course);
            prop_assert_eq!(slowed.to_bits(), time.to_bits());
        }
        let (settled, kept) = shaped(start, &after, cycle, slowed, limits);
        prop_assert_eq!((settled, kept), (after, slowed), "shaped once is shaped");
    }

    /// The same keyframes as a motion that is played: continuous with its rate, and never beyond the limits.
    #[test]
    fn what_is_played_is_continuous_with_its_rate((start, course, cycle, time, limits) in drawn()) {
        let (course, time) = shaped(start, &course, cycle, time, limits);
        let columns: Vec<([f64; 1], [f64; 1])> = course.iter().map(|(q, v)| ([*q], [*v])).collect();
        let postures = columns.iter().map(|(q, v)| (q.as_slice(), v.as_slice()));
        let (entry, ring) = (postures.clone().take(cycle), postures.skip(cycle));
        let player = Player::from_postures(&[start], entry, ring, time);
        let at = |t: f64| {
            let mut target = [0.0];
            player.targets(t, &mut target);
            target[0]
        };
        let h = 1e-5 * time;
        for knot in 1..2 * course.len() + 2 {
            let t = time * knot as f64;
            let (before, after) = ((at(t) - at(t - h)) / h, (at(t + h) - at(t)) / h);
            // By less than the spline's curvature, 6 |Δq| / T² + 4 |v| / T at most at either end, allows.
            let bend = h * (40.0 / (time * time) + 300.0 / time) + 1e-9 / h;
            prop_assert!((before - after).abs() < bend, "{before} before, {after} after {t} s");
        }
    }

    #[test]
    fn the_range_of_the_rate_is_that_of_dense_samples(
        from in (-3.0..3.0_f64, -20.0..20.0_f64),
        to in (-3.0..3.0_f64, -20.0..20.0_f64),
        duration in 0.02..2.0_f64,
    ) {
        let (least, greatest) = hermite_rate_range(from, to, duration);
        let rates = (0..=4000).map(|index| hermite_rate(from, to, duration, duration * f64::from(index) / 4000.0));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for rate in rates {
            low = low.min(rate);
            high = high.max(rate);
        }
        let scale = 1.0 + (to.0 - from.0).abs() / duration;
        prop_assert!(least <= low + 1e-9 * scale && high <= greatest + 1e-9 * scale);
        prop_assert!(low - least < 1e-4 * scale && greatest - high < 1e-4 * scale, "{least}..{greatest}, seen {low}..{high}");
    }
}

/// From 0 at the rate v to rest at 0 within T, the spline rises to 4/27 v T: the greatest rate below a limit u is 27/4 u/T.
#[test]
fn a_rate_is_scaled_to_what_the_closed_form_allows() {
    let limits = TargetLimits { range: Some([-1.0, 0.1]), speed: None };
    let (course, time) = shaped(0.0, &vec![(0.0, 20.0), (0.0, 0.0), (-0.5, 0.0)], 3, 0.25, limits);
    assert_eq!(time, 0.25);
    assert!((course[0].1 - 27.0 / 4.0 * 0.1 / 0.25).abs() < 1e-6, "{course:?}");
    // Between 0 and 1 at equal rates v the middle has 1.5 / T − v / 2: a limit of 1.7 / T bounds −v by 0.4 / T.
    let limits = TargetLimits { range: None, speed: Some(17.0) };
    let (course, time) = shaped(0.0, &vec![(0.0, -10.0), (1.0, -10.0), (0.5, 0.0)], 3, 0.1, limits);
    assert_eq!(time, 0.1);
    let middle = hermite_rate(course[0], course[1], 0.1, 0.05);
    assert!(middle <= 17.0 + 1e-6 && middle > 16.5, "{middle}: {course:?}");
}

/// Two knots 3 rad apart, at most 9 rad/s: between knots at rest that takes 1.5 · 3 / 9 s, whatever the rates were.
#[test]
fn a_way_that_is_too_long_for_the_speed_takes_longer() {
    let limits = TargetLimits { range: Some([-2.0, 2.0]), speed: Some(9.0) };
    let (course, time) = shaped(0.0, &vec![(-1.5, 4.0), (1.5, -4.0)], 0, 0.1, limits);
    assert!((time - 0.5).abs() < 1e-12, "{time}");
    assert_eq!((course[0].0, course[1].0), (-1.5, 1.5));
    // At exactly the speed that is needed, there is no room for the rates left.
    assert!(course.iter().all(|knot| knot.1.abs() < 1e-3), "{course:?}");
}

#[test]
fn an_angle_outside_of_the_range_is_moved_to_its_end() {
    let limits = TargetLimits { range: Some([-1.0, 1.0]), speed: None };
    let (course, time) = shaped(0.0, &vec![(1.4, 0.0), (-1.2, 3.0)], 0, 0.3, limits);
    assert_eq!((course[0], course[1].0, time), ((1.0, 0.0), -1.0, 0.3));
}

/// The bundled walk with what `change` does to its document.
fn walk(change: impl FnOnce(&mut Value)) -> Result<Player, String> {
    let character = read_file(&common::example_path("quadruped.urdf"), Options::default()).unwrap().character;
    let text = std::fs::read(common::example_path("quadruped-walk.motion.json")).unwrap();
    let mut document: Value = serde_json::from_slice(&text).unwrap();
    change(&mut document);
    let motion = Motion::parse(document.to_string().as_bytes()).map_err(|error| error.to_string())?;
    Player::new(&motion, &motion.joints, &TargetLimits::of(&character)).map_err(|error| error.to_string())
}

#[test]
fn a_document_beyond_the_limits_is_refused_with_keyframe_joint_and_value() {
    walk(|_| {}).unwrap();
    let too_far = walk(|document| {
        document["keyframes"][1]["angles"][2] = json!(-3.5);
        document["keyframes"][1]["velocities"][2] = json!(0.0);
    });
    let too_far = too_far.unwrap_err();
    assert!(
        too_far.contains("/keyframes/1/angles/2: the joint \"LF_knee\"") && too_far.contains("-3.5"),
        "{too_far}"
    );
    assert!(too_far.contains("its range is"), "{too_far}");
    let too_fast = walk(|document| document["keyframes"][1]["velocities"][1] = json!(400.0)).unwrap_err();
    assert!(
        too_fast.contains("/keyframes/1/velocities/1: the joint \"LF_swing\"") && too_fast.contains("400"),
        "{too_fast}"
    );
    assert!(too_fast.contains("its greatest speed is"), "{too_fast}");
}

/// Numbers with nine digits are within what their author wrote them for.
#[test]
fn rounding_breaks_no_limit() {
    let limits = TargetLimits { range: Some([-1.0, 1.0]), speed: Some(5.0) };
    let slack = 1e-6;
    assert!(limits.hold((1.0 + 4e-7, 0.0), (-1.0, 0.0), 1.0, slack));
    assert!(!limits.hold((1.0 + 4e-6, 0.0), (-1.0, 0.0), 1.0, slack));
    assert!(limits.hold((0.0, 5.000001), (0.5, 0.0), 1.0, slack));
    assert!(!limits.hold((0.0, 5.1), (0.5, 0.0), 1.0, slack));
}
