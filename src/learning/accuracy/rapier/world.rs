//! A model, a plan and a state as bodies, joints and colliders of rapier.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};
use rapier3d::dynamics::{
    CoefficientCombineRule, GenericJoint, GenericJointBuilder, JointAxesMask, JointAxis, MassProperties,
    MultibodyJointHandle, RigidBodyBuilder, RigidBodyHandle,
};
use rapier3d::geometry::{
    Collider, ColliderBuilder, Group, InteractionGroups, InteractionTestMode, SharedShape,
};
use rapier3d::math::{Matrix, Pose, Rotation, Vector};
use rapier3d::pipeline::PhysicsWorld;

use gaitwright_physics::character::Shape;
use gaitwright_physics::model::{DofKind, Model};
use gaitwright_physics::scene::{Feedforward, FrictionCone, PairMaterial, StepPlan, Terrain, UNLIMITED};
use gaitwright_physics::sim::State;
use gaitwright_physics::sim::bodies::Bodies;
use gaitwright_physics::sim::coordinates::reduced::kinematics::place;

/// What rapier's lengths are multiples of, in sizes of the character: about a metre for a dog.
const LENGTH_UNIT: f64 = 10.0;

/// Penetration that rapier does not correct, in sizes of the character: 0.1 mm for a dog.
pub const LINEAR_SLOP: f64 = 1e-3;

/// Distance between shapes from which rapier makes a contact, in sizes of the character: 2 cm for a dog.
pub const PREDICTION: f64 = 0.2;

/// Gauss-Seidel sweeps in each substep.
///
/// Rapier's default is one, and it does not warm-start motors: the driven joints of a standing robot then deflect by some
/// millimetres more than their springs would.
const SWEEPS: usize = 2;

/// What a plan asks for and rapier does not do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsupported {
    /// An effect or a setting of the plan.
    #[error("rapier has no {0}")]
    Missing(&'static str),
    /// Something that rapier always does.
    #[error("rapier cannot leave out {0}")]
    Inseparable(&'static str),
    /// A collision shape without volume.
    #[error("rapier cannot make a solid of a collision shape of link {0}")]
    Flat(String),
}

/// A model in rapier.
pub struct Built {
    pub world: PhysicsWorld,
    /// One a body of the model.
    pub bodies: Vec<RigidBodyHandle>,
    /// Any joint of the multibody; `None` for a lone body.
    pub tree: Option<MultibodyJointHandle>,
}

/// The rapier axis along which a joint is free.
pub fn axis(dof: DofKind) -> JointAxis {
    match dof {
        DofKind::Revolute => JointAxis::AngX,
        DofKind::Prismatic => JointAxis::LinX,
    }
}

/// Index of a joint's coordinate among the six of a rapier joint.
pub fn coordinate(dof: DofKind) -> usize {
    axis(dof) as usize
}

pub fn vector(vector: Vector3<f64>) -> Vector {
    Vector::new(vector.x, vector.y, vector.z)
}

fn rotation(rotation: &UnitQuaternion<f64>) -> Rotation {
    Rotation::from_xyzw(rotation.i, rotation.j, rotation.k, rotation.w)
}

fn rotation_of(matrix: &Matrix3<f64>) -> Rotation {
    rotation(&UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix)))
}

fn pose(pose: &Isometry3<f64>) -> Pose {
    Pose::from_parts(vector(pose.translation.vector), rotation(&pose.rotation))
}

