//! Legs: hips, chains of joints and foot points, for any number of legs and any direction of travel.
//!
//! Everything here is in the way frame: origin at the root's origin, x along the task's direction, z up, the
//! root upright. Left and right, fore and hind are told from it, not from the root's own axes.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Matrix5, Matrix5xX, Point3, Rotation3, Vector2, Vector3, Vector5};

use gaitwright_physics::model::{Body, DofKind, Frame, Model};
use gaitwright_physics::stance::{Stance, feet};

use super::closing::{self, Following};
use super::no_gaits::NoGaits;
use super::sole::Sole;
use super::spine::Spine;
use crate::gait::left_feet;
use crate::gait::limb::{greatest_reach, sprawled};

/// Rounds of inverse kinematics at most, and the error with which they end, m over the leg's length.
const ROUNDS: u32 = 30;
const CLOSE: f64 = 1e-6;
/// A foot point nearer than this share of the leg's size to where it should be is there.
const REACHED: f64 = 1e-3;
/// Singular values of a leg's Jacobian below this share of its greatest entry are zeros.
const DEPENDENT: f64 = 1e-3;
/// Damping of inverse kinematics, as a share of the leg's length: what keeps a straight leg from whirling.
const DAMPING: f64 = 0.01;

/// One leg.
#[derive(Debug, Clone)]
pub struct LegChain {
    /// Its joints by index into the model's, from the trunk outward.
    pub joints: Vec<usize>,
    /// The joints that closed loops move along with these; none where there are no such loops.
    pub followers: Vec<usize>,
    /// Where `joints`, and behind them `followers`, sit in the standing pose, m.
    pub origins: Vec<Vector3<f64>>,
    /// The links that are its foot: one of the body in which it ends, and of the bodies that this carries those that stand as well.
    pub links: Vec<usize>,
    /// Whether it is on the left.
    pub left: bool,
    /// Its place on its side, 0 at the front.
    pub row: usize,
    /// Where its long segments begin in the standing pose, m; where closed loops make a leg of several that begin at the same body, the mean.
    pub hip: Vector3<f64>,
    /// Its foot point in the standing pose, m: the centre of a ball, the middle of a sole.
    pub foot: Vector3<f64>,
    /// Height of the foot point above the ground on which the foot stands, m: the ball's radius.
    pub radius: f64,
    /// Greatest height of the hip above the foot point that the leg can reach with its foot below, m.
    pub length: f64,
    /// Which of its tilts, roll and pitch, the foot has to keep level: those of a sole that are left to the joints besides the foot's place.
    pub level: [bool; 2],
    /// Whether its foot stands beside its hip rather than below it.
    pub sprawled: bool,
    /// Sum of its segments, m: the unit of its lengths in inverse kinematics.
    size: f64,
    /// Frame of the body that carries the first joint.
    base: (Matrix3<f64>, Vector3<f64>),
    /// The bodies of `joints`.
    bodies: Vec<Body>,
    /// The foot point in the frame of its body, m.
    point: Vector3<f64>,
    /// The vertical of the standing pose in the frame of the foot's body.
    up: Vector3<f64>,
    /// Ranges of motion, rad or m.
    limits: Vec<Option<[f64; 2]>>,
    /// Angles of the standing pose, rad or m.
    pub standing: Vec<f64>,
    /// Which of its joints is the hip: where its long segments begin.
    first: usize,
    /// Greatest distance from the hip to the foot point, m.
    greatest: f64,
}

/// Where a leg's foot is, and how its joints move it.
#[derive(Debug, Clone)]
pub struct PlacedLeg {
    /// The foot point, m.
    pub foot: Vector3<f64>,
    /// The standing pose's vertical as the foot carries it.
    pub up: Vector3<f64>,
    /// Rotation of the foot's body.
    pub rotation: Matrix3<f64>,
    /// Axis and origin of every joint.
    axes: Vec<(Vector3<f64>, Vector3<f64>, DofKind)>,
}

impl PlacedLeg {
    /// Velocity of the point `at` of the foot's body per unit rate of the leg's joint `joint`, m/rad (or 1).
    pub fn column(&self, joint: usize, at: Vector3<f64>) -> Vector3<f64> {
        let (axis, origin, freedom) = &self.axes[joint];
        match freedom {
            DofKind::Revolute => axis.cross(&(at - origin)),
            DofKind::Prismatic => *axis,
        }
    }

    /// Where the leg's joint `joint` sits, m.
    pub fn origin(&self, joint: usize) -> Vector3<f64> {
        self.axes[joint].1
    }

