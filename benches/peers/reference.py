"""Writes the numbers in tests/reference: the motion of the bundled characters as Pinocchio computes it.

    pip install pin
    python benches/peers/reference.py            # writes tests/reference/*.json
    python benches/peers/reference.py --check    # computes all again and compares

Pinocchio is needed here alone: the tests read the files. The states are drawn from a fixed seed, so that a second run gives
the same files up to rounding. Inertias are taken as they are in the document, without rotor inertia, joint damping, dry
friction, contact or limits; gravity is 9.81 m/s² downward. A character document (JSON) is turned into a URDF here, by formulas
of this file's own, so that a mistake in the program's reader would show as a difference. What the files hold is described
in tests/reference/README.md.
"""

import argparse
import json
import math
import pathlib
import random
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tests" / "reference"

# File in tests/reference, character in examples, and whether its root link is fixed to the world.
CHARACTERS = [
    ("quadruped", "quadruped.urdf", False),
    ("biped", "biped.urdf", False),
    ("hexapod", "hexapod.json", False),
    ("snake", "snake.json", False),
    ("snake-fixed", "snake.json", True),
]
SEED = 20260
STATES = 6
GRAVITY = 9.81
DURATION, STEP = 0.5, 2e-5
# Differences of a second run that count as rounding: of a number, and of the largest number of its kind. Half a second of
# motion multiplies the rounding of its 25,000 steps.
TOLERANCE = {"random_states": 1e-12, "passive_half_second": 1e-10}


