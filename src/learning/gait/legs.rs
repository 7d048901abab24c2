//! Which leg is which: left or right, fore or hind, from the positions of the feet in the standing pose and the direction
//! of travel.

use std::fmt;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::limb::Limb;
use super::stride::mean;
use gaitwright_physics::character::Character;
use gaitwright_physics::model::Model;
use gaitwright_physics::stance::feet;

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
    // Left and right are relative to the middle of the feet: the root's origin may lie anywhere.
    let middle = at.iter().map(|at| at.y).sum::<f64>() / at.len().max(1) as f64;
    let side = |left: bool| {
        let mut side: Vec<usize> = (0..at.len()).filter(|&index| (at[index].y > middle) == left).collect();
        side.sort_by(|&a, &b| at[b].x.total_cmp(&at[a].x));
        side
    };
    let (left, right) = (side(true), side(false));
    if left.len() != right.len() {
        return feet.into_iter().map(|links| (links, None)).collect();
    }
    let rows = left.len();
    [(Side::Left, left), (Side::Right, right)]
        .into_iter()
        .flat_map(|(side, indices)| {
            indices.into_iter().enumerate().map(move |(row, index)| (index, Leg { side, row, rows }))
        })
        .map(|(index, leg)| (feet[index].clone(), Some(leg)))
        .collect()
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
