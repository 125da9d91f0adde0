"""Atomic writes of a single file, or of all files of a robot together."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import posixpath
import shutil
import stat
import tempfile
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from tfcompose.cli.compiling import compile_without_errors
from tfcompose.cli.terminal import UNREADABLE, fail, reject, warn
from tfcompose.compiler.emit import descriptions_of, emit
from tfcompose.foundation.findings import Finding, finding
from tfcompose.foundation.reading import exists, is_file, is_folder
from tfcompose.model.files import Target, assets_without_address
from tfcompose.model.plan import DESCRIPTION, STOCK_DESCRIPTION

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Iterable, Sequence

    from tfcompose.model.files import File, Form
    from tfcompose.model.robot import Asset, Robot


_PNG_PACKAGES = ("resvg_py", "font_lato")


def require_png_packages() -> None:
    """Refuse a picture as PNG before doing any work for it, if its packages are missing.

    Raises:
        SystemExit: after reporting one.
    """
    missing = [package for package in _PNG_PACKAGES if find_spec(package) is None]
    if missing:
        advice = "pip install 'tfcompose[pictures]'; svg needs nothing"
        fail(f"PNG needs the package {missing[0]}: {advice}", UNREADABLE)


def replace_file(path: Path, data: bytes) -> None:
    """Write the file atomically.

    A concurrent reader sees the old or the new file. Mode and owner stay. A device, a pipe or the
    target of a symbolic link is written directly.

    Raises:
        OSError: if the file cannot be written; the file is then unchanged.
    """
    before = path.stat() if exists(path) else None
    if path.is_symlink() or (before and not stat.S_ISREG(before.st_mode)):
        path.write_bytes(data)
        return
    descriptor, name = tempfile.mkstemp(prefix=".tfcompose-", dir=path.parent)
    new = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
            if before:
                with contextlib.suppress(PermissionError):  # the file of another user
                    os.fchown(stream.fileno(), before.st_uid, before.st_gid)
            os.fchmod(
                stream.fileno(), stat.S_IMODE(before.st_mode) if before else 0o666 & ~_umask()
            )
        new.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            new.unlink()
        raise


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def write_all(folder: Path, files: Sequence[File], earlier: Iterable[str] = ()) -> None:
    """Write files below ``folder``, such as the files of a build.

    A reader sees each file old or new, never partial. All files are first written to a folder
    inside ``folder``. After the last byte is on the disk, the files are moved into place, which
    needs no further space. If a file cannot be moved, the files before it are restored. Parameter
    files of an earlier build, and the files in ``earlier``, are removed if they are not among the
    new files.

    Raises:
        OSError: if the files cannot be written; then nothing has changed.
    """
    made = [parent for parent in (folder, *folder.parents) if not exists(parent)]
    before = [*_parameter_files(folder), *earlier]
    now = {file.path for file in files}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=".tfcompose-", dir=folder))
        try:
            for file in files:
                _write_to_disk(staging / "new" / file.path, file.text)
            _move(staging, folder, [file.path for file in files])
        finally:
            shutil.rmtree(staging, ignore_errors=True)
    except OSError:
        for parent in made:
            _remove_if_empty(parent)
        raise
    _remove_stale(folder, [path for path in before if path not in now])


def create_folder(folder: Path, files: Iterable[File]) -> None:
    """Create a folder with all of the files, or not at all. An empty folder may exist.

    The files are first written to a hidden folder next to it, which is then renamed.

    Raises:
        FileExistsError: if a file, or a folder that is not empty, has this name.
        OSError: if the files cannot be written; then nothing has changed.
    """
    made = [parent for parent in folder.parents if not exists(parent)]
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=".tfcompose-", dir=folder.parent))
        try:
            for file in files:
                _write_to_disk(staging / "new" / file.path, file.text)
            _rename_to_absent(staging / "new", folder)
        finally:
            shutil.rmtree(staging, ignore_errors=True)
    except BaseException:
        for parent in made:
            _remove_if_empty(parent)
        raise


def _rename_to_absent(new: Path, folder: Path) -> None:
    """Rename a folder. An empty folder with the new name is replaced.

    Raises:
        FileExistsError: if another file or folder has the new name.
    """
    try:
        new.rename(folder)
    except OSError as error:
        if error.errno in {errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR, errno.EBUSY}:
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(folder)) from None
        raise


def _move(staging: Path, folder: Path, paths: list[str]) -> None:
    """Move all files into place, or none.

    Replaced files are kept until the last file is in place.
    """
    made = [
        parent for parent in {(folder / path).parent: None for path in paths} if not exists(parent)
    ]
    done: list[str] = []
    try:
        for path in paths:
            target, old = folder / path, staging / "old" / path
            if is_folder(target) and not target.is_symlink():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
            target.parent.mkdir(parents=True, exist_ok=True)
            if exists(target):
                old.parent.mkdir(parents=True, exist_ok=True)
                _back_up(target, old)
        for path in paths:
            (staging / "new" / path).replace(folder / path)
            done.append(path)
    except OSError:
        for path in done:
            _put_back(staging / "old" / path, folder / path)
        for parent in reversed(made):
            _remove_if_empty(parent)
        raise


def _back_up(target: Path, old: Path) -> None:
    """Keep the old file under another name while a new file replaces it.

    If the file cannot be linked, it is copied.
    """
    with contextlib.suppress(OSError):
        if not target.is_symlink():
            os.link(target, old)
            return
    shutil.copy2(target, old)


def _put_back(old: Path, target: Path) -> None:
    with contextlib.suppress(OSError):
        if exists(old):
            old.replace(target)
        else:
            target.unlink()


def _remove_if_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()


def _write_to_disk(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="\n") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())


def _parameter_files(folder: Path) -> list[str]:
    """Return the parameter files of an earlier build, from the plan in the folder."""
    if not is_folder(folder / "params"):
        return []
    try:
        processes = json.loads((folder / "plan.json").read_text("utf-8"))["processes"]
        named = [process.get("params_file") for process in processes]
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return []
    return [
        name
        for name in named
        if isinstance(name, str) and name.startswith("params/") and ".." not in name
    ]


def _remove_stale(folder: Path, stale: Sequence[str]) -> None:
    for name in stale:
        with contextlib.suppress(OSError):
            (folder / name).unlink()
        for parent in (folder / name).relative_to(folder).parents[:-1]:
            _remove_if_empty(folder / parent)


def build(arguments: Namespace) -> tuple[Path, list[str], tuple[Finding, ...]]:
    """Build the robot; return the folder, the file names and the printed warnings.

    Raises:
        SystemExit: after an error message; then nothing was written.
    """
    reads_back = getattr(arguments, "read_back", False)
    if reads_back and find_spec("yourdfpy") is None:
        fail("--read-back needs the package yourdfpy: pip install 'tfcompose[view]'", UNREADABLE)
    robot, compiled = compile_without_errors(arguments.file, arguments)
    folder, target = destination(arguments, robot)
    lost = [
        _without_address(asset, target.form)
        for asset in assets_without_address(robot, target.form)
    ]
    if lost:
        reject(lost)
    shared = None if arguments.output else _other_source(folder, arguments.file)
    files = emit(robot, target)
    different = _differences(robot, files, target) if reads_back else []
    if different:
        reject(different)
    try:
        write_all(folder, files)
        if not arguments.output and is_file(arguments.file):
            replace_file(
                _source_file(folder), os.fsencode(f"{os.path.relpath(arguments.file, folder)}\n")
            )
    except OSError as error:
        where = f": {error.filename}" if error.filename else ""
        fail(f"nothing was written to {folder}: {error.strerror}{where}", UNREADABLE)
    if shared:
        warn(f"{folder} held the build of {shared}; -o builds into another folder")
    return folder, [file.path for file in files], compiled.findings


def _source_file(folder: Path) -> Path:
    """Return the file next to the folder that contains the path of the robot file.

    Two robot files may have the same robot name, and so the same folder.
    """
    return folder.with_name(f".{folder.name}.source")


def _other_source(folder: Path, file: str) -> Path | None:
    """Return the other robot file from which the folder was built, None if it no longer exists."""
    with contextlib.suppress(OSError, ValueError):
        before = folder / os.fsdecode(_source_file(folder).read_bytes()).removesuffix("\n")
        if not before.samefile(file):
            return Path(os.path.normpath(before))
    return None


def destination(arguments: Namespace, robot: Robot) -> tuple[Path, Target]:
    """Return the folder for the robot's files, and the form of addresses in these files."""
    folder = Path(arguments.output) if arguments.output else Path("build") / robot.name
    form: Form = getattr(arguments, "mesh", "as-written")
    return folder, Target(form, folder.as_posix(), Path.cwd().as_posix())


