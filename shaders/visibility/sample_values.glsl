// SPDX-License-Identifier: GPL-3.0-or-later

const uint NO_SEGMENT = 0x7FFFFFFFu;  // of samples without hair: beyond any possible index
