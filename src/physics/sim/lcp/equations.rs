//! The linear equations of an active set, and their solution.
//!
//! They are scaled to a unit diagonal, so that mass ratios do not spoil them, and a share [`PROXIMITY`] of the identity is
//! added: rows that depend on each other (a box on four points) leave many solutions, and the one nearest to the start is
//! taken. The steps then are those of the proximal-point method (Rockafellar 1976), whose limit does
//! not depend on that share.
//!
//! Where A is symmetric, so are the equations but for the columns of normal forces that sliding friction follows: it answers
//! to its normal force, and the normal force does not answer to it. Those columns and their rows are the border of a
//! symmetric positive definite core. The core is factorised without a search for pivots, which does the same in every scale,
//! so that only the share of the identity is scaled, and the few unknowns of the border follow from its Schur complement.
//! Where A is not symmetric, or rows of the core depend on each other, all equations are solved by elimination with pivots.

use super::linear;
use super::pieces::Pieces;
use super::problem::Problem;
use super::residual::dot;
use super::symmetric::{self, Lanes, SIDE, Symmetric};

/// Large against rounding (1e-16), small against the least eigenvalue that matters of a scaled matrix.
pub(super) const PROXIMITY: f64 = 1e-10;

/// The least pivot, as a share of its equation's diagonal, with which core and border are solved for one after the other. Rounding
/// errors are 10⁻¹⁶ by the least pivot; they have to be small against [`PROXIMITY`], which may be all that is left where rows
/// depend on each other.
const LEAST_PIVOT: f64 = 1e-4;

/// What the equations of an active set ask for and how far their solution goes, both scaled to a unit diagonal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    /// The greatest magnitude on the right-hand side.
    pub(super) asked: f64,
    /// The greatest of an unknown.
    pub(super) gone: f64,
}

/// The scratch memory of the solution.
#[derive(Debug, Clone, Default)]
pub(super) struct Equations {
    /// n, by how much each force changes; 0 where it is not unknown.
    changes: Vec<f64>,
    /// By how much each direction of sliding rotates, as a length of arc; 0 where it cannot.
    turns: Vec<f64>,
    /// The rows whose forces are unknowns of the core, in ascending order. Turns are its other unknowns.
    inner: Vec<usize>,
    /// The sliding contacts whose directions turn.
    turning: Vec<usize>,
    /// The rows whose forces are unknowns of the border: normal forces that friction follows.
    outer: Vec<usize>,
    core: Symmetric,
    /// The diagonal of each unknown of the core, then of the border (see [`stiffness`]); of all unknowns its root.
    scales: Vec<f64>,
    /// n for each direction of sliding: what a unit of its turn does to the velocities of all rows.
    effects_of_turns: Vec<f64>,
    /// n for each row of the border: what a unit of its force does with the friction that follows it.
    effects: Vec<f64>,
    /// Right-hand sides of the core, each of whole lanes: the equations' own, and one for every column of the border.
    sides: Vec<Lanes>,
    /// The border's rows beside the core, in as many lanes.
    below: Vec<Lanes>,
    /// See [`linear::solve`]: of all unknowns, or of those of the border.
    system: Vec<f64>,
    /// Those unknowns, where they are all.
    unknowns: Vec<Unknown>,
    /// Of each direction of sliding, which of them is the normal force that friction follows, if it is one.
    followed: Vec<Option<usize>>,
}

impl Equations {
    /// By how much forces change and directions of sliding turn, as [`Pieces::apply`] takes them.
    pub(super) fn solution(&self) -> (&[f64], &[f64]) {
        (&self.changes, &self.turns)
    }

