"""Operators compared with closed forms, lazy evaluation, sharing, and kinds."""

import gc
import json
import math
from random import Random

import numpy
import pytest
from conftest import actions

BALL = 4 / 3 * math.pi


def volume(solid):
    return solid.measure()["volume"]


def test_a_ball_has_the_volume_of_a_ball(ball):
    assert volume(ball) == pytest.approx(BALL, rel=1e-7)
    assert ball.measure()["area"] == pytest.approx(4 * math.pi, rel=1e-6)


def test_csg_has_the_volumes_of_closed_forms(ls):
    h = 0.05
    a, b = ls.sphere(radius=1, voxel=h), ls.sphere(radius=1, center=(1, 0, 0), voxel=h)
    lens = 5 * math.pi / 12  # intersection of two unit balls, a unit apart
    assert volume(a & b) == pytest.approx(lens, rel=2e-3)
    assert volume(a | b) == pytest.approx(2 * BALL - lens, rel=1e-3)
    assert volume(a - b) == pytest.approx(BALL - lens, rel=1e-2)
    box = ls.box(size=(4, 4, 4), voxel=0.1)
    assert volume(box - ls.sphere(radius=1, voxel=0.1)) == pytest.approx(64 - BALL, rel=5e-3)
    blended = ls.blend(box, ls.cylinder(radius=1, height=6, voxel=0.1), radius=0.4)
    assert volume(blended) > 64 + 2 * math.pi


def test_an_offset_ball_is_a_ball(ball):
    assert volume(ball.offset(0.2)) == pytest.approx(BALL * 1.2**3, rel=1e-4)
    assert volume(ball.offset("-2vx")) == pytest.approx(BALL * 0.9**3, rel=1e-4)
    assert volume(ball.transform(scale=2, translate=(1, 2, 3))) == pytest.approx(8 * BALL, rel=1e-6)


def test_methods_are_the_functions(ls, ball):
    assert volume(ls.offset(ball, 0.1)) == volume(ball.offset(distance=0.1))
    more = ls.union(ball, ls.box(size=(1, 1, 4), voxel=0.05), ls.box(size=(4, 1, 1), voxel=0.05))
    assert more.measure()["components"] == 1


def test_no_action_runs_before_it_is_needed(ls, ball):
    made = (ball.offset(0.1) | ball.offset(-0.1)).mesh()
    assert not made.is_computed and not ball.is_computed
    report = ls.compute(made)
    assert sorted(s["action"] for s in report["steps"]) == ["mesh", "offset", "offset", "sphere", "union"]
    assert made.is_computed
    assert ls.compute(made)["steps"] == []


def test_referenced_values_are_computed_once(ls, ball):
    grown = ball.offset(0.1)
    a, b = grown.mesh(), grown.offset(0.1)
    ls.compute(a)
    assert actions(ls) == ["sphere", "offset", "mesh"]
    ls.compute(b)
    assert actions(ls) == ["offset"]  # `grown` is held by a name and by `b`
    assert grown.is_computed
    ls.compute(ball.mesh())
    assert actions(ls) == ["mesh"]


def test_operands_of_uncomputed_values_are_computed_once(ls):
    base = ls.sphere(radius=1, voxel=0.1)
    a, b = base.mesh(), base.offset(0.2)
    del base
    ls.compute(a)
    assert actions(ls) == ["sphere", "mesh"]
    ls.compute(b)
    assert actions(ls) == ["offset"]


def test_unreachable_results_are_released(ls):
    """Intermediate results of a long chain do not stay in memory."""
    solid = ls.sphere(radius=1, voxel=0.1)
    for _ in range(5):
        solid = solid.offset(0.01)
    solid.compute()
    assert actions(ls) == ["sphere"] + ["offset"] * 5
    assert json.loads(ls.graph(solid))["nodes"][0]["op"] == "sphere"
    ls.compute(solid.mesh())
    assert actions(ls) == ["mesh"]


def test_long_chains_neither_overflow_nor_leak(ls):
    solid = ls.sphere(radius=1, voxel=0.1)
    for _ in range(50000):
        solid = solid.offset(0.01)
    assert len(json.loads(ls.graph(solid))["nodes"]) == 50001
    del solid
    gc.collect()


def test_graphs_of_any_shape_and_order_give_correct_results(ls):
    """Combines concentric balls by unions, intersections and offsets. Names appear and disappear between runs."""
    random = Random(3)
    base = {r: ls.sphere(radius=r, voxel=0.2) for r in (1.0, 1.6)}
    for _ in range(12):
        pool = [(solid, radius) for radius, solid in base.items()]
        for _ in range(random.randrange(1, 12)):
            (a, ra), (b, rb) = random.choice(pool), random.choice(pool)
            step = random.choice((-0.1, 0.15))
            made = random.choice(((a | b, max(ra, rb)), (a & b, min(ra, rb)), (a.offset(step), ra + step)))
            pool.append(made)
            if random.random() < 0.3:
                pool.pop(random.randrange(len(pool)))
            if random.random() < 0.3:
                random.choice(pool or [made])[0].compute()
            pool = pool or [made]
            del a, b, made
        for solid, radius in pool:
            assert solid.bounds[1] == pytest.approx([radius] * 3, abs=0.03)
            steps = ls.compute(solid)["steps"]
            assert steps == []


