"""Conversion between numpy arrays and values."""

import gc
import math

import numpy
import pytest

BALL = 4 / 3 * math.pi

CUBE = numpy.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
FACES = numpy.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def test_meshes_from_arrays(ls):
    for places in (numpy.float32, numpy.float64):
        for corners in (numpy.int32, numpy.int64, numpy.uint32, numpy.uint8):
            mesh = ls.Mesh(CUBE.astype(places), FACES.astype(corners))
            assert (mesh.vertices == CUBE).all() and (mesh.faces == FACES).all()
            assert mesh.vertices.dtype == numpy.float64 and mesh.faces.dtype == numpy.uint32
    assert mesh.measure()["volume"] == pytest.approx(1)
    solid = mesh.level_set(voxel=0.05)
    assert solid.measure()["volume"] == pytest.approx(1, rel=2e-2)
    strided = numpy.zeros((8, 6))[:, ::2]
    strided[:] = CUBE
    assert (ls.Mesh(strided, FACES[:, ::-1]).faces == FACES[:, ::-1]).all()


def test_views_share_memory_and_outlive_the_mesh(ls):
    mesh = ls.Mesh(CUBE, FACES)
    vertices, again = mesh.vertices, mesh.vertices
    assert vertices.ctypes.data == again.ctypes.data and not vertices.flags.owndata
    with pytest.raises(ValueError):
        vertices[0, 0] = 5
    del mesh, again
    gc.collect()
    assert (vertices == CUBE).all()
    assert ls.Mesh(CUBE, FACES).normals is None


@pytest.mark.parametrize(
    "vertices, faces",
    [
        (CUBE[:, :2], FACES),
        (CUBE.ravel(), FACES),
        (CUBE.astype(int), FACES),
        (CUBE, FACES[:, :2]),
        (CUBE, FACES.astype(float)),
        (CUBE, FACES + 1),
        (CUBE, FACES - 1),
        (CUBE, FACES.astype(numpy.int64) + 2**32),
        (numpy.where(CUBE == 1, numpy.nan, CUBE), FACES),
        (numpy.where(CUBE == 1, numpy.inf, CUBE), FACES),
        (CUBE.astype(complex), FACES),
        ([["a"] * 3] * 8, FACES),
    ],
)
def test_invalid_arrays_are_refused(ls, vertices, faces):
    with pytest.raises(ls.InputError, match="^Mesh: "):
        ls.Mesh(vertices, faces)


def test_arrays_of_a_solid_have_their_position(ls, ball):
    phi = ball.array()
    assert phi.dtype == numpy.float32 and phi.voxel == 0.05
    index = numpy.argwhere(numpy.abs(phi) < 0.1)
    points = numpy.array(phi.origin) + phi.voxel * index
    assert numpy.linalg.norm(points, axis=1) - 1 == pytest.approx(numpy.asarray(phi)[tuple(index.T)], abs=1e-6)
    part = ball.array(box=((0, 0, 0), (0.5, 1.5, 0.12)))
    assert part.shape == (11, 31, 3) and part.origin == pytest.approx((0, 0, 0))
    assert part[0, 0, 0] == pytest.approx(-0.15) and part[0, 30, 0] == pytest.approx(0.15)
    with pytest.raises(ls.InputError):
        ball.transform(rotate=30).array()
    with pytest.raises(ls.InputError):
        ball.array(box=((0.01, 0.01, 0.01), (0.02, 0.02, 0.02)))
    with pytest.raises(ls.ResourceError):
        ball.array(box=((-1e4,) * 3, (1e4,) * 3))


def test_arrays_are_restored_after_conversion(ls, ball):
    phi = ball.array()
    again = ls.from_array(phi, phi.voxel, phi.origin)
    assert not again.is_computed
    assert ls.compare(ball, again)["hausdorff"] < 1e-6
    assert (numpy.asarray(again.array(ball.bounds)) == ball.array(ball.bounds)).all()
    cut = ball - ls.box(size=(4, 4, 4), center=(2, 2, 2), voxel=0.05)
    phi = cut.array()
    assert ls.compare(cut, ls.from_array(phi, phi.voxel, phi.origin))["hausdorff"] < 0.75 * 0.05


