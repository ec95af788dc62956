#!/usr/bin/env python3
"""Quick pictures while a hand drags, VTK's ray caster beside Voxsplat: see README.md in this folder.

Run with any Python 3.10 or later; it makes its own virtual environment under target/peers, or takes
the one that --environment names.
"""

import argparse
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SIZE = (1280, 800)
DIRECTION = (0.45, 0.75, -0.48)
VIEW_UP = (0.0, 0.0, 1.0)
# Half the picture's height over the length of the volume's diagonal.
SCALE = 0.38
# Milliseconds allotted to a quick picture.
VTK_BUDGETS = (57.0, 33.0)
VOXSPLAT_BUDGETS = (57.0, 33.0, 20.0)
# Pictures until VTK's sample distances have settled, and timed ones; the camera turns by 1 degree each.
SETTLE, REPEAT = 12, 8
# Still pictures that are timed, after one that is not.
STILLS = 3
# Opacity per smallest spacing, and colours, piecewise linear over the files' own values.
SCANS = {
    "aneurism": {
        "opacity": [(40, 0.0), (110, 0.25), (255, 0.8)],
        "colour": [(40, "8c1f16"), (140, "e08a4c"), (255, "fff3e0")],
    },
    "LIDC2": {
        "opacity": [(60, 0.0), (120, 0.02), (170, 0.25), (255, 0.7)],
        "colour": [(60, "304a8c"), (130, "c8705c"), (200, "f0d8b0"), (255, "ffffff")],
    },
    "bonsai": {
        "opacity": [(25, 0.0), (45, 0.06), (90, 0.1), (150, 0.5), (255, 0.8)],
        "colour": [(25, "2c6e2c"), (70, "7ab04a"), (120, "9c6a3c"), (255, "f4e4c8")],
    },
}


def rgb(code):
    """Display values of a hexadecimal colour, 0 to 1."""
    return [int(code[i : i + 2], 16) / 255.0 for i in (0, 2, 4)]


def decoded(display):
    """Linear light of sRGB display values, 0 to 1."""
    import numpy as np

    return np.where(display <= 0.04045, display / 12.92, ((display + 0.055) / 1.055) ** 2.4)


def psnrs(found, exact):
    """PSNR over all pixels and RGB of two pictures in linear light, peak 1, and of their sRGB codes."""
    import fields

    found, exact = found.clip(0.0, 1.0), exact.clip(0.0, 1.0)
    # 200 where two pictures are the same: JSON has no infinity.
    number = lambda value: round(min(float(value), 200.0), 2)
    return {
        "psnr_linear_db": number(fields.psnr(found, exact)),
        "psnr_display_db": number(fields.psnr(fields.encoded(found), fields.encoded(exact))),
    }


class Caster:
    """VTK's CPU ray caster on one scan, as it stands while a window is dragged and at rest."""

    def __init__(self, path, scan):
        import numpy as np
        import vtk

        reader = vtk.vtkXMLImageDataReader()
        reader.SetFileName(str(path))
        reader.Update()
        self.image = reader.GetOutput()
        spacing = self.image.GetSpacing()
        dims = self.image.GetDimensions()
        self.unit_distance = min(spacing)
        self.centre = self.image.GetCenter()
        self.scale = SCALE * float(np.linalg.norm(np.multiply(spacing, dims)))
        self.mapper = vtk.vtkFixedPointVolumeRayCastMapper()
        self.mapper.SetInputData(self.image)
        self.mapper.SetBlendModeToComposite()
        self.mapper.SetAutoAdjustSampleDistances(1)
        # Half a spacing at rest, a whole one while dragged.
        self.mapper.SetLockSampleDistanceToInputSpacing(1)
        opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
        for value, alpha in scan["opacity"]:
            opacity.AddPoint(value, alpha)
        for value, code in scan["colour"]:
            colour.AddRGBPoint(value, *rgb(code))
        prop = vtk.vtkVolumeProperty()
        prop.SetScalarOpacity(opacity)
        prop.SetColor(colour)
        prop.SetScalarOpacityUnitDistance(self.unit_distance)
        prop.SetInterpolationTypeToLinear()
        prop.ShadeOff()
        volume = vtk.vtkVolume()
        volume.SetMapper(self.mapper)
        volume.SetProperty(prop)
        renderer = vtk.vtkRenderer()
        renderer.SetBackground(0.0, 0.0, 0.0)
        renderer.AddVolume(volume)
        self.camera = renderer.GetActiveCamera()
        far = 4.0 * self.scale
        unit = np.asarray(DIRECTION) / np.linalg.norm(DIRECTION)
        self.camera.ParallelProjectionOn()
        self.camera.SetParallelScale(self.scale)
        self.camera.SetFocalPoint(*self.centre)
        self.camera.SetPosition(*(np.asarray(self.centre) - far * unit))
        self.camera.SetViewUp(*VIEW_UP)
        renderer.ResetCameraClippingRange()
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(*SIZE)
        self.window.AddRenderer(renderer)

    def draw(self, budget_ms):
        """Milliseconds of one picture, finished; without a budget as at rest."""
        # 0.0001 is what VTK's own interactors ask for at rest.
        self.window.SetDesiredUpdateRate(0.0001 if budget_ms is None else 1e3 / budget_ms)
        start = time.perf_counter()
        self.window.Render()
        self.window.WaitForCompletion()
        return 1e3 * (time.perf_counter() - start)

    def picture(self):
        """The picture's linear light, (rows from the top, columns, RGB)."""
        import vtk
        from vtk.util import numpy_support

        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.SetInputBufferTypeToRGB()
        grab.ReadFrontBufferOff()
        grab.ShouldRerenderOff()
        grab.Update()
        shown = grab.GetOutput().GetPointData().GetScalars()
        pixels = numpy_support.vtk_to_numpy(shown).reshape(SIZE[1], SIZE[0], 3)
        return decoded(pixels[::-1] / 255.0)


