//! A quadruped whose gait is made by construction: legs placed by inverse kinematics, forces by
//! dividing the weight among the feet that stand.

#![allow(dead_code)] // Every test binary uses its own part of this.

use gaitwright_physics::character::{
    Character, Inertial, Joint, JointKind, Limits, Link, Placed, Shape, SurfaceMaterial,
};
use gaitwright_physics::playback::{Sample, Trace};
use gaitwright_physics::sim::contact::Against;
use gaitwright_physics::sim::{Contact, Root};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

/// Legs in the order of the phases everywhere here.
pub const LEGS: [&str; 4] = ["LF", "LH", "RF", "RH"];
pub const GRAVITY: f64 = 9.81;
pub const TRUNK_MASS: f64 = 10.0;
const LEG_MASS: f64 = 0.5;
const THIGH: f64 = 0.2;
const SHANK: f64 = 0.2;
const FOOT: f64 = 0.02;
/// Height of the root above the ground while it moves, m.
pub const HEIGHT: f64 = 0.32;

pub fn mass() -> f64 {
    TRUNK_MASS + 8.0 * LEG_MASS
}

/// Index of a leg's last link, the one with the foot.
pub fn foot_link(leg: usize) -> usize {
    2 + 2 * leg
}

fn hip(leg: usize) -> Vector3<f64> {
    let x = if leg.is_multiple_of(2) { 0.2 } else { -0.2 };
    let y = if leg < 2 { 0.11 } else { -0.11 };
    Vector3::new(x, y, 0.0)
}

fn translation(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Translation3::new(x, y, z).into()
}

fn inertial(mass: f64) -> Option<Inertial> {
    let inertia = Matrix3::from_diagonal_element(0.01 * mass);
    Some(Inertial { mass, center_of_mass: Point3::origin(), inertia })
}

fn joint(name: String, parent: usize, origin: Isometry3<f64>) -> Option<Joint> {
    Some(Joint {
        name,
        parent,
        kind: JointKind::Revolute,
        origin,
        axis: Unit::new_normalize(Vector3::y()),
        limits: Some(Limits { lower: -2.6, upper: 2.6 }),
        driven: true,
        effort: Some(20.0),
        velocity: None,
        damping: 0.0,
        friction: 0.0,
        armature: 0.0,
    })
}

/// Trunk (a box), and of each leg a thigh (capsule) and a shank (cylinder and ball).
pub fn quadruped() -> Character {
    let placed = |pose, shape| Placed { pose, shape, color: None };
    let mut links = vec![Link {
        name: "trunk".into(),
        joint: None,
        inertial: inertial(TRUNK_MASS),
        collisions: vec![placed(
            Isometry3::identity(),
            Shape::Box { half_extents: Vector3::new(0.26, 0.09, 0.05) },
        )],
        surface: SurfaceMaterial::default(),
        visuals: vec![],
    }];
    for (leg, name) in LEGS.iter().enumerate() {
        links.push(Link {
            name: format!("{name} thigh"),
            joint: joint(format!("{name}_hip"), 0, Translation3::from(hip(leg)).into()),
            inertial: inertial(LEG_MASS),
            collisions: vec![placed(
                translation(0.0, 0.0, -THIGH / 2.0),
                Shape::Capsule { radius: 0.025, half_length: THIGH / 2.0 },
            )],
            surface: SurfaceMaterial::default(),
            visuals: vec![],
        });
        links.push(Link {
            name: format!("{name} shank"),
            joint: joint(format!("{name}_knee"), 1 + 2 * leg, translation(0.0, 0.0, -THIGH)),
            inertial: inertial(LEG_MASS),
            collisions: vec![
                placed(
                    translation(0.0, 0.0, -SHANK / 2.0),
                    Shape::Cylinder { radius: 0.015, half_length: SHANK / 2.0 },
                ),
                placed(translation(0.0, 0.0, -SHANK), Shape::Sphere { radius: FOOT }),
            ],
            surface: SurfaceMaterial::default(),
            visuals: vec![],
        });
    }
    Character {
        name: "synthetic".into(),
        links,
        loops: Vec::new(),
        standing: None,
        digest: "sha256:0".into(),
        embedded_digest: None,
    }
}

pub fn joint_names() -> Vec<String> {
    LEGS.iter().flat_map(|leg| [format!("{leg}_hip"), format!("{leg}_knee")]).collect()
}

/// What gait to make.
#[derive(Debug, Clone, Copy)]
pub struct Gait {
    /// Touch-down of each leg as a part of the stride.
    pub phases: [f64; 4],
    /// Part of the stride that each leg stands.
    pub duty: f64,
    /// s.
    pub stride: f64,
    /// m/s along the heading.
    pub speed: f64,
    /// Direction of travel and of the body's x axis, rad about z.
    pub heading: f64,
    /// Of the root and the hips above the ground, m.
    pub height: f64,
    /// Of a foot in the middle of its swing, m.
    pub lift: f64,
    pub seconds: f64,
    /// Between two samples, s.
    pub interval: f64,
}