    /// Angular rate of the foot's body per unit rate of the leg's joint `joint`.
    fn turning(&self, joint: usize) -> Vector3<f64> {
        match self.axes[joint] {
            (axis, _, DofKind::Revolute) => axis,
            _ => Vector3::zeros(),
        }
    }
}

impl LegChain {
    /// Its joints and those that follow them.
    pub fn moved(&self) -> impl Iterator<Item = usize> {
        self.joints.iter().chain(&self.followers).copied()
    }

    /// Distance from the hip to the foot point of the leg as it is `placed`, as a share of the greatest.
    pub fn extension(&self, placed: &PlacedLeg) -> f64 {
        (placed.foot - placed.origin(self.first)).norm() / self.greatest
    }

    /// Height of the hip above the ground with all of the character's joints at `angles`, m.
    fn hip_height(&self, angles: &[f64]) -> f64 {
        let own: Vec<f64> = self.joints.iter().map(|&joint| angles[joint]).collect();
        let placed = self.place(&own);
        placed.origin(self.first).z - placed.foot.z + self.radius
    }

    /// The leg with its joints at `angles`.
    pub fn place(&self, angles: &[f64]) -> PlacedLeg {
        let mut frame = self.base;
        let mut axes = Vec::with_capacity(self.joints.len());
        for (body, &angle) in self.bodies.iter().zip(angles) {
            frame = body.carried_by(frame, angle);
            axes.push((frame.0 * body.axis, frame.1, body.dof));
        }
        let (rotation, origin) = frame;
        PlacedLeg { foot: origin + rotation * self.point, up: rotation * self.up, rotation, axes }
    }

    /// Whether its foot is a sole that it keeps level in any way.
    pub fn keeps_level(&self) -> bool {
        self.level.contains(&true)
    }

    /// Moves `angles` to where the foot point is at `target` (and a sole is level but for `tilt`, its wanted
    /// vertical): damped least squares (Wampler 1986) from where they are, within the ranges of motion. Gives the
    /// distance left, m.
    pub fn reach(&self, angles: &mut [f64], target: Vector3<f64>, tilt: Vector3<f64>) -> f64 {
        let mut left = f64::INFINITY;
        for _ in 0..ROUNDS {
            let placed = self.place(angles);
            let error = target - placed.foot;
            let twist = placed.up.cross(&tilt) * self.size;
            let kept = self.level.map(|kept| f64::from(u8::from(kept)));
            let twist = Vector2::new(kept[0] * twist.x, kept[1] * twist.y);
            left = error.norm();
            if left + twist.norm() < CLOSE * self.size {
                break;
            }
            let row = |joint: usize| {
                let (go, turn) = (placed.column(joint, placed.foot), placed.turning(joint) * self.size);
                Vector5::new(go.x, go.y, go.z, kept[0] * turn.x, kept[1] * turn.y)
            };
            let wanted = Vector5::new(error.x, error.y, error.z, twist.x, twist.y);
            let columns: Vec<Vector5<f64>> = (0..angles.len()).map(row).collect();
            // A joint that stands at the end of its range and is asked beyond it takes no part in the second try.
            let mut free = vec![true; angles.len()];
            for _ in 0..2 {
                let mut square = Matrix5::identity() * (DAMPING * self.size).powi(2);
                for (column, _) in columns.iter().zip(&free).filter(|(_, free)| **free) {
                    square += column * column.transpose();
                }
                let Some(factor) = square.cholesky() else { return left };
                let force = factor.solve(&wanted);
                let mut stuck = false;
                for (joint, column) in
                    columns.iter().enumerate().filter(|(joint, _)| free[*joint]).collect::<Vec<_>>()
                {
                    let change = column.dot(&force).clamp(-0.5, 0.5);
                    let beyond = self.limits[joint].is_some_and(|[lower, upper]| {
                        (change < 0.0 && angles[joint] <= lower) || (change > 0.0 && angles[joint] >= upper)
                    });
                    stuck |= beyond;
                    free[joint] &= !beyond;
                }
                if stuck {
                    continue;
                }
                for (joint, column) in columns.iter().enumerate().filter(|(joint, _)| free[*joint]) {
                    angles[joint] += column.dot(&force).clamp(-0.5, 0.5);
                    if let Some([lower, upper]) = self.limits[joint] {
                        angles[joint] = angles[joint].clamp(lower, upper);
                    }
                }
                break;
            }
        }
        left
    }
}

