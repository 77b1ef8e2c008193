"""Cases in (JSON), observables out (CSV): what every rig shares.

By hand, on one rig's list of cases:     yade -x -n yade_scripts/rebound.py cases.json observables.csv
A list to start from:                    yade -x -n yade_scripts/rebound.py --example cases.json
A rig of your own:                       yade -x -n yade_scripts/case.py my_rig.py cases.json observables.csv
By the package, on a campaign of rigs:   yade -x -n yade_scripts/case.py campaign.json

A case is an object with `id`, `contact_law`, `seed` and the groups `parameters`, `effects`, `conditions`, `numerics`;
each group holds exactly the names its rig declares. A rig is a file with a declaration `RIG` and `simulate(case)`,
which returns {observable: value} or raises `Failed(reason)`.
"""

import csv
import errno
import fcntl
import gc
import importlib.util
import io
import json
import math
import os
import select
import signal
import socketserver
import sys
import time
import zlib
from pathlib import Path

GROUPS = ("parameters", "effects", "conditions", "numerics")
TIMINGS = ["id", "seconds"]
EXPECTED_CASES = "expected a list of cases; `--example cases.json` writes one to start from"
CLAIM_BYTES = 16
NO_MEMORY, CANNOT_GO_ON = 70, 71  # exit statuses: the machine failed, not the case
DISK_OR_SYSTEM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS, errno.EMFILE, errno.ENFILE}


class Failed(Exception):
    """A simulation ran but its result is no observable; the message says why."""


def quantity(default: float, low: float, high: float, unit: str, meaning: str) -> dict:
    """Declaration of a number a rig takes: its default, its range, its unit, what it is."""
    return {"default": float(default), "min": float(low), "max": float(high), "unit": unit, "meaning": meaning}


def choice(default: str, options, meaning: str) -> dict:
    """Declaration of a condition that is a word: its default, the words there are, what it is."""
    return {"default": default, "options": tuple(options), "unit": "", "meaning": meaning}


