# SPDX-License-Identifier: GPL-3.0-or-later
"""The rig's firmware in an emulated AVR, opened as ``emu://`` or through a pty.

GPL-3.0-or-later, since it links simavr; the rig itself never imports it.
"""
