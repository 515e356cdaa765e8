# Set-up is part of every target: on a fresh machine `make demo` and `make test` are all it takes.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
# What the demo needs, and nothing else; all of it is a part of READY.
DEMO_READY := $(if $(wildcard $(READY)),$(READY),$(VENV)/.ready-demo)
PEERS := .venv-peers
PEERS_READY := $(PEERS)/.ready

# Tests start hundreds of processes, each of which would compile every module anew where this is set.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help setup peers demo test test-all test-peers torture package lint format notebooks docs bench results results-pictures results-engines results-robot results-goal results-evidence \
	results-structure example-memory feature-spaces tour clean

help:  ## Say what there is to make
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(READY)  ## Install into .venv what users and developers need

$(VENV)/.ready-demo: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -c "$$needs_of_demo" > $(VENV)/demo.txt
	$(BIN)/python -m pip install --quiet --requirement $(VENV)/demo.txt
	$(BIN)/python -m pip install --quiet --no-deps --editable .
	$(without_samples)
	touch $@

# All but Numba, which is 200 MB, and samples nothing here.
define needs_of_demo
import tomllib
project = tomllib.load(open('pyproject.toml', 'rb'))['project']
extras = project['optional-dependencies']
print(*(each for each in project['dependencies'] + extras['sim'] + extras['viz'] if 'numba' not in each), sep=chr(10))
endef
export needs_of_demo

# The sample models in PyBullet's wheel are 140 MB; of these only the things of odd shapes are used (28 MB).
without_samples = find $(VENV)/lib -mindepth 4 -maxdepth 4 -path '*/site-packages/pybullet_data/*' \
	! -name random_urdfs ! -name __init__.py -exec rm -rf {} +

# --group needs pip 25.1.
$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --editable '.[sim,vision,viz,print,report,viewer,ros,minari,notebooks]' \
		--group test --group dev --group docs
	$(without_samples)
	touch $@

# PyTorch comes first, and at a version, so that pip takes a build for the processor where it is told of one.
TORCH ?= torch==2.13.0
$(PEERS_READY): pyproject.toml
	$(PYTHON) -m venv $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet --upgrade 'pip>=25.1'
	$(PEERS)/bin/python -m pip install --quiet '$(TORCH)'
	$(PEERS)/bin/python -m pip install --quiet --editable '.[bench,agents,ap-gym,viz,notebooks]' --group test
	touch $@

peers: $(PEERS_READY)  ## Install into .venv-peers the libraries that tests compare with

demo: $(DEMO_READY)  ## Let the robot recognise an object by turning it over, told step by step and filmed
	$(BIN)/atg-fg demo

test: $(READY)  ## Run the tests
	$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

test-all: $(READY)  ## Run the tests, slow ones too
	$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder -m 'not peers'

test-peers: $(PEERS_READY)  ## Run the tests beside other libraries (JAX, pgmpy, pymdp, Stable-Baselines3, ap_gym), in .venv-peers
	$(PEERS)/bin/python -m pytest -m peers tests/benchmarks/test_peers.py tests/experiments/test_recognition_agent.py \
		tests/worlds/test_active_classification.py tests/test_guides.py

torture: $(READY)  ## Kill writers, cut the power, fill disks, damage files, fuzz readers (some two hours on 2 cores)
	$(BIN)/python -m pip install --quiet --group torture
	$(BIN)/python -m tests.torture --kills 1000 --files 50000 --fuzz 3600

package: $(READY)  ## Build the wheel and the sdist in dist, and try the wheel in an empty environment outside the tree
	rm -rf dist
	$(BIN)/python -m build --quiet
	$(BIN)/python -m tests.package

lint: $(READY)  ## Check style, types, and that packages import only what stands on lower floors
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY)  ## Mend style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

notebooks: $(READY)  ## Execute the notebooks, with the sources of their paired scripts
	$(BIN)/python notebooks/execute.py

docs: $(READY)  ## Build the documentation site in out/docs; a warning is an error
	$(BIN)/python docs/floors.py
	$(BIN)/sphinx-build -W --keep-going -q -b html docs out/docs

# The other scripts in benchmarks/ are about success, not time, and are run by themselves: docs/performance.md.
bench: $(READY)  ## (AGAINST=revision, ROUNDS=n) Time engines and other libraries, and the simulated robot, side by side; fill in docs/performance.md
	$(BIN)/python -m pip install --quiet --editable '.[bench]'
	mkdir -p results
	$(BIN)/atg-fg bench $(if $(AGAINST),--against $(AGAINST)) $(if $(ROUNDS),--rounds $(ROUNDS)) --json results/bench.json --markdown docs/performance.md
	$(BIN)/python benchmarks/simulation.py

