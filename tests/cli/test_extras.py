"""A command whose extra is not installed says which one, without a traceback."""

from __future__ import annotations

import sys

import pytest

from rig import cli


@pytest.mark.parametrize(("package", "extra", "command"), [
    ("scipy", "bench", ["bench", "precision", "-o", "unused"]),
    ("mpmath", "bench", ["bench", "stability"]),
])  # fmt: skip
def test_a_missing_extra_is_named(package, extra, command, monkeypatch, capsys):
    for name in list(sys.modules):
        if name.startswith(("rig.commands.bench", "rig.bench", f"{package}.")) or name == package:
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    assert cli.main(command) == 2
    said = capsys.readouterr().err
    assert package in said
    assert f"chainrig[{extra}]" in said
