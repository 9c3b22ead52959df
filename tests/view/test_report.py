"""The report page: what it holds agrees with the arrays, fits its size, and shows a failure first."""

import json
import re
from base64 import b64decode
from dataclasses import replace
from statistics import median
from time import process_time

import numpy as np
import pytest
from looked_at import MECHANISMS, run

from buckler.mbs import Status
from buckler.mbs.checks.suspicions import CHECKS
from buckler.mbs.record.errors import Errors
from buckler.mbs.view.report import page
from buckler.mbs.view.verdicts import QUESTIONS, verdicts

LEVEL = 1 / 65534


def content(text):
    """The data of a page, and a reader of its arrays."""
    found = json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)[1])
    words = np.frombuffer(b64decode(found["store"]), dtype="<u2")

    def read(entry, count):
        start, low, step = entry
        if start < 0:
            return np.full(count, low)
        part = words[start : start + count].astype(float)
        return np.where(part == 65535, np.nan, low + step * part)

    return found, read


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_page_fits_its_size_and_needs_no_network(name, tmp_path):
    path = run(name).write_html(tmp_path / "new" / "report.html")
    text = path.read_text()
    assert 50_000 < path.stat().st_size < 600_000
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!data:)""", text)
    assert "http" not in re.sub(r'<script id="data".*?</script>', "", text, flags=re.DOTALL)


@pytest.mark.parametrize("name", ["strip", "loose"])
def test_a_page_is_written_at_once(name, tmp_path):
    result = run(name)
    result.write_html(tmp_path / "report.html")  # templates, and whatever is imported when first used
    bands = [part for band in result.movie.bands.values() for part in (band.points, band.bending, band.axial)]
    pictured = [each.astype(np.float32) for each in (*result.movie.frames.values(), *bands)]
    ratios = []
    for _ in range(5):
        fresh = replace(result, film=type(result.film)(result.film.record))  # the movie too
        start = process_time()
        fresh.write_html(tmp_path / "report.html")
        written = process_time() - start
        np.savez_compressed(tmp_path / "run.npz", *result.signals.values(), *result.energy.values(), *pictured)
        ratios.append(written / (process_time() - start - written))
    assert median(ratios) < 2.0  # of the time in which the same run and its pictures are packed into a file


@pytest.mark.parametrize("name", MECHANISMS)
def test_peaks_survive(name):
    result = run(name)
    found, read = content(page(result, "x"))
    table = {row["name"]: row for row in found["signals"]["rows"]}
    bins = found["signals"]["bins"]
    for signal, values in result.signals.items():
        row, allowed = table[signal], LEVEL * np.ptp(values) + 1e-13 * np.abs(values).max(initial=1e-2)
        assert row["unit"] == result.units[signal]
        low, high = read(row["low"], bins), read(row["high"], bins)
        assert [low.min(), high.max()] == pytest.approx([values.min(), values.max()], abs=allowed)
        edges = np.linspace(result.time[0], result.time[-1], bins + 1)
        assert read(row["at"], bins + 1) == pytest.approx(np.interp(edges, result.time, values), abs=allowed)


@pytest.mark.parametrize("name", MECHANISMS)
def test_frames_on_the_page_are_those_of_the_movie(name):
    result = run(name)
    found, read = content(page(result, "x"))
    motion = found["motion"]
    time = read(motion["time"], motion["count"])
    for frame, axes in zip(motion["names"], motion["frames"], strict=True):
        for axis, entry in enumerate(axes):
            values = np.interp(time, result.movie.time, result.movie.frames[frame][:, axis])
            scale = max(np.ptp(result.movie.frames[frame][:, axis]), 1e-6)
            assert np.median(abs(read(entry, motion["count"]) - values)) < 2e-3 * scale
    assert set(motion["bands"]) == set(result.movie.bands)


def test_every_check_has_its_question():
    """All checks, and the words that begin the sentences of an accuracy and of a second solver."""
    assert set(QUESTIONS) == {check.name for check in CHECKS} | {"ACCURACY", "SOLVERS"}


def test_verdicts_tell_failed_from_not_run():
    def inapplicable(name):
        return {row.name: row.message for row in verdicts(run(name)) if row.verdict == "not applicable"}

    fine = run("pendulum")
    assert inapplicable("pendulum") == {
        "CONTACT": "no stop, no joint with clearance and no rope", "PENETRATION": "no stop and no joint with clearance",
        "UNBUCKLED": "no beam and no cable", "CROSSED": "no strut", "LINEAR": "no modal link",
        "BRANCH": "not a linkage of which the drives alone decide the motion",
    }  # fmt: skip
    fulfilled = {"NOT_FINITE", "TIME", "CONSTRAINTS", "ENERGY", "ACCURACY"}
    assert {row.name for row in verdicts(fine) if row.verdict == "no complaint"} == fulfilled
    assert set(inapplicable("strip")) == {"CROSSED", "LINEAR", "BRANCH"}
    assert set(inapplicable("strut")) == {"UNBUCKLED", "LINEAR", "BRANCH"}
    rows = verdicts(fine.suspect("a strange thing").suspect("ENERGY: balance 3e-02; too much").suspect("BRANCH: lower max_step"))
    assert {row.verdict for row in rows[:3]} == {"failed"} and [row.name for row in rows[:3]] == ["OTHER", "ENERGY", "BRANCH"]
    assert [row.message for row in rows[:3]] == ["a strange thing", "balance 3e-02; too much", "lower max_step"]
    assert {row.verdict for row in rows[3:]} == {"no complaint", "not applicable"}
    assert {row.verdict for row in verdicts(run("failed"))} == {"not run"}


def test_a_failed_accuracy_keeps_its_reason_where_the_error_is_not_known():
    reason = "no finer run could be made, so that the error is not known (3 runs)"
    result = replace(run("pendulum"), error=Errors()).suspect(f"ACCURACY: {reason}")
    row = next(row for row in verdicts(result) if row.name == "ACCURACY")
    assert (row.verdict, row.message) == ("failed", reason)


def test_a_page_cannot_be_broken_by_its_words():
    result = run("pendulum").suspect("ENERGY: </script><b>& \u2028 'quoted\"")
    text = page(result, "</title><script>alert(1)</script>")
    found, _ = content(text)
    assert found["title"] == "</title><script>alert(1)</script>" and "</script><b>" in found["message"]
    assert "<script>alert" not in text and text.count("<script") == 2


def test_measures_stand_with_their_errors_and_those_beyond_what_was_asked_are_marked():
    result = run("pendulum")
    known = replace(result.error, motion=1e-3, until=float(result.time[-1]))
    size = float(np.abs(result["A.x"]).max())
    errors = {key: share for key, share in ((("A.x", "rms"), 0.01), (("A.x", "peak"), 0.02))}
    known = replace(known, signals=errors, sizes=dict.fromkeys(errors, size))
    texts = ["max(abs(A.x))", "max(abs(A.x)) - max(abs(A.x))"]
    for asked, marked in ((0.1, [False, False]), (1e-3, [True, True])):
        found, _ = content(page(replace(result, error=known, asked=asked), "x", texts))
        largest, zero = found["readings"]
        assert [largest["beyond"], zero["beyond"]] == marked
        assert largest["value"] == pytest.approx(size) and 0.02 <= largest["error"] / size < 0.03
        assert zero["value"] == 0 and zero["relative"] is None and zero["error"] == pytest.approx(2 * largest["error"], rel=0.1)
        assert found["signals"]["first"] == ["A.x"]
    assert content(page(replace(result, status=Status.LOCKED, message="x"), "x", texts))[0]["readings"] == []
