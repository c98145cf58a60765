"""A command that needs a package which is no plain dependency names it, without a traceback."""

import sys

from rig import cli


def test_a_missing_package_is_named_with_a_command_that_brings_it(monkeypatch, capsys):
    for name in list(sys.modules):
        if name.startswith(("rig.commands.bench", "rig.bench", "mpmath")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mpmath", None)
    monkeypatch.setattr(sys, "executable", "/a lab/bin/python")
    assert cli.main(["bench", "stability"]) == 2
    wanted = "rig: this needs mpmath: '/a lab/bin/python' -m pip install mpmath\n"
    assert capsys.readouterr().err == wanted
