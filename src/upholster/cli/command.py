"""What all commands check before they run: options given once, numbers that are numbers."""

from itertools import zip_longest
from typing import Any

from typer.core import TyperCommand

from upholster.errors import InputError

__all__ = ["Command"]

_TELLS = {"--project": ("on",)}
"""Options that tell what others would, which then need not be given."""

_NUMBERS = {"integer": "a whole number", "float": "a number", "number": "a number"}
"""What is allowed, by a word that Typer's message has: its versions differ in all else."""


class Command(TyperCommand):
    """A command that refuses what Typer would take without a word, or in words that name no value."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read a command line.

        Raises
        ------
        InputError
            If an option that takes one value is given twice, or a number is none.
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
            wrong: Any = getattr(error, "param", None)
            message = str(getattr(error, "message", ""))
            kind = next((allowed for word, allowed in _NUMBERS.items() if word in message), None)
            value = _value(written, getattr(wrong, "opts", []))
            if wrong is None or kind is None or value is None:
                raise
            raise InputError(f"{wrong.opts[-1]} is {value!r}; allowed: {kind}") from None

    def _check_missing(self, ctx: Any, words: list[str]) -> None:
        """Name all options that are missing at once, and show how they are used."""
        if any(word in ctx.help_option_names for word in words):
            return
        told = [name for option, names in _TELLS.items() if _is_given(words, [option]) for name in names]
        missing = [
            f"{'/'.join(param.opts)} {param.metavar or ''}".rstrip()
            for param in self.params
            if param.required
            and param.name not in told
            and param.param_type_name == "option"
            and not _is_given(words, param.opts)
        ]
        if missing and words:
            example = f"; {self.epilog[0].lower()}{self.epilog[1:]}" if self.epilog else ""
            raise InputError(f"missing: {', '.join(missing)}{example}".replace("`", ""))


def _is_given(words: list[str], names: list[str]) -> bool:
    """Whether an option is among words; a short one may have its value behind it."""
    return any(
        word.split("=")[0] in names or (word[:2] in names and not word.startswith("--")) for word in words
    )


def _value(words: list[str], names: list[str]) -> str | None:
    """Return what stands behind an option, None if it is not given."""
    for word, behind in zip_longest(words, words[1:]):
        name, equals, value = word.partition("=")
        if name in names:
            return value if equals else behind
    return None
