//! A step allocates nothing once it is warm.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use gaitwright::scene::{Accuracy, Scene, SolverChoice, SolverKind};
use gaitwright::sim::{Command, Simulator};
use gaitwright::stance::Stance;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is handed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: as required of the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as required of the caller.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: as required of the caller.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_warm_step_allocates_nothing() {
    for kind in [SolverKind::Newton, SolverKind::Pgs] {
        let model = common::example("quadruped.urdf");
        let stance = Stance::find(&model, &Scene::default());
        let solver = SolverChoice { kind, ..SolverChoice::default() };
        let accuracy = Accuracy { solver, ..Accuracy::default() };
        let plan = common::plan(&model, &Scene::default(), &accuracy, Some(&stance.gains));
        let mut simulator = Simulator::new(model.clone(), plan, stance.state.clone());
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
            assert!(round == 0 || allocations == 0, "{allocations} allocations with {kind:?}");
        }
    }
}
