"""The catalogue: a file for each code, read on demand; and the codes of other packages."""

import re
import sys
from pathlib import Path

import pytest

from tests.support import processes
from tfcompose.foundation.catalogue import (
    CATALOGUE,
    FAMILIES,
    Catalogue,
    Code,
    can_be_allowed,
    code_of,
    read_code,
    similar_words,
)
from tfcompose.foundation.findings import finding
from tfcompose.foundation.tool import shipped_tools

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "tfcompose"
FOLDER = PACKAGE / "data" / "codes"
#: The pages of the codes of the core, and of those of the tools that ship.
FILES = sorted(PACKAGE.glob("**/codes/*.md"), key=lambda file: file.stem)
#: Codes of the past, which no other finding may have: TF904 was no_xacro, from when xacro was no
#: dependency.
RETIRED = {"TF904"}

HEAD = "---\nname: pump_off\nseverity: warning\nfamily: live\n---\n\n"
PAGE = "The pump is off.\n\nSwitch it on.\n"


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_each_file_is_a_code_and_a_page_that_starts_with_a_sentence(file: Path) -> None:
    assert CATALOGUE[file.stem] == read_code(file.stem, file.read_text("utf-8"))
    summary = CATALOGUE.summary(file.stem)
    assert re.fullmatch(r"[^\n]{9,109}\.", summary)
    first, gap, rest = CATALOGUE.page(file.stem).partition("\n\n")
    assert " ".join(first.split()) == summary
    assert not gap or len(rest.split()) >= 3, "why it is wrong, and what to do"
    assert all(len(line) <= 99 for line in file.read_text("utf-8").splitlines())


def test_codes_are_in_order_in_families_and_have_one_name_each() -> None:
    assert list(CATALOGUE) == [file.stem for file in FILES]
    assert {code.family for code in CATALOGUE.values()} == set(FAMILIES)
    assert len({code.name for code in CATALOGUE.values()}) == len(CATALOGUE)
    assert not RETIRED & CATALOGUE.keys()


def test_every_code_is_used_and_every_code_that_is_used_has_a_page() -> None:
    sources = [file.read_text("utf-8") for file in PACKAGE.rglob("*.py")]
    used = {code for text in sources for code in re.findall(r"\"(TF\d{3})\"", text)}
    assert used == set(CATALOGUE)


def test_a_head_says_what_a_code_is() -> None:
    text = HEAD.replace("live", "guard").replace("---\n\n", "unbuildable: true\n---\n\n") + PAGE
    assert read_code("ACME101", text) == Code(
        "ACME101", "pump_off", family="guard", severity="warning", unbuildable=True
    )
    numbered = (HEAD + PAGE).replace("family: live\n", "")
    assert read_code("TF299", numbered).family == "tree"


@pytest.mark.parametrize(
    ("limit", "si"),
    [
        ("0.02 m", (0.02, "m")),
        ("2 cm", (0.02, "m")),
        ("90 deg", (1.5707963267948966, "rad")),
        ("95 %", (0.95, "%")),
    ],
)
def test_a_limit_is_in_si(limit: str, si: tuple[float, str]) -> None:
    assert read_code("TF640", HEAD[:-5] + f"limit: {limit}\n---\n\n" + PAGE).limit == si


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (PAGE, "head"),
        (HEAD, "page"),
        (HEAD.rstrip(), "page"),
        (HEAD.replace("pump_off", "Pump off") + PAGE, "name"),
        (HEAD.replace("name: pump_off\n", "") + PAGE, "name"),
        (HEAD.replace("warning", "note") + PAGE, "severity"),
        (HEAD.replace("severity: warning\n", "") + PAGE, "severity"),
        (HEAD.replace("live", "pumps") + PAGE, "family"),
        (HEAD.replace("family: live\n", "") + PAGE, "family"),
        (HEAD.replace("family: live", "familly: live") + PAGE, "familly"),
        (HEAD.replace("family: live", "family: live\nfamily: live") + PAGE, "twice"),
        (HEAD.replace("family: live", "family: live\nlimit: 3 ft") + PAGE, "limit"),
        (HEAD.replace("family: live", "family: live\nunbuildable: yes") + PAGE, "unbuildable"),
    ],
)
def test_a_file_that_is_not_understood_says_which_and_why(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=rf"ACME101: .*{why}"):
        read_code("ACME101", text)


def test_a_finding_takes_name_and_severity_from_its_code_by_default() -> None:
    warning = finding("TF207", "message", None)
    assert (warning.name, warning.severity) == ("wrong_chain_order", "warning")
    assert finding("TF207", "message", None, severity="error").severity == "error"
    assert finding("TF201", "message", None).severity == "error"


