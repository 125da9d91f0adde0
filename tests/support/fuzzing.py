"""Mutated inputs for whatever reads what others wrote.

Each is read, or refused as it should be, in bounded time.

``python -m tests.support.fuzzing COUNT SEED`` tries so many inputs of each kind, and keeps those
that end otherwise in ``tests/fuzz/corpus``, where the tests try them from then on.
"""

import hashlib
import random
import resource
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from tests.support.cli import tfcompose_in
from tfcompose.cli.compiling import disk, library
from tfcompose.cli.dry_run import _lines as plan_lines
from tfcompose.cli.reading import read_text
from tfcompose.cli.terminal import printable
from tfcompose.compiler.compile import compile_robot
from tfcompose.compiler.emit import emit
from tfcompose.compiler.render.formats import render_github, render_json, render_sarif
from tfcompose.compiler.render.text import render_text
from tfcompose.compiler.urdf.lint import lint_urdf
from tfcompose.compiler.urdf.packages import Packages
from tfcompose.foundation.findings import Finding, RejectedError
from tfcompose.model.messages import GUARD_EVENTS, GUARD_ORDERS, REQUESTS, UNREADABLE, read_notice
from tfcompose.model.plan.file import read_plan
from tfcompose.spec.load.params import load_params
from tfcompose.tf.ros.tf_codec import Decoder, decode
from tfcompose.tools.exporters.kubernetes import Cluster, files_of, kubernetes
from tfcompose.tools.exporters.launch import launch
from tfcompose.tools.exporters.launch_frontends import LaunchFile
from tfcompose.tools.exporters.supervisors import Machine, compose, systemd

CORPUS = Path(__file__).parents[1] / "fuzz" / "corpus"
#: Processor time that an input may take, in seconds.
MOST_S = 10.0
#: What an input may hold; longer ones are cut.
LONGEST = 20_000

LIBRARY = library()
_STARTS_NOTHING = frozenset(
    [
        "lint",
        "build",
        "tree",
        "graph",
        "diff",
        "explain",
        "pose",
        "presets",
        "export",
        "schema",
        "help",
        "import",
    ]
)
_ROBOT = """tfcompose: 1
robot: r
args: {side: {choices: [left, right], default: left}}
links: {base_link: {}, arm: {parent: base_link}}
profiles: {demo: {frames: {eye: {parent: arm}}}}
"""
WORDS = """
{ } [ ] ,  - &a *a <<: ${ null ~ 1e999 -0.0 !x " ' \ufeff é < > /> <!-- &amp; &#xD800; "\\ud800" nan .inf true | #
base_link ${1/0} $(find x)
"""  # noqa: E501 (a text as its reader has it)
PIECES = [word.encode() for word in WORDS.split()] + [
    b"\n",
    b"\n  ",
    b": ",
    b"\t",
    b"\x00",
    b"\x1b[2J",
    b"0x" + b"f" * 400,
    b"9" * 400,
    b"[" * 60,
    b"{a: " * 60,
    b"\xed\xa0\x80",
    b"\xff",
    b"\x00\x00\x00\x80",
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff",
]


def mutated(data: bytes, samples: list[bytes], rng: random.Random) -> bytes:
    """Return the data with pieces replaced, removed, doubled, or taken from other inputs."""
    for _ in range(rng.choice((1, 1, 2, 3, 6))):
        begin_at = rng.randrange(len(data) + 1)
        end = min(len(data), begin_at + rng.choice((0, 0, 1, 2, 4, 8, 40)))
        kind = rng.randrange(6)
        if kind == 0:
            piece = rng.choice(PIECES)
        elif kind == 1:
            piece = bytes([rng.randrange(256)])
        elif kind == 2 and end > begin_at:
            piece = bytes([data[begin_at] ^ 1 << rng.randrange(8)]) + data[begin_at + 1 : end]
        elif kind == 3:
            sample = rng.choice(samples)
            begin = rng.randrange(len(sample) + 1)
            piece = sample[begin : begin + rng.randrange(80)]
        elif kind == 4:
            begin = rng.randrange(len(data) + 1)
            piece = data[begin : begin + rng.randrange(80)] * rng.choice((1, 1, 2, 20))
        else:
            piece = b""
        data = data[:begin_at] + piece + data[end:]
    return data[:LONGEST]