impl Gait {
    pub fn new(phases: [f64; 4], duty: f64) -> Self {
        Self {
            phases,
            duty,
            stride: 0.5,
            speed: 0.8,
            heading: 0.0,
            height: HEIGHT,
            lift: 0.06,
            seconds: 10.0,
            interval: 0.005,
        }
    }

    /// Part of the stride since the touch-down of `leg` at `time`.
    fn since_touch_down(&self, leg: usize, time: f64) -> f64 {
        (time / self.stride - self.phases[leg]).rem_euclid(1.0)
    }

    pub fn stands(&self, leg: usize, time: f64) -> bool {
        // Not on the edge of a float: a touch-down at a sample's own time belongs to that sample.
        (self.since_touch_down(leg, time) + 1e-9).rem_euclid(1.0) < self.duty
    }

    /// Foot relative to its hip at `time`: back at constant speed in stance, forward in an arc in swing.
    fn foot(&self, leg: usize, time: f64) -> Vector3<f64> {
        let s = self.since_touch_down(leg, time);
        let reach = 0.5 * self.speed * self.stride * self.duty;
        let ground = FOOT - self.height;
        if s < self.duty {
            Vector3::new(reach * (1.0 - 2.0 * s / self.duty), 0.0, ground)
        } else {
            let u = (s - self.duty) / (1.0 - self.duty);
            Vector3::new(reach * (2.0 * u - 1.0), 0.0, ground + self.lift * (std::f64::consts::PI * u).sin())
        }
    }

    pub fn trace(&self) -> Trace {
        let count = (self.seconds / self.interval).round() as usize;
        let samples = (0..=count).map(|index| self.sample(index as f64 * self.interval)).collect();
        Trace { samples, ..Trace::default() }
    }

    pub fn sample(&self, time: f64) -> Sample {
        let orientation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading);
        let velocity = orientation * Vector3::new(self.speed, 0.0, 0.0);
        let position = Point3::from(velocity * time + Vector3::new(0.0, 0.0, self.height));
        let root = Isometry3::from_parts(position.into(), orientation);
        let mut link_poses = vec![root];
        let (mut angles, mut contacts) = (Vec::new(), Vec::new());
        let mut loads = vec![0.0; 9];
        let standing = (0..4).filter(|&leg| self.stands(leg, time)).count();
        for leg in 0..4 {
            let (upper, lower) = leg_angles(self.foot(leg, time));
            let thigh = root * Translation3::from(hip(leg)) * turn(upper);
            let shank = thigh * translation(0.0, 0.0, -THIGH) * turn(lower);
            link_poses.extend([thigh, shank]);
            angles.extend([upper, lower]);
            if self.stands(leg, time) {
                let foot = shank * Point3::new(0.0, 0.0, -SHANK);
                loads[foot_link(leg)] = mass() * GRAVITY / standing as f64;
                contacts.push(Contact {
                    link: foot_link(leg),
                    against: Against::Ground,
                    position: Point3::new(foot.x, foot.y, 0.0),
                    normal: Vector3::z(),
                    force: Vector3::new(0.0, 0.0, mass() * GRAVITY / standing as f64),
                    velocity: Vector3::zeros(),
                    depth: 0.0005,
                });
            }
        }
        Sample {
            time,
            root: Root {
                position,
                orientation,
                linear_velocity: velocity,
                angular_velocity: Vector3::zeros(),
            },
            velocities: vec![0.0; angles.len()],
            targets: angles.clone(),
            torques: vec![1.0; angles.len()],
            angles,
            link_poses,
            contacts,
            loads,
            center_of_mass: position,
        }
    }
}

/// Makes the loads those of the contacts with the ground as they are now.
pub fn settle_loads(trace: &mut Trace) {
    for sample in &mut trace.samples {
        sample.loads.fill(0.0);
        for contact in sample.contacts.iter().filter(|contact| contact.against == Against::Ground) {
            sample.loads[contact.link] += contact.force.dot(&contact.normal);
        }
    }
}

fn turn(angle: f64) -> Isometry3<f64> {
    Isometry3::rotation(Vector3::y() * angle)
}

/// Hip and knee angle that put the foot at `foot` from the hip (law of cosines), knee to the back.
fn leg_angles(foot: Vector3<f64>) -> (f64, f64) {
    let reach = foot.norm().min(THIGH + SHANK - 1e-6);
    let bend =
        ((THIGH * THIGH + SHANK * SHANK - reach * reach) / (2.0 * THIGH * SHANK)).clamp(-1.0, 1.0).acos();
    let knee = std::f64::consts::PI - bend;
    let lead =
        ((THIGH * THIGH + reach * reach - SHANK * SHANK) / (2.0 * THIGH * reach)).clamp(-1.0, 1.0).acos();
    let line = (-foot.x).atan2(-foot.z);
    (line + lead, -knee)
}
