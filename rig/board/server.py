"""One page over HTTP, to any number of browsers: GET, nothing else.

Nothing of a request is kept, and no request makes the page: it is there when it is asked for.
"""

import gzip
import socket
from hashlib import sha256
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from rig.text_rows import read_rows

_PATIENCE_S = 20.0


class PageServer(ThreadingHTTPServer):
    """Serves the page that was shown last, each browser in a thread of its own.

    Parameters
    ----------
    listener
        Where browsers come in.
    script
        Digest of the page's only script, as a security policy has it.
    """

    daemon_threads = True
    page = "none", b"", b""
    """What tells the page from others, the page as it is, and compressed."""

    def __init__(self, listener: socket.socket, script: str) -> None:
        super().__init__(listener.getsockname()[:2], _Answers, bind_and_activate=False)
        self.socket.close()
        self.socket = listener
        self.headers = [(name, text.format(script=script)) for name, text in read_rows(__file__)]

    def show(self, page: str) -> None:
        """Have another page."""
        plain = page.encode("utf-8", "replace")
        tag = f'W/"{sha256(plain).hexdigest()[:20]}"'
        self.page = tag, plain, gzip.compress(plain, mtime=0)

    def handle_error(self, *_: object) -> None:
        """Leave out what a browser did that has gone."""


class _Answers(BaseHTTPRequestHandler):
    """What one browser asks."""

    server: PageServer
    timeout = _PATIENCE_S
    protocol_version = default_request_version = "HTTP/1.1"

    def parse_request(self) -> bool:
        """Refuse whatever is no wish to read; what comes behind a body is not read."""
        if not super().parse_request():
            return False
        if "Content-Length" in self.headers or "Transfer-Encoding" in self.headers:
            self.close_connection = True
        if self.command != "GET":
            self.send_error(HTTPStatus.METHOD_NOT_ALLOWED)
        return self.command == "GET"

    def do_GET(self) -> None:
        """Send the page, or that it is the one that the browser has."""
        tag, plain, packed = self.server.page
        if self.path.partition("?")[0] != "/":
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        is_kept = tag in self.headers.get("If-None-Match", "")
        is_packed = "gzip" in self.headers.get("Accept-Encoding", "")
        body = b"" if is_kept else packed if is_packed else plain
        self.send_response(HTTPStatus.NOT_MODIFIED if is_kept else HTTPStatus.OK)
        self.send_header("ETag", tag)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        if is_packed:
            self.send_header("Content-Encoding", "gzip")
        self.end_headers()
        self.wfile.write(body)

    def end_headers(self) -> None:
        """Add what every answer has."""
        for name, text in self.server.headers:
            self.send_header(name, text)
        super().end_headers()

    def log_message(self, *_: object) -> None:
        """Keep nothing of a request."""