def _differences(robot: Robot, files: Iterable[File], target: Target) -> list[Finding]:
    """Return the differences between the robot and its URDFs, which are read back."""
    from tfcompose.compiler.urdf.read_back import differences

    texts = {file.path: file.text for file in files}
    advice = "nothing was written; this is a bug in tfcompose: please report it"
    findings = []
    for part, described_robot in descriptions_of(robot):
        folder = f"{part}/" if part else ""
        inside = replace(target, folder=posixpath.join(target.folder, folder))
        for name, full in ((DESCRIPTION, True), (STOCK_DESCRIPTION, False)):
            path = folder + name
            differences_of = differences(described_robot, texts[path], inside, full=full)
            findings += [
                finding("TF910", f"{path}: {difference}", None, help=advice)
                for difference in differences_of
            ]
    return findings


def _without_address(asset: Asset, form: Form) -> Finding:
    """Return the finding about a file that has no address in the requested form."""
    if form != "package":
        return finding(
            "TF724",
            f"{asset.uri} was not found and has no path",
            asset.span,
            help="build without --mesh",
        )
    advice = (
        "a folder with a package.xml above it, packages: {name: FOLDER} and package://name/…, or"
        " no --mesh"
    )
    return finding("TF726", f"{asset.uri} is in no package", asset.span, help=advice)
