"""A service, as its user sees it."""
import os
import urllib.parse
from typing import Any, Callable, Dict, Iterator, List, Optional

from . import _types as types
from ._events import follow
from ._http import Http
from ._upload import prepare
from .jobs import Job
from .pictures import Picture
from .scene import Scene

IMPORT_S = 300.0  # that the service may think about an upload
BEAT_S = 15.0


class Client:
    """A connection to a service.

    url: its address, which may have a path; left out: $PENUMBRA_SERVER, else
        http://127.0.0.1:8080.
    token: a bearer token; left out: $PENUMBRA_TOKEN, else none.
    timeout: seconds without a byte after which a call gives up (Unreachable); None: never. Calls
        that take long by their nature (deadline_ms, uploads) have that time besides.
    retries: how often a call is tried again that found nobody, or whose answer says that it may
        succeed later (429, 503). Retry-After is honoured; without it the pauses double, from a
        quarter of a second to eight, a random part shorter.
    retry_for: seconds after which no new attempt begins; an answer that asks for a longer wait is
        raised at once (Busy).
    ssl_context: for https, as of ssl.create_default_context().

    Threads may share a client: each call that is under way has a connection of its own, and
    connections are kept for the next. As a context manager it closes them. Every call is safe to be
    repeated, and a job that is started twice for a broken connection is one job.

    Calls raise a PenumbraError: Unreachable without an answer, else a Problem: Denied, Invalid,
    NotFound, Busy, DeadlinePassed.
    """

    def __init__(self, url: Optional[str] = None, token: Optional[str] = None, *,
                 timeout: Optional[float] = 60.0, retries: int = 4, retry_for: float = 60.0,
                 ssl_context: Any = None):
        url = url or os.environ.get("PENUMBRA_SERVER") or "http://127.0.0.1:8080"
        token = os.environ.get("PENUMBRA_TOKEN") if token is None else token
        self._http = Http(url, token, timeout, retries, retry_for, ssl_context)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def __repr__(self):
        return "<Client %s>" % self._http.url

    def close(self) -> None:
        """Closes the connections; calls from then on raise a PenumbraError."""
        self._http.close()

    # ---- scenes and images ----

    def upload(self, scene: Any, *, entry: str = "", name: str = "",
               progress: Optional[Callable[[int, int], None]] = None) -> Scene:
        """Uploads a scene unless the service has it, which its SHA-256 tells before.

        scene: the path of a .glb, a .zip or a .gltf, with which the files go that it names; a
            folder that holds one scene; bytes; a file opened in binary mode; or
            {name: path or bytes}.
        entry: which one, where there are several in a folder or zip; its path in there.
        name: what it is to be called; else as its file. A scene that has a name keeps it.
        progress: called with the bytes sent and all, while they go.

        Raises besides Problem (Invalid: what is wrong with the file) FileNotFoundError for what is
        not there, and ValueError for a folder without a scene, or with several and no `entry`.
        """
        return Scene(self, self._upload("/v1/scenes", scene, entry, progress, name))

    def upload_image(self, image: Any, *,
                     progress: Optional[Callable[[int, int], None]] = None) -> "types.ImageInfo":
        """Uploads a PNG, JPEG or WebP that lights emit, unless it is there: path, bytes or file.
        A light has it as {"type": "rect", "texture": {"image": info["id"]}}."""
        return self._upload("/v1/images", image, "", progress)

    def _upload(self, folder, thing, entry, progress, name=""):
        upload = prepare(thing, entry, name)
        # Who may upload may not always look.
        known = self._http.call("GET", folder + "/" + upload.id, accepted=(403, 404))
        if known.status == 200:
            return known.json()
        query = upload.query if folder == "/v1/scenes" else ""  # images have no names
        path = folder + ("/" + upload.id if upload.method == "PUT" else "") + query
        return self._http.call(
            upload.method, path, lambda: upload.told(progress),
            {"Content-Type": upload.type, "Content-Length": str(upload.size)}, (), IMPORT_S).json()

    def _pages(self, path, key):
        while path:
            page = self._http.get(path)
            yield from page[key]
            path = page.get("next")

    def scenes(self, name: str = "", tag: str = "") -> Iterator[Scene]:
        """The stored scenes, page after page as they are asked for; only those whose name has
        `name` in it, whatever its case, and with this tag, where one is given."""
        said = {key: value for key, value in (("name", name), ("tag", tag)) if value}
        path = "/v1/scenes" + ("?" + urllib.parse.urlencode(said) if said else "")
        return (Scene(self, info) for info in self._pages(path, "scenes"))

    def scene(self, id: str) -> Scene:
        """A stored scene, by its id or the first digits of it (at least six) that no other has.
        NotFound when there is none, a Problem of status 409 when there are several."""
        return Scene(self, self._get("/v1/scenes/", id))

    def images(self) -> Iterator["types.ImageInfo"]:
        """The stored images for lights."""
        return self._pages("/v1/images", "images")

    def image(self, id: str) -> "types.ImageInfo":
        """What a stored image is. NotFound when there is none."""
        return self._get("/v1/images/", id)

    def delete_image(self, id: str) -> None:
        """Removes a stored image."""
        self._http.call("DELETE", "/v1/images/" + urllib.parse.quote(id, safe=""), accepted=(404,))

    # ---- jobs ----

    def jobs(self, state: Optional["types.JobState"] = None) -> Iterator[Job]:
        """The caller's jobs, from the newest on; only those in a state, when one is given."""
        query = "?state=" + urllib.parse.quote(state) if state else ""
        return (Job(self, info) for info in self._pages("/v1/jobs" + query, "jobs"))

    def job(self, id: str) -> Job:
        """A job, by its id. NotFound when there is none (any more)."""
        return Job(self, self._get("/v1/jobs/", id))

    # ---- the service ----

    def service(self) -> "types.Service":
        """Version, device, limits, how many wait."""
        return self._http.get("/v1")

    def techniques(self) -> List["types.TechniqueInfo"]:
        """Every shadow method: title, citation, cost class, artefacts, and its parameters with
        default, range, unit and help."""
        return self._http.get("/v1/techniques")["techniques"]

    def technique(self, name: "types.TechniqueName") -> "types.TechniqueInfo":
        """One shadow method. NotFound when there is none of this name."""
        return self._get("/v1/techniques/", name)

    def stats(self) -> "types.Stats":
        """Rolling times per method and stage, in milliseconds."""
        return self._http.get("/v1/stats")

    def events(self) -> Iterator[Dict[str, Any]]:
        """What the service counts, once a second for as long as the loop goes on: `unix_s`,
        `recent` and `metrics`. Goes on when the service went and came back within
        `retries` attempts."""
        return (event.data for event in follow(self._http, "/v1/events", "", BEAT_S))

    def openapi(self) -> Dict[str, Any]:
        """The service's OpenAPI document."""
        return self._http.get("/openapi.json")

    # ---- of parts of this package ----

    def _get(self, folder, name):
        return self._http.get(folder + urllib.parse.quote(name, safe=""))

    def _picture(self, link, record=None, final=True):
        answer = self._http.call("GET", link, headers={"Accept": "*/*"})
        return Picture(answer.body, answer.type, record, final)
