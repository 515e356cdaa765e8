"""What a ``WorkerServer`` imports before it forks workers: the library, and its compiled loops, by two short trials."""

import gc
from contextlib import suppress

from atg_fg.experiments.table1 import TestPlan, run_test

with suppress(Exception):  # what fails here fails in a worker as well, and is told there
    run_test(TestPlan(engine="bayes-filter", n_actions=1, n_trials=2, n_objects=2), 0)
gc.freeze()  # what no collection visits stays memory that all workers share
