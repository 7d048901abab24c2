//! The grid and its splines, genomes and islands.

use super::{bundled, grid_of, parameters, plain_grid};
use gaitwright_learning::learn::ga::{Individual, Island, migrate, restart_stale};
use gaitwright_learning::learn::genome::Genome;
use gaitwright_learning::learn::grid::{Grid, GridState, JointGrid, Level};
use gaitwright_learning::learn::limb::{JointChain, Sagittal, limbs};
use gaitwright_learning::learn::transition::Transition;
use gaitwright_learning::learn::{Learning, Mutation, Repair, Repairs};
use gaitwright_physics::motion::hermite;
use gaitwright_physics::scene::Scene;
use gaitwright_physics::stance::Stance;
use nalgebra::Vector3;
use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

proptest! {
    #[test]
    fn every_level_lies_in_the_range_and_can_come_back(
        standing in -2.0..2.0f64, below in 0.0..2.0f64, above in 0.001..2.0f64,
        speed in 0.1..40.0f64, reach in 0.05..2.0f64, halves in (1u8..10, 1u8..6), time in 0.02..1.0f64,
    ) {
        let (lower, upper) = (standing - below, standing + above);
        let levels = (2 * halves.0 + 1, 2 * halves.1 + 1);
        let joint = JointGrid::new(standing, Some([lower, upper]), speed, reach, levels, time);
        for angle in joint.lowest..=joint.highest() {
            let [slowest, fastest] = joint.velocity_range(angle);
            prop_assert!(slowest <= 0 && fastest >= 0, "rest is always offered");
            for velocity in slowest..=fastest {
                let (q, v) = joint.place(Level { angle, velocity });
                prop_assert!((lower..=upper).contains(&q));
                prop_assert!((q - standing).abs() <= 2.0 * reach * (1.0 + 1e-9));
                prop_assert!(v.abs() <= speed * (1.0 + 1e-9));
                for i in 0..=200 {
                    let on_the_way = hermite((q, v), (q, 0.0), time, time * f64::from(i) / 200.0);
                    prop_assert!(on_the_way > lower - 1e-6 && on_the_way < upper + 1e-6);
                }
            }
        }
        let width = f64::from(joint.highest() - joint.lowest) * joint.angle_step;
        prop_assert!(width <= 2.0 * reach * (1.0 + 1e-9));
        let free = JointGrid::new(standing, None, speed, reach, levels, time);
        prop_assert_eq!(free.velocities.len(), usize::from(levels.0));
        prop_assert!(free.velocities.iter().all(|range| range == &[-(halves.1 as i8), halves.1 as i8]));
    }
}

#[test]
fn velocities_thin_out_toward_a_limit_as_in_the_papers_figure_3() {
    // Seven angles over the whole range of ±0.6, transitions slow enough to matter.
    let joint = JointGrid::new(0.0, Some([-0.6, 0.6]), 4.0, 0.6, (7, 5), 0.5);
    assert_eq!(joint.velocities, [[0, 2], [-1, 2], [-2, 2], [-2, 2], [-2, 2], [-2, 1], [-2, 0]]);
}

#[test]
fn a_standing_angle_outside_the_range_is_moved_into_it() {
    let joint = JointGrid::new(3.0, Some([-1.0, 1.0]), 5.0, 0.4, (5, 3), 0.1);
    assert_eq!((joint.standing, joint.lowest, joint.highest()), (1.0, -4, 0));
    assert_eq!(
        joint.clamp(7, 1),
        Level { angle: 0, velocity: 0 },
        "no velocity out of the range at the limit"
    );
    assert_eq!(joint.clamp(-9, -3), Level { angle: -4, velocity: -1 });
}

