"""What the command line says of itself: help, completion, cases and how to cite."""

import re
import shutil
import subprocess
import sys

import pytest
from test_command_line import READY_MADE

from fitting.cli import command
from jaxcontact.__main__ import _parser, _parser_with_fits, main
from jaxcontact.paper import REPRODUCTIONS
from jaxcontact.paper.reproduce import CASES

pytestmark = pytest.mark.versions


def test_cite_and_cases_print(capfd):
    assert main(["cite"]) == 0
    assert "10.1007/s11249-025-01990-5" in capfd.readouterr().out
    assert main(["cases"]) == 0
    listed = capfd.readouterr().out
    assert listed.count(".toml") == len(READY_MADE) + 1 == 10 and "film_map: A study" in listed


@pytest.mark.parametrize("name", ["run", "new", "check", "sweep", "plot", "convert", "play", "reproduce"])
def test_help_ends_with_examples_that_are_commands(name, capsys):
    """Each is understood by the parser, but for what stands behind its #."""
    with pytest.raises(SystemExit):
        main([name, "--help"])
    text = capsys.readouterr().out
    examples = [line.split("#")[0].split() for line in text.split("examples:")[1].splitlines() if line]
    assert len(examples) >= 2
    for words in examples:
        assert words[:2] == ["jaxcontact", name] and _parser().parse_args(words[1:])


def test_examples_of_the_fits_are_commands(capsys):
    """Every kind of fit has examples, which its help shows and its parser understands."""
    with pytest.raises(SystemExit):
        main(["fit", "--help"])
    kinds = set(re.findall(r"^    (\w+)\b", capsys.readouterr().out, re.M)) - {"KIND"}
    assert kinds == set(command.EXAMPLES)
    parser = _parser_with_fits()
    for kind, examples in command.EXAMPLES.items():
        with pytest.raises(SystemExit):
            main(["fit", kind, "--help"])
        shown = capsys.readouterr().out
        for words in examples:
            assert f"\n  jaxcontact fit {kind} {words}" in shown
            assert callable(parser.parse_args(["fit", kind, *words.split()]).command)


COMPLETE = """
source "$1"
shift
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
$(complete -p jaxcontact | sed 's/.*-F \\([^ ]*\\) .*/\\1/') jaxcontact "${!#}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""  # what bash does when the tab key is pressed


@pytest.mark.skipif(not shutil.which("bash"), reason="asks bash itself")
def test_bash_completes_commands_options_kinds_of_fits_and_files(tmp_path, capsys):
    pytest.importorskip("shtab", reason="completion is the extra jaxcontact[completion]")
    (tmp_path / "case.toml").touch()
    with pytest.raises(SystemExit, match="0"):
        main(["--completion", "bash"])
    script = tmp_path / "completion.bash"
    script.write_text(capsys.readouterr().out)

    def completed(*words):
        command = ["bash", "-c", COMPLETE, "bash", script, "jaxcontact", *words]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        return set(done.stdout.split())

    assert completed("r") == {"run", "reproduce"}
    assert completed("run", "--res") == {"--resume"}
    assert completed("fit", "c") == {"creep", "compare", "cause"}
    assert completed("check", "ca") == {"case.toml"}


def test_completion_without_its_extra_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "shtab", None)
    assert main(["--completion", "bash"]) == 2
    assert capsys.readouterr().err.endswith("pip install 'jaxcontact[completion]'\n")


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_are_given_every_command(shell, capsys):
    pytest.importorskip("shtab", reason="completion is the extra jaxcontact[completion]")
    with pytest.raises(SystemExit, match="0"):
        main(["--completion", shell])
    script = capsys.readouterr().out
    assert all(name in script for name in ("convert", "reproduce", "indentation", "resume"))


@pytest.mark.parametrize(
    "words, status", [("--help", 0), ("--version", 0), ("cases", 0), ("cite", 0), ("rnu", 2)]
)
def test_what_says_how_to_go_on_does_not_wait_for_jax(words, status):
    code = f"""
import sys
from jaxcontact.__main__ import main
try:
    status = main([{words!r}])
except SystemExit as end:
    status = end.code
assert status == {status}, status
sys.exit([name for name in ("jax", "scipy", "matplotlib") if name in sys.modules] or None)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_help_of_reproduce_lists_what_there_is(capsys):
    assert [case.name for case in CASES] == list(REPRODUCTIONS)
    with pytest.raises(SystemExit):
        main(["reproduce", "--help"])
    words = re.split(r"[,\s]+", capsys.readouterr().out)
    assert set(words) >= set(REPRODUCTIONS)