/// The way frame of travel along `direction` (world frame), and where the bodies of `model` are in it as they stand in `stance`.
fn placed(model: &Model, stance: &Stance, direction: [f64; 3]) -> (Rotation3<f64>, Vec<Frame>) {
    let to_way = Rotation3::from_axis_angle(&Vector3::z_axis(), -direction[1].atan2(direction[0]));
    let mut frames = vec![(*to_way.matrix(), Vector3::zeros())];
    for (body, &angle) in model.bodies.iter().skip(1).zip(&stance.angles) {
        frames.push(body.carried_by(frames[body.parent], angle));
    }
    (to_way, frames)
}

/// Centre of mass, m, and rotational inertia about it with stiff joints, kg m².
fn whole(model: &Model, frames: &[Frame]) -> (Vector3<f64>, Matrix3<f64>) {
    let placed = || model.bodies.iter().zip(frames);
    let at = |body: &Body, frame: &Frame| frame.1 + frame.0 * body.center;
    let center = placed().map(|(body, frame)| at(body, frame) * body.mass).sum::<Vector3<f64>>() / model.mass;
    let inertia = placed()
        .map(|(body, frame)| {
            let away = at(body, frame) - center;
            let steiner = Matrix3::identity() * away.norm_squared() - away * away.transpose();
            frame.0 * body.inertia * frame.0.transpose() + steiner * body.mass
        })
        .sum();
    (center, inertia)
}

/// The legs of a character, and what of it as a whole a gait has to know.
#[derive(Debug, Clone)]
pub struct Legs {
    /// Left legs before right ones, front to back; none where there is a spine.
    pub legs: Vec<LegChain>,
    /// The body itself, where it has no legs.
    pub spine: Option<Spine>,
    /// Centre of mass in the standing pose, m.
    pub center: Vector3<f64>,
    /// Rotational inertia about it along the axes of the way frame, all joints stiff, kg m².
    pub inertia: Matrix3<f64>,
    /// kg.
    pub mass: f64,
    /// Mean height of the hips above the ground when it stands at rest, its springs bent by its weight, m: the height by which its gaits
    /// are judged. Without legs what stands in for it ([`Spine::size`]).
    pub hip_height: f64,
    /// Mean length of the legs, or of the body that has none, m.
    pub length: f64,
    /// From the root's axes to those of the way frame.
    pub to_way: Rotation3<f64>,
    /// Angles of all joints in the standing pose.
    pub standing: Vec<f64>,
}

impl Legs {
    /// The legs that `model` stands on in `stance`, for travel along `direction` (world frame, root unturned; only x
    /// and y count).
    ///
    /// # Errors
    /// [`NoGaits`] where it stands on nothing that a joint carries, or not on as many legs on the left as on the
    /// right, and where a leg has joints that neither a motor nor a closed loop moves.
    pub fn of(model: &Model, stance: &Stance, direction: [f64; 3]) -> Result<Self, NoGaits> {
        let (to_way, frames) = placed(model, stance, direction);
        if stance.support.is_empty() {
            return Err(NoGaits::NoFeet);
        }
        if let Some(&link) = stance.support.iter().find(|link| model.links[**link].body == 0) {
            return Err(NoGaits::OnRoot { link: link_name(model, link) });
        }
        let mut feet = feet(model, &stance.support);
        feet.sort_by_key(|links| model.links[links[0]].body);
        let mut legs = feet
            .into_iter()
            .map(|links| leg(model, stance, &frames, links))
            .collect::<Result<Vec<_>, _>>()?;
        let mut taken = BTreeSet::new();
        if let Some(twice) = legs.iter().flat_map(LegChain::moved).find(|joint| !taken.insert(*joint)) {
            return Err(NoGaits::Shared { joint: model.joint_names[twice].clone() });
        }
        let feet: Vec<Vector3<f64>> = legs.iter().map(|leg| leg.foot).collect();
        let sides =
            left_feet(&feet).map_err(|[left, right, between]| NoGaits::Unpaired { left, right, between })?;
        for (leg, is_left) in legs.iter_mut().zip(sides) {
            leg.left = is_left;
        }
        legs.sort_by(|a, b| b.left.cmp(&a.left).then(b.foot.x.total_cmp(&a.foot.x)));
        let left = legs.len() / 2;
        for (index, leg) in legs.iter_mut().enumerate() {
            leg.row = index % left;
        }

        let (center, inertia) = whole(model, &frames);
        let count = legs.len() as f64;
        let hip_height = legs.iter().map(|leg| leg.hip_height(&stance.state.angles)).sum::<f64>() / count;
        let length = legs.iter().map(|leg| leg.length).sum::<f64>() / count;
        let (mass, standing) = (model.mass, stance.angles.clone());
        Ok(Self { legs, spine: None, center, inertia, mass, hip_height, length, to_way, standing })
    }

