"""Meshes of isosurfaces by Levelsmith and by VTK's flying edges, on one thread. See volumes.sh."""

import json
import math
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

MOST_TIME = 2  # bound on the ratio of CPU seconds
RUNS = 5


def our_mesh(levelsmith, folder, source, value, options):
    """CPU seconds of the action, the least of several runs, and the mesh file."""
    report, mesh = folder / "report.json", folder / "mesh.ply"
    least = math.inf
    for _ in range(RUNS):
        chain = [*source, "!", "isosurface-mesh", str(value), "--border", "open", *options]
        subprocess.run(
            [levelsmith, "-q", "--threads", "1", "--report", report, *chain, "!", "write", mesh],
            check=True, stderr=subprocess.DEVNULL)
        steps = json.loads(report.read_text())["steps"]
        least = min(least, next(s["cpu_s"] for s in steps if s["action"] == "isosurface-mesh"))
    return least, mesh


def flying_edges(image, value):
    """CPU seconds of the filter, the least of several runs, and its output."""
    edges = vtk.vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, value)
    edges.ComputeNormalsOn()
    edges.ComputeGradientsOff()
    edges.ComputeScalarsOff()
    least = math.inf
    for _ in range(RUNS):
        edges.Modified()
        begin = time.process_time()
        edges.Update()
        least = min(least, time.process_time() - begin)
    return least, edges.GetOutput()


def points_and_normals(output):
    return vtk_to_numpy(output.GetPoints().GetData()), vtk_to_numpy(output.GetPointData().GetNormals())


def read_ply(path):
    reader = vtk.vtkPLYReader()
    reader.SetFileName(str(path))
    reader.Update()
    return points_and_normals(reader.GetOutput())


def marschner_lobb(p):
    radius = numpy.hypot(p[:, 0], p[:, 1])
    wave = numpy.cos(12 * math.pi * numpy.cos(math.pi * radius / 2))
    return (1 - numpy.sin(math.pi * p[:, 2] / 2) + 0.25 * (1 + wave)) / 2.5


def torus(p):
    return 0.25 - numpy.hypot(numpy.hypot(p[:, 0], p[:, 1]) - 0.6, p[:, 2])


def sphere(p):
    return 0.6 - numpy.linalg.norm(p, axis=1)


def outward(function, p):
    step = 1e-5
    gradient = numpy.empty_like(p)
    for axis in range(3):
        ahead = numpy.eye(3)[axis] * step
        gradient[:, axis] = function(p + ahead) - function(p - ahead)
    return -gradient / numpy.linalg.norm(gradient, axis=1)[:, None]


def normal_errors(function, points, normals, spacing):
    """Mean and largest angle, degrees, of the normals more than three spacings from the border."""
    points = points.astype(float)
    inside = numpy.abs(points).max(axis=1) < 1 - 3 * spacing
    exact = outward(function, points[inside])
    held = normals[inside].astype(float)
    held /= numpy.linalg.norm(held, axis=1)[:, None]
    angles = numpy.degrees(numpy.arctan2(
        numpy.linalg.norm(numpy.cross(held, exact), axis=1), numpy.abs((held * exact).sum(axis=1))))
    return angles.mean(), angles.max()


def image_of(function, size):
    axis = numpy.linspace(-1, 1, size)
    k, j, i = numpy.meshgrid(axis, axis, axis, indexing="ij")
    values = function(numpy.column_stack([i.ravel(), j.ravel(), k.ravel()])).astype(numpy.float32)
    image = vtk.vtkImageData()
    image.SetDimensions(size, size, size)
    image.SetOrigin(-1, -1, -1)
    image.SetSpacing(*[2 / (size - 1)] * 3)
    image.GetPointData().SetScalars(numpy_to_vtk(values, deep=True))
    return image


def main(levelsmith, head):
    vtk.vtkSMPTools.Initialize(1)
    is_good = True
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        reader = vtk.vtkNIFTIImageReader()
        reader.SetFileName(head)
        reader.Update()
        print(f"{pathlib.Path(head).name}, CPU seconds of one thread: Levelsmith, flying edges, ratio")
        for value in (40.5, 60.5, 100.5):
            theirs, output = flying_edges(reader.GetOutput(), value)
            for options in ([], ["--filter", "tricubic"], ["--no-normals"]):
                ours, _ = our_mesh(levelsmith, folder, ["read", head], value, options)
                bound = "" if options else f"  bound <= {MOST_TIME}"
                is_good &= bool(options) or ours <= MOST_TIME * theirs
                print(f"  {value} {' '.join(options):20} {ours:7.3f} {theirs:7.3f} {ours / theirs:6.2f}{bound}")
            print(f"  {value} triangles {output.GetNumberOfCells()}")
        print("errors of normals, degrees: mean and largest of Levelsmith, of flying edges")
        for form, function, value in (("sphere", sphere, 0), ("torus", torus, 0),
                                      ("marschner-lobb", marschner_lobb, 0.5)):
            for size in (41, 81):
                _, output = flying_edges(image_of(function, size), value)
                theirs = normal_errors(function, *points_and_normals(output), 2 / (size - 1))
                _, mesh = our_mesh(levelsmith, folder, ["volume", form, "--size", str(size)], value,
                                   ["--filter", "tricubic"])
                ours = normal_errors(function, *read_ply(mesh), 2 / (size - 1))
                is_good &= ours[0] < theirs[0]
                print(f"  {form:15} {size:3}: {ours[0]:9.4f} {ours[1]:9.3f} {theirs[0]:9.4f} {theirs[1]:9.3f}")
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2]))
