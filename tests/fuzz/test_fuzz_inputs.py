"""Whatever bytes come in, they are read or refused.

No traceback, no endless reading, no raw control characters.
"""

import os
from pathlib import Path

import pytest

from tests.support.fuzzing import CORPUS, KINDS, Kind, fault_of, inputs

#: So many of each kind; TFCOMPOSE_FUZZ=12000 tries a hundred thousand in all.
COUNT = int(os.environ.get("TFCOMPOSE_FUZZ", "150"))
SEED = int(os.environ.get("TFCOMPOSE_FUZZ_SEED", "1"))


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_what_was_found_once_stays_mended(kind: Kind, tmp_path: Path) -> None:
    faults = [fault for data in kind.corpus() if (fault := fault_of(kind, data, tmp_path))]
    assert not faults, faults[0]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_mutated_inputs_are_read_or_refused(kind: Kind, tmp_path: Path) -> None:
    for data in inputs(kind, SEED, int(COUNT * kind.weight)):
        assert not (fault := fault_of(kind, data, tmp_path)), f"{data!r}\n{fault}"


def test_each_kind_of_input_has_a_corpus_that_is_small() -> None:
    assert {folder.name for folder in CORPUS.iterdir()} == {kind.name for kind in KINDS}
    assert sum(file.stat().st_size for file in CORPUS.rglob("*") if file.is_file()) < 200_000
