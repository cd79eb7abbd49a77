"""Everything that CMake looks for and every library header that code includes comes from a package
that deploy/install-deps.sh installs."""
import fnmatch
import os
import re
import subprocess

import tree

# As CMake or pkg-config spells it (lower case): the Debian package. None: part of the compiler.
CMAKE = {
    "threads": None, "m": None, "dl": None, "rt": None,
    "pkgconfig": "pkgconf", "python3": "python3", "curl": "libcurl4-openssl-dev",
    "libcurl": "libcurl4-openssl-dev", "libmicrohttpd": "libmicrohttpd-dev",
    "libcjson": "libcjson-dev", "cjson": "libcjson-dev", "openexr": "libopenexr-dev",
    "libtiff-4": "libtiff-dev",
    "libisal": "libisal-dev", "libwebp": "libwebp-dev", "libwebpdecoder": "libwebp-dev",
    "libwebpmux": "libwebp-dev", "sqlite3": "libsqlite3-dev",
    "spng": "libspng-dev", "libspng": "libspng-dev", "libutf8proc": "libutf8proc-dev",
    "draco": "libdraco-dev", "draco/compression/decode.h": "libdraco-dev",
    "libturbojpeg": "libturbojpeg0-dev", "turbojpeg": "libturbojpeg0-dev",
    "libseccomp": "libseccomp-dev", "libzip": "libzip-dev", "zlib": "zlib1g-dev",
    "openssl": "libssl-dev", "libssl": "libssl-dev", "libcrypto": "libssl-dev",
    "egl": "libegl-dev", "gl": "libgl-dev", "opengl": "libgl-dev", "cglm": "libcglm-dev",
    "meshoptimizer": "libmeshoptimizer-dev", "embree": "libembree-dev", "embree3": "libembree-dev",
    "embree4": "libembree-dev",
    "tinygltf": "libtinygltf-dev", "tiny_gltf.h": "libtinygltf-dev",
    "tbb": "libembree-dev", "clang-format": "clang-format",
    "embree3/rtcore.h": "libembree-dev", "embree4/rtcore.h": "libembree-dev",
    "microhttpd.h": "libmicrohttpd-dev",
    "meshoptimizer.h": "libmeshoptimizer-dev", "nlohmann_json": "nlohmann-json3-dev",
}
HEADERS = {
    "microhttpd.h": "libmicrohttpd-dev", "cjson/*": "libcjson-dev", "tiny_gltf.h": "libtinygltf-dev",
    "nlohmann/*": "nlohmann-json3-dev", "Imf*.h": "libopenexr-dev",
    "tiffio.h": "libtiff-dev",
    "cglm/*": "libcglm-dev", "meshoptimizer.h": "libmeshoptimizer-dev", "embree[34]/*": "libembree-dev",
    "isa-l.h": "libisal-dev", "isa-l/*": "libisal-dev", "GL/*": "libgl-dev", "EGL/*": "libegl-dev",
    "seccomp.h": "libseccomp-dev", "zip.h": "libzip-dev", "webp/*": "libwebp-dev",
    "spng.h": "libspng-dev", "utf8proc.h": "libutf8proc-dev", "draco/*": "libdraco-dev", "turbojpeg.h": "libturbojpeg0-dev", "curl/*": "libcurl4-openssl-dev",
    "openssl/*": "libssl-dev", "zlib.h": "zlib1g-dev", "sqlite3.h": "libsqlite3-dev",
}
KEYWORDS = set("""REQUIRED QUIET IMPORTED_TARGET GLOBAL STATIC CONFIG MODULE COMPONENTS NO_MODULE
    NAMES HINTS PATHS PATH_SUFFIXES NO_DEFAULT_PATH DOC OPTIONAL_COMPONENTS""".split())


def looked_for(text):
    """Names after find_package, pkg_check_modules, find_library, find_path and find_program."""
    text = re.sub(r"#.*", "", text)
    for call in re.finditer(r"\b(find_package|pkg_check_modules|pkg_search_module|find_library|"
                            r"find_path|find_program)\s*\(([^)]*)\)", text):
        words = [w.strip('"') for w in call[2].split() if w.strip('"') not in KEYWORDS]
        if call[1] == "find_package":
            yield words[0]
        else:
            for word in words[1:]:
                if not word.startswith(("$", "/")):
                    yield re.split(r"[<>=]", word)[0]


def main():
    script = os.path.join(tree.ROOT, "deploy", "install-deps.sh")
    packages = set(subprocess.run([script, "--list"], check=True, capture_output=True,
                                  text=True).stdout.split())
    problems = []
    for name in tree.files():
        if name.endswith(("CMakeLists.txt", ".cmake")):
            for wanted in looked_for(tree.read(name)):
                package = CMAKE.get(wanted.lower(), "")
                if package == "":
                    problems.append("%s: %s: say in tests/lint/packages.py what package has it" %
                                    (name, wanted))
                elif package and package not in packages:
                    problems.append("%s: %s needs %s, which install-deps.sh lacks" %
                                    (name, wanted, package))
        elif name.endswith((".c", ".h", ".cpp")):
            for header in re.findall(r"^\s*#\s*include\s*<([^>]+)>", tree.read(name), re.M):
                for pattern, package in HEADERS.items():
                    if fnmatch.fnmatchcase(header, pattern) and package not in packages:
                        problems.append("%s: <%s> needs %s, which install-deps.sh lacks" %
                                        (name, header, package))
    tree.finish(problems)


if __name__ == "__main__":
    main()
