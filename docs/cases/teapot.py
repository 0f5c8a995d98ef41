"""Meshes of the Utah teapot's Bézier patches: teapot.py TeapotBufferGeometry.js FOLDER [SEGMENTS]
Writes FOLDER/teapot-pot.ply, -handle.ply and -spout.ply. Each is closed, so that their union is a solid."""

import collections
import re
import sys

# Patches in the order of the file. The lid is between the body and the bottom.
PARTS = {"pot": [*range(0, 12), *range(20, 32)], "handle": [*range(12, 16)], "spout": [*range(16, 20)]}
LID = range(20, 28)
LID_SCALE = 1.4 / 1.3  # the lid ends at radius 1.3 and the rim begins at 1.4: without this the pot is open
MOUTH, LIP = range(18, 20), 0.75  # the lip of the spout curls inwards from here: a cap behind it would leave a thin edge


def read(file):
    """The control points of each patch, from the two arrays of the file."""
    with open(file) as source:
        text = re.sub(r"/\*.*?\*/", "", source.read(), flags=re.DOTALL)

    def array(name):
        body = re.search(rf"{name} = \[(.*?)\]", text, re.DOTALL).group(1)
        return [float(number.replace(" ", "")) for number in re.findall(r"-?\s*[\d.]+", body)]

    indices, numbers = [int(index) for index in array("teapotPatches")], array("teapotVertices")
    points = [numbers[i : i + 3] for i in range(0, len(numbers), 3)]
    return [[points[index] for index in indices[i : i + 16]] for i in range(0, len(indices), 16)]


def bernstein(t):
    s = 1 - t
    return [s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t]


def mesh(patches, segments, ends):
    """Vertices and triangles of some patches. Their borders are joined, and open ends are closed by a fan.
    ENDS has the end of the first parameter of each patch, up to 1."""
    vertices, number, triangles = [], {}, []

    def vertex(point):
        key = tuple(round(x, 6) + 0.0 for x in point)
        if key not in number:
            number[key] = len(vertices)
            vertices.append(key)
        return number[key]

    steps = [i / segments for i in range(segments + 1)]

    def point(patch, a, b):
        return [sum(a[i] * b[j] * patch[4 * i + j][k] for i in range(4) for j in range(4)) for k in range(3)]

    for patch, end in zip(patches, ends):
        grid = [[vertex(point(patch, bernstein(end * s), bernstein(t))) for t in steps] for s in steps]
        for i in range(segments):
            for j in range(segments):
                p, q, r, s = grid[i][j], grid[i + 1][j], grid[i + 1][j + 1], grid[i][j + 1]
                triangles += [t for t in ((p, r, q), (p, s, r)) if len(set(t)) == 3]

    following = {}
    edges = collections.Counter((t[k], t[(k + 1) % 3]) for t in triangles for k in range(3))
    for a, b in edges:
        if (b, a) not in edges:
            following[b] = a
    while following:
        ring = [next(iter(following))]
        while ring[-1] in following:
            ring.append(following.pop(ring[-1]))
        ring.pop()
        centre = vertex([sum(vertices[i][k] for i in ring) / len(ring) for k in range(3)])
        triangles += [(centre, ring[i - 1], ring[i]) for i in range(len(ring))]
    edges = collections.Counter((t[k], t[(k + 1) % 3]) for t in triangles for k in range(3))
    assert all(count == 1 and edges[b, a] == 1 for (a, b), count in edges.items()), "the patches are not closed"
    volume = sum(
        x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) + x[2] * (y[0] * z[1] - y[1] * z[0])
        for x, y, z in (tuple(vertices[i] for i in t) for t in triangles)
    )
    return vertices, triangles if volume > 0 else [t[::-1] for t in triangles]


def write(file, vertices, triangles):
    with open(file, "w") as target:
        print(f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}", file=target)
        print("property float x\nproperty float y\nproperty float z", file=target)
        print(f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header", file=target)
        for vertex in vertices:
            print(*vertex, file=target)
        for triangle in triangles:
            print(3, *triangle, file=target)


if __name__ == "__main__":
    patches, folder = read(sys.argv[1]), sys.argv[2]
    for i in LID:
        patches[i] = [[x * LID_SCALE, y * LID_SCALE, z] for x, y, z in patches[i]]
    for name, some in PARTS.items():
        ends = [LIP if i in MOUTH else 1 for i in some]
        write(f"{folder}/teapot-{name}.ply", *mesh([patches[i] for i in some], int((sys.argv[3:] or [24])[0]), ends))