    /// Solves the equations of `pieces` at a point with the velocities `velocity`; `None` when elimination found no pivot.
    #[inline(always)] // part of the kernels
    pub(super) fn solve(
        &mut self,
        problem: &Problem<'_>,
        pieces: &Pieces,
        velocity: &[f64],
    ) -> Option<Extent> {
        self.changes.resize(problem.rows(), 0.0);
        cleared(&mut self.turns, pieces.sliding.len(), 0.0);
        self.turning.clear();
        self.turning.extend((0..pieces.sliding.len()).filter(|index| pieces.sliding[*index].turn.is_some()));
        let direct = if !problem.symmetric {
            None
        } else if pieces.sliding.is_empty() {
            self.solve_symmetric(problem, pieces, velocity)
        } else {
            self.solve_bordered(problem, pieces, velocity)
        };
        direct.or_else(|| self.solve_with_pivots(problem, pieces, velocity))
    }

    /// The solution where every unknown is the force of a row. `None` when a pivot is not positive.
    #[inline(always)] // part of the kernels
    fn solve_symmetric(
        &mut self,
        problem: &Problem<'_>,
        pieces: &Pieces,
        velocity: &[f64],
    ) -> Option<Extent> {
        let Self { changes, inner, core, scales, sides, .. } = self;
        inner.clear();
        inner.extend((0..problem.rows()).filter(|row| pieces.free[*row]));
        if inner.len() < changes.len() {
            changes.fill(0.0);
        }
        scales.clear();
        scales.extend(inner.iter().map(|row| stiffness(problem, *row)));
        core.gather(problem.matrix, problem.rows(), inner, |place| PROXIMITY * scales[place]);
        cleared(sides, symmetric::tiles(inner.len()), [0.0; SIDE]);
        let (mut asked, mut gone) = (0.0_f64, 0.0_f64);
        for ((side, row), scale) in sides.as_flattened_mut().iter_mut().zip(&*inner).zip(&*scales) {
            let wrong = velocity[*row];
            *side = -wrong;
            asked = asked.max(wrong.powi(2) / scale);
        }
        symmetric::factorise(core)?;
        symmetric::substitute(core, sides);
        for ((value, row), scale) in sides.as_flattened().iter().zip(&*inner).zip(&*scales) {
            changes[*row] = *value;
            gone = gone.max(value.powi(2) * scale);
        }
        Some(Extent { asked: asked.sqrt(), gone: gone.sqrt() })
    }

    /// The solution of equations that are symmetric but for the columns of the normal forces that sliding friction follows.
    /// `None` when a pivot is smaller than [`LEAST_PIVOT`].
    #[inline(always)] // part of the kernels
    fn solve_bordered(&mut self, problem: &Problem<'_>, pieces: &Pieces, velocity: &[f64]) -> Option<Extent> {
        self.find_border(problem, pieces);
        self.gather_core(problem, pieces);
        let asked = self.gather_border(problem, pieces, velocity);
        let Self { changes, turns, inner, turning, outer, core, scales, sides, below, system, .. } = self;
        symmetric::factorise(core)?;
        if core
            .inverse_pivots()
            .iter()
            .zip(&scales[..scales.len() - outer.len()])
            .any(|(inverse, scale)| LEAST_PIVOT * inverse * scale > 1.0)
        {
            return None;
        }
        let size = SIDE * symmetric::tiles(scales.len() - outer.len());
        for side in sides.chunks_exact_mut((size / SIDE).max(1)) {
            symmetric::substitute(core, side);
        }
        // The Schur complement of the core, beside what its solution leaves of the border's right-hand side.
        let (width, last) = (linear::width(outer.len()), outer.len());
        let (own, columns) = sides.as_flattened_mut().split_at_mut(size);
        for (place, entries) in system.chunks_exact_mut(width).enumerate() {
            let below = &below.as_flattened()[place * size..(place + 1) * size];
            entries[last] -= dot(below, own);
            for (column, entry) in entries[..last].iter_mut().enumerate() {
                *entry -= dot(below, &columns[column * size..(column + 1) * size]);
            }
        }
        linear::solve(system, last)?;
        changes.fill(0.0);
        let scales_of_border = &scales[scales.len() - last..];
        let pivots = system.chunks_exact(width).enumerate().map(|(place, entries)| entries[place]);
        if pivots.zip(scales_of_border).any(|(pivot, scale)| pivot.abs() < LEAST_PIVOT * scale) {
            return None;
        }
        let mut gone = 0.0_f64;
        let of_border = outer.iter().zip(scales_of_border).zip(system.chunks_exact(width));
        for (place, ((row, scale), entries)) in of_border.enumerate() {
            let value = entries[last];
            changes[*row] = value;
            gone = gone.max(value.powi(2) * scale);
            for (own, column) in own.iter_mut().zip(&columns[place * size..(place + 1) * size]) {
                *own -= value * column;
            }
        }
        gone = own.iter().zip(&*scales).fold(gone, |gone, (value, scale)| gone.max(value.powi(2) * scale));
        let (of_rows, of_turns) = own.split_at(inner.len());
        inner.iter().zip(of_rows).for_each(|(row, value)| changes[*row] = *value);
        turning.iter().zip(of_turns).for_each(|(index, value)| turns[*index] = *value);
        Some(Extent { asked: asked.sqrt(), gone: gone.sqrt() })
    }

