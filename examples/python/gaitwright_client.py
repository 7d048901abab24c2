#!/usr/bin/env python3
"""A client of the gaitwright service, with the standard library alone (and numpy arrays where numpy is there).

    client = Client("http://127.0.0.1:8080")
    job = client.submit("quadruped.urdf", task={"gait": "trot"}, learning={"seconds": 60})
    job = client.wait(job, on_generation=lambda figures: print(figures["generation"], figures["best"]))
    motion = client.motion(job)                    # the motion document
    loop = arrays(motion)                          # its keyframes as arrays
    open("trot.glb", "wb").write(client.export(job, "glb"))

As a program it does the same for a character file: `gaitwright_client.py CHARACTER --out DIR`.
"""

import argparse
import json
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
import uuid
from pathlib import Path

try:
    import numpy
except ImportError:
    numpy = None

#: States in which nothing more happens to a job by itself.
FINAL = ("succeeded", "failed", "cancelled")

#: The ending of the files of each form in which a motion can be had.
EXTENSIONS = {"glb": "glb", "bvh": "bvh", "csv": "csv", "ros": "yaml", "mujoco": "xml"}

#: How often a stream of events that breaks off is taken up again before the client gives up.
RECONNECTIONS = 5


class Problem(Exception):
    """The service refused. `status` is the HTTP status, `document` the problem document (RFC 9457), and `errors` its
    faults, each with `pointer` and `detail`."""

    def __init__(self, status, document):
        self.status = status
        self.document = document
        self.errors = document.get("errors", [])
        faults = [f"{fault['pointer']}: {fault['detail']}" if fault["pointer"] else fault["detail"] for fault in self.errors]
        super().__init__(f"{status} {document.get('title', '')}: " + ("; ".join(faults) or document.get("detail", "")))


