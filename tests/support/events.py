# SPDX-License-Identifier: Apache-2.0
"""A client of server-sent events."""
import collections
import http.client
import json
import time

import contract

Event = collections.namedtuple("Event", "name id data at")

SCHEMAS = {"progress": {"$ref": "#/components/schemas/Progress"},
           "held": {"$ref": "#/components/schemas/Held"},
           "tiles": {"$ref": "#/components/schemas/Tiles"},
           "done": {"anyOf": [{"$ref": "#/components/schemas/Render"}, {"type": "null"}]}}


class Stream:
    """The events of a render; each is held against the OpenAPI document."""

    def __init__(self, port, render, last_id=None, timeout=30):
        self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=timeout)
        fields = {} if last_id is None else {"Last-Event-ID": str(last_id)}
        path = f"/v1/renders/{render}/events"
        self.connection.request("GET", path, headers=fields)
        self.answer = self.connection.getresponse()
        self.status, self.headers = self.answer.status, self.answer.headers
        self.pings = 0
        if self.status != 200:
            contract.check("GET", path, self.status, self.headers, self.answer.read())
        else:
            contract.check("GET", path, self.status, self.headers, b"")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.connection.close()

    def __iter__(self):
        """Every event until the server ends the stream."""
        fields = {}
        while line := self.answer.readline().decode():
            name, _, value = line.rstrip("\n").partition(":")
            if line == "\n" and "event" in fields:
                data = json.loads(fields["data"])
                contract.validate(SCHEMAS[fields["event"]], data)
                yield Event(fields["event"], int(fields["id"]) if "id" in fields else None, data,
                            time.monotonic())
            self.pings += line.startswith(":")
            if line == "\n":
                fields = {}
            elif name:
                fields[name] = value.removeprefix(" ")