    /// Divides the rows of unknown forces between core and border, and finds what turns and the forces of the border do.
    #[inline(always)] // part of the kernels
    fn find_border(&mut self, problem: &Problem<'_>, pieces: &Pieces) {
        let n = problem.rows();
        let Self { inner, outer, effects_of_turns, effects, .. } = self;
        outer.clear();
        for sliding in &pieces.sliding {
            if pieces.free[sliding.normal] && !outer.contains(&sliding.normal) {
                outer.push(sliding.normal);
            }
        }
        inner.clear();
        inner.extend((0..n).filter(|row| pieces.free[*row] && !outer.contains(row)));
        effects.clear();
        for row in &*outer {
            let from = effects.len();
            effects.extend_from_slice(&problem.matrix[row * n..(row + 1) * n]);
            for sliding in pieces.sliding.iter().filter(|sliding| sliding.normal == *row) {
                sliding.add_effects_along(problem, &mut effects[from..]);
            }
        }
        effects_of_turns.resize(pieces.sliding.len() * n, 0.0);
        for (sliding, effects) in pieces.sliding.iter().zip(effects_of_turns.chunks_exact_mut(n)) {
            sliding.effects_across(problem, effects);
        }
    }

    /// Fills the core, and its part of the scales.
    #[inline(always)] // part of the kernels
    fn gather_core(&mut self, problem: &Problem<'_>, pieces: &Pieces) {
        let n = problem.rows();
        let Self { inner, turning, core, scales, effects_of_turns, .. } = self;
        scales.clear();
        scales.extend(inner.iter().map(|row| stiffness(problem, *row)));
        core.gather(problem.matrix, n, inner, |place| PROXIMITY * scales[place]);
        core.extend(inner.len() + turning.len());
        for (place, index) in (inner.len()..).zip(&*turning) {
            let (sliding, effects) = (&pieces.sliding[*index], &effects_of_turns[index * n..(index + 1) * n]);
            for (column, row) in inner.iter().enumerate() {
                core.set(place, column, effects[*row]);
            }
            for (column, other) in (inner.len()..place).zip(&*turning) {
                core.set(place, column, pieces.sliding[*other].across(effects));
            }
            let diagonal = sliding.across(effects) + sliding.turn.map_or(0.0, |turn| turn.bend);
            let scale = if diagonal > 0.0 { diagonal } else { greatest(problem, sliding.rows[0]) };
            core.set(place, place, diagonal + PROXIMITY * scale);
            scales.push(scale);
        }
    }

