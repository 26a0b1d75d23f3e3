# SPDX-License-Identifier: Apache-2.0
"""Runs a command as if the kernel lacked something: lacking.py landlock|landlock-boot|seccomp COMMAND...

A seccomp filter answers the calls in question as a kernel without would. Under `seccomp` no other filter
can be added after it."""
import ctypes
import errno
import os
import sys

LANDLOCK = (444, 445, 446)
SECCOMP, PRCTL = 317, 157
PR_SET_SECCOMP, PR_SET_NO_NEW_PRIVS = 22, 38
LOAD, EQUAL, RETURN = 0x20, 0x15, 0x06  # BPF: load a word, jump if equal, return
ALLOW, REFUSE = 0x7FFF0000, 0x00050000
NUMBER, ARGUMENT = 0, 16  # offsets in struct seccomp_data


class Instruction(ctypes.Structure):
    _fields_ = [("code", ctypes.c_ushort), ("yes", ctypes.c_ubyte), ("no", ctypes.c_ubyte), ("k", ctypes.c_uint)]


class Program(ctypes.Structure):
    _fields_ = [("length", ctypes.c_ushort), ("instructions", ctypes.POINTER(Instruction))]


def refuse(number, code):
    return [(EQUAL, 0, 1, number), (RETURN, 0, 0, REFUSE | code)]


FILTERS = {
    "landlock": [step for n in LANDLOCK for step in refuse(n, errno.ENOSYS)],
    "landlock-boot": [step for n in LANDLOCK for step in refuse(n, errno.EOPNOTSUPP)],
    "seccomp": [*refuse(SECCOMP, errno.ENOSYS), (EQUAL, 0, 3, PRCTL), (LOAD, 0, 0, ARGUMENT),
                *refuse(PR_SET_SECCOMP, errno.EINVAL)],
}


def main(what, *command):
    steps = [(LOAD, 0, 0, NUMBER), *FILTERS[what], (RETURN, 0, 0, ALLOW)]
    instructions = (Instruction * len(steps))(*steps)
    program = Program(len(steps), instructions)
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 or \
            libc.prctl(PR_SET_SECCOMP, 2, ctypes.byref(program), 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl")
    os.execv(command[0], command)


main(*sys.argv[1:])