def test_only_signs_and_slopes_near_the_surface_matter(ls):
    h = 0.1
    x = numpy.stack(numpy.meshgrid(*[numpy.arange(-15, 16) * h] * 3, indexing="ij"), -1)
    distance = numpy.linalg.norm(x, axis=-1) - 1
    exact = ls.from_array(distance, h, origin=(-1.5,) * 3)
    clipped = ls.from_array(numpy.clip(distance, -2 * h, 2 * h), h, origin=(-1.5,) * 3)
    assert ls.compare(exact, clipped)["hausdorff"] < 1e-4
    assert exact.measure()["volume"] == pytest.approx(BALL, rel=1e-4)
    assert exact.check()["passed"]
    wide = ls.from_array(distance, h, origin=(-1.5,) * 3, half_width=5)
    assert wide.info()["half_width"] == 5


@pytest.mark.parametrize("reach, radius", [(10, 0.998), (10, 0.92), (11, 1.05), (12, 1.1)])
def test_surfaces_near_the_border_do_not_move(ls, reach, radius):
    h = 0.1
    x = numpy.stack(numpy.meshgrid(*[numpy.arange(-reach, reach + 1) * h] * 3, indexing="ij"), -1)
    distance = numpy.linalg.norm(x, axis=-1) - radius
    solid = ls.from_array(distance, h, x[0, 0, 0])
    assert ls.compare(solid, ls.sphere(radius=radius, voxel=h))["hausdorff"] < 0.1 * h


def test_a_solid_larger_than_its_band_stays_full(ls):
    """Blocks without samples are inside too."""
    phi = ls.box(size=(8, 8, 8), voxel=0.1).array()
    solid = ls.from_array(phi, phi.voxel, phi.origin)
    assert solid.measure()["volume"] == pytest.approx(512, rel=1e-3)
    assert solid.measure()["cavities"] == 0
    assert solid.array(((0, 0, 0), (0.1, 0.1, 0.1)))[0, 0, 0] < 0


def test_arrays_without_a_solid_are_refused(ls):
    good = numpy.full((20, 20, 20), 0.3)
    good[5:15, 5:15, 5:15] = -0.3
    ls.from_array(good, 0.1).compute()

    def refuse(phi, voxel=0.1, kind=ls.InputError):
        with pytest.raises(kind, match="^from_array: "):
            ls.from_array(phi, voxel)

    for number in (numpy.nan, numpy.inf):
        bad = good.copy()
        bad[3, 4, 5] = number
        with pytest.raises(ls.InputError, match=r"phi\[3, 4, 5\] is"):
            ls.from_array(bad, 0.1)
    refuse(-good)
    refuse(numpy.abs(good))
    refuse(good[8:])
    refuse(good[0])
    refuse(good[:0])
    refuse(good.astype(complex))
    refuse(good, -0.1, ls.UsageError)
    refuse(good, numpy.nan, ls.UsageError)


def test_functions_become_solids(ls):
    calls = []

    def squares(p):
        assert p.dtype == numpy.float64 and p.shape[1] == 3
        calls.append(len(p))
        return (p**2).sum(axis=1) - 1

    solid = ls.from_function(squares, ((-1.2,) * 3, (1.3,) * 3), 0.02)
    assert solid.measure()["volume"] == pytest.approx(BALL, rel=1e-5)
    assert solid.check()["passed"]
    assert sum(calls) < 0.7 * 125**3


def test_functions_with_any_slope(ls):
    def torus(p):
        r = numpy.hypot(p[:, 0], p[:, 1]) - 2
        return numpy.hypot(r, p[:, 2]) - 0.5

    bounds = ((-2.7,) * 2 + (-0.7,), (2.7,) * 2 + (0.7,))
    want = 2 * math.pi**2 * 2 * 0.25
    for change in (lambda d: d, lambda d: 1000 * d, lambda d: 1e-6 * d, lambda d: numpy.tanh(5 * d)):
        solid = ls.from_function(lambda p: change(torus(p)), bounds, 0.1)
        assert solid.measure()["volume"] == pytest.approx(want, rel=2e-3)


