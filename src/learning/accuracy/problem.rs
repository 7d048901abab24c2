//! The problem that settings are compared on.

use super::measure::Measure;
use crate::scenario::ScenarioSetup;
use gaitwright_physics::scene::Accuracy;
use gaitwright_physics::sim::State;

/// Pieces of a simulation whose true ends are known.
#[derive(Debug, Clone)]
pub struct AccuracyProblem {
    /// Character, scene, start and drive.
    pub setup: ScenarioSetup,
    /// How the error of a state against the true one is measured.
    pub measure: Measure,
    /// Time between two marks of a piece, and from its start to its first mark, s.
    pub interval: f64,
    /// The pieces; at least one.
    pub pieces: Vec<Piece>,
}

/// A part of the simulation that every setting starts from the same state.
#[derive(Debug, Clone)]
pub struct Piece {
    /// The state at its start; its time is that of the whole simulation.
    pub start: State,
    /// The true states one, two, … intervals later; at least one.
    pub marks: Vec<State>,
}

impl AccuracyProblem {
    /// Number of steps from mark to mark, none of which is longer than `step` seconds.
    pub fn steps(&self, step: f64) -> usize {
        // A step that divides the interval but for rounding is taken as it is.
        (self.interval / step * (1.0 - 1e-9)).ceil().max(1.0) as usize
    }

    /// `accuracy` with the longest step not above its own that divides the interval.
    pub fn divided(&self, accuracy: &Accuracy) -> Accuracy {
        Accuracy { step: self.interval / self.steps(accuracy.step) as f64, ..*accuracy }
    }

    /// Simulated time of all pieces together, s.
    pub fn seconds(&self) -> f64 {
        self.interval * self.marks() as f64
    }

    /// The true states at all marks, piece by piece.
    pub fn states(&self) -> impl Iterator<Item = &State> {
        self.pieces.iter().flat_map(|piece| &piece.marks)
    }

    /// Number of marks of all pieces together.
    pub fn marks(&self) -> usize {
        self.pieces.iter().map(|piece| piece.marks.len()).sum()
    }
}
