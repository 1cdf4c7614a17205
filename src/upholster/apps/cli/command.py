"""Checks that all commands make before they run: options are given once, numbers are numbers."""

from itertools import zip_longest
from typing import Any

from typer.core import TyperCommand

from upholster.base.errors import InputError

__all__ = ["Command"]

_IMPLIES = {"--project": ("on",)}
"""Options that imply others, which then need not be given."""

_NUMBERS = {"integer": "a whole number", "float": "a number", "number": "a number"}
"""The allowed value, by a word in Typer's message: its versions differ in all other words."""


_MEANT = {"--scale": ["--sample-size", "--element-size"]}
"""Options to suggest for some that do not exist, instead of those with the most similar names."""


class Command(TyperCommand):
    """A command that refuses input which Typer would accept silently, or refuse without naming the value."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read a command line.

        Raises
        ------
        InputError
            If an option that takes one value is given twice, or a number is not a number.
        """
        written = list(args[: args.index("--")] if "--" in args else args)
        self._check_missing(ctx, written)
        for param in self.params:
            names = [*param.opts, *param.secondary_opts]
            given = [word for word in written if word.startswith("-") and word.split("=")[0] in names]
            if len(given) > 1 and not (param.multiple or getattr(param, "is_flag", False)):
                raise InputError(f"{param.opts[-1]} is given {len(given)} times; allowed: once")
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            if known := _MEANT.get(getattr(error, "option_name", "")):
                own = [name for param in self.params for name in param.opts]
                error.possibilities = [name for name in known if name in own]  # type: ignore[attr-defined]
            wrong: Any = getattr(error, "param", None)
            message = str(getattr(error, "message", ""))
            kind = next((allowed for word, allowed in _NUMBERS.items() if word in message), None)
            value = _value(written, getattr(wrong, "opts", []))
            if wrong is None or kind is None or value is None:
                raise
            raise InputError(f"{wrong.opts[-1]} is {value!r}; allowed: {kind}") from None

    def _check_missing(self, ctx: Any, words: list[str]) -> None:
        """Name all missing options in one message, with an example."""
        if any(word in ctx.help_option_names for word in words):
            return
        implied = [name for option, names in _IMPLIES.items() if _is_given(words, [option]) for name in names]
        missing = [
            f"{'/'.join(param.opts)} {param.metavar or ''}".rstrip()
            for param in self.params
            if param.required
            and param.name not in implied
            and param.param_type_name == "option"
            and not _is_given(words, param.opts)
        ]
        if missing and words:
            example = f"; {self.epilog[0].lower()}{self.epilog[1:]}" if self.epilog else ""
            raise InputError(f"missing: {', '.join(missing)}{example}".replace("`", ""))


def _is_given(words: list[str], names: list[str]) -> bool:
    """Whether an option is among words; a short one may be joined with its value."""
    return any(
        word.split("=")[0] in names or (word[:2] in names and not word.startswith("--")) for word in words
    )


def _value(words: list[str], names: list[str]) -> str | None:
    """Return the word after an option, None if it is not given."""
    for word, behind in zip_longest(words, words[1:]):
        name, equals, value = word.partition("=")
        if name in names:
            return value if equals else behind
    return None
