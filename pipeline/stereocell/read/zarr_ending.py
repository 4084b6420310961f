"""Cancel reads that a failed read leaves in zarr's event loop, before Python exits.

zarr reads the chunks of a window concurrently. The first damaged chunk ends the read, but the other
reads stay in zarr's event loop. The loop is closed when Python exits, and each remaining read then
prints a traceback after our line on the damage. Modules that read through zarr import this
module.
"""

import asyncio
import atexit
from concurrent.futures import CancelledError
from contextlib import suppress

from zarr.core import sync

_PATIENCE_S = 5  # seconds for which the program waits at its end until the reads have ended


def end_reads() -> None:
    """Cancel the reads that remain in zarr's event loop, and wait until they have ended."""
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


# Python calls exit functions in reverse order: this one runs before zarr's, imported above.
atexit.register(end_reads)
