//! Feedback: changes of the keyframes that depend on the cell in which the trunk is.
//!
//! What open loop cannot hold, a heading or a balance, is held by a choice among rings of keyframes. Of the trunk a few measures
//! are looked at ([`TrunkMeasure`]), each is divided into cells, and each cell has a ring: what is added to the
//! keyframes of the loop. At every keyframe the cells are looked up anew, and the motion goes on to the next keyframe of the
//! rings that these name; the changes of several measures add up. This is the policy of QDSEGA, whose trunk cells choose the next
//! state (Tokizaki & Hasegawa), restricted to the states of the rings.

use nalgebra::{UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::Fault;
use crate::sim::Root;

/// Which changes are added to the keyframes of a motion, by the cells of the trunk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Steering {
    /// x and y of the unit vector in the world frame along which the motion starts out.
    pub direction: [f64; 2],
    /// One for each measure; their changes add up.
    pub tables: Vec<SteeringTable>,
}

/// A ring of changes for each cell of one measure of the trunk.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SteeringTable {
    /// What is looked at.
    pub measure: TrunkMeasure,
    /// Where one cell ends and the next begins, in the unit of the measure, increasing.
    pub bounds: Vec<f64>,
    /// One for each cell, from the least values to the greatest, one more than `bounds`: what is added to each keyframe of the loop but
    /// the last, which is the first of the next cycle.
    pub rings: Vec<Vec<KeyframeChange>>,
}

/// What is looked at of the root link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TrunkMeasure {
    /// Rotation about the vertical since the start of play, to the left, rad, in (−π, π].
    Heading,
    /// Angle by which what was upright at the start of play leans along `direction`, turned by the heading, rad.
    ForwardTilt,
    /// The same to the left of it.
    LeftTilt,
    /// Angular velocity with which it leans along that direction, rad/s.
    ForwardTiltRate,
    /// The same to the left of it.
    LeftTiltRate,
}

/// What is added to the targets of a keyframe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyframeChange {
    /// rad or m, one a joint.
    pub angles: Vec<f64>,
    /// Per second, one a joint.
    pub velocities: Vec<f64>,
}

impl KeyframeChange {
    /// No change of so many joints.
    pub(super) fn none(joints: usize) -> Self {
        Self { angles: vec![0.0; joints], velocities: vec![0.0; joints] }
    }
}

impl TrunkMeasure {
    /// Its value for a root that was at `start` when the motion set out along `direction`.
    pub fn of(self, root: &Root, start: &Root, direction: [f64; 2]) -> f64 {
        let turned = root.orientation * start.orientation.inverse();
        // The part of the rotation that is about the vertical; the rest tilts.
        let half = turned.quaternion().k.atan2(turned.quaternion().w);
        let heading = (2.0 * half).sin().atan2((2.0 * half).cos());
        let level = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -heading);
        let [x, y] = direction;
        let (forward, left) = (Vector3::new(x, y, 0.0), Vector3::new(-y, x, 0.0));
        let (turning, up) = (level * root.angular_velocity, level * (turned * Vector3::z()));
        match self {
            Self::Heading => heading,
            Self::ForwardTilt => up.dot(&forward).atan2(up.z),
            Self::LeftTilt => up.dot(&left).atan2(up.z),
            Self::ForwardTiltRate => turning.dot(&left),
            Self::LeftTiltRate => -turning.dot(&forward),
        }
    }
}

impl SteeringTable {
    /// The ring for a value of the measure.
    fn ring(&self, value: f64) -> &[KeyframeChange] {
        &self.rings[self.bounds.partition_point(|bound| *bound <= value)]
    }
}

impl Steering {
    /// What the rings for a root at `root` add to the `next` keyframe of the loop, of so many joints; the motion set out at `start`.
    pub(super) fn change(&self, next: usize, root: &Root, start: &Root, joints: usize) -> KeyframeChange {
        let mut sum = KeyframeChange::none(joints);
        for table in &self.tables {
            let change = &table.ring(table.measure.of(root, start, self.direction))[next];
            sum.angles.iter_mut().zip(&change.angles).for_each(|(sum, change)| *sum += change);
            sum.velocities.iter_mut().zip(&change.velocities).for_each(|(sum, change)| *sum += change);
        }
        sum
    }

    /// The same for joints in another order: `order` has for each new place the old one.
    pub(super) fn reordered(&self, order: &[usize]) -> Self {
        let mut steering = self.clone();
        for change in steering.tables.iter_mut().flat_map(|table| &mut table.rings).flatten() {
            change.angles = order.iter().map(|&joint| change.angles[joint]).collect();
            change.velocities = order.iter().map(|&joint| change.velocities[joint]).collect();
        }
        steering
    }

    /// Everything that keeps it from being played with a loop of `keyframes` keyframes, the last not counted, of `joints` joints.
    pub(super) fn faults(&self, keyframes: usize, joints: usize) -> Vec<Fault> {
        let mut faults = Vec::new();
        let [x, y] = self.direction;
        let off = (x.hypot(y) - 1.0).abs();
        if off.is_nan() || off > 1e-6 {
            faults.push(Fault::new("/direction", "the direction is not a unit vector"));
        }
        for (index, table) in self.tables.iter().enumerate() {
            let place = format!("/tables/{index}");
            let mut count = |field: &str, found: usize, wanted: usize, of: &str| {
                if found != wanted {
                    let reason = format!("{found} where {wanted} are needed, one for each {of}");
                    faults.push(Fault::new(format!("{place}/{field}"), reason));
                }
            };
            count("rings", table.rings.len(), table.bounds.len() + 1, "cell");
            for (number, ring) in table.rings.iter().enumerate() {
                count(&format!("rings/{number}"), ring.len(), keyframes, "keyframe of the loop but the last");
                for (keyframe, change) in ring.iter().enumerate() {
                    let place = format!("rings/{number}/{keyframe}");
                    count(&format!("{place}/angles"), change.angles.len(), joints, "joint");
                    count(&format!("{place}/velocities"), change.velocities.len(), joints, "joint");
                }
            }
            let changes = || table.rings.iter().flatten();
            let mut values = table
                .bounds
                .iter()
                .chain(changes().flat_map(|change| change.angles.iter().chain(&change.velocities)));
            if !values.all(|value| value.is_finite()) {
                faults.push(Fault::new(place.clone(), "a number of the table is not finite"));
            }
            if table.bounds.windows(2).any(|pair| pair[0] >= pair[1]) {
                faults.push(Fault::new(format!("{place}/bounds"), "the bounds do not increase"));
            }
        }
        faults
    }
}
