"""What a finding names. How it says so stands in tests/golden/wording."""

from tfcompose.foundation.findings import Finding


def words(finding: Finding) -> set[str]:
    """Return the words of a finding's message, without the punctuation behind them."""
    return words_of(finding.message)


def words_of(text: str) -> set[str]:
    return {word.rstrip(",;:.?") for word in text.split()}


def expect(finding: Finding, code: str, *names: str) -> None:
    """Check that a finding has this code and contains all of these names.

    They may be in its message, notes or help.
    """
    text = "\n".join([finding.message, *(note.message for note in finding.notes), finding.help])
    assert (finding.code, [name for name in names if name not in text]) == (code, []), text
