# SPDX-License-Identifier: Apache-2.0
"""The architecture's arrows: who may include whom, who may use which library, who may link what."""
import pathlib
import re

import pytest
import tree

# Each layer with what stands below it. The longest matching path decides.
BELOW = {
    "core/base": [],
    "core/scene": ["core/base"],
    "core/image": ["core/base"],
    "proto": ["core/base"],
    "core/render": ["core/base", "core/scene", "core/image"],
    "worker": ["core/base", "core/scene", "core/image", "core/render", "proto"],
    "server": ["core/base", "core/scene", "proto"],
    "server/main.c": ["core/base", "server", "server/cli"],
    "server/cli": ["core/base"],
    # The encoder is a program of its own: the coordinator knows it as a process, not as code.
    "server/encoder": ["core/base", "core/image", "server"],
}

# Each library's headers with the only files that may include them (tests may include any).
LIBRARIES = {
    r"embree3/.*": ["core/render/trace.c"],
    r"OpenImageIO/.*": ["core/image/"],
    r"tiny_gltf\.h": ["core/scene/"],
    r"jansson\.h": ["core/scene/", "server/"],
    r"microhttpd\.h": ["server/http.c", "server/response.c", "server/stream.c", "server/framing.c",
                       "server/turns.c"],
    r"uv\.h": ["server/", "worker/"],
    r"protobuf-c/.*|.*\.pb-c\.h": ["proto/"],
    r"sqlite3\.h": ["server/store.c", "server/database.c", "server/job_row.c", "server/scene_row.c",
                    "server/archive.c"],
    r"xxhash\.h": ["core/base/digest.c"],
    r"gnutls/.*": ["core/base/digest.c", "proto/secure.c", "server/certificate.c"],
    r"seccomp\.h|linux/(seccomp|landlock|filter)\.h": ["core/base/sandbox.c"],
    r"curl/.*": ["server/cli/client.c"],
    r"systemd/.*": ["server/supervisor.c"],
    r"cmocka\.h": ["tests/"],
}

SYSTEM = re.compile(
    r"(assert|complex|ctype|errno|fenv|float|inttypes|limits|locale|math|setjmp|signal|stdalign"
    r"|stdarg|stdatomic|stdbool|stddef|stdint|stdio|stdlib|stdnoreturn|string|tgmath|threads|time"
    r"|uchar|wchar|dirent|endian|fcntl|ftw|getopt|grp|langinfo|libgen|malloc|netdb|poll|pthread|pwd|sched|search"
    r"|spawn|strings|syscall|sysexits|termios|ucontext|unistd)\.h"
    r"|(sys|netinet|arpa|net|linux|asm)/.*\.h|.*intrin\.h|cpuid\.h|[a-z_]+")

TARGET_LIBRARIES = {
    "PkgConfig::libcurl": ["server/cli"], "PkgConfig::curl": ["server/cli"],
    "PkgConfig::jansson": ["core/scene", "server", "server/cli"],
    "PkgConfig::microhttpd": ["server"], "PkgConfig::uv": ["server", "worker"],
    "PkgConfig::protobuf-c": ["proto"], "PkgConfig::sqlite3": ["server"],
    "PkgConfig::xxhash": ["core/base"], "PkgConfig::gnutls": ["core/base", "proto", "server"],
    "PkgConfig::seccomp": ["core/base"], "PkgConfig::systemd": ["server"], "embree": ["core/render"],
    "PkgConfig::OpenImageIO": ["core/image"],
}


def layer_of(path):
    matches = [layer for layer in BELOW if str(path).startswith(layer)]
    return max(matches, key=len, default=None)


def own_includes(text):
    return re.findall(r'^#include "([^"]+)"', text, flags=re.M)


def upward_includes(path, text):
    """Includes of our own headers that point at a layer which is not below."""
    layer = layer_of(path)
    if layer is None:
        return []
    allowed = [layer, *BELOW[layer]]
    if pathlib.PurePosixPath(layer).suffix:
        allowed.append(str(pathlib.PurePosixPath(layer).parent))
    return [name for name in own_includes(text)
            if not name.endswith(".pb-c.h") and layer_of(name) not in allowed]


def stray_libraries(path, text):
    """Headers of a library in a file that is not its place, or of a library nobody decided on."""
    stray = []
    for name in re.findall(r'^#include [<"]([^>"]+)[>"]', text, flags=re.M):
        homes = [home for pattern, home in LIBRARIES.items() if re.fullmatch(pattern, name)]
        if homes:
            if not any(str(path).startswith(place) for place in homes[0]):
                stray.append(name)
        elif f"<{name}>" in text and not SYSTEM.fullmatch(name):
            stray.append(name)
    return stray


def not_own_header_first(path, text):
    """A .c that has a header includes it first: so every header is proven to stand alone."""
    own = str(pathlib.PurePosixPath(path).with_suffix(".h"))
    includes = re.findall(r'^#include [<"]([^>"]+)[>"]', text, flags=re.M)
    return [own] if own in includes and includes[0] != own else []


def include_cycles(headers):
    """headers: name -> text. Returns the names on a cycle, in order, or []."""
    state = {}

    def visit(name, trail):
        if state.get(name) == "done" or name not in headers:
            return []
        if name in trail:
            return trail[trail.index(name):]
        found = next(filter(None, (visit(n, trail + [name])
                                   for n in own_includes(headers[name]))), [])
        state[name] = "done"
        return found

    return next(filter(None, (visit(name, []) for name in headers)), [])


