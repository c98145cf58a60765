"""One page over HTTP, to any number of browsers: GET and HEAD, nothing else.

Nothing of a request is kept, and no request makes the page: it is there when it is asked for.
"""

from __future__ import annotations

import asyncio
import gzip
import re
from contextlib import suppress
from hashlib import sha256
from http import HTTPStatus
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import socket

_HEAD_BYTES = 1 << 13
_PATIENCE_S = 20.0  # for a whole request, and for its answer to be taken
_CONNECTIONS = 256
_WAITING_BYTES = 1 << 18
_CLOSES = re.compile(
    rb"\r\n(connection: *close|content-length: *[1-9]|transfer-encoding:)", re.IGNORECASE
)
_ALWAYS = """\
Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'; \
script-src '{script}'; connect-src 'self'; img-src data:; base-uri 'none'; \
form-action 'none'; frame-ancestors 'none'
X-Content-Type-Options: nosniff
Referrer-Policy: no-referrer
Cross-Origin-Resource-Policy: same-origin
Cache-Control: no-cache
Vary: Accept-Encoding
"""


class PageServer:
    """Serves what `page` is.

    Parameters
    ----------
    script
        Digest of the page's only script, as a security policy has it.
    """

    def __init__(self, script: str) -> None:
        self._headers = _ALWAYS.format(script=script)
        self._lines: dict[asyncio.StreamWriter, None] = {}  # whoever was heard last is last
        self.page = b""
        self._packed = b""
        self._tag = ""

    def show(self, page: str) -> None:
        """Have another page."""
        self.page = page.encode("utf-8", "replace")
        self._packed = gzip.compress(self.page, 6, mtime=0)
        self._tag = f'W/"{sha256(self.page).hexdigest()[:20]}"'

    async def serve(self, listener: socket.socket) -> None:
        """Serve until cancelled."""
        server = await asyncio.start_server(self._answer, sock=listener, limit=_HEAD_BYTES)
        await server.serve_forever()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one browser, until it has gone or says nothing."""
        writer.transport.set_write_buffer_limits(_WAITING_BYTES)
        try:
            stays = True
            while stays:
                self._lines.pop(writer, None)
                self._lines[writer] = None
                if len(self._lines) > _CONNECTIONS:
                    next(iter(self._lines)).transport.abort()
                    del self._lines[next(iter(self._lines))]
                async with asyncio.timeout(_PATIENCE_S):
                    try:
                        head = await reader.readuntil(b"\r\n\r\n")
                    except asyncio.LimitOverrunError:
                        head = b""
                    stays = bool(head) and _CLOSES.search(head) is None
                    writer.write(self._reply(head, stays=stays))
                    await writer.drain()
        except (OSError, EOFError, TimeoutError):
            writer.transport.abort()
        finally:
            self._lines.pop(writer, None)
            with suppress(OSError):
                writer.close()

    def _reply(self, head: bytes, *, stays: bool) -> bytes:
        """Return the answer to one request; empty is one whose head is too long."""
        line, _, fields = head.lower().partition(b"\r\n")
        method, _, target = head.partition(b"\r\n")[0].partition(b" ")
        more, body = "", b""
        if not head:
            status = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
        elif not re.fullmatch(rb"[a-z]+ [!-~]+ http/1\.[01]", line):
            status = HTTPStatus.BAD_REQUEST
        elif method not in {b"GET", b"HEAD"}:
            status, more = HTTPStatus.METHOD_NOT_ALLOWED, "Allow: GET, HEAD\n"
        elif not re.match(rb"/(\?\S*)? ", target):
            status = HTTPStatus.NOT_FOUND
        elif self._tag.encode().lower() in fields:
            status, more = HTTPStatus.NOT_MODIFIED, f"ETag: {self._tag}\n"
        else:
            status, more, body = HTTPStatus.OK, f"ETag: {self._tag}\n", self.page
            more += "Content-Type: text/html; charset=utf-8\n"
            if re.search(rb"accept-encoding:[^\r]*gzip", fields):
                more, body = f"{more}Content-Encoding: gzip\n", self._packed
        if status >= HTTPStatus.BAD_REQUEST:
            body = f"{status.value} {status.phrase}\n".encode()
            more += "Content-Type: text/plain; charset=utf-8\n"
        if status != HTTPStatus.NOT_MODIFIED:
            more += f"Content-Length: {len(body)}\n"
        more += "" if stays else "Connection: close\n"
        first = f"HTTP/1.1 {status.value} {status.phrase}\n"
        text = f"{first}{self._headers}{more}\n".replace("\n", "\r\n")
        return text.encode() + (b"" if method == b"HEAD" else body)
