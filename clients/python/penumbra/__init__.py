"""A client of penumbra, the daemon that renders glTF scenes with soft shadows.

    with penumbra.Client("http://127.0.0.1:8080") as client:
        client.upload("scene.glb").render(technique="pcss", width=800).save("picture.png")

Needs nothing but Python's own library. Types of requests and answers are in `penumbra.types`.
"""
from . import _types as types
from ._events import Event
from ._types import VERSION as __version__
from .client import Client
from .errors import (Busy, DeadlinePassed, Denied, Invalid, JobFailed, NotFound, PenumbraError,
                     Problem, Unreachable)
from .jobs import Frame, Job
from .pictures import Compared, Comparison, Picture
from .scene import Scene

__all__ = ["Busy", "Client", "Compared", "Comparison", "DeadlinePassed", "Denied", "Event", "Frame",
           "Invalid", "Job", "JobFailed", "NotFound", "PenumbraError", "Picture", "Problem",
           "Scene", "Unreachable", "__version__", "types"]
