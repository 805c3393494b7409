# dovetail: everything a newcomer types. Each target installs what it lacks (tools/setup.sh).

.PHONY: run views test python wheel dist try-install verify calculix lint deny book bench against peers truth extremes study cluster-test mutants fuzz setup checks clean
.DEFAULT_GOAL := run

PYTHON := target/venv/bin/python

# The paper's scene, from mesh to results, in output/paper.
run: setup
	cargo run --release --locked -- run scenes/paper.toml

# The pictures of the paper's scene in docs/images: the moving one of the README, and those of the guide
# to ParaView, by the views of the folder views with one X server for all of them.
views: setup checks
	@tools/setup.sh views
	[ -e output/paper/peak.vtu ] || $(MAKE) run
	$(PYTHON) scripts/draw_motion.py output/paper docs/images/motion.gif
	xvfb-run -a views/pictures.sh output/paper docs/images

# Every test, then a run whose files VTK's own reader, meshio and pyvista read back.
test: setup checks
	@tools/setup.sh python
	cargo test --locked --workspace
	target/debug/dovetail run scenes/paper.toml --out output/check --quiet
	$(PYTHON) scripts/check_output.py output/check

# The Python package of the debug build, in target/python: PYTHONPATH=target/python python3.
python: setup
	cargo build --locked --package dovetail-python
	rm -rf target/python
	mkdir -p target/python
	cp -r crates/python/python/dovetail target/python
	cp target/debug/lib_dovetail.so target/python/dovetail/_dovetail.abi3.so

# The Python package and the program in one wheel, in target/wheels.
wheel: setup
	@tools/setup.sh dist
	tools/package.sh wheel

# An archive with the program, its man pages, completions and scenes, in target/dist.
dist: setup
	@tools/setup.sh dist
	tools/package.sh dist

# The wheel and the archive in a root without compiler, gmsh and BLAS. Needs root.
try-install: wheel dist
	@tools/setup.sh root
	$(if $(filter 0,$(shell id -u)),,sudo) scripts/try_install.sh

# The library without the readers of meshes, the slow tests, the kernels of `make bench` once, the
# comparisons with CalculiX if it is installed, the extremes, and .ci/slow. docs/verification.md has
# their figures and how long they take.
verify: setup
	@tools/setup.sh calculix
	cargo clippy --locked --package dovetail-solver --no-default-features -- -D warnings
	cargo build --release --locked
	cargo test --release --locked --workspace -- --ignored
	cargo bench --locked --bench kernels -- --test
	@if command -v ccx >/dev/null; then $(MAKE) calculix; \
	    else echo "verify: no CalculiX (ccx), its comparisons are left out"; fi
	$(MAKE) extremes
	.ci/slow

calculix: setup
	@tools/setup.sh calculix
	$(PYTHON) benches/calculix/compare_blade_modes.py
	$(PYTHON) benches/calculix/campbell.py
	$(PYTHON) benches/calculix/nodal_diameters.py
	$(PYTHON) benches/calculix/matrices.py meshes/dovetail.msh
	$(PYTHON) benches/calculix/initial_displacement.py meshes/dovetail.msh
	$(PYTHON) benches/calculix/quadrature.py meshes/dovetail.msh
	$(PYTHON) benches/calculix/compare_elements.py
	$(PYTHON) benches/calculix/compare_elements.py --rpm 20000
	$(PYTHON) benches/calculix/stress.py
	$(PYTHON) benches/calculix/contact_statics.py meshes/dovetail.msh --jaw-rotates

lint:
	cargo fmt --all --check
	cargo fmt --manifest-path fuzz/Cargo.toml --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --no-deps

# Licences, origin and unwanted ones of all dependencies, as deny.toml has them.
deny:
	@cargo deny --version >/dev/null 2>&1 || cargo install --locked cargo-deny
	cargo deny --all-features check bans licenses sources

# The book of docs, in target/book.
book:
	@mdbook --version >/dev/null 2>&1 || cargo install --locked mdbook
	mdbook build docs

# Seconds and ratios; see docs/performance.md.
bench: setup
	cargo bench --locked
	cargo build --release --locked
	python3 benches/growth.py