def rotation(rpy):
    """The rotation matrix of roll, pitch and yaw about fixed axes, as in URDF."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def solid(shape):
    """Volume (m³) of a shape and its inertia over its mass (m²) about its centre, along its own axes."""
    kind = shape["kind"]
    if kind == "box":
        x, y, z = shape["size"]
        return x * y * z, np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) / 12.0
    r = shape["radius"]
    if kind == "sphere":
        return 4.0 / 3.0 * math.pi * r**3, np.eye(3) * 0.4 * r * r
    if kind != "capsule":
        raise ValueError(f"no formula for a {kind}")
    # A cylinder along z and two half balls, whose centres of mass are 3/8 r outside of its ends.
    h = shape["length"]
    cylinder, ball = math.pi * r * r * h, 4.0 / 3.0 * math.pi * r**3
    across = cylinder * (r * r / 4 + h * h / 12) + ball * (0.4 * r * r + h * h / 4 + 3 / 8 * h * r)
    along = cylinder * r * r / 2 + ball * 0.4 * r * r
    volume = cylinder + ball
    return volume, np.diag([across, across, along]) / volume


def inertial(link):
    """Mass, centre of mass and inertia about it of a link whose shapes are filled at its density."""
    pieces = []
    for shape in link["shapes"]:
        pose = shape.get("pose", {})
        turn = rotation(pose.get("rpy", [0.0, 0.0, 0.0]))
        volume, inertia = solid(shape)
        mass = link["density"] * volume
        pieces.append((mass, np.array(pose.get("position", [0.0, 0.0, 0.0]), dtype=float), mass * turn @ inertia @ turn.T))
    mass = sum(piece[0] for piece in pieces)
    center = sum(piece[0] * piece[1] for piece in pieces) / mass
    inertia = np.zeros((3, 3))
    for piece, place, own in pieces:
        arm = place - center
        inertia += own + piece * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, center, inertia


def numbers(values):
    return " ".join(repr(float(value)) for value in values)


def urdf_of(document):
    """The character document as the text of a URDF with the same links and joints; shapes are left out."""
    robot = ElementTree.Element("robot", name=document["name"])
    for link in document["links"]:
        mass, center, inertia = inertial(link)
        element = ElementTree.SubElement(ElementTree.SubElement(robot, "link", name=link["name"]), "inertial")
        ElementTree.SubElement(element, "origin", xyz=numbers(center))
        ElementTree.SubElement(element, "mass", value=repr(float(mass)))
        axes = {a + b: repr(float(inertia[i, j])) for i, a in enumerate("xyz") for j, b in enumerate("xyz") if i <= j}
        ElementTree.SubElement(element, "inertia", {"i" + name: value for name, value in axes.items()})
    for joint in document["joints"]:
        if joint["kind"] != "revolute":
            raise ValueError(f"{joint['name']} is {joint['kind']}: only revolute joints are turned into URDF here")
        element = ElementTree.SubElement(robot, "joint", name=joint["name"], type=joint["kind"])
        ElementTree.SubElement(element, "parent", link=joint["parent"])
        ElementTree.SubElement(element, "child", link=joint["child"])
        origin = joint.get("origin", {})
        rpy = origin.get("rpy", [0.0, 0.0, 0.0])
        ElementTree.SubElement(element, "origin", xyz=numbers(origin.get("position", [0, 0, 0])), rpy=numbers(rpy))
        ElementTree.SubElement(element, "axis", xyz=numbers(joint["axis"]))
        limits, motor = joint["limits"], joint["actuation"]
        ElementTree.SubElement(
            element,
            "limit",
            lower=repr(limits["lower"]),
            upper=repr(limits["upper"]),
            effort=repr(motor["max_torque"]),
            velocity=repr(motor["max_speed"]),
        )
    return ElementTree.tostring(robot, encoding="unicode")


class Character:
    """A character in Pinocchio. Its state is a vector y: root position (world, m), orientation (quaternion w, x, y, z),
    joint angles, then the root's linear and angular velocity along its own axes, then joint velocities. A character whose
    root is fixed has angles and velocities alone."""

    def __init__(self, path, fixed):
        text = path.read_text()
        if path.suffix == ".json":
            text = urdf_of(json.loads(text))
        root = () if fixed else (pinocchio.JointModelFreeFlyer(),)
        self.model = pinocchio.buildModelFromXML(text, *root)
        self.model.gravity = pinocchio.Motion(np.array([0.0, 0.0, -GRAVITY]), np.zeros(3))
        self.model.armature[:] = 0.0
        self.data = self.model.createData()
        self.fixed = fixed
        first = 1 if fixed else 2
        self.joints = list(self.model.names)[first:]
        self.root_positions, self.root_velocities = (0, 0) if fixed else (7, 6)
        assert self.model.nq - self.root_positions == len(self.joints), "every joint has one coordinate"

    def configuration(self, y):
        """Pinocchio's own coordinates and velocities; its quaternion is x, y, z, w and of length one."""
        q, v = y[: self.model.nq].copy(), y[self.model.nq :]
        if not self.fixed:
            q[3:7] = np.roll(q[3:7], -1) / np.linalg.norm(q[3:7])
        return q, v

    def acceleration(self, y, torque):
        """Change of the velocities in y, for torques of the joints, N m."""
        q, v = self.configuration(y)
        return pinocchio.aba(self.model, self.data, q, v, np.concatenate([np.zeros(self.root_velocities), torque]))

    def rate(self, y, torque):
        """dy/dt."""
        _, v = self.configuration(y)
        positions = v.copy()
        if not self.fixed:
            w, vector = y[3], y[4:7]
            turn = pinocchio.Quaternion(*(y[3:7] / np.linalg.norm(y[3:7]))).matrix()
            quaternion = 0.5 * np.concatenate([[-vector @ v[3:6]], w * v[3:6] + np.cross(vector, v[3:6])])
            positions = np.concatenate([turn @ v[:3], quaternion, v[6:]])
        return np.concatenate([positions, self.acceleration(y, torque)])

    def passive(self, y):
        """The state after half a second without torque, by the classical Runge-Kutta method of fourth order."""
        torque = np.zeros(len(self.joints))
        for _ in range(round(DURATION / STEP)):
            first = self.rate(y, torque)
            second = self.rate(y + 0.5 * STEP * first, torque)
            third = self.rate(y + 0.5 * STEP * second, torque)
            fourth = self.rate(y + STEP * third, torque)
            y = y + STEP / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)
            if not self.fixed:
                y[3:7] /= np.linalg.norm(y[3:7])
        return y

    def draw(self, rng, speed):
        """A random state; joints anywhere within their limits, velocities of about `speed` (m/s, rad/s)."""
        def normal(count, size):
            return [rng.gauss(0.0, size) for _ in range(count)]

        root = []
        if not self.fixed:
            orientation = np.array(normal(4, 1.0))
            root = [*normal(2, 0.5), 1.0 + rng.random(), *(orientation / np.linalg.norm(orientation))]
        lower, upper = self.model.lowerPositionLimit, self.model.upperPositionLimit
        angles = [rng.uniform(lower[index], upper[index]) for index in range(self.root_positions, self.model.nq)]
        return np.array([*root, *angles, *normal(self.model.nv, speed)])

    def root(self, y, torque):
        """The root link's motion in the world frame. `linear_acceleration` is the second derivative of its position."""
        v, a = y[self.model.nq :][:6], self.acceleration(y, torque)[:6]
        turn = pinocchio.Quaternion(*y[3:7]).matrix()
        return {
            "position": list(y[:3]),
            "orientation_wxyz": list(y[3:7]),
            "linear_velocity": list(turn @ v[:3]),
            "angular_velocity": list(turn @ v[3:]),
            "linear_acceleration": list(turn @ (a[:3] + np.cross(v[3:], v[:3]))),
            "angular_acceleration": list(turn @ a[3:]),
        }

    def by_joint(self, values):
        return dict(zip(self.joints, values, strict=True))

    def random_state(self, y, torque):
        q, v = self.configuration(y)
        acceleration = self.acceleration(y, torque)
        joints = zip(q[self.root_positions :], v[self.root_velocities :], acceleration[self.root_velocities :], torque)
        names = ("angle", "velocity", "acceleration", "torque")
        state = {} if self.fixed else {"root": self.root(y, torque)}
        state["joints"] = self.by_joint([dict(zip(names, map(float, joint))) for joint in joints])
        state["mass"] = pinocchio.computeTotalMass(self.model)
        state["center_of_mass"] = list(pinocchio.centerOfMass(self.model, self.data, q))
        state["kinetic_energy"] = pinocchio.computeKineticEnergy(self.model, self.data, q, v)
        state["potential_energy"] = pinocchio.computePotentialEnergy(self.model, self.data, q)
        diagonal = np.diag(pinocchio.crba(self.model, self.data, q))[self.root_velocities :]
        state["joint_inertia_diagonal"] = self.by_joint(map(float, diagonal))
        return state

    def passive_state(self, y):
        torque = np.zeros(len(self.joints))
        q, v = self.configuration(y)
        acceleration = self.acceleration(y, torque)
        joints = zip(q[self.root_positions :], v[self.root_velocities :], acceleration[self.root_velocities :])
        state = {} if self.fixed else {"root": self.root(y, torque)}
        state["joints"] = self.by_joint([list(map(float, joint)) for joint in joints])
        return state


