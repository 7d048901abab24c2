//! Bodies side by side: every body in a lane of its own, after its parent, in trees of any shape.

use gaitwright_physics::character::JointKind;
use gaitwright_physics::model::{Model, Parents, Slot};
use gaitwright_physics::sim::{State, link_poses};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{bodies, common};

/// Random trees, of all sizes from a single link on.
const TREES: u64 = 60;

fn trees() -> impl Iterator<Item = std::sync::Arc<Model>> {
    let drawn = (0..TREES).map(|case| {
        let mut rng = ChaCha8Rng::seed_from_u64(case);
        bodies::tree(&mut rng, 1 + case as usize, case % 5 == 0)
    });
    let bundled = ["quadruped.urdf", "biped.urdf", "hexapod.json", "snake.json"].map(common::example);
    drawn.chain(bundled)
}

#[test]
fn every_body_has_a_lane_of_its_own_after_its_parent() {
    for model in trees() {
        let mut seen = vec![0; model.bodies.len()];
        for (index, group) in model.groups.iter().enumerate() {
            for (lane, &body) in group.bodies.iter().enumerate() {
                if lane >= group.count {
                    assert_eq!(
                        (group.mass[lane], group.empty[lane]),
                        (0.0, 1.0),
                        "an empty lane adds nothing"
                    );
                    continue;
                }
                seen[body] += 1;
                assert_eq!(model.slots[body], Slot { group: index, lane });
                let parent = model.slots[model.bodies[body].parent];
                assert!(index == 0 || parent.group < index, "the parent comes before");
                match group.parents {
                    // The root stands in all lanes of its group.
                    Parents::Beside(0) => assert_eq!(parent.group, 0),
                    Parents::Beside(parents) => assert_eq!(parent, Slot { group: parents, lane }),
                    Parents::Each(slots) => assert_eq!(parent, slots[lane]),
                }
            }
        }
        assert!(seen.iter().all(|count| *count == 1), "{seen:?}");
    }
}

/// Against poses composed link by link from the character as it was drawn.
#[test]
fn links_are_where_their_joints_put_them() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for model in trees() {
        let mut state = State::new(&model);
        state.angles.iter_mut().for_each(|angle| *angle = rng.random_range(-3.0..3.0));
        state.root.orientation = UnitQuaternion::from_euler_angles(0.3, -0.7, 2.0);
        let mut expected: Vec<Isometry3<f64>> = Vec::new();
        for link in &model.character.links {
            let pose = match &link.joint {
                None => {
                    Isometry3::from_parts(Translation3::from(state.root.position), state.root.orientation)
                }
                Some(joint) => {
                    let angle = model.joint(&joint.name).map_or(0.0, |index| state.angles[index]);
                    let moved = match joint.kind {
                        JointKind::Fixed => Isometry3::identity(),
                        JointKind::Revolute => Isometry3::rotation(*joint.axis * angle),
                        JointKind::Prismatic => Isometry3::from(Translation3::from(*joint.axis * angle)),
                    };
                    expected[joint.parent] * joint.origin * moved
                }
            };
            expected.push(pose);
        }
        for (expected, found) in expected.iter().zip(link_poses(&model, &state)) {
            let apart = (expected.translation.vector - found.translation.vector).norm();
            // Some sixty joints of up to three metres each, all rounded at a part in 10¹⁶.
            assert!(apart <= 1e-11 && expected.rotation.angle_to(&found.rotation) <= 1e-7, "{apart}");
        }
    }
}