# This tree beside another commit on this machine, as ratios: make against REV=24db848a. ONLY names the
# inputs, of which benches/against.py has a list.
against: setup
	python3 benches/against.py $(REV) $(if $(ONLY),--only $(ONLY))

# dovetail beside pyHarm and a dense Newton in numpy on one reduced model; see docs/performance.md. Then
# beside pyHarm and tmdsimpy on their examples of contact through springs; see docs/verification.md.
peers: setup
	benches/peers/compare.sh
	benches/peers/penalty/compare.sh

# Random small models beside periodic motions by integration in time, as rates of right and wrong answers; see
# docs/verification.md. TRUTH has options: make truth TRUTH="--models 500 --accuracy 0.001".
truth: setup
	@tools/setup.sh python
	cargo build --release --locked --package dovetail-python
	mkdir -p target/truth/python
	cp -r crates/python/python/dovetail target/truth/python
	cp target/release/lib_dovetail.so target/truth/python/dovetail/_dovetail.abi3.so
	$(PYTHON) benches/truth/run.py --check $(TRUTH)

# Every extreme of the input, as the table of docs/extremes.md.
extremes: setup
	cargo build --release --locked
	python3 scripts/extremes.py

# What the settings of the solution cost and buy on the paper's scene; see docs/study_results.md.
# The study of the flank mesh takes a quarter of an hour and 3 GB:
# dovetail study studies/flank_mesh.toml --jobs 1 --threads 2.
study: setup
	cargo build --release --locked
	target/release/dovetail study studies/harmonics.toml

# The workflow of a study on a Slurm of two nodes that is made on this machine: one node dies, and the
# results are those of a local run. Needs root; see docs/verification.md.
cluster-test: setup
	@tools/setup.sh cluster
	cargo build --release --locked
	$(if $(filter 0,$(shell id -u)),,sudo) python3 scripts/cluster_test.py

# Which changes of the contact core its fast tests do not notice; with SHARD=0/8 an eighth of them.
# See docs/verification.md.
MUTANTS := cargo mutants --profile mutants -C=--locked \
    $(if $(SHARD),--shard $(SHARD) --sharding round-robin)
mutants: setup checks
	@cargo mutants --version >/dev/null 2>&1 || cargo install --locked cargo-mutants
	mkdir -p output
	$(MUTANTS) --output output/mutants_core --package dovetail-dynamics -C=--lib \
	    -f crates/dynamics/src/contact/coulomb.rs -f crates/dynamics/src/contact/mod.rs \
	    -f crates/dynamics/src/contact/penalty.rs -f crates/dynamics/src/dlft/gross_slip.rs \
	    -f crates/dynamics/src/dlft/balance.rs \
	    -f crates/dynamics/src/dlft/orbit.rs -f crates/dynamics/src/dlft/retention.rs \
	    -f crates/dynamics/src/dlft/branch/folds.rs -f crates/dynamics/src/dlft/peaks.rs -- -- \
	    contact:: problem:: dlft::balance dlft::dense dlft::aft dlft::gross_slip \
	    dlft::jacobians dlft::orbit dlft::retention dlft::branch::folds dlft::peaks \
	    --skip corrections_of
	$(MUTANTS) --output output/mutants_results --package dovetail-solver -C=--lib \
	    -f crates/solver/src/results/quantities.rs -- -- results::
	$(MUTANTS) --output output/mutants_sweep --package dovetail-dynamics -C=--lib \
	    -f crates/dynamics/src/dlft/sweep.rs -- -- dlft::sweep::of_a_mass
	DOVETAIL_PYTHON=$(CURDIR)/$(PYTHON) $(MUTANTS) --output output/mutants_export \
	    --package dovetail-export --test-package dovetail -C=--test=program \
	    -f crates/export/src/flank.rs -- -- export_files:: --skip notices

# Texts and files that a user gives, as inputs that a fuzzer changes: each target for so many
# seconds. See docs/verification.md.
FUZZ_SECONDS := 3600
fuzz: setup
	@tools/setup.sh fuzz
	@cargo fuzz --version >/dev/null 2>&1 || cargo install --locked cargo-fuzz
	fuzz/run.sh $(FUZZ_SECONDS)

setup:
	@tools/setup.sh

checks:
	@tools/setup.sh checks

clean:
	cargo clean
	rm -rf output
