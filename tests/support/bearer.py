# SPDX-License-Identifier: Apache-2.0
"""A farm's tokens, and what their bearers see of it."""
import json
import subprocess

import farm


def token(data, name, scopes="submit,read"):
    run = subprocess.run([farm.program("penumbra"), "token", "add", name, "--scope", scopes, "--data", data],
                         capture_output=True, text=True, check=True, timeout=30)
    return run.stdout.strip()


class Client:
    """What one token's bearer sees of a farm."""

    def __init__(self, service, secret):
        self.service, self.secret = service, secret

    def ask(self, method, path, body=None, **fields):
        headers = {name.replace("_", "-"): value for name, value in fields.items()}
        if self.secret:
            headers["Authorization"] = f"Bearer {self.secret}"
        return self.service.request(method, path, body if body is None else json.dumps(body), headers)

    def post(self, body, **fields):
        answer = self.ask("POST", "/v1/renders", body, Content_Type="application/json", **fields)
        assert answer.status in (200, 202), answer.body
        return json.loads(answer.body)["id"]

    def status(self, render):
        return self.ask("GET", f"/v1/renders/{render}").status

    def state(self, render):
        return json.loads(self.ask("GET", f"/v1/renders/{render}").body)["state"]

    def done(self, render):
        farm.wait_for(lambda: self.state(render) == "done", 30, "the render")
        return render

    def listed(self, query=""):
        answer = self.ask("GET", f"/v1/renders?limit=100{query}")
        return [render["id"] for render in json.loads(answer.body)["renders"]]

    def pages(self):
        cursor, found = "", []
        while cursor is not None:
            page = json.loads(self.ask("GET", f"/v1/renders?limit=1{cursor and '&cursor=' + cursor}").body)
            found += [render["id"] for render in page["renders"]]
            cursor = page["next"]
        return found
