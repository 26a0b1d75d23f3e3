#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Goes on with the spoiled wires; see tests/bench/chaos.py.
PEN_LONG=wire exec /usr/bin/python3 "$(dirname "$0")/chaos.py"
