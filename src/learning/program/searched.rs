//! Which parameters of a leg program a search changes.

use super::legs::Legs;
use super::ring::{
    APART, ASIDE_LAGS, FORE_DUTY, FORE_FOOTHOLD, FORE_LIFT, FORE_PUSH, FORE_WIDTH, SIDEWAYS, SWAY, TURN,
    Wanted,
};

/// What makes fore legs differ from hind legs.
const OF_ROWS: [usize; 6] = [FORE_DUTY, FORE_FOOTHOLD, FORE_WIDTH, FORE_LIFT, FORE_PUSH, APART];

/// Indices of those of `count` parameters that a search changes.
///
/// Not those that do nothing for the gait or for the legs: a search is the slower the more it has. Nor those that a way is set straight
/// with, where that is done in the end: the turns and drifts that they cause by chance hide what the others do. Bounds of two
/// robots cost a quarter less without these two, and from seeds that such searches came to.
pub fn searched(legs: &Legs, wanted: &Wanted, count: usize) -> Vec<usize> {
    let mut left_out = Vec::new();
    if legs.spine.is_none() {
        let mirrored = wanted.gait.mirrored_after();
        if mirrored.is_some() {
            left_out.extend(ASIDE_LAGS);
        }
        // Nothing sways over legs that carry left and right at once, if they go straight on.
        if mirrored == Some(0.0) {
            left_out.push(SWAY);
        }
        if legs.rows() == 1 {
            left_out.extend(OF_ROWS);
        }
        if wanted.straightened_later {
            left_out.extend([TURN, SIDEWAYS]);
        }
    }
    (0..count).filter(|index| !left_out.contains(index)).collect()
}
