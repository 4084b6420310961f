"""End the reads that a failed one leaves behind in zarr's event loop, before Python ends.

zarr reads the chunks of a window side by side. The first damaged chunk ends the read, and the other
reads stay in zarr's event loop. zarr closes that loop as Python ends, and each read that is still
in it then prints a traceback of its own after the line on the damage. Modules that read through
zarr import this one.
"""

import asyncio
import atexit
from concurrent.futures import CancelledError
from contextlib import suppress

from zarr.core import sync

_PATIENCE_S = 5  # s for the reads to end


def end_reads() -> None:
    """Cancel the reads that are left in zarr's event loop, and wait until they have ended."""
    loop = sync.loop[0]
    if loop is None or not loop.is_running():
        return
    with suppress(CancelledError, TimeoutError, RuntimeError):  # the loop may end meanwhile
        asyncio.run_coroutine_threadsafe(_cancel_others(), loop).result(_PATIENCE_S)


async def _cancel_others() -> None:
    others = asyncio.all_tasks() - {asyncio.current_task()}
    for task in others:
        task.cancel()
    await asyncio.gather(*others, return_exceptions=True)


# Python calls these in the reverse order: this one before that of zarr, which it has imported.
atexit.register(end_reads)
