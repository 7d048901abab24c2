//! Impacts make no energy, whatever the restitution, the friction and the number of points, and where the laws of impact
//! have a closed form it holds.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::sync::Arc;

use gaitwright_physics::character::{self, Options, Source};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{
    Accuracy, Coordinates, Effect, FrictionCone, Gains, Integrator, Scene, StepPlan, Switch,
};
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::bodies::urdf;
use crate::common;

/// Radius of the balls that touch the ground, m.
const RADIUS: f64 = 0.02;

/// So short that in a step only the impact counts, s.
const STEP: f64 = 1e-6;

/// Only impacts act: no gravity, and no forces that depend on velocities.
fn impacts_only(restitution: f64, friction: f64) -> Scene {
    let mut scene = Scene { gravity: [0.0; 3], restitution, friction, ..Scene::default() };
    scene.effects.insert(Effect::VelocityForces, Switch::Off);
    scene.effects.insert(Effect::SelfCollision, Switch::Off);
    scene
}

/// Kinetic energy with the velocities of `moving` at the pose of `placed`, J.
fn kinetic(plan: &Arc<StepPlan>, placed: &State, moving: &State) -> f64 {
    let mut state = State::new(&plan.model);
    state.root = placed.root;
    state.root.linear_velocity = moving.root.linear_velocity;
    state.root.angular_velocity = moving.root.angular_velocity;
    state.angles.copy_from_slice(&placed.angles);
    state.velocities.copy_from_slice(&moving.velocities);
    Simulator::new(plan.clone(), state).energy().kinetic
}

/// The pose at which the first step from `start` solves for its velocities.
fn pose_of_impact(plan: &StepPlan, start: &State) -> State {
    let mut state = start.clone();
    if plan.accuracy.integrator == Integrator::MoreauJean {
        let half = 0.5 * plan.step();
        let root = &mut state.root;
        root.position += root.linear_velocity * half;
        root.orientation = UnitQuaternion::from_scaled_axis(root.angular_velocity * half) * root.orientation;
        for (angle, rate) in state.angles.iter_mut().zip(&start.velocities) {
            *angle += rate * half;
        }
    }
    state
}

/// Kinetic energies before and after the impact of the first step, J, and the state after it.
fn impact(plan: &Arc<StepPlan>, start: &State) -> ([f64; 2], Simulator) {
    let mut simulator = Simulator::new(plan.clone(), start.clone());
    simulator.step(Command::Passive).unwrap_or_else(|failure| panic!("{failure}"));
    let pose = pose_of_impact(plan, start);
    ([kinetic(plan, &pose, start), kinetic(plan, &pose, simulator.state())], simulator)
}

/// One of the methods of integration, the coordinates and the friction cones, at a step that is an impact.
fn any_method(rng: &mut ChaCha8Rng) -> Accuracy {
    let (integrator, coordinates) = [
        (Integrator::SemiImplicitEuler, Coordinates::Reduced),
        (Integrator::MoreauJean, Coordinates::Reduced),
        (Integrator::SemiImplicitEuler, Coordinates::Maximal),
    ][rng.random_range(0..3)];
    let friction_cone = if rng.random_bool(0.5) { FrictionCone::Cone } else { FrictionCone::Pyramid };
    Accuracy { step: STEP, integrator, coordinates, friction_cone, ..Accuracy::default() }
}