@pytest.mark.parametrize("code", ["TF999", "tf201", "", "TF20", "../codes/TF201", "TF201\n"])
def test_what_is_no_code_is_in_no_catalogue_and_no_finding(code: str) -> None:
    assert code not in CATALOGUE
    assert not can_be_allowed(code)
    for ask in (CATALOGUE.page, CATALOGUE.summary, lambda code: finding(code, "message", None)):
        with pytest.raises(KeyError):
            ask(code)


def test_a_code_is_found_by_its_name_too() -> None:
    assert code_of("two_parents") == code_of("tf201") == "TF201"
    assert code_of("three_parents") is None
    assert {"two_parents", "TF201"} <= set(similar_words("two_parent"))
    assert not similar_words("TF999")


def test_an_error_that_prevents_the_build_cannot_be_allowed() -> None:
    assert not Code("TF202", "cycle", "tree", "error", unbuildable=True).can_be_allowed
    assert not CATALOGUE["TF101"].can_be_allowed
    assert CATALOGUE["TF301"].can_be_allowed


def package(folder: Path, name: str, *codes: str) -> Path:
    """Make a package with these codes; return the folder that they are in."""
    (folder / name / "codes").mkdir(parents=True)
    (folder / name / "__init__.py").touch()
    for code in codes:
        (folder / name / "codes" / f"{code}.md").write_text(HEAD + PAGE, encoding="utf-8")
    return folder / name / "codes"


def test_later_folders_are_read_only_for_codes_that_are_in_none_before(
    tmp_path: Path,
) -> None:
    folder = package(tmp_path, "acme_pumps", "ACME101", "ACME102")
    lookups = []

    def more() -> list[Path]:
        lookups.append(1)
        return [folder]

    both = Catalogue(FOLDER, more=more)
    assert both["TF201"] == CATALOGUE["TF201"]
    assert not lookups
    assert (both["ACME101"].name, both.page("ACME101")) == ("pump_off", PAGE.rstrip())
    assert lookups
    assert list(both)[:2] == ["ACME101", "ACME102"]
    assert set(both) >= set(Catalogue(FOLDER))


def test_codes_of_tools_are_in_their_folders_and_in_the_catalogue() -> None:
    for tool in shipped_tools().tools:
        for code in tool.code_names():
            assert CATALOGUE[code].code == code
            assert not (FOLDER / f"{code}.md").exists()
    assert {"TF886", "TF913", "TF020"} <= CATALOGUE.keys()


def test_what_was_loaded_needs_no_file(tmp_path: Path) -> None:
    file = tmp_path / "ACME101.md"
    file.write_text(HEAD + PAGE, encoding="utf-8")
    loaded, lazy = Catalogue(tmp_path), Catalogue(tmp_path)
    loaded.load()
    file.unlink()
    assert loaded["ACME101"].name == "pump_off"
    with pytest.raises(KeyError):
        lazy["ACME101"]


def test_the_catalogue_loads_no_tool_and_nothing_else_of_the_package() -> None:
    loaded = "[name for name in sys.modules if name.startswith('tfcompose')]"
    program = f"import sys, tfcompose.foundation.findings; print(*{loaded})"
    done = processes.run([sys.executable, "-c", program], check=True, cwd=ROOT)
    modules = {
        "tfcompose",
        *(f"tfcompose.foundation{name}" for name in ("", ".catalogue", ".findings", ".tool")),
    }
    assert set(done.stdout.split()) == modules


READS = """
import sys
from pathlib import Path
read = []
sys.addaudithook(lambda event, args: event == "open" and read.append(str(args[0])))
{program}
print(*sorted(Path(name).stem for name in read if "data/codes/" in name), file=sys.stderr)
"""


@pytest.mark.parametrize(
    ("program", "codes"),
    [
        ("import tfcompose.foundation.findings, tfcompose.compiler.check", set()),
        (
            "from tfcompose.cli.parser import main\nmain(['lint', 'robots/my_robot.yaml'])",
            # those that have limits
            {"TF640", "TF641", "TF642", "TF643", "TF644", "TF645"},
        ),
    ],
)
def test_a_file_is_read_only_for_a_finding_or_a_limit(program: str, codes: set[str]) -> None:
    command = [sys.executable, "-c", READS.format(program=program)]
    done = processes.run(command, check=True, cwd=ROOT)
    assert set(done.stderr.split()) <= codes
