import json


def test_it_judges_recorded_tests_anew(run, tmp_path):
    quick = ["--engine", "bayes-filter", "--trials", "8", "--actions", "3", "--tests", "2", "--jobs", "1"]
    run("table1", *quick, "--records", tmp_path)
    files = sorted(tmp_path.iterdir())
    status, output, error = run("rescore", *files, "--preset", "default", "--json", "-")
    assert (status, error) == (0, "")
    document = json.loads(output)
    assert document["parameters"] == {"preset": "default", "engine": "bayes-filter"}
    assert [test["success"][1] for test in document["tests"]] == [8, 8]
    assert "test-0001" in run("rescore", *files, "--preset", "paper")[1]


def test_other_files_are_refused(refused, tmp_path):
    (tmp_path / "other.txt").write_text("no log")
    assert "other.txt" in refused("rescore", tmp_path / "other.txt")
    assert "gtsam" in refused("rescore", tmp_path / "other.txt", "--engine", "gtsam")
