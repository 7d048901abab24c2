//! The two coordinate systems: a tree of joint coordinates, and bodies by themselves.
//!
//! They differ in free motion, in how rows are half-solved, in the response to forces and in how positions
//! advance. Rows, contacts, the complementarity problem and step control are the same in both.

pub(super) mod maximal;
pub(super) mod outcome;
pub mod reduced;
