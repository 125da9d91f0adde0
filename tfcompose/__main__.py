"""The program: each command, and each process of tfcompose's own, starts here.

``tfcompose``, ``python -m tfcompose`` and ``python …/tfcompose/__main__.py`` are the same program.
No module comes from the folder that it is started in: a ``random.py`` there is the user's. So
nothing is imported before that folder is off the path (Python 3.10 has no ``-P`` to do so).
"""

import sys


def main() -> int:
    """Run the program, started as a script or with ``-m``, and return the exit code."""
    if not (sys.flags.isolated or getattr(sys.flags, "safe_path", False)):
        del sys.path[0]  # the script's folder; with -m the current one
    return run()


def run() -> int:
    """Run the program, started by ``launcher.program.ANYWHERE``, and return the exit code."""
    dropped = {"", *_from_python_path()}
    sys.path[:] = [folder for folder in sys.path if folder not in dropped]
    if "tfcompose" not in sys.modules:
        _load_package()
    from tfcompose.launcher.program import is_process, run_process

    if is_process(sys.argv[1:]):
        return run_process()
    from tfcompose.cli import main as run_command

    return run_command()


def _from_python_path() -> set[str]:
    """Return the current folder where PYTHONPATH puts it on the path, as its empty entries do."""
    import os  # Python has loaded it

    entries = os.environ.get("PYTHONPATH")
    if not entries or not any(
        os.path.normpath(entry) == "." for entry in entries.split(os.pathsep)
    ):
        return set()
    try:
        return {os.getcwd()}  # noqa: PTH109 (pathlib may not be loaded yet)
    except FileNotFoundError:  # it was removed
        return set()


def _load_package() -> None:
    """Load the package that this file is in, wherever that is."""
    from importlib.util import module_from_spec, spec_from_file_location
    from pathlib import Path

    folder = Path(__file__).absolute().parent
    spec = spec_from_file_location(
        "tfcompose", folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        raise ImportError(f"{folder} cannot be loaded")
    package = sys.modules["tfcompose"] = module_from_spec(spec)
    spec.loader.exec_module(package)


if __name__ == "__main__":
    _code = main()
    # Python remembers that Ctrl-C ended an exec of text, as `dataclass` makes them, and would at
    # last end by the signal although the command handled it. The next exec lets it forget.
    exec("")  # noqa: S102
    sys.exit(_code)
