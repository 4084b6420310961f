"""Other processes of this machine."""

import os


def is_alive(process: int) -> bool:
    """Return whether a process of that id runs; elsewhere than on POSIX it is taken to."""
    if os.name != "posix":  # os.kill asks nothing there, it kills
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # somebody else's
        pass
    return True