/// A random tree with a ball on each link, and where the balls are in the links.
fn tree(rng: &mut ChaCha8Rng, links: usize, fixed: bool) -> (Arc<Model>, Vec<Point3<f64>>) {
    let mut text = String::from(r#"<robot name="tree">"#);
    let mut balls = Vec::new();
    for link in 0..links {
        let mass = 10_f64.powf(rng.random_range(-1.0..1.0));
        let [x, y, z] = [0; 3].map(|_| mass * rng.random_range(0.002..0.02));
        let ball = Point3::from([0; 3].map(|_| rng.random_range(-0.2..0.2)));
        let _ = write!(
            text,
            r#"<link name="l{link}"><inertial><mass value="{mass:?}"/>
            <inertia ixx="{x:?}" ixy="0" ixz="0" iyy="{y:?}" iyz="0" izz="{z:?}"/></inertial>
            <collision><origin xyz="{:?} {:?} {:?}"/><geometry><sphere radius="{RADIUS}"/></geometry></collision></link>"#,
            ball.x, ball.y, ball.z
        );
        balls.push(ball);
        if link > 0 {
            let parent = rng.random_range(0..link);
            let [a, b, c, d, e, f] = [0; 6].map(|_| rng.random_range(-0.3..0.3));
            let kind = ["revolute", "continuous", "prismatic"][rng.random_range(0..3)];
            let friction = if rng.random_bool(0.2) { 0.2 } else { 0.0 };
            let _ = write!(
                text,
                r#"<joint name="j{link}" type="{kind}"><parent link="l{parent}"/><child link="l{link}"/>
                <origin xyz="{a:?} {b:?} {c:?}"/><axis xyz="{d:?} {e:?} {f:?}"/>
                <limit lower="-0.5" upper="0.5" effort="100" velocity="100"/><dynamics friction="{friction:?}"/></joint>"#
            );
        }
    }
    text.push_str("</robot>");
    let model = urdf(&text, fixed);
    (if rng.random_bool(0.5) { with_rotors(rng, &model) } else { model }, balls)
}

/// `model` with a rotor in every joint, of a tenth to ten times 0.01 kg m² (or kg).
fn with_rotors(rng: &mut ChaCha8Rng, model: &Model) -> Arc<Model> {
    let mut character = (*model.character).clone();
    for joint in character.links.iter_mut().filter_map(|link| link.joint.as_mut()) {
        joint.armature = 10_f64.powf(rng.random_range(-3.0..-1.0));
    }
    Arc::new(Model::new(Arc::new(character), Base::fixed_if(model.fixed_base)))
}

/// A random motion of `model` in which as many of its `balls` touch the ground as `contacts` says, if there are so many.
fn over_ground(rng: &mut ChaCha8Rng, model: &Arc<Model>, balls: &[Point3<f64>], contacts: usize) -> State {
    let mut three = |size: f64| Vector3::from([0; 3].map(|_| rng.random_range(-size..size)));
    let mut state = State::new(model);
    state.root.orientation = UnitQuaternion::from_scaled_axis(three(3.0));
    if !model.fixed_base {
        state.root.angular_velocity = three(5.0);
        state.root.linear_velocity = three(1.0) - Vector3::z();
    }
    for joint in 0..model.joint_count() {
        let range = if rng.random_bool(0.3) { 0.5 } else { 0.45 };
        state.angles[joint] = if range == 0.5 { -0.5 } else { rng.random_range(-range..range) };
        state.velocities[joint] = rng.random_range(-3.0..3.0);
    }
    let plan = common::plan(model, &impacts_only(0.0, 0.0), &Accuracy::default(), None);
    let poses = Simulator::new(plan, state.clone()).link_poses();
    let mut bottoms: Vec<f64> =
        poses.iter().zip(balls).map(|(pose, ball)| (pose * ball).z - RADIUS).collect();
    bottoms.sort_by(f64::total_cmp);
    state.root.position.z = -bottoms[contacts.min(bottoms.len()) - 1];
    state
}

/// After an impact of any restitution and friction on so many points, by any method, which must not make energy.
fn lands(
    rng: &mut ChaCha8Rng,
    model: &Arc<Model>,
    balls: &[Point3<f64>],
    contacts: usize,
    name: &str,
) -> Simulator {
    let restitution = if rng.random_bool(0.2) { 1.0 } else { rng.random_range(0.0..1.0) };
    let friction = if rng.random_bool(0.2) { 0.0 } else { rng.random_range(0.0..2.0) };
    let accuracy = any_method(rng);
    let plan = common::plan(model, &impacts_only(restitution, friction), &accuracy, None);
    let start = over_ground(rng, model, balls, contacts);
    let ([before, after], simulator) = impact(&plan, &start);
    assert!(
        after <= before * (1.0 + 1e-9),
        "{name}, e {restitution}, μ {friction}, {accuracy:?}: {before} J to {after} J"
    );
    simulator
}

/// Two and a half thousand impacts of random trees, on 1 to 8 points, some at the ends of joint ranges.
#[test]
fn random_impacts_make_no_energy() {
    let seeds: Vec<u64> = (0..625).collect();
    let counted = common::in_parallel(&seeds, |seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
        let (links, fixed) = (rng.random_range(1..10), rng.random_bool(0.2));
        let (model, balls) = tree(&mut rng, links.max(1 + usize::from(fixed)), fixed);
        let mut rebounding = 0;
        for _ in 0..4 {
            let contacts = rng.random_range(1..9);
            let simulator = lands(&mut rng, &model, &balls, contacts, &format!("seed {seed}, {links} links"));
            rebounding += usize::from(simulator.contacts().any(|contact| contact.force.norm() > 0.0));
        }
        rebounding
    });
    assert!(counted.iter().sum::<usize>() > 1500, "impacts: {counted:?}");
}

