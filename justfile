# `just` lists the recipes. CONTRIBUTING.md describes when to use which.

set shell := ["bash", "-euo", "pipefail", "-c"]

# Lists the recipes
default:
    @just --list

# Fast loop: format and lints of all targets
check:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets --locked -- -D warnings

# Tests one crate: `just test chaic-world`, `just test chaic-world --test it random`
test CRATE *ARGS:
    cargo test --locked -p {{CRATE}} {{ARGS}}

# Runs everything that CI runs, about 25 minutes from a cold clone on two cores
ci:
    .ci/run

# Rewrites the golden files after an intended change of states or images
bless:
    cargo run --locked -p chaic-goldens -- --update
    CHAIC_BLESS=1 cargo test --locked -p chaic-render --test it golden
    git diff --stat -- crates/dev/chaic-goldens/goldens.txt crates/render/chaic-render/tests/it/golden.txt

# Builds the reference of all crates into target/doc, and the book with replays into book/ if mdbook is installed
docs:
    RUSTDOCFLAGS='-D warnings' cargo doc --workspace --no-deps --locked
    if command -v mdbook >/dev/null; then cargo build --locked -p chaic; docs/book.sh target/debug/chaic; else echo "mdbook is not installed: skipped the book"; fi

# Builds the Python wheel into dist/
wheel:
    python3 -m venv target/wheel-venv
    target/wheel-venv/bin/pip install --quiet 'maturin>=1.9,<2'
    PATH="$PWD/target/wheel-venv/bin:$PATH" maturin build --release --locked --out dist
