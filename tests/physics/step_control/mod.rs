//! When steps are divided: in the character's own units, by relative motion, and not by what changes nothing.

mod frames;
mod scale;
mod spin;