def vtk_rows(name, scan, path):
    """VTK's rows on one scan, its still picture, and what Voxsplat needs to draw the same view."""
    caster = Caster(path, scan)
    frames = []
    for budget in VTK_BUDGETS:
        caster.camera.Azimuth(-float(SETTLE))
        for _ in range(SETTLE):
            caster.draw(budget)
            caster.camera.Azimuth(1.0)
        quick = []
        for _ in range(REPEAT):
            ms = caster.draw(budget)
            quick.append((ms, caster.picture(), caster.mapper.GetImageSampleDistance()))
            caster.camera.Azimuth(1.0)
        caster.camera.Azimuth(-float(REPEAT))
        frames.append((budget, quick))
    # The same views at rest.
    stills, still_ms = [], []
    caster.draw(None)
    for turn in range(REPEAT):
        ms = caster.draw(None)
        stills.append(caster.picture())
        if turn < STILLS:
            still_ms.append(ms)
        caster.camera.Azimuth(1.0)
    rows = [{
        "program": "vtk-cpu",
        "picture": "still",
        **timed(still_ms),
        "image_sample_distance": round(caster.mapper.GetImageSampleDistance(), 2),
    }]  # fmt: skip
    for budget, quick in frames:
        errors = [psnrs(found, exact) for (_, found, _), exact in zip(quick, stills)]
        rows.append({
            "program": "vtk-cpu",
            "picture": "quick",
            "budget_ms": budget,
            **timed([ms for ms, _, _ in quick]),
            "image_sample_distance": round(statistics.median(d for _, _, d in quick), 2),
            "against_own_still": {
                key: round(statistics.median(e[key] for e in errors), 2) for key in errors[0]
            },
        })  # fmt: skip
    shown = {"centre": caster.centre, "scale": caster.scale, "unit": caster.unit_distance}
    caster.window.Finalize()
    return [{"scan": name, **row} for row in rows], stills[0], shown


def timed(times):
    return {
        "frame_ms": round(statistics.median(times), 1),
        "frame_ms_all": [round(t, 1) for t in times],
        "load_average": round(os.getloadavg()[0], 1),
    }


def voxsplat(binary, path, scan, shown, more, repeat):
    """One of Voxsplat's pictures in linear light, and its statistics."""
    import numpy as np
    import OpenEXR

    numbers = lambda values: ",".join(repr(float(v)) for v in values)
    with tempfile.TemporaryDirectory() as folder:
        out, stats = pathlib.Path(folder) / "p.exr", pathlib.Path(folder) / "s.json"
        command = [
            str(binary), "render", str(path), "--output", str(out), "--stats", str(stats),
            "--resolution", f"{SIZE[0]},{SIZE[1]}",
            "--camera-direction", numbers(DIRECTION),
            "--camera-view-up", numbers(VIEW_UP),
            "--camera-focal-point", numbers(shown["centre"]),
            "--parallel-scale", repr(shown["scale"]),
            "--opacity", ",".join(f"{v}:{a!r}" for v, a in scan["opacity"]),
            "--color", ",".join(f"{v}:{code}" for v, code in scan["colour"]),
            "--opacity-unit-distance", repr(float(shown["unit"])),
            "--background", "000000", "--repeat", str(repeat), *more,
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"voxsplat failed: {done.stderr.strip()}\n{' '.join(command)}")
        with OpenEXR.File(str(out)) as file:
            channels = file.channels()
            key = next(k for k in ("RGBA", "RGB") if k in channels)
            pixels = np.asarray(channels[key].pixels, np.float64)
        return pixels[:, :, :3], json.loads(stats.read_text())


