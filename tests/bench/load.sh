#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The coordinator under load; see load_driver.py.
exec /usr/bin/python3 "$(dirname "$0")/load_driver.py" "$@"
