# SPDX-License-Identifier: GPL-3.0-or-later
"""Kernels on several threads of a processor, where Warp runs them on one; on a GPU they are launched as they are."""

import os
import threading

import warp as wp

MOST_THREADS = 8
LEAST_SHARE = 4096  # pieces for which another thread is worth its start


def share_count(count, least_share, device):
    """How many threads share so many pieces of work, at least so many each."""
    return min(os.cpu_count() or 1, MOST_THREADS, 1 + count // least_share) if wp.get_device(device).is_cpu else 1


def in_threads(kernel, count, inputs, outputs, device):
    """Launch a kernel on as many shares as there are lists of outputs; its last input is where its share begins."""
    bounds = [count * share // len(outputs) for share in range(len(outputs) + 1)]
    if len(outputs) > 1:  # threads would compile it once each; on a processor a block is one thread
        kernel.module.load(wp.get_device(device), 1)

    def launch(share):
        first, end = bounds[share : share + 2]
        wp.launch(kernel, dim=end - first, inputs=[*inputs, first], outputs=outputs[share], device=device)

    others = [threading.Thread(target=launch, args=(share,)) for share in range(1, len(outputs))]
    for thread in others:
        thread.start()
    launch(0)
    for thread in others:
        thread.join()
