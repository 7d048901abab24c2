//! Hard cases: scenes in which simulators fail, each with the bounds that must hold in it.
//!
//! A [`Case`] is a scenario with bounds that follow from its physics: no more energy than the scene holds,
//! no joint beyond its limit, rest where there must be rest. [`judge()`] runs it and measures every bounded
//! [`Quantity`]. The bounds are those of the default step and of four times that step alike.

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
