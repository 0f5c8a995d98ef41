"""Cache of results in a folder."""

import pickle

import numpy
import pytest
from conftest import actions


@pytest.fixture
def kept(ls, tmp_path):
    """Sets the cache folder, and removes the setting afterwards."""
    ls.set_cache(tmp_path / "kept")
    yield tmp_path / "kept"
    ls.set_cache()


def ran(ls):
    """Actions that the last run computed, without cached ones."""
    return [step["action"] for step in ls.last_report()["steps"] if not step.get("known")]


def part(ls):
    base = ls.box(size=(2, 2, 1), voxel=0.05)
    return base.blend(ls.sphere(radius=0.8, voxel=0.05), radius=0.2)


def test_the_second_run_computes_nothing(ls, kept):
    first = part(ls)
    mesh = first.mesh()
    ls.compute(first, mesh)
    assert ran(ls) == ["box", "sphere", "blend", "mesh"]
    second = part(ls)
    again = second.mesh()
    report = ls.compute(second, again)
    assert ran(ls) == [] and second.is_computed and again.is_computed
    assert report["exit_code"] == 0
    assert (second.array() == first.array()).all()
    assert (again.vertices == mesh.vertices).all() and (again.faces == mesh.faces).all()


def test_unneeded_values_can_be_computed_later(ls, kept):
    base = part(ls)
    grown = base.offset(0.1)
    grown.compute()
    volume = base.measure()["volume"]
    known = part(ls)
    result = known.offset(0.1).compute()
    assert ran(ls) == [] and not known.is_computed
    assert (result.array() == grown.array()).all()
    assert known.measure()["volume"] == volume and known.is_computed
    assert "blend" not in ran(ls)


def test_values_from_arrays_are_cached_by_content(ls, kept):
    phi = ls.sphere(radius=1, voxel=0.1).array()

    def work(phi):
        solid = ls.from_array(phi, phi.voxel, phi.origin)
        solid.compute()
        return solid.offset(0.1).compute().info()["hash"], ran(ls)

    first = work(phi)
    assert work(phi)[0] == first[0]
    assert ran(ls) == []
    other = phi * 0.5
    other.origin = phi.origin
    assert work(other)[1] != [] or work(other)[0] != first[0]
    mesh = ls.Mesh(numpy.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
                   numpy.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))  # fmt: skip
    moved = ls.Mesh(mesh.vertices * 1.5, mesh.faces)
    for each in (mesh, moved):
        each.level_set(voxel=0.05).compute()
        assert ran(ls) == ["level-set"]
    mesh.level_set(voxel=0.05).compute()
    assert ran(ls) == []


def test_files_are_written_once(ls, kept, tmp_path):
    target = tmp_path / "a.vdb"
    part(ls).save(target)
    stamp = target.stat().st_mtime_ns
    part(ls).save(target)
    assert ran(ls) == [] and target.stat().st_mtime_ns == stamp
    target.unlink()
    part(ls).save(target)
    assert target.exists()


def test_a_damaged_entry_is_computed_again(ls, kept):
    expected = part(ls).info()["hash"]
    for entry in (kept / "results").glob("*.vdb"):
        entry.write_bytes(entry.read_bytes()[:1000])
    solid = part(ls)
    assert solid.compute().info()["hash"] == expected


def test_an_invalid_folder_is_refused(ls, tmp_path):
    (tmp_path / "file").write_text("")
    ls.set_cache(tmp_path / "file")
    try:
        with pytest.raises(ls.FileError, match="cannot create"):
            part(ls).compute()
    finally:
        ls.set_cache()
    part(ls).compute()
    assert not any(step.get("known") for step in ls.last_report()["steps"])
    assert actions(ls)


def test_values_are_pickled_bit_for_bit(ls):
    solid = part(ls)
    solid.name = "lid"
    again = pickle.loads(pickle.dumps(solid))
    assert type(again) is ls.Solid and again.is_computed and again.name == "lid"
    assert again.info()["hash"] == solid.info()["hash"] and again.voxel == solid.voxel
    mesh = solid.mesh()
    back = pickle.loads(pickle.dumps(mesh))
    assert (back.vertices == mesh.vertices).all() and (back.faces == mesh.faces).all()
    field = ls.sphere(radius=1, voxel=0.1).march(speed="1 + 0.5*x", to=0.4)
    assert type(field) is ls.Field
    assert pickle.loads(pickle.dumps(field)).info() == field.info()
    with pytest.raises(ls.UsageError, match="patch cannot be sent"):
        pickle.dumps(solid.decal(at=(0, 0, 1), direction=(1, 0, 0), radius=0.3, height=0.1))
