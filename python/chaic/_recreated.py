"""Pickling and copying of environments by their constructor arguments."""

from __future__ import annotations

from typing import Any, TypeVar

T = TypeVar("T", bound="Recreated")


class Recreated:
    """Environment whose pickle and whose copies are its constructor arguments, as with ``EzPickle`` of Gymnasium.

    The result is a new environment without an episode, so it needs a reset. Subclasses may have other arguments.
    """

    _constructor_arguments: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls: type[T], *args: Any, **kwargs: Any) -> T:
        env = object.__new__(cls)
        env._constructor_arguments = (args, kwargs)
        return env

    def __reduce__(self) -> tuple[Any, ...]:
        # Gymnasium sets the specification after the construction.
        state = {name: value for name, value in vars(self).items() if name == "spec"}
        return _create, (type(self), *self._constructor_arguments), state


def _create(cls: type[T], args: tuple[Any, ...], kwargs: dict[str, Any]) -> T:
    return cls(*args, **kwargs)