def test_thin_and_full_parts_of_functions_are_found(ls):
    def plate(p):
        return numpy.max(numpy.abs(p - [0, 0, 0.013]) - [1, 1, 0.06], axis=1)

    thin = ls.from_function(plate, ((-1.3,) * 3, (1.3,) * 3), 0.04)
    assert thin.measure()["volume"] == pytest.approx(4 * 0.12, rel=0.02)
    cube = ls.from_function(lambda p: numpy.abs(p).max(axis=1) - 4, ((-5,) * 3, (5,) * 3), 0.1)
    assert cube.measure()["volume"] == pytest.approx(512, rel=2e-3)


def test_invalid_functions_are_refused(ls):
    bounds = ((-2, -2, -2), (2, 2, 2))

    def refuse(f, bounds=bounds, voxel=0.2, kind=ls.InputError):
        with pytest.raises(kind, match="^from_function: "):
            ls.from_function(f, bounds, voxel)

    ball = lambda p: numpy.linalg.norm(p, axis=1) - 1
    refuse(lambda p: numpy.full(len(p), numpy.nan))
    refuse(lambda p: p)
    refuse(lambda p: 1.0)
    refuse(lambda p: ball(p) + 5)
    refuse(lambda p: ball(p) - 1.5)
    refuse(lambda p: ball(p) - 50)
    refuse(ball, bounds[::-1], kind=ls.UsageError)
    refuse(ball, ((0, 0), (1, 1)), kind=ls.UsageError)
    refuse(ball, voxel=0, kind=ls.UsageError)
    refuse(ball, voxel=1e-6, kind=ls.ResourceError)
    with pytest.raises(ZeroDivisionError):
        ls.from_function(lambda p: 1 // 0, bounds, 0.2)


def test_point_clouds_from_arrays(ls):
    normals = (CUBE - 0.5).astype(numpy.float32)
    cloud = ls.PointCloud(CUBE, normals)
    assert (cloud.positions == CUBE).all() and (cloud.normals == normals).all()
    assert cloud.radii is None and cloud.colors is None and cloud.weights is None
    assert cloud.info()["points"] == 8 and cloud.info()["spacing"]["mean"] == 1
    assert ls.PointCloud(CUBE).normals is None
    moved = cloud.transform(scale=2)
    assert isinstance(moved, ls.PointCloud) and (moved.positions == 2 * CUBE).all()
    assert cloud.thin(count=3).positions.shape == (3, 3)
    sampled = ls.Mesh(CUBE, FACES).sample(count=500)
    assert sampled.positions.shape == (500, 3)
    for bad in (CUBE[:, :2], CUBE.astype(int), CUBE * numpy.nan):
        with pytest.raises(ls.InputError):
            ls.PointCloud(bad)
    with pytest.raises(ls.InputError):
        ls.PointCloud(CUBE, normals[:3])


def test_point_clouds_are_read_from_files(ls, tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("x,y,z,r,g,b,radius,weight\n1,2,3,255,0,0,0.5,0.25\n")
    cloud = ls.read(str(file))
    assert isinstance(cloud, ls.PointCloud)
    assert cloud.colors.tolist() == [[1, 0, 0, 1]]
    assert cloud.radii.tolist() == [0.5] and cloud.weights.tolist() == [0.25]


def test_adaptive_fields_are_sampled(ls):
    ball = ls.sphere(radius=1, voxel=0.05).mesh()
    field = ball.level_set(adaptive=True, tolerance=0.01)
    assert isinstance(field, ls.AdaptiveField)
    assert field.tolerance == 0.01 and field.cells > 1000
    points = numpy.array([[0.98, 0, 0], [0, 1.02, 0], [0, 0, 5.0], [numpy.nan, 0, 0]])
    distances = field.distances(points)
    assert abs(distances[0] + 0.02) < 0.011 and abs(distances[1] - 0.02) < 0.011
    assert distances[2] > 3 and numpy.isnan(distances[3])
    moved = ball.transform(translate=(0.5, 0, 0)).level_set(adaptive=True, tolerance=0.01)
    assert isinstance(field | moved, ls.AdaptiveField)
    assert (field - moved).measure()["volume"] < field.measure()["volume"]
    assert isinstance(field.to_band(voxel=0.1), ls.Solid)
    for bad in (numpy.zeros(3), numpy.zeros((2, 2)), numpy.zeros((2, 3), int)):
        with pytest.raises(ls.InputError, match="distances: the array points has shape"):
            field.distances(bad)


def test_segmentations_have_labels(ls):
    box = ls.box(size=(4, 4, 4), voxel=0.2)
    ball = ls.sphere(radius=1, voxel=0.2)
    parts = ls.segment(box, ball)
    assert isinstance(parts, ls.Segmentation)
    assert parts.labels == [1, 2] and parts.voxel == 0.2
    points = numpy.array([[0.0, 0, 0], [1.5, 0, 0], [3.0, 0, 0]])
    labels = parts.labels_at(points)
    assert labels.dtype == numpy.uint16 and labels.tolist() == [2, 1, 0]
    assert isinstance(parts.extract(1), ls.Solid)
    assert [m["label"] for m in parts.measure()["materials"]] == [1, 2]
    with pytest.raises(ls.InputError, match="labels_at: the array points has shape"):
        parts.labels_at(numpy.zeros(3))
    # The ball reaches from -1 to 1, the box from -2 to 2.
    assert numpy.allclose(parts.distances(points), [1, 0.5, 1], atol=0.02)
    assert numpy.allclose(parts.distances(points, region=1), [1, -0.5, 1], atol=0.02)
    assert numpy.isinf(parts.sheet_distances(points)).all() and parts.sheet_labels == []
    with pytest.raises(ls.UsageError, match="distances: the segmentation has no region 3"):
        parts.distances(points, region=3)


def test_sheets_have_distances(ls):
    wall = ls.Mesh([[-1.0, -1, 0.03], [1, -1, 0.03], [1, 1, 0.03], [-1, 1, 0.03]], [[0, 1, 2], [0, 2, 3]])
    field = wall.segment(sheets=True, voxel=0.1)
    assert field.labels == [] and field.sheet_labels == [0]
    points = numpy.array([[0.0, 0, 0.23], [0, 0, 3.03], [0, 0, -0.97], [2, 0, 0.03], [numpy.nan, 0, 0]])
    assert field.labels_at(points).tolist() == [0, 0, 0, 0, 0]
    for distances in (field.distances(points), field.sheet_distances(points)):
        assert numpy.allclose(distances[:4], [0.2, 3, 1, 1], atol=1e-5) and numpy.isnan(distances[4])
    with pytest.raises(ls.InputError, match="sheet_distances: the array points has shape"):
        field.sheet_distances(numpy.zeros(3))


def test_terrains_from_arrays(ls, tmp_path):
    heights = numpy.arange(12, dtype=numpy.float32).reshape(3, 4)
    ground = ls.Terrain(heights, spacing=(2, 3), origin=(10, 20))
    assert (ground.heights == heights).all() and ground.heights.dtype == numpy.float32
    assert ground.spacing == (2, 3) and ground.origin == (10, 20)
    assert not ground.heights.flags.writeable
    assert ground.measure()["projected_area"] == 36
    solid = ground.solidify(base=-1, voxel=0.5)
    assert isinstance(solid, ls.Solid)
    assert isinstance(ground.surface_band(voxel=0.5), ls.Surface)
    assert isinstance(ground.mesh(), ls.Mesh) and len(ground.mesh().faces) == 12
    heights[1, 1] = numpy.nan
    holed = ls.Terrain(heights)
    assert numpy.isnan(holed.heights[1, 1]) and holed.info()["missing"] == 1
    assert holed.terrain(fill=True).heights[1, 1] == 5
    file = tmp_path / "a.asc"
    holed.save(str(file))
    assert (ls.read(str(file)).heights[0] == heights[0]).all()
    for bad in (numpy.zeros((3, 4), int), heights[0], numpy.full((3, 4), numpy.inf)):
        with pytest.raises(ls.InputError):
            ls.Terrain(bad)
    with pytest.raises(ls.InputError):
        ls.Terrain(heights, spacing=(0, 1))