# One command a file: README's results tables and figures are these.
results: $(READY)  ## Run the experiments of README's results in the ideal world (three minutes on 2 cores)
	mkdir -p results docs/images
	$(BIN)/atg-fg table1 --preset paper --tests 40 --engine bayes-filter --json results/table1_paper.json
	$(BIN)/atg-fg table1 --preset default --tests 40 --engine bayes-filter --json results/table1_default.json
	$(BIN)/atg-fg table1 --preset default --tests 5 --engine gtsam --json results/table1_gtsam.json
	$(BIN)/atg-fg table1 --world rendered --tests 5 --engine bayes-filter --json results/table1_rendered.json
	$(BIN)/atg-fg figure3 --preset paper --json results/figure3_paper.json --csv results/figure3_paper.csv \
		--plot docs/images/figure3_paper.png
	$(BIN)/atg-fg figure3 --preset default --json results/figure3_default.json --csv results/figure3_default.csv \
		--plot docs/images/figure3_default.png

# Boxes without tags, each draw of boxes by itself; what simpler means make of them is printed.
PICTURES := table1 --world picture-box --preset learned --tests 1
results-pictures: $(READY)  ## Run the experiments on boxes with pictures (about an hour on 2 cores)
	mkdir -p results/pictures
	for seed in 0 1 2 3 4 5 6 7 8 9; do \
		$(BIN)/atg-fg $(PICTURES) --seed $$seed --json results/pictures/learned_$$seed.json || exit; \
	done
	for seed in 0 1 2 3 4; do \
		$(BIN)/atg-fg $(PICTURES) --seed $$seed --slip 0.04 --json results/pictures/slip_$$seed.json || exit; \
	done
	$(BIN)/atg-fg table1 --world picture-box --preset default --engine bayes-filter --tests 10 \
		--json results/table1_picture-box_default.json
	$(BIN)/python benchmarks/appearance.py 10
	$(BIN)/python benchmarks/weight.py 5

# README's table of methods, and how calibrated each engine is (about a quarter of an hour).
results-engines: $(READY)  ## Compare and calibrate all inference engines
	$(BIN)/atg-fg engines compare --trials 50 --engines all --json results/compare.json
	for engine in bayes-filter gtsam particle gibbs loopy-bp mean-field; do \
		$(BIN)/atg-fg engines check --engine $$engine --trials 5000 --json results/calibrate_$$engine.json || exit; \
	done

# Reliability first: the preset robot is estimated from it. A test that was cut off goes on where it stopped.
ROBONAUT := table1 --world robonaut --engine bayes-filter --tests 1 --resume
results-robot: $(READY)  ## Run the experiments on the simulated robot (about an hour and a half on 2 cores)
	mkdir -p results/robonaut docs/images
	for condition in nominal worn; do \
		$(BIN)/atg-fg sim reliability --condition $$condition --actions 1000 \
			--json results/reliability_$$condition.json || exit; \
		for preset in paper default; do \
			$(BIN)/atg-fg $(ROBONAUT) --condition $$condition --preset $$preset \
				--records results/robonaut/$${condition}_$$preset \
				--json results/table1_robonaut_$${condition}_$$preset.json || exit; \
		done; \
	done
	$(BIN)/atg-fg sim calibrate results/reliability_worn.json --output atg_fg/storage/data/robot.json
	for preset in default robot; do \
		$(BIN)/atg-fg table1 --slip 0.038 --missing 0.047 --preset $$preset --tests 20 --engine bayes-filter \
			--json results/table1_noisy_$$preset.json || exit; \
	done
	$(BIN)/atg-fg sim picture --output docs/images/robonaut.png --film docs/images/robonaut.gif \
		--table docs/images/robonaut_table.png
	$(BIN)/atg-fg sim reliability --pictures --actions 500 --json results/reliability_pictures_nominal.json
	$(BIN)/atg-fg table1 --world robonaut-picture-box --condition nominal --preset learned --tests 1 --resume \
		--records results/robonaut/pictures_nominal_learned --json results/table1_robonaut-picture-box_learned.json
	$(BIN)/atg-fg sim picture --pictures --seed 18 --output docs/images/robonaut_pictures.png \
		--film docs/images/robonaut_pictures.gif

# The goal experiment: in the ideal world with 200 runs each, then on the robot with a record of every run.
GOAL := goal --engine bayes-filter
results-goal: $(READY)  ## Reach goal aspects with three cubes (about half an hour on 2 cores)
	mkdir -p results/goal_robonaut docs/images
	$(BIN)/atg-fg $(GOAL) --trials 200 --learning-actions 0 --json results/goal_complete.json
	$(BIN)/atg-fg $(GOAL) --trials 200 --json results/goal_explored.json
	$(BIN)/atg-fg $(GOAL) --trials 200 --learning-policy random --json results/goal_random.json
	$(BIN)/atg-fg $(GOAL) --trials 200 --unreachable explore --json results/goal_exploring.json
	$(BIN)/atg-fg $(GOAL) --trials 200 --planner value-iteration --json results/goal_value_iteration.json
	$(BIN)/atg-fg goal --preset learned --trials 200 --json results/goal_learned.json
	$(BIN)/atg-fg $(GOAL) --trials 20 --world robonaut --records results/goal_robonaut --resume \
		--video docs/images/goal.gif --json results/goal_robonaut.json

