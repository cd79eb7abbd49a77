"""Which folder may include what. The first rule whose pattern fits a file decides; inside server/ and
renderer/ includes only go down, floor by floor."""
import fnmatch
import re

import tree

BASICS = ("container", "error", "fnv", "hex", "layer", "limits", "memory", "number", "param",
          "request", "result", "srgb", "technique_info", "utf8")
FLOOR_1 = ["protocol/%s.h" % name for name in BASICS] + ["protocol/*.def"]
PURE = set("""assert ctype errno fenv float inttypes limits locale math stdalign stdarg stdatomic
    stdbool stddef stdint stdio stdlib string strings time""".split())
SYSTEM = PURE | set("""byteswap dirent dlfcn endian fcntl fnmatch getopt glob immintrin libgen link
    malloc poll pthread pwd sched semaphore setjmp signal spawn syscall termios threads unistd
    ucontext x86intrin xmmintrin emmintrin""".split())
SOCKETS = set("sys/socket sys/un netdb netinet/in netinet/tcp arpa/inet ifaddrs net/if".split())
GL = ["GL/*", "EGL/*", "KHR/*", "cglm/*"]
# One for each library that has no C header, alone in its folder.
CXX_SHIMS = ["renderer/import/document/*.cpp", "renderer/import/draco/*.cpp",
             "renderer/encode/*.cpp"]

# pattern of the including file, project headers it may include, headers of libraries, system headers
RULES = [
    (r"protocol/(%s)\.[ch]" % "|".join(BASICS), FLOOR_1, [], "pure"),
    (r"protocol/.*", ["protocol/*"], ["cjson/cJSON.h"], "pure"),
    (r"renderer/blob/.*", FLOOR_1 + ["renderer/blob/*", "renderer/shared/*"], [], "system"),
    (r"renderer/generate/.*", FLOOR_1 + ["renderer/blob/*", "renderer/generate/*"],
     ["cglm/*"], "system"),
    (r"renderer/pose/.*", FLOOR_1 + ["renderer/blob/*", "renderer/pose/*"], [], "system"),
    (r"renderer/import/.*",
     FLOOR_1 + ["renderer/blob/*", "renderer/pose/*", "renderer/import/*"],
     ["tiny_gltf.h", "nlohmann/*", "cjson/cJSON.h", "meshoptimizer.h", "zip.h", "webp/*", "spng.h", "turbojpeg.h",
      "seccomp.h", "cglm/*", "openssl/*", "libdeflate.h", "zlib.h", "utf8proc.h", "draco/*"],
     "system"),
    (r"renderer/encode/.*", FLOOR_1 + ["renderer/picture.h", "renderer/encode/*"],
     ["Imf*.h", "isa-l.h", "isa-l/*", "tiffio.h", "turbojpeg.h", "webp/*"], "system"),
    (r"renderer/trace/.*", FLOOR_1 + ["renderer/*"], ["embree[34]/*"] + GL, "system"),
    (r"renderer/.*", FLOOR_1 + ["renderer/*"], GL, "system"),
    (r"server/.*",
     ["protocol/*", "server/*", "renderer/renderer.h", "renderer/encode/encode.h",
      "renderer/catalogue/catalogue.h", "renderer/device.h", "renderer/picture.h",
      "renderer/blob/pscene.h", "renderer/blob/builder.h", "renderer/import/import_process.h",
      "renderer/import/bundle.h", "renderer/import/names.h", "renderer/generate/generate.h",
      "renderer/metrics/*.h", "renderer/trace/*.h"],
     ["cjson/cJSON.h", "microhttpd.h", "openssl/*", "zlib.h", "seccomp.h", "isa-l.h", "isa-l/*", "sqlite3.h",
      "webp/mux.h", "zip.h"],
     "sockets"),
    (r"clients/.*",
     ["protocol/*", "clients/*", "renderer/generate/generate.h", "renderer/blob/pscene.h",
      "renderer/import/bundle.h", "renderer/import/names.h", "renderer/metrics/*.h"],
     ["cjson/cJSON.h", "curl/*", "zip.h", "openssl/*"], "sockets"),
]
# The floors inside a folder, from below, as patterns of folders or of modules (a path without its
# ending) in it. A file may include what lies in its own folder or on a floor below, not its
# neighbours on the same floor.
FLOORS = {
    "server": [["base"], ["wire"], ["access", "http", "store", "pages"], ["queue", "uploads", "live", "gallery"], ["workers"], ["auto", "jobs/store"], ["jobs"], ["routes"], ["routes/stored"],
               [""]],
    "renderer": [
        ["device", "picture", "shared", "shaders/*", "metrics", "catalogue/catalogue"],
        ["blob"], ["pose"],
        ["gl", "trace", "encode", "generate", "import/base", "import/bundle",
         "import/draco"],
        ["trace/embree"],
        ["trace/denoise"],
        ["import/names"], ["import/files"], ["import/image", "import/document"],
        ["import/geometry"],
        ["import/convert"], ["import/motion"], ["import/convert/node"], ["import/convert/convert"],
        ["import"],
        ["scene"], ["light", "edges"],
        ["technique"],
        ["passes/draw"], ["passes/map", "passes/rays"], ["passes/light"], ["passes/filter"],
        ["techniques"],
        ["frame"],
        ["lane"],
        ["residency"],
        ["renderer"],
        ["warm_up"],
        ["registry"],
        ["catalogue"]],
}
MOST_FILES = 20  # directly in a folder of the trees that have floors
CROWDED = ["renderer/techniques"]  # a file per method, and its shader
# Tests may look into everything, and compare with other libraries.
FREE = r"tests/.*"
# No part of the renderer may know of these, whatever the table says. The importer, a program of its
# own, is the one that reads JSON: glTF is JSON.
NOT_BELOW_SERVER = ["microhttpd.h", "curl/*"]


