"""Jobs: renders, comparisons and sequences that go on when nobody waits."""
import time
from typing import Any, Iterator, NamedTuple, Optional

from . import _types as types
from ._events import Event, follow
from .errors import JobFailed, NotFound, PenumbraError, make_problem
from .pictures import Comparison, Picture

OVER = ("successful", "failed", "dismissed")
FIRST_PAUSE_S, MOST_PAUSE_S = 0.1, 2.0
MOST_MISSES = 8  # frames that are not there, before one waits for more


class Frame(NamedTuple):
    """number: from 0 on. picture: of the job's frame. done, total: how far the job is."""
    number: int
    picture: Picture
    done: int
    total: int


def is_last(event):
    return event.kind == "state" and event.data["state"] in OVER


class Job:
    """A job of the service. info: what was last heard of it (types.Job)."""

    def __init__(self, client, info):
        self.client = client
        self.info: "types.Job" = info

    @property
    def id(self) -> str:
        return self.info["id"]

    @property
    def state(self) -> "types.JobState":
        """accepted, running, successful, failed or dismissed (cancelled), when last heard of."""
        return self.info["state"]

    @property
    def progress(self) -> float:
        """From 0 to 1, when last heard of."""
        return self.info["progress"]

    def __repr__(self):
        return "<Job %s %s %s %.0f %%>" % (self.id[:12], self.info["kind"], self.state,
                                           100 * self.progress)

    @property
    def path(self) -> str:
        return "/v1/jobs/" + self.id

    def refresh(self) -> "Job":
        """Asks how far it is."""
        self.info = self.client._http.get(self.path)
        return self

    def events(self, last_id: str = "") -> Iterator[Event]:
        """What becomes of it, as it happens, until it is over; goes on by itself where a connection
        broke off. kind "state": data is the job (types.Job); "frame": its `frame`, `bytes`, `href`,
        `done`, `total`. last_id: the id of an event, after which it begins."""
        # Something comes at least every fifteen seconds.
        for event in follow(self.client._http, self.path + "/events", last_id, 15.0, is_last):
            if event.kind == "state":
                self.info = event.data
            yield event

    def frame(self, number: int) -> Picture:
        """One of its pictures, from 0 on. NotFound while it is not there."""
        return self.client._picture(self.path + "/frames/%d" % number)

    def frame_request(self, number: int) -> "types.RenderRequest":
        """The request whose picture a frame is."""
        return self.client._http.get(self.path + "/frames/%d" % number)

    def frames(self) -> Iterator[Frame]:
        """Each picture as soon as it is there, in the order in which they are done. A broken
        connection does not end it: it is taken up again, and where events do not come through the
        job is asked now and then. Raises JobFailed when the job ends without success."""
        given = set()
        try:
            for event in self.events():
                if event.kind == "frame" and event.data["frame"] not in given:
                    given.add(event.data["frame"])
                    yield Frame(event.data["frame"], self.frame(event.data["frame"]),
                                event.data["done"], event.data["total"])
        except NotFound:
            raise
        except PenumbraError:
            yield from self._poll(given)
        self.check()

    def _poll(self, given):
        pause = FIRST_PAUSE_S
        while True:
            self.refresh()
            over = self.state in OVER
            count, misses = self.info["frames"], 0
            for number in range(count["total"]):
                if len(given) >= count["done"] or (misses >= MOST_MISSES and not over):
                    break
                if number in given:
                    continue
                try:
                    picture = self.frame(number)
                except NotFound:
                    misses += 1
                    continue
                given.add(number)
                pause = FIRST_PAUSE_S
                yield Frame(number, picture, len(given), count["total"])
            if over:
                return
            time.sleep(pause)
            pause = min(MOST_PAUSE_S, pause * 2)

    def check(self) -> "Job":
        """JobFailed when it is over without success."""
        if self.state in ("failed", "dismissed"):
            error = self.info.get("error")
            raise JobFailed(self, make_problem(error["status"], error) if error else None)
        return self

    def wait(self, timeout: Optional[float] = None) -> "Job":
        """Returns when it is over; JobFailed when it has failed or was cancelled, TimeoutError
        after `timeout` seconds, in which it goes on."""
        end = None if timeout is None else time.monotonic() + timeout
        pause = FIRST_PAUSE_S
        while self.refresh().state not in OVER:
            left = pause if end is None else min(pause, end - time.monotonic())
            if left <= 0:
                raise TimeoutError("job %s is still %s" % (self.id[:12], self.state))
            time.sleep(left)
            pause = min(MOST_PAUSE_S, pause * 1.5)
        return self.check()

    def result(self, timeout: Optional[float] = None) -> Any:
        """Waits, and returns what it made: a Picture, a Comparison, or of a sequence the bytes of
        its archive (zip; an animated WebP is a Picture; None with archive="none")."""
        link = self.wait(timeout).info["links"].get("result")
        if link is None:
            return None
        answer = self.client._http.call("GET", link, headers={"Accept": "*/*"})
        if answer.type == "application/json":
            return Comparison(self.client._picture, answer.json())
        if answer.type.startswith("image/"):
            return Picture(answer.body, answer.type)
        return answer.body

    def cancel(self) -> "Job":
        """Ends it, if it is not over; what is done of it stays. (One that ends by itself just
        before is removed: NotFound from then on.)"""
        if self.refresh().state not in OVER:
            answer = self.client._http.call("DELETE", self.path)
            if answer.status != 204:
                self.info = answer.json()
        return self

    def delete(self) -> None:
        """Removes it with all its files, cancelling it first."""
        while self.client._http.call("DELETE", self.path, accepted=(404,)).status == 200:
            time.sleep(FIRST_PAUSE_S)  # it is being cancelled
