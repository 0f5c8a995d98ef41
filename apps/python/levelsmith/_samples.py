"""Converts arrays and functions to solids."""

import numpy

from . import _core, _operators, _values

SIDE = 8  # grid points of a block along an axis, as in a leaf of OpenVDB
HALF = SIDE // 2


def _refuse(text, action):
    raise _core.InputError(f"{action}: {text}")


def _require(voxel, action):
    voxel = float(voxel)
    if not (numpy.isfinite(voxel) and voxel > 0):
        raise _core.UsageError(f"{action}: the voxel is {voxel}; give a positive length")
    return voxel


def _point(point, name, action):
    point = numpy.asarray(point, dtype=float)
    if point.shape != (3,) or not numpy.isfinite(point).all():
        raise _core.UsageError(f"{action}: {name} is not a point; give three finite numbers")
    return point


def _solid(origin, voxel, blocks, values, inside, half_width, action):
    if not (values < 0).any():
        _refuse("no value is negative; distances must be negative inside", action)
    raw = _values.wrap(
        _core.samples(
            tuple(float(x) for x in origin),
            voxel,
            numpy.ascontiguousarray(blocks, numpy.int32),
            numpy.ascontiguousarray(values, numpy.float32),
            numpy.ascontiguousarray(inside, numpy.int32),
        )
    )
    number = next(i for i, op in enumerate(_operators.registry) if op["name"] == "reinitialize")
    return _values.wrap(_core.node(number, (raw,), {"half_width": half_width}))


def _mixed(signs, axes):
    """Flags the blocks in which the sign changes, and both blocks of a pair of neighbours between which
    it changes. axes: axes of `signs` that run over the grid points of a block."""
    low, high = signs.min(axis=axes), signs.max(axis=axes)
    mixed = low != high
    for axis in range(3):
        a, b = _sides(axis)
        differ = (high[a] != high[b]) | (low[a] != low[b])
        mixed[a] |= differ
        mixed[b] |= differ
    return mixed


def _dilated(mask):
    """Adds to a mask of blocks their neighbours across faces, edges and corners."""
    for axis in range(3):
        near = mask.copy()
        a, b = _sides(axis)
        near[a] |= mask[b]
        near[b] |= mask[a]
        mask = near
    return mask


