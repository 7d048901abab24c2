"""The scene of `benches/step.rs` in MuJoCo: steps a second on one core, default solver.

    pip install mujoco
    python benches/peers/step.py path/to/a1.urdf [--pose JOINT=ANGLE ...] [--height H]

A free root is added, the robot stands on a plane with friction 0.8, position servos sway by 0.05 rad at 1 Hz
about the pose. Only contacts with the ground are computed. Timings are the best of several rounds.
"""

import argparse
import json
import math
import re
import time
import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np

STEPS = 1000
STEP = 0.002


def load(path, stiffness, damping):
    """The robot with a free root on a plane, contacts with the ground only, and servos."""
    text = re.sub(r"<visual>.*?</visual>", "", open(path).read(), flags=re.S)
    root = ElementTree.fromstring(text)
    extra = ElementTree.SubElement(root, "mujoco")
    ElementTree.SubElement(
        extra, "compiler", discardvisual="true", fusestatic="true", balanceinertia="true", strippath="true"
    )
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    spec.option.timestep = STEP
    spec.worldbody.first_body().add_freejoint()
    # Bits keep the robot's shapes from touching each other: they meet the ground alone.
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = 1, 2
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[50, 50, 1], friction=[0.8, 0.005, 0.0001], contype=2, conaffinity=1
    )
    for joint in spec.joints:
        if joint.type == mujoco.mjtJoint.mjJNT_FREE:
            continue
        actuator = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=stiffness, kv=damping)
    return spec.compile()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("urdf")
    parser.add_argument("--check", help="output of `gaitwright check`, for its standing pose and height")
    parser.add_argument("--stiffness", type=float, default=60.0)
    parser.add_argument("--damping", type=float, default=2.0)
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    model = load(options.urdf, options.stiffness, options.damping)
    data = mujoco.MjData(model)
    pose, height = {}, 0.35
    if options.check:
        standing = json.load(open(options.check))["standing"]
        pose, height = standing["joints"], standing["root_height"]
    names = [model.actuator(index).name for index in range(model.nu)]
    rest = np.array([pose.get(name, 0.0) for name in names])
    sways = np.array([index % 3 != 0 for index in range(model.nu)], dtype=float)
    targets = [rest + 0.05 * math.sin(2 * math.pi * index * STEP) * sways for index in range(STEPS)]
    best, contacts = math.inf, 0
    for _ in range(options.rounds):
        mujoco.mj_resetData(model, data)
        data.qpos[2] = height
        for name, angle in zip(names, rest):
            data.qpos[model.joint(name).qposadr[0]] = angle
        contacts, elapsed = 0, 0.0
        for target in targets:
            data.ctrl[:] = target
            started = time.perf_counter()
            mujoco.mj_step(model, data)
            elapsed += time.perf_counter() - started
            contacts += data.ncon
        best = min(best, elapsed)
    print(
        f"mujoco {mujoco.__version__}: {STEPS / best:.0f} steps/s, {contacts / STEPS:.2f} contacts, "
        f"{model.nv} degrees of freedom, mass {sum(model.body_mass):.3f} kg, root at {data.qpos[2]:.3f} m in the end"
    )


if __name__ == "__main__":
    main()
