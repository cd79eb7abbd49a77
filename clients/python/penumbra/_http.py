"""Calls over kept connections: which are tried again, when, and how often."""
import email.utils
import http.client
import json
import random
import socket
import threading
import time
import urllib.parse

from ._types import VERSION
from .errors import PenumbraError, Problem, Unreachable, make_problem

FIRST_PAUSE_S, MOST_PAUSE_S = 0.25, 8.0
# What a service or a proxy before it says when it cannot take a request now.
NOT_NOW = (408, 429, 502, 503)
BROKEN = (OSError, http.client.HTTPException)
KEPT = 8  # connections that wait for the next call


class Answer:
    def __init__(self, response, body):
        self.status, self.headers, self.body = response.status, response.headers, body

    @property
    def type(self):
        return self.headers.get("Content-Type", "").partition(";")[0].strip()

    def json(self):
        try:
            return json.loads(self.body)
        except ValueError:
            raise PenumbraError("the answer is not JSON: %.80r" % self.body) from None


def seconds_of(text):
    """Retry-After: seconds or a date; None for anything else."""
    try:
        return max(0.0, float(text))
    except (TypeError, ValueError):
        pass
    try:
        return max(0.0, email.utils.parsedate_to_datetime(text).timestamp() - time.time())
    except (TypeError, ValueError):
        return None


def problem_of(answer):
    try:
        document = json.loads(answer.body)
    except ValueError:
        document = None
    if not isinstance(document, dict):
        text = answer.body[:200].decode("utf-8", "replace")
        document = {"title": http.client.responses.get(answer.status, "Error"), "detail": text,
                    "retryable": answer.status in NOT_NOW}
    return make_problem(answer.status, document, seconds_of(answer.headers.get("Retry-After")))


class Http:
    """Any number of threads may call; each call has a connection for itself while it lasts."""

    def __init__(self, url, token, timeout, retries, retry_for, ssl_context):
        if token and not (token.isascii() and token.isprintable() and " " not in token):
            raise ValueError("the token is not printable ASCII without blanks")
        parts = urllib.parse.urlsplit(url if "://" in url else "http://" + url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.query:
            raise ValueError("not the address of a service: %r" % url)
        self.scheme, self.host, self.port = parts.scheme, parts.hostname, parts.port
        self.prefix = parts.path.rstrip("/")
        self.url = "%s://%s%s" % (parts.scheme, parts.netloc, self.prefix)
        self.token, self.timeout, self.ssl_context = token, timeout, ssl_context
        self.retries, self.retry_for = retries, retry_for
        self.idle, self.lock, self.closed = [], threading.Lock(), False

    # ---- connections ----

    def connect(self):
        if self.scheme == "https":
            return http.client.HTTPSConnection(self.host, self.port, timeout=self.timeout,
                                               context=self.ssl_context)
        return http.client.HTTPConnection(self.host, self.port, timeout=self.timeout)

    def take(self, fresh):
        with self.lock:
            if self.closed:
                raise PenumbraError("the client is closed")
            if self.idle and not fresh:
                return self.idle.pop()
        return self.connect()

    def give(self, connection, response):
        with self.lock:
            if not response.will_close and not self.closed and len(self.idle) < KEPT:
                self.idle.append(connection)
                return
        connection.close()

    def close(self):
        with self.lock:
            self.closed, idle, self.idle = True, self.idle, []
        for connection in idle:
            connection.close()

    # ---- one call ----

    def target(self, link):
        """The path of a link in an answer, or of a call, behind the address of the service."""
        parts = urllib.parse.urlsplit(link)
        path = parts.path
        if self.prefix and path != self.prefix and not path.startswith(self.prefix + "/"):
            path = self.prefix + path
        return path + ("?" + parts.query if parts.query else "")

    def send(self, connection, method, link, body, headers, silence):
        """Sends a request and returns the response's head."""
        if connection.sock is None:
            connection.connect()
            connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # A socket refuses a time that is too long.
        connection.sock.settimeout(
            None if self.timeout is None else min(self.timeout + silence, 1e6))
        head = {"User-Agent": "penumbra-python/" + VERSION, "Accept": "application/json", **headers}
        if self.token:
            head["Authorization"] = "Bearer " + self.token
        try:
            connection.request(method, self.target(link), body() if callable(body) else body, head)
        except (BrokenPipeError, ConnectionResetError):
            pass  # it may have refused what it had not read to the end, and said why
        return connection.getresponse()

    def open(self, method, link, body=None, headers=None, silence=0.0):
        """(connection, response), with all that a kept connection may need: it may have ended."""
        connection = self.take(False)
        kept = connection.sock is not None
        while True:
            try:
                return connection, self.send(connection, method, link, body, headers or {}, silence)
            except BROKEN as error:
                connection.close()
                if not kept or isinstance(error, socket.timeout):
                    raise
            except BaseException:
                connection.close()
                raise
            connection, kept = self.take(True), False

    def attempt(self, *call):
        connection, response = self.open(*call)
        try:
            answer = Answer(response, response.read())
        except BaseException:
            connection.close()
            raise
        self.give(connection, response)
        return answer

    # ---- again ----

    def unreachable(self, error):
        if isinstance(error, socket.timeout):
            return Unreachable("nothing came from %s in time" % self.url)
        return Unreachable("no answer from %s: %s" % (self.url, error or type(error).__name__))

    def again(self, call):
        """Calls until it succeeds, as long as that makes sense; raises the last error."""
        end = time.monotonic() + self.retry_for
        for tries in range(self.retries + 1):
            pause = min(MOST_PAUSE_S, FIRST_PAUSE_S * 2.0 ** min(tries, 16))
            pause *= random.uniform(0.5, 1.0)
            try:
                return call()
            except Problem as error:
                if error.status not in NOT_NOW or not error.retryable:
                    raise
                if error.retry_after is not None:  # later than that: not all at once
                    pause += error.retry_after
                failure = error
            except PenumbraError:
                raise
            except BROKEN as error:
                failure = self.unreachable(error)
                failure.__cause__ = error
            if tries == self.retries or time.monotonic() + pause > end:
                raise failure
            time.sleep(pause)

    def call(self, method, link, body=None, headers=None, accepted=(), silence=0.0):
        """The answer, when its status is below 400 or one of `accepted`."""
        def once():
            answer = self.attempt(method, link, body, headers, silence)
            if answer.status >= 400 and answer.status not in accepted:
                raise problem_of(answer)
            return answer
        return self.again(once)

    def get(self, link):
        return self.call("GET", link).json()

    def stream(self, method, link, body=None, headers=None, silence=0.0, again=True):
        """(response, close) of an answer that goes on; `close` must be called."""
        def once():
            connection, response = self.open(method, link, body, headers, silence)
            if response.status < 400:
                return response, connection.close
            try:
                answer = Answer(response, response.read())
            finally:
                connection.close()
            raise problem_of(answer)
        return self.again(once) if again else once()
