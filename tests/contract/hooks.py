"""Bodies that are no JSON: no schema says what an archive is, and texts go as they are."""

import io
import json
import pathlib
import zipfile

import schemathesis
from hypothesis import strategies

ROOT = pathlib.Path(__file__).parents[2]
PADDLER = (ROOT / "tests/service/paddler.urdf").read_bytes()


def archive(urdf):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as files:
        files.writestr("robot.urdf", urdf)
    return packed.getvalue()


schemathesis.openapi.media_type("application/zip", strategies.sampled_from([archive(PADDLER)]))


@schemathesis.serializer("application/xml", "text/xml", "application/zip")
def plain(context, value):
    """Texts and bytes go as they are."""
    return value if isinstance(value, bytes) else str(value).encode(errors="surrogatepass")


@schemathesis.deserializer("application/jsonl")
def first_line(context, response):
    """The first line stands for all: each is described by the same schema."""
    return json.loads(response.content.split(b"\n")[0])


@schemathesis.deserializer("text/yaml", "text/x-yaml", "application/x-yaml", "text/vnd.yaml", "application/yaml")
def text(context, response):
    """YAML as text, by any of its names: its schema says no more, and a trajectory may be several documents in a row."""
    return response.text


@schemathesis.hook
def filter_case(context, case):
    """Headers that nobody knows are passed over, as HTTP has it."""
    return "x-schemathesis-unknown-property" not in (case.headers or {})
