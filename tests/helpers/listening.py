"""Listening sockets of processes, seen from outside."""

import os
from pathlib import Path


def listening(pids) -> list[str]:
    """Listening sockets (TCP, and Unix ones with a name) of processes, seen from outside."""
    inodes = set()
    for pid in pids:
        for entry in Path(f"/proc/{pid}/fd").glob("*"):
            try:
                link = os.readlink(entry)
            except OSError:  # closed meanwhile
                continue
            if link.startswith("socket:["):
                inodes.add(link[8:-1])
    found = []
    for table in ("tcp", "tcp6", "udp", "udp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            cells = line.split()
            if cells[9] in inodes and (table.startswith("udp") or cells[3] == "0A"):
                found.append(f"{table} {cells[1]}")
    for line in Path("/proc/net/unix").read_text().splitlines()[1:]:
        cells = line.split()
        if cells[6] in inodes and int(cells[3], 16) & 0x10000:
            found.append(f"unix {' '.join(cells[7:])}")
    return found