/// Builds the world, at `state`.
///
/// # Errors
/// As [`super::Rapier::new`].
pub fn build(model: &Model, plan: &StepPlan, state: &State) -> Result<Built, Unsupported> {
    refuse(model, plan)?;
    let mut world = PhysicsWorld { gravity: vector(plan.gravity), ..PhysicsWorld::default() };
    let settings = &mut world.integration_parameters;
    settings.dt = plan.step();
    settings.length_unit = LENGTH_UNIT * model.size;
    settings.normalized_allowed_linear_error = LINEAR_SLOP / LENGTH_UNIT;
    settings.normalized_prediction_distance = PREDICTION / LENGTH_UNIT;
    settings.num_internal_pgs_iterations = SWEEPS;
    // Contact manifolds are computed anew in each step.
    settings.contact_recycling = false;

    let mut motions = Bodies::new(model);
    place(model, state, &mut motions);
    let mut bodies: Vec<RigidBodyHandle> = Vec::with_capacity(motions.len());
    for (index, motion) in motions.iter().enumerate() {
        let fixed = index == 0 && model.fixed_base;
        let origin = state.root.position.coords + motion.point(frame_offset(model, index));
        let builder = if fixed { RigidBodyBuilder::fixed() } else { RigidBodyBuilder::dynamic() };
        let mut builder =
            builder.pose(Pose::from_parts(vector(origin), rotation_of(&motion.rotation))).can_sleep(false);
        if !fixed {
            let velocity = motion.velocity;
            builder = builder
                .additional_mass_properties(mass_properties(model, index))
                .linvel(vector(velocity.at(motion.center)))
                .angvel(vector(velocity.angular));
        }
        bodies.push(world.insert_body(builder));
    }
    let mut tree = None;
    for (index, body) in model.bodies.iter().enumerate().skip(1) {
        let joint = joint(model, plan, index);
        let inserted = world.insert_multibody_joint(bodies[body.parent], bodies[index], joint);
        tree = Some(inserted.ok_or(Unsupported::Missing("such a kinematic tree"))?);
    }
    add_colliders(&mut world, model, plan, &bodies)?;
    for body in &bodies {
        // Otherwise rapier would apply the given masses only after the first forces.
        world.bodies[*body].recompute_mass_properties_from_colliders(&world.colliders);
    }
    if let Some((tree, _)) = tree.and_then(|tree| world.multibody_joints.get_mut(tree)) {
        // Makes the root free or fixed, as its body is.
        tree.forward_kinematics(&world.bodies, true);
        tree.set_self_contacts_enabled(false);
        let root = tree.ndofs() - model.joint_count();
        tree.damping_mut().fill(0.0);
        let mut angles = vec![0.0; tree.ndofs()];
        for joint in 0..model.joint_count() {
            tree.damping_mut()[root + joint] = plan.damping.as_ref().map_or(0.0, |damping| damping[joint]);
            tree.frictions_mut()[root + joint] = plan.dry_friction.as_ref().map_or(0.0, |dry| dry[joint]);
            tree.armature_mut()[root + joint] = model.armature[joint];
            angles[root + joint] = state.angles[joint];
        }
        tree.apply_displacements(&angles);
        let mut rates = tree.generalized_velocity_mut();
        if !model.fixed_base {
            let velocity = motions.at(0).velocity;
            rates.fixed_rows_mut::<3>(0).copy_from(&velocity.at(motions.at(0).center));
            rates.fixed_rows_mut::<3>(3).copy_from(&velocity.angular);
        }
        rates.rows_mut(root, model.joint_count()).copy_from_slice(&state.velocities);
        tree.forward_kinematics(&world.bodies, false);
        tree.update_rigid_bodies(&mut world.bodies, true);
    }
    Ok(Built { world, bodies, tree })
}

/// Fails with the first thing that the plan asks for and rapier does not do.
fn refuse(model: &Model, plan: &StepPlan) -> Result<(), Unsupported> {
    let moving = !model.fixed_base || model.joint_count() > 0;
    let feedforward = plan.drive.as_ref().map_or(Feedforward::None, |drive| drive.feedforward);
    let offset = plan.drive.as_ref().is_some_and(|drive| drive.offset.iter().any(|torque| *torque != 0.0));
    let pyramid = plan.accuracy.friction_cone == FrictionCone::Pyramid;
    let corrected = plan.ground.is_some() || plan.limits.is_some();
    for (asked, answer) in [
        (!model.loops.is_empty(), Unsupported::Missing("joints that close loops as they are done here")),
        (plan.self_collision, Unsupported::Missing("self-collision as it is done here")),
        (!plan.obstacles.is_empty(), Unsupported::Missing("obstacles as they are done here")),
        (matches!(plan.ground, Some(Terrain::Field(_))), Unsupported::Missing("this ground")),
        (plan.trunk_rotation_lock, Unsupported::Missing("lock of the root's rotation")),
        (plan.contact_time_constant.is_some(), Unsupported::Missing("contacts as soft as they are here")),
        (feedforward != Feedforward::None, Unsupported::Missing("feedforward torque in its motors")),
        (offset, Unsupported::Missing("offset torque in its motors")),
        (plan.surfaces.has_grains(), Unsupported::Missing("friction that depends on the direction")),
        (pyramid && plan.friction.is_some(), Unsupported::Missing("friction pyramid for multibodies")),
        (plan.accuracy.step_tolerance.is_some(), Unsupported::Missing("control of a step's error")),
        (moving && !plan.velocity_forces, Unsupported::Inseparable("velocity-dependent forces")),
        (corrected && !plan.stabilization, Unsupported::Inseparable("the correction of penetration")),
    ] {
        if asked {
            return Err(answer);
        }
    }
    Ok(())
}

