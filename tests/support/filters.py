"""Runs a seccomp filter on a system call without the kernel: those of other machines, too."""

import struct
from collections.abc import Sequence

_WORD = 0xFFFFFFFF


def verdict(program: bytes, architecture: int, number: int, arguments: Sequence[int] = ()) -> int:
    """Return what a filter returns for a call (linux/bpf_common.h)."""
    padded = [*arguments, *[0] * (6 - len(arguments))]
    data = struct.pack(
        "<IIQ6Q", number, architecture, 0, *(text & (1 << 64) - 1 for text in padded)
    )
    lines = [struct.unpack_from("HBBI", program, offset) for offset in range(0, len(program), 8)]
    index = value = 0
    while True:
        code, then, otherwise, operand = lines[index]
        index += 1
        if code == 0x20:
            value = int(struct.unpack_from("<I", data, operand)[0])
        elif code == 0x06:
            return int(operand)
        else:
            holds = {
                0x15: value == operand,
                0x35: value >= operand,
                0x45: bool(value & operand & _WORD),
            }[code]
            index += then if holds else otherwise