class Client:
    """A service at `address`; `token` is what it was started with where it wants one, `timeout` the longest silence, s."""

    def __init__(self, address="http://127.0.0.1:8080", token=None, timeout=120.0):
        self.address = address.rstrip("/")
        self.headers = {"Authorization": f"Bearer {token}"} if token else {}
        self.timeout = timeout

    # Characters and jobs

    def check(self, character):
        """Has a character (a path, or bytes of URDF, JSON or zip) checked and kept. Its `id` serves in `submit`."""
        body, kind = _form({"character": _contents(character)})
        return self._json("POST", "/v1/characters", body, {"Content-Type": kind})

    def submit(self, character, *, key=None, **wanted):
        """Queues a job for a character: a path, bytes, or `{"id": …}`. `wanted` are the fields of the job document: `task`,
        `learning`, `scene`, `accuracy`, `seed`, `priority`. With a `key` the same request can be sent again and is the same job."""
        headers = {"Idempotency-Key": key} if key else {}
        if isinstance(character, dict):
            body, kind = json.dumps({"character": character, **wanted}).encode(), "application/json"
        else:
            body, kind = _form({"character": _contents(character), "job": json.dumps(wanted).encode()})
        return self._json("POST", "/v1/jobs", body, {"Content-Type": kind, **headers})

    def job(self, job):
        """The job as it is now. Here and below a job is its document or its id."""
        return self._json("GET", _place(job))

    def jobs(self, state=None):
        """All jobs, the newest first; those in one state where it is given."""
        path = "/v1/jobs?limit=200" + (f"&state={state}" if state else "")
        while path:
            page = self._json("GET", path)
            yield from page["jobs"]
            path = page["next"]

    def cancel(self, job):
        return self._json("POST", _place(job) + "/cancel")

    def retry(self, job):
        return self._json("POST", _place(job) + "/retry")

    def delete(self, job):
        self._bytes("DELETE", _place(job))

    # Following

    def events(self, job):
        """The events of a job as pairs of kind and document: `state`, `generation` for every generation from the first
        on, `progress` in between, and `end`, the last. A stream that breaks off is taken up again where it was."""
        last, broken = None, 0
        while True:
            headers = {"Accept": "text/event-stream", **({"Last-Event-ID": last} if last else {})}
            try:
                with self._open("GET", _place(job) + "/events", None, headers) as stream:
                    for kind, number, document in _events(stream):
                        last, broken = number or last, 0
                        yield kind, document
                        if kind == "end":
                            return
                cause = ConnectionError("the stream of events ended before the job")
            except OSError as error:
                cause = error
            broken += 1
            if broken > RECONNECTIONS:
                raise cause
            time.sleep(min(0.2 * 2**broken, 5.0))

    def wait(self, job, on_generation=None):
        """Follows a job to its end, and gives it as it then is. `on_generation` is called with every generation's figures."""
        for kind, document in self.events(job):
            if kind == "generation" and on_generation:
                on_generation(document)
            if kind == "end":
                return document

    # Results

    def repertoire(self, job, preliminary=False):
        """Every motion of a job in figures: `motions`, and the number `motion` of the one that is the job's."""
        return self._json("GET", _place(job) + "/motions" + _query(preliminary=preliminary))

    def motion(self, job, number=None, preliminary=False):
        """A motion document: that of the job, or the one of the repertoire with this number. `preliminary` takes what there
        is of a job that has not ended."""
        return self._json("GET", _place(job) + _motion(number) + _query(preliminary=preliminary))

    def gait(self, job, number=None, preliminary=False):
        """The gait report of a motion."""
        place = "/gait" if number is None else f"/motions/{number}/gait"
        return self._json("GET", _place(job) + place + _query(preliminary=preliminary))

    def curve(self, job):
        """The learning curve so far."""
        return self._json("GET", _place(job) + "/curve")

    def report(self, job, preliminary=False):
        """Everything about a job; `preliminary` takes what there is of one that has not ended."""
        return self._json("GET", _place(job) + "/report" + _query(preliminary=preliminary))

    def export(self, job, form, number=None, fps=None, in_place=False):
        """The bytes of a motion in another form: `glb`, `bvh`, `csv`, `ros` or `mujoco`."""
        if form not in EXTENSIONS:
            raise ValueError(f"unknown form {form!r}, expected one of {', '.join(EXTENSIONS)}")
        query = _query(fps=fps, in_place=in_place)
        return self._bytes("GET", f"{_place(job)}{_motion(number)}.{EXTENSIONS[form]}{query}")

    def export_repertoire(self, job, fps=None, in_place=False):
        """The bytes of one glTF binary with all motions of a job."""
        query = _query(fps=fps, in_place=in_place)
        return self._bytes("GET", f"{_place(job)}/motions.glb{query}")

    def recording(self, job, path):
        """Writes the recording for the Rerun viewer into a file; of a running job, as it grows, until the job has ended. Raises
        `http.client.IncompleteRead` where the service ends before, or the job goes on in another recording."""
        with self._open("GET", _place(job) + "/recording.rrd") as stream, open(path, "wb") as file:
            while chunk := stream.read1(1 << 16):
                file.write(chunk)

    # The ways of HTTP

    def _open(self, method, path, body=None, headers=None):
        sent = {**self.headers, **(headers or {})}
        request = urllib.request.Request(self.address + path, data=body, headers=sent, method=method)
        try:
            return urllib.request.urlopen(request, timeout=self.timeout)
        except urllib.error.HTTPError as error:
            with error:
                text = error.read().decode("utf-8", "replace")
            try:
                document = json.loads(text)
            except ValueError:
                document = {}
            if not isinstance(document, dict):
                document = {}
            raise Problem(error.code, document or {"title": error.reason, "detail": text}) from None

    def _bytes(self, method, path, body=None, headers=None):
        with self._open(method, path, body, headers) as answer:
            return answer.read()

    def _json(self, method, path, body=None, headers=None):
        return json.loads(self._bytes(method, path, body, headers))


