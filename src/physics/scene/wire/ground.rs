//! What the character stands on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::character::LENGTH;
use crate::fault::Fault;

/// Greatest number of points of a height field along an edge.
const POINTS: usize = 1000;
/// The ground.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Ground {
    /// A horizontal plane; solid below.
    Plane {
        /// z of the plane in the world frame, m.
        #[serde(default)]
        height: f64,
    },
    /// A surface over a rectangle along the world's x and y; solid below, nothing beyond the rectangle.
    ///
    /// Between four neighbouring points the surface is two triangles, which meet along the diagonal from the
    /// point of least x and y to that of greatest x and y.
    HeightField {
        /// z of the surface in the world frame, m. The list at index i is the row at
        /// y = `center.y` − `size.y` / 2 + i `size.y` / (rows − 1); its number at index j is the point at
        /// x = `center.x` − `size.x` / 2 + j `size.x` / (columns − 1). At least two rows of at least two.
        heights: Vec<Vec<f64>>,
        /// Lengths of the rectangle along x and y, m.
        size: [f64; 2],
        /// Its middle in the world, x and y, m.
        #[serde(default)]
        center: [f64; 2],
    },
}

impl Default for Ground {
    fn default() -> Self {
        Self::Plane { height: 0.0 }
    }
}

impl Ground {
    /// Everything impossible in the ground.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        match self {
            Self::Plane { height } => {
                if height.is_nan() || height.abs() > LENGTH {
                    let reason = format!("the height must be finite and within {LENGTH:e} m");
                    faults.push(Fault::new("/height", reason));
                }
            }
            Self::HeightField { heights, size, center } => {
                let columns = heights.first().map_or(0, Vec::len);
                if !(2..=POINTS).contains(&heights.len()) || !(2..=POINTS).contains(&columns) {
                    let reason =
                        format!("a height field has from 2 to {POINTS} rows of 2 to {POINTS} heights");
                    faults.push(Fault::new("/heights", reason));
                }
                for (index, row) in heights.iter().enumerate() {
                    if row.len() != columns {
                        let reason = format!("the row has {} heights, the first one {columns}", row.len());
                        faults.push(Fault::new(format!("/heights/{index}"), reason));
                    }
                    if !row.iter().all(|height| height.abs() <= LENGTH) {
                        let reason = format!("every height must be finite and within {LENGTH:e} m");
                        faults.push(Fault::new(format!("/heights/{index}"), reason));
                    }
                }
                if !size.iter().all(|length| (1e-3..=LENGTH).contains(length)) {
                    let reason = format!("both lengths must lie between 1e-3 and {LENGTH:e} m");
                    faults.push(Fault::new("/size", reason));
                }
                if !center.iter().all(|place| place.abs() <= LENGTH) {
                    let reason = format!("both coordinates must be finite and within {LENGTH:e} m");
                    faults.push(Fault::new("/center", reason));
                }
            }
        }
        faults
    }
}
