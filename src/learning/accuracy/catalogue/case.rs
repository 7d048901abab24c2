//! A hard case: a scenario and the bounds that must hold in it.

use super::quantity::Quantity;
use super::sketch;
use crate::scenario::Scenario;
use gaitwright_physics::scene::Accuracy;

/// A scene that is hard to simulate, and what must hold in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Its unique name.
    pub name: String,
    /// What happens in it, in one line.
    pub about: String,
    /// The scene, at the step at which it is to be run first.
    pub scenario: Scenario,
    /// The bounds that must hold, at the step of `scenario` and at four times that step.
    pub bounds: Vec<CaseBound>,
    /// Whether the case tests its own step, which is then never multiplied.
    pub own_step: bool,
}

/// A quantity and the most it may be.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseBound {
    /// What is measured.
    pub quantity: Quantity,
    /// The most it may be, in the quantity's unit.
    pub most: f64,
}

impl Case {
    /// A case without bounds yet.
    pub(super) fn new(name: impl Into<String>, about: impl Into<String>, scenario: Scenario) -> Self {
        Self { name: name.into(), about: about.into(), scenario, bounds: Vec::new(), own_step: false }
    }

    /// With `quantity` bounded by `most`.
    pub(super) fn at_most(mut self, most: f64, quantity: Quantity) -> Self {
        self.bounds.push(CaseBound { quantity, most });
        self
    }

    /// A case that tests its own step: never at a multiple of it.
    pub(super) fn at_its_own_step(mut self) -> Self {
        self.own_step = true;
        self
    }

    /// The case with the default settings at its step, within the same bounds; `None` where it has them already.
    pub fn by_default(&self) -> Option<Self> {
        let plain =
            |accuracy: &mut Accuracy| *accuracy = Accuracy { step: accuracy.step, ..Accuracy::default() };
        let scenario = sketch::tuned(self.scenario.clone(), plain);
        (scenario != self.scenario).then(|| Self { scenario, ..self.clone() })
    }

    /// The scenario at `factor` times its step.
    pub fn at(&self, factor: f64) -> Scenario {
        let factor = if self.own_step { 1.0 } else { factor };
        sketch::tuned(self.scenario.clone(), |accuracy| accuracy.step *= factor)
    }
}