/// Impacts of trees of a hundred links on up to a hundred points.
#[test]
fn random_impacts_on_a_hundred_points_make_no_energy() {
    let seeds: Vec<u64> = (0..16).collect();
    let touching = common::in_parallel(&seeds, |seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(5000 + seed);
        let (model, balls) = tree(&mut rng, 100, false);
        let contacts = rng.random_range(60..=100);
        let simulator =
            lands(&mut rng, &model, &balls, contacts, &format!("seed {seed}, {contacts} contacts"));
        simulator.contacts().count()
    });
    // Points that are on their way up do not count.
    assert!(touching.iter().all(|&touching| touching >= 50), "{touching:?}");
}

/// A free body of this mass (kg) and moment of inertia (kg m²) about its centre, its origin, with a ball at its tip.
const MASS: f64 = 1.3;
const INERTIA: f64 = 0.04;

/// The rod's tip touches the ground at `arm` = (x, z) from the centre, m. The contact velocity of the plane motion is
/// (along x, along z) = `approach`, m/s, with no spin; what it is after the impact, with the closed form's mobilities
/// A_nn, A_nt, A_tt.
struct Tip {
    normal: f64,
    mixed: f64,
    tangent: f64,
    after: [f64; 2],
}

fn tip(arm: [f64; 2], approach: [f64; 2], restitution: f64, friction: f64, integrator: Integrator) -> Tip {
    let [x, z] = arm;
    let model = urdf(
        &format!(
            r#"<robot name="rod"><link name="rod"><inertial><mass value="{MASS}"/>
            <inertia ixx="{INERTIA}" ixy="0" ixz="0" iyy="{INERTIA}" iyz="0" izz="{INERTIA}"/></inertial>
            <collision><origin xyz="{x:?} 0 {:?}"/><geometry><sphere radius="{RADIUS}"/></geometry></collision>
            </link></robot>"#,
            z + RADIUS
        ),
        false,
    );
    let mut start = State::new(&model);
    start.root.position.z = -z;
    start.root.linear_velocity = Vector3::new(approach[0], 0.0, approach[1]);
    let accuracy = Accuracy { step: STEP, integrator, ..Accuracy::default() };
    let plan = common::plan(&model, &impacts_only(restitution, friction), &accuracy, None);
    let ([before, after], simulator) = impact(&plan, &start);
    assert!(after <= before * (1.0 + 1e-9), "{before} J to {after} J");
    let root = simulator.state().root;
    let [vx, vz, turn] = [root.linear_velocity.x, root.linear_velocity.z, root.angular_velocity.y];
    Tip {
        normal: 1.0 / MASS + x * x / INERTIA,
        mixed: -x * z / INERTIA,
        tangent: 1.0 / MASS + z * z / INERTIA,
        after: [vx + turn * z, vz - turn * x],
    }
}

const INTEGRATORS: [Integrator; 2] = [Integrator::SemiImplicitEuler, Integrator::MoreauJean];

/// The pose moves by a millionth of a metre in the step, and the arm with it.
const TOLERANCE: f64 = 3e-5;