    /// The legs, or else a body without legs whose joints are a row, for travel along `direction`.
    ///
    /// # Errors
    /// Why it has no [legs](Self::of), where there is neither.
    pub fn any(model: &Model, stance: &Stance, direction: [f64; 3]) -> Result<Self, NoGaits> {
        Self::of(model, stance, direction)
            .or_else(|legless| Self::none(model, stance, direction).ok_or(legless))
    }

    /// The [height](Self::hip_height) by which a Froude number becomes a speed and disturbances are measured, m; that of the root for who has
    /// neither legs nor its joints in a row.
    pub fn hip_height_of(model: &Model, stance: &Stance, direction: [f64; 3]) -> f64 {
        let legs = Self::any(model, stance, direction).ok();
        legs.map_or(model.height_scale(stance.root_height), |legs| legs.hip_height)
    }

    /// A body without legs whose joints are a row, for travel along `direction`; `None` where they are not, and where it stands on
    /// legs.
    pub fn none(model: &Model, stance: &Stance, direction: [f64; 3]) -> Option<Self> {
        let (to_way, frames) = placed(model, stance, direction);
        let spine = Spine::of(model, &frames)?;
        // A wave of the other joints moves a body along only if it lies on the ground as a whole, its first link as well.
        if !stance.support.iter().any(|&link| model.links[link].body == 0) {
            return None;
        }
        let (center, inertia) = whole(model, &frames);
        let (hip_height, length) = (spine.size(), spine.length);
        let (mass, standing) = (model.mass, stance.angles.clone());
        let spine = Some(spine);
        Some(Self { legs: Vec::new(), spine, center, inertia, mass, hip_height, length, to_way, standing })
    }

    /// The joints that move in a gait.
    pub fn joints(&self) -> Vec<usize> {
        let of_legs = self.legs.iter().flat_map(LegChain::moved);
        let of_spine = self.spine.iter().flat_map(|spine| spine.joints.iter().map(|joint| joint.joint));
        of_legs.chain(of_spine).collect()
    }

    /// Legs on a side.
    pub fn rows(&self) -> usize {
        self.legs.len() / 2
    }

    /// The leg that stands on a link: on one that carries it in the standing pose.
    pub fn standing_on(&self, link: usize) -> Option<usize> {
        self.legs.iter().position(|leg| leg.links.contains(&link))
    }
}

/// The bodies of the leg that ends in `body`, from the trunk outward: up to where others branch off. What closed loops hold to the leg
/// is no other.
fn chain(model: &Model, body: usize) -> Vec<usize> {
    let mut way = vec![body];
    let mut last = body;
    while model.bodies[last].parent != 0 {
        last = model.bodies[last].parent;
        way.push(last);
    }
    let beside = closing::beside(model, &way);
    let alone = |body: usize| {
        let children = (1..model.bodies.len()).filter(|child| model.bodies[*child].parent == body);
        children.filter(|child| !beside.contains(child)).count() == 1
    };
    if let Some(branching) = way.iter().skip(1).position(|&body| !alone(body)) {
        way.truncate(branching + 1);
    }
    way.reverse();
    way
}

/// Name of a link by its index among the character's.
fn link_name(model: &Model, link: usize) -> String {
    model.character.links[link].name.clone()
}

/// Whether a leg that ends in the link `foot` can be moved as a gait asks: inverse kinematics moves every one of its joints.
fn movable(
    model: &Model,
    stance: &Stance,
    foot: usize,
    (joints, followers): (&[usize], &[usize]),
) -> Result<(), NoGaits> {
    let foot = || link_name(model, foot);
    // A foot that is to be lifted and set forward needs two joints.
    if joints.len() < 2 {
        return Err(NoGaits::OneJoint { foot: foot() });
    }
    let in_loop = |joint: &usize| model.loops.iter().any(|closed| closed.bodies.contains(&(joint + 1)));
    let decided = if followers.is_empty() {
        if let Some(&passive) = joints.iter().find(|joint| !model.driven[**joint]) {
            return Err(NoGaits::NoMotor { foot: foot(), joint: model.joint_names[passive].clone() });
        }
        !joints.iter().any(in_loop)
    } else {
        closing::decide(model, &stance.angles, joints, followers)
    };
    if decided { Ok(()) } else { Err(NoGaits::Undecided { foot: foot() }) }
}

