"""The files of a recording, and what there is to say of those that cannot be read."""

from __future__ import annotations

import re
from pathlib import Path

ENDINGS = {".mcap", ".db3"}


class BagError(Exception):
    """Raised when a bag cannot be read; the message is one sentence for the user, ``help`` what to do."""

    def __init__(self, message: str, advice: str = "") -> None:
        super().__init__(message)
        self.help = advice


def files_at(path: Path) -> list[Path]:
    """Return what is to be read, in this order: a folder with its metadata, a file, or the files of a folder.

    Raises:
        BagError: if there is nothing there, or nothing that is a bag.
    """
    if path.name == "metadata.yaml":
        path = path.parent
    if not path.exists():
        raise BagError(f"there is no bag {path}")
    if path.is_dir():
        if (path / "metadata.yaml").exists():
            return [path]
        files = sorted((file for file in path.iterdir() if file.suffix in ENDINGS), key=_in_order)
        if not files:
            advice = "ros2 bag record makes a folder with metadata.yaml, which says what is in it"
            raise BagError(f"{path} has no metadata.yaml and holds no recording", advice)
        return files
    if path.suffix == ".bag":
        raise BagError(f"{path} is a bag of ROS 1", "rosbags-convert makes one of ROS 2 from it")
    if path.suffix in {".zstd", ".zst"}:
        raise BagError(f"{path} is compressed as a whole", "name its folder with metadata.yaml, or unzstd it first")
    if path.suffix not in ENDINGS:
        raise BagError(f"{path} is no recording: these end in .mcap or .db3", "or name the folder of one")
    return [path]


def _in_order(file: Path) -> list[tuple[int, str]]:
    """Order names by the numbers in them: a bag that was split is numbered."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", file.name)]


def damaged(path: str, error: Exception) -> BagError:
    """Return what to say where the library cannot read a bag."""
    words = " ".join(str(error).split()) or type(error).__name__
    advice = ""
    if "end magic" in words:
        words = "it ends in the middle, as when the recorder was killed"
        advice = "mcap recover FILE -o WHOLE.mcap keeps what is whole in it"
    elif _is_mcap(Path(path)) and not isinstance(error, OSError) and not type(error).__module__.startswith("rosbags"):
        words = f"it is damaged ({words})"  # what the library did not expect, such as a size beyond all bounds
        advice = "mcap recover FILE -o WHOLE.mcap keeps what is whole in it"
    elif "malformed" in words or "missing tables" in words or "not a database" in words:
        advice = "sqlite3 FILE .recover | sqlite3 WHOLE.db3 keeps what is whole in it"
    elif "metadata" in words or "database files are missing" in words:
        advice = "ros2 bag reindex writes metadata.yaml anew; or name a recording in the folder"
    return BagError(f"{path} cannot be read as a bag: {words}", advice)


def _is_mcap(path: Path) -> bool:
    return path.suffix == ".mcap" or any(path.glob("*.mcap"))
