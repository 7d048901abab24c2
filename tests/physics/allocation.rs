//! A step allocates nothing once it is warm, and a simulator nothing for what its scene does not call for.

use crate::common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{
    Accuracy, Coordinates, Effect, Feedforward, Gains, Scene, SolverChoice, SolverKind, StepPlan,
};
use gaitwright_physics::sim::contact::Against;
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
    static BYTES: Cell<usize> = const { Cell::new(0) };
}

fn count(bytes: usize) {
    ALLOCATIONS.with(|count| count.set(count.get() + 1));
    BYTES.with(|sum| sum.set(sum.get() + bytes));
}

struct Counting;

// SAFETY: every call is handed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: as required of the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as required of the caller.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        // SAFETY: as required of the caller.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_warm_step_allocates_nothing() {
    for (character, kind, coordinates) in [
        ("quadruped.urdf", SolverKind::Newton, Coordinates::Reduced),
        ("quadruped.urdf", SolverKind::Pgs, Coordinates::Reduced),
        ("quadruped.urdf", SolverKind::Newton, Coordinates::Maximal),
        ("pantograph.json", SolverKind::Newton, Coordinates::Reduced),
    ] {
        let model = common::example(character);
        let stance = Stance::find(&model, &Scene::default());
        let solver = SolverChoice { kind, ..SolverChoice::default() };
        let accuracy = Accuracy { solver, coordinates, ..Accuracy::default() };
        let plan = common::plan(&model, &Scene::default(), &accuracy, Some(&stance.gains));
        let mut simulator = Simulator::new(plan, stance.state.clone());
        let targets: Vec<Vec<f64>> = (0..=1000)
            .map(|index| {
                let swing = 0.6 * (0.03 * index as f64).sin();
                stance
                    .angles
                    .iter()
                    .enumerate()
                    .map(|(joint, angle)| angle + swing * (joint % 3) as f64)
                    .collect()
            })
            .collect();
        // The first round meets every kind of row; the second, from the same state, must need no memory.
        for round in 0..2 {
            simulator.set_state(&stance.state);
            let before = ALLOCATIONS.with(Cell::get);
            for pair in targets.windows(2) {
                simulator.step(Command::Track { now: &pair[0], next: &pair[1] }).unwrap();
            }
            let allocations = ALLOCATIONS.with(Cell::get) - before;
            assert!(
                round == 0 || allocations == 0,
                "{allocations} allocations of {character} with {kind:?} in {coordinates:?} coordinates"
            );
        }
    }
}

/// Bytes that a simulator of `plan` asks for.
fn memory(model: &Arc<Model>, plan: &Arc<StepPlan>) -> usize {
    let (plan, state) = (plan.clone(), State::new(model));
    let before = BYTES.with(Cell::get);
    let simulator = Simulator::new(plan, state);
    let after = BYTES.with(Cell::get);
    drop(simulator);
    after - before
}

#[test]
fn what_is_off_takes_no_memory() {
    let model = common::example("quadruped.urdf");
    let mut with = Model::clone(&model);
    with.friction.fill(0.3);
    let with = Arc::new(with);
    let mut without = Model::clone(&with);
    without.friction.fill(0.0);
    without.limits.fill(None);
    let without = Arc::new(without);
    let gains =
        Gains { feedforward: Feedforward::ContactAware, ..Stance::find(&model, &Scene::default()).gains };
    let unlimited = Gains { max_torque: vec![None; model.joint_count()], ..gains.clone() };
    let direct = Gains { feedforward: Feedforward::None, ..gains.clone() };
    let bytes = |model: &Arc<Model>, scene: &Scene, gains: &Gains| {
        memory(model, &common::plan(model, scene, &Accuracy::default(), Some(gains)))
    };
    let scene = Scene::default();
    let all = bytes(&with, &scene, &gains);
    // Beside each effect, the same scene or character without what it acts on.
    let cases = [
        (Effect::GroundContact, bytes(&with, &Scene { ground: None, ..scene.clone() }, &gains)),
        (Effect::Friction, bytes(&with, &Scene { friction: 0.0, ..scene.clone() }, &gains)),
        (Effect::TorqueLimits, bytes(&with, &scene, &unlimited)),
        (Effect::Feedforward, bytes(&with, &scene, &direct)),
    ];
    let off = |effects: &[Effect]| bytes(&with, &common::without(effects), &gains);
    for (effect, absent) in cases {
        let off = off(&[effect]);
        assert!(off < all, "{}: {off} bytes when off, {all} when on", effect.name());
        assert_eq!(off, absent, "{}", effect.name());
    }
    let joints = [Effect::JointLimits, Effect::JointFriction];
    assert_eq!(off(&joints), bytes(&without, &scene, &gains));
    for effect in joints {
        assert!(off(&[effect]) < all, "{}", effect.name());
    }
}

/// Obstacles, a height field, self-collision and restitution, all of them acting.
#[test]
fn a_warm_step_allocates_nothing_whatever_it_touches() {
    let model = common::example("snake.json");
    let stance = Stance::find(&model, &Scene::default());
    let scene: Scene = serde_json::from_str(
        r#"{"restitution": 0.4, "ground": {"kind": "height_field", "size": [4, 4],
                "heights": [[0, 0.1, 0, 0.1], [0.1, 0, 0.1, 0], [0, 0.1, 0, 0.1], [0.1, 0, 0.1, 0]]},
            "obstacles": [{"shape": {"kind": "box", "size": [0.3, 0.3, 0.3]}},
                {"shape": {"kind": "cylinder", "radius": 0.1, "length": 0.3, "pose": {"position": [0.3, 0.1, 0.1]}}}]}"#,
    )
    .unwrap();
    let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&stance.gains));
    assert!(plan.self_collision && plan.obstacles.len() == 2 && plan.restitution.is_some());
    let mut start = stance.state.clone();
    start.root.position.z = 0.5;
    let mut simulator = Simulator::new(plan, start.clone());
    // Every other joint turns about the vertical: the snake rolls up into a ring that closes on itself.
    let curled: Vec<f64> =
        (0..model.joint_count()).map(|joint| if joint % 2 == 0 { 1.2 } else { 0.2 }).collect();
    start.angles.copy_from_slice(&curled);
    let mut kinds = [false; 3];
    for round in 0..2 {
        simulator.set_state(&start);
        let before = ALLOCATIONS.with(Cell::get);
        for _ in 0..1000 {
            simulator.step(Command::Track { now: &curled, next: &curled }).unwrap();
            for contact in simulator.contacts() {
                match contact.against {
                    Against::Ground => kinds[0] = true,
                    Against::Obstacle(_) => kinds[1] = true,
                    Against::Link { .. } => kinds[2] = true,
                }
            }
        }
        let allocations = ALLOCATIONS.with(Cell::get) - before;
        assert!(round == 0 || allocations == 0, "{allocations} allocations");
    }
    assert_eq!(kinds, [true; 3], "ground, obstacles and links must all be touched");
}
