"""What is uploaded: its bytes, its id, and which files belong to it."""
import hashlib
import io
import json
import os
import posixpath
import secrets
import struct
import unicodedata
import urllib.parse

from .errors import PenumbraError

PIECE = 1 << 18
SCENES = (".glb", ".gltf", ".vrm")


class Bytes:
    """A file's bytes, from memory, from disk or from an open file, to be read more than once."""

    def __init__(self, thing):
        self.thing = thing
        if isinstance(thing, bytes):
            self.size = len(thing)
        elif isinstance(thing, str):
            self.size = os.path.getsize(thing)
        else:
            self.start = thing.tell()
            self.size = thing.seek(0, os.SEEK_END) - self.start

    def pieces(self):
        if isinstance(self.thing, str):
            with open(self.thing, "rb") as file:
                yield from self.read(file)
            return
        if isinstance(self.thing, bytes):
            yield from self.read(io.BytesIO(self.thing))
            return
        self.thing.seek(self.start)
        yield from self.read(self.thing)

    def read(self, file):
        left = self.size
        while left:
            piece = file.read(min(left, PIECE))
            if not piece:
                raise PenumbraError("a file became shorter while it was read")
            left -= len(piece)
            yield piece

    def head(self):
        for piece in self.pieces():
            return piece[:256]
        return b""


class Upload:
    """What is sent: method, path below the folder, query, type, size, and its pieces."""

    def __init__(self, parts, entry="", name=""):
        """parts: {name: Bytes}; a lone one that is no .gltf is sent as it is. `name`: what the
        scene is to be called; else as its file."""
        self.parts = sorted(((os.fsencode(name), data) for name, data in parts.items()),
                            key=lambda part: part[0])
        first_name, first = self.parts[0]
        self.alone = len(self.parts) == 1 and not first_name.lower().endswith(b".gltf")
        said = {"entry": entry, "name": name or entry}
        self.query = "?" + urllib.parse.urlencode({k: v for k, v in said.items() if v},
                                                  errors="surrogateescape")
        self.query = self.query if self.query != "?" else ""
        self.id = self.hash(os.fsencode(entry))
        self.method = "PUT" if self.alone and not entry else "POST"
        if self.alone:
            head = first.head()
            self.type = ("model/gltf-binary" if head[:4] == b"glTF" else
                         "application/zip" if head[:4] == b"PK\3\4" else
                         "model/gltf+json" if head.lstrip()[:1] == b"{" else
                         "application/octet-stream")
            self.size = first.size
            return
        boundary = secrets.token_hex(16).encode()
        self.type = "multipart/form-data; boundary=" + boundary.decode()
        self.frames = []
        for name, _ in self.parts:
            quoted = name.replace(b'"', b"%22").replace(b"\r", b"%0D").replace(b"\n", b"%0A")
            self.frames.append(b'--%s\r\nContent-Disposition: form-data; name="file"; filename="%s"'
                               b"\r\nContent-Type: application/octet-stream\r\n\r\n" % (
                                   boundary, quoted))
        self.tail = b"--%s--\r\n" % boundary
        self.size = len(self.tail) + sum(len(frame) + data.size + 2 for frame, (_, data) in zip(
            self.frames, self.parts))

    def hash(self, entry):
        """The id that the service gives these bytes: the SHA-256 of the file that it stores. For
        several files, or with an entry, that is renderer/import/bundle.h."""
        digest = hashlib.sha256()
        if entry:
            digest.update(b"PENENTR1" + struct.pack("<II", len(entry), 0) + entry)
        if not self.alone:
            digest.update(b"PENBNDL1" + struct.pack("<II", len(self.parts), 0))
        for name, data in self.parts:
            if not self.alone:
                digest.update(struct.pack("<IIQ", len(name), 0, data.size) + name)
            for piece in data.pieces():
                digest.update(piece)
        return digest.hexdigest()

    def pieces(self):
        if self.alone:
            yield from self.parts[0][1].pieces()
            return
        for frame, (_, data) in zip(self.frames, self.parts):
            yield frame
            yield from data.pieces()
            yield b"\r\n"
        yield self.tail

    def told(self, progress):
        """The pieces; `progress` hears of each that has gone."""
        sent = 0
        for piece in self.pieces():
            yield piece
            sent += len(piece)
            if progress:
                progress(sent, self.size)


