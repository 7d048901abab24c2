//! Maximal coordinates: the system as Tokizaki & Hasegawa write it.
//!
//! Every body has six velocities of its own, the mass matrix is block-diagonal, and every joint is rows e
//! beside those of contacts, limits and drives (eqs. 5-27). A body's velocities v are those of its centre of
//! mass and its rotation, its forces f its weight and −ω × I ω.
//!
//! **What the rows read.** The paper's joint row asks J\[t\] v⁺ = 0. Joint coordinates ask that the
//! constraint's second derivative vanish, J v̇ = −J̇ v, so that J v⁺ = −h J̇ v. A row of a contact, in joint
//! coordinates, reads the velocity that the new joint rates give the body in its *old* place,
//! V_i = V_0 + Σ S_j q̇_j⁺. With spatial accelerations a_i = a_parent + S_i q̈_i + V_parent × S_i q̇_i (Featherstone
//! 2008, chapter 5) that velocity is
//!
//! V_i⁺ = V_i + h a_i + h (0; ω_0 × v_0) − h D_i,  D_i = D_parent + V_parent × S_i q̇_i,  D_0 = 0,
//!
//! v_0 being the velocity of the root's origin, while a step of the body by itself gives it
//! V_i + h a_i + h (0; ω_i × v_i) with the velocity v_i of its centre of mass. So with the *row correction*
//!
//! C_i = h (0; ω_0 × v_0 − ω_i × v_i) − h D_i
//!
//! added to the velocity that every row reads, Tᵀ (V_child − V_parent) = 0 is the joint's row with the bias
//! −h J̇ v, and contacts, limits, drives and the root read what they read in joint coordinates: the new joint rates
//! are the same to rounding. Without it (`joint_bias: paper`) the rows are the paper's.
//!
//! **Velocity-dependent forces.** The paper's f\[t\] is that of the old velocities. Joint coordinates take those forces,
//! and the row correction with them, at the mean of old and new velocities, because at the old ones alone they add
//! energy to every rotation (see `coordinates/reduced/stages`). To give the same motion, both coordinates need the same
//! means, and so the means are those of a step in joint coordinates, which a [`Forecast`](forecast::Forecast) computes
//! ahead on a copy of the state. The paper's own rows take the old velocities as the equations stand. In either case
//! the forecast decides whether a body rotates or a pendulum oscillates too fast for the step, and which limits are near.

mod forecast;
pub mod kinematics;
mod response;
mod rows;
pub mod stages;
mod velocity_control;
mod workspace;

pub use workspace::MaximalWorkspace;