/// Where the leg swings from whose first long segment is that of `body`. Of a five-bar leg, beside which others move along, that is the
/// middle between its hips: its foot stands below it.
fn hip(model: &Model, frames: &[Frame], body: usize, followers: &[usize]) -> Vector3<f64> {
    let carrier = model.bodies[body].parent;
    let beside = followers.iter().map(|joint| joint + 1).filter(|&body| model.bodies[body].parent == carrier);
    let hips: Vec<Vector3<f64>> = beside.chain([body]).map(|body| frames[body].1).collect();
    hips.iter().sum::<Vector3<f64>>() / hips.len() as f64
}

/// The leg with the foot made of `links`, of which the first is where it ends; on the left, in row 0.
fn leg(model: &Model, stance: &Stance, frames: &[Frame], links: Vec<usize>) -> Result<LegChain, NoGaits> {
    let body = model.links[links[0]].body;
    let chain = chain(model, body);
    let joints: Vec<usize> = chain.iter().map(|body| body - 1).collect();
    let followers: Vec<usize> = closing::beside(model, &chain).iter().map(|body| body - 1).collect();
    movable(model, stance, links[0], (&joints, &followers))?;

    let sole = Sole::of(model, frames, &chain).ok_or(NoGaits::NoFeet)?;
    let Sole { point, radius, reach, first_long, flat } = sole;
    let parent = model.bodies[chain[0]].parent;
    let distal = &chain[first_long + 1..];
    let hip = hip(model, frames, chain[first_long], &followers);
    let (rotation, origin) = frames[body];
    let foot = origin + rotation * point;
    let mut leg = LegChain {
        origins: joints.iter().chain(&followers).map(|joint| frames[joint + 1].1).collect(),
        joints,
        followers,
        links,
        left: true,
        row: 0,
        hip,
        foot,
        radius,
        length: 0.0,
        level: [false; 2],
        sprawled: sprawled(&(foot - hip)),
        size: reach,
        base: frames[parent],
        bodies: chain.iter().map(|&body| model.bodies[body].clone()).collect(),
        point,
        up: rotation.transpose() * Vector3::z(),
        limits: chain.iter().map(|body| model.limits[body - 1]).collect(),
        standing: chain.iter().map(|body| stance.angles[body - 1]).collect(),
        first: first_long,
        greatest: greatest_reach(model, distal, Point3::from(point)),
    };
    if flat {
        leg.level = tilts(&leg);
    }
    leg.length = leg.hip.z - leg.foot.z + highest(model, stance, &leg);
    Ok(leg)
}

/// Which tilts of its foot, roll and pitch, the leg can change in the standing pose while the foot stays where it is: those whose rows
/// add to the rank of the Jacobian. A leg whose joints all turn about one axis has one joint left for the pitch of three.
fn tilts(leg: &LegChain) -> [bool; 2] {
    let placed = leg.place(&leg.standing);
    let columns: Vec<Vector5<f64>> = (0..leg.joints.len())
        .map(|joint| {
            let (go, turn) = (placed.column(joint, placed.foot) / leg.size, placed.turning(joint));
            Vector5::new(go.x, go.y, go.z, turn.y, turn.x)
        })
        .collect();
    let jacobian = Matrix5xX::from_columns(&columns);
    let rank = |rows: usize| jacobian.rows(0, rows).into_owned().rank(DEPENDENT * jacobian.amax());
    let [place, pitched, rolled] = [3, 4, 5].map(rank);
    [rolled > pitched, pitched > place]
}

/// How much higher than in the standing pose the leg can carry its hip with the foot straight below where it stands, m, and below
/// the hip as seen from the side unless the leg is sprawled. Ranges of motion and offsets aside keep many a leg from ever being as
/// long as the sum of its segments.
fn highest(model: &Model, stance: &Stance, leg: &LegChain) -> f64 {
    let reaches = |target: Vector3<f64>| {
        let mut own = leg.standing.clone();
        let left = leg.reach(&mut own, target, Vector3::z());
        let mut angles = stance.angles.clone();
        leg.joints.iter().zip(own).for_each(|(&joint, angle)| angles[joint] = angle);
        let closed = leg.followers.is_empty()
            || Following::new(model, &angles, &leg.joints, &leg.followers)
                .is_some_and(|following| following.open < REACHED * leg.size);
        closed && left < REACHED * leg.size
    };
    let below = if leg.sprawled { leg.foot.x } else { leg.hip.x };
    let (mut reached, mut missed) = (0.0, leg.size);
    for _ in 0..12 {
        let tried = 0.5 * (reached + missed);
        if reaches(Vector3::new(below, leg.foot.y, leg.foot.z - tried)) {
            reached = tried;
        } else {
            missed = tried;
        }
    }
    reached
}
