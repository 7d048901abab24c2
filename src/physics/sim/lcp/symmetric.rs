//! Symmetric positive definite systems, factorised by tiles.
//!
//! K = L D Lᵀ without a search for pivots, which takes half the work of elimination and none of its swaps. The matrix is
//! kept as tiles of [`SIDE`] × [`SIDE`] entries on and below its diagonal, so that every product is one of
//! arrays of a known length, and the last tiles are padded by the identity.

use multiversion::multiversion;

use super::residual::dot;

/// Rows and columns of a tile.
pub(super) const SIDE: usize = 4;

/// A column of a tile, or the part of a vector that belongs to a tile's rows.
pub(super) type Lanes = [f64; SIDE];

/// Entries by columns.
type Tile = [Lanes; SIDE];

/// A symmetric system of equations, K y = r.
#[derive(Debug, Clone, Default)]
pub(super) struct Symmetric {
    /// The tiles on and below the diagonal, one row of tiles after the other: of K, then of L D.
    tiles: Vec<Tile>,
    /// Of D.
    inverse: Vec<Lanes>,
}

impl Symmetric {
    /// K becomes the part of the symmetric `stride` × `stride` matrix `matrix` in the rows and columns `chosen`, with `added` on its
    /// diagonal, by place in `chosen`.
    #[inline(always)] // part of the kernels
    pub(super) fn gather(
        &mut self,
        matrix: &[f64],
        stride: usize,
        chosen: &[usize],
        added: impl Fn(usize) -> f64,
    ) {
        self.tiles.clear();
        self.inverse.resize(tiles(chosen.len()), [0.0; SIDE]);
        for (row, here) in chosen.chunks(SIDE).enumerate() {
            let place = run(here);
            for (column, there) in chosen.chunks(SIDE).take(row + 1).enumerate() {
                let mut tile = [[0.0; SIDE]; SIDE];
                if let (Some(first), Some(other)) = (place, run(there)) {
                    let lines = matrix[other * stride..].chunks(stride);
                    for (lanes, line) in tile.iter_mut().zip(lines) {
                        lanes.copy_from_slice(&line[first..first + SIDE]);
                    }
                } else {
                    for (lanes, other) in tile.iter_mut().zip(there) {
                        let line = &matrix[other * stride..(other + 1) * stride];
                        lanes.iter_mut().zip(here).for_each(|(lane, row)| *lane = line[*row]);
                    }
                }
                if row == column {
                    (0..there.len()).for_each(|index| tile[index][index] += added(SIDE * row + index));
                    (there.len()..SIDE).for_each(|beyond| tile[beyond][beyond] = 1.0);
                }
                self.tiles.push(tile);
            }
        }
    }

    /// Adds equations to K until there are `size`, with zeros for their entries, to be set one by one.
    #[inline(always)] // part of the kernels
    pub(super) fn extend(&mut self, size: usize) {
        let rows = tiles(size);
        self.inverse.resize(rows, [0.0; SIDE]);
        self.tiles.resize(first_of(rows), [[0.0; SIDE]; SIDE]);
        for beyond in size..SIDE * rows {
            self.set(beyond, beyond, 1.0);
        }
    }

    /// Sets the entry of K in `row` and in `column`, which is not greater.
    #[inline(always)] // part of the kernels
    pub(super) fn set(&mut self, row: usize, column: usize, entry: f64) {
        self.tiles[first_of(row / SIDE) + column / SIDE][column % SIDE][row % SIDE] = entry;
    }

    /// The inverses of the pivots of the factorised K, in the order of its equations.
    pub(super) fn inverse_pivots(&self) -> &[f64] {
        self.inverse.as_flattened()
    }
}

/// How many tiles lie beside each other along `size` equations.
#[inline(always)] // part of the kernels
pub(super) fn tiles(size: usize) -> usize {
    size.div_ceil(SIDE)
}

