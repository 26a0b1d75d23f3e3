# SPDX-License-Identifier: Apache-2.0
"""The repository's files as the lint tests see them."""
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]


def files(*suffixes):
    """Paths relative to ROOT of the files that are, or are about to be, committed."""
    command = ["git", "-c", "safe.directory=*", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    names = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    paths = [pathlib.PurePosixPath(name) for name in sorted(set(names.split("\0"))) if name]
    return [path for path in paths
            if (ROOT / path).is_file() and (not suffixes or path.name.endswith(suffixes))]


def text(path):
    return (ROOT / path).read_text(encoding="utf-8")


def _blank(match):
    """The same text with all but line ends replaced, so that line numbers stay true."""
    return re.sub(r"[^\n]", " ", match.group())


def code_of(source):
    """C source with comments and the insides of literals blanked out."""
    pattern = r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\''
    return re.sub(pattern, _blank, source, flags=re.S)
