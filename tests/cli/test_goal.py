import json

import pytest

QUICK = ["--engine", "bayes-filter", "--memory-cubes", "5", "--learning-actions", "8", "--jobs", "1", "--trials", "2"]


def test_it_prints_json_in_the_promised_shape(run):
    status, output, error = run("goal", *QUICK, "--seed", "3", "--json", "-")
    assert (status, error) == (0, "")
    document = json.loads(output)
    assert document["command"] == "goal"
    assert (document["parameters"]["cubes"], document["parameters"]["memory_cubes"]) == (3, 5)
    assert (document["runs"], document["goals"]) == (2, 6)
    for name in ("reached", "reached_of_reachable", "declared_of_unreachable", "wrong_success", "optimal"):
        rate = document[name]
        low, high = rate["interval95"]
        assert rate["rate"] is None or low <= rate["rate"] <= high


def test_it_shows_a_table_with_intervals(run):
    status, output, _ = run("goal", *QUICK, "--learning-actions", "0")
    assert status == 0
    assert "goals reached" in output
    assert "6 of 6" in output
    assert "95 % interval" in output


def test_runs_go_on_where_they_were_cut_off(run, tmp_path):
    run("goal", *QUICK[:-1], "1", "--records", tmp_path)
    _, resumed, _ = run("goal", *QUICK, "--records", tmp_path, "--resume", "--json", "-")
    _, whole, _ = run("goal", *QUICK, "--json", "-")
    assert resumed == whole
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run-0000.json.gz", "run-0001.json.gz"]


def test_a_world_with_a_camera_is_filmed(run, tmp_path):
    image = pytest.importorskip("PIL.Image")
    film = tmp_path / "film.gif"
    status, _, error = run("goal", "--world", "rendered", *QUICK[:-1], "1", "--cubes", "2", "--video", film)
    assert (status, error) == (0, "")
    with image.open(film) as frames:
        assert frames.n_frames >= 2
        assert frames.size == (320, 240)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--cubes", "0"], "Invalid value for '--cubes'"),
        (["--cubes", "9"], "n_stations: 9; expected at most n_remembered = 5"),
        (["--trials", "0"], "'--trials': Input should be greater than or equal to"),
        (["--planner", "fast"], "'fast'; expected one of: attempts, surprise, value-iteration"),
        (["--unreachable", "give-up"], "'give-up'; expected one of: declare, explore"),
        (["--learning-policy", "greedy"], "'greedy'; expected one of: entropy, explore, "),
        (["--learning-world", "moon"], "'moon'"),
        (["--world", "moon"], "'moon'"),
        (["--world", "prism"], "world: 'prism'; expected a world of ARcubes: ideal, rendered, robonaut"),
        (["--learning-world", "lock"], "learning_world: 'lock'; expected a world of ARcubes"),
        (["--video", "film.gif"], "world with a camera: unknown name 'ideal'; expected one of: rendered, robonaut"),
        (["--world", "rendered", "--video", "film.mp4"], "suffix '.mp4'; expected .gif"),
        (["--resume"], "--resume: no records"),
        (["--slip", "2"], "--slip: 2"),
        (["--json", "/nowhere/at/all.json"], "/nowhere/at/all.json"),
    ],
)
def test_bad_options_are_one_line(refused, arguments, message):
    assert message in refused("goal", *QUICK, *arguments)
