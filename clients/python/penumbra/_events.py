"""Server-sent events, and how to go on where a connection broke off."""
import json
import time
from typing import Any, NamedTuple

from ._http import BROKEN
from .errors import PenumbraError, Problem

PAUSE_S = 1.0


class Event(NamedTuple):
    """id: of the event, "" without one. kind: its name. data: what it says, from JSON."""
    id: str
    kind: str
    data: Any


def parse(lines):
    """The events in a stream of lines, and numbers: the seconds to wait before coming again."""
    kind, data, identity = "message", [], ""
    for line in lines:
        line = line.decode("utf-8", "replace").rstrip("\r\n")
        key, _, value = line.partition(":")
        value = value[1:] if value.startswith(" ") else value
        if not line:
            if data:
                yield Event(identity, kind, json.loads("\n".join(data)))
            kind, data = "message", []
        elif key == "event":
            kind = value
        elif key == "data":
            data.append(value)
        elif key == "id":
            identity = value
        elif key == "retry" and value.isdigit():
            yield int(value) / 1000


def follow(http, link, last="", silence=0.0, over=lambda event: False):
    """The events of a stream that can be taken up again, until `over` says that one is the last, or
    the service that there are no more. Without any in `http.retries` connections: the error."""
    failures, pause = 0, PAUSE_S
    while True:
        close, failure = None, None
        try:
            headers = {"Accept": "text/event-stream", **({"Last-Event-ID": last} if last else {})}
            response, close = http.stream("GET", link, None, headers, silence, again=False)
            if response.status == 204:
                return
            for event in parse(response):
                if isinstance(event, float):
                    pause = event
                    continue
                last, failures = event.id or last, 0
                yield event
                if over(event):
                    return
        except BROKEN as error:
            failure = http.unreachable(error)
        except Problem as error:
            if not error.retryable:
                raise
            pause, failure = max(pause, error.retry_after or 0), error
        finally:
            if close:
                close()
        failures += 1
        if failures > http.retries:
            raise failure or PenumbraError("%s%s ends without an event" % (http.url, link))
        time.sleep(pause)
