//! The rows of a step: what each asks of the new velocity, half-solved and gathered into one problem.

mod assembly;
pub mod contact;
pub mod drive;
pub mod dry_friction;
mod half_solved;
pub mod joint;
pub mod limit;
pub mod lock;
pub mod loops;
mod owner;
mod stabilization;
pub mod torque;
pub mod without_impact;

pub use assembly::{Row, Rows};
pub use half_solved::ROOT;
pub use owner::RowOwner;
pub use stabilization::Recovery;
pub(super) use stabilization::SHARE_PER_STEP;
