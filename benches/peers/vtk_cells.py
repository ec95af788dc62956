#!/usr/bin/env python3
"""Unstructured meshes, Voxsplat's native cells beside VTK's two mappers: see README.md in this folder.

Run with any Python 3.10 or later; it makes its own virtual environment under target/peers, or takes
the one that --environment names.
"""

import argparse
import concurrent.futures.process
import json
import multiprocessing
import os
import pathlib
import platform
import resource
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(HERE))
import vtk_frontier  # noqa: E402

# Cubes along each axis of the made mesh, six tetrahedra each.
CUBES = 55
# How far its points are moved, in edges of a cube, along each axis, but for the look LOBES.
JITTER = 0.15
# The linear field: 0.5 + GRADIENT . x, within [0, 1] over the cube [-1, 1]^3.
GRADIENT = (0.25, -0.15, 0.1)
# The greatest opacity, per unit distance. VTK's mappers take opacity over unit distance for extinction,
# Voxsplat -log1p(-opacity): so small an opacity is as good as both.
TOP = 1e-3
# Extinction at the greatest opacity, per world unit of the made mesh.
EXTINCTION = {"peak": 2.5, "comb": 1.5, "lobes": 3.0}
# Opacity over value, as shares of TOP, linear between.
LOOKS = {
    "peak": [(0.0, 0.0), (0.3, 0.0), (0.5, 1.0), (0.7, 0.0), (1.0, 0.0)],
    "comb": [(t / 40.0, float(t % 2)) for t in range(41)],
    "lobes": [(0.0, 0.0), (0.25, 0.0), (0.5, 1.0), (0.75, 0.0), (1.0, 0.0)],
}
# The look whose field is not linear over the whole mesh: Marschner and Lobb's at the points, linear within
# each tetrahedron. Intervals of a ray of its exact picture.
LOBES, LOBES_STEPS = "lobes", 2048
# Files without an exact picture: path, field, whether its values are of cells, extinction at the
# field's greatest value per half diagonal of the mesh. Opacity rises from the least value to it.
FILES = {
    "can": ("can.vtu", "EQPS", True, 40.0),
    "disk_out_ref": ("disk_out_ref.ex2", "Temp", False, 8.0),
    "bluntfin": ("derived/bluntfin_tets.vtu", "Density", False, 8.0),
}
SLABS = (0.5, 1.0, 2.0, 4.0)
# VTK's ray integrators, None for its own choice, and its projected tetrahedra.
RAY_CASTERS = {
    "default": None,
    "partial": "vtkUnstructuredGridPartialPreIntegration",
    "linear": "vtkUnstructuredGridLinearRayIntegrator",
}
PROJECTED = "projected"
# Runs a command and says its peak memory in KiB. A child's peak begins with that of the process that
# starts it, so that one is small.
STARTER = """import os, resource, sys
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ)
status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(min(abs(status), 255))"""


