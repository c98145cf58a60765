# SPDX-License-Identifier: GPL-3.0-or-later
"""cffi's modules cannot be named in pyproject.toml."""

from setuptools import setup

setup(cffi_modules=["build_harness.py:ffi"])
