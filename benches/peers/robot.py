"""A robot in MuJoCo as gaitwright simulates it: free root, servos, contact with the ground, and with itself if so asked."""

import pathlib
import re
import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np


def load(path, gains, ground=True, friction=0.8, itself=False):
    """Compiles the robot at `path`: a URDF, or a model that `gaitwright export --format mujoco` wrote.

    `gains` are the servos' stiffness, damping and greatest torque, each a number or {joint: number}, the last `None`
    or with `None` where the torque is not bounded; `gains` of `None` leave the joints passive. With `itself` the robot can
    touch itself, in all pairs but those that MuJoCo leaves out by itself.
    """
    spec = exported(str(path)) if pathlib.Path(path).suffix == ".xml" else from_urdf(str(path))
    # Bits keep the robot's shapes from touching each other: they meet the ground alone.
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = (1, 3 if itself else 2) if ground else (0, 0)
    if ground:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[50, 50, 1],
            friction=[friction, 0.005, 0.0001],
            contype=2,
            conaffinity=1,
        )
        # Of two coefficients the greater holds; the shapes' own must not be it.
        for geom in spec.geoms:
            geom.friction = [friction, 0.005, 0.0001]
    if gains is not None:
        for joint in spec.joints:
            if joint.type == mujoco.mjtJoint.mjJNT_FREE:
                continue
            stiffness, damping, torque = (each[joint.name] if isinstance(each, dict) else each for each in gains)
            actuator = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
            actuator.set_to_position(kp=stiffness, kv=damping)
            if torque is not None:
                actuator.forcelimited = True
                actuator.forcerange = [-torque, torque]
    return spec.compile()


def exported(path):
    """The robot of an exported model, without the motion's actuators and keys and without its ground."""
    spec = mujoco.MjSpec.from_file(path)
    for part in [*spec.keys, *spec.actuators, *spec.worldbody.geoms]:
        spec.delete(part)
    for geom in spec.geoms:
        geom.priority = 0
    return spec


def from_urdf(path):
    """The robot of a URDF, its root free."""
    text = re.sub(r"<visual>.*?</visual>", "", open(path).read(), flags=re.S)
    root = ElementTree.fromstring(text)
    for inertia in root.iter("inertia"):
        # Dummy links have matrices that MuJoCo refuses; without their products they are sound, and as small.
        ixx, ixy, ixz, iyy, iyz, izz = (float(inertia.get(key, 0)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
        if np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]).min() <= 1e-12 * ixx:
            inertia.attrib.update(ixy="0", ixz="0", iyz="0")
    extra = ElementTree.SubElement(root, "mujoco")
    ElementTree.SubElement(
        extra,
        "compiler",
        discardvisual="true",
        fusestatic="true",
        balanceinertia="true",
        strippath="true",
        # Links without a mass have none, as they have in ROS; MuJoCo would weigh their shapes.
        inertiafromgeom="false",
    )
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    spec.worldbody.first_body().add_freejoint()
    return spec


def joints(model):
    """Names of the movable joints but the root's, in MuJoCo's order."""
    return [model.joint(index).name for index in range(1, model.njnt)]


def place(model, data, pose, height):
    """Puts the robot at rest: joints at `pose` ({joint: rad}, others 0), the root upright at `height` m."""
    mujoco.mj_resetData(model, data)
    data.qpos[2] = height
    for name in joints(model):
        data.qpos[model.joint(name).qposadr[0]] = pose.get(name, 0.0)


def start(model, data, line):
    """Puts the robot in the state of a line of `gaitwright simulate`."""
    mujoco.mj_resetData(model, data)
    root = line["root"]
    data.qpos[:3], data.qpos[3:7] = root["position"], root["orientation"]
    data.qvel[:3] = root["linear_velocity"]
    # The angular velocity of a free joint is along the body's own axes.
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, data.qpos[3:7])
    data.qvel[3:6] = turn.reshape(3, 3).T @ root["angular_velocity"]
    for name, joint in line["joints"].items():
        data.qpos[model.joint(name).qposadr[0]] = joint["angle"]
        data.qvel[model.joint(name).dofadr[0]] = joint["velocity"]


def solver_residual(model, data):
    """How far the solver was from the solution of its own, softened problem in the last step, m/s over its rows.

    MuJoCo minimises over the acceleration a; the gradient g = M (a - a_smooth) - J^T f is what its solver left. The
    step times J M^-1 g is what that leaves in the velocities of the rows.
    """
    if data.nefc == 0:
        return 0.0
    inertial = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, inertial, data.qacc)
    gradient = inertial - data.qfrc_smooth - data.qfrc_constraint
    acceleration = np.zeros((1, model.nv))
    mujoco.mj_solveM(model, data, acceleration, gradient[None, :])
    rows = np.zeros(data.nefc)
    mujoco.mj_mulJacVec(model, data, rows, acceleration[0])
    return float(model.opt.timestep * np.abs(rows).max())


def contact_residual(model, data):
    """How far the last step's contacts were from the laws of rigid contact and of Coulomb, m/s.

    The natural map that gaitwright's own residual is made of, on the velocities w after the step and the forces f at
    the contacts that touch: |min(a f, w)| of a normal, and of the tangents |a f - P(a f - w)|, where P projects onto the
    disc of radius a mu f_n and a = h (J M^-1 J^T) turns a force into a velocity.
    """
    worst = 0.0
    jacobian, force = np.zeros((3, model.nv)), np.zeros(6)
    for index in range(data.ncon):
        contact = data.contact[index]
        if contact.dist > 0:
            continue
        body = max(model.geom_bodyid[geom] for geom in contact.geom)
        mujoco.mj_jac(model, data, jacobian, None, contact.pos, body)
        rows = contact.frame.reshape(3, 3) @ jacobian
        if model.geom_bodyid[contact.geom[1]] != body:
            rows = -rows
        mujoco.mj_contactForce(model, data, index, force)
        solved = np.zeros_like(rows)
        mujoco.mj_solveM(model, data, solved, rows)
        scale = model.opt.timestep * np.einsum("ij,ij->i", rows, solved)
        velocity = rows @ data.qvel
        worst = max(worst, abs(min(scale[0] * force[0], velocity[0])))
        a = scale[1:].max()
        aim = a * force[1:3] - velocity[1:]
        reach, radius = np.linalg.norm(aim), a * contact.friction[0] * max(force[0], 0.0)
        nearest = aim if reach <= radius else aim * (radius / reach)
        worst = max(worst, float(np.linalg.norm(a * force[1:3] - nearest)))
    return worst


def depth(data):
    """Deepest penetration of the present contacts, m."""
    return max([0.0] + [-data.contact[index].dist for index in range(data.ncon)])