def _render_all(findings: list[Finding]) -> None:
    """Render findings in each form; each says where and what in text that a terminal can take."""
    assert not [finding for finding in findings if finding.code == "TF903"], findings
    for text in (
        render_text(findings, lambda *_: None, colour=False),
        render_json(findings),
        render_github(findings),
        render_sarif(findings, "0"),
    ):
        text.encode()
        assert not {"\x1b", "\x00", "\x9b"} & set(text), ascii(text)


def _compiled(file: Path) -> None:
    try:
        text = read_text(str(file))
        compiled = compile_robot(text, str(file), LIBRARY, read=read_text, disk=disk())
    except RejectedError as error:
        _render_all(list(error.findings))
        return
    _render_all(list(compiled.findings))
    assert compiled.robot or compiled.errors
    if compiled.robot and not compiled.errors:
        for emitted in emit(compiled.robot):
            emitted.text.encode()
            if emitted.path == "plan.json":
                read_plan(emitted.text, emitted.path)


def robot(data: bytes, folder: Path) -> None:
    """A robot file."""
    file = folder / "robot.yaml"
    file.write_bytes(data)
    _compiled(file)


def calibration(data: bytes, folder: Path) -> None:
    """A calibration file, and the robot that it is about."""
    (folder / "kit.calib").write_bytes(data)
    (folder / "calibrated.yaml").write_text(
        "tfcompose: 1\nrobot: r\ncalibrations: [kit.calib]\nlinks: {base_link: {}}\nframes:"
        " {tool0: {parent: base_link}, eye: {parent: tool0, calibration: {file: kit.calib}}}\n",
        "utf-8",
    )
    _compiled(folder / "calibrated.yaml")


def params(data: bytes, folder: Path) -> None:
    """A parameter file of ROS."""
    file = folder / "nav.yaml"
    file.write_bytes(data)
    try:
        _render_all(load_params(read_text(str(file)), str(file)).findings)
    except RejectedError as error:
        _render_all(list(error.findings))


def urdf(data: bytes, folder: Path) -> None:
    """A URDF, which names no xacro."""
    file = folder / "r.urdf"
    file.write_bytes(data.replace(b"<xacro:", b"<xacro_"))
    _render_all(lint_urdf(str(file), Packages(disk())))


def xacro(data: bytes, folder: Path) -> None:
    """A xacro file."""
    file = folder / "r.xacro"
    file.write_bytes(data)
    _render_all(lint_urdf(str(file), Packages(disk())))


def _run(argv: list[str], folder: Path) -> None:
    """Run a command in a folder; it ends with an exit code of its own, and obeys no text."""
    done = tfcompose_in(folder, *argv)
    assert done.returncode in {0, 1, 2}, done.stderr
    output = done.stdout + done.stderr
    assert "Traceback" not in output
    assert not {"\x1b", "\x00", "\x9b"} & set(output), ascii(output)


def script(data: bytes, folder: Path) -> None:
    """A shell script that starts a robot."""
    (folder / "bringup.sh").write_bytes(data)
    _run(["import", "bringup.sh"], folder)


def launch_file(data: bytes, folder: Path) -> None:
    """A launch file of ROS 1, which needs no launch."""
    (folder / "robot.launch").write_bytes(data)
    _run(["import", "robot.launch"], folder)


def arguments(data: bytes, folder: Path) -> None:
    """Arguments of a command that starts nothing, each ended by NUL."""
    (folder / "robot.yaml").write_text(_ROBOT, "utf-8")
    (folder / "r.urdf").write_text("<robot name='r'><link name='a'/></robot>", "utf-8")
    argv = [word.decode("utf-8", "surrogateescape") for word in data.split(b"\0")]
    endless = {"-w", "--watch", "-"}
    if argv[0] in _STARTS_NOTHING and not endless & set(argv):
        _run([word for word in argv if not word.startswith(("/", ".", "~"))], folder)


