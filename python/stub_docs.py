"""Copies the docstrings of the native module into its type stubs, for editors that read only stubs.

    python python/stub_docs.py [--check]
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from typing import Any

from chaic import _chaic

STUBS = Path(__file__).parent / "chaic" / "_chaic.pyi"


def with_docstrings(text: str) -> str:
    """Returns the stubs with their docstrings replaced by those of the installed module."""
    lines = text.splitlines()
    # The order from last to first keeps the line numbers of earlier definitions valid.
    for node, item in reversed(list(_definitions(ast.parse(text)))):
        doc = (item.__doc__ or "").strip()
        body = node.body[0]
        has_doc = isinstance(body, ast.Expr) and isinstance(getattr(body.value, "value", None), str)
        if has_doc:
            assert body.end_lineno is not None
            del lines[body.lineno - 1 : body.end_lineno]
            if len(node.body) == 1:
                head = lines[body.lineno - 2]
                lines[body.lineno - 2] = f"{head} ..."
        if not doc:
            continue
        indent = " " * (node.col_offset + 4)
        quoted = [f'{indent}"""{doc.splitlines()[0]}'] + [
            f"{indent}{line}" if line else "" for line in doc.splitlines()[1:]
        ]
        quoted[-1] += '"""'
        above = body.lineno - 1
        if isinstance(node, ast.ClassDef):
            only = len(node.body) == 1 and lines[node.lineno - 1].endswith(" ...")
            if only:
                lines[node.lineno - 1] = lines[node.lineno - 1].removesuffix(" ...")
            lines[node.lineno : node.lineno] = quoted
            continue
        last = above if not has_doc else above - 1
        if lines[last].endswith(" ..."):
            lines[last] = lines[last].removesuffix(" ...")
        lines[last + 1 : last + 1] = quoted
    return "\n".join(lines) + "\n"


def _definitions(tree: ast.Module) -> Any:
    """Yields the classes, functions and methods of the stubs with their runtime objects."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            owner = getattr(_chaic, node.name)
            yield node, owner
            for member in node.body:
                if isinstance(member, ast.FunctionDef) and member.name not in ("__new__", "__len__"):
                    yield member, getattr(owner, member.name)
        elif isinstance(node, ast.FunctionDef):
            yield node, getattr(_chaic, node.name)


def main() -> None:
    text = STUBS.read_text()
    updated = with_docstrings(text)
    if sys.argv[1:] == ["--check"]:
        problem = f"{STUBS.name} differs from the docstrings of the module; run python/stub_docs.py"
        sys.exit(problem if updated != text else 0)
    STUBS.write_text(updated)


if __name__ == "__main__":
    main()