def fits(name, patterns):
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def system_allowed(header, kind):
    name = header[:-2] if header.endswith(".h") else header
    if kind == "pure":
        return name in PURE
    if name in SOCKETS:
        return kind == "sockets"
    return name in SYSTEM or name.startswith(("sys/", "linux/", "asm/", "sanitizer/"))


def floor_of(name, top):
    """Number of the floor and what stands for the room there; None for what lies elsewhere."""
    if not name.startswith(top + "/"):
        return None
    module = name[len(top) + 1:].rpartition(".")[0]
    folder = module.rpartition("/")[0]
    for room in (module, folder):
        for number, rooms in enumerate(FLOORS[top]):
            if fits(room, rooms):
                return number, room
    return len(FLOORS[top]), folder


def check_floor(name, line, header, problems):
    for top, floors in FLOORS.items():
        own, other = (floor_of(n, top) for n in (name, header))
        if not own or not other:
            continue
        if len(floors) in (own[0], other[0]):
            problems.append("%s:%d: %s or %s is on no floor" % (name, line, own[1], other[1]))
        elif own[1] != other[1] and other[0] >= own[0]:
            problems.append("%s:%d: %s lies on no floor below" % (name, line, header))


def check_rooms(names, problems):
    rooms = {}
    for name in names:
        folder = name.rpartition("/")[0]
        if name.partition("/")[0] in FLOORS and folder not in CROWDED:
            rooms.setdefault(folder, []).append(name)
    for folder, files in sorted(rooms.items()):
        if len(files) > MOST_FILES:
            problems.append("%s: %d files directly in it, %d are allowed" %
                            (folder, len(files), MOST_FILES))


def check_include(name, line, quoted, header, problems):
    if re.fullmatch(FREE, name):
        return
    for pattern, project, libraries, kind in RULES:
        if not re.fullmatch(pattern, name):
            continue
        if quoted:
            ok = fits(header, project)
        elif name.endswith(".cpp") and "." not in header:
            ok = True  # the standard library of C++, in a shim
        else:
            ok = fits(header, libraries) or system_allowed(header, kind)
        if name.startswith("renderer/") and not quoted and fits(header, NOT_BELOW_SERVER):
            ok = False
        if not ok:
            problems.append("%s:%d: may not include %s" % (name, line, header))
        return
    problems.append("%s:%d: no rule says what this file may include" % (name, line))


def main():
    problems, users_of_microhttpd, shims = [], set(), {}
    for name in tree.files():
        if name.endswith((".cpp", ".cc", ".cxx", ".hpp", ".hh")):
            folder = name.rsplit("/", 1)[0]
            if not fits(name, CXX_SHIMS):
                problems.append("%s: C++ outside the shims" % name)
            elif folder in shims:
                problems.append("%s: a second shim beside %s" % (name, shims[folder]))
            shims[folder] = name
        if not name.endswith((".c", ".h", ".cpp")):
            continue
        for number, text in enumerate(tree.read(name).splitlines(), 1):
            found = re.match(r'\s*#\s*(?:include|define SHARED_ROWS)\s*([<"])([^>"]+)[>"]', text)
            if not found:
                continue
            if found[2] == "microhttpd.h" and not name.startswith("tests/"):
                users_of_microhttpd.add(name)
            check_include(name, number, found[1] == '"', found[2], problems)
            check_floor(name, number, found[2], problems)
    check_rooms(tree.files(), problems)
    if len(users_of_microhttpd) > 1:
        problems.append("microhttpd.h is included by more than one file: %s" %
                        ", ".join(sorted(users_of_microhttpd)))
    tree.finish(problems)


if __name__ == "__main__":
    main()
