//! The learner: its parts against closed forms, exhaustive search and value iteration, and the whole
//! for determinism, on a toy world and on a character in the simulator.

mod character;
mod codings;
mod crank;
mod policies;
mod repairs;
mod requests;
mod rewards;
mod states;
mod symmetry;
mod terms;
mod toy;

use std::sync::Arc;

use gaitwright_learning::learn::grid::{Grid, JointGrid};
use gaitwright_learning::learn::{
    Behaviour, Cancel, Checkpoint, Generation, Learned, Learning, Observer, Parameters, Task, Weights,
};
use gaitwright_physics::character::{Options, read_file};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::Accuracy;
use gaitwright_physics::stance::Stance;

/// Two joints without limits.
pub fn plain_grid() -> Grid {
    let joint = JointGrid::new(0.0, None, 5.0, 0.6, (9, 5), 0.1);
    Grid { joints: vec![joint; 2], limbs: Vec::new(), beats: 1, symmetry: None }
}

pub fn bundled(name: &str) -> Arc<Model> {
    let path = crate::common::example_path(name);
    let reading = read_file(&path, Options::default()).unwrap();
    Arc::new(Model::new(Arc::new(reading.character), Base::Floating))
}

/// How the joints of a character that is to go along x are divided.
pub fn grid_of(model: &Model, stance: &Stance, parameters: &Parameters) -> Grid {
    Grid::new(model, stance, [1.0, 0.0, 0.0], parameters)
}

pub fn parameters(learning: &Learning, stance: &Stance) -> Parameters {
    learning.resolve(stance, 9.81, Accuracy::default().step).unwrap()
}

/// Nothing is charged.
pub fn free() -> Weights {
    Weights { energy: 0.0, drift: 0.0, turn: 0.0, slip: 0.0, impact: 0.0, smoothness: 0.0, posture: 0.0 }
}

/// As far as possible, at no cost.
pub fn plain_task() -> Task {
    Task { weights: free(), ..Task::default() }
}

#[derive(Default)]
pub struct Notes {
    pub generations: Vec<Generation>,
    pub improved: Vec<Behaviour>,
    pub checkpoints: Vec<Checkpoint>,
    pub cancel_after: Option<(usize, Cancel)>,
}

impl Observer for Notes {
    fn generation(&mut self, figures: &Generation) {
        self.generations.push(figures.clone());
        if let Some((count, cancel)) = &self.cancel_after
            && self.generations.len() >= *count
        {
            cancel.cancel();
        }
    }
    fn improved(&mut self, best: &Behaviour) {
        self.improved.push(best.clone());
    }
    fn checkpoint(&mut self, checkpoint: &Checkpoint) {
        self.checkpoints.push(checkpoint.clone());
    }
}

/// What must be equal, bit for bit: everything but the wall clock.
pub fn timeless(mut learned: Learned) -> Learned {
    for point in &mut learned.curve {
        point.elapsed = 0.0;
    }
    learned
}
