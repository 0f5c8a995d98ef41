"""CPU seconds from a volume file to a picture, by Levelsmith and by VTK. See volume_picture.sh."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

SIZE = (1024, 768)
FROM, TO, UP, FOV = (-230, 330, 70), (-2, -14, 10), (0, 0, 1), 34
MOST = 0.5  # bound on the time beside VTK's ray caster of isosurfaces
RUNS = 3


def vtk_picture(method, head, value, out):
    """Draws the picture with VTK. Prints the CPU seconds up to the contour and in all, after the import of VTK."""
    import vtk
    begin = time.process_time()
    vtk.vtkSMPTools.Initialize(1)
    reader = vtk.vtkNIFTIImageReader()
    reader.SetFileName(head)
    reader.Update()
    contour = 0
    renderer = vtk.vtkRenderer()
    if method == "flying-edges":
        edges = vtk.vtkFlyingEdges3D()
        edges.SetInputConnection(reader.GetOutputPort())
        edges.SetValue(0, value)
        edges.ComputeNormalsOn()
        edges.ComputeScalarsOff()
        edges.Update()
        contour = time.process_time() - begin
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(edges.GetOutputPort())
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        renderer.AddActor(actor)
    else:
        properties = vtk.vtkVolumeProperty()
        properties.SetInterpolationTypeToLinear()
        properties.ShadeOn()
        colour = vtk.vtkColorTransferFunction()
        colour.AddRGBPoint(0, 1, 1, 1)
        properties.SetColor(colour)
        opacity = vtk.vtkPiecewiseFunction()
        if method == "gpu-isosurface":
            mapper = vtk.vtkGPUVolumeRayCastMapper()
            mapper.SetBlendModeToIsoSurface()
            properties.GetIsoSurfaceValues().SetValue(0, value)
            opacity.AddPoint(0, 1)
        else:
            mapper = vtk.vtkFixedPointVolumeRayCastMapper()
            mapper.SetNumberOfThreads(1)
            opacity.AddPoint(value - 0.5, 0)
            opacity.AddPoint(value + 0.5, 1)
        mapper.AutoAdjustSampleDistancesOff()
        mapper.SetSampleDistance(0.5)  # voxels have 1 mm
        if hasattr(mapper, "SetImageSampleDistance"):
            mapper.SetImageSampleDistance(1)
        properties.SetScalarOpacity(opacity)
        mapper.SetInputConnection(reader.GetOutputPort())
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(properties)
        renderer.AddVolume(volume)
    to_grid = vtk.vtkMatrix4x4()
    matrix = reader.GetSFormMatrix() or reader.GetQFormMatrix()
    vtk.vtkMatrix4x4.Invert(matrix, to_grid)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*to_grid.MultiplyPoint((*FROM, 1))[:3])
    camera.SetFocalPoint(*to_grid.MultiplyPoint((*TO, 1))[:3])
    camera.SetViewUp(*to_grid.MultiplyPoint((*UP, 0))[:3])
    camera.SetViewAngle(FOV)
    renderer.ResetCameraClippingRange()
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*SIZE)
    window.AddRenderer(renderer)
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(out)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()
    print(contour, time.process_time() - begin)


def vector(v):
    return ",".join(str(x) for x in v)


VIEW = ["--size", "x".join(map(str, SIZE)), "--from", vector(FROM), "--to", vector(TO), "--up", vector(UP),
        "--fov", str(FOV), "--samples", "1"]


def our_picture(levelsmith, head, value, out, options):
    """CPU seconds of the whole process."""
    before = os.times()
    subprocess.run([levelsmith, "-q", "--threads", "1", "read", head, "!", "render", out, "--isovalue", str(value), *VIEW,
                    *options], check=True, stderr=subprocess.DEVNULL)
    after = os.times()
    return after.children_user - before.children_user + after.children_system - before.children_system


def mesh_picture(levelsmith, head, value, out, report):
    """CPU seconds of Embree's picture of a mesh of the same surface, without reading and the mesh."""
    subprocess.run([levelsmith, "-q", "--threads", "1", "--report", report, "read", head, "!", "isosurface-mesh", str(value),
                    "--border", "open", "!", "render", out, *VIEW, "--style", "tone"], check=True, stderr=subprocess.DEVNULL)
    steps = json.loads(report.read_text())["steps"]
    return next(s["cpu_s"] for s in steps if s["action"] == "render")


def main(levelsmith, head, keep=None):
    is_good = True
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(keep or name)
        print(f"{pathlib.Path(head).name}, {SIZE[0]}x{SIZE[1]}: CPU seconds from the file to a picture")
        for value in (40.5, 100.5):
            theirs = {}
            for method in ("flying-edges", "gpu-isosurface", "fixed-point"):
                runs = [list(map(float, subprocess.run(
                    [sys.executable, __file__, "--vtk", method, head, str(value), folder / f"{method}-{value}.png"],
                    check=True, capture_output=True, text=True).stdout.split())) for _ in range(RUNS)]
                theirs[method] = min(run[1] for run in runs)
                if method == "flying-edges":
                    contour = min(run[0] for run in runs)
            theirs["flying edges, picture by Embree"] = contour + min(
                mesh_picture(levelsmith, head, value, folder / f"mesh-{value}.png", folder / "report.json")
                for _ in range(RUNS))
            for method, seconds in theirs.items():
                print(f"  {value} {method:32} {seconds:6.2f}")
            for filter in ("trilinear", "tricubic", "cubic-c1"):
                for style in ("tone", "lit"):
                    ours = min(our_picture(levelsmith, head, value, folder / f"{filter}-{style}-{value}.png",
                                           ["--filter", filter, "--style", style]) for _ in range(RUNS))
                    is_bound = filter == "trilinear" and style == "tone"
                    is_good &= not is_bound or ours <= MOST * theirs["gpu-isosurface"]
                    ratios = "".join(f"  {ours / seconds:5.2f}" for seconds in theirs.values())
                    print(f"  {value} Levelsmith, {filter}, {style:20} {ours:6.2f}  ratios{ratios}"
                          + (f"  bound of the second <= {MOST}" if is_bound else ""))
    return 0 if is_good else 1


if __name__ == "__main__":
    if sys.argv[1] == "--vtk":
        vtk_picture(sys.argv[2], sys.argv[3], float(sys.argv[4]), sys.argv[5])
    else:
        sys.exit(main(*sys.argv[1:]))
