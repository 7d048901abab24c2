//! The frames that all formats are written from.

use gaitwright::export::{MotionFrame, SampledMotion};

use super::{Example, assert_near};

/// Steps over the seam of the loop, finely sampled: no joint and no part of the root jumps there or changes its rate
/// by more than it does elsewhere from one frame to the next.
#[test]
fn the_loop_closes_in_position_and_velocity() {
    for example in [Example::new(), Example::with_poses(), super::feet::bundled("walk")] {
        for fps in [24.0, 60.0, 1000.0] {
            let sampled = SampledMotion::new(&example.motion, example.character(), fps).unwrap();
            let frames = &sampled.cycle.frames;
            let (first, last) = (&frames[0], &frames[frames.len() - 1]);
            assert_eq!(first.angles, last.angles);
            assert_eq!(first.targets, last.targets);
            assert_eq!(first.root, last.root);
            if fps < 1000.0 {
                continue;
            }
            let numbers = |frame: &MotionFrame| {
                let q = frame.root.rotation;
                let root = frame.root.translation.vector.iter().copied().chain([q.i, q.j, q.k]);
                frame.angles.iter().copied().chain(root).collect::<Vec<f64>>()
            };
            // Twice round, so that the seam lies in the middle.
            let round = frames[..frames.len() - 1].iter().chain(frames).map(numbers).collect::<Vec<_>>();
            let seam = frames.len() - 1;
            for quantity in 0..round[0].len() {
                let bends: Vec<f64> = round
                    .windows(3)
                    .map(|three| (three[2][quantity] - 2.0 * three[1][quantity] + three[0][quantity]).abs())
                    .collect();
                // The bend at frame `k` stands at `k − 1`.
                let elsewhere = bends.iter().enumerate().filter(|(at, _)| *at + 1 != seam);
                let greatest = elsewhere.fold(0.0, |greatest: f64, (_, bend)| greatest.max(*bend));
                assert!(
                    bends[seam - 1] <= 1.2 * greatest + 1e-9,
                    "{quantity}: {} {greatest}",
                    bends[seam - 1]
                );
            }
        }
    }
}

#[test]
fn frames_have_the_length_the_travel_and_the_angles_of_the_motion() {
    let example = Example::new();
    let motion = &example.motion;
    // The middle keyframe lies on a frame.
    let sampled = SampledMotion::new(motion, example.character(), 250.0 / 3.0).unwrap();
    let frames = &sampled.cycle.frames;
    assert_eq!(frames.len(), 15);
    assert!((sampled.cycle.duration() - (motion.cycle.end - motion.cycle.start)).abs() < 1e-12);
    let [start, end] = example.ends();
    assert_near(&frames[0].placed_root(false), &start, 1e-9);
    assert_near(&frames[14].placed_root(false), &end, 1e-6);
    assert_near(&frames[14].placed_root(true), &start, 1e-9);
    for (frame, keyframe) in [(&frames[0], 0), (&frames[7], 1), (&frames[14], 2)] {
        let keyframe = &motion.keyframes[keyframe];
        assert!((frame.time - keyframe.time).abs() < 1e-12);
        for ((joint, angle), target) in sampled.joints().iter().zip(&frame.angles).zip(&frame.targets) {
            let own = motion.joints.iter().position(|name| name == joint).unwrap();
            assert!((angle - keyframe.angles[own]).abs() < 1e-12);
            assert!((target - keyframe.angles[own]).abs() < 1e-12);
        }
        let root = gaitwright_physics::sim::Root::from(&keyframe.root);
        let root = nalgebra::Isometry3::from_parts(root.position.into(), root.orientation);
        assert_near(&frame.placed_root(false), &root, 1e-6);
    }
    let entry = sampled.entry.as_ref().unwrap();
    let last = &entry.frames[entry.frames.len() - 1];
    assert_eq!((&last.angles, &last.root), (&frames[0].angles, &frames[0].root));
    assert!(entry.frames[0].angles.iter().zip(&motion.entry[0].angles).all(|(a, b)| (a - b).abs() < 1e-12));
}

/// Half-way between two keyframes the root is where its velocities lead: near the line between them, and not far off it.
#[test]
fn the_root_moves_with_its_velocity() {
    let example = Example::new();
    let sampled = SampledMotion::new(&example.motion, example.character(), 1000.0).unwrap();
    let frames = &sampled.cycle.frames;
    let step = sampled.cycle.interval();
    let root = |at: usize| frames[at].placed_root(false);
    // The accelerations before and after a keyframe differ, which such a difference sees by a quarter of a step.
    let keyframe = &example.motion.keyframes[1].root;
    let middle = frames.len() / 2;
    let moved = (root(middle + 1).translation.vector - root(middle - 1).translation.vector) / (2.0 * step);
    let turned =
        (root(middle + 1).rotation * root(middle - 1).rotation.inverse()).scaled_axis() / (2.0 * step);
    assert!((moved - nalgebra::Vector3::from(keyframe.linear_velocity)).norm() < 5e-3, "{moved}");
    assert!((turned - nalgebra::Vector3::from(keyframe.angular_velocity)).norm() < 1e-2, "{turned}");
}

#[test]
fn links_are_where_the_simulator_has_them() {
    let example = Example::with_poses();
    let sampled = SampledMotion::new(&example.motion, example.character(), 60.0).unwrap();
    let added = sampled.certificate.closed.angle;
    assert!((added - 0.003 * sampled.cycle.duration()).abs() < 1e-9, "{added}");
    for frame in &sampled.cycle.frames {
        let found = sampled.link_poses(frame, false);
        let wanted = example.link_poses(&frame.placed_root(false), &frame.angles);
        assert_eq!(found.len(), wanted.len());
        found.iter().zip(&wanted).for_each(|(found, wanted)| assert_near(found, wanted, 1e-9));
    }
}

/// What would be too much to write is refused with the figures of it, and with the rate that is possible.
#[test]
fn too_many_numbers_are_refused() {
    let mut example = Example::new();
    let longer = 10_000.0;
    for keyframe in &mut example.motion.keyframes {
        keyframe.time *= longer;
        keyframe.velocities.iter_mut().for_each(|rate| *rate /= longer);
        keyframe.root.linear_velocity = keyframe.root.linear_velocity.map(|rate| rate / longer);
        keyframe.root.angular_velocity = keyframe.root.angular_velocity.map(|rate| rate / longer);
    }
    example.motion.cycle.end *= longer;
    let refused = SampledMotion::new(&example.motion, example.character(), 1000.0).unwrap_err().to_string();
    // 1680 s of 12 joints with angle, target and rate, and the root.
    assert!(refused.contains("1680") && refused.contains("numbers"), "{refused}");
    let rate: f64 = refused.split("at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let possible = SampledMotion::new(&example.motion, example.character(), rate.floor()).unwrap();
    assert!(possible.cycle.frames.len() > 10_000);
}
