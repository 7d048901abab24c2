"""The scene of `benches/step.rs` in MuJoCo: steps a second on one core, default solver.

    pip install mujoco
    python benches/peers/step.py path/to/a1.urdf [--check check.json]

A free root is added, the robot stands on a plane with friction 0.8, position servos sway by 0.05 rad at 1 Hz
about the pose. Only contacts with the ground are computed. Timings are the best of several rounds; contacts,
residual and penetration come from a round that is not timed.
"""

import argparse
import json
import math
import time

import mujoco
import numpy as np

import robot

STEPS = 1000
STEP = 0.002


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("urdf")
    parser.add_argument("--check", help="output of `gaitwright check`, for its standing pose and height")
    parser.add_argument("--stiffness", type=float, default=60.0)
    parser.add_argument("--damping", type=float, default=2.0)
    parser.add_argument("--rounds", type=int, default=15)
    options = parser.parse_args()
    model = robot.load(options.urdf, (options.stiffness, options.damping, None))
    model.opt.timestep = STEP
    data = mujoco.MjData(model)
    pose, height = {}, 0.35
    if options.check:
        standing = json.load(open(options.check))["standing"]
        pose, height = standing["joints"], standing["root_height"]
    rest = np.array([pose.get(name, 0.0) for name in robot.joints(model)])
    sways = np.array([index % 3 != 0 for index in range(model.nu)], dtype=float)
    targets = [rest + 0.05 * math.sin(2 * math.pi * index * STEP) * sways for index in range(STEPS)]

    best = math.inf
    for _ in range(options.rounds):
        robot.place(model, data, pose, height)
        elapsed = 0.0
        for target in targets:
            data.ctrl[:] = target
            started = time.perf_counter()
            mujoco.mj_step(model, data)
            elapsed += time.perf_counter() - started
        best = min(best, elapsed)

    robot.place(model, data, pose, height)
    contacts, solver, law, depth = 0, 0.0, [], 0.0
    for target in targets:
        data.ctrl[:] = target
        mujoco.mj_step(model, data)
        contacts += data.ncon
        solver = max(solver, robot.solver_residual(model, data))
        law.append(robot.contact_residual(model, data))
        depth = max(depth, robot.depth(data))
    print(
        f"mujoco {mujoco.__version__}: {STEPS / best:.0f} steps/s, {contacts / STEPS:.2f} contacts, {model.nv} degrees of "
        f"freedom, mass {sum(model.body_mass):.3f} kg, root at {data.qpos[2]:.3f} m in the end\n"
        f"residual of its own problem at most {solver:.1e} m/s, of rigid contact with friction median "
        f"{np.median(law):.1e} and at most {max(law):.1e} m/s, penetration at most {depth:.1e} m"
    )


if __name__ == "__main__":
    main()