def plan(data: bytes, folder: Path) -> None:
    """A built plan: reviewed and exported, if it is one."""
    try:
        read = read_plan(
            data.decode("utf-8", "surrogatepass" if len(data) % 2 else "replace"),
            str(folder / "plan.json"),
        )
    except RejectedError as error:
        _render_all(list(error.findings))
        return
    except UnicodeDecodeError:
        return
    for line in plan_lines(read, {}):
        line.encode()
        assert printable(line).isprintable(), ascii(line)
    texts = {path: "" for process in read.started for path in files_of(read, process)}
    pods = kubernetes(read, Cluster("robot:1"), texts)
    units, services = systemd(read, Machine("/robot")), compose(read, Machine("."))
    for made, _ in (units, services, launch(read, LaunchFile("."), "<robot/>"), pods):
        for file in made:
            file.text.encode()


def message(data: bytes, _folder: Path) -> None:
    """A line between processes: a request, a notice, an event or an order."""
    for read in (REQUESTS.decode, read_notice, GUARD_EVENTS.decode, GUARD_ORDERS.decode):
        with suppress(*UNREADABLE):
            read(data)


def transforms(data: bytes, _folder: Path) -> None:
    """The bytes of a TFMessage."""
    with suppress(ValueError):
        for transform in decode(data):
            assert isinstance(transform.child, str)
    decoder = Decoder()
    for _ in range(2):
        with suppress(ValueError):
            list(decoder.rows(data))
        with suppress(ValueError):
            decoder.stamps(data)


@dataclass(frozen=True)
class Kind:
    """A kind of input: its reader, and how many inputs count as one of another kind."""

    read: Callable[[bytes, Path], None]
    weight: float = 1.0

    @property
    def name(self) -> str:
        return self.read.__name__

    def corpus(self) -> list[bytes]:
        """Return the inputs that mutations begin with."""
        return [file.read_bytes() for file in sorted((CORPUS / self.name).iterdir())]


KINDS = (
    Kind(robot, 0.5),
    Kind(calibration),
    Kind(params),
    Kind(urdf),
    Kind(xacro, 0.05),
    Kind(script, 0.2),
    Kind(launch_file, 0.02),
    Kind(arguments, 0.3),
    Kind(plan),
    Kind(message),
    Kind(transforms),
)


class TooLongError(BaseException):
    """An input takes more processor time than it may."""


def _refuse(_number: int, _frame: FrameType | None) -> None:
    raise TooLongError


@contextmanager
def _bounded() -> Iterator[None]:
    before = signal.signal(signal.SIGVTALRM, _refuse)
    signal.setitimer(signal.ITIMER_VIRTUAL, MOST_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def fault_of(kind: Kind, data: bytes, folder: Path) -> str:
    """Return how the reading of an input ends where it should not: a traceback, or empty."""
    try:
        with _bounded():
            kind.read(data, folder)
    except (Exception, TooLongError):  # noqa: BLE001 (whatever it is, it should not be)
        return traceback.format_exc()
    return ""


def inputs(kind: Kind, seed: int, count: int) -> Iterator[bytes]:
    """Yield mutations of the corpus; the same ones for the same seed and corpus."""
    corpus, rng = kind.corpus(), random.Random(f"{kind.name} {seed}")
    for _ in range(count):
        yield mutated(rng.choice(corpus), corpus, rng)


def _kept(kind: Kind, data: bytes) -> Path:
    file = CORPUS / kind.name / f"found-{hashlib.sha256(data).hexdigest()[:12]}"
    file.write_bytes(data)
    return file


def main(count: int, seed: int) -> int:
    """Try so many inputs of each kind; return how many ended otherwise than they should."""
    failures = 0
    with tempfile.TemporaryDirectory() as folder:
        for kind in KINDS:
            tried, faults = 0, set[tuple[str, ...]]()
            for data in inputs(kind, seed, int(count * kind.weight)):
                fault, tried = fault_of(kind, data, Path(folder)), tried + 1
                where = tuple(fault.splitlines()[-3:])
                if fault and where not in faults:
                    faults.add(where)
                    sys.stderr.write(f"{_kept(kind, data)}\n{fault}\n")
            failures += len(faults)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
            sys.stdout.write(
                f"{kind.name}: {tried} inputs, {len(faults)} faults; peak memory {peak} MB\n"
            )
            sys.stdout.flush()
    return failures


if __name__ == "__main__":
    sys.exit(bool(main(int(sys.argv[1]), int(sys.argv[2]))))