/// Puts L D in place of K. `None` when a pivot is not positive; K is lost then.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn factorise(system: &mut Symmetric) -> Option<()> {
    let Symmetric { tiles, inverse, .. } = system;
    let rows = inverse.len();
    for pivot in 0..rows {
        let (above, below) = tiles.split_at_mut(first_of(pivot + 1));
        let diagonal = above.last_mut()?;
        let inverse = &mut inverse[pivot];
        *inverse = factorise_tile(diagonal)?;
        let mut start = 0;
        for row in pivot + 1..rows {
            let (before, own) = below.split_at_mut(start);
            let (own, _) = own.split_at_mut(row + 1);
            let (own, rest) = own[pivot..].split_first_mut()?;
            eliminate(own, diagonal, inverse);
            let mut other = 0;
            for (column, tile) in (pivot + 1..=row).zip(rest) {
                let across = if column == row { &*own } else { &before[other + pivot] };
                for k in 0..SIDE {
                    let scaled = own[k].map(|entry| entry * inverse[k]);
                    for (lanes, factor) in tile.iter_mut().zip(across[k]) {
                        *lanes = std::array::from_fn(|lane| lanes[lane] - factor * scaled[lane]);
                    }
                }
                other += column + 1;
            }
            start += row + 1;
        }
    }
    Some(())
}

/// Puts y in place of the right-hand side r, which has as many lanes as `system`, now factorised, has rows of tiles.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn substitute(system: &Symmetric, side: &mut [Lanes]) {
    let Symmetric { tiles, inverse, .. } = system;
    let rows = side.len();
    for pivot in 0..rows {
        let (known, left) = side.split_at_mut(pivot + 1);
        let (own, inverse) = (&mut known[pivot], &inverse[pivot]);
        let diagonal = &tiles[first_of(pivot) + pivot];
        for c in 0..SIDE - 1 {
            let factor = own[c] * inverse[c];
            for r in c + 1..SIDE {
                own[r] -= factor * diagonal[c][r];
            }
        }
        let share: Lanes = std::array::from_fn(|c| own[c] * inverse[c]);
        for (row, side) in (pivot + 1..rows).zip(left) {
            subtract(side, &tiles[first_of(row) + pivot], &share);
        }
    }
    for row in (0..rows).rev() {
        let (known, below) = side.split_at_mut(row + 1);
        let own = &mut known[row];
        let mut sums = [0.0; SIDE];
        for (other, known) in (row + 1..rows).zip(below) {
            for (sum, column) in sums.iter_mut().zip(&tiles[first_of(other) + row]) {
                *sum += dot(column, known);
            }
        }
        let diagonal = &tiles[first_of(row) + row];
        for c in (0..SIDE).rev() {
            let mut sum = own[c] - sums[c];
            for r in c + 1..SIDE {
                sum -= diagonal[c][r] * own[r];
            }
            own[c] = sum * inverse[row][c];
        }
    }
}

/// The first of as many rows as a tile has, if nothing between them is left out.
#[inline(always)] // part of the kernels
fn run(chosen: &[usize]) -> Option<usize> {
    match *chosen {
        [first, _, _, last] if last - first == SIDE - 1 => Some(first),
        _ => None,
    }
}

/// Index of the first tile of a row of tiles.
fn first_of(row: usize) -> usize {
    row * (row + 1) / 2
}

/// Puts L D in place of the tile, which is symmetric, and gives D's inverse; `None` when a pivot is not positive.
#[inline(always)] // part of the kernels
fn factorise_tile(tile: &mut Tile) -> Option<Lanes> {
    let mut inverse = [0.0; SIDE];
    for c in 0..SIDE {
        let column = tile[c];
        if column[c].is_nan() || column[c] <= 0.0 {
            return None;
        }
        inverse[c] = 1.0 / column[c];
        for other in c + 1..SIDE {
            let factor = column[other] * inverse[c];
            tile[other] = std::array::from_fn(|lane| tile[other][lane] - factor * column[lane]);
        }
    }
    Some(inverse)
}

/// Puts L D in place of a tile below `diagonal`, which is factorised.
#[inline(always)] // part of the kernels
fn eliminate(tile: &mut Tile, diagonal: &Tile, inverse: &Lanes) {
    for c in 0..SIDE - 1 {
        let column = tile[c];
        for other in c + 1..SIDE {
            let factor = diagonal[c][other] * inverse[c];
            tile[other] = std::array::from_fn(|lane| tile[other][lane] - factor * column[lane]);
        }
    }
}

/// `vector − tile · share`.
#[inline(always)] // part of the kernels
fn subtract(vector: &mut Lanes, tile: &Tile, share: &Lanes) {
    for (column, share) in tile.iter().zip(share) {
        *vector = std::array::from_fn(|lane| vector[lane] - share * column[lane]);
    }
}