    /// Fills the border and the right-hand sides, and the border's part of the scales. Returns the square of the greatest
    /// magnitude on the equations' own right-hand side, scaled to a unit diagonal.
    #[inline(always)] // part of the kernels
    fn gather_border(&mut self, problem: &Problem<'_>, pieces: &Pieces, velocity: &[f64]) -> f64 {
        let n = problem.rows();
        let Self { inner, turning, outer, scales, effects_of_turns, effects, sides, below, system, .. } =
            self;
        let tiles = symmetric::tiles(inner.len() + turning.len());
        cleared(sides, (1 + outer.len()) * tiles, [0.0; SIDE]);
        cleared(below, outer.len() * tiles, [0.0; SIDE]);
        let (own, columns) = sides.as_flattened_mut().split_at_mut(SIDE * tiles);
        let of_core = |numbers: &[f64], side: &mut [f64], sign: f64| {
            for (entry, row) in side.iter_mut().zip(&*inner) {
                *entry = sign * numbers[*row];
            }
            for (entry, index) in side[inner.len()..].iter_mut().zip(&*turning) {
                *entry = sign * pieces.sliding[*index].across(numbers);
            }
        };
        of_core(velocity, own, -1.0);
        let mut asked =
            own.iter().zip(&*scales).fold(0.0_f64, |asked, (side, scale)| asked.max(side.powi(2) / scale));
        let width = linear::width(outer.len());
        system.resize(outer.len() * width, 0.0);
        for (place, row) in outer.iter().enumerate() {
            let side = place * SIDE * tiles..(place + 1) * SIDE * tiles;
            of_core(&effects[place * n..(place + 1) * n], &mut columns[side.clone()], 1.0);
            let below = &mut below.as_flattened_mut()[side];
            for (entry, other) in below.iter_mut().zip(&*inner) {
                *entry = problem.matrix[row * n + other];
            }
            for (entry, index) in below[inner.len()..].iter_mut().zip(&*turning) {
                *entry = effects_of_turns[index * n + row];
            }
            let (scale, wrong) = (stiffness(problem, *row), velocity[*row]);
            let entries = &mut system[place * width..(place + 1) * width];
            for (entry, effects) in entries.iter_mut().zip(effects.chunks_exact(n)) {
                *entry = effects[*row];
            }
            entries[place] += PROXIMITY * scale;
            entries[outer.len()] = -wrong;
            scales.push(scale);
            asked = asked.max(wrong.powi(2) / scale);
        }
        asked
    }

    /// The solution of all equations by elimination with pivots; `None` when it finds none.
    fn solve_with_pivots(
        &mut self,
        problem: &Problem<'_>,
        pieces: &Pieces,
        velocity: &[f64],
    ) -> Option<Extent> {
        let n = problem.rows();
        self.find_unknowns(problem, pieces);
        let Self { changes, turns, unknowns, followed, scales, effects_of_turns, system, .. } = self;
        // Where A is not symmetric, these are combinations of its rows and no effects.
        effects_of_turns.resize(pieces.sliding.len() * n, 0.0);
        for (sliding, combined) in pieces.sliding.iter().zip(effects_of_turns.chunks_exact_mut(n)) {
            sliding.effects_across(problem, combined);
        }
        let equation = |unknown: &Unknown| match *unknown {
            Unknown::Force(row) => &problem.matrix[row * n..(row + 1) * n],
            Unknown::Turn(index) => &effects_of_turns[index * n..(index + 1) * n],
        };
        scales.clear();
        for unknown in &*unknowns {
            let diagonal = unknown.of(pieces, equation(unknown)) + unknown.bend(pieces);
            let row = match *unknown {
                Unknown::Force(row) => row,
                Unknown::Turn(index) => pieces.sliding[index].rows[0],
            };
            scales.push(if diagonal > 0.0 { diagonal } else { greatest(problem, row) }.sqrt());
        }
        followed.clear();
        followed.extend(
            pieces.sliding.iter().map(|sliding| {
                unknowns.iter().position(|unknown| *unknown == Unknown::Force(sliding.normal))
            }),
        );
        let (m, width) = (unknowns.len(), linear::width(unknowns.len()));
        // Padding need not be cleared: nothing depends on it.
        system.resize(m * width, 0.0);
        for (place, row) in system.chunks_exact_mut(width).enumerate() {
            let (own, entries) = (&unknowns[place], equation(&unknowns[place]));
            for (entry, other) in row.iter_mut().zip(&*unknowns) {
                *entry = other.of(pieces, entries);
            }
            for (sliding, normal) in pieces.sliding.iter().zip(&*followed) {
                if let Some(normal) = *normal {
                    row[normal] += sliding.coefficient * sliding.along(entries);
                }
            }
            row[place] += own.bend(pieces);
            for (entry, scale) in row.iter_mut().zip(&*scales) {
                *entry /= scales[place] * scale;
            }
            row[place] += PROXIMITY;
            row[m] = -own.of(pieces, velocity) / scales[place];
        }
        let magnitudes =
            |system: &[f64]| system.chunks_exact(width).fold(0.0_f64, |most, row| most.max(row[m].abs()));
        let asked = magnitudes(system);
        linear::solve(system, m)?;
        changes.fill(0.0);
        let gone = magnitudes(system);
        for ((unknown, row), scale) in unknowns.iter().zip(system.chunks_exact(width)).zip(&*scales) {
            match *unknown {
                Unknown::Force(force) => changes[force] = row[m] / scale,
                Unknown::Turn(index) => turns[index] = row[m] / scale,
            }
        }
        Some(Extent { asked, gone })
    }

