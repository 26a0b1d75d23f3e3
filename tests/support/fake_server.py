# SPDX-License-Identifier: Apache-2.0
"""A server that answers what a test tells it, to show a client the answers that a real one gives
seldom or never.

    with FakeServer({("GET", "/v1/farm"): (200, {"rate": 0})}) as server:
        ...
        server.requests  # [(method, path, body), ...]

An answer is (status, body) or a list of them, of which the last is repeated; a body that is a dict
is sent as JSON, bytes as they are.
"""
import http.server
import json
import threading


class FakeServer:
    def __init__(self, answers, port=0):
        self.answers = {key: list(value) if isinstance(value, list) else [value]
                        for key, value in answers.items()}
        self.requests = []
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", port), self._handler())
        self.port = self.server.server_port
        self.url = f"http://127.0.0.1:{self.port}"
        self.thread = threading.Thread(target=self.server.serve_forever, args=(0.01,))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.thread.join()
        self.server.server_close()

    def answer(self, method, path):
        waiting = self.answers.get((method, path), [(404, {"detail": "no such thing"})])
        return waiting.pop(0) if len(waiting) > 1 else waiting[0]

    def _handler(self):
        fake = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def handle_any(self):
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                fake.requests.append((self.command, self.path, body))
                status, answer = fake.answer(self.command, self.path)
                data = answer if isinstance(answer, bytes) else json.dumps(answer).encode()
                self.send_response(status)
                self.send_header("Content-Length", str(len(data)))
                self.end_headers()
                self.wfile.write(data)

            do_GET = do_POST = do_PATCH = do_PUT = handle_any

            def log_message(self, *_):
                pass

        return Handler
