//! A MuJoCo model (MJCF) with keyframes that hold poses and controls.
//!
//! The actuators are those of the motion's drive: `kp` and `kv` are its stiffness and damping. MuJoCo damps the
//! joint's velocity and not its difference to the target's, so that a control is the target plus the target's rate
//! times kv/kp: the torque is then kp (q* − q) + kv (q̇* − q̇), as here.

use std::fmt::Write;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::sampled::{MotionFrame, SampledMotion};
use super::unused::unused;
use gaitwright_physics::character::{
    Character, Friction, Inertial, JointKind, Link, LoopKind, Placed, Shape, SurfaceMaterial,
};
use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::model::{Base, Model as PhysicsModel};
use gaitwright_physics::motion::Motion;
use gaitwright_physics::scene::Ground;

/// Longest step of the model, s: MuJoCo's own default.
const STEP: f64 = 0.002;

/// The greatest impedance of MuJoCo's usual contacts, by which it divides the time constant of `solref`.
const STIFFEST: f64 = 0.95;

/// Moments of inertia up to this are none to MuJoCo, kg m².
const LEAST_MOMENT: f64 = 1e-14;

/// A model that stands for the character on its ground, with a key for every frame of the entry and then of the loop,
/// on one clock.
pub(super) fn write(sampled: &SampledMotion<'_>, motion: &Motion) -> Result<String, InputError> {
    let skeleton = &sampled.skeleton;
    let character = skeleton.character;
    let mut faults = Vec::new();
    for slide in character.loops.iter().filter(|closed| closed.kind == LoopKind::Prismatic) {
        let reason = format!("the loop \"{}\" slides, and MuJoCo closes no loop with a slide", slide.name);
        faults.push(Fault::new("/character", reason));
    }
    let height = match &motion.scene.ground {
        Some(Ground::Plane { height }) => Some(*height),
        None => None,
        Some(_) => {
            faults.push(Fault::new("/scene/ground", "only level ground can be exported to MuJoCo"));
            None
        }
    };
    for (index, link) in character.links.iter().enumerate() {
        if matches!(link.surface.friction, Some(Friction::Directional { .. })) {
            let reason = "friction that depends on the direction cannot be exported to MuJoCo";
            faults.push(Fault::new(format!("/character/links/{index}/friction"), reason));
        }
    }
    if !motion.scene.obstacles.is_empty() {
        faults.push(Fault::new("/scene/obstacles", "obstacles cannot be exported to MuJoCo"));
    }
    if !faults.is_empty() {
        return Err(InputError::Impossible(faults));
    }
    let inertials = inertials(character);
    let mut model =
        Model { sampled, motion, inertials, text: String::new(), meshes: String::new(), order: Vec::new() };
    let mut ground = String::new();
    if let Some(height) = height {
        let _ = writeln!(
            ground,
            "    <geom name=\"ground\" type=\"plane\" pos=\"0 0 {height:?}\" size=\"0 0 1\" contype=\"0\" \
             conaffinity=\"1\"/>"
        );
    }
    model.body(0, 2);
    let gravity = numbers(motion.scene.acting_gravity().as_slice());
    let step = motion.provenance.accuracy.step.min(STEP);
    let (loops, actuators, keys) = (model.loops(step), model.actuators(), model.keys());
    let Model { text, meshes, .. } = model;
    let certificate = serde_json::to_string(&sampled.certificate);
    let certificate = certificate.map_err(|error| InputError::impossible("", error.to_string()))?;
    Ok(format!(
        "<mujoco model={}>\n{REPLAY}  <compiler angle=\"radian\" autolimits=\"true\" inertiafromgeom=\"false\" \
         balanceinertia=\"true\"/>\n  <option timestep=\"{step:?}\" gravity=\"{gravity}\" \
         integrator=\"implicitfast\" cone=\"elliptic\"/>\n  <custom>\n    <text name=\"certificate\" \
         data={}/>\n  </custom>\n  <asset>\n{meshes}  </asset>\n  <worldbody>\n\
         {ground}{text}  </worldbody>\n{loops}  <actuator>\n{actuators}  </actuator>\n  <keyframe>\n{keys}  </keyframe>\n\
         </mujoco>\n",
        quoted(&character.name),
        quoted(&certificate)
    ))
}

