//! The mixed linear complementarity problem of a step, and its solvers.
//!
//! A solver sees a matrix, a vector and bounds, and never a character. The problem (Tokizaki &
//! Hasegawa eqs. (16), (26), (27)): find the forces λ and the velocities w = A λ + b such that every
//! row satisfies its [`Bound`].
//!
//! | solver | exact | circular cone | cost of a solve with n rows |
//! |---|---|---|---|
//! | [`Pgs`] | in the limit | yes | n² a sweep |
//! | [`Newton`] | to rounding | yes | n³/3 a step, one or two steps from a good start, more where rows depend on each other, thousands of n² where it takes splitting |
//! | [`Lemke`] | to rounding | no | 2 m² a pivot, where the lifted problem has m ≤ 7 n / 3 variables |
//!
//! [`Equality`] stands before any of them: it solves the free rows by a factor that knows where they are
//! zero, and leaves the other rows to the solver behind it. [`Counted`] counts what was solved.

mod active;
mod counted;
mod equality;
mod equations;
mod lemke;
mod linear;
mod newton;
mod pgs;
mod pieces;
mod problem;
mod proximal;
mod residual;
mod skyline;
mod splitting;
mod standard;
mod symmetric;

pub use counted::{Counted, SolverWork};
pub use equality::Equality;
pub use lemke::Lemke;
pub use newton::Newton;
pub use pgs::Pgs;
pub use problem::{Bound, Problem, Solution, SolveStatus, Solver};
pub(super) use residual::dot;
pub use residual::{project, residual};
