//! What accuracy costs, and what must hold where it is hard to come by.

pub mod catalogue;