/// How the file is replayed.
const REPLAY: &str = "  <!-- Start at key 0. At the time t the controls are those of the keys, linear between them; after \
    the last key the loop begins again at the key \"loop_0\". -->\n";

struct Model<'a> {
    sampled: &'a SampledMotion<'a>,
    motion: &'a Motion,
    /// What each link is given of the inertia of its rigid body.
    inertials: Vec<Option<Inertial>>,
    text: String,
    meshes: String,
    /// Places of the angles in the order in which MuJoCo meets the joints.
    order: Vec<usize>,
}

// Writing to a string cannot fail, so that its results are dropped below.
impl Model<'_> {
    fn body(&mut self, link: usize, depth: usize) {
        let sampled = self.sampled;
        let links = &sampled.skeleton.character.links;
        let own = &links[link];
        let indent = "  ".repeat(depth);
        let frame = match &own.joint {
            Some(joint) => joint.origin,
            None => start(sampled).placed_root(false),
        };
        let _ = writeln!(self.text, "{indent}<body name={} {}>", quoted(&self.body_name(link)), pose(&frame));
        if let Some(inertial) = &self.inertials[link] {
            let _ = writeln!(self.text, "{indent}  {}", inertia(inertial));
        }
        match (&own.joint, sampled.skeleton.angle_of[link]) {
            (None, _) => {
                let joint = |name: &str| {
                    links.iter().filter_map(|link| link.joint.as_ref()).any(|joint| joint.name == name)
                };
                let name = unused("root", joint);
                let _ = writeln!(self.text, "{indent}  <freejoint name={}/>", quoted(&name));
            }
            (Some(joint), Some(angle)) => {
                self.order.push(angle);
                let kind = if joint.kind == JointKind::Revolute { "hinge" } else { "slide" };
                let range = joint.limits.as_ref().map_or(String::new(), |limits| {
                    format!(" range=\"{:?} {:?}\"", limits.lower, limits.upper)
                });
                let _ = writeln!(
                    self.text,
                    "{indent}  <joint name={} type=\"{kind}\" axis=\"{}\"{range} damping=\"{:?}\" \
                     frictionloss=\"{:?}\" armature=\"{:?}\"/>",
                    quoted(&joint.name),
                    numbers(joint.axis.as_slice()),
                    joint.damping,
                    joint.friction,
                    joint.armature
                );
            }
            (Some(_), None) => {}
        }
        for placed in &own.collisions {
            let geom = self.geom(placed, own.surface);
            let _ = writeln!(self.text, "{indent}  {geom}");
        }
        for child in sampled.skeleton.children(link) {
            self.body(child, depth + 1);
        }
        let _ = writeln!(self.text, "{indent}</body>");
    }

    /// The name of the body that a link is.
    fn body_name(&self, link: usize) -> String {
        let links = &self.sampled.skeleton.character.links;
        match &*links[link].name {
            // MuJoCo has a body of this name already.
            "world" => unused("world_", |name| links.iter().any(|link| link.name == name)),
            name => name.to_owned(),
        }
    }

    /// What closes the loops, as stiff as steps of `step` seconds allow: a ball holds one point of both links together, a hinge two on its
    /// axis. MuJoCo takes the points of the second link from the pose with all angles at zero.
    fn loops(&self, step: f64) -> String {
        let character = self.sampled.skeleton.character;
        if character.loops.is_empty() {
            return String::new();
        }
        // As far apart as joints are.
        let joints = character.links.iter().filter_map(|link| link.joint.as_ref());
        let apart = joints.map(|joint| joint.origin.translation.vector.norm()).fold(0.0, f64::max);
        let mut text = "  <equality>\n".to_owned();
        for closed in &character.loops {
            let [first, second] = closed.links.map(|link| quoted(&self.body_name(link)));
            let frame = closed.frames[0];
            let points = match closed.kind {
                LoopKind::Ball => vec![0.0],
                LoopKind::Revolute => vec![-0.5 * apart, 0.5 * apart],
                LoopKind::Fixed | LoopKind::Prismatic => Vec::new(),
            };
            let ends = format!("body1={first} body2={second} solref=\"{:?} 1\"", 2.0 * step);
            for along in &points {
                let anchor = frame * Point3::from(*closed.axis * *along);
                let anchor = numbers(anchor.coords.as_slice());
                let _ = writeln!(text, "    <connect {ends} anchor=\"{anchor}\"/>");
            }
            if points.is_empty() {
                let _ = writeln!(text, "    <weld {ends}/>");
            }
        }
        text + "  </equality>\n"
    }

    fn geom(&mut self, placed: &Placed, surface: SurfaceMaterial) -> String {
        let shape = match &placed.shape {
            Shape::Sphere { radius } => format!("type=\"sphere\" size=\"{radius:?}\""),
            Shape::Box { half_extents } => {
                format!("type=\"box\" size=\"{}\"", numbers(half_extents.as_slice()))
            }
            Shape::Cylinder { radius, half_length } => {
                format!("type=\"cylinder\" size=\"{radius:?} {half_length:?}\"")
            }
            Shape::Capsule { radius, half_length } => {
                format!("type=\"capsule\" size=\"{radius:?} {half_length:?}\"")
            }
            Shape::Hull { vertices, .. } => {
                // MuJoCo moves a mesh to its centre of mass and back by itself.
                let name = format!("hull_{}", self.meshes.lines().count());
                let corners: Vec<String> =
                    vertices.iter().map(|corner| numbers(corner.coords.as_slice())).collect();
                let _ = writeln!(
                    self.meshes,
                    "    <mesh name=\"{name}\" inertia=\"convex\" vertex=\"{}\"/>",
                    corners.join(" ")
                );
                format!("type=\"mesh\" mesh=\"{name}\"")
            }
        };
        let scene = &self.motion.scene;
        let friction = surface.friction.map_or(scene.friction, |own| own.greatest().min(scene.friction));
        let solref = match scene.contact_time_constant {
            0.0 => String::new(),
            time_constant => format!(" solref=\"{:?} 1\"", time_constant / STIFFEST),
        };
        // Shapes meet the ground and not each other; with priority what stands at them holds, and not the ground's.
        format!(
            "<geom {shape} {} friction=\"{friction:?} 0.005 0.0001\"{solref} priority=\"1\" contype=\"1\" \
             conaffinity=\"0\"/>",
            pose(&placed.pose)
        )
    }

    /// The joints with an actuator, by the place of their angle, with the index of each in the motion.
    fn driven(&self) -> Vec<(usize, usize)> {
        let joints = self.sampled.skeleton.movable().enumerate().filter(|(_, joint)| joint.driven);
        let own = |name: &str| self.motion.joints.iter().position(|other| other == name);
        joints.filter_map(|(angle, joint)| Some((angle, own(&joint.name)?))).collect()
    }

    fn actuators(&self) -> String {
        let drive = &self.motion.drive;
        let line = |(angle, joint): (usize, usize)| {
            let name = quoted(&self.sampled.joints()[angle]);
            let force = drive.max_torque[joint]
                .map_or(String::new(), |most| format!(" forcerange=\"-{most:?} {most:?}\""));
            format!(
                "    <position name={name} joint={name} kp=\"{:?}\" kv=\"{:?}\"{force}/>\n",
                drive.stiffness[joint], drive.damping[joint]
            )
        };
        self.driven().into_iter().map(line).collect()
    }

    fn keys(&self) -> String {
        let mut text = String::new();
        let mut clock = 0.0;
        for (name, clip) in [("entry", self.sampled.entry.as_ref()), ("loop", Some(&self.sampled.cycle))] {
            let Some(clip) = clip else { continue };
            // The entry's last frame is the loop's first.
            let count = clip.frames.len() - usize::from(name == "entry");
            for (index, frame) in clip.frames[..count].iter().enumerate() {
                self.key(&mut text, &format!("{name}_{index}"), clock + frame.time, frame);
            }
            clock += clip.duration();
        }
        text
    }

    fn key(&self, text: &mut String, name: &str, time: f64, frame: &MotionFrame) {
        let root = frame.placed_root(false);
        let (p, q) = (root.translation.vector, root.rotation);
        let angles = self.order.iter().map(|&angle| frame.angles[angle]);
        let state: Vec<f64> = [p.x, p.y, p.z, q.w, q.i, q.j, q.k].into_iter().chain(angles).collect();
        let drive = &self.motion.drive;
        let control = |(angle, joint): (usize, usize)| {
            let (stiffness, damping) = (drive.stiffness[joint], drive.damping[joint]);
            let ahead = if stiffness > 0.0 { damping / stiffness } else { 0.0 };
            frame.targets[angle] + ahead * frame.target_rates[angle]
        };
        let controls: Vec<f64> = self.driven().into_iter().map(control).collect();
        let _ = writeln!(
            text,
            "    <key name=\"{name}\" time=\"{time:?}\" qpos=\"{}\" ctrl=\"{}\"/>",
            numbers(&state),
            numbers(&controls)
        );
    }
}