#[track_caller]
fn close(found: [f64; 2], wanted: [f64; 2]) {
    let apart = (found[0] - wanted[0]).abs().max((found[1] - wanted[1]).abs());
    assert!(apart < TOLERANCE, "{found:?} m/s instead of {wanted:?}");
}

/// P_n = −(1 + e) w_n / A_nn: w_n⁺ = −e w_n⁻, w_t⁺ = w_t⁻ + A_nt P_n.
#[test]
fn a_rod_without_friction_rebounds_by_newtons_law() {
    for integrator in INTEGRATORS {
        for restitution in [0.3, 0.8, 1.0] {
            let [along, down] = [0.4, -1.5];
            let tip = tip([0.2, -0.3], [along, down], restitution, 0.0, integrator);
            let impulse = -(1.0 + restitution) * down / tip.normal;
            close(tip.after, [along + tip.mixed * impulse, -restitution * down]);
        }
    }
}

/// Sliding in one direction throughout, P_t = −μ P_n sgn(w_t): the laws of Newton, Poisson and Stronge agree (Stronge
/// 2000, "Impact Mechanics", chapter 3), P_n = −(1 + e) w_n / (A_nn − μ A_nt sgn(w_t)).
#[test]
fn a_rod_that_slides_throughout_rebounds_as_all_laws_have_it() {
    for integrator in INTEGRATORS {
        for (restitution, friction) in [(0.3, 0.1), (0.7, 0.2), (1.0, 0.15)] {
            for side in [-1.0, 1.0] {
                let [along, down] = [4.0 * side, -1.0];
                let tip = tip([0.12, -0.3], [along, down], restitution, friction, integrator);
                let impulse = -(1.0 + restitution) * down / (tip.normal - friction * side * tip.mixed);
                let slip = along + (tip.mixed - friction * side * tip.tangent) * impulse;
                assert!(slip * side > 0.0, "it slides throughout");
                close(tip.after, [slip, -restitution * down]);
            }
        }
    }
}

/// Sticking throughout, with no sliding before: w_t = 0 and w_n⁺ = −e w_n⁻ by all three laws, where μ is at least
/// |A_nt| / A_tt (Stronge 2000, section 3.4).
#[test]
fn a_rod_that_sticks_throughout_rebounds_as_all_laws_have_it() {
    for integrator in INTEGRATORS {
        for restitution in [0.0, 0.4, 0.9] {
            let tip = tip([0.2, -0.3], [0.0, -1.2], restitution, 2.0, integrator);
            assert!(tip.mixed.abs() / tip.tangent < 2.0);
            close(tip.after, [0.0, restitution * 1.2]);
        }
    }
}

/// Sliding that the impact stops: with B = A⁻¹ over normal and tangent, W(s) = (B_nn s² e² w_n² − wᵀ B w) / 2, so that
/// W(s) ≤ (1 − e²) W(0) allows a rebound of e √(wᵀ B w / B_nn). Newton's law gives e |w_n| however little of the energy the
/// stopped impact takes; Poisson's e |w_n + w_t B_nt / B_nn| is never above the bound.
#[test]
fn a_rod_that_comes_to_stick_rebounds_within_its_energy() {
    let mut bounded = 0;
    for integrator in INTEGRATORS {
        for along in [-1.2, -0.8, -0.4, 0.4, 0.8, 1.2] {
            let (restitution, down) = (0.9, -1.0);
            let tip = tip([0.25, -0.3], [along, down], restitution, 5.0, integrator);
            let determinant = tip.normal * tip.tangent - tip.mixed * tip.mixed;
            let [nn, nt, tt] = [tip.tangent, -tip.mixed, tip.normal].map(|entry| entry / determinant);
            let energy = nn * down * down + 2.0 * nt * down * along + tt * along * along;
            let bound = restitution * (energy / nn).sqrt();
            let newton = -restitution * down;
            let poisson = -restitution * (down + along * nt / nn);
            assert!(poisson <= bound + 1e-12);
            bounded += usize::from(bound < newton);
            close(tip.after, [0.0, newton.min(bound)]);
        }
    }
    assert!(bounded >= 2, "{bounded} rebounds were bounded");
}