#[test]
fn a_transition_is_refused_exactly_if_its_spline_leaves_the_range() {
    let joints = vec![JointGrid::new(0.1, Some([-0.5, 0.6]), 8.0, 0.6, (9, 5), 0.2); 2];
    let grid = Grid { joints, limbs: Vec::new(), beats: 1, symmetry: None };
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let (mut refused, mut allowed) = (0, 0);
    for _ in 0..400 {
        let ends = Genome::random(&grid, 2, true, &mut rng);
        let (from, to) = (grid.posture(&ends.states[0]), grid.posture(&ends.states[1]));
        let transition = Transition { from: &from, to: &to, duration: 0.2 };
        let mut excess = f64::MIN;
        let mut angles = [0.0; 2];
        for i in 0..=2000 {
            transition.targets(0.2 * f64::from(i) / 2000.0, &mut angles);
            excess = angles.iter().fold(excess, |worst, &q| worst.max(q - 0.6).max(-0.5 - q));
        }
        // Samples can miss a peak by 1e-5 at most (its curvature times half a spacing squared).
        if excess > 1e-5 {
            assert!(!transition.stays_within(&grid));
            refused += 1;
        } else if excess < -1e-5 {
            assert!(transition.stays_within(&grid));
            allowed += 1;
        }
    }
    assert!(refused > 20 && allowed > 100, "{refused} refused, {allowed} allowed");
}

/// With subsets that are not closed under symmetry: limbs can then follow others in turn.
fn unsymmetrical() -> Learning {
    Learning { repairs: Repairs::default().without(Repair::Symmetry), ..Learning::default() }
}

fn is_on(grid: &Grid, genome: &Genome) -> bool {
    genome.states.iter().all(|state| {
        let mut joints = state.levels.iter().zip(&grid.joints);
        joints.all(|(level, joint)| joint.clamp(level.angle.into(), level.velocity.into()) == *level)
    })
}

fn all_different(genome: &Genome) -> bool {
    let states = &genome.states;
    (0..states.len()).all(|i| !states[..i].contains(&states[i]))
}

