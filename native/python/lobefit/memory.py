"""Memory that is asked for before work begins that could not say that it got too little."""

import mmap


def need(size: int) -> None:
    """Raises MemoryError where this process cannot get `size` more bytes, of which none is kept.

    Blender, and the system where it starts a thread, end the process when they get no memory.
    """
    try:
        mmap.mmap(-1, size).close()
    except OSError:
        raise MemoryError from None
