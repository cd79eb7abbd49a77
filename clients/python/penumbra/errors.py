"""What can go wrong, as exceptions; all are a PenumbraError."""


class PenumbraError(Exception):
    """The base of all errors of this package."""


class Unreachable(PenumbraError, ConnectionError):
    """No answer: nobody listens there, the connection broke, or nothing came within `timeout`."""


class Problem(PenumbraError):
    """The service's answer was an error (RFC 9457).

    status: the HTTP status. title, detail: what is wrong, in words. pointer: RFC 6901 pointer to
    the key of the request that is wrong, or "". retryable: the same request may succeed later.
    retry_after: seconds after which, or None. request_id: its name in the service's log, or "".
    document: all members as they came.
    """

    def __init__(self, status, document, retry_after=None):
        self.status = status
        self.document = document
        self.title = document.get("title") or "Error"
        self.detail = document.get("detail") or ""
        self.pointer = document.get("pointer") or ""
        self.retryable = bool(document.get("retryable"))
        self.request_id = document.get("request_id") or ""
        self.retry_after = retry_after
        super().__init__("%s (%d): %s%s" % (self.title, status, self.detail,
                                            " [at %s]" % self.pointer if self.pointer else ""))

    def __reduce__(self):
        return make_problem, (self.status, self.document, self.retry_after)


class Invalid(Problem):
    """The request cannot be done as it is: 400, 406, 413, 415, 422."""


class Denied(Problem):
    """The token is missing or wrong, or may not do this: 401, 403."""


class NotFound(Problem):
    """There is no such scene, image, method, job or frame (any more): 404."""


class Busy(Problem):
    """Full, draining, or the caller's share is used up, still so after all retries: 429, 503."""


class DeadlinePassed(Problem):
    """The request was not done by its deadline_ms: 504."""


class JobFailed(PenumbraError):
    """A job ended without success.

    job: the Job. problem: a Problem that says why, or None when it was cancelled.
    """

    def __init__(self, job, problem=None):
        self.job, self.problem = job, problem
        super().__init__("Job %s: %s" % (job.id[:12], problem or "cancelled"))


KINDS = {400: Invalid, 406: Invalid, 413: Invalid, 415: Invalid, 422: Invalid, 401: Denied,
         403: Denied, 404: NotFound, 429: Busy, 503: Busy, 504: DeadlinePassed}


def make_problem(status, document, retry_after=None):
    return KINDS.get(status, Problem)(status, document, retry_after)