# What learning the structure that objects share adds; the ablation goes on where its logs in results end: remove them to run it again.
results-structure: $(READY)  ## Run the experiments on learned structure (about half an hour on 2 cores)
	mkdir -p results docs/images
	$(BIN)/atg-fg table1 --preset learned --tests 20 --json results/table1_learned.json
	$(BIN)/atg-fg table1 --preset learned --tests 20 --actions 6 --json results/table1_learned_6.json
	$(BIN)/atg-fg table1 --preset learned --tests 20 --actions 4 --json results/table1_learned_4.json
	$(BIN)/atg-fg table1 --preset learned --tests 20 --slip 0.02 --wrong 0.005 --json results/table1_learned_noisy.json
	$(BIN)/atg-fg ablation --variants "default;learned" --noises ideal --actions 10 --tests 3 \
		--worlds prism,lock,lid-box,repeated-tags \
		--log results/ablation_worlds.jsonl --json results/ablation_other_worlds.json
	for world in ideal lock lid-box repeated-tags random-atg; do \
		$(BIN)/atg-fg table1 --world $$world --preset learned --tests 5 --json results/kinds_$$world.json || exit; \
	done
	for world in prism mixed half-and-half; do \
		$(BIN)/atg-fg table1 --world $$world --preset learned --tests 40 --json results/kinds_$$world.json || exit; \
	done
	for world in prism mixed; do \
		$(BIN)/atg-fg table1 --world $$world --preset learned --tests 40 --slip 0.02 --wrong 0.005 \
			--json results/kinds_$${world}_noisy.json || exit; \
	done
	for world in half-and-half random-atg; do \
		$(BIN)/atg-fg table1 --world $$world --world-option n_successors=1 --tests 3 --preset learned \
			--json results/kinds_$${world}_sure.json || exit; \
	done
	$(BIN)/atg-fg table1 --preset learned --tests 5 --missing 0.1 --json results/kinds_missing.json
	$(BIN)/atg-fg table1 --preset learned --tests 5 --slip 0.05 --wrong 0.01 --json results/kinds_slipping.json
	$(BIN)/python benchmarks/kinds_found.py 5
	$(BIN)/python benchmarks/kinds_found.py 5 0.02 0.005
	$(BIN)/python benchmarks/told_random_atgs.py 5
	$(BIN)/atg-fg table1 --preset learned --tests 1 --trials 10 --save-memories out
	$(BIN)/atg-fg memory structure out/memory-0000.json --plot docs/images/structure.png
	$(BIN)/atg-fg rescore results/robonaut/*/test-0000.jsonl.gz --preset learned --json results/rescore_learned.json
	$(BIN)/atg-fg ablation --variants "paper;default;learned" --tests 10 --log results/ablation.jsonl \
		--json results/ablation.json --plot docs/images/ablation.png

# Evidence that errs: each world of the table in docs/experiments.md.
DETECTOR := table1 --preset learned --world detector --objects 8 --trials 48 --actions 8 --tests 20
NOISY := table1 --preset learned --tests 5
results-evidence: $(READY)  ## Run the experiments on evidence that errs (about an hour on 2 cores)
	mkdir -p results/evidence
	for noise in 0,0 0.05,0.05 0.2,0.1; do for confidences in false true; do for own in false true; do \
		$(BIN)/atg-fg $(DETECTOR) --wrong $${noise%,*} --missing $${noise#*,} --world-option confidences=$$confidences \
			--world-option own_dynamics=$$own --json results/evidence/detector_$${noise}_$${confidences}_$$own.json || exit; \
	done; done; done
	$(BIN)/atg-fg $(NOISY) --wrong 0.1 --missing 0.1 --json results/evidence/cubes_10_10.json
	$(BIN)/atg-fg $(NOISY) --wrong 0.2 --missing 0.2 --json results/evidence/cubes_20_20.json
	$(BIN)/atg-fg $(NOISY) --slip 0.05 --wrong 0.1 --missing 0.1 --json results/evidence/cubes_slip_10_10.json

# The memory that `atg-fg memory example` writes: 30 trials, one after the other, of the 100 cubes of seed 0.
EXAMPLE := out/example.json
example-memory: $(READY)  ## Learn the memory that comes with the package (half a minute)
	mkdir -p out
	rm -f $(EXAMPLE)
	for seed in $$(seq 100 129); do \
		$(BIN)/atg-fg trial --preset learned $$(test -e $(EXAMPLE) && echo --memory $(EXAMPLE)) --save-memory $(EXAMPLE) \
			--seed $$seed || exit; \
	done
	cp $(EXAMPLE) atg_fg/storage/data/cubes.json

feature-spaces: $(READY)  ## Calibrate the features that worlds without tags come with (a quarter of a minute)
	$(BIN)/python -m sim.kept_features

tour: $(READY)  ## Run the commands of docs/tour.md and write down what they print (some ten minutes)
	$(BIN)/python docs/tour.py

clean:  ## Remove what make has made
	rm -rf $(VENV) $(PEERS) out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