def test_a_failed_run_keeps_its_results(ls, ball):
    bad = ball.offset(-5)
    with pytest.raises(ls.InputError):
        bad.compute()
    assert ball.is_computed and not bad.is_computed
    assert ls.last_report()["exit_code"] == 3


def test_kinds_have_classes(ls, ball, tmp_path):
    mesh = ball.mesh()
    assert isinstance(mesh, ls.Mesh) and isinstance(mesh.level_set(voxel=0.1), ls.Solid)
    assert isinstance(ball.march(speed="1 + 0.5*x", to=0.2), ls.Field)
    assert isinstance(ball.decal(at=(0, 0, 1), direction=(1, 0, 0), radius=0.3, height=0.1), ls.Patch)
    assert isinstance(ls.scene(ball, mesh), ls.Scene)
    ball.save(tmp_path / "ball.vdb")
    again = ls.read(tmp_path / "ball.vdb")
    assert isinstance(again, ls.Solid) and volume(again) == volume(ball)
    mesh.save(str(tmp_path / "ball.ply"))
    assert (ls.read(tmp_path / "ball.ply").vertices == mesh.vertices).all()
    assert volume(mesh) == pytest.approx(BALL, rel=1e-2)


def test_fields_are_given_as_values(ls, ball):
    bump = ls.sphere(radius=0.5, center=(0, 0, 1), voxel=0.05)
    half = ball.offset(0.2, mask="x", mask_min=0, mask_max=0)
    assert BALL < volume(half) < BALL * 1.2**3
    by_value = ball.offset(0.2, mask=bump, mask_min=-0.1, mask_max=0, mask_invert=True)
    assert volume(by_value) > BALL
    text = json.loads(ls.graph(by_value))
    assert text["nodes"][-1]["named"] == {"mask": 1}


def test_numpy_numbers_are_numbers(ls):
    assert volume(ls.sphere(radius=numpy.array(1.0), voxel="0.1")) == pytest.approx(BALL, rel=1e-5)
    assert len(ls.box(size=[1, 1, 1], voxel=0.1).mesh(sharp=numpy.bool_(True)).faces)
    ball = ls.sphere(radius=numpy.float32(1), center=numpy.array([1, 2, 3]), voxel=numpy.float64(0.1))
    assert ball.bounds.mean(axis=0) == pytest.approx([1, 2, 3], abs=1e-6)
    turned = ball.transform(matrix=numpy.diag([2.0, 2, 2, 1]))
    assert volume(turned) == pytest.approx(8 * BALL, rel=1e-5)
    assert volume(ls.clip(ball, box=[(0, 0, 0), (1, 5, 5)])) == pytest.approx(BALL / 2, rel=2e-2)


def test_the_graph_runs_again_on_the_command_line(ls, ball):
    nodes = json.loads(ls.graph((ball | ball.offset(0.1)).mesh()))["nodes"]
    assert [node["op"] for node in nodes] == ["sphere", "offset", "union", "mesh"]
    assert nodes[2]["inputs"] == [0, 1]


def test_names_are_reported(ls, ball):
    ball.name = "ball"
    assert "'ball'" in repr(ball)
    scene = ls.scene(ball, ball.mesh())
    assert scene.info()["solids"][0]["name"] == "ball"


def test_pictures(ls, ball, tmp_path):
    import struct

    png = ball._repr_png_()
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", png[16:24]) == (320, 240)
    ball.render(tmp_path / "a.png", size=(64, 48))
    assert struct.unpack(">II", (tmp_path / "a.png").read_bytes()[16:24]) == (64, 48)
    assert ball.mesh()._repr_png_()[:4] == b"\x89PNG"


def test_deformations_are_values(ls, tmp_path):
    bar = ls.box(size=(1, 1, 4), voxel=0.1)
    bent = ls.lattice(bend=60, towards=(1, 0, 0), box=((-1, -1, -3), (1, 1, 3)))
    assert isinstance(bent, ls.Deformation) and not bent.is_computed
    moved = bar.deform(bent)
    assert volume(moved) == pytest.approx(4, rel=2e-2)  # without --sharp
    bent.save(str(tmp_path / "bent.json"))
    again = ls.read(str(tmp_path / "bent.json"))
    assert isinstance(again, ls.Deformation)
    assert bar.deform(again).info() == moved.info()
    assert bent.info()["form"] == "lattice"
    assert (again.points == bent.points).all() and bent.points.shape[3] == 3
    rest = bar.lattice(count=(2, 3, 4), box=None)
    assert rest.points.shape == (2, 3, 4, 3)
    low, high = rest.points.reshape(-1, 3).min(0), rest.points.reshape(-1, 3).max(0)
    wide = ls.Deformation(rest.points * (1.5, 1, 1), (low, high))
    assert volume(bar.deform(wide)) == pytest.approx(6, rel=2e-2)
    with pytest.raises(ls.InputError, match="shape"):
        ls.Deformation(numpy.zeros((2, 2, 3)), (low, high))
    around = bar.lattice(twist=30)
    assert bar.deform(around).info() == bar.deform(twist=30).info()
    with pytest.raises(ls.UsageError, match="needs 2 operands"):
        bar.deform()
    with pytest.raises(ls.UsageError, match="takes 1 operand"):
        bar.deform(bent, twist=3)
