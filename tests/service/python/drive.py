"""Everything that the client can do, against a service: `drive.py ADDRESS CHARACTER FOLDER`."""

import json
import struct
import sys
from pathlib import Path

from gaitwright_client import Client, Problem, arrays, numpy

address, character, folder = sys.argv[1:]
client = Client(address)


def refused(status, act):
    try:
        act()
    except Problem as problem:
        assert problem.status == status == problem.document["status"], (problem.status, problem.document)
        return problem
    raise AssertionError(f"{status} was expected")


# A character, and what is wrong with others.
found = client.check(character)
assert found["name"] == "quadruped" and len(found["joints"]) == 12, found
assert client.check(Path(character).read_bytes())["id"] == found["id"]
problem = refused(422, lambda: client.check(b'{"name": "nothing", "links": 3}'))
assert problem.errors and all(fault["pointer"] and fault["detail"] for fault in problem.errors), problem.document
assert problem.errors[0]["detail"] in str(problem)
problem = refused(422, lambda: client.submit(character, task={"gait": "wave"}, learning={"population": -1}))
assert problem.errors[0]["pointer"].startswith("/"), problem.document
refused(404, lambda: client.job("01890000-0000-7000-8000-000000000000"))

# A job, once however often it is sent.
wanted = {"task": {"gait": "trot", "speed": 0.9}, "learning": {"generations": 12}, "seed": 7}
job = client.submit({"id": found["id"]}, key="a-trot", **wanted)
assert job["state"] in ("queued", "running") and job["seed"] == 7, job
assert client.submit({"id": found["id"]}, key="a-trot", **wanted)["id"] == job["id"]
waiting = client.submit(character, task={"gait": "walk"})
assert waiting["id"] != job["id"] and waiting["task"]["gait"] == "walk", waiting
refused(409, lambda: client.motion(waiting))
assert [other["id"] for other in client.jobs()] == [waiting["id"], job["id"]]
client.cancel(waiting)
assert client.wait(waiting)["state"] == "cancelled"
client.delete(waiting)
refused(404, lambda: client.job(waiting))

# Followed from the first generation to the end, also by who comes late.
generations = []
job = client.wait(job, generations.append)
assert job["state"] == "succeeded", job
assert [figures["generation"] for figures in generations] == list(range(12)), generations
kinds = [kind for kind, _ in client.events(job["id"])]
assert kinds == ["generation"] * 12 + ["end"], kinds
assert len(client.curve(job)["points"]) == 12

# Its motions.
repertoire = client.repertoire(job)
[entry] = repertoire["motions"]
assert repertoire["motion"] == entry["number"] == 1
motion = client.motion(job)
assert motion["format"] == "gaitwright/motion@1" and "preliminary" not in motion
assert motion == client.motion(job, number=1)
assert client.gait(job)["format"] == "gaitwright/gait@1"
assert client.gait(job, number=1)["feet"]
assert client.report(job)["format"].startswith("gaitwright/")
loop = arrays(motion)
assert len(loop["time"]) == len(loop["velocities"]) == len(motion["keyframes"])
assert [len(row) for row in loop["angles"]] == [12] * len(loop["time"])
assert {len(row) for row in loop["root_orientation"]} == {4}
assert len(loop["poses"]["time"]) == len(loop["poses"]["root_position"]) > 2
if numpy:
    assert loop["angles"].shape == (len(motion["keyframes"]), 12)

# Its files.
glb = client.export(job, "glb", fps=30)
assert struct.unpack("<4sII", glb[:12]) == (b"glTF", 2, len(glb))
gaits = client.export_repertoire(job, in_place=True)
assert b"_in_place" in gaits and struct.unpack("<4sII", gaits[:12]) == (b"glTF", 2, len(gaits))
assert client.export(job, "bvh", number=1, in_place=True).startswith(b"HIERARCHY")
rows = lambda fps: client.export(job, "csv", fps=fps).count(b"\nloop,")
assert rows(100) > 1.5 * rows(50) > 3
assert b"joint_names" in client.export(job, "ros")
assert b"<mujoco" in client.export(job, "mujoco")
problem = refused(422, lambda: client.export(job, "csv", fps=0))
assert problem.document["pointer"] == "fps", problem.document
client.recording(job, f"{folder}/job.rrd")
assert Path(folder, "job.rrd").read_bytes()[:3] == b"RRF"
json.dumps(motion)
print("done")
