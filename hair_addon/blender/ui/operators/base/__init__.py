# SPDX-License-Identifier: GPL-3.0-or-later
"""Base classes of operators: poll, long work, dialogs and file browsers."""
