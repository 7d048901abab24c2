//! The form of half-solved numbers, which all coordinates share.

/// Rows that stand side by side.
pub const LANES: usize = 4;

/// One number of up to [`LANES`] rows; 0 for those that are not there.
pub type Lanes = [f64; LANES];

/// Numbers of a half-solved row that belong to the root.
pub const ROOT: usize = 6;
