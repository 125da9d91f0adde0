"""What a finding names. How it says so stands in tests/golden/wording."""

from tfcompose.foundation.findings import Finding


def words(found: Finding) -> set[str]:
    """Return the words of a finding's message, without the punctuation behind them."""
    return words_of(found.message)


def words_of(text: str) -> set[str]:
    return {word.rstrip(",;:.?") for word in text.split()}


def expect(found: Finding, code: str, *names: str) -> None:
    """Check that a finding has this code and contains all of these names.

    They may be in its message, notes or help.
    """
    text = "\n".join([found.message, *(note.message for note in found.notes), found.help])
    assert (found.code, [name for name in names if name not in text]) == (code, []), text