/// A double pendulum of two bars of 1 kg and 0.5 m, with a ball at its tip.
fn double_pendulum() -> Arc<Model> {
    let bar = |name: &str| {
        format!(
            r#"<link name="{name}"><inertial><origin xyz="0 0 -0.25"/><mass value="1"/>
            <inertia ixx="0.0208" ixy="0" ixz="0" iyy="0.0208" iyz="0" izz="0.0001"/></inertial>"#
        )
    };
    urdf(
        &format!(
            r#"<robot name="double"><link name="base"/>{}</link>{}
            <collision><origin xyz="0 0 -0.5"/><geometry><sphere radius="{RADIUS}"/></geometry></collision></link>
            <joint name="a" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
            <joint name="b" type="continuous"><parent link="upper"/><child link="lower"/>
            <origin xyz="0 0 -0.5"/><axis xyz="0 1 0"/></joint></robot>"#,
            bar("upper"),
            bar("lower")
        ),
        true,
    )
}

/// One that moves at random with its tip on the ground, and the speed at which the tip approaches that, m/s.
fn tip_on_the_ground(rng: &mut ChaCha8Rng, model: &Model) -> (State, f64) {
    let mut start = State::new(model);
    start.angles[0] = rng.random_range(-1.2..1.2);
    start.angles[1] = rng.random_range(-0.5 * TAU..0.5 * TAU);
    start.velocities[0] = rng.random_range(-4.0..4.0);
    start.velocities[1] = rng.random_range(-4.0..4.0);
    let tip = |angle: f64, sum: f64| 0.5 * (angle.cos() + sum.cos());
    let sum = start.angles[0] + start.angles[1];
    start.root.position.z = tip(start.angles[0], sum) + RADIUS;
    let rates = [start.velocities[0], start.velocities[0] + start.velocities[1]];
    let approach = 0.5 * (start.angles[0].sin() * rates[0] + sum.sin() * rates[1]);
    (start, approach)
}

/// Kane's example: the tip of a double pendulum with e = 0.9 and μ = 0.5 gained ten times its energy by Newton's law.
#[test]
fn a_double_pendulum_gains_nothing() {
    let model = double_pendulum();
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let (mut scaled, mut impacts) = (0, 0);
    for case in 0..600 {
        let (start, approach) = tip_on_the_ground(&mut rng, &model);
        let integrator = INTEGRATORS[case % 2];
        let accuracy = Accuracy { step: STEP, integrator, ..Accuracy::default() };
        let plan = common::plan(&model, &impacts_only(0.9, 0.5), &accuracy, None);
        let ([before, after], simulator) = impact(&plan, &start);
        assert!(after <= before * (1.0 + 1e-9), "case {case}: {before} J to {after} J");
        if let Some(contact) = simulator.contacts().next().filter(|_| approach < -0.1) {
            impacts += 1;
            scaled += usize::from(contact.velocity.z < 0.9 * -approach - 1e-4);
        }
    }
    assert!(impacts > 150 && scaled > 10, "{scaled} of {impacts} rebounds were scaled");
}

/// Rotors, dampers and springs push back in an impact as links do: they are part of the mass in reduced coordinates and rows in maximal
/// ones, and both rebound alike, without gaining energy.
#[test]
fn what_is_in_the_joints_changes_an_impact_alike_in_both_coordinates() {
    let plain = double_pendulum();
    let mut rng = ChaCha8Rng::seed_from_u64(32);
    let mut impacts = 0;
    for case in 0..300 {
        let model = with_rotors(&mut rng, &plain);
        let (start, approach) = tip_on_the_ground(&mut rng, &model);
        // The damper takes a good part of a velocity within the step of the impact.
        let damping = if case % 2 == 0 { vec![0.0; 2] } else { vec![rng.random_range(0.0..0.1) / STEP; 2] };
        let gains = Gains { stiffness: vec![0.0; 2], damping, max_torque: vec![None; 2], ..Gains::default() };
        let ends = [Coordinates::Reduced, Coordinates::Maximal].map(|coordinates| {
            let accuracy = Accuracy { step: STEP, coordinates, ..Accuracy::default() };
            let plan = common::plan(&model, &impacts_only(0.9, 0.5), &accuracy, Some(&gains));
            let mut simulator = Simulator::new(plan.clone(), start.clone());
            let rest = &start.angles;
            simulator.step(Command::Track { now: rest, next: rest }).unwrap();
            let [before, after] = [&start, simulator.state()].map(|state| kinetic(&plan, &start, state));
            assert!(after <= before * (1.0 + 1e-9), "case {case}, {coordinates:?}: {before} J to {after} J");
            let strikes = simulator.contacts().any(|contact| contact.force.z > 0.0);
            (strikes, simulator.state().velocities.clone())
        });
        // Where the damper alone takes the tip off the ground, reduced coordinates know of no impact, and maximal ones of one that does
        // as the law says.
        let [(true, reduced), (_, maximal)] = &ends else { continue };
        let apart = reduced.iter().zip(maximal).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-4, "case {case}: {reduced:?} and {maximal:?}");
        impacts += usize::from(approach < -0.1);
    }
    assert!(impacts > 60, "{impacts} impacts");
}

