"""Reads mutated files in a process that may not import anybody's code, open sockets or start processes."""

import base64
import contextlib
import copy
import io
import json
import os
import pathlib
import random
import shutil
import sys
import time

import pandas as pd
from submissions import parts_of, write

from caregiver_mj import cli
from caregiver_mj.caregivers.answers import replayed

ODD = [None, True, -1, 0, 5, 10**18, 10**400, 1e308, float("nan"), float("inf"), "", "\x1b[31m\u202e", "x" * 10**5]
ODD += [[], {}]
ODD += ["antigravity:x", "os:abort", "http://127.0.0.1:9/x", "chat:X", "[/foo]", "venv.__main__:x:0.5"]
ODD += ["](javascript:a)", "$\\frac{$"]
ODD += [[[[[]]]], {"a": [{}]}, ["none"], "none", "floor", "house", "grid", "../../etc/passwd", "/dev/zero", "1" * 5000]
SEEN = []
FORBIDDEN = ("socket.", "subprocess.Popen", "os.exec", "os.system", "os.posix_spawn", "os.fork")
STRANGE = ("antigravity", "venv", "http.server", "this")


def watch(event, arguments):
    if event.startswith(FORBIDDEN):
        SEEN.append(f"{event} {arguments!r}"[:100])
    elif event == "import" and str(arguments[0]) in STRANGE:
        SEEN.append(f"import {arguments[0]}")
    elif event == "open" and isinstance(arguments[0], str) and arguments[1] and set("wax+") & set(str(arguments[1])):
        place = pathlib.Path(arguments[0]).resolve()
        if not place.is_relative_to(SCRATCH.resolve()) and "cache" not in str(place) and str(place) != os.devnull:
            SEEN.append(f"write {place}"[:100])


def mutated(value, lots):
    """A JSON value with something in it replaced or left out."""
    if not isinstance(value, dict | list) or not value or lots.random() < 0.1:
        if isinstance(value, str) and value and lots.random() < 0.3:
            place = lots.randrange(len(value))
            return value[:place] + chr(lots.choice([0, 27, 65, 0x202E, 0xD800, 0x1F600])) + value[place + 1 :]
        return copy.deepcopy(lots.choice(ODD))
    key = lots.choice(sorted(value) if isinstance(value, dict) else range(len(value)))
    changed = copy.copy(value)
    if lots.random() < 0.15:
        del changed[key]
    else:
        changed[key] = mutated(value[key], lots)
    return changed


def flipped(content, lots):
    found = bytearray(content)
    if lots.random() < 0.3:
        return bytes(found[: lots.randrange(len(found) + 1)])
    for _ in range(lots.choice([1, 1, 3, 30])):
        if found:
            found[lots.randrange(len(found))] = lots.randrange(256)
    return bytes(found)


def submission(path, lots):
    given = GIVEN / "a.submission"
    if lots.random() < 0.2:
        path.write_bytes(flipped(given.read_bytes(), lots))
        return
    parts = parts_of(given)
    name = lots.choice([*parts, "run.json", "run.json"])
    if name.startswith("episodes") and lots.random() < 0.5:
        answers = base64.b64decode(parts[name]["answers"])
        parts[name]["answers"] = base64.b64encode(flipped(answers, lots)).decode()
    else:
        parts[name] = mutated(parts[name], lots)
    write(path, parts)


def folder(path, lots, given):
    shutil.copytree(GIVEN / given, path)
    files = sorted(one for one in path.rglob("*") if one.is_file() and one.suffix in (".json", ".parquet"))
    file = lots.choice([*files, path / "run.json", path / "summary.json"])
    if file.suffix == ".json" and lots.random() < 0.8:
        file.write_text(json.dumps(mutated(json.loads(file.read_text()), lots)))
    elif file.suffix == ".parquet" and lots.random() < 0.5:
        table = pd.read_parquet(file)
        odd = [-1, 10**18, float("nan"), "\x1b[31m", "[/foo]", None]
        table[lots.choice(list(table))] = lots.choice(odd)
        table.to_parquet(file)
    else:
        file.write_bytes(flipped(file.read_bytes(), lots))


def command(reader, lots, place):
    tiny = GIVEN / "tiny.txt"
    if reader in ("verify", "leaderboard"):
        submission(place / "a.submission", lots)
        return [reader, place / "a.submission" if reader == "verify" else place]
    if reader == "house":
        (place / "a.txt").write_bytes(flipped(tiny.read_bytes() * lots.choice([1, 1, 1000]), lots))
        return ["house", "check", place / "a.txt"]
    folder(place / "run", lots, "acted" if reader == "answers" else "run")
    evaluate = ["evaluate", "--world", "grid", "--house", tiny, "--epsilon", 1, "--episodes", 2, "--resume"]
    return {
        "report": ["report", place / "run"],
        "compare": ["compare", place / "run", GIVEN / "run"],
        "pool": ["pool", place / "run", GIVEN / "other", "--out", place / "out"],
        "submit": ["submit", place / "run", "--out", place / "b.submission"],
        "resume": [*evaluate, "--caregiver", "none", "nearest", "--out", place / "run"],
        "answers": ["render", "--answers", place / "run", "--caregiver", "nearest", "--out", place / "a.mp4"],
    }[reader]


def most_memory():
    """Return the most memory that this process has held, in megabytes, not what it was forked from had."""
    lines = pathlib.Path("/proc/self/status").read_text().splitlines()
    return round(next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1000)


def read(reader):
    """Read changed files; return how many were refused, and the longest time, in seconds of the processor."""
    refused, worst = 0, 0.0
    for number in range(COUNT):
        place = SCRATCH / f"{reader}{number}"
        place.mkdir()
        argv, out, err = command(reader, random.Random(number), place), io.StringIO(), io.StringIO()
        start = time.process_time()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = cli.main([*map(str, argv)])
        worst = max(worst, time.process_time() - start)
        text = err.getvalue()
        assert status in (0, 2), (reader, number, status, text[-500:])
        assert "Traceback" not in text, (reader, number, text)
        if status:
            (*_, last) = (line for line in text.splitlines() if not line.startswith("  "))  # below it, a plan's line
            assert last.startswith("caregiver-mj: "), (reader, number, last)
            assert len(last) < 1100, (reader, number, last[:200])
            assert all(line.isprintable() for line in text.splitlines()), (reader, number, text)
        assert "\x1b[31m" not in out.getvalue() + text, (reader, number)
        refused += bool(status)
        shutil.rmtree(place)
    return refused, worst


def main():
    if "answers" in READERS:
        from caregiver_mj.viz import film  # takes seconds to import

        film.render_episode = lambda out, spec, answers, **_: replayed(spec.plan, answers)  # without a picture
    sys.addaudithook(watch)
    for reader in READERS:
        refused, worst = read(reader)
        told = {"reader": reader, "tried": COUNT, "refused": refused, "read": COUNT - refused}
        told |= {"megabytes": most_memory(), "seconds": round(worst, 1), "seen": sorted(set(SEEN))}
        print(json.dumps(told), flush=True)


if __name__ == "__main__":
    READERS, COUNT = sys.argv[1].split(","), int(sys.argv[2])
    GIVEN, SCRATCH = map(pathlib.Path, sys.argv[3:5])
    main()
