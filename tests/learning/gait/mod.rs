//! How gaits are measured, named and judged.

mod names;

use gaitwright_learning::gait::{Leg, Side};

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
