//! A pose that looks like standing.
//!
//! The pose minimises a sum of squares over the joint angles, starting from the angles nearest to zero
//! that the limits allow: feet level, feet below the joints their limbs swing from, limbs a little bent,
//! soles flat, the centre of mass above the feet, joints away from their limits and near where they began; joints
//! that carry no limb (of arms, necks and tails) hardly leave it. A character that lies rather than stands (a snake) keeps
//! the pose it was drawn in.

use nalgebra::{Vector2, Vector3};

use super::anatomy::{Limb, Posed, limbs};
use super::{loops, starts};
use crate::model::{DofKind, Model};

/// Height of a limb's first joint above the ground as a share of the limb's length. A bent leg can push off, which
/// helps learning more than the low torques of a straight one.
const EXTENSION: f64 = 0.7;

/// The same for a character that was drawn flat with its legs stretched to the sides: its feet stand below its knees, away from its trunk, for its legs to swing fore and aft.
const SPRAWLED_EXTENSION: f64 = 0.5;

/// Joints that slide are moved by this share of a limb's length where others are moved by a radian.
const SLIDE: f64 = 0.25;

/// Joints keep this share of their range away from its ends where they can.
const MARGIN: f64 = 0.12;

/// Greatest number of body poses that a search computes. A robot of twelve joints needs a tenth of it; without the bound
/// one of hundreds of links would take minutes.
const PLACED: usize = 1_000_000;

/// A character lower than this share of its own width lies rather than stands.
const LYING: f64 = 0.2;

/// A trunk that is carried is higher above the feet than this share of a limb's length.
const LIFTED: f64 = 0.1;

/// Fewest limbs of a character that may stand although it is drawn flat, with its legs stretched to the sides: both ends of a
/// snake look like limbs.
const SPRAWLED: usize = 4;

/// Where a pose costs more, others are looked for.
const POOR: f64 = 0.05;

/// What a radian away from where a joint began costs: of joints that move a limb, and of those that do not, which are to hang as they
/// were drawn and not to balance the character.
const AWAY: [f64; 2] = [0.003, 0.1];

/// The author's pose, where there is one; angles left out of it are the nearest to zero.
pub fn given(model: &Model) -> Option<Vec<f64>> {
    let standing = model.character.standing.as_ref()?;
    let mut angles = neutral(model);
    for (name, angle) in standing {
        if let Some(joint) = model.joint(name) {
            angles[joint] = *angle;
        }
    }
    loops::close(model, &mut angles);
    Some(angles)
}

/// The angles nearest to zero within the limits.
fn neutral(model: &Model) -> Vec<f64> {
    let nearest = |limit: &Option<[f64; 2]>| limit.map_or(0.0, |[lower, upper]| 0.0_f64.clamp(lower, upper));
    model.limits.iter().map(nearest).collect()
}

/// Searches for a standing pose in which a sole costs `tilted` that is tilted by a right angle; the same for the same model.
pub fn search(model: &Model, tilted: f64) -> Vec<f64> {
    let mut start = neutral(model);
    loops::close(model, &mut start);
    let posed = Posed::new(model, &start);
    let limbs = limbs(model, &posed);
    let drawn_flat = lies(&posed);
    if limbs.is_empty() || (drawn_flat && limbs.len() < SPRAWLED) {
        return start;
    }
    let size = limbs.iter().map(|limb| limb.length).sum::<f64>() / limbs.len() as f64;
    let units = model.bodies[1..].iter().map(|body| match body.dof {
        DofKind::Prismatic => SLIDE * size,
        DofKind::Revolute => 1.0,
    });
    let units: Vec<f64> = units.collect();
    let away = away(model, &limbs);
    let sprawled = drawn_flat && radiate(&posed, &limbs);
    let cost =
        Cost { model, limbs: &limbs, start: &start, away: &away, units: &units, size, sprawled, tilted };
    let found = |from: Vec<f64>| descend(from, model, &limbs, &units, |angles| cost.of(angles));
    let mut angles = found(start.clone());
    let others = if drawn_flat {
        // Legs that are stretched out may be let down as they are, or folded at one of their joints.
        starts::folded(model, &limbs, &start)
    } else if model.loops.is_empty() && cost.of(&angles) > POOR {
        // The descent may have taken straight legs the wrong way. Those of closed loops do not bend at one knee.
        starts::bent(model, &limbs, &start)
    } else {
        Vec::new()
    };
    for from in others {
        let other = found(from);
        if cost.of(&other) < cost.of(&angles) {
            angles = other;
        }
    }
    loops::close(model, &mut angles);
    // What was drawn flat and cannot lift itself off the ground stays as it was drawn.
    let lifted = !drawn_flat || lifts_its_trunk(&Posed::new(model, &angles), &limbs, size);
    if lifted { angles } else { start }
}