/// Where the motion begins.
fn start<'a>(sampled: &'a SampledMotion<'_>) -> &'a MotionFrame {
    &sampled.entry.as_ref().unwrap_or(&sampled.cycle).frames[0]
}

/// The inertia that each link is given: its own; or, in a rigid body of several links one of which has an inertia that MuJoCo does not
/// take as it is, the whole body's at its first link and none at the others. MuJoCo refuses inertias that are not positive definite,
/// and changes those that break the triangle inequality.
fn inertials(character: &Character) -> Vec<Option<Inertial>> {
    let model = PhysicsModel::new(Arc::new(character.clone()), Base::Floating);
    let heavy = |link: &Link| link.inertial.clone().filter(|inertial| inertial.mass > 0.0);
    let mut inertials: Vec<Option<Inertial>> = character.links.iter().map(heavy).collect();
    for (index, body) in model.bodies.iter().enumerate() {
        let links =
            || model.links.iter().enumerate().filter(|(_, place)| place.body == index).map(|(link, _)| link);
        if !links().any(|link| inertials[link].as_ref().is_some_and(|own| !possible(&own.inertia))) {
            continue;
        }
        links().for_each(|link| inertials[link] = None);
        let whole = Inertial { mass: body.mass, center_of_mass: body.center.into(), inertia: body.inertia };
        if let Some(first) = links().next() {
            inertials[first] = Some(whole);
        }
    }
    inertials
}

/// Whether MuJoCo takes an inertia as it is.
fn possible(inertia: &Matrix3<f64>) -> bool {
    let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    moments[0] > LEAST_MOMENT && moments[0] + moments[1] >= moments[2]
}

fn inertia(inertial: &Inertial) -> String {
    let i = &inertial.inertia;
    let full = [i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]];
    format!(
        "<inertial pos=\"{}\" mass=\"{:?}\" fullinertia=\"{}\"/>",
        numbers(inertial.center_of_mass.coords.as_slice()),
        inertial.mass,
        numbers(&full)
    )
}

fn pose(frame: &Isometry3<f64>) -> String {
    let q = frame.rotation;
    let position: &Vector3<f64> = &frame.translation.vector;
    format!("pos=\"{}\" quat=\"{}\"", numbers(position.as_slice()), numbers(&[q.w, q.i, q.j, q.k]))
}

fn numbers(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(" ")
}

/// A name as an attribute, in its quotes.
fn quoted(name: &str) -> String {
    let escaped = name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    format!("\"{escaped}\"")
}
