//! Hard cases: scenes in which simulators fail, each with the bounds that must hold in it.
//!
//! A [`Case`] is a scenario with bounds that follow from its physics: no more energy than the scene holds,
//! no joint beyond its limit, rest where there must be rest. [`judge()`] runs it and measures every bounded
//! [`Quantity`]. The bounds are those of the default step and of four times that step alike.

mod chains;
mod contacts;
mod crowd;
mod judge;
mod limits;
mod loops;
mod quantity;
mod robots;
mod rotation;
mod sketch;
mod springs;
mod steps;

use crate::scenario::Scenario;

pub use judge::{Row, Verdict, judge, to_csv};
pub use quantity::{Quantity, Run};

/// A scene that is hard to simulate, and what must hold in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// The name by which it is asked for.
    pub name: String,
    /// What happens in it, in one line.
    pub about: String,
    /// The scene, at the step at which it is to be run first.
    pub scenario: Scenario,
    /// What must hold.
    pub bounds: Vec<Bound>,
    /// Whether the case is about its own step, which is then never multiplied.
    pub own_step: bool,
}

/// A quantity and the most it may be.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// What is measured.
    pub quantity: Quantity,
    /// The most it may be, in the quantity's unit.
    pub most: f64,
}

/// Every case.
pub fn cases() -> Vec<Case> {
    [
        chains::cases(),
        springs::cases(),
        rotation::cases(),
        contacts::cases(),
        limits::cases(),
        loops::cases(),
        robots::cases(),
        steps::cases(),
        crowd::cases(),
    ]
    .concat()
}

/// The case called `name`.
pub fn named(name: &str) -> Option<Case> {
    cases().into_iter().find(|case| case.name == name)
}

impl Case {
    fn new(name: impl Into<String>, about: impl Into<String>, scenario: Scenario) -> Self {
        Self { name: name.into(), about: about.into(), scenario, bounds: Vec::new(), own_step: false }
    }

    /// With `quantity` bounded by `most`.
    fn at_most(mut self, most: f64, quantity: Quantity) -> Self {
        self.bounds.push(Bound { quantity, most });
        self
    }

    /// Never at a multiple of its step.
    fn at_its_own_step(mut self) -> Self {
        self.own_step = true;
        self
    }

    /// The scenario at `factor` times its step.
    pub fn at(&self, factor: f64) -> Scenario {
        let factor = if self.own_step { 1.0 } else { factor };
        sketch::tuned(self.scenario.clone(), |accuracy| accuracy.step *= factor)
    }
}
