//! Which leg is which: left or right, fore or hind, from the positions of the feet in the standing pose and the direction
//! of travel.

use std::fmt;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::limb::Limb;
use super::stride::mean;
use gaitwright_physics::character::Character;
use gaitwright_physics::model::Model;
use gaitwright_physics::stance::feet;

/// A foot is on the line between left and right within this share of the distance of the farthest foot from the middle.
const ON_THE_LINE: f64 = 1e-3;

/// A side of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// To the left of the direction of travel.
    Left,
    /// To the right of it.
    Right,
}

/// A leg of a character with as many legs on the left as on the right.
///
/// Written as two letters: the side (`L`, `R`) and the row. Rows are `F` and `H` (fore, hind) for four
/// legs, `F`, `M`, `H` for six, none for two, and otherwise numbers from 1 at the front.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Leg {
    /// Left or right.
    pub side: Side,
    /// Place along the body, 0 at the front.
    pub row: usize,
    /// Number of legs on each side.
    pub rows: usize,
}

impl fmt::Display for Leg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.side == Side::Left { "L" } else { "R" })?;
        match (self.rows, self.row) {
            (1, _) => Ok(()),
            (2 | 3, 0) => f.write_str("F"),
            (2, _) | (3, 2) => f.write_str("H"),
            (3, _) => f.write_str("M"),
            (_, row) => write!(f, "{}", row + 1),
        }
    }
}

/// A foot, by its links, and its leg.
pub(super) type PlacedFoot = (Vec<usize>, Option<Leg>);

/// The feet in the order left before right, front to back, each with its leg.
///
/// `standing` are the world frames of the character's links in its standing pose. Fore is where `direction` (world
/// frame, of any length) points seen from above, whatever the root's axes are: a character sent sideways or backward has
/// its left and fore legs where an animal that faces that way has them. Without as many feet on the left as on the
/// right, no foot has a leg and the order is that of `feet`. A foot is where its first link is.
pub(super) fn place(
    character: &Character,
    feet: Vec<Vec<usize>>,
    standing: &[Isometry3<f64>],
    direction: [f64; 3],
) -> Vec<PlacedFoot> {
    let heading = direction[1].atan2(direction[0]);
    let level = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -heading);
    let at: Vec<Vector3<f64>> =
        feet.iter().map(|links| level * foot(character, links[0], standing).coords).collect();
    let Ok(is_left) = left_feet(&at) else { return feet.into_iter().map(|links| (links, None)).collect() };
    let side = |left: bool| {
        let mut side: Vec<usize> = (0..at.len()).filter(|&index| is_left[index] == left).collect();
        side.sort_by(|&a, &b| at[b].x.total_cmp(&at[a].x));
        side
    };
    let (left, right) = (side(true), side(false));
    let rows = left.len();
    [(Side::Left, left), (Side::Right, right)]
        .into_iter()
        .flat_map(|(side, indices)| {
            indices.into_iter().enumerate().map(move |(row, index)| (index, Leg { side, row, rows }))
        })
        .map(|(index, leg)| (feet[index].clone(), Some(leg)))
        .collect()
}

/// Which of the feet at these places (way frame, m) are left ones, as many as are right ones. Left and right are relative to the middle
/// of the feet: the root's origin may lie anywhere. Feet on the line between, as the middle legs of a hexapod that goes sideways, are shared
/// out, those in front to the left.
///
/// # Errors
/// How many are on the left, on the right and on the line between, where they make no pairs.
pub(crate) fn left_feet(at: &[Vector3<f64>]) -> Result<Vec<bool>, [usize; 3]> {
    let middle = at.iter().sum::<Vector3<f64>>() / at.len().max(1) as f64;
    let size = at.iter().map(|at| (at - middle).xy().norm()).fold(0.0, f64::max);
    let beside = |at: &Vector3<f64>| {
        let off = at.y - middle.y;
        if off.abs() > ON_THE_LINE * size { off } else { 0.0 }
    };
    let mut left: Vec<bool> = at.iter().map(|at| beside(at) > 0.0).collect();
    let mut between: Vec<usize> = (0..at.len()).filter(|&index| beside(&at[index]) == 0.0).collect();
    let lefts = left.iter().filter(|left| **left).count();
    let rights = at.len() - lefts - between.len();
    let half = at.len() / 2;
    if at.len() % 2 == 1 || lefts.max(rights) > half || between.len() == at.len() {
        return Err([lefts, rights, between.len()]);
    }
    between.sort_by(|&a, &b| at[b].x.total_cmp(&at[a].x));
    between.into_iter().take(half - lefts).for_each(|index| left[index] = true);
    Ok(left)
}

/// Position of the foot of a supporting link: the origin of its lowest shape, world frame, m.
fn foot(character: &Character, link: usize, standing: &[Isometry3<f64>]) -> Point3<f64> {
    let frame = standing.get(link).copied().unwrap_or_default();
    let shapes = character.links.get(link).map_or(&[][..], |link| &link.collisions);
    shapes
        .iter()
        .map(|placed| frame * Point3::from(placed.pose.translation.vector))
        .min_by(|a, b| a.z.total_cmp(&b.z))
        .unwrap_or_else(|| Point3::from(frame.translation.vector))
}

/// Mean height above `ground` of the hips of the legs that stand on `support`, m: of where their long segments begin. `None` where
/// no joint carries any of these links.
pub(super) fn hip_height(
    model: &Model,
    support: &[usize],
    standing: &[Isometry3<f64>],
    ground: f64,
) -> Option<f64> {
    let feet = feet(model, support);
    let limbs = feet.iter().filter_map(|links| Limb::of(model, links[0], standing));
    let heights: Vec<f64> = limbs.map(|limb| standing[limb.hip].translation.z - ground).collect();
    mean(&heights)
}