def voxsplat_rows(binary, name, scan, path, shown, vtk_still):
    """Voxsplat's rows on one scan, and its adapter."""
    rows, exact = [], {}
    for kernel, flags in (("bspline", []), ("linear", ["--kernel", "linear"])):
        exact[kernel], said = voxsplat(binary, path, scan, shown, flags, STILLS)
        rows.append({
            "program": "voxsplat",
            "picture": "still",
            "kernel": kernel,
            **timed(said["frame_ms"][1:]),
            "against_vtk_still": psnrs(exact[kernel], vtk_still),
        })  # fmt: skip
    for budget in VOXSPLAT_BUDGETS:
        flags = ["--refine", "coarse", "--budget-ms", repr(budget)]
        quick, said = voxsplat(binary, path, scan, shown, flags, REPEAT)
        rows.append({
            "program": "voxsplat",
            "picture": "quick",
            "budget_ms": budget,
            **timed(said["frame_ms"][1:]),
            "drawn_resolution": said["drawn_resolution"],
            "octree_nodes": said["octree_nodes"],
            "against_own_still": psnrs(quick, exact["bspline"]),
            "against_linear_still": psnrs(quick, exact["linear"]),
        })  # fmt: skip
    return [{"scan": name, **row} for row in rows], said["adapter"]


def table(results):
    """The results in Markdown."""
    lines = [
        "# Quick pictures beside VTK's",
        "",
        "Printed by `benches/peers/vtk_previews.py` from `previews.json`; what it compares is in",
        "`benches/peers/README.md`. PSNR in linear light / display-coded, dB, at"
        f" {results['size'][0]} × {results['size'][1]}.",
        f"Measured {results['date']} on {results['machine']['cores']} cores, {results['adapter']};"
        f" load average {results['load_average'][0]} to {results['load_average'][1]}.",
        "",
        "| scan | program | picture | budget, ms | frame, ms | drawn | PSNR to its own still"
        " | PSNR to `--kernel linear` |",
        "|---|---|---|---|---|---|---|---|",
    ]
    both = lambda row, key: (
        f"{row[key]['psnr_linear_db']} / {row[key]['psnr_display_db']}" if key in row else "–"
    )
    for row in results["rows"]:
        drawn = "×".join(str(n) for n in row.get("drawn_resolution", [])) or "–"
        if row.get("octree_nodes"):
            drawn += f", {row['octree_nodes']} nodes"
        if "image_sample_distance" in row:
            drawn = f"every {row['image_sample_distance']} pixels"
        picture = f"{row['picture']}, {row['kernel']}" if "kernel" in row else row["picture"]
        lines.append(
            f"| {row['scan']} | {row['program']} | {picture} | {row.get('budget_ms', '–')}"
            f" | {row['frame_ms']} | {drawn} | {both(row, 'against_own_still')}"
            f" | {both(row, 'against_linear_still')} |"
        )
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--voxsplat", type=pathlib.Path, default=ROOT / "target/release/voxsplat")
    parser.add_argument("--commit", default="", help="commit of that binary, for the record")
    parser.add_argument("--data", type=pathlib.Path, help="folder of the scans; default: $VOXSPLAT_DATA/scalar")
    parser.add_argument("--scans", nargs="+", default=list(SCANS), choices=list(SCANS))
    parser.add_argument("--environment", type=pathlib.Path, help="virtual environment with vtk, numpy and OpenEXR, taken as it is")
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "benches/results/previews.json")
    options = parser.parse_args()
    if options.data is None:
        if "VOXSPLAT_DATA" not in os.environ:
            parser.error("expected --data FOLDER or VOXSPLAT_DATA, found neither; name the folder of the scans")
        options.data = pathlib.Path(os.environ["VOXSPLAT_DATA"]) / "scalar"
    for needed in (options.voxsplat, *(options.data / f"{name}.vti" for name in options.scans)):
        if not needed.is_file():
            parser.error(f"expected a file, found none; build it or name another: {needed}")
    sys.path.insert(0, str(HERE))
    import vtk_frontier

    if options.environment is None:
        vtk_frontier.enter_environment(ROOT / "target/peers/venv")
    elif pathlib.Path(sys.prefix).resolve() != options.environment.resolve():
        python = str(options.environment / "bin" / "python")
        os.execv(python, [python, *sys.argv])
    # Off screen, without an X server.
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import vtk

    rows, adapter = [], ""
    for name in options.scans:
        scan, path = SCANS[name], options.data / f"{name}.vti"
        peers, vtk_still, shown = vtk_rows(name, scan, path)
        ours, adapter = voxsplat_rows(options.voxsplat, name, scan, path, shown, vtk_still)
        for row in peers + ours:
            print({k: v for k, v in row.items() if k != "frame_ms_all"}, flush=True)
        rows += peers + ours
    loads = [row["load_average"] for row in rows]
    results = {
        "date": time.strftime("%Y-%m-%d", time.gmtime()),
        "machine": {"cores": os.cpu_count(), "system": platform.system()},
        "adapter": adapter,
        "load_average": [min(loads), max(loads)],
        "versions": {"vtk": vtk.vtkVersion.GetVTKVersion(), "voxsplat": options.commit},
        "size": SIZE,
        "camera": {"direction": DIRECTION, "view_up": VIEW_UP, "scale_over_diagonal": SCALE},
        "scans": {name: SCANS[name] for name in options.scans},
        "rows": rows,
    }
    options.output.write_text(json.dumps(results, indent=1) + "\n")
    options.output.with_suffix(".md").write_text(table(results))


if __name__ == "__main__":
    main()
