//! Measures of a gait: footfalls, phases, duty factors, name, cost of transport, physical validity, and whether it is natural.
//!
//! The figures are Hildebrand's (M. Hildebrand 1965, "Symmetrical gaits of horses"; 1989, "The
//! quadrupedal gaits of vertebrates"): the duty factor of a foot is the share of the stride for which it is
//! on the ground; its phase is the share of the stride by which it touches down after the reference foot.

mod foot;
pub(crate) mod foot_force;
mod footfall;
pub(crate) mod harmonics;
mod legs;
pub(crate) mod limb;
pub(crate) mod limits;
mod measure;
mod name;
mod natural;
mod report;
mod stride;
mod trunk;
mod unnamed;
mod validity;

pub use footfall::{Detection, Footing};
pub(crate) use legs::left_feet;
pub use legs::{Leg, Side};
pub use limits::leaps;
pub use measure::{GaitContext, measure};
pub use name::{Classified, Template, UNCLASSIFIED, classify, templates};
pub use natural::{NaturalnessContext, judge, least_travel, travels};
pub use report::{Foot, GaitFormat, GaitReport, Pair, Regime, Spread, UnnamedBecause};
pub use validity::validity;
