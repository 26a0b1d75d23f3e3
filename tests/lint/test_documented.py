# SPDX-License-Identifier: Apache-2.0
"""What --help of the built programs says, the manual pages, the completions and the example of the
configuration file say too: no option is missing anywhere, and none is left over.

Breaks when an option is added, renamed or removed in one of these places only.
"""
import functools
import re
import subprocess

import pytest
from farm import program
from tree import ROOT

DEPLOY = ROOT / "deploy"
# Options that a client takes stand in the manual under this heading, or with render's.
CLIENTS = "Clients"
# What makes sense for one start only is no setting of a file.
NO_SETTINGS = {"config", "parent-death", "help"}


@functools.cache
def help_of(*words):
    return subprocess.run([program(words[0]), *words[1:], "--help"], capture_output=True, text=True,
                          check=True, timeout=30).stdout


def long_options(text):
    return set(re.findall(r"(?<![\w-])--([a-z][\w-]*)", text))


def options(*words):
    """The names of the long options that a command explains: those at the beginning of a line."""
    lines = [line for line in help_of(*words).splitlines() if re.match(r" +-", line)]
    return long_options("\n".join(re.split(r" {2,}(?=[^ -])", line.strip())[0] for line in lines)) - {"help"}


def commands():
    names = re.findall(r"^  (\w+)  ", help_of("penumbra"), flags=re.M)
    assert "render" in names and "serve" in names
    return names


OF_DIRECTORIES = ["fsck", "backup", "restore"]
OF_ACCESS = ["token", "worker", "cert"]
OF_PENUMBRA = ["render", "submit", "status", "list", "watch", "cancel", "pause", "resume", "priority", "workers", "drain",
               "reset", "serve", "config", *OF_DIRECTORIES, *OF_ACCESS]


def test_all_commands_are_tested_here():
    assert sorted(commands()) == sorted([*OF_PENUMBRA, "version"])


def manual(name):
    return (DEPLOY / "man" / name).read_text()


def manual_options(text):
    return set(re.findall(r"^\.It Fl (?:\w , Fl )?-([a-z][\w-]*)", text, flags=re.M))


def section(text, heading):
    """From a .Ss to the next heading."""
    found = re.search(rf"^\.Ss {heading}$(.*?)(?=^\.S[hs] |\Z)", text, flags=re.M | re.S)
    assert found, heading
    return found[1]


def test_penumbra_1_explains_every_option_and_no_other():
    page = manual("penumbra.1")
    render, clients = (manual_options(section(page, title)) for title in ("penumbra render", CLIENTS))
    assert render == options("penumbra", "render")
    assert manual_options(section(page, "penumbra serve")) == options("penumbra", "serve")
    assert manual_options(section(page, "penumbra config check")) == options("penumbra", "config")
    rest = set().union(*(options("penumbra", name) for name in OF_PENUMBRA
                         if name not in ("render", "serve", "config", *OF_DIRECTORIES, *OF_ACCESS)))
    assert manual_options(section(page, "Data directories")) == set().union(
        *(options("penumbra", name) for name in OF_DIRECTORIES))
    assert manual_options(section(page, "Access")) == set().union(
        *(options("penumbra", name) for name in OF_ACCESS))
    assert clients == rest - (render - clients)
    assert all(re.search(rf"^\.Cm (\w+ \| )*{name}\b", page, flags=re.M) for name in commands())


def test_penumbra_worker_8_explains_every_option_and_no_other():
    own = {name for name in options("penumbra-worker") if name != "version"}
    found = manual_options(manual("penumbra-worker.8")) - {"help", "version"}
    assert found == own | {"connect"}


def bash_completes(program_name, *words):
    """What bash offers for the last of the words."""
    script = (f'. "{DEPLOY}/completions/bash/penumbra"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); '
              f'{program_name}; printf "%s\\n" "${{COMPREPLY[@]}}"')
    run = subprocess.run(["bash", "-c", script, "bash", *words], capture_output=True, text=True,
                         check=True, timeout=30)
    return set(run.stdout.split())


