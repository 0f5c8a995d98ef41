"""Runs one graph over many parameters, locally and on a cluster, also while a worker is killed."""

import json
import os
import pickle
import signal
import threading
import time

import numpy
import pytest

PARTS = """
set voxel 0.1
sphere --radius ${radius} --voxel ${voxel}
box --size 1,1,4 --voxel ${voxel}
difference
write part_${radius}.vdb
measure
mesh
write part_${radius}.ply
"""
RADII = [{"radius": radius} for radius in (0.8, 1.0, 1.2, 1.4)]


@pytest.fixture(scope="module")
def client():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=3, processes=True, threads_per_worker=1, dashboard_address=None
    ) as cluster, distributed.Client(cluster) as client:
        yield client


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Folder of the caller, which differs from that of the workers."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


def contents(folder):
    """Contents of the folder, hidden files included."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def printed(reports):
    return [report["printed"] for report in reports]


def kill_one_that_works(client, killed, is_over):
    """Kills a worker process during a job."""

    def running(dask_worker):
        return [key for key, task in dask_worker.state.tasks.items() if task.state == "executing"]

    pids = client.run(os.getpid)
    while not is_over.is_set():
        before = client.run(running)
        time.sleep(0.1)
        after = client.run(running)
        for address in pids:
            if before.get(address) and before[address] == after.get(address):
                os.kill(pids[address], signal.SIGKILL)
                killed.append((pids[address], after[address][0]))
                return


class Killer:
    """Kills a worker while a map runs."""

    def __init__(self, client):
        self.killed, self.is_over = [], threading.Event()
        self.thread = threading.Thread(target=kill_one_that_works, args=(client, self.killed, self.is_over))

    def __enter__(self):
        self.thread.start()
        return self.killed

    def __exit__(self, *_):
        self.is_over.set()
        self.thread.join()


def test_a_pipeline_runs_once_for_each_set(ls, folder):
    reports = ls.map(PARTS, RADII)
    assert len(contents(folder)) == 8
    for radius, report in zip(RADII, reports):
        assert report["exit_code"] == 0 and "volume" in report["printed"]
        assert report["graph"]["nodes"][0]["options"]["radius"] == f"{radius['radius']:g}"
        assert ls.read(folder / f"part_{radius['radius']:g}.vdb").measure()["volume"] > 0
    assert ls.map(PARTS, []) == []


def test_a_file_is_a_pipeline_or_a_graph(ls, folder):
    expected = printed(ls.map(PARTS, RADII[:2]))
    (folder / "parts.pipeline").write_text(PARTS)
    assert printed(ls.map("parts.pipeline", RADII[:2])) == expected
    assert printed(ls.map(folder / "parts.pipeline", RADII[:2])) == expected
    graph = json.loads(ls.graph(ls.sphere(radius=1, voxel=0.1).mesh()))
    graph["nodes"][0]["options"]["radius"] = "${radius}"
    graph["nodes"].append({"op": "write", "inputs": [1], "options": {"file": "ball${radius}.ply"}})
    (folder / "ball.json").write_text(json.dumps(graph))
    ls.map("ball.json", RADII[:2])
    assert numpy.abs(ls.read("ball0.8.ply").vertices).max() == pytest.approx(0.8, abs=1e-3)
    with pytest.raises(ls.UsageError, match="'ball.json' has no variable 'raduis'|has no value"):
        ls.map("ball.json", [{"raduis": 1}])
    with pytest.raises(ls.UsageError, match="has no variable 'more'; its variables are radius"):
        ls.map("ball.json", [{"radius": 1, "more": 2}])


def test_a_page_of_a_pipeline_has_pictures(ls, tmp_path):
    text = "--report ${file}\nsphere --radius 1 --voxel 0.1\noffset 0.1\nmeasure\n"
    files = [tmp_path / "run.html", tmp_path / "run.json"]
    ls.map(text, [{"file": str(file)} for file in files])
    page, data = (file.read_text(encoding="utf-8") for file in files)
    assert page.count('src="data:image/png;base64,') == 2
    assert json.loads(data)["versions"]["OpenVDB"]


def test_values_are_written_as_in_chains(ls, folder):
    text = "box --size ${size} --voxel ${voxel}\ntransform --translate ${to}\nmeasure --json\n"
    given = {"size": (1, 2, 1.5), "voxel": numpy.float32(0.125), "to": numpy.array([1, 2, 3.0])}
    (report,) = ls.map(text, [given])
    assert json.loads(report["printed"])["volume"] == pytest.approx(3, rel=5e-2)
    with pytest.raises(ls.UsageError, match="voxel: a value of type object is not"):
        ls.map(text, [{**given, "voxel": object()}])


def test_functions_return_transferable_results(ls):
    def make(radius, deep=False):
        ball = ls.sphere(radius=radius, voxel=0.1)
        return {"solid": ball, "more": [ball.mesh(), ball.measure()["volume"]]} if deep else ball

    balls = ls.map(make, [{"radius": 1}, {"radius": 2}])
    assert all(ball.is_computed for ball in balls)
    assert balls[1].measure()["volume"] == pytest.approx(8 * balls[0].measure()["volume"], rel=1e-2)
    (result,) = ls.map(make, [{"radius": 1, "deep": True}])
    assert result["more"][0].is_computed and result["more"][1] > 4
    with pytest.raises(ls.UsageError, match="returns a Scene, which cannot be sent"):
        ls.map(lambda: ls.scene(ls.sphere(radius=1, voxel=0.1)), [{}])


def test_refusals_name_the_parameters(ls, folder):
    with pytest.raises(ls.UsageError, match=r"--radius: '-1'.*line 3.*\(parameters\[1\], radius = -1\)"):
        ls.map(PARTS, [{"radius": 1}, {"radius": -1}])
    assert contents(folder) == {}  # all sets are checked before the first run
    with pytest.raises(ls.UsageError, match="^map: raduis=1: .* no variable raduis; did you mean 'radius'"):
        ls.map(PARTS, [{"raduis": 1}])
    with pytest.raises(ls.InputError, match=r"parameters\[1\], box = "):
        ls.map(lambda box: ls.sphere(radius=1, voxel=0.1).array(box=box).sum(),
               [{"box": None}, {"box": ((0.01,) * 3, (0.02,) * 3)}])  # fmt: skip
    with pytest.raises(ZeroDivisionError) as caught:
        ls.map(lambda x: 1 // x, [{"x": 1}, {"x": 0}])
    assert getattr(caught.value, "__notes__", ["parameters[1], x = 0"]) == ["parameters[1], x = 0"]
    for graph, sets, sentence in (
        (PARTS, {"radius": 1}, "parameters is a dict"),
        (PARTS, [1], r"parameters\[0\] is a int"),
        (3, RADII, "graph is a int"),
        ("nowhere.pipeline", RADII, "cannot be read: No such file"),
        ("sphere --radius 1 --voxel ${radius}\nwrite - --format vdb\n", RADII, "standard stream"),
        ("--no-clobber\nsphere --radius ${radius} --voxel 0.1\ninfo\n", RADII, "no-clobber"),
    ):
        with pytest.raises(ls.Error, match=sentence):
            ls.map(graph, sets)
    with pytest.raises(ls.UsageError, match="client is a str"):
        ls.map(PARTS, RADII, "tcp://localhost:8786")


def test_warnings_name_the_parameters(ls):
    with pytest.warns(ls.Warning, match=r"parameters\[0\], radius = 0.8"):
        ls.map("sphere --radius ${radius} --voxel 0.1\n", RADII[:1])


def test_a_cache_is_shared(ls, folder):
    first = ls.map(PARTS, RADII[:2], cache="kept")
    again = ls.map(PARTS, RADII[:2], cache="kept")
    assert printed(first) == printed(again)
    assert all(step.get("known") for report in again for step in report["steps"])
    assert not any(step.get("known") for step in first[0]["steps"])


def test_a_cluster_gives_the_same_results(ls, client, tmp_path, monkeypatch):
    here, there = tmp_path / "here", tmp_path / "there"
    reports = []
    for place, where in ((here, None), (there, client)):
        place.mkdir()
        monkeypatch.chdir(place)
        reports.append(printed(ls.map(PARTS, RADII + RADII[:1], where)))
    assert reports[0] == reports[1]
    assert contents(here) == contents(there) and len(contents(there)) == 8


def test_functions_run_on_a_cluster(ls, client):
    def make(radius):
        import levelsmith as ls

        solid = ls.box(size=(2, 2, 2), voxel=0.1) - ls.sphere(radius=radius, voxel=0.1)
        return solid, solid.mesh(), os.getpid()

    here, there = ls.map(make, RADII), ls.map(make, RADII, client)
    for a, b in zip(here, there):
        assert a[0].info()["hash"] == b[0].info()["hash"]
        assert (a[1].vertices == b[1].vertices).all() and a[2] != b[2]
    base = ls.sphere(radius=1, voxel=0.1)  # values are sent to workers too
    (grown,) = ls.map(lambda solid: solid.offset(0.1), [{"solid": base}], client)
    assert grown.info()["hash"] == base.offset(0.1).info()["hash"]


def test_errors_are_returned_from_a_cluster(ls, client, folder):
    text = "read ${file}\nmesh\nwrite ${file:stem}.ply\n"
    ls.sphere(radius=1, voxel=0.2).save("good.vdb")
    (folder / "bad.vdb").write_text("no grid")
    sets = [{"file": "good.vdb"}, {"file": "bad.vdb"}]
    sentences = []
    for where in (None, client):
        with pytest.raises(ls.InputError, match=r"line 1\) \(parameters\[1\], file = 'bad.vdb'\)") as caught:
            ls.map(text, sets, where)
        sentences.append(str(caught.value))
        assert caught.value.exit_code == 3
    assert sentences[0] == sentences[1]
    with pytest.raises(ZeroDivisionError):
        ls.map(lambda x: 1 // x, [{"x": 0}], client)
    with pytest.warns(ls.Warning, match=r"parameters\[0\], radius = 0.8"):
        ls.map("sphere --radius ${radius} --voxel 0.1\n", RADII[:1], client)


def test_messages_before_an_error_are_reported(ls, client):
    def work():
        import levelsmith as ls

        mesh = ls.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]], [[0, 1, 2]])
        mesh.level_set(voxel=0.05, sign_anyway=True).compute()
        raise ValueError("mine")

    found = []
    for where in (None, client):
        with pytest.warns(ls.Warning) as told, pytest.raises((ls.Error, ValueError)) as caught:
            ls.map(work, [{}], where)
        found.append((str(caught.value), [str(each.message) for each in told if each.category is ls.Warning]))
    assert found[0] == found[1] and found[0][1]


def test_workers_share_a_cache(ls, client, folder):
    first = ls.map(PARTS, RADII, client, cache="kept")
    again = ls.map(PARTS, RADII, client, cache="kept")
    assert printed(first) == printed(again)
    assert all(step.get("known") for report in again for step in report["steps"])


def test_the_job_of_a_killed_worker_is_run_again(ls, client, tmp_path):
    """Each job writes a mark with its process id before its computation, and another after it."""
    marks = tmp_path / "marks"
    marks.mkdir()

    def work(i, marks):
        import levelsmith as ls

        (marks / f"begun-{i}-{os.getpid()}").touch()
        solid = ls.box(size=(2, 2, 2 + 0.5 * i), voxel=0.06).curvature_flow(time=0.1)
        solid.save(marks / f"solid-{i}.vdb")
        (marks / f"done-{i}-{os.getpid()}").touch()
        return solid

    sets = [{"i": i, "marks": marks} for i in range(4)]
    with Killer(client) as killed:
        solids = ls.map(work, sets, client)
    ((pid, _),) = killed
    begun = [path.name.split("-")[1:] for path in marks.glob("begun-*")]
    done = [path.name.split("-")[1:] for path in marks.glob("done-*")]
    cut = [i for i, process in begun if int(process) == pid and [i, process] not in done]
    assert len(cut) == 1  # the killed worker was running this job,
    assert [i for i, _ in done].count(cut[0]) == 1 and len(done) == 4  # which another worker repeated
    assert not list(marks.glob(".*"))  # no partial files
    (tmp_path / "here").mkdir()
    expected = ls.map(work, [{"i": i, "marks": tmp_path / "here"} for i in range(4)])
    for i, (a, b) in enumerate(zip(solids, expected)):
        assert a.info()["hash"] == b.info()["hash"]
        assert (marks / f"solid-{i}.vdb").read_bytes() == (tmp_path / f"here/solid-{i}.vdb").read_bytes()


def test_a_job_that_kills_every_worker_is_abandoned(ls, client):
    with pytest.raises(ls.ResourceError, match=r"every worker that took this job died.*\(parameters\[1\], i = 1\)"):
        ls.map(lambda i: os.kill(os.getpid(), signal.SIGKILL) if i else i, [{"i": 0}, {"i": 1}], client)
    # Two of three, because a nanny may give up on a worker that dies during start-up.
    client.wait_for_workers(2, timeout=60)
    assert ls.map(lambda i: i, [{"i": 7}], client) == [7]


def test_pipelines_survive_a_killed_worker(ls, client, tmp_path, monkeypatch):
    text = """
