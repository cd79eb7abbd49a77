"""Pictures and comparisons, as the service made them."""
import os
import tempfile
from typing import Any, Dict, Iterator, List, Optional, Union

from . import _types as types
from .errors import PenumbraError

ENDINGS = {"png": (".png",), "exr": (".exr",), "jpeg": (".jpg", ".jpeg"), "webp": (".webp",),
           "tiff": (".tif", ".tiff")}
TYPES = {"image/png": "png", "image/x-exr": "exr", "image/jpeg": "jpeg", "image/webp": "webp",
         "image/tiff": "tiff"}


class Picture:
    """An image file, and how it was made.

    bytes: the file. format: "png", "exr", "jpeg", "webp" or "tiff". record: the service's record of
    the render (types.Record), or None where there is none (a job's frames, maps of a comparison).
    final: False for those of progressive() that better ones follow.
    """

    def __init__(self, data: bytes, kind: str, record: "Optional[types.Record]" = None,
                 final: bool = True):
        if kind not in TYPES:
            raise PenumbraError("the answer is no image but %s" % (kind or "of no type"))
        self.bytes, self.format, self.record, self.final = data, TYPES[kind], record, final

    def __repr__(self):
        size = self.record["image"] if self.record else None
        return "<Picture %s%s, %d bytes>" % (
            self.format, " %d x %d" % (size["width"], size["height"]) if size else "",
            len(self.bytes))

    @property
    def warnings(self) -> List[str]:
        """What the method could not do, in words; [] without a record."""
        return list(self.record["warnings"]) if self.record else []

    @property
    def timings(self) -> Dict[str, Optional[float]]:
        """Milliseconds per stage; {} without a record. Of each pass: record["passes"]."""
        return {**self.record["stages_ms"]} if self.record else {}  # type: ignore

    @property
    def request(self) -> Dict[str, Any]:
        """The request as the service completed it; {} without a record."""
        return {**self.record["request"]} if self.record else {}

    def save(self, path: "Union[str, os.PathLike[str]]") -> str:
        """Writes the file, whole or not at all. ValueError when its name ends like another
        format's. Returns the path."""
        path = os.fspath(path)
        ending = os.path.splitext(path)[1].lower()
        others = [f for f, endings in ENDINGS.items() if ending in endings and f != self.format]
        if others:
            raise ValueError("the picture is %s: render it with format=%r for a file %s" % (
                self.format, others[0], ending))
        handle, temporary = tempfile.mkstemp(dir=os.path.dirname(path) or ".", prefix=".penumbra-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(self.bytes)
            mask = os.umask(0)
            os.umask(mask)
            os.chmod(temporary, 0o666 & ~mask)
            os.replace(temporary, path)
        except BaseException:
            os.unlink(temporary)
            raise
        return path

    def _repr_png_(self) -> Optional[bytes]:
        return self.bytes if self.format == "png" else None

    def _repr_jpeg_(self) -> Optional[bytes]:
        return self.bytes if self.format == "jpeg" else None

    def numpy(self) -> Any:
        """The pixels as a NumPy array, height x width x channels, as the file has them: uint8 or
        uint16 of PNG, JPEG, WebP and TIFF, floats (linear) of EXR. Needs NumPy, and one of
        OpenImageIO, imageio or, for EXR, OpenEXR that can read the format: ImportError without."""
        handle, path = tempfile.mkstemp(suffix=ENDINGS[self.format][0])
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(self.bytes)
            return read_pixels(path, self.format)
        finally:
            os.unlink(path)


def read_openimageio(path, kind):
    import OpenImageIO  # type: ignore
    image = OpenImageIO.ImageInput.open(path)
    if image is None:
        raise ValueError(OpenImageIO.geterror())
    try:
        return image.read_image(image.spec().format)
    finally:
        image.close()


def read_openexr(path, kind):
    import numpy
    import OpenEXR  # type: ignore
    if kind != "exr":
        raise ValueError("OpenEXR reads EXR only")
    with OpenEXR.File(path, separate_channels=True) as file:
        channels = file.channels()
        order = [name for name in "RGBAYZ" if name in channels] or sorted(channels)
        return numpy.stack([channels[name].pixels for name in order], axis=-1)


def read_imageio(path, kind):
    try:
        import imageio.v3 as imageio  # type: ignore
    except ImportError:  # before 2.16
        import imageio  # type: ignore
    return imageio.imread(path)


def read_pixels(path, kind):
    try:
        import numpy
    except ImportError:
        raise ImportError("numpy() needs NumPy: pip install numpy imageio") from None
    failures = []
    for reader in (read_openimageio, read_openexr, read_imageio):
        try:
            pixels = numpy.asarray(reader(path, kind))
            return pixels[:, :, None] if pixels.ndim == 2 else pixels
        except ImportError as error:
            failures.append(str(error))
        except Exception as error:  # of a reader that has no plugin for the format
            failures.append("%s: %.200s" % (reader.__name__[5:], error))
    raise ImportError("nothing here reads %s (%s): pip install %s" % (
        kind.upper(), "; ".join(failures), "OpenEXR" if kind == "exr" else "imageio"))


class Compared:
    """A method's row of a comparison: row["rmse"], row["ssim"] and so on, as types.ComparedMethod
    has them, and the pictures that belong to it."""

    def __init__(self, http_picture, row):
        self.row, self._picture = row, http_picture

    def __getitem__(self, key: str) -> Any:
        return self.row[key]

    def get(self, key: str, default: Any = None) -> Any:
        """The figure, or the default where this row has none."""
        return self.row.get(key, default)

    @property
    def name(self) -> str:
        """The method's name."""
        return self.row["technique"]["name"]

    @property
    def error(self) -> Optional[str]:
        """Why the method failed, in words, or None."""
        return self.row.get("error")

    def picture(self, link: str = "image") -> Picture:
        """A picture of this row: "image", "difference" (white: equal, red: too light, blue: too
        dark), "ssim_map" or "flip_map". KeyError when it has none, NotFound when it is kept no
        more."""
        return self._picture(self.row.get("links", {})[link])

    def __repr__(self):
        return "<Compared %s rmse=%s ms=%s>" % (self.name, self.get("rmse"), self.get("total_ms"))


class Comparison:
    """The rows of a comparison, in the order that was asked for; by number or by a method's name.
    reference: the row of the reference. document: all of it, as types.Comparison has it."""

    def __init__(self, http_picture, document):
        self.document = document
        self.reference = Compared(http_picture, document["reference"])
        self.rows = [Compared(http_picture, row) for row in document["methods"]]

    @property
    def warnings(self) -> List[str]:
        """What could not be done, in words."""
        return list(self.document["warnings"])

    def __iter__(self) -> Iterator[Compared]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, which: Union[str, int]) -> Compared:
        if isinstance(which, str):
            for row in self.rows:
                if row.name == which:
                    return row
            raise KeyError(which)
        return self.rows[which]

    def __str__(self):
        line = "%-18s %9s %9s %7s %7s %9s"
        rows = [line % ("method", "rmse", "penumbra", "ssim", "flip", "ms")]
        for row in self.rows:
            figures = [row.get(k) for k in ("rmse", "rmse_penumbra", "ssim", "flip", "total_ms")]
            texts = ["-" if f is None else ("%.2f" if i == 4 else "%.4f") % f
                     for i, f in enumerate(figures)]
            rows.append(line % (row.name, *texts) if not row.error else row.name + ": " + row.error)
        return "\n".join(rows)
