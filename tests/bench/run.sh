#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Measures everything that tests/bench/RESULTS.md tells, and writes it; see results.py.
exec /usr/bin/python3 "$(dirname "$0")/results.py" "$@"
