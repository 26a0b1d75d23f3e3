# SPDX-License-Identifier: Apache-2.0
"""What deploy/cmake/Compiler.cmake asks of compiler and linker is in the programs.

Breaks when a target is built without pen_hardening, or a flag is lost with a compiler or a library."""
import json
import pathlib
import re
import subprocess

import farm
import pytest

PROGRAMS = ("penumbra", "penumbra-encoder", "penumbra-worker")
BUILD = farm.BIN.parent
# What runs where the renderer spends its time, built once for each instruction set, and on the machine that
# builds: SECURITY.md says so.
UNHARDENED = re.compile(r"core/render/CMakeFiles/pen_kernel_v[234]\.dir/|/pen_filter_table_make\.dir/")
COMPILED_WITH = ("-fstack-protector-strong", "-fstack-clash-protection", "-fcf-protection=full", "-D_FORTIFY_SOURCE=3",
                 "-ftrivial-auto-var-init=zero", "-fno-delete-null-pointer-checks", "-fno-strict-overflow")

pytestmark = pytest.mark.skipif(farm.SLOW > 1, reason="of the release build")


def readelf(option, path):
    return subprocess.run(["readelf", "-W", option, path], capture_output=True, text=True, check=True).stdout


@pytest.fixture(params=PROGRAMS)
def program(request):
    return farm.BIN / request.param


def test_addresses_are_random_and_tables_read_only(program):
    """Position independent; relocations done before main and then read-only; no memory both written and run."""
    segments = readelf("--segments", program)
    dynamic = readelf("--dynamic", program)
    assert "Elf file type is DYN" in segments and re.search(r"Flags:.*\bPIE\b", dynamic)
    assert "GNU_RELRO" in segments and re.search(r"Flags:.*\bNOW\b", dynamic)
    assert "TEXTREL" not in dynamic and "RPATH" not in dynamic and "RUNPATH" not in dynamic
    flags = re.findall(r"^ +(?:LOAD|GNU_STACK) +(?:0x\w+ +){5}([RWE ]{3}) ", segments, flags=re.M)
    assert len(flags) >= 5 and not [f for f in flags if "W" in f and "E" in f]
    assert re.search(r"GNU_STACK .* RW  ", segments)


def test_stacks_and_copies_are_checked(program):
    symbols = readelf("--dyn-syms", program)
    assert "__stack_chk_fail" in symbols
    assert re.search(r"__(snprintf|vsnprintf|memcpy|memset)_chk", symbols)


def objects():
    """{object file below the build: words of its command} of what the programs are made of, all of them."""
    commands = [c["command"].split() for c in json.loads((BUILD / "compile_commands.json").read_text())]
    found = {words[words.index("-o") + 1]: words for words in commands}
    return {name: words for name, words in found.items() if not name.startswith("tests/")}


def test_every_object_is_compiled_with_all_of_it():
    """The linker drops the mark of indirect branches as soon as one object lacks it, and Debian 12's own start
    code does; so it is the objects that are looked at."""
    wrong = []
    hardened = {name: words for name, words in objects().items() if not UNHARDENED.search(name)}
    assert len(hardened) > 150
    for name, words in hardened.items():
        missing = [flag for flag in COMPILED_WITH if flag not in words]
        notes = readelf("--notes", BUILD / name)
        if missing or "IBT, SHSTK" not in notes:
            wrong.append((name, missing or "no IBT, SHSTK"))
    assert not wrong


def test_only_the_kernels_go_without():
    """Breaks when the exception above covers more than it says."""
    bare = [words[words.index("-c") + 1] for name, words in objects().items() if UNHARDENED.search(name)]
    assert {pathlib.PurePath(path).parent.name for path in bare} == {"render"}
    assert {pathlib.PurePath(path).name for path in bare if bare.count(path) != 3} == {"filter_table_make.c"}