#[test]
fn chance_stays_on_the_grid_and_makes_no_duplicates() {
    let model = bundled("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let grid = grid_of(&model, &stance, &parameters(&unsymmetrical(), &stance));
    assert_eq!(grid.limbs.len(), 4);
    let rates = Mutation { angle: 0.5, velocity: 0.5, state: 0.2, limb: 0.5, time: 0.5 };
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for _ in 0..50 {
        let (a, b) = (Genome::random(&grid, 6, true, &mut rng), Genome::random(&grid, 6, true, &mut rng));
        assert!(is_on(&grid, &a) && all_different(&a));
        assert_eq!(a.distance(&a), 0.0);
        assert_eq!(a.distance(&b), b.distance(&a));
        let uniform = a.cross_uniform(&b, 1, &mut rng);
        for (i, state) in uniform.states.iter().enumerate() {
            assert!(*state == a.states[i] || *state == b.states[i]);
        }
        let single: Vec<Vec<usize>> = (0..4).map(|limb| vec![limb]).collect();
        let by_limb = a.cross_by_limb(&b, &single, &grid, &mut rng);
        for limb in &grid.limbs {
            let levels = |genome: &Genome| -> Vec<Vec<Level>> {
                let part = |state: &GridState| limb.joints.iter().map(|&joint| state.levels[joint]).collect();
                genome.states.iter().map(part).collect()
            };
            assert!(levels(&by_limb) == levels(&a) || levels(&by_limb) == levels(&b));
        }
        let mut mutant = a.clone();
        mutant.mutate(&grid, &rates, &mut rng);
        assert!(is_on(&grid, &mutant) && mutant != a);
        let mut twins = Genome { states: vec![a.states[0].clone(); 6] };
        twins.repair(&grid, &mut rng);
        assert!(is_on(&grid, &twins) && all_different(&twins));
    }
}

#[test]
fn limbs_that_follow_others_still_do_after_mutation() {
    let model = bundled("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let grid = grid_of(&model, &stance, &parameters(&unsymmetrical(), &stance));
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let leaders = |genome: &Genome| (0..4).map(|limb| genome.leader(&grid, limb)).collect::<Vec<_>>();
    let (mut followers, mut alternating) = (0, 0);
    for _ in 0..100 {
        let genome = Genome::random(&grid, 4, true, &mut rng);
        assert_eq!(genome.leader(&grid, 0), None, "the first limb leads");
        let mut mutant = genome.clone();
        let rates = Mutation { angle: 0.3, velocity: 0.3, state: 0.1, limb: 0.0, time: 0.0 };
        mutant.mutate(&grid, &rates, &mut rng);
        assert_ne!(mutant, genome);
        for (before, after) in leaders(&genome).into_iter().zip(leaders(&mutant)) {
            // A limb may come to follow an even earlier one by chance, never none.
            assert!(before.is_none() || after.is_some());
            followers += usize::from(after.is_some());
            alternating += usize::from(after.is_some_and(|leader| leader.swapped));
        }
    }
    assert!(followers > 100 && alternating > 30, "{followers} follow, {alternating} in turn");
}

#[test]
fn left_legs_are_the_mirror_image_of_right_legs() {
    let model = bundled("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let plane = Sagittal::new(Vector3::x(), Vector3::z());
    let limbs = limbs(&model, &stance.angles, plane);
    let name = |joint: usize| model.joint_names[joint].as_str();
    for target in &limbs {
        assert_eq!(target.joints.len(), 3);
        for source in &limbs {
            let signs = target.signs_from(source).unwrap();
            // Abduction turns about the axis ahead, hip and knee about the lateral one: in a mirror the
            // former reverses and the latter do not.
            let side = |limb: &JointChain| name(limb.joints[0]).starts_with('L');
            let expected = if side(target) == side(source) { [1, 1, 1] } else { [-1, 1, 1] };
            assert_eq!(signs, expected, "{} like {}", name(target.joints[0]), name(source.joints[0]));
        }
    }
}

#[test]
fn islands_keep_their_elite_and_breed_no_duplicates() {
    let grid = plain_grid();
    let learning = Learning { population: 12, states: 3, elite: 2, ..Learning::default() };
    let parameters = learning.resolve_with(0.1, 0.01).unwrap();
    let mut island = Island::default();
    let first = island.ask(&grid, &parameters, 5, 0, 0);
    assert_eq!(first.len(), 12);
    let score = |genomes: Vec<Genome>| -> Vec<Individual> {
        // The closer to a corner of the grid, the better.
        let fitness = |genome: &Genome| {
            genome.states.iter().flat_map(|state| &state.levels).map(|level| f64::from(level.angle)).sum()
        };
        genomes.into_iter().map(|genome| Individual { fitness: fitness(&genome), genome }).collect()
    };
    island.tell(score(first.clone()), &parameters);
    for generation in 1..40 {
        let best = island.members[..2].to_vec();
        let children = island.ask(&grid, &parameters, 5, generation, 0);
        assert_eq!(children, island.ask(&grid, &parameters, 5, generation, 0), "same seed, same children");
        assert_eq!(children.len(), 10);
        for (i, child) in children.iter().enumerate() {
            assert!(!children[..i].contains(child) && all_different(child) && is_on(&grid, child));
            assert!(island.members.iter().all(|member| member.genome != *child));
        }
        island.tell(score(children), &parameters);
        assert_eq!(island.members.len(), 12);
        assert!(best.iter().all(|individual| island.members.contains(individual)));
        assert!(island.members.windows(2).all(|pair| pair[0].fitness >= pair[1].fitness));
    }
    let best = island.members[0].fitness;
    assert!(best > 18.0, "of at most 3 × 2 × 4 = 24, less what keeps states apart; reached {best}");

    // Given up: whoever made no progress, unless nobody has proven more.
    let proven = |fitness: f64, stale| Island { accepted: Some(vec![9.0, fitness]), stale, ..island.clone() };
    let mut tried =
        vec![proven(1.0, 20), proven(2.0, 30), proven(1.0, 19), Island { accepted: None, ..proven(0.0, 20) }];
    restart_stale(&mut tried, 20);
    assert_eq!(tried, [Island::default(), proven(2.0, 30), proven(1.0, 19), Island::default()]);

    let mut ring = vec![island.clone(), Island::default(), island];
    ring[1].tell(score(first), &parameters);
    migrate(&mut ring);
    assert_eq!(ring[1].members[0].fitness, best, "the best moved on");
    assert!(ring.iter().all(|island| island.members.len() == 12));
}
