"""The service against its description: schemathesis asks it whatever the description allows, and what it does not.

    python tests/contract/run.py PROGRAM [SECONDS]

PROGRAM is the program under test. First come the examples and the bounds of every call, then for SECONDS (60) whatever is
allowed, and from answers with ids on to the calls that take them, then the results of a job that has succeeded. Needs schemathesis (PyPI) beside this python.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request

HERE = pathlib.Path(__file__).parent
ROOT = HERE.parents[1]
TOKEN = "correct-horse-battery-staple"

# How long a job may wait or run before it is cancelled, s: whatever follows it then ends.
LONGEST = 2


class Service:
    """A service on a folder of its own."""

    def __init__(self, program, folder):
        environment = {**os.environ, "GAITWRIGHT_TOKEN": TOKEN}
        arguments = ["serve", "--listen", "127.0.0.1:0", "--data", f"{folder}/data", "--queue", "100000"]
        self.process = subprocess.Popen(
            [program, *arguments, "--request-rate", "0"], stderr=subprocess.PIPE, text=True, env=environment
        )
        for line in self.process.stderr:
            if line.startswith("listening on "):
                self.base = line.removeprefix("listening on ").strip()
                break
        else:
            sys.exit("the service did not start")
        self.log = []
        threading.Thread(target=lambda: self.log.extend(self.process.stderr), daemon=True).start()

    def ask(self, path, body=None, method=None):
        data = None if body is None else json.dumps(body).encode()
        headers = {"authorization": f"Bearer {TOKEN}", "content-type": "application/json"}
        request = urllib.request.Request(self.base + path, data=data, headers=headers, method=method)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.loads(answer.read() or b"null")

    def succeed(self):
        """The id of a job that has succeeded."""
        urdf = (ROOT / "examples/quadruped.urdf").read_text()
        job = self.ask("/v1/jobs", {
            "character": {"urdf": urdf}, "task": {"speed": 0.9}, "seed": 7,
            "learning": {"generations": 12, "gait_generations": 12}})
        while job["state"] in ("queued", "running"):
            time.sleep(0.5)
            job = self.ask(f"/v1/jobs/{job['id']}")
        assert job["state"] == "succeeded", job
        return job["id"]

    def cancel_old_jobs(self):
        """Cancels whatever has been there for a while, again and again."""
        seen = {}
        while True:
            time.sleep(0.5)
            try:
                for state in ("running", "queued"):
                    for job in self.ask(f"/v1/jobs?limit=200&state={state}")["jobs"]:
                        if time.monotonic() - seen.setdefault(job["id"], time.monotonic()) > LONGEST:
                            self.ask(f"/v1/jobs/{job['id']}/cancel", method="POST")
            except urllib.error.HTTPError:
                pass  # it has ended by itself, or somebody was faster
            except OSError:
                return


def check(service, folder, name, settings, *arguments):
    """Runs schemathesis; whether it found nothing."""
    config = pathlib.Path(folder) / f"{name}.toml"
    config.write_text(settings + (HERE / "schemathesis.toml").read_text().replace("hooks.py", str(HERE / "hooks.py")))
    program = str(pathlib.Path(sys.executable).with_name("st"))
    command = [
        program, "--config-file", str(config), "run", f"{service.base}/openapi.json", "--checks", "all",
        "--header", f"Authorization: Bearer {TOKEN}", "--request-timeout", "120", "--seed", "1", *arguments,
    ]
    return subprocess.run(command, cwd=folder).returncode == 0


def main():
    program, seconds = os.path.abspath(sys.argv[1]), (sys.argv[2:] or ["60"])[0]
    with tempfile.TemporaryDirectory() as folder:
        service = Service(program, folder)
        try:
            job = service.succeed()
            threading.Thread(target=service.cancel_old_jobs, daemon=True).start()
            bounds = check(service, folder, "bounds", "", "--phases", "examples,coverage")
            anything = check(
                service, folder, "anything", "", "--phases", "fuzzing,stateful", "--max-time", seconds)
            results = check(
                service, folder, "results", f'parameters = {{ "path.id" = "{job}", "path.motion" = "1" }}\n',
                "--phases", "coverage,fuzzing", "--max-time", seconds, "--exclude-method", "DELETE",
                "--exclude-method", "POST", "--include-path-regex", r"^/v1/jobs/\{id\}")
            alive = service.process.poll() is None
        finally:
            service.process.kill()
        panics = [line for line in service.log if "panicked" in line]
        if not (bounds and anything and results and alive and not panics):
            sys.exit("\n".join(["the service does not do what it describes", *panics]))


main()
