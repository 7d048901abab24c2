//! How gaits are measured, named and judged.

mod measures;
mod names;
mod natural;
mod played;

use std::sync::Arc;

use gaitwright_learning::gait::{GaitContext, GaitReport, Leg, Side, measure};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::playback::Trace;
use nalgebra::Isometry3;

use crate::synthetic::{GRAVITY, Gait, mass, quadruped};

/// Links that carry the quadruped, deliberately not in the order of the legs.
const SUPPORT: [usize; 4] = [8, 2, 6, 4];

/// A standing pose with the given heading.
fn standing(heading: f64) -> Vec<Isometry3<f64>> {
    Gait { speed: 0.0, heading, ..Gait::new([0.0; 4], 1.0) }.sample(0.0).link_poses
}

/// The gait of a trace of the synthetic quadruped that heads and goes along `heading`, rad.
fn report(trace: &Trace, heading: f64) -> GaitReport {
    report_toward(trace, heading, [2.0 * heading.cos(), 2.0 * heading.sin(), 0.0])
}

/// The same where it was asked to go along `direction`.
fn report_toward(trace: &Trace, heading: f64, direction: [f64; 3]) -> GaitReport {
    let (model, standing) = (Model::new(Arc::new(quadruped()), Base::Floating), standing(heading));
    let setting = GaitContext {
        model: &model,
        support: &SUPPORT,
        standing: &standing,
        ground: 0.0,
        mass: mass(),
        gravity: GRAVITY,
        direction,
    };
    measure(trace, &setting)
}

/// Distance of two phases on the circle.
fn circular(a: f64, b: f64) -> f64 {
    let difference = a - b;
    (difference - difference.round()).abs()
}

/// A leg of four in the order LF, LH, RF, RH.
fn leg(index: usize) -> Leg {
    let side = if index < 2 { Side::Left } else { Side::Right };
    Leg { side, row: index % 2, rows: 2 }
}

/// A leg by its name, with `rows` legs on a side.
fn leg_called(name: &str, rows: usize) -> Leg {
    let sides = [Side::Left, Side::Right].into_iter();
    let mut legs = sides.flat_map(|side| (0..rows).map(move |row| Leg { side, row, rows }));
    legs.find(|leg| leg.to_string() == name).unwrap_or_else(|| panic!("no leg {name}"))
}
