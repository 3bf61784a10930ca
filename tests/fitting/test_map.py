"""Maps of force curves: one table and one figure of a folder, from curves with a known modulus."""

import csv
import json

import numpy as np
import pytest

from jaxcontact.__main__ import main

T = np.linspace(0.0, 1.0, 300)
Z = np.linspace(-1e-6, 1e-6, 300)


def write(path, E, seed):
    """A curve of a ball of 5 um on a half-space of nu = 0.5 (Hertz), with noise."""
    load = 16.0 / 9.0 * E * np.sqrt(5e-6) * np.maximum(Z, 0.0) ** 1.5
    load = load + 2e-3 * 4e-9 * np.random.default_rng(seed).standard_normal(T.size)
    rows = (f"{t:.6g}\t{1e9 * P:.6g}\t{1e9 * d:.6g}\n" for t, P, d in zip(T, load, Z, strict=True))
    path.write_text("Time (s)\tLoad (nN)\tDepth (nm)\n" + "".join(rows))


@pytest.mark.slow
def test_a_folder_becomes_a_table_and_a_figure_and_is_continued(tmp_path, capsys):
    folder, out = tmp_path / "curves", tmp_path / "map"
    folder.mkdir()
    for k, E in enumerate((500.0, 1e3, 0.0)):
        write(folder / f"{k}.txt", E, k)
    (folder / "notes.txt").write_text("no curve\n")
    command = ["fit", "map", str(folder), "-o", str(out), "--radius", "5e-6", "--processes", "1"]
    assert main(command) == 3  # one curve could not be fitted
    assert json.loads((out / "options.json").read_text())["radius"] == 5e-6
    said = capsys.readouterr().out
    assert "2 of 3 curves accepted" in said and "1 of 4 files without rows of numbers" in said
    # the curves end at a fifth of the radius of the ball
    assert "note: 2 of 3 curves, first: the depth reaches 0.2 of the radius of the ball" in said
    with (out / "map.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["verdict"] for row in rows] == ["accepted", "accepted", "failed"]
    assert "rises with depth" in rows[2]["reason"]
    assert ["radius of the ball" in row["notes"] for row in rows] == [True, True, False]
    for row, E in zip(rows, (500.0, 1e3), strict=False):
        assert float(row["E low [Pa]"]) < E < float(row["E high [Pa]"])
    assert (out / "map.png").stat().st_size > 1e4
    stored = {path: path.stat().st_mtime_ns for path in (out / "curves").glob("*.npz")}
    write(folder / "3.txt", 2e3, 3)
    main(command)
    assert "3 of 4 curves accepted" in capsys.readouterr().out
    assert all(path.stat().st_mtime_ns == when for path, when in stored.items())  # none was fitted again
    with pytest.raises(SystemExit) as ended:
        raise SystemExit(main([*command, "--nu", "0.3"]))
    assert ended.value.code not in (0, None) and "not of a map with these options" in capsys.readouterr().err