def test_bash_completes_the_commands():
    assert bash_completes("_penumbra", "penumbra", "") - {"--help", "--version"} == set(commands())


@pytest.mark.parametrize("command", OF_PENUMBRA)
def test_bash_completes_the_options(command):
    found = long_options(" ".join(bash_completes("_penumbra", "penumbra", command, "--")))
    assert found - {"help"} == options("penumbra", command)


def test_bash_completes_the_worker():
    found = long_options(" ".join(bash_completes("_penumbra_worker", "penumbra-worker", "--")))
    assert found - {"help"} == options("penumbra-worker") | {"connect", "version"}


def test_bash_completes_values():
    for words in (("serve", "--log-level"), ("serve", "--isa"), ("render", "--mode"), ("config",)):
        offered = bash_completes("_penumbra", "penumbra", *words, "") - {"--help"}
        assert offered and all(value in help_of("penumbra", words[0]) for value in offered)


def fish_options(program_name, command=None):
    """The long options that fish knows for a command."""
    found = set()
    for line in (DEPLOY / "completions/fish/penumbra.fish").read_text().splitlines():
        only = re.search(r'"__fish_seen_subcommand_from ([^"$]*)"', line)
        name = re.search(r" -l ([\w-]+)", line)
        if not line.startswith(f"complete -c {program_name} ") or not name or '"not ' in line:
            continue
        if only is None or command in only[1].split():
            found.add(name[1])
    return found - {"help"}


def zsh_options(command):
    """The long options of an arm of the case, its arrays put in."""
    text = (DEPLOY / "completions/zsh/_penumbra").read_text()
    arrays = dict(re.findall(r"^local -a (\w+)=\((.*?)\)$", text, flags=re.M | re.S))
    arm = re.search(rf"^    (?:\w+ \| )*{command}(?: \| \w+)*\) (.*?);;", text, flags=re.M | re.S)[1]
    while names := re.findall(r"\$(\w+)", arm):
        arm = arm.replace(f"${names[0]}", arrays[names[0]])
    return set(re.findall(r"(?:'|\)|,)--([a-z][\w-]*)", arm)) - {"help"}


@pytest.mark.parametrize("command", OF_PENUMBRA)
def test_fish_and_zsh_complete_the_options(command):
    assert fish_options("penumbra", command) == options("penumbra", command)
    assert zsh_options(command) == options("penumbra", command)


def test_fish_and_zsh_complete_the_commands_and_the_worker():
    fish = (DEPLOY / "completions/fish/penumbra.fish").read_text()
    zsh = (DEPLOY / "completions/zsh/_penumbra").read_text()
    assert set(re.search(r"^set -l commands (.*)$", fish, flags=re.M)[1].split()) == set(commands())
    assert set(re.findall(r"^    '(\w+):", zsh, flags=re.M)) == set(commands())
    worker = options("penumbra-worker") | {"connect", "version"}
    assert fish_options("penumbra-worker") == worker
    arm = re.search(r"== penumbra-worker \]\]; then(.*?)return", zsh, flags=re.S)[1]
    arrays = dict(re.findall(r"^local -a (\w+)=\((.*?)\)$", zsh, flags=re.M | re.S))
    arm = arm.replace("$daemon", arrays["daemon"]).replace("$here", arrays["here"])
    assert set(re.findall(r"(?:'|\)|,)--([a-z][\w-]*)", arm)) == worker


def test_the_configuration_file_has_every_setting_and_no_other():
    settings = options("penumbra", "serve") - NO_SETTINGS
    example = (DEPLOY / "penumbra.conf").read_text()
    page = manual("penumbra.conf.5")
    assert set(re.findall(r"^#([a-z-]+) = ", example, flags=re.M)) == settings
    assert set(re.findall(r"^\.It Cm ([a-z-]+) No =", page, flags=re.M)) == settings
