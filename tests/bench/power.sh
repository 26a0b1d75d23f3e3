#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Goes on with the power cuts; see tests/bench/chaos.py.
PEN_LONG=power exec /usr/bin/python3 "$(dirname "$0")/chaos.py"
