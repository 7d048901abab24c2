//! Hard cases: scenes in which simulators fail, each with the bounds that must hold in it.
//!
//! A [`Case`] is a scenario with bounds that follow from its physics: no gain of energy, no joint beyond its limit,
//! rest where friction or damping must end all motion. [`judge()`] runs it and measures every bounded [`Quantity`].
//! The same bounds hold at the default step and at four times that step.

mod case;
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

pub use case::{Case, CaseBound};
pub use judge::{CaseMeasurement, CaseVerdict, judge, to_csv};
pub use quantity::{CaseRun, Quantity};

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
