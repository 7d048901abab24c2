//! A run of QDSEGA.

use super::arena::StudyArena;
use super::trail::{Found, Trail};
use crate::learn::{
    Behaviour, Cancel, Checkpoint, Generation, LearnError, Learning, Observer, learn, reference_gravity,
};
use gaitwright_physics::scene::Gains;

/// More generations than any run has.
const UNLIMITED: u32 = 1_000_000;

/// Searches until `seconds` have been simulated; the generation in which they are is the last.
pub(super) fn run(
    arena: &StudyArena,
    learning: &Learning,
    energy: f64,
    seed: u64,
    seconds: f64,
) -> Result<Trail, LearnError> {
    let learning = Learning { generations: Some(UNLIMITED), seconds: None, ..learning.clone() };
    let subject = &arena.subject;
    let gravity = reference_gravity(&subject.scene);
    let parameters = learning.resolve(&subject.stance, gravity, subject.accuracy.step)?;
    let setup = arena.setup(learning.trunk, parameters, energy, seed);
    let cancel = Cancel::default();
    let mut witness = Witness {
        cancel: cancel.clone(),
        seconds,
        gains: &subject.stance.gains,
        new: None,
        trail: Trail::default(),
    };
    learn(&setup, &mut witness, &cancel, None)?;
    Ok(witness.trail)
}

/// Notes what is found, and ends the search when its time is used up.
struct Witness<'a> {
    cancel: Cancel,
    seconds: f64,
    gains: &'a Gains,
    /// Found in this generation.
    new: Option<Behaviour>,
    trail: Trail,
}

impl Observer for Witness<'_> {
    fn improved(&mut self, best: &Behaviour) {
        self.new = Some(best.clone());
    }

    fn generation(&mut self, figures: &Generation) {
        let trail = &mut self.trail;
        trail.simulated = figures.simulated_seconds;
        trail.saved = figures.saved_seconds;
        trail.hit_rate = Some(figures.cache_hit_rate);
        let (at, gains) = (figures.simulated_seconds, self.gains.clone());
        trail.found.extend(self.new.take().map(|behaviour| Found { at, behaviour, gains }));
        if figures.simulated_seconds >= self.seconds {
            self.cancel.cancel();
        }
    }

    fn checkpoint(&mut self, _: &Checkpoint) {}
}