def arrays(motion):
    """The keyframes of a motion document as arrays: `time` (n), `angles` and `velocities` (n × joints, in the order of
    `motion["joints"]`), `root_position` (n × 3, m) and `root_orientation` (n × 4, w x y z). Of numpy where it is there,
    otherwise lists. With simulated poses in the document, `poses` holds the same of them, but for velocities."""

    def gather(frames, fields):
        columns = {name: [field(frame) for frame in frames] for name, field in fields.items()}
        return {name: numpy.array(column) for name, column in columns.items()} if numpy else columns

    fields = {
        "time": lambda frame: frame["time"],
        "angles": lambda frame: frame["angles"],
        "root_position": lambda frame: frame["root"]["position"],
        "root_orientation": lambda frame: frame["root"]["orientation"],
    }
    found = gather(motion["keyframes"], {**fields, "velocities": lambda frame: frame["velocities"]})
    if motion.get("poses"):
        found["poses"] = gather(motion["poses"], fields)
    return found


def _contents(character):
    return character if isinstance(character, bytes) else Path(character).read_bytes()


def _place(job):
    return f"/v1/jobs/{job if isinstance(job, str) else job['id']}"


def _motion(number):
    return "/motion" if number is None else f"/motions/{number}"


def _query(**fields):
    given = {name: str(value).lower() for name, value in fields.items() if value is not None and value is not False}
    return "?" + urllib.parse.urlencode(given) if given else ""


def _form(parts):
    """A multipart form, and its media type."""
    boundary = uuid.uuid4().hex
    body = b"".join(
        f'--{boundary}\r\nContent-Disposition: form-data; name="{name}"; filename="{name}"\r\n\r\n'.encode() + contents + b"\r\n"
        for name, contents in parts.items()
    )
    return body + f"--{boundary}--\r\n".encode(), f"multipart/form-data; boundary={boundary}"


def _events(stream):
    """Kind, id and document of every server-sent event of a stream."""
    fields = {}
    for line in stream:
        name, _, value = line.decode().rstrip("\r\n").partition(":")
        if name:
            fields[name] = value.removeprefix(" ")
        elif "data" in fields:
            yield fields.get("event", "message"), fields.get("id"), json.loads(fields["data"])
            fields = {}


def main():
    parser = argparse.ArgumentParser(description="Teaches a character through the gaitwright service.")
    parser.add_argument("character", type=Path, help="URDF, character JSON, or zip of a URDF with its meshes")
    parser.add_argument("--out", type=Path, required=True, help="folder for the motions and the recording")
    parser.add_argument("--job", type=Path, help="job document: task, learning, scene, accuracy, seed")
    parser.add_argument("--form", action="append", default=[], choices=EXTENSIONS, help="export every motion so as well")
    parser.add_argument("--address", default="http://127.0.0.1:8080")
    parser.add_argument("--token")
    arguments = parser.parse_args()
    client = Client(arguments.address, arguments.token)
    wanted = json.loads(arguments.job.read_text()) if arguments.job else {}
    wanted.pop("format", None)
    job = client.submit(arguments.character, **wanted)
    print(f"{arguments.address}/#/jobs/{job['id']}", file=sys.stderr)
    show = lambda figures: print(f"generation {figures['generation']}: {figures['best']:.3f}", file=sys.stderr)
    job = client.wait(job, show)
    if job["state"] != "succeeded":
        sys.exit(f"the job {job['state']}: {job['error']}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    for entry in client.repertoire(job)["motions"]:
        stem = entry["file"].removesuffix(".json")
        (arguments.out / entry["file"]).write_text(json.dumps(client.motion(job, entry["number"])))
        for form in arguments.form:
            (arguments.out / f"{stem}.{EXTENSIONS[form]}").write_bytes(client.export(job, form, entry["number"]))
        print(f"{entry['name']}: {entry['metrics']['speed']:.2f} m/s, natural: {entry['metrics']['natural']}")
    client.recording(job, arguments.out / "recording.rrd")


if __name__ == "__main__":
    try:
        main()
    except (Problem, OSError) as error:
        sys.exit(f"gaitwright_client: {error}")