/// Whether all limbs lead away from the middle between them. Legs drawn all the same way, along the trunk, are meant to hang below it.
fn radiate(posed: &Posed, limbs: &[Limb]) -> bool {
    let begins = |limb: &Limb| flat(posed.bodies.at(limb.first_long).origin);
    let middle = limbs.iter().map(begins).sum::<Vector2<f64>>() / limbs.len() as f64;
    limbs.iter().all(|limb| {
        let outward = begins(limb) - middle;
        posed.foot(limb).is_some_and(|foot| (flat(foot) - begins(limb)).dot(&outward) > 0.0)
    })
}

/// Whether all that is no limb is higher than the feet by a [part](LIFTED) of `size`, m.
fn lifts_its_trunk(posed: &Posed, limbs: &[Limb], size: f64) -> bool {
    let feet = limbs.iter().filter_map(|limb| posed.foot(limb)).map(|foot| foot.z);
    let highest = feet.fold(f64::NEG_INFINITY, f64::max);
    let trunk =
        posed.surface.iter().filter(|point| limbs.iter().all(|limb| !limb.bodies.contains(&point.body)));
    trunk.map(|point| point.at.z).fold(f64::INFINITY, f64::min) > highest + LIFTED * size
}

/// The greatest tilt of a sole that stands as `angles` say, rad.
pub fn tilt(model: &Model, angles: &[f64]) -> f64 {
    let mut start = neutral(model);
    loops::close(model, &mut start);
    let posed = Posed::new(model, angles);
    let limbs = limbs(model, &Posed::new(model, &start));
    let soles = limbs.iter().filter(|limb| limb.flat);
    let vertical = |limb: &Limb| posed.bodies.at(limb.bodies[limb.bodies.len() - 1]).rotation * limb.up;
    soles.map(|limb| vertical(limb).angle(&Vector3::z())).fold(0.0, f64::max)
}

/// What it costs that each joint leaves where it began.
fn away(model: &Model, limbs: &[Limb]) -> Vec<f64> {
    let [moving, idle] = AWAY;
    let mut away = vec![idle; model.joint_count()];
    let feet = limbs.iter().filter_map(|limb| limb.bodies.last().copied());
    // What a closed loop joins moves with the limbs.
    let looped = model.loops.iter().flat_map(|closing| closing.bodies);
    for mut body in feet.chain(looped) {
        while body > 0 {
            away[body - 1] = moving;
            body = model.bodies[body].parent;
        }
    }
    away
}

/// Whether the character is flat in this pose.
fn lies(posed: &Posed) -> bool {
    let height = posed.center_of_mass.z - posed.lowest();
    let middle = posed.center_of_mass.xy();
    let width = posed.surface.iter().map(|point| (point.at.xy() - middle).norm()).fold(0.0, f64::max);
    height < LYING * width
}

/// Pattern search: every move is tried in both directions, and the step is halved when none lowers the cost. Ends with
/// the best pose found when [`PLACED`] is used up.
fn descend(
    mut angles: Vec<f64>,
    model: &Model,
    limbs: &[Limb],
    units: &[f64],
    cost: impl Fn(&[f64]) -> f64,
) -> Vec<f64> {
    let moves = moves(model, limbs, units);
    let mut best = cost(&angles);
    let mut step = 0.3;
    let mut rounds = PLACED / (2 * moves.len() * model.bodies.len());
    while step > 1e-3 && rounds > 0 {
        rounds -= 1;
        let before = best;
        for (joints, direction) in moves.iter().flat_map(|joints| [(joints, 1.0), (joints, -1.0)]) {
            let mut tried = angles.clone();
            for (joint, share) in joints {
                let angle = tried[*joint] + direction * step * share;
                tried[*joint] =
                    model.limits[*joint].map_or(angle, |[lower, upper]| angle.clamp(lower, upper));
            }
            let found = cost(&tried);
            if found < best {
                best = found;
                angles = tried;
            }
        }
        if best > before - 1e-4 * before.abs() {
            step *= 0.5;
        }
    }
    angles
}

