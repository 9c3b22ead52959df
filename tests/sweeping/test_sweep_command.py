"""`buckler sweep`: table, figures, files, parts, and messages for wrong words."""

import csv
import os
import re
import subprocess
import sys
from dataclasses import replace

import pytest
import sweep_toy
from made_up_study import metrics_of
from sweep_runs import ENVIRONMENT, ROOT, same, start, stored

from buckler.mbs.declare import declarations
from buckler.studies.kit.running import CaseMaker
from buckler.studies.kit.style import house_style
from buckler.studies.sweeping.sweep import sweep
from buckler.studies.sweeping.table import choose, figures, make_cases, parse, points, to_dataframe


def lines_of(out):
    """Cells of the printed table."""
    body = out.split("\n\n")[0].splitlines()[2:]
    return [re.split(r"  +", line.strip()) for line in body if "  " in line.strip()]


def test_a_table_of_units_values_and_files(toy, capsys):
    assert toy("--vary", "length=100mm,200mm", "--vary", "speed=1:2:2", "--metrics", "strut.force") == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert re.match(r" +length \[mm\] +speed \[rad/s\] +strut.force \[N\]\n", out)  # as they were written; cases.csv is in SI
    assert lines_of(out) == [["100", "1", "2 ± 0"], ["100", "2", "5 ± 0"], ["200", "1", "3 ± 0"], ["200", "2", "6 ± 0"]]
    assert f"written to {toy.folder}, cases in {toy.store}" in out
    assert {p.name for p in toy.folder.iterdir()} == {
        "cases.sqlite", "cases.csv", "metrics.json", "strut.force.png", "strut.force.pdf",
    }  # fmt: skip
    content = metrics_of(toy.folder)
    assert (content["status"], content["metrics"]["cases"]["value"]) == ("OK", 4)
    lines = list(csv.DictReader((toy.folder / "cases.csv").open()))
    assert [float(line["strut.force [N]"]) for line in lines] == [2, 5, 3, 6]
    assert [float(line["speed [rad/s]"]) for line in lines] == [1, 2, 1, 2]
    assert [float(line["strut.force relative error"]) for line in lines] == [0, 0, 0, 0]


def test_the_data_frame_has_units_and_errors():
    pytest.importorskip("pandas")
    frame = to_dataframe(sweep(sweep_toy, sweep_toy.toys(3, noise=1)), {"length": "m"})
    assert frame["length [m]"].tolist() == [0, 0.125, 0.25]
    exact = frame["strut.force [N]"] - 10 * frame["length [m]"] - 1
    relative = abs(exact / (10 * frame["length [m]"] + 1))
    assert frame["strut.force relative error"].tolist() == pytest.approx(relative.tolist(), rel=1e-12)


def test_parts_make_the_whole(toy, capsys, monkeypatch):
    words = ("--vary", "length=0:1:7", "--noise", "1")
    for part in ("1/2", "2/2"):
        assert toy(*words, "--part", part) == 0
        assert f"part {part[0]} of 2" in capsys.readouterr().out
    assert len(stored(toy.folder / "cases-part-1-of-2.sqlite")) == 4
    monkeypatch.setattr(sweep_toy, "run", None)  # nothing is left to run
    assert toy(*words) == 0
    monkeypatch.undo()
    whole = [sweep_toy.Parameters(length=float(f"{i / 6:.12g}"), noise=1) for i in range(7)]
    assert stored(toy.store) == same(sweep(sweep_toy, whole))


def test_failed_and_suspect_cases_are_lines_of_the_table_and_of_the_store(toy, capsys):
    assert toy("--vary", "ending=fine,suspect,raises", "--metrics", "strut.force") == 1
    out, err = capsys.readouterr()
    assert [line[-1] for line in lines_of(out)] == ["OK", "SUSPECT", "ERROR"]
    assert [line[1] for line in lines_of(out)][:2] == ["4 ± 0", "4 ± 0"]
    assert err.endswith("toy: FAILED: 1 SUSPECT, 1 ERROR of 3 cases; the first is case 1: energy grew by 3 %\n")
    assert len(stored(toy.store)) == 3
    assert metrics_of(toy.folder)["metrics"]["failed"]["value"] == 1


def test_models_are_compared_under_one_name(toy, capsys):
    """`strut.force` and `beam.force` are one column, and one family of lines."""
    assert toy("--vary", "models=strut,beam", "--vary", "length=1,2") == 0
    out = capsys.readouterr().out
    assert "force [N]" in out and "strut.force" not in out
    assert [line[:3] for line in lines_of(out)] == [
        ["strut", "1", "11 ± 0"], ["strut", "2", "21 ± 0"], ["beam", "1", "11 ± 0"], ["beam", "2", "21 ± 0"],
    ]  # fmt: skip


