"""One test for a table of cases."""

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any


def for_each(cases: Iterable[Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Make one test of all cases.

    Its failure names each case that does not hold, with what is wrong in it.

    The test's first parameter is given the case; where cases are tuples, as many parameters are
    given their members. Further parameters are fixtures, which all cases share.
    """
    table = [case if isinstance(case, tuple) else (case,) for case in cases]
    assert table, "a table without cases claims nothing"

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        signature = inspect.signature(test)
        of_a_case = list(signature.parameters)[: len(table[0])]

        @functools.wraps(test)
        def test_of_all(**fixtures: Any) -> None:
            failures = []
            for case in table:
                try:
                    test(**dict(zip(of_a_case, case, strict=True)), **fixtures)
                except Exception as error:  # noqa: BLE001 (whatever is wrong with a case, the others are tried)
                    failures.append(
                        f"{', '.join(map(str, case))}: {type(error).__name__}: {error}"
                    )
            assert not failures, f"{len(failures)} of {len(table)} cases:\n" + "\n".join(failures)

        fixtures = [each for name, each in signature.parameters.items() if name not in of_a_case]
        test_of_all.__signature__ = signature.replace(parameters=fixtures)  # type: ignore[attr-defined]
        return test_of_all

    return decorate