/// A link that weighs `mass` kg, with a ball where there is one.
fn arm_link(name: &str, mass: f64, ball: Option<Point3<f64>>) -> String {
    let inertia = 0.01 * mass;
    let ball = ball.map_or(String::new(), |at| {
        format!(
            r#"<collision><origin xyz="{:?} {:?} {:?}"/><geometry><sphere radius="{RADIUS}"/></geometry></collision>"#,
            at.x, at.y, at.z
        )
    });
    format!(
        r#"<link name="{name}"><inertial><mass value="{mass:?}"/>
        <inertia ixx="{inertia:?}" ixy="0" ixz="0" iyy="{inertia:?}" iyz="0" izz="{inertia:?}"/></inertial>{ball}</link>"#
    )
}

/// A trunk with two arms of two joints each, in a random pose in which a ball on the one hand touches a ball on the other.
fn hands_that_touch(rng: &mut ChaCha8Rng, fixed: bool) -> (Arc<Model>, State) {
    let names = ["a1", "a2", "b1", "b2"];
    let parents = ["trunk", "a1", "trunk", "b1"];
    let masses: Vec<f64> = (0..5).map(|_| 10_f64.powf(rng.random_range(-1.0..1.0))).collect();
    let joints: String = names
        .iter()
        .zip(parents)
        .map(|(name, parent)| {
            let [a, b, c, d, e, f] = [0; 6].map(|_| rng.random_range(-0.3..0.3));
            let kind = ["continuous", "prismatic"][rng.random_range(0..2)];
            format!(
                r#"<joint name="j{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>
                <origin xyz="{a:?} {b:?} {c:?}"/><axis xyz="{d:?} {e:?} {f:?}"/>
                <limit lower="-9" upper="9" effort="100" velocity="100"/></joint>"#
            )
        })
        .collect();
    let built = |balls: [Option<Point3<f64>>; 2]| {
        let mut text = format!(r#"<robot name="hands">{}"#, arm_link("trunk", masses[0], None));
        for (index, name) in names.iter().enumerate() {
            let ball = if index % 2 == 1 { balls[index / 2] } else { None };
            text.push_str(&arm_link(name, masses[index + 1], ball));
        }
        urdf(&format!("{text}{joints}</robot>"), fixed)
    };
    let mut three = |size: f64| Vector3::from([0; 3].map(|_| rng.random_range(-size..size)));
    let held = Point3::from(three(0.2));
    let model = built([Some(held), None]);
    let mut state = State::new(&model);
    state.root.orientation = UnitQuaternion::from_scaled_axis(three(3.0));
    let apart = three(1.0).normalize() * (2.0 * RADIUS);
    if !fixed {
        (state.root.linear_velocity, state.root.angular_velocity) = (three(1.0), three(5.0));
    }
    for joint in 0..4 {
        state.angles[joint] = rng.random_range(-0.5..0.5);
        state.velocities[joint] = rng.random_range(-3.0..3.0);
    }
    let plan = common::plan(&model, &impacts_only(0.0, 0.0), &Accuracy::default(), None);
    let poses = Simulator::new(plan, state.clone()).link_poses();
    let of = |name: &str| model.character.links.iter().position(|link| link.name == name).unwrap();
    let other = poses[of("b2")].inverse_transform_point(&(poses[of("a2")] * held + apart));
    (built([Some(held), Some(other)]), state)
}

/// A thousand impacts of a character's hands on each other, sliding as they like.
#[test]
fn links_that_strike_each_other_at_random_make_no_energy() {
    let seeds: Vec<u64> = (0..250).collect();
    let counted = common::in_parallel(&seeds, |seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(9000 + seed);
        let (mut struck, mut sliding) = (0, 0);
        for _ in 0..4 {
            let (model, start) = hands_that_touch(&mut rng, seed % 5 == 0);
            let restitution = if rng.random_bool(0.2) { 1.0 } else { rng.random_range(0.0..1.0) };
            let friction = rng.random_range(0.0..2.0);
            let accuracy = any_method(&mut rng);
            let mut scene = Scene { ground: None, ..impacts_only(restitution, friction) };
            scene.effects.insert(Effect::SelfCollision, Switch::On);
            let plan = common::plan(&model, &scene, &accuracy, None);
            let ([before, after], simulator) = impact(&plan, &start);
            assert!(
                after <= before * (1.0 + 1e-9),
                "seed {seed}, e {restitution}, μ {friction}, {accuracy:?}: {before} J to {after} J"
            );
            for contact in simulator.contacts().filter(|contact| contact.force.norm() > 0.0) {
                struck += 1;
                let along = contact.force - contact.normal * contact.force.dot(&contact.normal);
                sliding += usize::from(along.norm() > 1e-3 * contact.force.norm());
            }
        }
        [struck, sliding]
    });
    let sum = |of: usize| counted.iter().map(|counts| counts[of]).sum::<usize>();
    assert!(sum(0) > 300 && sum(1) > 200, "{} impacts, {} of them with friction", sum(0), sum(1));
}