def test_the_same_command_computes_nothing_again_and_another_is_refused(toy, capsys, monkeypatch):
    assert toy("--vary", "length=1,2") == 0
    capsys.readouterr()
    monkeypatch.setattr(sweep_toy, "run", None)
    assert toy("--vary", "length=1,2") == 0
    assert capsys.readouterr().err == ""
    assert toy("--vary", "length=1,3") == 2
    message = (
        f"error: {toy.store} holds another sweep, with length = 2.0, which is not asked for now; name another with --store\n"
    )
    assert capsys.readouterr().err == message


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "nothing varies: give --vary; see --help"),
        (["--vary", "lenght=1:2:3"], "--vary lenght=1:2:3: unknown parameter 'lenght'; did you mean length?"),
        (["--vary", "length=1:2:3", "--speed", "7kg"], "speed = 7kg: must be in rad/s"),
        (["--vary", "length=1,2", "--workers", "-1"], "workers = -1: out of range; allowed: 0 or more"),
        (["--vary", "length=1,2", "--store", "/no/where/s.sqlite"], "--store /no/where/s.sqlite: no such folder"),
        (["--vary", "length=1,2", "--worker", "3"], "unknown option '--worker'; did you mean --workers?"),
        (["--vary", "order=12,13", "--speed", "6"], "order = 13: not with a speed above 5 rad/s"),
    ],
)
def test_wrong_input_is_one_line_and_exit_2_before_anything_runs(toy, capsys, words, message):
    assert toy(*words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert err.startswith("error: ") and err.count("\n") == 1
    assert not toy.store.exists()


def test_a_metric_that_is_not_there_is_named_after_the_run(toy, capsys):
    assert toy("--vary", "length=1,2", "--metrics", "strut.forse") == 2
    assert capsys.readouterr().err.endswith("error: --metrics strut.forse: no such metric; there are: strut.force, strut.time\n")
    assert len(stored(toy.store)) == 2


def drawn(*texts, endings=("fine",)):
    """Axes of the figure of the toy's force, drawn from rows as the engine would give them."""
    kind = sweep_toy.Parameters
    maker = CaseMaker(kind, declarations(kind), {})
    axes = [parse(text, maker.known) for text in texts]
    cases = [replace(case, ending=endings[i % len(endings)]) for i, case in enumerate(make_cases(maker, axes))]
    design = points(axes, sweep(sweep_toy, cases, workers=0))
    name = "force" if any("models" in text for text in texts) else "strut.force"
    with house_style():
        (figure,) = figures(axes, design, choose(design, [name])).values()
        figure.draw_without_rendering()
    return figure.axes


@pytest.mark.parametrize("texts", [["length=1:3:5"], ["length=1:3:5", "speed=0:1:6"], ["ending=fine", "models=strut,beam,cable"]])
def test_failed_and_suspect_cases_are_marks(texts):
    (ax,) = drawn(*texts, endings=("fine", "suspect", "raises"))
    assert [text.get_text() for text in ax.get_legend().get_texts()][:2] == ["failed", "suspect"]
    total = 30 if len(texts[1:]) and "speed" in texts[1] else 5 if len(texts) == 1 else 3
    crosses = [line for line in ax.lines if line.get_marker() == "x"]
    assert sum(len(line.get_xdata()) for line in crosses) == total // 3
    hollow = [line for line in ax.lines if line.get_markerfacecolor() == "white" and line.get_marker() != "x"]
    assert sum(len(line.get_xdata()) for line in hollow) == (total + 1) // 3


@pytest.mark.parametrize("words", [["list"], ["sweep", "toy", "--vary", "length=0:1:40", "--workers", "1"]])
def test_a_reader_that_goes_away_ends_it_quietly(tmp_path, words):
    out = ["--out", tmp_path] if words[0] == "sweep" else []
    process = start(*words, *out)
    process.stdout.close()  # as `| head -0` does
    err = process.stderr.read()
    assert process.wait() == 141
    process.stderr.close()
    assert "Traceback" not in err and "BrokenPipe" not in err
    if out:
        assert len(stored(tmp_path / "toy-sweep" / "cases.sqlite")) == 40


@pytest.mark.slow
def test_the_how_to_works_as_written(tmp_path):
    """Each command and Python block of the page, in its order, in an empty folder, but for the scripts of clusters."""
    page = (ROOT / "docs" / "how-to-sweep.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert [kind for kind, _ in blocks].count("sh") >= 1
    environment = ENVIRONMENT | {"PATH": f"{os.path.dirname(sys.executable)}:{os.environ['PATH']}"}
    for kind, block in blocks:
        if kind == "python":
            (tmp_path / "script.py").write_text(block)
            block = f"{sys.executable} script.py"
        if kind in ("sh", "python") and "#SBATCH" not in block:
            done = subprocess.run(["bash", "-euc", block], cwd=tmp_path, env=environment, capture_output=True, text=True)
            assert done.returncode == 0, f"{block}\n{done.stderr}"
