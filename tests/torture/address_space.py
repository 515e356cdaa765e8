"""How much memory a process that reads damaged files may take, and how much it took."""

from __future__ import annotations

import resource

#: A process has this much address space beyond what it begins with; beyond it there is a ``MemoryError``.
_ADDRESS_SPACE = 2**30


def limit_address_space() -> None:
    with open("/proc/self/statm") as file:
        pages = int(file.read().split()[0])
    most = pages * resource.getpagesize() + _ADDRESS_SPACE
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))


def peak(*, reset: bool = False) -> int:
    """Return the most RAM that this process had at once, since the last reset."""
    if reset:
        with open("/proc/self/clear_refs", "w") as file:
            file.write("5")
    with open("/proc/self/status") as file:
        (line,) = (line for line in file if line.startswith("VmHWM"))
    return int(line.split()[1]) * 1024
