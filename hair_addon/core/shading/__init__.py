# SPDX-License-Identifier: GPL-3.0-or-later
"""How a fibre scatters light: the reference that the shaders must match."""