def listing(root):
    """The files below a folder, as paths with slashes."""
    for folder, folders, names in os.walk(root):
        folders.sort()
        for name in names:
            path = os.path.join(folder, name)
            if os.path.isfile(path):
                yield os.path.relpath(path, root).replace(os.sep, "/")


def plain(name):
    """What names of one file may differ in: Unicode's normal forms and case."""
    return unicodedata.normalize("NFKC", name).casefold()


def find(uri, gltf, names):
    """The file below the folder that a uri in `gltf` means."""
    wanted = posixpath.normpath(posixpath.join(
        posixpath.dirname(gltf), urllib.parse.unquote(uri).replace("\\", "/")))
    if wanted in names:
        return wanted
    like = [name for name in names if plain(name) == plain(wanted)]
    if len(like) == 1:
        return like[0]
    raise FileNotFoundError("%s names %.200s, %s" % (
        gltf, uri, "and several files could be meant" if like else
        "which is outside its folder" if wanted.startswith(("../", "/")) else
        "which is not in its folder"))


def gltf_files(root, gltf):
    """{name: Bytes} of a .gltf below a folder and of what it names."""
    whole = {gltf: Bytes(os.path.join(root, *gltf.split("/")))}
    try:
        document = json.loads(b"".join(whole[gltf].pieces()).decode("utf-8-sig"))
        items = [item for key in ("buffers", "images") for item in document.get(key) or []]
        uris = [item["uri"] for item in items if isinstance(item.get("uri"), str)]
    except (ValueError, AttributeError, TypeError):
        return whole  # the service says what is wrong with it
    uris = [uri for uri in uris if not uri[:5].lower() == "data:"]
    names = set(listing(root)) if uris else ()
    for name in {find(uri, gltf, names) for uri in uris}:
        whole[name] = Bytes(os.path.join(root, *name.split("/")))
    return whole


def of_folder(root, entry, name):
    scenes = [name for name in listing(root) if name.lower().endswith(SCENES)]
    if entry:
        scenes = [name for name in scenes if name == entry]
    if len(scenes) != 1:
        raise ValueError("%s holds %s" % (root, "several scenes, `entry` says which: " + ", ".join(
            scenes[:8]) if scenes else "no scene" + (" " + entry if entry else "")))
    if scenes[0].lower().endswith(".gltf"):
        return Upload(gltf_files(root, scenes[0]), name=name or scenes[0])
    return Upload({scenes[0]: Bytes(os.path.join(root, *scenes[0].split("/")))},
                  name=name or scenes[0])


def prepare(thing, entry="", name=""):
    """An Upload of a path, a folder, bytes, an open file, or {name: any of these but a folder}."""
    if isinstance(thing, dict):
        if not thing:
            raise ValueError("nothing to upload")
        if len(thing) == 1 and not entry:
            name = name or str(next(iter(thing)))
        return Upload({str(file): as_bytes(data) for file, data in thing.items()}, entry, name)
    if isinstance(thing, (str, os.PathLike)):
        path = os.fsdecode(thing)
        if os.path.isdir(path):
            return of_folder(path, entry, name)
        name = name or (os.path.basename(path) if not entry else "")
        if path.lower().endswith(".gltf"):
            return Upload(gltf_files(os.path.dirname(path) or ".", os.path.basename(path)), entry, name)
    return Upload({"scene": as_bytes(thing)}, entry, name)


def as_bytes(thing):
    if isinstance(thing, (str, os.PathLike)):
        return Bytes(os.fsdecode(thing))
    if isinstance(thing, (bytes, bytearray, memoryview)):
        return Bytes(bytes(thing))
    if not hasattr(thing, "read") or isinstance(thing, io.TextIOBase):
        raise TypeError("a path, bytes or a file opened in binary mode, not %s" % (
            type(thing).__name__))
    if getattr(thing, "seekable", lambda: False)():
        return Bytes(thing)
    return Bytes(thing.read())