def reference(name, example, fixed):
    """Everything that a file of tests/reference holds."""
    character = Character(ROOT / "examples" / example, fixed)
    # `random` of the standard library keeps its sequences from version to version.
    rng = random.Random(f"{SEED} {name}")
    states = []
    for _ in range(STATES):
        y = character.draw(rng, 1.0)
        torque = np.array([rng.uniform(-1.0, 1.0) for _ in character.joints])
        states.append(character.random_state(y, torque))
    start = character.draw(rng, 0.5)
    return {
        "character": f"examples/{example}",
        "fixed_base": fixed,
        "made_by": f"benches/peers/reference.py with Pinocchio {pinocchio.__version__}",
        "joint_order": character.joints,
        "random_states": states,
        "passive_half_second": {
            "start": character.passive_state(start),
            "end": character.passive_state(character.passive(start)),
        },
    }


def leaves(value, path=()):
    """Every number and string of a document, with its path."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, (*path, key))
    elif isinstance(value, (list, tuple)):
        for index, inner in enumerate(value):
            yield from leaves(inner, (*path, index))
    else:
        yield path, value


def differences(kept, made):
    """What differs by more than rounding, as lines of text."""
    kept, made = dict(leaves(kept)), dict(leaves(made))
    for path in kept.keys() ^ made.keys():
        yield f"{path} is in one of both alone"
    for path in kept.keys() & made.keys():
        old, new = kept[path], made[path]
        if isinstance(old, float) and isinstance(new, float):
            # An acceleration near zero is a difference of large ones: relative to the largest of its state.
            state = path[:2]
            scale = max(1.0, max(abs(it) for at, it in kept.items() if at[:2] == state and isinstance(it, float)))
            if not abs(old - new) <= TOLERANCE[path[0]] * scale:
                yield f"{path}: {old!r} kept, {new!r} computed"
        elif old != new and path != ("made_by",):
            yield f"{path}: {old!r} kept, {new!r} computed"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare with the files instead of writing them")
    check = parser.parse_args().check
    failed = False
    for name, example, fixed in CHARACTERS:
        path, made = FOLDER / f"{name}.json", reference(name, example, fixed)
        if not check:
            path.write_text(json.dumps(made, indent=1) + "\n")
            print(f"wrote {path.relative_to(ROOT)}")
            continue
        found = sorted(differences(json.loads(path.read_text()), made))
        print(f"{path.relative_to(ROOT)}: {f'{len(found)} differences' if found else 'the same to rounding'}")
        for line in found[:10]:
            print(f"    {line}")
        failed |= bool(found)
    sys.exit(failed)


if __name__ == "__main__":
    main()