def link_statements(folder, text):
    """(target, library) for each library named in a target_link_libraries of a CMakeLists.txt."""
    keywords = {"PUBLIC", "PRIVATE", "INTERFACE"}
    code = re.sub(r"#[^\n]*", "", text)
    for arguments in re.findall(r"target_link_libraries\(([^)]*)\)", code):
        target, *names = arguments.split()
        yield from ((target, name) for name in names if name not in keywords)


def target_homes(lists):
    """lists: folder -> CMakeLists text. Which folder makes which of our targets."""
    return {target: folder for folder, text in lists.items()
            for target in re.findall(r"add_(?:library|executable)\(([\w-]+)", text)}


def upward_links(lists):
    """Links that the layers do not allow: of our targets, or of a library out of its place."""
    homes = target_homes(lists)
    found = []
    for folder, text in lists.items():
        for target, name in link_statements(folder, text):
            layer = "server/encoder" if target == "penumbra-encoder" else folder
            home = homes.get(name)
            allowed = [folder, layer, *BELOW[layer]]
            if target == "penumbra":
                allowed.append("server/cli")
            if home is not None and home not in allowed:
                found.append(f"{target} links {name}")
            if folder not in TARGET_LIBRARIES.get(name, [folder]):
                found.append(f"{target} links {name}")
    return found


def sources():
    return [path for path in tree.files(".c", ".h", ".cpp") if path.parts[0] != "tests"]


@pytest.mark.parametrize("rule", [upward_includes, stray_libraries, not_own_header_first],
                         ids=lambda rule: rule.__name__)
def test_the_tree_keeps_the_rule(rule):
    paths = sources()
    found = [f"{path}: {name}" for path in paths for name in rule(path, tree.text(path))]
    assert paths and not found, "\n" + "\n".join(found)


def test_headers_include_each_other_in_no_circle():
    headers = {str(path): tree.text(path) for path in tree.files(".h")}
    assert headers and not include_cycles(headers)


def test_targets_link_only_what_is_below():
    lists = {str(path.parent): tree.text(path) for path in tree.files("CMakeLists.txt")
             if layer_of(path) is not None}
    assert len(lists) >= 6 and not upward_links(lists)


@pytest.mark.parametrize("rule, path, text", [
    (upward_includes, "core/base/buf.c", '#include "core/scene/desc.h"\n'),
    (upward_includes, "core/scene/parse.c", '#include "core/render/render.h"\n'),
    (upward_includes, "server/job.c", '#include "core/render/render.h"\n'),
    (upward_includes, "server/job.c", '#include "server/cli/client.h"\n'),
    (upward_includes, "server/cli/render.c", '#include "server/job.h"\n'),
    (upward_includes, "proto/frame.c", '#include "worker/pool.h"\n'),
    (stray_libraries, "worker/pool.c", "#include <embree3/rtcore.h>\n"),
    (stray_libraries, "server/api.c", "#include <microhttpd.h>\n"),
    (stray_libraries, "server/job.c", "#include <sqlite3.h>\n"),
    (stray_libraries, "core/base/buf.c", "#include <zlib.h>\n"),
    (stray_libraries, "worker/session.c", '#include "proto/penumbra.pb-c.h"\n'),
    (not_own_header_first, "core/base/buf.c",
     '#include <stdio.h>\n\n#include "core/base/buf.h"\n'),
])
def test_the_rule_refuses_a_bad_sample(rule, path, text):
    assert rule(path, text)


@pytest.mark.parametrize("rule, path, text", [
    (upward_includes, "server/main.c", '#include "server/cli/cli.h"\n#include "server/loop.h"\n'),
    (upward_includes, "server/encoder.c", '#include "core/image/codec.h"\n'),
    (upward_includes, "worker/pool.c", '#include "core/render/render.h"\n'),
    (stray_libraries, "server/http.c", "#include <microhttpd.h>\n#include <sys/socket.h>\n"),
    (stray_libraries, "core/image/oiio.cpp", "#include <OpenImageIO/imageio.h>\n#include <vector>\n"),
])
def test_the_rule_accepts_a_good_sample(rule, path, text):
    assert not rule(path, text)


def test_a_circle_is_found():
    assert include_cycles({"a.h": '#include "b.h"\n', "b.h": '#include "c.h"\n',
                           "c.h": '#include "b.h"\n'}) == ["b.h", "c.h"]
    assert not include_cycles({"a.h": '#include "b.h"\n#include "c.h"\n', "b.h": '#include "c.h"\n',
                               "c.h": ""})


def test_an_upward_link_is_found():
    lists = {"core/base": "add_library(pen_base STATIC a.c)\n"
                          "target_link_libraries(pen_base PRIVATE pen_render)\n",
             "core/render": "add_library(pen_render STATIC b.c)\n"
                            "target_link_libraries(pen_render PUBLIC pen_base PRIVATE embree)\n",
             "server": "add_library(pen_server STATIC c.c)\n"
                       "target_link_libraries(pen_server PRIVATE pen_base embree)\n"}
    assert upward_links(lists) == ["pen_base links pen_render", "pen_server links embree"]
