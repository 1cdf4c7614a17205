"""The page of benchmarks shows the files of results, all of them, and nothing else in their places."""

import importlib.util
import re
import subprocess
from pathlib import Path

import pytest
from benchmarks import tables
from benchmarks.tables import PAGE, Table, page, read_table, read_tables, write_table

HEAD = {"measured": "1 May 2026", "revision": "abc", "command": "python -m benchmarks x"}


def test_the_page_is_what_the_command_makes() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert page(text, read_tables()) == text, "run: python -m benchmarks.tables"


def test_every_table_names_a_benchmark_that_there_is_and_a_day() -> None:
    source = (Path(tables.__file__).parent / "__main__.py").read_text(encoding="utf-8")
    found = read_tables()
    assert len(found) >= 10
    for name, table in found.items():
        named = re.match(r"python -m benchmarks (\w+)", table.head["command"])
        assert named, name
        assert importlib.util.find_spec(f"benchmarks.{named[1]}") is not None
        assert f'"{named[1]}"' in source, name
        assert re.fullmatch(r"\d{1,2} [A-Z][a-z]+ 20\d\d", table.head["measured"]), name
        assert re.fullmatch(r"[0-9a-f]{7,}", table.head["revision"]), name


def test_a_table_is_read_as_it_was_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = subprocess.CompletedProcess([], 0, stdout="0123abc\n")
    monkeypatch.setattr(tables.subprocess, "run", lambda *_, **__: done)
    rows = [("a, b", '"quoted"'), ("|c|", "")]
    made = Table(("what", "is"), rows, {"note": "n: m", "peers": ""})
    path = write_table("x", made, "python -m benchmarks x", tmp_path)
    table = read_table(path)
    assert (table.columns, table.rows) == (("what", "is"), tuple(rows))
    assert table.head.keys() == {"measured", "revision", "command", "note"}
    assert (table.head["revision"], table.head["note"]) == ("0123abc", "n: m")
    assert "\n| \\|c\\| |  |\n" in table.markdown()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("# measured: today\n# command: y\na,b\n1,2\n", "x.csv: its head lacks 'revision'"),
        (
            "# measured: t\n# revision: r\n# command: y\n# by: me\na\n1\n",
            "x.csv: its head has an unknown line 'by'",
        ),
        ("# measured: t\n# revision: r\n# command: y\na,b\n1,2\n1\n", "x.csv: row 2 has 1 cells, not 2"),
    ],
)
def test_a_file_that_is_not_a_table_is_refused(tmp_path: Path, text: str, fault: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=re.escape(fault)):
        read_table(path)


def test_a_page_shows_each_table_once() -> None:
    table = Table(("a",), (("1",),), HEAD)
    place = "<!-- table: x -->\nold\n<!-- end of table -->\n"
    made = page(place, {"x": table})
    assert made == f"<!-- table: x -->\n{table.markdown()}<!-- end of table -->\n"
    assert page(made, {"x": table}) == made
    with pytest.raises(ValueError, match=r"no benchmarks/results/x\.csv"):
        page(place, {})
    with pytest.raises(ValueError, match="'x' 2 times"):
        page(place + place, {"x": table})
    with pytest.raises(ValueError, match="'y' 0 times"):
        page(place, {"x": table, "y": table})


def test_the_command_says_whether_the_page_is_up_to_date(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    written = tmp_path / "page.md"
    monkeypatch.setattr(tables, "PAGE", written)
    written.write_text(re.sub(r"\n\| .*", "", PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    assert tables.main(["--check"]) == 1
    assert tables.main([]) == tables.main(["--check"]) == 0
    written.write_text("<!-- table: nothing -->\n<!-- end of table -->\n", encoding="utf-8")
    assert tables.main([]) == 2
    assert re.fullmatch("benchmarks.tables: .*\n", capsys.readouterr().err)


def test_what_benchmarks_publish_is_on_the_page() -> None:
    source = (Path(tables.__file__).parent / "__main__.py").read_text(encoding="utf-8")
    listed = re.search(r"^TABLES = \{(.*?)\}$", source, re.MULTILINE | re.DOTALL)
    assert listed
    rows = dict(re.findall(r'"(\w+)": "(\w*)"', listed[1]))
    assert set(rows.values()) - {""} == set(read_tables()) - {"eye", "formats"}  # entered by hand
    folder = Path(tables.__file__).parent
    assert all("def measured(" in (folder / f"{name}.py").read_text(encoding="utf-8") for name in rows)
