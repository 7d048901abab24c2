//! What a subset of states is closed under: the mirror image, and the cyclic shift of limbs.
//!
//! Animals of two, four, six or eight legs move their left legs as their right ones half a stride later, and in many gaits every
//! leg as the one behind it part of a stride later. A subset that contains the mirror image of each of its states, and
//! what it becomes when each limb does what the one before it did, holds such gaits as rings: of one state of a pronk,
//! of a few of a trot and the pace that belongs to it, of all of a walk.

use super::levels::{GridState, JointGrid};
use super::limb::JointChain;

/// Share of the greatest distance of a limb from the root's origin within which two places are the same.
const SAME_PLACE: f64 = 0.02;

/// Where each joint's level comes from, and with which sign.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointMap(Vec<(usize, i8)>);

impl JointMap {
    fn identity(joints: usize) -> Self {
        Self((0..joints).map(|joint| (joint, 1)).collect())
    }

    /// Lets the joints of `to` take the levels of those of `from`.
    fn take(&mut self, to: &JointChain, from: &JointChain, signs: &[i8]) {
        for ((&to, &from), &sign) in to.joints.iter().zip(&from.joints).zip(signs) {
            self.0[to] = (from, sign);
        }
    }

    /// First `self`, then `next`.
    fn then(&self, next: &Self) -> Self {
        let through = |&(from, sign): &(usize, i8)| {
            let (origin, first) = self.0[from];
            (origin, sign * first)
        };
        Self(next.0.iter().map(through).collect())
    }

    /// Source and sign of every joint.
    pub fn sources(&self) -> &[(usize, i8)] {
        &self.0
    }

    fn image(&self, joints: &[JointGrid], state: &GridState) -> GridState {
        let levels = joints.iter().zip(&self.0).map(|(joint, &(from, sign))| {
            let (level, sign) = (state.levels[from], i16::from(sign));
            joint.clamp(sign * i16::from(level.angle), sign * i16::from(level.velocity))
        });
        GridState { levels: levels.collect(), beats: state.beats }
    }
}

/// The symmetry of a character's joints.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symmetry {
    mirror: JointMap,
    /// The shift of limbs by 0, 1, … rows. By all rows it is the mirror image.
    shifts: Vec<JointMap>,
}

impl Symmetry {
    /// That of `limbs`; `None` where a limb lies aside and has no mirror image, or other ranges of motion than it.
    pub fn of(limbs: &[JointChain], joints: &[JointGrid]) -> Option<Self> {
        let size = limbs.iter().map(|limb| limb.origin.norm()).fold(0.0, f64::max);
        let near = SAME_PLACE * size;
        let mut mirror = JointMap::identity(joints.len());
        // Pairs of a left and a right limb.
        let mut rows: Vec<[&JointChain; 2]> = Vec::new();
        for limb in limbs {
            let image = limb.mirrored_origin();
            let twin = |other: &&JointChain| {
                (other.origin - image).norm() <= near && other.joints.len() == limb.joints.len()
            };
            if limb.left.abs() <= near {
                mirror.take(limb, limb, &limb.own_mirror_signs());
            } else {
                let twin = limbs.iter().find(twin)?;
                mirror.take(limb, twin, &limb.signs_from(twin)?);
                if limb.left > 0.0 {
                    rows.push([limb, twin]);
                }
            }
        }
        let mirrored = |joint: &JointGrid, (from, sign): (usize, i8)| joint.mirrors(&joints[from], sign);
        if !joints.iter().zip(&mirror.0).all(|(joint, &source)| mirrored(joint, source)) {
            return None;
        }
        // Front to back; stable, so that the order does not depend on rounding of equals.
        rows.sort_by(|a, b| b[0].ahead.total_cmp(&a[0].ahead));
        let shift = shift(&rows, joints.len());
        let mut shifts = vec![JointMap::identity(joints.len())];
        if let Some(shift) = shift {
            for _ in 1..rows.len() {
                shifts.push(shifts[shifts.len() - 1].then(&shift));
            }
        }
        Some(Self { mirror, shifts })
    }

    /// Number of states that a state becomes, itself included.
    pub fn images(&self) -> usize {
        2 * self.shifts.len()
    }

    /// Where each joint takes its angle from in the mirror image, and with which sign.
    pub fn mirror(&self) -> &JointMap {
        &self.mirror
    }

    /// The mirror image of a state.
    pub fn mirrored(&self, joints: &[JointGrid], state: &GridState) -> GridState {
        self.mirror.image(joints, state)
    }

    /// What a state becomes by every shift of limbs, itself first; with their mirror images these are all.
    pub fn shifted(&self, joints: &[JointGrid], state: &GridState) -> Vec<GridState> {
        self.shifts.iter().map(|shift| shift.image(joints, state)).collect()
    }
}

/// Every limb does what the one before it on its side did, and those in front what the hindmost of the other side did;
/// `None` where the limbs are not of a kind.
fn shift(rows: &[[&JointChain; 2]], joints: usize) -> Option<JointMap> {
    let mut map = JointMap::identity(joints);
    for (index, row) in rows.iter().enumerate() {
        let before =
            if index > 0 { rows[index - 1] } else { rows.last().map(|[left, right]| [*right, *left])? };
        for (limb, from) in row.iter().zip(before) {
            map.take(limb, from, &limb.signs_from(from)?);
        }
    }
    Some(map)
}