/// Three balls that slide along a line, the last two touching each other, with and without friction.
#[test]
fn links_that_hit_each_other_make_no_energy() {
    let text = format!(
        r#"<robot name="cradle"><link name="base"/>{}{}{}{}{}{}</robot>"#,
        round("a"),
        round("b"),
        round("c"),
        slide("a", -0.2),
        slide("b", 0.0),
        slide("c", 0.1)
    );
    let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Fixed));
    for integrator in INTEGRATORS {
        for (restitution, friction) in [(1.0, 0.0), (0.7, 0.0), (1.0, 1.0), (0.5, 0.3)] {
            let mut scene = Scene { ground: None, ..impacts_only(restitution, friction) };
            scene.effects.insert(Effect::SelfCollision, Switch::On);
            let accuracy = Accuracy { step: 1e-3, integrator, ..Accuracy::default() };
            let plan = common::plan(&model, &scene, &accuracy, None);
            let mut start = State::new(&model);
            start.velocities[0] = 1.0;
            let mut simulator = Simulator::new(plan, start);
            let before = simulator.energy().kinetic;
            let mut last = before;
            for _ in 0..300 {
                simulator.step(Command::Passive).unwrap();
                let now = simulator.energy().kinetic;
                assert!(now <= last + 1e-9 * before, "{last} J to {now} J");
                last = now;
            }
            // The momentum along the slides is handed on.
            let sum: f64 = simulator.state().velocities.iter().sum();
            assert!((sum - 1.0).abs() < 1e-7, "{sum} of the momentum is left");
            assert!(simulator.state().velocities[2] > 0.1, "the last ball moves");
        }
    }
}

fn round(name: &str) -> String {
    format!(
        r#"<link name="{name}"><inertial><mass value="1"/>
        <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
        <collision><geometry><sphere radius="0.05"/></geometry></collision></link>"#
    )
}

fn slide(name: &str, at: f64) -> String {
    format!(
        r#"<joint name="j{name}" type="prismatic"><parent link="base"/><child link="{name}"/>
        <origin xyz="{at} 0 0"/><axis xyz="1 0 0"/><limit lower="-10" upper="10" effort="1" velocity="10"/></joint>"#
    )
}
