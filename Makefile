# make demo, make test: from a bare clone, everything that they need is installed into .venv first.
# ARGS goes to pytest or to the script:  make test ARGS="-k cvt -x"

.PHONY: help demo compare turntable test desktop bench build lint lock samples clean
.DELETE_ON_ERROR:

# uv trusts the certificates that the machine trusts, as pip does: some networks have their own.
export UV_SYSTEM_CERTS = true

python = .venv/bin/python
installed = .venv/installed
peers = .venv/peers

help: ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-9s %s\n", $$1, $$2 }' Makefile

demo: $(installed) ## the head, 200 guides, 30,000 strands: pictures and tables in out/demo
	$(python) blend_samples/demo.py --out out/demo $(ARGS)

test: $(installed) ## every test but the long benchmarks and those in a window
	$(python) -m pytest -m "not long and not desktop" $(ARGS)

desktop: $(installed) ## the tests in a window of Blender, OpenGL and Vulkan: pictures in out/desktop
	$(python) -m pytest -m desktop tests/desktop $(ARGS)

bench: $(installed) $(peers) ## the benchmarks, with their figures
	$(python) -m pytest tests/benchmarks -s $(ARGS)

compare: $(installed) ## the head by Cycles and by Vellus: mean colours, and both pictures, in out/compare
	$(python) blend_samples/compare.py --out out/compare $(ARGS)

turntable: $(installed) ## the head turning, 24 frames by the command line, in out/turntable; goes on where it was stopped
	$(python) blend_samples/turntable.py --out out/turntable $(ARGS)

build: $(installed) ## dist/vellus-VERSION-PLATFORM.zip; PLATFORM=linux-x64, windows-x64, macos-arm64 or all
	$(python) tools/build_extension.py $(PLATFORM)

lint: $(installed) ## ruff: rules and format
	$(python) -m ruff check
	$(python) -m ruff format --check

samples: $(installed) ## the .blend files of blend_samples
	$(python) blend_samples/build_samples.py $(ARGS)

lock: $(installed) ## requirements.lock from pyproject.toml; make lock ARGS=--upgrade for newer versions
	$(python) -m uv pip compile --quiet --group runtime --group test --group dev --universal --python-version 3.13 \
	  --generate-hashes --no-header --no-emit-index-url --output-file requirements.lock $(ARGS)
	$(python) -m uv pip compile --quiet --group bench --constraint requirements.lock --universal --python-version 3.13 \
	  --generate-hashes --no-header --no-emit-index-url --no-annotate --output-file requirements-bench.lock $(ARGS)

clean: ## what was made, but not what was installed (.venv) or downloaded (wheels)
	rm -rf build dist out .hypothesis .pytest_cache .ruff_cache

$(installed): requirements.lock tools/bootstrap.sh tools/debian-packages.txt
	@sh tools/bootstrap.sh

$(peers): requirements-bench.lock $(installed)
	$(python) -m uv pip install --quiet --require-hashes -r requirements-bench.lock
	@touch $@
