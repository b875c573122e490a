# SPDX-License-Identifier: GPL-3.0-or-later
"""Bases of operators: when they can run, long work, dialogs and file browsers."""
