//! The front: the settings that no other setting beats in both computing time and error.

use super::row::TableRow;

/// Marks the rows that no other row beats in both computing time and error.
pub(super) fn mark_front(rows: &mut [TableRow]) {
    let cost = |row: &TableRow| row.comparable().map(|figures| (figures.seconds, figures.error));
    let costs: Vec<_> = rows.iter().map(cost).collect();
    for (row, own) in rows.iter_mut().zip(&costs) {
        row.front = own.is_some_and(|own| !costs.iter().flatten().any(|other| beats(*other, own)));
    }
}

/// Whether `one` is at least as fast and as exact as `other`, and better in one of the two.
fn beats(one: (f64, f64), other: (f64, f64)) -> bool {
    one.0 <= other.0 && one.1 <= other.1 && one != other
}