def mesh(cubes, jitter):
    """Points and tetrahedra of the made mesh.

    Every cube is split along the same diagonal (Kuhn). A point moves along an axis only where it is not
    at the cube's end of that axis, so that the mesh fills [-1, 1]^3 exactly.
    """
    import itertools

    import numpy as np

    index = np.stack(np.meshgrid(*[np.arange(cubes + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    inner = (index > 0) & (index < cubes)
    moved = np.random.default_rng(7).uniform(-jitter, jitter, index.shape) * inner
    points = ((index + moved) * (2.0 / cubes) - 1.0).astype(np.float32)
    weights = np.array([(cubes + 1) ** 2, cubes + 1, 1])
    first = (index[(index < cubes).all(axis=1)] @ weights)[:, None]
    parts = []
    for axes in itertools.permutations(range(3)):
        corners = np.concatenate([[0], np.cumsum(weights[list(axes)])])
        # The odd permutations are mirrored.
        if np.linalg.det(np.eye(3)[list(axes)]) < 0.0:
            corners = corners[[0, 2, 1, 3]]
        parts.append(first + corners)
    # Neighbours in the file are neighbours in space, as mesh generators leave them.
    cells = np.stack(parts, axis=1).reshape(-1, 4)
    a, b, c, d = (points[cells[:, k]].astype(np.float64) for k in range(4))
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) > 0.0).all(), "a tetrahedron is inverted"
    return points, cells


def write_mesh(path, cubes, look):
    """Writes the made mesh and a look's field as a raw, uncompressed .vtu."""
    import numpy as np
    import vtk
    from vtk.util import numpy_support

    import fields

    points, cells = mesh(cubes, 0.0 if look == LOBES else JITTER)
    at = points.astype(np.float64)
    values = fields.marschner_lobb(*at.T) if look == LOBES else 0.5 + at @ np.array(GRADIENT)
    values = values.astype(np.float32)
    grid = vtk.vtkUnstructuredGrid()
    held = vtk.vtkPoints()
    held.SetData(numpy_support.numpy_to_vtk(points, deep=True))
    grid.SetPoints(held)
    table = vtk.vtkCellArray()
    table.SetData(4, numpy_support.numpy_to_vtkIdTypeArray(np.ascontiguousarray(cells.ravel()), deep=True))
    grid.SetCells(vtk.VTK_TETRA, table)
    array = numpy_support.numpy_to_vtk(values, deep=True)
    array.SetName("f")
    grid.GetPointData().SetScalars(array)
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToNone()
    if not writer.Write():
        raise SystemExit(f"VTK did not write {path}")


def read_grid(path, field):
    """VTK's unstructured grid of a file, tetrahedra alone, and the ms of reading and of splitting."""
    import vtk

    start = time.perf_counter()
    if path.suffix == ".ex2":
        reader = vtk.vtkExodusIIReader()
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        reader.SetPointResultArrayStatus(field, 1)
        reader.Update()
        grid = reader.GetOutput().GetBlock(0).GetBlock(0)
    else:
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(path))
        reader.Update()
        grid = reader.GetOutput()
    read = time.perf_counter()
    if not grid.IsHomogeneous() or grid.GetCellType(0) != vtk.VTK_TETRA:
        split = vtk.vtkDataSetTriangleFilter()
        split.TetrahedraOnlyOn()
        split.SetInputData(grid)
        split.Update()
        grid = split.GetOutput()
    return grid, 1e3 * (read - start), 1e3 * (time.perf_counter() - read)


def framed(bounds):
    """The view's middle, half height and greatest depth for VTK's (x0, x1, y0, y1, z0, z1)."""
    import itertools

    import numpy as np

    import fields

    pairs = np.array(bounds, np.float64).reshape(3, 2)
    centre = pairs.mean(axis=1)
    corners = np.array(list(itertools.product(*pairs))) - centre
    right, up, _ = fields.camera_axes()
    scale = 1.05 * float(max(np.abs(corners @ right).max(), np.abs(corners @ up).max()))
    return [float(v) for v in centre], scale, float(np.linalg.norm(corners[0]))


def made_scene(cubes, look, path):
    centre, scale, reach = framed((-1.0, 1.0) * 3)
    return {
        "scene": look, "cubes": cubes, "path": path, "field": "f", "of_cells": False,
        "centre": centre, "scale": scale, "reach": reach,
        "opacity": [(value, TOP * share) for value, share in LOOKS[look]],
        "unit_distance": TOP / EXTINCTION[look],
    }  # fmt: skip


def file_scene(name, data):
    """The scene of a file: VTK reads it for its bounds and its range of values."""
    path, field, of_cells, extinction = FILES[name]
    grid, _, _ = read_grid(data / path, field)
    centre, scale, reach = framed(grid.GetBounds())
    values = (grid.GetCellData() if of_cells else grid.GetPointData()).GetArray(field)
    low, high = values.GetRange()
    return {
        "scene": name, "path": data / path, "field": field, "of_cells": of_cells,
        "centre": centre, "scale": scale, "reach": reach,
        "opacity": [(low, 0.0), (high, TOP)],
        "unit_distance": TOP * reach / extinction,
    }  # fmt: skip


def rays(scene):
    """The foot of each pixel centre's ray, row 0 at the top, and where it enters and leaves the cube."""
    import numpy as np

    import fields

    right, up, forward = fields.camera_axes()
    at = scene["scale"] * ((2.0 * np.arange(fields.SIZE) + 1.0) / fields.SIZE - 1.0)
    foot = at[None, :, None] * right - at[:, None, None] * up
    near, far = np.sort([(-1.0 - foot) / forward, (1.0 - foot) / forward], axis=0)
    near = near.max(axis=-1)
    return foot, near, np.maximum(far.min(axis=-1), near)


def exact_linear(scene, nodes):
    """The exact picture of the linear field: opacity of shape (SIZE, SIZE).

    Along a ray the field is linear: the optical depth is the integral of the extinction over the values
    from where the ray enters the cube to where it leaves it, over the field's slope. Gauss-Legendre
    with `nodes` nodes between the corners of the transfer function, where the extinction is smooth.
    """
    import numpy as np

    import fields

    foot, near, far = rays(scene)
    slope = float(np.dot(GRADIENT, fields.camera_axes()[2]))
    middle = 0.5 + foot @ np.array(GRADIENT)
    low, high = np.sort([middle + slope * near, middle + slope * far], axis=0)
    depth = np.zeros_like(low)
    for (v0, a0), (v1, a1) in zip(scene["opacity"], scene["opacity"][1:]):
        begin, end = np.clip(low, v0, v1), np.clip(high, v0, v1)
        for x, w in zip(*np.polynomial.legendre.leggauss(nodes)):
            value = begin + (0.5 + 0.5 * x) * (end - begin)
            alpha = a0 + (a1 - a0) * (value - v0) / (v1 - v0)
            depth -= 0.5 * w * (end - begin) * np.log1p(-alpha)
    return -np.expm1(-depth / (abs(slope) * scene["unit_distance"]))


def exact_lobes(scene, steps):
    """The exact picture of LOBES: opacity of shape (SIZE, SIZE), by the midpoint rule in `steps` intervals.

    A cube's tetrahedra are the orders of a point's coordinates in it: from the least corner, the value
    changes by the edge of the greatest coordinate first.
    """
    import numpy as np

    import fields

    cubes = scene["cubes"]
    axis = (np.arange(cubes + 1) * (2.0 / cubes) - 1.0).astype(np.float32).astype(np.float64)
    values = fields.marschner_lobb(*np.meshgrid(axis, axis, axis, indexing="ij"))
    values = values.astype(np.float32).astype(np.float64).ravel()
    weights = np.array([(cubes + 1) ** 2, cubes + 1, 1])
    foot, near, far = rays(scene)
    forward = fields.camera_axes()[2]
    corners, opacities = np.array(scene["opacity"]).T
    picture = np.zeros(near.shape)
    for row in range(len(picture)):
        hit = np.nonzero(far[row] > near[row])[0]
        length = far[row, hit] - near[row, hit]
        t = near[row, hit, None] + length[:, None] * ((np.arange(steps) + 0.5) / steps)
        part = (foot[row, hit, None, :] + t[:, :, None] * forward + 1.0) * (0.5 * cubes)
        cube = np.clip(np.floor(part), 0, cubes - 1).astype(np.int64)
        part -= cube
        corner = cube @ weights
        value = values[corner]
        order = np.argsort(-part, axis=-1)
        before = value
        for k in range(3):
            which = order[:, :, k]
            corner = corner + weights[which]
            after = values[corner]
            value = value + (after - before) * np.take_along_axis(part, which[:, :, None], axis=-1)[:, :, 0]
            before = after
        depth = -np.log1p(-np.interp(value, corners, opacities)).sum(axis=1) * length / steps
        picture[row, hit] = -np.expm1(-depth / scene["unit_distance"])
    return picture


def exact(scene, work):
    """The exact picture of a made scene, and its RMSE to one by half as many nodes or steps."""
    import numpy as np

    if scene["scene"] != LOBES:
        pictures = [exact_linear(scene, nodes) for nodes in (4, 8)]
    else:
        path = work / f"exact-lobes-{scene['cubes']}-{LOBES_STEPS}.npy"
        if not path.exists():
            np.save(path, [exact_lobes(scene, LOBES_STEPS // 2), exact_lobes(scene, LOBES_STEPS)])
        pictures = np.load(path)
    return pictures[1], float(np.sqrt(np.mean((pictures[1] - pictures[0]) ** 2)))


class Mapper(vtk_frontier.Vtk):
    """One window and one mesh of VTK, with the scene's camera and transfer function."""

    def __init__(self, grid, scene, mode):
        import numpy as np
        import vtk

        import fields

        if mode == PROJECTED:
            mapper = vtk.vtkProjectedTetrahedraMapper()
        else:
            mapper = vtk.vtkUnstructuredGridVolumeRayCastMapper()
            mapper.SetAutoAdjustSampleDistances(0)
            mapper.SetImageSampleDistance(1.0)
            if RAY_CASTERS[mode] is not None:
                mapper.SetRayIntegrator(getattr(vtk, RAY_CASTERS[mode])())
        mapper.SetInputData(grid)
        if scene["of_cells"]:
            mapper.SetScalarModeToUseCellFieldData()
        else:
            mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectScalarArray(scene["field"])
        opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
        for value, alpha in scene["opacity"]:
            # What VTK divides by the unit distance is the extinction itself. One at the top: projected
            # tetrahedra round to 8 bits.
            opacity.AddPoint(value, np.log1p(-alpha) / np.log1p(-TOP))
            # The integrators take the corners of the colours alone for those of the opacities, too.
            colour.AddRGBPoint(value, 1.0, 1.0, 1.0)
        prop = vtk.vtkVolumeProperty()
        prop.SetScalarOpacity(opacity)
        prop.SetColor(colour)
        prop.SetScalarOpacityUnitDistance(scene["unit_distance"] / -np.log1p(-TOP))
        prop.ShadeOff()
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(prop)
        renderer = vtk.vtkRenderer()
        renderer.SetBackground(0.0, 0.0, 0.0)
        renderer.AddVolume(volume)
        away = 3.0 * scene["reach"]
        self.camera = renderer.GetActiveCamera()
        self.camera.ParallelProjectionOn()
        self.camera.SetParallelScale(scene["scale"])
        self.camera.SetFocalPoint(*scene["centre"])
        self.camera.SetPosition(*(np.array(scene["centre"]) - away * fields.camera_axes()[2]))
        self.camera.SetViewUp(*fields.VIEW_UP)
        if mode != PROJECTED:
            # The ray caster's rays pass through corners of pixels: the view moves by half a pixel.
            self.camera.SetWindowCenter(1.0 / fields.SIZE, 1.0 / fields.SIZE)
        self.camera.SetClippingRange(away - 1.1 * scene["reach"], away + 1.1 * scene["reach"])
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(fields.SIZE, fields.SIZE)
        self.window.AddRenderer(renderer)
        self.mapper = mapper

    def draw(self):
        """Milliseconds of one picture, finished."""
        start = time.perf_counter()
        self.window.Render()
        self.window.WaitForCompletion()
        return 1e3 * (time.perf_counter() - start)


def run_vtk(scene, mode, repeat):
    """The row of one of VTK's modes on one scene, its picture and its renderer; in a process of its own."""
    import vtk

    before = own_peak_mib()
    grid, read_ms, split_ms = read_grid(scene["path"], scene["field"])
    drawn = Mapper(grid, scene, mode)
    first = drawn.draw()
    picture = drawn.picture()
    times = []
    for _ in range(repeat):
        drawn.camera.Azimuth(1.0)
        times.append(drawn.draw())
    renderer = [
        line.split(":", 1)[1].strip()
        for line in drawn.window.ReportCapabilities().splitlines()
        if line.startswith("OpenGL renderer")
    ]
    row = {
        "program": "vtk-projected" if mode == PROJECTED else "vtk-ray-cast",
        "mode": mode,
        "tetrahedra": grid.GetNumberOfCells(),
        "load_ms": round(read_ms + split_ms, 1),
        "of_that_splitting_ms": round(split_ms, 1),
        "first_ms": round(first, 1),
        **vtk_frontier.timed(times),
        "peak_mib": own_peak_mib(),
        "peak_mib_before": before,
    }
    if mode != PROJECTED:
        row["threads"] = drawn.mapper.GetNumberOfThreads()
    drawn.window.Finalize()
    return row, picture, (renderer or ["unknown"])[0], vtk.vtkVersion.GetVTKVersion()


def own_peak_mib():
    return round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)


def apart(function, *arguments):
    """What a function returns in a fresh process, so that its memory is its own."""
    fresh = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=fresh) as pool:
        return pool.submit(function, *arguments).result()


def run_voxsplat(binary, scene, slabs, repeat):
    """The row of one number of slabs on one scene, its picture and its adapter."""
    import numpy as np
    import OpenEXR

    import fields

    numbers = lambda values: ",".join(repr(float(v)) for v in values)
    points = [(float(v), float(a)) for v, a in scene["opacity"]]
    with tempfile.TemporaryDirectory() as folder:
        out, stats = pathlib.Path(folder) / "p.exr", pathlib.Path(folder) / "s.json"
        command = [
            str(binary), "render", str(scene["path"]), "--output", str(out), "--stats", str(stats),
            "--engine", "native", "--kernel", "cells", "--classify", "pre-integrated",
            "--field", scene["field"], "--shading", "none",
            "--resolution", f"{fields.SIZE},{fields.SIZE}",
            "--camera-direction", numbers(fields.DIRECTION),
            "--camera-view-up", numbers(fields.VIEW_UP),
            "--camera-focal-point", numbers(scene["centre"]),
            "--parallel-scale", repr(scene["scale"]),
            "--opacity", ",".join(f"{v!r}:{a!r}" for v, a in points),
            "--opacity-unit-distance", repr(scene["unit_distance"]),
            "--color", f"{points[0][0]!r}:ffffff,{points[-1][0]!r}:ffffff", "--background", "000000",
            "--slabs-per-voxel", repr(slabs), "--repeat", str(repeat),
        ]  # fmt: skip
        starter = [sys.executable, "-I", "-S", "-c", STARTER]
        start = time.perf_counter()
        done = subprocess.run([*starter, *command], capture_output=True, text=True)
        process_ms = 1e3 * (time.perf_counter() - start)
        if done.returncode != 0:
            raise SystemExit(f"voxsplat failed: {done.stderr.strip()}\n{' '.join(command)}")
        with OpenEXR.File(str(out)) as file:
            pixels = np.asarray(file.channels()["RGBA"].pixels, np.float64)
        known = json.loads(stats.read_text())
    row = {
        "program": "voxsplat",
        "mode": f"{slabs:g} slabs",
        "slabs_per_voxel": slabs,
        "slab_thickness": known["plan"]["slab_thickness"],
        "load_ms": round(known["load_ms"], 1),
        "first_ms": round(known["frame_ms"][0], 1),
        **vtk_frontier.timed(known["frame_ms"][1:]),
        "process_ms": round(process_ms, 1),
        "peak_mib": round(int(done.stdout.split()[-1]) / 1024.0),
    }
    return row, pixels[:, :, 0], known["adapter"]


def run_scene(scene, options, adapters):
    """All rows of one scene, VTK's modes that crashed, and what is known of the scene."""
    import numpy as np

    import fields

    truth, kept = None, {}
    if "cubes" in scene:
        truth, own = apart(exact, scene, options.work)
        print(f"{scene['scene']}: mean opacity {truth.mean():.3f}, exact to {own:.1e}", flush=True)
        kept = {"mean_opacity": round(float(truth.mean()), 4), "exact_rmse": own}
    rows, failed, found = [], [], {}
    about = {k: scene[k] for k in ("scene", "cubes") if k in scene}

    def add(row, picture):
        if truth is not None:
            row.update(vtk_frontier.measured(picture, truth))
        rounded = np.rint(np.clip(picture, 0.0, 1.0) * 255.0) / 255.0
        # 200 where two pictures are the same: JSON has no infinity.
        row["psnr_to"] = {
            mode: 200.0 if np.array_equal(rounded, other) else round(fields.psnr(rounded, other), 2)
            for mode, other in found.items()
        }
        row["mean"] = round(float(picture.mean()), 5)
        found[row["mode"]] = rounded
        rows.append({**about, **row})
        print({k: v for k, v in rows[-1].items() if k != "frame_ms_all"}, flush=True)
        if options.pictures:
            name = f"{scene['scene']}-{scene.get('cubes', 'file')}-{row['program']}-{row['mode']}.pgm"
            save_picture(options.pictures / name.replace(" ", "-"), picture)

    for mode in (*RAY_CASTERS, PROJECTED):
        # Values of cells are for VTK's own choice of integrator alone.
        if mode not in options.vtk or (scene["of_cells"] and RAY_CASTERS.get(mode)):
            continue
        try:
            row, picture, adapters["vtk"], adapters["vtk_version"] = apart(
                run_vtk, scene, mode, options.repeat
            )
            add(row, picture)
        except concurrent.futures.process.BrokenProcessPool:
            failed.append({**about, "mode": mode})
            print(f"VTK crashed: {failed[-1]}", flush=True)
    # The finest first: the others are held to it.
    for slabs in sorted(options.slabs, reverse=True):
        row, picture, adapters["voxsplat"] = run_voxsplat(options.voxsplat, scene, slabs, options.repeat)
        add(row, picture)
    if options.pictures and truth is not None:
        save_picture(options.pictures / f"{scene['scene']}-{scene['cubes']}-exact.pgm", truth)
    return rows, failed, kept


def save_picture(path, picture):
    """An 8-bit PGM of a picture of 0 to 1."""
    height, width = picture.shape
    codes = (picture.clip(0.0, 1.0) * 255.0).round().astype("uint8")
    path.write_bytes(f"P5 {width} {height} 255\n".encode() + codes.tobytes())


def ratios(rows):
    """For every row of VTK's: Voxsplat's time over VTK's, at VTK's PSNR or, without, at one slab."""
    out = []
    for peer in rows:
        if peer["program"] == "voxsplat":
            continue
        same = [r for r in rows if (r["scene"], r.get("cubes")) == (peer["scene"], peer.get("cubes"))]
        ours = [r for r in same if r["program"] == "voxsplat"]
        if not ours:
            continue
        if "psnr_db" in peer:
            at = vtk_frontier.time_at(ours, peer["psnr_db"])
        else:
            at = next((r["frame_ms"] for r in ours if r["slabs_per_voxel"] == 1.0), None)
        out.append({
            **{k: peer[k] for k in ("scene", "cubes", "program", "mode", "psnr_db") if k in peer},
            "vtk_ms": peer["frame_ms"],
            "voxsplat_ms": None if at is None else round(at, 1),
            "ratio": None if at is None else round(at / peer["frame_ms"], 2),
        })  # fmt: skip
    return out


def table(results):
    """The results in Markdown."""
    lines = [
        f"VTK {results['versions']['vtk']} ({results['adapters'].get('vtk', 'not run')}), Voxsplat"
        f" {results['adapters'].get('voxsplat', 'not run')}; {results['size'][0]} × {results['size'][1]},"
        f" {results['machine']['cores']} cores, load average {results['load_average'][0]} to"
        f" {results['load_average'][1]}, {results['date']}.",
        "",
        "| scene | tetrahedra | program | mode | load, ms | first, ms | then, ms | peak, MiB | PSNR, dB"
        " | to VTK's ray caster | to its projection | to Voxsplat's finest |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    finest = next((r["mode"] for r in results["rows"] if r["program"] == "voxsplat"), None)
    for row in results["rows"]:
        to = " | ".join(str(row["psnr_to"].get(mode, "–")) for mode in ("default", PROJECTED, finest))
        lines.append(
            f"| {named(row)} | {row.get('tetrahedra', '')} | {row['program']} | {row['mode']}"
            f" | {row['load_ms']:.0f} | {row['first_ms']:.0f} | {row['frame_ms']:.0f} | {row['peak_mib']}"
            f" | {row.get('psnr_db', '–')} | {to} |"
        )
    lines += [f"| {named(row)} | | | {row['mode']} | VTK crashed |" for row in results["crashed"]]
    lines += [
        "",
        "Voxsplat's time over VTK's, at VTK's PSNR where there is an exact picture and at one slab elsewhere:",
        "",
        "| scene | VTK's mode | dB | VTK ms | Voxsplat ms | ratio |",
        "|---|---|---|---|---|---|",
    ]
    for row in results["at_equal_psnr"]:
        none = lambda value, other: other if value is None else value
        lines.append(
            f"| {named(row)} | {row['program']} {row['mode']} | {row.get('psnr_db', '–')}"
            f" | {row['vtk_ms']:.0f} | {none(row['voxsplat_ms'], 'not reached')} | {none(row['ratio'], '–')} |"
        )
    return "\n".join(lines) + "\n"


def named(row):
    return f"{row['scene']}, {row['cubes']}³ cubes" if "cubes" in row else row["scene"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--voxsplat", type=pathlib.Path, default=ROOT / "target/release/voxsplat")
    parser.add_argument("--commit", default="", help="commit of that binary, for the record")
    parser.add_argument("--data", type=pathlib.Path, help="folder of the files; default: $VOXSPLAT_DATA/unstructured, or no files")
    parser.add_argument("--files", nargs="*", default=list(FILES), choices=list(FILES))
    parser.add_argument("--looks", nargs="*", default=list(LOOKS), choices=list(LOOKS))
    parser.add_argument("--cubes", nargs="+", type=int, default=[CUBES], help="cubes along an axis of the made mesh")
    parser.add_argument("--vtk", nargs="*", default=[*RAY_CASTERS, PROJECTED], choices=[*RAY_CASTERS, PROJECTED])
    parser.add_argument("--slabs", nargs="*", type=float, default=list(SLABS))
    parser.add_argument("--repeat", type=int, default=vtk_frontier.REPEAT, help="timed pictures after the first")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "target/peers")
    parser.add_argument("--environment", type=pathlib.Path, help="virtual environment with vtk, numpy and OpenEXR, taken as it is")
    parser.add_argument("--pictures", type=pathlib.Path, help="folder for the pictures, as PGM")
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "benches/results/peers-cells.json")
    options = parser.parse_args()
    if options.data is None and "VOXSPLAT_DATA" in os.environ:
        options.data = pathlib.Path(os.environ["VOXSPLAT_DATA"]) / "unstructured"
    files = options.files if options.data is not None else []
    for needed in (options.voxsplat, *(options.data / FILES[name][0] for name in files)):
        if not needed.is_file():
            parser.error(f"expected a file, found none; build it or name another: {needed}")
    options.work.mkdir(parents=True, exist_ok=True)
    if options.environment is None:
        vtk_frontier.enter_environment(options.work / "venv")
    elif pathlib.Path(sys.prefix).resolve() != options.environment.resolve():
        python = str(options.environment / "bin" / "python")
        os.execv(python, [python, *sys.argv])
    # Off screen, without an X server.
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import fields

    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    # VTK is never loaded here, nor anything large kept, so that other processes begin small.
    scenes = []
    for cubes in options.cubes:
        for look in options.looks:
            path = options.work / f"kuhn-{cubes}-{'lobes' if look == LOBES else 'linear'}.vtu"
            if not path.exists():
                apart(write_mesh, path, cubes, look)
            scenes.append(made_scene(cubes, look, path))
    scenes += [apart(file_scene, name, options.data) for name in files]
    rows, crashed, adapters, kept = [], [], {}, {}
    for scene in scenes:
        more, failed, about = run_scene(scene, options, adapters)
        rows += more
        crashed += failed
        kept[named(scene)] = {
            **{k: scene[k] for k in ("field", "centre", "scale", "opacity", "unit_distance")},
            **about,
        }
    loads = [row["load_average"] for row in rows]
    results = {
        "date": time.strftime("%Y-%m-%d", time.gmtime()),
        "machine": {"cores": os.cpu_count(), "system": platform.system()},
        "load_average": [min(loads), max(loads)],
        "versions": {"vtk": adapters.pop("vtk_version", None), "voxsplat": options.commit},
        "adapters": adapters,
        "size": [fields.SIZE, fields.SIZE],
        "camera_direction": [float(v) for v in fields.DIRECTION],
        "gradient": GRADIENT,
        "jitter": JITTER,
        "scenes": kept,
        "rows": rows,
        "crashed": crashed,
        "at_equal_psnr": ratios(rows),
    }
    options.output.write_text(json.dumps(results, indent=1) + "\n")
    print(table(results))


if __name__ == "__main__":
    main()
