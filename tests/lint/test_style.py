# SPDX-License-Identifier: Apache-2.0
"""The house rules that a machine can check. A rule takes (path, text) and returns what offends it;
each has a sample that it must refuse, so that no rule passes by checking nothing."""
import ast
import pathlib
import re
import subprocess

import pytest
import tree

C = (".c", ".h", ".cpp")
SOURCES = C + (".proto", ".py", ".sh", ".lua", ".js", ".mjs", ".css")
FILE_LINES_MAX = 800
FUNCTION_LINES_MAX = 70

BANNED = ("alloca", "asctime", "atof", "atoi", "atol", "atoll", "ctime", "gets", "mktemp",
          "sprintf", "strcat", "strcpy", "strncat", "strncpy", "strtok", "tmpnam",
          "vsprintf")


def line_of(text, offset):
    return text.count("\n", 0, offset) + 1


def missing_licence(path, text):
    lines = text.splitlines()
    if lines and lines[0].startswith("#!"):
        lines = lines[1:]
    comment = r"(/\*|#|//|--) SPDX-License-Identifier: Apache-2\.0( \*/)?"
    found = bool(lines) and re.fullmatch(comment, lines[0])
    return [] if found else ["line 1: no SPDX-License-Identifier"]


def banned_calls(path, text):
    code = tree.code_of(text)
    pattern = r"\b(" + "|".join(BANNED) + r")\s*\("
    return [f"line {line_of(code, m.start())}: {m[1]}" for m in re.finditer(pattern, code)]


def machine_paths(path, text):
    pattern = r"(?<![\w.$}])/(?:home|root|work|Users|mnt)/\w+"
    return [f"line {line_of(text, m.start())}: {m[0]}" for m in re.finditer(pattern, text)]


def unfinished_marks(path, text):
    pattern = r"\b(?:TO" r"DO|FIX" r"ME|XX" r"X|HA" r"CK)\b"
    return [f"line {line_of(text, m.start())}: {m[0]}" for m in re.finditer(pattern, text)]


def too_long(path, text):
    lines = text.count("\n")
    return [f"{lines} lines"] if lines > FILE_LINES_MAX else []


def long_c_functions(path, text):
    """In the house format a function's braces, and only they, stand in column 0."""
    bodies = re.finditer(r"^\{\n.*?^\}", tree.code_of(text), flags=re.S | re.M)
    lengths = [(line_of(text, m.start()), m[0].count("\n") + 1) for m in bodies]
    return [f"line {at}: a function of {n} lines" for at, n in lengths if n > FUNCTION_LINES_MAX]


def long_python_functions(path, text):
    functions = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef)]
    lengths = [(f.lineno, f.end_lineno - f.lineno + 1) for f in functions]
    return [f"line {at}: a function of {n} lines" for at, n in lengths if n > FUNCTION_LINES_MAX]


def wrong_guard(path, text):
    inner = [part for part in pathlib.PurePosixPath(path).with_suffix("").parts if part != "core"]
    guard = "PEN_" + "_".join(inner).upper().replace("-", "_") + "_H"
    found = f"#ifndef {guard}\n#define {guard}\n" in text
    return [] if found else [f"no include guard {guard}"]


def does_not_stand_alone(path, text):
    """Whether a header compiles by itself: every type that it names is declared or included."""
    command = ["gcc", "-std=gnu11", "-D_GNU_SOURCE", f"-I{tree.ROOT}", "-Wall", "-Wextra",
               "-pedantic", "-Werror", "-fsyntax-only", "-x", "c", "-"]
    unit = text + "extern int pen_not_empty;\n"
    run = subprocess.run(command, input=unit, capture_output=True, text=True)
    return run.stderr.splitlines()[:3] if run.returncode else []


RULES = {
    missing_licence: SOURCES,
    banned_calls: C,
    machine_paths: SOURCES + (".md", ".txt", ".cmake", ".json", ".in", ".service"),
    unfinished_marks: SOURCES + (".md", ".txt", ".cmake"),
    too_long: SOURCES,
    long_c_functions: C,
    long_python_functions: (".py",),
    wrong_guard: (".h",),
    does_not_stand_alone: (".h",),
}

BAD = [
    (missing_licence, "int x;\n"),
    (missing_licence, "#!/bin/sh\nset -e\n# SPDX-License-Identifier: Apache-2.0\n"),
    (banned_calls, "void f(char *a)\n{\n\tstrcpy(a, \"x\");\n}\n"),
    (banned_calls, "int n = atoi (text);\n"),
    (machine_paths, 'open("/ho' 'me/somebody/scene.json")\n'),
    (unfinished_marks, "/* TO" "DO: later */\n"),
    (too_long, "\n" * (FILE_LINES_MAX + 1)),
    (long_c_functions, "int f(void)\n{\n" + "\tg();\n" * (FUNCTION_LINES_MAX - 1) + "}\n"),
    (long_python_functions, "def f():\n" + "    g()\n" * FUNCTION_LINES_MAX),
    (wrong_guard, "#ifndef PEN_OTHER_H\n#define PEN_OTHER_H\n#endif\n"),
    (does_not_stand_alone, "size_t pen_size(void);\n"),
]

GOOD = [
    (missing_licence, "#!/bin/sh\n# SPDX-License-Identifier: Apache-2.0\n"),
    (banned_calls, "/* strcpy(a, b) is banned */\nint n = pen_atoi(\"gets(\");\n"),
    (machine_paths, "DATA/frames/ID.f32, $HOME/work/x, ../shared/root/y\n"),
    (too_long, "\n" * FILE_LINES_MAX),
    (long_c_functions, "int f(void)\n{\n" + "\tg();\n" * (FUNCTION_LINES_MAX - 2) + "}\n"),
    (wrong_guard, "#ifndef PEN_SAMPLE_H\n#define PEN_SAMPLE_H\n#endif\n"),
    (does_not_stand_alone, "#include <stddef.h>\nsize_t pen_size(void);\n"),
]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_the_tree_keeps_the_rule(rule):
    paths = tree.files(*RULES[rule])
    found = [f"{path}: {what}" for path in paths for what in rule(path, tree.text(path))]
    assert paths and not found, "\n" + "\n".join(found)


@pytest.mark.parametrize("rule, sample", BAD, ids=lambda value: getattr(value, "__name__", ""))
def test_the_rule_refuses_a_bad_sample(rule, sample):
    assert rule("sample.h", sample)


@pytest.mark.parametrize("rule, sample", GOOD, ids=lambda value: getattr(value, "__name__", ""))
def test_the_rule_accepts_a_good_sample(rule, sample):
    assert not rule("sample.h", sample)


def test_every_rule_has_a_bad_sample():
    assert {rule for rule, _ in BAD} == set(RULES)


def test_the_top_level_is_closed():
    """A new name at the top is a decision, not an accident."""
    allowed = {"CMakeLists.txt", "CMakePresets.json", "README.md", "LICENSE", "CHANGELOG.md",
               "CONTRIBUTING.md", "SECURITY.md", "core", "server", "worker", "proto", "tests",
               "deploy"}
    names = {path.parts[0] for path in tree.files()}
    assert {name for name in names if not name.startswith(".")} <= allowed
