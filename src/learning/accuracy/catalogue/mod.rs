//! Hard cases: scenes in which simulators fail, each with the bounds that must hold in it.
//!
//! A [`Case`] is a scenario with bounds that follow from its physics: no gain of energy, no joint beyond its limit,
//! rest where friction or damping must end all motion. [`judge()`] runs it and measures every bounded [`Quantity`].
//!
//! Bounds are set from the physics before a case is run. There are four kinds:
//!
//! - What a closed form gives: a speed from a height, an angle from a precession, the weight of what rests; times a factor
//!   near 1 for the step.
//! - Energy that cannot grow, and momentum that cannot change: a share of what the case can release, or holds. It is 1 % for
//!   single bodies and springs, whose fastest motion a step of 8 ms resolves with many steps a turn, and 5 % for chains,
//!   whose ends whip at 1000 rad/s, or the change that an error of first order makes, h/2 times a power.
//! - Rest, contact and limits, which are inequalities: what the solver's tolerance of 1e-9 m/s leaves over the ten seconds,
//!   with two decades or more for steps in which rows come and go (1e-7 to 1e-6 m, m/s or rad), or a
//!   length that cannot be seen where something hits it (1e-4 m for a single body, 1e-3 m for a robot that falls 5 m).
//! - Torques that have a limit: rounding, 1e-9 N m.
//!
//! The same bounds hold at the default step and at four times that step. [`compare()`] runs it with the default settings
//! beside the best ones.

mod case;
mod chains;
mod comparison;
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
pub use comparison::{CaseComparison, compare, to_csv, to_markdown};
pub use judge::{CaseMeasurement, CaseVerdict, judge};
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
