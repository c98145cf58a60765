"""One page over HTTP, to any number of browsers: GET, nothing else.

Nothing of a request is kept, and no request makes the page: it is there when it is asked for.
"""

from __future__ import annotations

import asyncio
import gzip
import re
from contextlib import suppress
from hashlib import sha256
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import socket

_HEAD_BYTES = 1 << 13
_PATIENCE_S = 20.0  # for a whole request, and for its answer to be taken
_CONNECTIONS = 256
_WAITING_BYTES = 1 << 18
_REQUEST = re.compile(rb"[A-Za-z]+ [!-~]+ HTTP/1\.[01]\r\n")
_PAGE = re.compile(rb"GET /(\?\S*)? ")
_CLOSES = re.compile(rb"(?i)\r\n(connection: *close|content-length: *[1-9]|transfer-encoding:)")
_GZIP = re.compile(rb"(?i)\r\naccept-encoding:[^\r]*gzip")
_ANSWER = """\
HTTP/1.1 {status}
Content-Security-Policy: default-src 'none'; style-src 'unsafe-inline'; \
script-src '{script}'; connect-src 'self'; img-src data:; base-uri 'none'; \
form-action 'none'; frame-ancestors 'none'
X-Content-Type-Options: nosniff
Referrer-Policy: no-referrer
Cross-Origin-Resource-Policy: same-origin
Cache-Control: no-cache
Vary: Accept-Encoding
Content-Type: text/html; charset=utf-8
Content-Length: {length}
Connection: {connection}

"""


class PageServer:
    """Serves the page that was shown last.

    Parameters
    ----------
    script
        Digest of the page's only script, as a security policy has it.
    """

    def __init__(self, script: str) -> None:
        self._script = script
        self._page, self._packed, self._tag = b"", b"", ""
        self._lines: dict[asyncio.StreamWriter, None] = {}  # whoever was heard last is last

    def show(self, page: str | None) -> None:
        """Have another page; `None` for the same."""
        if page is not None:
            self._page = page.encode("utf-8", "replace")
            self._packed = gzip.compress(self._page, mtime=0)
            self._tag = f'W/"{sha256(self._page).hexdigest()[:20]}"'

    async def start(self, listener: socket.socket) -> asyncio.Server:
        """Begin to serve."""
        return await asyncio.start_server(self._serve, sock=listener, limit=_HEAD_BYTES)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one browser, until it has gone or says nothing."""
        writer.transport.set_write_buffer_limits(_WAITING_BYTES)
        head = b" "
        try:
            while head and _CLOSES.search(head) is None:
                self._lines.pop(writer, None)
                self._lines[writer] = None
                if len(self._lines) > _CONNECTIONS:
                    longest_silent = next(iter(self._lines))
                    longest_silent.transport.abort()
                    del self._lines[longest_silent]
                async with asyncio.timeout(_PATIENCE_S):
                    head = b""
                    with suppress(asyncio.LimitOverrunError):
                        head = await reader.readuntil(b"\r\n\r\n")
                    writer.write(self._answer(head))
                    await writer.drain()
        except (OSError, EOFError, TimeoutError):
            writer.transport.abort()
        finally:
            self._lines.pop(writer, None)
            with suppress(OSError):
                writer.close()

    def _answer(self, head: bytes) -> bytes:
        """Return the answer to one request; empty is one whose head is too long."""
        body = b""
        if not head:
            status = "431 Request Header Fields Too Large"
        elif not _REQUEST.match(head):
            status = "400 Bad Request"
        elif not head.startswith(b"GET "):
            status = "405 Method Not Allowed\nAllow: GET"
        elif not _PAGE.match(head):
            status = "404 Not Found"
        elif self._tag.encode() in head:
            status = f"304 Not Modified\nETag: {self._tag}"
        else:
            status, body = f"200 OK\nETag: {self._tag}", self._page
            if _GZIP.search(head):
                status, body = f"{status}\nContent-Encoding: gzip", self._packed
        closes = not head or _CLOSES.search(head)
        text = _ANSWER.format(
            status=status,
            script=self._script,
            length=len(body),
            connection="close" if closes else "keep-alive",
        )
        return text.replace("\n", "\r\n").encode() + body