    /// All unknowns, normal forces first: where rows depend on each other, elimination leaves as they are what comes last.
    fn find_unknowns(&mut self, problem: &Problem<'_>, pieces: &Pieces) {
        let Self { unknowns, turning, .. } = self;
        unknowns.clear();
        let normal = |row: &usize| pieces.free[*row] && !problem.bounds[*row].is_friction();
        unknowns.extend((0..problem.rows()).filter(normal).map(Unknown::Force));
        let mut turning = turning.iter().copied().peekable();
        for row in (0..problem.rows()).filter(|row| problem.bounds[*row].is_friction()) {
            if pieces.free[row] {
                unknowns.push(Unknown::Force(row));
            } else if let Some(index) = turning.next_if(|index| pieces.sliding[*index].rows[0] == row) {
                unknowns.push(Unknown::Turn(index));
            }
        }
    }
}

/// What an equation of an active set is solved for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unknown {
    /// The force of a row.
    Force(usize),
    /// How far a direction of sliding turns.
    Turn(usize),
}

impl Unknown {
    /// What `numbers`, one for every row, are along it.
    fn of(self, pieces: &Pieces, numbers: &[f64]) -> f64 {
        match self {
            Self::Force(row) => numbers[row],
            Self::Turn(index) => pieces.sliding[index].across(numbers),
        }
    }

    /// See [`Turn::bend`](super::pieces::Turn::bend).
    fn bend(self, pieces: &Pieces) -> f64 {
        match self {
            Self::Force(_) => 0.0,
            Self::Turn(index) => pieces.sliding[index].turn.map_or(0.0, |turn| turn.bend),
        }
    }
}

/// Makes `numbers` `count` times `zero`.
fn cleared<T: Clone>(numbers: &mut Vec<T>, count: usize, zero: T) {
    numbers.clear();
    numbers.resize(count, zero);
}

/// The diagonal of the force of `row`, and where that is not positive the greatest entry of its row.
fn stiffness(problem: &Problem<'_>, row: usize) -> f64 {
    let diagonal = problem.matrix[row * (problem.rows() + 1)];
    if diagonal > 0.0 { diagonal } else { greatest(problem, row) }
}

/// The greatest entry of a row, or 1 where there is none.
fn greatest(problem: &Problem<'_>, row: usize) -> f64 {
    let n = problem.rows();
    let entries = &problem.matrix[row * n..(row + 1) * n];
    let greatest = entries.iter().fold(0.0_f64, |greatest, entry| greatest.max(entry.abs()));
    if greatest > 0.0 { greatest } else { 1.0 }
}
