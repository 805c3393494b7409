# dovetail: everything a newcomer types. Each target installs what it lacks (tools/setup.sh).

.PHONY: run test lint bench extremes setup vtk clean
.DEFAULT_GOAL := run

VTK_PYTHON := target/venv/bin/python

# The paper's scene, from mesh to results, in output/paper.
run: setup
	cargo run --release --locked -- run scenes/paper.toml

# Every test, then a run whose files VTK's own reader reads back.
test: setup vtk
	cargo test --locked
	cargo build --release --locked
	target/release/dovetail run scenes/paper.toml --out output/check --quiet \
	    --set response.points=21
	$(VTK_PYTHON) scripts/check_output.py output/check

lint:
	cargo fmt --check
	cargo clippy --locked --all-targets -- -D warnings

# Seconds and ratios; see docs/performance.md.
bench: setup
	cargo bench --locked

# Every extreme of the input, as the table of docs/verification.md.
extremes: setup
	cargo build --release --locked
	python3 scripts/extremes.py

setup:
	@tools/setup.sh

vtk:
	@tools/setup.sh vtk

clean:
	cargo clean
	rm -rf output
