"""Fails if a dependency has a license that this project doesn't accept.

Reads the output of `cargo metadata --format-version 1` from standard input.
"""

import json
import re
import sys

ACCEPTED = {
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    # The root certificates of webpki-roots: data, permissive.
    "CDLA-Permissive-2.0",
    "ISC",
    "MIT",
    "MIT-0",
    "MPL-2.0",
    "OFL-1.1",
    "Ubuntu-font-1.0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
}


def is_accepted(expression: str) -> bool:
    """Whether an SPDX expression can be met with accepted licenses alone.

    Handles what crates write: OR and AND with parentheses, and the old slash for OR.
    """
    expression = expression.replace("/", " OR ")
    for license_id in sorted(ACCEPTED, key=len, reverse=True):
        pattern = r"(?<![\w.-])" + re.escape(license_id) + r"(?![\w.-])"
        expression = re.sub(pattern, " True ", expression)
    expression = expression.replace(" OR ", " or ").replace(" AND ", " and ")
    left = re.sub(r"\b(True|or|and)\b|[()\s]", "", expression)
    if left:
        expression = re.sub(r"[A-Za-z][\w.+-]*(\s+WITH\s+[\w.-]+)?", keep_words, expression)
    return bool(eval(expression, {"__builtins__": {}}))  # only True, False, or, and, ( and )


def keep_words(match: re.Match) -> str:
    word = match.group(0)
    return word if word in ("True", "or", "and") else "False"


def main() -> int:
    packages = json.load(sys.stdin)["packages"]
    bad = [
        f"{p['name']} {p['version']}: {p['license'] or 'no license given'}"
        for p in packages
        if not is_accepted(p["license"] or "False")
    ]
    for line in bad:
        print(f"license not accepted: {line}", file=sys.stderr)
    print(f"{len(packages) - len(bad)} of {len(packages)} packages have accepted licenses")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
