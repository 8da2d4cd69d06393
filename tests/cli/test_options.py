"""Options of all commands: one spelling of each, every one in the help, and figures alone on standard output."""

import argparse
import json

import pytest
from metamer.cli.parser import parser

#: Names that are still taken and that no help shows.
OLD = {"--into", "--processes"}


def commands(found=None, words=()):
    """Every command that has no verbs of its own, with its words."""
    found = found or parser()
    verbs = [one for one in found._actions if isinstance(one, argparse._SubParsersAction)]
    if not verbs:
        yield words, found
    for one in verbs:
        for name, command in one.choices.items():
            yield from commands(command, (*words, name))


def deviations(one):
    """Yield what is wrong with an option or an argument, in words."""
    names, shown = set(one.option_strings), one.help != argparse.SUPPRESS
    if not one.help:
        yield "no help"
    if shown == bool(names & OLD) or names & {"--out", "--cores", "--workers"}:
        yield "another name"
    if ("-o" in names) != ("--output" in names):
        yield "-o and --output are one"
    if "--json" in names and (one.metavar != "FILE" or one.nargs or not one.help.endswith("; - for standard output")):
        yield "--json FILE, - for standard output"
    if "--html" in names and one.metavar != "FILE":
        yield "--html FILE"
    if "--jobs" in names and (one.metavar != "N" or not one.help.startswith("processes")):
        yield "--jobs N, processes"


def test_every_option_is_spelt_alike_and_in_the_help():
    found = list(commands())
    assert len(found) > 30
    wrong = [
        f"{' '.join(words)} {one.option_strings or one.dest}: {said}"
        for words, command in found
        for one in command._actions
        for said in deviations(one)
    ]
    for words, command in found:
        if any(one.dest == "catalogue" for one in command._actions):
            wrong += (
                []
                if any("--catalogue" in one.option_strings for one in command._actions)
                else [f"{words}: no --catalogue"]
            )
    assert not wrong, "\n".join(wrong)


def test_wrong_usage_of_every_command_ends_with_64(metamer):
    for words, _ in commands():
        code, out, err = metamer(*words, "--no-such-option")
        assert code == 64 and not out and "usage:" in err, words


@pytest.mark.parametrize(
    "words",
    [
        "render s.toml -o o.png --illuminant D66",
        "review s.toml --illuminants D65,D66",
        "transfer show s.toml --illuminant D66",
        "transfer relight s.toml --illuminant D66",
        "transfer relight s.toml --like seat=warner:10",
        "report compare a.csv b.csv --illuminants D66",
        "report compare a.csv b.csv --observer 1931_3",
        "report compare a.csv b.csv --json x.json --csv x.json",
        "match a.csv b.csv --json x.json --csv x.json",
        "catalogue diff a b --observer 1931_3",
        "catalogue diff a b --illuminants D66",
        "catalogue preview --illuminant D66",
        "catalogue like paint/red --but warner=10",
        "catalogue import s.csv --uplift smit",
        "catalogue import s.csv --fill 3",
        "catalogue import s.csv --texel-mm 0",
        "catalogue export * --format cxf4 -o y",
        "display patches -o patches.txt",
        "display claim readings.csv --observer 1931_3",
        "display observer a.ccss b.ccss --matched-for 1931_3",
        "bench display --case none",
        "bench factor --cases none",
    ],
)
def test_a_word_that_no_option_knows_is_wrong_usage(metamer, tmp_path, monkeypatch, tiny_catalogue, words):
    """Before a file is read: there is none here."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("METAMER_CATALOGUE", str(tiny_catalogue))
    code, out, err = metamer(*words.split())
    assert code == 64 and not out and "metamer" in err, err
    assert not list(tmp_path.iterdir())


def test_an_old_name_of_an_option_is_taken():
    for words in (["catalogue", "import", "--into", "there"], ["catalogue", "list", "--catalogue", "there"]):
        assert parser(words).parse_args(words).catalogue.name == "there"
    for words in (["report", "baseline", "suite", "--into", "there"], ["review", "--out", "there"]):
        assert parser(words).parse_args(words).out.name == "there"


def test_figures_go_to_a_file_or_stand_alone_on_standard_output(metamer, tiny_catalogue, tmp_path):
    """Into a file, people still get their table; on standard output, programs get nothing else."""
    file = tmp_path / "list.json"
    code, out, _ = metamer("catalogue", "list", tiny_catalogue, "--json", file)
    assert code == 0 and "tiny/copper" in out and not out.startswith("{")
    code, alone, _ = metamer("catalogue", "list", "--catalogue", tiny_catalogue, "--json", "-")
    assert code == 0 and json.loads(alone) == json.loads(file.read_text(encoding="utf-8"))
