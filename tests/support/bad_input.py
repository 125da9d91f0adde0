"""Files that are no robot: what each of them is, and where its one fault is."""

#: The smallest robot.
GOOD = "tfcompose: 1\nrobot: r\nlinks: {base_link: {}}\n"


def nested_aliases() -> str:
    """Return 10 MB that would be 9 to the power of many values if the aliases were followed."""
    lines = ["tfcompose: 1", "robot: r", "x-a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"x-a{n + 1}: &a{n + 1} [{', '.join([f'*a{n}'] * 9)}]" for n in range(190_000)]
    return "\n".join([*lines, "links: {base_link: {visual: *a190000}}", ""])


def small_bomb() -> str:
    lines = [
        "tfcompose: 1",
        "robot: r",
        "x-a0: &a0 {a: 1, b: 1, c: 1, d: 1, e: 1, f: 1, g: 1, h: 1, i: 1}",
    ]
    lines += [
        f"x-a{n + 1}: &a{n + 1} {{{', '.join(f'{k}: *a{n}' for k in 'abcdefghi')}}}"
        for n in range(30)
    ]
    return "\n".join([*lines, "links: *a30", ""])


BAD: dict[str, tuple[bytes, str, tuple[int, int], int]] = {  # text, code, place, exit code
    "empty": (b"", "TF002", (1, 1), 1),
    "only a comment": (b"# nothing\n", "TF002", (1, 1), 1),
    "binary": (bytes(range(256)), "TF001", (2, 118), 2),
    "a NUL": (b"tfcompose: 1\nrobot: \0\n", "TF001", (2, 1), 2),
    "latin-1": ("tfcompose: 1\nrobot: k\xe4se\n".encode("latin-1"), "TF001", (2, 9), 2),
    "a list": (b"- tfcompose: 1\n", "TF002", (1, 1), 1),
    "a tab": (b"tfcompose: 1\nlinks:\n\tbase_link: {}\n", "TF002", (3, 1), 1),
    "a bracket open": (b"tfcompose: 1\nrobot: [r\nlinks: {}\n", "TF002", (2, 8), 1),
    "two documents": (GOOD.encode() + b"---\na: 1\n", "TF002", (4, 1), 1),
    "aliases, 10 MB": (nested_aliases().encode(), "TF008", (1, 1), 1),
    "aliases, small": (small_bomb().encode(), "TF008", (8, 7), 1),
    "depth": (b"tfcompose: 1\nrobot: " + b"[" * 100_000, "TF008", (2, 47), 1),
    "an anchor that is not there": (b"tfcompose: 1\nrobot: *r\n", "TF002", (2, 8), 1),
    "a name with quotes": (
        GOOD.encode() + b"frames: {'\"q\"': {parent: base_link}}\n",
        "TF501",
        (4, 10),
        1,
    ),
    "a name with &": (
        GOOD.encode() + b"frames: {a&b: {parent: base_link}}\n",
        "TF501",
        (4, 10),
        1,
    ),
    "NaN": (
        GOOD.encode() + b"frames: {a: {parent: base_link, xyz: [.nan, 0, 0]}}\n",
        "TF007",
        (4, 39),
        1,
    ),
    "a preset that is not there": (
        GOOD.encode() + b"sensors: {a: {parent: base_link, preset: generic/lidar}}\n",
        "TF601",
        (4, 42),
        1,
    ),
    "a process named as a path": (
        GOOD.encode()
        + b"processes: {../../x: {run: {package: a, executable: b}, params: {c: 1}}}\n",
        "TF501",
        (4, 13),
        1,
    ),
}
