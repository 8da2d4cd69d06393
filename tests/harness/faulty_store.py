"""A web server on loopback that answers ranges of a folder's files, or passes requests on, and fails as told."""

import http.client
import re
import threading
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from patience import patient

_RANGE = re.compile(r"bytes=(\d+)-(\d*)")


@dataclass
class Store:
    """A server at `address`, and what it was asked for.

    fault : "", or what becomes of each GET of a range: "cut" (the connection, after half), "short" (half, as if it were
        all), "slow" (nothing until `go_on`), "whole" (the file, whatever range was asked for), a status such as "403".
        "larger": sizes in answers to HEAD are too large.
    asked : (method, path, bytes of the answer) of each request.
    """

    folder: Path | None = None
    upstream: str = ""
    fault: str = ""
    address: str = ""
    asked: list = field(default_factory=list)
    go_on: threading.Event = field(default_factory=threading.Event)

    def answer(self, method, path, headers):
        """Status, headers and body of a request without faults."""
        if self.upstream:
            connection = http.client.HTTPConnection(self.upstream, timeout=patient(30))
            try:
                connection.request(method, path, headers=headers)
                answer = connection.getresponse()
                left = ("connection", "transfer-encoding", "server", "date")
                kept = {name: value for name, value in answer.getheaders() if name.lower() not in left}
                return answer.status, kept, answer.read()
            finally:
                connection.close()
        file = self.folder / path.lstrip("/")
        if not file.is_file():
            return 404, {"Content-Length": "0"}, b""
        data = file.read_bytes()
        asked = _RANGE.fullmatch(headers.get("Range", ""))
        if asked is None or self.fault == "whole":
            return 200, {"Content-Length": str(len(data)), "Accept-Ranges": "bytes"}, b"" if method == "HEAD" else data
        first, last = int(asked[1]), min(int(asked[2] or len(data)), len(data) - 1)
        said = {"Content-Length": str(last - first + 1), "Content-Range": f"bytes {first}-{last}/{len(data)}"}
        return 206, said, data[first : last + 1]


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_GET(self):
        store, fault = self.server.store, self.server.store.fault
        status, headers, body = store.answer(self.command, self.path, dict(self.headers))
        ranged = self.command == "GET" and "Range" in self.headers
        store.asked.append((self.command, self.path, len(body)))
        if ranged and fault == "slow":
            store.go_on.wait(60)
        if self.command == "HEAD" and fault == "larger":
            headers["Content-Length"] = str(int(headers["Content-Length"]) + 5000)
        if ranged and fault.isdigit():
            status, headers, body = int(fault), {"Content-Length": "0"}, b""
        if ranged and fault == "short":
            body = body[: len(body) // 2]
            headers["Content-Length"] = str(len(body))
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        if self.command == "GET":
            self.wfile.write(body[: len(body) // 2] if ranged and fault == "cut" else body)
        if ranged and fault == "cut":
            self.close_connection = True

    do_HEAD = do_GET

    def log_message(self, *words):
        """Say nothing."""


@contextmanager
def served(folder=None, upstream=""):
    """Serve a folder, or another server's answers, while the block lasts."""
    store = Store(folder, upstream)
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Handler)
    server.daemon_threads, server.store = True, store
    store.address = f"127.0.0.1:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield store
    finally:
        store.go_on.set()
        server.shutdown()
        server.server_close()
        thread.join(timeout=patient(30))
