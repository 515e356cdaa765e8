import json


def test_compare_says_for_each_engine_how_exact_it_is(run):
    status, output, error = run(
        "engines",
        "compare",
        "--trials",
        2,
        "--actions",
        2,
        "--remembered",
        3,
        "--engines",
        "gtsam,bayes-filter",
        "--json",
        "-",
    )
    assert (status, error) == (0, "")
    document = json.loads(output)
    assert document["command"] == "compare"
    assert set(document["engines"]) == {"gtsam", "bayes-filter"}
    gtsam = document["engines"]["gtsam"]
    assert gtsam["exact"] is True
    assert gtsam["total_variation"]["worst"] < 1e-12
    assert gtsam["same_decision"]["rate"] == 1
    assert gtsam["time_ratio"]["median"] > 0


def test_compare_takes_a_memory_and_trials_of_ones_own(run, tmp_path):
    looks, memory = tmp_path / "looks.csv", tmp_path / "mugs.json"
    looks.write_text("trial,step,action,view\n1,0,turn,logo\n1,1,turn,handle\n1,2,,logo\n2,0,turn,plain\n2,1,,logo\n")
    assert run("learn", looks, "--memory", memory, "--objects", 3, "--preset", "default")[0] == 0
    with looks.open("a") as file:
        file.write("3,0,,scratch\n")  # a label that the memory has not met
    plot = tmp_path / "errors.png"
    status, output, error = run(
        "engines", "compare", "--memory", memory, "--trials", looks,
        "--engines", "gtsam,particle(n_particles=9,seed=1)", "--json", "-", "--plot", plot,
    )  # fmt: skip
    assert (status, error) == (0, "")
    engines = json.loads(output)["engines"]
    assert list(engines) == ["gtsam", "particle(n_particles=9,seed=1)"]
    assert [len(engines["gtsam"][key]) for key in ("errors", "seconds", "reference_seconds")] == [6, 6, 6]
    assert max(engines["gtsam"]["errors"]) == engines["gtsam"]["total_variation"]["worst"] < 1e-12
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_with_kinds_engines_are_held_against_the_one_that_knows_of_them(run):
    about = ("--trials", 2, "--actions", 6, "--remembered", 8, "--preset", "learned")
    status, output, error = run("engines", "compare", *about, "--engines", "learned-structure,gtsam", "--json", "-")
    assert (status, error) == (0, "")
    engines = json.loads(output)["engines"]
    assert engines["learned-structure"]["total_variation"]["worst"] == 0
    assert engines["gtsam"]["total_variation"]["worst"] > 0.1  # it takes each object for a graph of its own


def test_compare_prints_a_table(run):
    status, output, error = run(
        "engines", "compare", "--trials", 1, "--actions", 1, "--remembered", 1, "--engines", "bayes-filter"
    )
    assert (status, error) == (0, "")
    assert "bayes-filter" in output
    assert "same decision" in output


def test_calibrate_tests_the_posteriors(run):
    status, output, error = run("engines", "check", "--trials", 60, "--json", "-")
    assert (status, error) == (0, "")
    document = json.loads(output)
    assert document["parameters"] == {"engine": "bayes-filter", "trials": 60, "seed": 0}
    assert 0 <= document["chi_square"]["p"] <= 1
    assert len(document["averaged_posterior"]) == len(document["prior"]) == 6
    status, output, _ = run("engines", "check", "--trials", 20)
    assert "chi-square" in output


def test_explain_tells_how_it_can_have_come_about(run):
    status, output, error = run("explain", "tests/data/scripted_trial.json", "--k", 2, "--smooth", "--json", "-")
    assert (status, error) == (0, "")
    document = json.loads(output)
    best, second = document["explanations"]
    assert best["object"] is None
    assert second == {"object": "cube-000", "aspects": [[0, 1], [1, 5]], "probability": second["probability"]}
    assert best["probability"] > second["probability"] > 0.3
    assert sum(document["surprise"]) + document["log_evidence"] < 1e-9
    assert document["smoothed"]["object"] == "cube-000"


def test_explain_draws_the_same_samples_from_the_same_seed(run):
    arguments = ["explain", "tests/data/scripted_trial.json", "--samples", 20, "--json", "-"]
    first, again = (run(*arguments, "--seed", 1)[1] for _ in range(2))
    other = run(*arguments, "--seed", 2)[1]
    assert first == again != other
    status, output, _ = run("explain", "tests/data/scripted_trial.json", "--samples", 1, "--smooth")
    assert status == 0
    assert "drawn from the posterior" in output


def test_bad_options_are_refused(refused):
    assert "unknown name 'magic'" in refused("engines", "compare", "--engines", "magic")
    assert "unknown name 'magic'" in refused("engines", "check", "--engine", "magic")
    assert "'--trials': Input should be greater than or equal to 2" in refused("engines", "check", "--trials", 1)
    assert "--trials: 0; expected a whole number from 1 to 100000" in refused("engines", "compare", "--trials", 0)
    assert "together with --memory" in refused("engines", "compare", "--trials", "looks.csv")
    assert "unknown option 'particles'" in refused("engines", "compare", "--engines", "particle(particles=1)")
    assert "'--k': Input should be greater than or equal to 1" in refused(
        "explain", "tests/data/scripted_trial.json", "--k", 0
    )
    assert "nowhere.json" in refused("explain", "nowhere.json")