def from_array(phi, voxel, origin=(0, 0, 0), half_width=3):
    """A solid from an array of signed distances, negative inside.

    phi[i, j, k] is the value at origin + voxel * (i, j, k). Only the signs and the values next to the
    surface are read; distances are computed from these. The array must contain the entire solid,
    with positive values on its border.
    """
    action = "from_array"
    voxel, origin = _require(voxel, action), _point(origin, "the origin", action)
    phi = numpy.asarray(phi)
    if phi.ndim != 3 or phi.dtype.kind not in "fiu" or 0 in phi.shape:
        _refuse(f"phi has shape {phi.shape} and type {phi.dtype}; give numbers in three dimensions", action)
    bad = ~numpy.isfinite(phi)
    if bad.any():
        index = tuple(int(i) for i in numpy.argwhere(bad)[0])
        _refuse(f"phi{list(index)} is {phi[index]}; give finite numbers", action)
    for axis in range(3):
        for end in (0, -1):
            if (phi.take(end, axis) < 0).any():
                _refuse(
                    f"the solid touches the {'end' if end else 'start'} of axis {axis}; "
                    "give a larger array with positive values on its border",
                    action,
                )
    padded, before = _padded(phi.astype(numpy.float32))
    origin = origin - voxel * numpy.array(before)
    count = [n // SIDE for n in padded.shape]
    split = padded.reshape(count[0], SIDE, count[1], SIDE, count[2], SIDE).transpose(0, 2, 4, 1, 3, 5)
    signs = split < 0
    sampled = _dilated(_mixed(signs, (3, 4, 5)))
    inside = numpy.argwhere(signs[..., 0, 0, 0] & ~sampled)
    return _solid(origin, voxel, numpy.argwhere(sampled), split[sampled], inside, half_width, action)


def _padded(phi):
    """Pads an array to complete blocks, and by half a block where the solid is that close to the border.

    Returns the padded array and the number of points added at the start of each axis. The padded
    values continue the slope at the border, but are not below the value at the border.
    """
    def room(axis, layers):
        return HALF if (phi.take(layers, axis, mode="clip") < 0).any() else 0

    near = [(room(a, range(HALF)), room(a, range(n - HALF, n))) for a, n in enumerate(phi.shape)]
    widths = [(low, high + -(low + n + high) % SIDE) for (low, high), n in zip(near, phi.shape)]
    sloped = numpy.pad(phi, widths, mode="reflect", reflect_type="odd")
    return numpy.maximum(numpy.pad(phi, widths, mode="edge"), sloped), [low for low, _ in widths]


class _Sampler:
    """Evaluates a function at grid points, in calls of bounded size."""

    CALL = 1 << 18  # largest number of points in one call

    def __init__(self, function, origin, voxel):
        self.function, self.origin, self.voxel = function, origin, voxel

    def at(self, index):
        """Values of the function at grid points. index: (n, 3) grid indices."""
        values = numpy.empty(len(index), numpy.float64)
        for start in range(0, len(index), self.CALL):
            part = index[start : start + self.CALL]
            points = self.origin + self.voxel * part
            found = numpy.asarray(self.function(points))
            if found.shape != (len(part),):
                _refuse(
                    f"the function returns shape {found.shape} for {len(part)} points; "
                    f"return ({len(part)},)",
                    "from_function",
                )
            bad = ~numpy.isfinite(found.astype(float))
            if bad.any():
                point = points[numpy.argmax(bad)]
                _refuse(
                    f"the function is {found[numpy.argmax(bad)]} at "
                    f"({point[0]:g}, {point[1]:g}, {point[2]:g}); return finite numbers",
                    "from_function",
                )
            values[start : start + self.CALL] = found
        return values


def from_function(f, bounds, voxel, half_width=3):
    """A solid from a function of points, negative inside, that need not be a distance.

    f takes an (n, 3) array of world points and returns (n,) numbers. bounds are two points; the box
    between them contains the entire solid. f is evaluated at every fourth grid point. It is evaluated
    at all grid points of a block where its sign changes, or where its slope suggests a sign change,
    and of the neighbouring blocks into which the surface continues. A part of the solid is missed only if it lies between the coarse
    points and the values and slopes there do not indicate it.
    """
    action = "from_function"
    voxel = _require(voxel, action)
    if numpy.shape(bounds) != (2, 3):
        raise _core.UsageError(f"{action}: bounds needs two points, ((x, y, z), (x, y, z))")
    low, high = (_point(bounds[i], "a bound", action) for i in (0, 1))
    if not (low < high).all():
        raise _core.UsageError(f"{action}: the first bound must be below the second on every axis")
    count = numpy.ceil((high - low) / (voxel * SIDE) + 1e-9)
    if numpy.prod(2 * count + 1) > MOST_COARSE:
        raise _core.ResourceError(f"{action}: the bounds contain too many voxels; use larger voxels")
    count = count.astype(int)
    sampler = _Sampler(f, low, voxel)
    requested, is_inside = _coarse(sampler, count)
    blocks = _Blocks(count, is_inside)
    while requested.any():
        index = numpy.argwhere(requested)
        points = (SIDE * index[:, None, :] + OFFSETS[None]).reshape(-1, 3)
        requested = blocks.add(index, sampler.at(points).reshape(-1, SIDE, SIDE, SIDE))
    index, samples = blocks.result()
    inside = numpy.argwhere(is_inside & (blocks.number < 0))
    if ((inside == 0) | (inside == count - 1)).any() or _meet_border(index, samples, count):
        _refuse("the solid touches the bounds; give larger bounds", action)
    scale = numpy.abs(samples).max(initial=0) or 1.0  # samples may exceed the range of float32
    return _solid(low, voxel, index, samples / scale, inside, half_width, action)


# Index offsets of the grid points of a block from its first one.
OFFSETS = numpy.indices((SIDE, SIDE, SIDE)).reshape(3, -1).T
MOST_COARSE = 2**27  # largest number of grid points in the coarse evaluation


def _coarse(sampler, count):
    """Flags the blocks that may contain a surface, and the blocks that lie inside the solid.

    Evaluates the function at every fourth grid point. count: number of blocks along each axis.
    """
    shape = 2 * count + 1
    values = sampler.at(HALF * numpy.indices(shape).reshape(3, -1).T).reshape(shape)
    slopes = numpy.zeros_like(values)
    for axis in range(3):
        change = numpy.diff(values, axis=axis) ** 2
        steepest = numpy.zeros_like(values)
        for side in _sides(axis):
            numpy.maximum(steepest[side], change, out=steepest[side])
        slopes += steepest
    slopes = numpy.sqrt(slopes)
    nearest = numpy.full(count, numpy.inf)
    slope, inside = numpy.zeros(count), numpy.zeros(count, int)
    for i, j, k in numpy.ndindex(3, 3, 3):
        part = tuple(slice(n, n + 2 * c - 1, 2) for n, c in zip((i, j, k), count))
        numpy.minimum(nearest, numpy.abs(values[part]), out=nearest)
        numpy.maximum(slope, slopes[part], out=slope)
        inside += values[part] < 0
    # `slope` is the change of the function over one spacing of the coarse points. Any position is
    # at most 0.87 spacings from the nearest coarse point; 1.2 adds a margin.
    requested = (nearest <= 1.2 * slope) | ((inside > 0) & (inside < 27))
    return requested, inside == 27


def _sides(axis):
    """Indices of all items but the last along an axis, and of all items but the first."""
    before, behind = [slice(None)] * 3, [slice(None)] * 3
    before[axis], behind[axis] = slice(None, -1), slice(1, None)
    return tuple(before), tuple(behind)


class _Blocks:
    """Blocks with samples. Finds the neighbouring blocks that need samples too."""

    REACH = 3  # number of grid points beyond the surface that interpolation reads

    def __init__(self, count, is_inside):
        self.count, self.is_inside = count, is_inside
        self.number = numpy.full(count, -1)
        self.index, self.samples = [], []
        self.signs = numpy.zeros((0, SIDE, SIDE, SIDE), bool)

    def add(self, index, samples):
        """Adds the samples of some blocks. Returns a mask of the blocks that need samples next."""
        self.number[tuple(index.T)] = len(self.signs) + numpy.arange(len(index))
        self.index.append(index)
        self.samples.append(samples)
        signs = samples < 0
        self.signs = numpy.concatenate([self.signs, signs])
        requested = numpy.zeros(self.count, bool)
        near = {-1: slice(None, self.REACH), 0: slice(None), 1: slice(-self.REACH, None)}
        for step in numpy.ndindex(3, 3, 3):
            step = numpy.array(step) - 1
            part = signs[(slice(None), *(near[s] for s in step))].reshape(len(signs), -1)
            self._request(index[part.any(axis=1) & ~part.all(axis=1)] + step, requested)
        for axis in range(3):
            for side in (-1, 1):
                step = numpy.zeros(3, int)
                step[axis] = side
                self._request_across(index, signs, axis, step, requested)
        return requested & (self.number < 0)

    def _request(self, index, requested):
        index = index[((index >= 0) & (index < self.count)).all(axis=1)]
        requested[tuple(index.T)] = True

    def _request_across(self, index, signs, axis, step, requested):
        """Requests the blocks around each block that has a sign change across its face in direction `step`."""
        other = index + step
        known = ((other >= 0) & (other < self.count)).all(axis=1)
        index, signs, other = index[known], signs[known], other[known]
        here = signs.take(-1 if step[axis] > 0 else 0, axis + 1)
        number = self.number[tuple(other.T)]
        there = self.is_inside[tuple(other.T)][:, None, None] & numpy.ones_like(here)
        sampled = number >= 0
        face = 0 if step[axis] > 0 else -1
        there[sampled] = self.signs[number[sampled]].take(face, axis + 1)
        crossed = index[(here != there).any(axis=(1, 2))]
        for near in numpy.ndindex(3, 3, 3):
            self._request(crossed + numpy.array(near) - 1, requested)

    def result(self):
        if not self.index:
            return numpy.zeros((0, 3), int), numpy.zeros((0, SIDE, SIDE, SIDE))
        return numpy.concatenate(self.index), numpy.concatenate(self.samples)


def _meet_border(index, samples, count):
    return any(
        (samples[index[:, axis] == number].take(face, axis + 1) < 0).any()
        for axis in range(3)
        for number, face in ((0, 0), (count[axis] - 1, SIDE - 1))
    )
