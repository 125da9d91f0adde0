"""Texts and settings of processes for a launch file.

The launch file computes some of these texts when it starts, from its arguments and environment
variables.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tfcompose.model.process_keys import PROCESS_KEYS
from tfcompose.tools.exporters.launch_texts import ArgumentValue, FilePath, TypedText, text_of
from tfcompose.tools.exporters.launch_values import condition_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tfcompose.model.plan import PlanProcess
    from tfcompose.model.process_keys import Setting
    from tfcompose.tools.exporters.launch_texts import Text
    from tfcompose.tools.exporters.launch_values import Condition, LaunchValues

_TYPES = {"bool": "bool", "int": "int", "float": "float", "string": "str"}


class ProcessTexts:
    """Returns the texts of processes, with parts that the launch file computes."""

    def __init__(self, values: LaunchValues) -> None:
        self.values = values

    def condition(self, process: PlanProcess) -> Condition | None:
        """Return the condition of the process; None if it always starts."""
        expression = self.values.conditions.get(process.name)
        return condition_of(expression, self.values.kinds) if expression else None

    def text(self, process: PlanProcess, text: str) -> Text:
        """Return a text of the process, with its placeholders replaced by paths."""
        return text_of(text, self.file(process) if process.params_file else None)

    def file(self, process: PlanProcess) -> FilePath:
        """Return the process's parameter file."""
        return FilePath(process.params_file or "", process in self.values.more)

    def arguments(self, process: PlanProcess, argv: Iterable[str]) -> tuple[Text, ...]:
        """Return the arguments of a command; the launch file computes some of them."""
        made = self.texts_of(process, "args")
        return tuple(
            made.get(str(index), self.text(process, argument))
            for index, argument in enumerate(argv)
        )

    def environment(self, process: PlanProcess) -> dict[str, Text]:
        """Return the environment variables of the process."""
        env = {name: self.text(process, value) for name, value in process.env.items()}
        return env | self.texts_of(process, "env")

    def settings(self, process: PlanProcess, *, is_own: bool = True) -> tuple[Setting, ...]:
        """Return the settings of a process's keys.

        ``is_own`` is False if ``tfcompose exec`` starts the process's program.
        """
        settings: list[Setting] = []
        for key in PROCESS_KEYS:
            dialect = key.launch
            if dialect is None or (dialect.is_own and not is_own):
                continue
            if key.name == "env":
                env = self.environment(process)
                settings += [s._replace(value=env) for s in dialect.settings(process) if env]
            else:
                settings += self._with_texts(process, dialect.settings(process))
        return tuple(settings)

    def _with_texts(self, process: PlanProcess, settings: Iterable[Setting]) -> Iterator[Setting]:
        for setting in settings:
            if isinstance(setting.value, str):
                yield setting._replace(value=self.text(process, setting.value))
            else:
                yield setting

    def remap(self, process: PlanProcess) -> dict[str, Text]:
        """Return the process's remappings."""
        remap: dict[str, Text] = {old: (new,) for old, new in process.remap.items()}
        return remap | self.texts_of(process, "remap")

    def made_params(self, process: PlanProcess) -> dict[str, TypedText]:
        """Return the parameters that the launch file computes."""
        return {
            name: TypedText(text, _type_of(text))
            for name, text in self.texts_of(process, "params").items()
        }

    def param(self, process: PlanProcess, value: Any) -> Any:
        """Return a parameter's value, with the placeholders in its texts replaced by paths."""
        if isinstance(value, list):
            return [self.param(process, item) for item in value]
        if not isinstance(value, str):
            return value
        text = self.text(process, value)
        return value if text in {(value,), ()} else TypedText(text, "str")

    def texts_of(self, process: PlanProcess, section: str) -> dict[str, Text]:
        """Return the texts of a section that the launch file computes, by name.

        ``section`` is ``args``, ``env``, ``params`` or ``remap``.
        """
        texts = self.values.texts.get(process.name, {})
        return {
            key.removeprefix(f"{section}."): text
            for key, text in texts.items()
            if key.startswith(f"{section}.")
        }


def _type_of(text: Text) -> str:
    """Return the type of a parameter.

    If the text is a single argument, this is the argument's type, else str.
    """
    only, *rest = text
    return _TYPES[only.kind] if not rest and isinstance(only, ArgumentValue) else "str"