def load(file: Path, effects=()):
    """The rig (or effect) in a file, as a module; a rig also takes the effects in other files."""
    spec = importlib.util.spec_from_file_location(Path(file).stem, file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for effect in map(load, effects):
        name = effect.EFFECT["name"]
        module.EFFECTS = (*(own for own in module.EFFECTS if own.EFFECT["name"] != name), effect)
        module.RIG["effects"] = {**module.RIG["effects"], name: effect.EFFECT["parameters"]}
    return module


def flat(case: dict) -> dict:
    """A case as one row: groups merged, an effect's parameter as `effect.parameter`."""
    row = {name: case[name] for name in ("id", "contact_law", "seed")}
    for group in ("parameters", "conditions", "numerics"):
        row.update(case[group])
    for effect, values in case["effects"].items():
        row.update({f"{effect}.{name}": value for name, value in values.items()})
    return row


def columns(rig: dict) -> list[str]:
    """The columns of a rig's CSV: id, inputs, observables, status."""
    return list(flat(example(rig))) + list(rig["observables"]) + ["status"]


def example(rig: dict) -> dict:
    """A complete case with every default."""
    groups = {group: {k: v["default"] for k, v in rig[group].items()} for group in GROUPS if group != "effects"}
    return {"id": "example", "contact_law": rig["contact_laws"][0], "seed": 0, **groups, "effects": absent(rig)}


def absent(rig: dict) -> dict:
    """A rig's effects, none of them present: amounts at the value that means absent, shapes at their default."""
    return {
        effect: {name: quantity["absent" if "absent" in quantity else "default"] for name, quantity in values.items()}
        for effect, values in rig["effects"].items()
    }


def check(case: dict, rig: dict) -> None:
    """Refuse a case with a missing or unknown name, a value that is no finite number, or a word that is no option."""
    expected = example(rig)

    def compare(where: str, given, wanted):
        if not isinstance(given, dict):
            raise ValueError(f"{where}: expected an object, got {given!r}")
        for kind, names in (("unknown", set(given) - set(wanted)), ("missing", set(wanted) - set(given))):
            if names:
                raise ValueError(f"{where}: {kind} {', '.join(sorted(names))}; expected {', '.join(sorted(wanted))}")

    compare("case", case, expected)
    for group in GROUPS:
        compare(group, case[group], expected[group])
    for effect, values in case["effects"].items():
        compare(f"effect {effect}", values, expected["effects"][effect])
    words = {name: declared["options"] for name, declared in rig["conditions"].items() if "options" in declared}
    words["contact_law"] = rig["contact_laws"]
    for name, value in flat(case).items():
        if name in words:
            if value not in list(words[name]):
                raise ValueError(f"{name}: expected one of {', '.join(words[name])}, got {value!r}")
        elif name == "id":
            if not isinstance(value, (str, int)) or value == "":
                raise ValueError(f"id: expected a name, got {value!r}")
        elif not (isinstance(value, (int, float)) and abs(value) <= sys.float_info.max):  # neither NaN nor 10**400
            raise ValueError(f"{name}: expected a finite number, got {value!r}")


def run(case: dict, module) -> dict:
    """One case, as a row with its observables and its status: `ok` or the reason there is none."""
    from yade_scripts import acting  # not at the top, which also runs before the package can be found

    rig = module.RIG
    try:
        check(case, rig)
        observed = module.simulate(case)
        if set(observed) != set(rig["observables"]):
            raise ValueError(f"simulate returned {sorted(observed)}, expected {sorted(rig['observables'])}")
        in_order = {name: observed[name] for name in rig["observables"]}
        observed = acting.read_of(getattr(module, "EFFECTS", ()), case, in_order, rig["name"])
        bad = [name for name, value in observed.items() if value is not None and not math.isfinite(value)]
        status = f"not a number: {', '.join(bad)}" if bad else "ok"
    except Failed as failure:
        observed, status = {}, str(failure) or "failed without a reason"
    except (MemoryError, ImportError):  # this machine or this YADE cannot do it: no outcome of the case
        raise
    except Exception as error:  # one case's mistake is that case's outcome; its neighbours go on
        if isinstance(error, OSError) and error.errno in DISK_OR_SYSTEM:
            raise
        observed, status = {}, f"{type(error).__name__}: {error}"
    if status != "ok":
        observed = {}
    groups = {**{group: {} for group in GROUPS}, "contact_law": "", "seed": "", **case}
    return {
        **flat(groups),
        **{name: observed.get(name) for name in rig["observables"]},
        "status": one_line(status),
    }


def one_line(text: str) -> str:
    """Text that stands in one CSV cell on one line."""
    return " ".join(str(text).split())[:300]


def line(row: dict, names: list[str]) -> bytes:
    """A row as CSV bytes; floats with every digit, an observable that does not apply blank."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(["" if row.get(n) is None else row.get(n) for n in names])
    return text.getvalue().encode()


def sealed(text: bytes) -> bytes:
    """A line with its checksum (CRC-32) as one more cell."""
    body = text.rstrip(b"\n")
    return b"%s,%08x\n" % (body, zlib.crc32(body))


def unsealed(text: bytes) -> bytes | None:
    """A line without its checksum; None where it is torn, altered or not ours."""
    body, _, checksum = text.rpartition(b",")
    return body if body and checksum == b"%08x" % zlib.crc32(body) else None


class Table:
    """A CSV file that several processes append whole lines to; in a store each line carries its checksum."""

    def __init__(self, file: Path, names: list[str], checked: bool = False):
        self.names, self.checked = names, checked
        self.descriptor = os.open(file, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        fcntl.flock(self.descriptor, fcntl.LOCK_EX)
        size = os.fstat(self.descriptor).st_size
        if size == 0:
            head = [*names, "crc32"] if checked else names
            os.write(self.descriptor, line(dict(zip(head, head, strict=True)), head))
        elif os.pread(self.descriptor, 1, size - 1) != b"\n":
            os.write(self.descriptor, b"\n")  # close the line that a lost machine left torn
        fcntl.flock(self.descriptor, fcntl.LOCK_UN)

    def append(self, row: dict) -> None:
        """Add a row whole, or leave the file as it was and raise OSError."""
        data = line(row, self.names)
        self.add(sealed(data) if self.checked else data)

    def add(self, data: bytes) -> None:
        """Add lines that are bytes already, all or none."""
        fcntl.flock(self.descriptor, fcntl.LOCK_EX)
        try:
            size = os.fstat(self.descriptor).st_size
            if os.write(self.descriptor, data) != len(data):
                os.ftruncate(self.descriptor, size)
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        finally:
            fcntl.flock(self.descriptor, fcntl.LOCK_UN)


def claims(file: Path, total: int, worker: str):
    """Indices of cases nobody has claimed, claimed one at a time; record k of the file names case k's worker."""
    descriptor = os.open(file, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
    while True:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        index = os.fstat(descriptor).st_size // CLAIM_BYTES
        if index < total:
            os.write(descriptor, f"{worker:>{CLAIM_BYTES - 1}}\n".encode())
        fcntl.flock(descriptor, fcntl.LOCK_UN)
        if index >= total:
            return
        yield index


def work(jobs, modules: dict, tables: dict, timings: Table) -> None:
    """Simulate (rig name, case) after (rig name, case), each row written as soon as it is known."""
    for rig, case in jobs:
        start = time.perf_counter()
        tables[rig].append(run(case, modules[rig]))
        timings.append({"id": case.get("id", ""), "seconds": f"{time.perf_counter() - start:.6f}"})


def cases_in(file: Path, rig: dict) -> list[dict]:
    """The cases of a rig in a JSON file, each checked; ValueError or OSError where the file is nothing of the kind."""
    text = file.read_text(encoding="utf-8-sig")
    if not text.strip():
        raise ValueError(f"{file}: is empty; {EXPECTED_CASES}")
    try:
        cases = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{file}: no valid JSON: {error}; {EXPECTED_CASES}") from None
    if not isinstance(cases, list) or not cases:
        kind = "an empty list" if cases == [] else f"{type(cases).__name__} {str(cases)[:40]!r}"
        raise ValueError(f"{file}: got {kind}; {EXPECTED_CASES}")
    for number, case in enumerate(cases, start=1):
        name = repr(case["id"]) if isinstance(case, dict) and "id" in case else f"number {number}"
        try:
            check(case, rig)
        except ValueError as error:
            raise ValueError(f"{file}: case {name}: {error}") from None
    return cases


def refuse_foreign(file: Path, names: list[str]) -> None:
    """Refuse to write over a file that is no table with these columns; an empty one may go."""
    header = line(dict(zip(names, names, strict=True)), names)
    if file.is_dir():
        raise ValueError(f"{file}: is a folder; name a file to write")
    if not file.parent.is_dir():
        raise ValueError(f"{file}: there is no folder {file.parent}; make it first")
    if file.exists() and file.stat().st_size:
        with open(file, "rb") as stream:
            if stream.readline(len(header)) != header:
                raise ValueError(f"{file}: is no table that this rig wrote; move it away or name another file")


def by_hand(rig_file: Path, arguments: list[str]) -> int:
    """A rig called by hand: `cases.json observables.csv`, or `--example cases.json`.

    What the user gave wrongly is told in one line on stderr, with exit status 2, and no file is touched.
    """
    try:
        if not rig_file.is_file():
            raise ValueError(f"{rig_file}: no such file; expected a rig, a file with RIG and simulate(case)")
        if len(arguments) != 2:
            raise ValueError(f"usage: yade -x -n {rig_file.name} cases.json observables.csv (or --example cases.json)")
        module = load(rig_file)
        if arguments[0] == "--example":
            write_example(Path(arguments[1]), module.RIG)
            return 0
        given, observables = Path(arguments[0]), Path(arguments[1])
        timings = observables.parent / "timings.csv"
        if not given.is_file():
            raise ValueError(f"{given}: {'is no file' if given.exists() else 'no such file'}; {EXPECTED_CASES}")
        for written in (observables, timings):
            if written.exists() and written.samefile(given):
                raise ValueError(f"{given}: would be written over by {written}; name another file for the observables")
        if observables.name == timings.name:
            raise ValueError(f"{observables}: is the name of the table of times; name another file for the observables")
        cases = cases_in(given, module.RIG)
        refuse_foreign(observables, columns(module.RIG))
        refuse_foreign(timings, TIMINGS)
        for old in (observables, timings):
            old.unlink(missing_ok=True)
        table, times = Table(observables, columns(module.RIG)), Table(timings, TIMINGS)
    except (ValueError, OSError) as error:
        print(one_line(str(error)), file=sys.stderr)
        return 2
    name = module.RIG["name"]
    work(((name, case) for case in cases), {name: module}, {name: table}, times)
    return 0


def write_example(file: Path, rig: dict) -> None:
    """A list of one complete case to start from; ValueError where a file of other content is in the way."""
    text = json.dumps([example(rig)], indent=1) + "\n"
    if file.exists() and (not file.is_file() or file.read_text(encoding="utf-8", errors="replace") not in ("", text)):
        raise ValueError(f"{file}: exists already; name another file for the example")
    file.write_text(text, encoding="utf-8")


def campaign(file: Path) -> int:
    """A campaign of the package: cases of several rigs, shared with other processes through the claims file."""
    task = json.loads(file.read_text())
    modules = {name: load(rig["file"], rig["effects"]) for name, rig in task["rigs"].items()}
    cases = task["cases"]
    mine = claims(Path(task["claims"]), len(cases), os.environ["PELLET_STUDY_WORKER"])
    jobs = ((cases[index].pop("rig"), cases[index]) for index in mine)
    try:
        tables = {n: Table(rig["table"], columns(modules[n].RIG), checked=True) for n, rig in task["rigs"].items()}
        work(jobs, modules, tables, Table(task["timings"], TIMINGS))
    except (MemoryError, ImportError, OSError) as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr, flush=True)
        return NO_MEMORY if isinstance(error, MemoryError) else CANNOT_GO_ON
    return 0


def close_servers() -> None:
    """Close the python prompt and the XMLRPC server that YADE opens on every interface."""
    for thing in gc.get_objects():
        if isinstance(thing, socketserver.BaseServer):
            thing.shutdown()
            thing.server_close()


def die_with_driver() -> None:
    """End when the driver ends, however it ends: its end of the pipe closes, and the system kills this process.

    The system does it, not a thread of this process, which a simulation that never returns to Python would hold up.
    """
    if "PELLET_STUDY_LIFELINE" in os.environ:
        lifeline = int(os.environ["PELLET_STUDY_LIFELINE"])
        fcntl.fcntl(lifeline, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(lifeline, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(lifeline, fcntl.F_SETFL, os.O_ASYNC)
        if select.select([lifeline], [], [], 0)[0]:  # it has ended already
            os._exit(1)


def main(arguments: list[str]) -> int:
    """What YADE runs: a campaign, or a rig's file and what was given with it."""
    from yade import O

    try:
        os.rmdir(os.path.dirname(O.tmpFilename()))  # YADE leaves this folder behind; nothing here uses it
    except OSError:
        pass
    die_with_driver()
    close_servers()
    if len(arguments) == 1 and arguments[0].endswith(".json"):
        return campaign(Path(arguments[0]))
    return by_hand(Path(arguments[0]).resolve(), arguments[1:])


if __name__ == "__main__":
    _here = Path(sys.argv[0]).resolve().parent  # YADE leaves __file__ unset
    _spec = importlib.util.spec_from_file_location(
        "yade_scripts", _here / "__init__.py", submodule_search_locations=[str(_here)]
    )
    sys.modules["yade_scripts"] = importlib.util.module_from_spec(_spec)  # its parent folder stays off the path
    from yade_scripts.case import main as _main

    sys.exit(_main(sys.argv[1:]))