box --size 2,2,${length} --voxel 0.06
curvature-flow 0.1
write flown_${length}.vdb
measure
"""
    sets = [{"length": length} for length in (2, 2.5, 3)]
    for place in ("there", "here"):
        (tmp_path / place).mkdir()
    monkeypatch.chdir(tmp_path / "there")
    with Killer(client) as killed:
        there = ls.map(text, sets, client, cache=tmp_path / "kept")
    assert killed and killed[0][1].startswith("levelsmith-")
    monkeypatch.chdir(tmp_path / "here")
    here = ls.map(text, sets)
    assert printed(there) == printed(here)
    assert contents(tmp_path / "here") == contents(tmp_path / "there")


def test_files_of_dead_processes_are_removed(ls, folder):
    """Removes a file like the one that a job leaves when it is killed during writing."""
    dead = 2**22 - 7  # larger than any process id
    for name in (f".part_0.8.vdb.{dead}-0.tmp", f".other.vdb.{dead}-0.tmp", f".part_0.8.vdb.{os.getpid()}-0.tmp"):
        (folder / name).write_text("half")
    ls.map(PARTS, RADII[:1])
    assert sorted(path.name for path in folder.glob(".*")) == sorted(
        [f".other.vdb.{dead}-0.tmp", f".part_0.8.vdb.{os.getpid()}-0.tmp"]
    )


def test_equal_jobs_have_equal_keys(ls, folder):
    pytest.importorskip("distributed")
    from levelsmith import _map

    one, two, other = _map._pipelines(PARTS, [RADII[0], dict(RADII[0]), RADII[1]])
    assert one.key() == two.key() != other.key()
    assert pickle.loads(pickle.dumps(one)).key() == one.key()
    ball = ls.sphere(radius=1, voxel=0.1)
    keys = {_map._Function(abs, {"x": x}).key() for x in (ball, ls.sphere(radius=1, voxel=0.1))}
    assert len(keys) == 1
