"""What tests of jobs share."""
import http.client
import json

import harness
from harness import wait

TINY = {"technique": {"name": "hard"}, "width": 24, "height": 16}
ASYNC = {"Content-Type": "application/json", "Prefer": "respond-async"}
OVER = ("successful", "failed", "dismissed")


def post(d, path, request, **headers):
    return d.call("POST", path, json.dumps(request),
                  {"Content-Type": "application/json",
                   **{k.replace("_", "-"): v for k, v in headers.items()}})


def start(d, scene, sequence, **request):
    answer = post(d, "/v1/jobs", {"scene": scene, **TINY, **request, "sequence": sequence})
    assert answer.status == 202, answer.body
    return answer.json()


def job(d, id):
    return d.get("/v1/jobs/" + id).json()


def ended(d, id):
    wait(lambda: job(d, id)["state"] in OVER, 120)
    return job(d, id)


def frame(d, id, number):
    answer = d.get("/v1/jobs/%s/frames/%d" % (id, number))
    assert answer.status == 200, answer.body
    return answer.body


def single(d, id, scene, number):
    """The picture of a frame's own request, rendered by itself and anew."""
    request = d.get("/v1/jobs/%s/frames/%d" % (id, number), Accept="application/json").json()
    answer = d.render(scene, {**request, "deadline_ms": 300000})
    assert answer.status == 200, answer.body
    return answer.body


class Events:
    """A connection to a job's events."""

    def __init__(self, d, id, last=None):
        self.connection = http.client.HTTPConnection("127.0.0.1", d.port,
                                                     timeout=60 * harness.PATIENCE)
        headers = {} if last is None else {"Last-Event-ID": str(last)}
        self.connection.request("GET", "/v1/jobs/%s/events" % id, None, headers)
        self.response = self.connection.getresponse()

    def __iter__(self):
        """(id, event, data) of each, until the stream ends."""
        event = {}
        try:
            for line in self.response:
                line = line.decode().rstrip("\n")
                if line.startswith(":"):
                    continue
                if line:
                    key, value = line.split(": ", 1)
                    event[key] = value
                elif "data" in event:
                    yield int(event["id"]), event["event"], json.loads(event["data"])
                    event = {}
        finally:
            self.close()

    def close(self):
        self.response.close()
        self.connection.close()
