//! The ground as a step needs it.

use nalgebra::Vector3;

use super::Ground;

/// The surface of the ground.
#[derive(Debug, Clone, PartialEq)]
pub enum Terrain {
    /// A horizontal plane.
    Plane {
        /// z in the world frame, m.
        height: f64,
    },
    /// A surface of triangles over a grid.
    Field(HeightField),
}

/// A surface over a rectangular grid along the world's x and y.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    /// Row by row along y, each along x, m.
    heights: Vec<f64>,
    /// Numbers of points along x and y, at least 2.
    points: [usize; 2],
    /// Distances between them, m.
    spacing: [f64; 2],
    /// Least x and y, m.
    corner: [f64; 2],
    /// Greatest height, m.
    highest: f64,
}

impl Terrain {
    /// The surface of a `ground` without faults.
    pub fn new(ground: &Ground) -> Self {
        match ground {
            Ground::Plane { height } => Self::Plane { height: *height },
            Ground::HeightField { heights, size, center } => {
                let points = [heights.first().map_or(0, Vec::len), heights.len()];
                let heights = heights.concat();
                Self::Field(HeightField {
                    highest: heights.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                    heights,
                    points,
                    spacing: [0, 1].map(|axis| size[axis] / (points[axis] - 1) as f64),
                    corner: [0, 1].map(|axis| center[axis] - size[axis] / 2.0),
                })
            }
        }
    }

    /// z of the surface at `x`, `y`, m; beyond a height field that of its nearest point.
    pub fn height(&self, x: f64, y: f64) -> f64 {
        match self {
            Self::Plane { height } => *height,
            Self::Field(field) => {
                let at = [field.within(0, x), field.within(1, y)];
                field.triangle_at(at[0], at[1]).map_or(field.highest, |[a, b, c]| {
                    let up = (b - a).cross(&(c - a));
                    a.z - (up.x * (at[0] - a.x) + up.y * (at[1] - a.y)) / up.z
                })
            }
        }
    }

    /// Greatest z of the surface, m.
    pub fn highest(&self) -> f64 {
        match self {
            Self::Plane { height } => *height,
            Self::Field(field) => field.highest,
        }
    }
}

impl HeightField {
    /// All corners, row by row along y, and how many of them a row has.
    pub fn corners(&self) -> (impl Iterator<Item = Vector3<f64>> + '_, usize) {
        let [columns, rows] = self.points;
        let corners = (0..rows).flat_map(move |row| (0..columns).map(move |column| self.point(column, row)));
        (corners, columns)
    }

    /// Corners of the triangle above or below `x`, `y`, counter-clockwise seen from above; `None` beyond the
    /// rectangle.
    pub fn triangle_at(&self, x: f64, y: f64) -> Option<[Vector3<f64>; 3]> {
        let (column, across) = self.cell(0, x)?;
        let (row, along) = self.cell(1, y)?;
        let [lower, upper] = self.triangles(column, row);
        Some(if across >= along { lower } else { upper })
    }

    /// Calls `each` with every triangle of the cells that a square of half width `reach` around `x`, `y`
    /// touches.
    pub fn triangles_near(&self, x: f64, y: f64, reach: f64, mut each: impl FnMut([Vector3<f64>; 3])) {
        let range = |axis: usize, at: f64| {
            let cells = self.points[axis] - 1;
            let cell = |at: f64| ((at - self.corner[axis]) / self.spacing[axis]).floor();
            let (first, last) = (cell(at - reach), cell(at + reach));
            if last < 0.0 || first >= cells as f64 {
                0..0
            } else {
                first.max(0.0) as usize..(last as usize + 1).min(cells)
            }
        };
        for row in range(1, y) {
            for column in range(0, x) {
                self.triangles(column, row).into_iter().for_each(&mut each);
            }
        }
    }

    /// The two triangles of a cell, counter-clockwise seen from above: the one on the side of greater x, and the one
    /// on the side of greater y.
    fn triangles(&self, column: usize, row: usize) -> [[Vector3<f64>; 3]; 2] {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| self.point(column + x, row + y));
        [[a, b, c], [a, c, d]]
    }

    fn point(&self, column: usize, row: usize) -> Vector3<f64> {
        let along = |axis: usize, index: usize| self.corner[axis] + self.spacing[axis] * index as f64;
        Vector3::new(along(0, column), along(1, row), self.heights[row * self.points[0] + column])
    }

    /// Index of the cell along `axis` that contains `at`, and the share of the cell's length that lies before `at`.
    fn cell(&self, axis: usize, at: f64) -> Option<(usize, f64)> {
        let cells = self.points[axis] - 1;
        let place = (at - self.corner[axis]) / self.spacing[axis];
        if !(0.0..=cells as f64).contains(&place) {
            return None;
        }
        let cell = (place as usize).min(cells - 1);
        Some((cell, place - cell as f64))
    }

    /// The value nearest to `at` within the rectangle.
    fn within(&self, axis: usize, at: f64) -> f64 {
        let length = self.spacing[axis] * (self.points[axis] - 1) as f64;
        // A little inward, so that rounding does not put the border outside.
        let rounding = 1e-12 * length;
        at.clamp(self.corner[axis] + rounding, self.corner[axis] + length - rounding)
    }
}
