# make demo and make test work from a fresh clone: dependencies are installed into .venv first.
# ARGS goes to pytest or to the script:  make test ARGS="-k cvt -x"

.PHONY: help demo compare turntable dynamics pictures test farm long desktop viewers bench build lint lock samples clean
.DELETE_ON_ERROR:

# Let uv use the system's certificates, as pip does: some networks have their own.
export UV_SYSTEM_CERTS = true

# Slow downloads are waited for, and failed downloads are repeated.
export UV_HTTP_RETRIES = 10
export UV_HTTP_TIMEOUT = 300
export PIP_RETRIES = 10
export PIP_DEFAULT_TIMEOUT = 120

# Tests start many processes: without this each would compile every module again.
unexport PYTHONDONTWRITEBYTECODE

python = .venv/bin/python
installed = .venv/installed
peers = .venv/peers
actionlint = github.com/rhysd/actionlint/cmd/actionlint@v1.7.12

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-9s %s\n", $$1, $$2 }' Makefile

demo: $(installed) ## a portrait with 400 guides and 30,000 strands: images and tables in out/demo
	$(python) blend_samples/demo.py --out out/demo $(ARGS)

# As many processes test as there are processors: threads of Mesa and of OpenBLAS would only wait for one another.
test farm long: export LP_NUM_THREADS = 0
test farm long: export OPENBLAS_NUM_THREADS = 1
# The order of sets of strings is the same in each run.
test farm long desktop: export PYTHONHASHSEED = 0

# All tests load kernels that are compiled once, in place of each process compiling them.
test: $(installed) ## all tests except benchmarks and tests in a window, in up to four processes
	$(if $(ARGS),,$(python) tools/build_extension.py --kernels)
	$(python) -m pytest -m "not long and not desktop and not farm" --ignore tests/desktop --numprocesses auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder $(ARGS)

farm: $(installed) ## tests of other processes and render engines, and of farms: Slurm, OpenJobDescription, Flamenco in VELLUS_FLAMENCO
	$(python) -m pytest -m "farm and not long" --numprocesses 2 --dist loadfile $$(grep -rl --include='*.py' mark.farm tests) $(ARGS)

long: $(installed) ## in an hour: the rest of the parameters of which `make test` runs a share
	$(python) -m pytest -m "long and not desktop" --ignore tests/desktop --ignore tests/benchmarks --numprocesses auto --dist loadfile $(ARGS)

# Three processes, as walks wait for a quarter of their time.
desktop: $(installed) ## tests in a window of Blender, with OpenGL and Vulkan: screenshots in out/desktop
	$(python) -m pytest -m "desktop and not long" --numprocesses 3 --dist loadfile --no-loadscope-reorder tests/desktop $(ARGS)

viewers: $(installed) ## files of cards in Khronos' validator and in three.js: needs Node.js and Chromium; pictures in out/viewers
	mkdir -p build/viewers out/viewers
	cp tests/support/viewers/package.json tests/support/viewers/package-lock.json build/viewers
	npm ci --prefix build/viewers --ignore-scripts --no-audit --no-fund
	VELLUS_VIEWERS=build/viewers VELLUS_VIEWERS_PICTURES=out/viewers $(python) -m pytest -m farm tests/crossings/test_viewers.py $(ARGS)

bench: $(installed) $(peers) ## the benchmarks, with their figures
	$(python) -m pytest tests/benchmarks -s $(ARGS)

compare: $(installed) ## the head rendered by Cycles and Vellus: mean colours and both images, in out/compare
	$(python) blend_samples/comparisons/compare.py --out out/compare $(ARGS)

turntable: $(installed) ## a turntable of the head, 24 frames by the command line, in out/turntable; resumable
	$(python) blend_samples/turntable.py --out out/turntable $(ARGS)

dynamics: $(installed) ## hair that moves: strips, plots and a film in out/dynamics; ARGS="shaking plots" for some
	$(python) blend_samples/dynamics/dynamics.py --out out/dynamics $(ARGS)

pictures: $(installed) ## the pictures of README and manual, in docs; ARGS="styles grooms" for some, and for slow ones
	$(python) blend_samples/pictures/all_pictures.py $(ARGS)

build: $(installed) ## dist/vellus-VERSION-PLATFORM.zip; PLATFORM=windows-x64 or all for others, ARGS=--gpus for a release
	$(python) tools/build_extension.py $(PLATFORM) $(ARGS)

lint: $(installed) ## ruff: rules and format; pyrefly: types; zizmor and, with Go, actionlint: workflows
	$(python) -m ruff check
	$(python) -m ruff format --check
	$(python) -m pyrefly check
	.venv/bin/zizmor --offline --no-progress --quiet .github/workflows
	if GOBIN=$(CURDIR)/build go install $(actionlint); \
	  then build/actionlint -shellcheck= -pyflakes= .github/workflows/*.yml; \
	  else echo "actionlint is skipped: Go is not installed, or its download failed"; fi

samples: $(installed) ## the .blend files of blend_samples
	$(python) blend_samples/build_samples.py $(ARGS)

lock: $(installed) ## requirements.lock from pyproject.toml; make lock ARGS=--upgrade for newer versions
	$(python) -m uv pip compile --quiet --group runtime --group test --group dev --universal --python-version 3.13 \
	  --generate-hashes --no-header --no-emit-index-url --output-file requirements.lock $(ARGS)
	$(python) -m uv pip compile --quiet --group bench --constraint requirements.lock --universal --python-version 3.13 \
	  --generate-hashes --no-header --no-emit-index-url --no-annotate --output-file requirements-bench.lock $(ARGS)

clean: ## delete build products, but not the installation (.venv) or downloaded wheels
	rm -rf build dist out .hypothesis .pytest_cache .ruff_cache

$(installed): requirements.lock tools/bootstrap.sh tools/debian-packages.txt
	@sh tools/bootstrap.sh

$(peers): requirements-bench.lock $(installed)
	$(python) -m uv pip install --quiet --require-hashes -r requirements-bench.lock
	@touch $@
