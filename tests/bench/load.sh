#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Polls and posts against a busy server; see load_driver.py.
exec /usr/bin/python3 "$(dirname "$0")/load_driver.py" "$@"
