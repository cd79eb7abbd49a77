"""A stored scene, and what can be asked of it."""
import json
import secrets
from typing import Any, List, Optional, Sequence

from . import _types as types
from ._calls import SceneCalls
from ._events import parse
from ._http import BROKEN
from .errors import NotFound, PenumbraError, Unreachable, make_problem
from .jobs import Job
from .pictures import Comparison, Picture

KEEP: Any = object()  # what was not given stays as it is

# When nothing was said; a test holds it against the OpenAPI document.
DEADLINE_MS = 30000


def body_of(values):
    """The request's body, of {path: value}; None was not given."""
    body = {}
    for path, value in values.items():
        if value is None or path == ("technique", "params"):
            continue
        place = body
        for key in path[:-1]:
            place = place.setdefault(key, {})
        place[path[-1]] = value
    params = values.get(("technique", "params"))
    if params is not None:
        technique = body.get("technique")
        if technique is None:
            raise ValueError("params are a method's: which one does `technique` say")
        technique = dict(technique) if isinstance(technique, dict) else {"name": technique}
        body["technique"] = {**technique, "params": {**technique.get("params", {}), **params}}
    return body


def silence_of(body):
    """How long an answer may take besides what any may."""
    return (body.get("deadline_ms") or DEADLINE_MS) / 1000


class Scene(SceneCalls):
    """A scene of the service. info: its description (types.Scene): triangles, bounds in metres,
    cameras, lights, animations, variants, warnings and more."""

    def __init__(self, client, info):
        self.client = client
        self.info: "types.Scene" = info

    @property
    def id(self) -> str:
        """The SHA-256 of its bytes, in hex."""
        return self.info["id"]

    @property
    def name(self) -> str:
        """What it is called; "" when nobody said."""
        return self.info["name"]

    @property
    def tags(self) -> List[str]:
        """Words that it is found by; see Client.scenes."""
        return list(self.info["tags"])

    @property
    def warnings(self) -> List[str]:
        """What of the file is not shown as it says, in words."""
        return list(self.info["warnings"])

    def __repr__(self):
        called = " %r" % self.name if self.name else ""
        return "<Scene %s%s, %d triangles>" % (self.id[:12], called, self.info["triangles"])

    def __eq__(self, other):
        return isinstance(other, Scene) and self.id == other.id

    def __hash__(self):
        return hash(self.id)

    def refresh(self) -> "Scene":
        """Asks for its description again. NotFound when it was removed."""
        self.info = self.client._http.get(self._path())
        return self

    def change(self, *, name: Optional[str] = KEEP,
               tags: Optional[Sequence[str]] = KEEP) -> "Scene":
        """Changes its name, or its tags to these; None: it has none any more. Denied when the scene
        is somebody else's, Invalid for what cannot be."""
        given = {"name": name, "tags": tags if tags is KEEP or tags is None else list(tags)}
        changes = {key: value for key, value in given.items() if value is not KEEP}
        self.info = self.client._http.call(
            "PATCH", self._path(), json.dumps(changes).encode(),
            {"Content-Type": "application/json"}).json()
        return self

    def thumbnail(self) -> Picture:
        """A small picture (JPEG) of it, which the service makes once and keeps."""
        return self.client._picture(self._path("/thumbnail"))

    def delete(self) -> None:
        """Removes it from the service, for everybody. Denied when it is somebody else's."""
        self.client._http.call("DELETE", self._path(), accepted=(404,))

    # ---- what _calls.py calls ----

    def _path(self, call=""):
        return "/v1/scenes/" + self.id + call

    def _post(self, path, body, **headers):
        headers = {"Content-Type": "application/json",
                   **{key.replace("_", "-"): value for key, value in headers.items()}}
        return self.client._http.call("POST", path, json.dumps(body).encode(), headers, (),
                                      silence_of(body))

    def _render(self, values):
        body = body_of(values)
        if body.get("session") or body.get("budget_ms") or body.get("on_deadline") == "best":
            # Such a picture is nobody else's, and only the stream of parts has a link to it.
            for picture in self._parts(body):
                pass
            return picture
        record = self._post(self._path("/render"), body).json()
        try:
            if "href" in record["image"]:
                return self.client._picture(record["image"]["href"], record)
        except NotFound:
            pass  # the service keeps none, or no longer
        answer = self._post(self._path("/render"), body, Accept="*/*")
        return Picture(answer.body, answer.type, record)

    def _progressive(self, values):
        return self._parts(body_of(values))

    def _parts(self, body):
        headers = {"Content-Type": "application/json", "Accept": "text/event-stream"}
        response, close = self.client._http.stream(
            "POST", self._path("/render"), json.dumps(body).encode(), headers, silence_of(body))
        try:
            for event in parse(response):
                if isinstance(event, float):
                    continue
                if event.kind == "problem":
                    raise make_problem(event.data.get("status", 500), event.data)
                picture = self._part(event)
                if picture:
                    yield picture
                if event.kind == "done":
                    return
        except PenumbraError:
            raise
        except BROKEN as error:
            raise self.client._http.unreachable(error) from error
        finally:
            close()
        raise Unreachable("the answer broke off before its last picture")

    def _part(self, event):
        record, final = event.data, event.kind == "done"
        try:
            return self.client._picture(record["image"]["href"], record, final)
        except (NotFound, KeyError):
            if final:
                raise PenumbraError("the service did not keep the picture") from None
            return None  # a better one has taken its place

    def _job(self, path, body):
        answer = self._post(path, body, Prefer="respond-async",
                            Idempotency_Key=secrets.token_hex(16))
        if answer.status != 202:
            raise PenumbraError("a request of this kind (auto, a session) cannot be a job: what it "
                                "gives depends on when it is asked")
        return Job(self.client, answer.json())

    def _render_job(self, values):
        return self._job(self._path("/render"), body_of(values))

    def _compare_job(self, values):
        return self._job(self._path("/compare"), body_of(values))

    def _sequence(self, values):
        body = body_of(values)
        return self._job("/v1/jobs", {"scene": self.id, **body,
                                      "sequence": body.get("sequence", {})})

    def _compare(self, values):
        answer = self._post(self._path("/compare"), body_of(values))
        return Comparison(self.client._picture, answer.json())