/// Moves of the search, each some joints and how far they go: every joint by itself; every joint
/// against the one that carries it, which folds a limb and leaves its end below its beginning; and either
/// for all limbs at once, without which level feet would keep each other from moving. `units` are what joints are moved by, rad or m.
fn moves(model: &Model, limbs: &[Limb], units: &[f64]) -> Vec<Vec<(usize, f64)>> {
    let fold = |joint: usize| {
        let parent = model.bodies[joint + 1].parent;
        (parent > 0).then(|| vec![(joint, 2.0 * units[joint]), (parent - 1, -units[parent - 1])])
    };
    let mut moves = Vec::new();
    // All limbs first, so that limbs alike bend alike.
    let longest = limbs.iter().map(|limb| limb.bodies.len()).max().unwrap_or(0);
    for place in 0..longest {
        let alike = || limbs.iter().filter_map(move |limb| limb.bodies.get(place)).map(|body| body - 1);
        moves.push(alike().map(|joint| (joint, units[joint])).collect());
        moves.push(alike().filter_map(fold).flatten().collect());
    }
    let joints = 0..model.joint_count();
    moves.extend(joints.clone().map(|joint| vec![(joint, units[joint])]));
    moves.extend(joints.filter_map(fold));
    moves
}

/// The sum of squares that the search minimises: the less a pose looks like standing, the greater.
struct Cost<'a> {
    model: &'a Model,
    limbs: &'a [Limb],
    start: &'a [f64],
    /// What a unit away from there costs.
    away: &'a [f64],
    /// What counts as one of each joint, rad or m.
    units: &'a [f64],
    /// Mean length of the limbs, m.
    size: f64,
    /// Whether its legs stand sprawled.
    sprawled: bool,
    /// What a sole costs that is tilted by a right angle.
    tilted: f64,
}

impl Cost<'_> {
    fn of(&self, angles: &[f64]) -> f64 {
        let posed = Posed::new(self.model, angles);
        let feet: Vec<Vector3<f64>> = self.limbs.iter().filter_map(|limb| posed.foot(limb)).collect();
        let count = feet.len() as f64;
        let mean: Vector3<f64> = feet.iter().sum::<Vector3<f64>>() / count;
        let relative = |length: f64| (length / self.size).powi(2);

        let mut cost = 4.0 * relative(flat(posed.center_of_mass - mean).norm());
        for (limb, foot) in self.limbs.iter().zip(&feet) {
            let attached = posed.bodies.at(limb.first_long).origin;
            let extension = (attached.z - foot.z) / limb.length;
            let (above, usual) = match self.sprawled {
                true => (posed.bodies.at(limb.last_long).origin, SPRAWLED_EXTENSION),
                false => (attached, EXTENSION),
            };
            cost += 20.0 * relative(foot.z - mean.z) / count;
            cost += 1.0 * relative(flat(above - foot).norm()) / count;
            cost += 4.0 * (extension - usual).powi(2) / count;
            // Of what was drawn flat the lower side of a shank is no sole.
            if limb.flat && !self.sprawled {
                let up = posed.bodies.at(limb.bodies[limb.bodies.len() - 1]).rotation * limb.up;
                cost += self.tilted * (1.0 - up.z) / count;
            }
        }
        // A body below the feet (a knee, a belly) would carry the character in their place.
        let below = (mean.z - posed.lowest()).max(0.0);
        cost += 20.0 * relative(below);
        // The simulator would close an open loop with large forces.
        cost += 20.0 * relative(loops::opening(self.model, &posed));
        for (joint, angle) in angles.iter().enumerate() {
            cost += self.away[joint] * ((angle - self.start[joint]) / self.units[joint]).powi(2);
            if let Some([lower, upper]) = self.model.limits[joint] {
                let margin = MARGIN * (upper - lower);
                let inside = (angle - lower).min(upper - angle);
                cost += 2.0 * ((margin - inside).max(0.0) / margin).powi(2) / angles.len() as f64;
            }
        }
        cost
    }
}

fn flat(vector: Vector3<f64>) -> Vector2<f64> {
    vector.xy()
}
