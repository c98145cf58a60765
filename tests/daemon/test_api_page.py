"""API.md says what there is."""

import re
from pathlib import Path

from rig.daemon import connection, rpc
from rig.daemon.lease import LEASE_S
from rig.daemon.service import METHODS
from rig.session.schema import APPLICATION_ID, SCHEMA_VERSION

PAGE = (Path(__file__).parents[2] / "rig/daemon/API.md").read_text("utf-8")


def rows(heading):
    table = PAGE.partition(f"## {heading}\n")[2].partition("\n## ")[0]
    return re.findall(r"^\| `(\w+)`", table, re.MULTILINE)


def test_every_method_is_on_the_page():
    assert rows("Methods") == list(METHODS)


def test_every_kind_of_error_is_on_the_page():
    kinds = re.search(r"^\| `kind` \| (.*) \|$", PAGE, re.MULTILINE).group(1)
    for kind in re.findall(r"`(\w+)`", kinds):
        error = {"data": {"kind": kind, "reason": "BUSY", "detail": 0}}
        assert type(rpc.error_of(error)).__name__ == kind


def test_the_page_has_the_numbers():
    text = " ".join(PAGE.split())
    assert f"Version {rpc.API}." in text
    assert f"not heard for {LEASE_S:g} s" in text
    assert f"within {connection.HELLO_S:g} s, or" in text
    assert f"| {connection.CLIENTS}; any further" in text
    assert f"| {rpc.WAITING_LIMIT}; more get" in text
    assert f"read | {rpc.UNREAD_LIMIT >> 20} MiB" in text
    assert f"has code −{-rpc.FAILURE} and" in text
    assert rpc.REQUEST_LIMIT == 64 << 10
    assert rpc.MESSAGE_LIMIT == 16 << 20


def test_the_page_knows_the_session_file():
    assert f"`application_id` 0x{APPLICATION_ID:X}, `user_version` {SCHEMA_VERSION}" in PAGE
    assert "`rig/session/tables.txt`" in PAGE
