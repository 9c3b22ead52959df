"""A sweep in parts: each runs its share into a store of its own, and the stores become one that is as if it had run whole."""

import os
import re
import sqlite3
import subprocess
import sys

import pytest
import sweep_toy
from sweep_runs import ROOT, same, stored
from sweep_toy import Parameters

from buckler.studies.kit.cli import main
from buckler.studies.sweeping.after import Merged, merge
from buckler.studies.sweeping.store import StoreError
from buckler.studies.sweeping.sweep import Part, sweep

CASES = [Parameters(length=i / 10, noise=1, ending=e) for i in range(5) for e in ("fine", "suspect", "raises")]


def parts(folder, of, **options):
    """Stores of all parts, the last one first."""
    paths = []
    for number in range(of, 0, -1):
        paths.append(folder / f"{number}.sqlite")
        sweep(sweep_toy, CASES, workers=0, store=paths[-1], part=Part(number, of), **options)
    return paths


def test_parts_make_the_whole(tmp_path):
    paths = parts(tmp_path, 4, signals=True)
    assert sum(len(stored(path)) for path in paths) == len(CASES)
    assert merge(paths, tmp_path / "all.sqlite") == Merged(15, 15)
    whole = sweep(sweep_toy, CASES, workers=0, signals=True)
    merged = sweep(sweep_toy, CASES, workers=0, store=tmp_path / "all.sqlite", signals=True)
    assert same(merged) == stored(tmp_path / "all.sqlite") == same(whole)
    assert all((a.arrays()["force"] == b.arrays()["force"]).all() for a, b in zip(merged, whole, strict=True) if a.signals)


def test_what_is_missing_is_taken_later_and_merging_twice_changes_nothing(tmp_path):
    paths = parts(tmp_path, 3)
    out = tmp_path / "new" / "all.sqlite"
    assert merge(paths[:2], out) == Merged(15, 10)
    assert merge(paths, out) == merge(paths, out) == Merged(15, 15)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("UPDATE cases SET metrics = replace(metrics, '\"value\":', '\"value\":1')", "contradicts another part in case 0: "),
        ("UPDATE cases SET status = 'FAILED'", "contradicts another part in case 0: FAILED, elsewhere OK"),
        ("UPDATE about SET value = '\"other\"' WHERE name = 'study'", "of another sweep than .*: study other, not "),
        ("UPDATE about SET value = replace(value, '\"numpy\": \"', '\"numpy\": \"9') WHERE name = 'versions'", "numpy 9"),
        ("PRAGMA user_version = 7", "has format 7"),
    ],
)
def test_contradictions_are_refused_and_leave_nothing_behind(tmp_path, change, message):
    first, second, out = tmp_path / "1.sqlite", tmp_path / "2.sqlite", tmp_path / "all.sqlite"
    for path in (first, second):
        sweep(sweep_toy, CASES[:3], workers=0, store=path)
    with sqlite3.connect(second) as connection:
        connection.execute(change)
    with pytest.raises(StoreError, match=message):
        merge([first, second], out)
    assert not out.exists()
    merge([first], out)
    before = stored(out)
    with pytest.raises(StoreError, match=message):
        merge([second], out)
    assert stored(out) == before


def test_parts_on_the_command_line(toy, capsys):
    folder, out = toy.folder, toy.store
    for number, count in ((1, 3), (2, 2)):
        assert toy("--vary", "length=0:1:5", "--part", f"{number}/2") == 0
        assert f"toy: part {number} of 2, {count} cases ({count} OK)" in capsys.readouterr().out
    assert {path.name for path in folder.iterdir()} == {"part-1-of-2.sqlite", "part-2-of-2.sqlite"}
    assert main(argv=["merge", *map(str, sorted(folder.glob("part-*"))), "--out", str(out)]) == 0
    assert f"2 stores, 5 cases, merged into {out}" in capsys.readouterr().out
    assert toy("--vary", "length=0:1:5") == 0
    assert "5 cases, 5 of them stored already" in capsys.readouterr().err


@pytest.mark.slow
def test_the_array_job_of_the_page_runs(tmp_path):
    """Its script, as SLURM would start it: twice, with the number of each; then what the page says comes after."""
    page = (ROOT / "docs" / "how-to-run-on-a-cluster.md").read_text(encoding="utf-8")
    job, after = re.findall(r"^```sh\n(.*?)^```$", page.partition("## Dask")[0], re.MULTILINE | re.DOTALL)
    (tmp_path / "buckler").write_text(f'#!/bin/sh\nexec {sys.executable} -m buckler.studies "$@"\n')
    (tmp_path / "buckler").chmod(0o755)
    for long, short in {"0.5mm:400": "0.5mm:4", "source .venv/bin/activate": "", "of-8": "of-2", "ID/8": "ID/2"}.items():
        assert long in job + after
        job, after = job.replace(long, short), after.replace(long, short)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "SLURM_CPUS_PER_TASK": "0"}
    jobs = [f"SLURM_ARRAY_TASK_ID={number}\n{job}" for number in (1, 2)]
    for script in (*jobs, f"{after.rstrip()} --workers 0"):
        words = {"args": ["bash", "-e", "-c", script], "cwd": tmp_path, "env": environment, "timeout": 120}
        done = subprocess.run(**words, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert "4 cases, 4 of them stored already" in done.stderr


@pytest.mark.parametrize("text", ["3/2", "0/2", "1", "a/b", "1/0"])
def test_what_is_no_part_is_said_in_one_line(toy, capsys, text):
    assert toy("--vary", "length=0:1:5", "--part", text) == 2
    assert capsys.readouterr().err == f"error: --part {text}: write I/N, such as 2/8 for the second of eight parts\n"


def test_a_part_that_is_not_there(tmp_path, capsys):
    assert main(argv=["merge", str(tmp_path / "none.sqlite"), "--out", str(tmp_path / "all.sqlite")]) == 2
    assert capsys.readouterr().err == f"error: {tmp_path / 'none.sqlite'}: no such file\n"