/// Origin of rapier's frame of a body, in the body frame, m: the root's is its centre of mass.
fn frame_offset(model: &Model, body: usize) -> Vector3<f64> {
    if body == 0 { model.bodies[0].center } else { Vector3::zeros() }
}

fn mass_properties(model: &Model, index: usize) -> MassProperties {
    let body = &model.bodies[index];
    let [x, y, z] = [0, 1, 2].map(|column| vector(body.inertia.column(column).into()));
    let center = vector(body.center - frame_offset(model, index));
    MassProperties::with_inertia_matrix(center, body.mass, Matrix::from_cols(x, y, z))
}

/// The joint that carries body `index`, along x of frames that are rotated so that x is its axis.
fn joint(model: &Model, plan: &StepPlan, index: usize) -> GenericJoint {
    let body = &model.bodies[index];
    let locked = match body.dof {
        DofKind::Revolute => JointAxesMask::LOCKED_REVOLUTE_AXES,
        DofKind::Prismatic => JointAxesMask::LOCKED_PRISMATIC_AXES,
    };
    let to_axis = Rotation::from_rotation_arc(Vector::X, vector(body.axis));
    let offset = body.offset - frame_offset(model, body.parent);
    let mut joint = GenericJointBuilder::new(locked)
        .local_frame1(Pose::from_parts(vector(offset), rotation_of(&body.joint_rotation) * to_axis))
        .local_frame2(Pose::from_rotation(to_axis))
        .build();
    let range = plan.limits.as_ref().map_or(UNLIMITED, |limits| limits[index - 1]);
    if range != UNLIMITED {
        joint.set_limits(axis(body.dof), range);
    }
    joint
}

/// Adds the ground and the character's collision shapes, which collide with the ground alone.
fn add_colliders(
    world: &mut PhysicsWorld,
    model: &Model,
    plan: &StepPlan,
    bodies: &[RigidBodyHandle],
) -> Result<(), Unsupported> {
    let Some(Terrain::Plane { height }) = plan.ground else { return Ok(()) };
    let finish = |shape: ColliderBuilder, own: Group, other: Group, material: PairMaterial| -> Collider {
        shape
            .density(0.0)
            .friction(plan.friction.map_or(0.0, |_| material.friction))
            .friction_combine_rule(CoefficientCombineRule::Min)
            .restitution(plan.restitution.map_or(0.0, |_| material.restitution))
            .restitution_combine_rule(CoefficientCombineRule::Max)
            .collision_groups(InteractionGroups::new(own, other, InteractionTestMode::And))
            .build()
    };
    let (of_ground, of_character) = (Group::GROUP_1, Group::GROUP_2);
    let plane = ColliderBuilder::new(SharedShape::halfspace(Vector::Z)).translation(Vector::Z * height);
    world.colliders.insert(finish(plane, of_ground, of_character, plan.surfaces.ground));
    let materials = model.links.iter().zip(&plan.surfaces.links);
    for (link, (place, material)) in model.character.links.iter().zip(materials) {
        if model.fixed_base && place.body == 0 {
            continue;
        }
        for placed in &link.collisions {
            let mut at = place.pose * placed.pose;
            at.translation.vector -= frame_offset(model, place.body);
            let shape = solid(&placed.shape).ok_or_else(|| Unsupported::Flat(link.name.clone()))?;
            let collider = ColliderBuilder::new(shape).position(pose(&at) * upright(&placed.shape));
            let collider = finish(collider, of_character, of_ground, *material);
            world.colliders.insert_with_parent(collider, bodies[place.body], &mut world.bodies);
        }
    }
    Ok(())
}

/// The shape as rapier has it; `None` if it has no volume.
fn solid(shape: &Shape) -> Option<SharedShape> {
    Some(match shape {
        Shape::Sphere { radius } => SharedShape::ball(*radius),
        Shape::Box { half_extents: half } => SharedShape::cuboid(half.x, half.y, half.z),
        Shape::Cylinder { radius, half_length } => SharedShape::cylinder(*half_length, *radius),
        Shape::Capsule { radius, half_length } => SharedShape::capsule_z(*half_length, *radius),
        Shape::Hull { vertices, .. } => {
            let points: Vec<Vector> = vertices.iter().map(|vertex| vector(vertex.coords)).collect();
            SharedShape::convex_hull(&points)?
        }
    })
}

/// The rotation from rapier's cylinder, whose axis is y, to ours, whose axis is z.
fn upright(shape: &Shape) -> Pose {
    match shape {
        Shape::Cylinder { .. } => Pose::from_rotation(Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2)),
        _ => Pose::IDENTITY,
    }
}
