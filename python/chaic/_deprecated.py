"""Old names of parameters and attributes; each works for one version and raises a ``DeprecationWarning``."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any


def warn(old: str, new: str, *, stacklevel: int = 3) -> None:
    """Warns that ``old`` is now called ``new``; the default ``stacklevel`` names the caller's caller."""
    warnings.warn(f"{old} is deprecated; use {new}", DeprecationWarning, stacklevel=stacklevel)


def rename_keys(values: dict[str, Any], renamed: Mapping[str, str]) -> None:
    """Replaces old keys in ``values`` by new ones. ``TypeError`` if both the old and the new key are present."""
    for old, new in renamed.items():
        if old not in values:
            continue
        if new in values:
            raise TypeError(f"{old} is the old name of {new}; give {new} only")
        warn(old, new, stacklevel=4)
        values[new] = values.pop(old)


def partner_image_size(new: int | None, old: int | None) -> int | None:
    """Returns ``partner_image_size``, or the value of its old name ``minds_image_size``."""
    if old is None:
        return new
    if new is not None:
        raise TypeError("minds_image_size is the old name of partner_image_size; give partner_image_size only")
    warn("minds_image_size", "partner_image_size", stacklevel=4)
    return old
