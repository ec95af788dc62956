#!/usr/bin/env python3
"""Time against error, Voxsplat beside VTK's ray casters: see README.md in this folder.

Run with any Python 3.10 or later; it makes its own virtual environment under target/peers.
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
PACKAGES = ["vtk==9.7.2", "numpy", "OpenEXR"]
SIZES = [64, 128, 256]
# Intervals per ray of the exact picture: its own error is stated beside the results.
EXACT_STEPS = {"marschner-lobb": 2048, "blobs": 512}
# Timed pictures after the first, which compiles and uploads; the camera turns by 1 degree for each.
REPEAT = 4
SLABS = (0.5, 1.0, 2.0)


def enter_environment(folder):
    """Installs the packages into `folder` once, and runs this script again in there."""
    python = folder / "bin" / "python"
    if pathlib.Path(sys.prefix).resolve() == folder.resolve():
        return
    if not (folder / "ready").exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
        (folder / "ready").touch()
    os.execv(str(python), [str(python), *sys.argv])


def truth(work, name):
    """The exact picture of a field and its own error, computed once."""
    import numpy as np

    import fields

    steps = EXACT_STEPS[name]
    path = work / f"exact-{name}-{steps}.npz"
    if not path.exists():
        picture, rmse = fields.exact(fields.FIELDS[name], steps)
        np.savez(path, picture=picture, rmse=rmse)
    stored = np.load(path)
    return stored["picture"], float(stored["rmse"])


def measured(picture, exact):
    """The errors of one picture (opacity, float64), as written and after rounding to 8 bits."""
    import numpy as np

    import fields

    rounded = np.rint(np.clip(picture, 0.0, 1.0) * 255.0) / 255.0
    shift = fields.shift_of(picture, exact)
    return {
        "psnr_db": round(fields.psnr(rounded, exact), 2),
        "psnr_float_db": round(fields.psnr(picture, exact), 2),
        "psnr_encoded_db": round(fields.psnr(fields.encoded(rounded), fields.encoded(exact)), 2),
        "shift_px": [round(v, 3) for v in shift],
        "psnr_without_shift_db": round(fields.psnr(rounded, fields.shifted(exact, shift)), 2),
    }


def vtk_image(samples, scalar):
    """A vtkImageData of (z, y, x) samples in the scene's world space."""
    import numpy as np
    import vtk
    from vtk.util import numpy_support

    n = samples.shape[0]
    image = vtk.vtkImageData()
    image.SetDimensions(n, n, n)
    image.SetSpacing(2.0 / n, 2.0 / n, 2.0 / n)
    start = -1.0 + 1.0 / n
    image.SetOrigin(start, start, start)
    kept = np.ascontiguousarray(samples.astype(scalar).ravel())
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(kept, deep=True))
    return image


def read_nrrd(path, n):
    """The samples of a file that `fields.write_nrrd` wrote."""
    import numpy as np

    raw = path.read_bytes()
    return np.frombuffer(raw[-2 * n**3 :], "<u2").reshape(n, n, n)


class Vtk:
    """One window and one volume of VTK, with the scene's camera and transfer function."""

    def __init__(self, image, gpu):
        import vtk

        import fields

        self.mapper = (
            vtk.vtkGPUVolumeRayCastMapper() if gpu else vtk.vtkFixedPointVolumeRayCastMapper()
        )
        self.mapper.SetInputData(image)
        self.mapper.SetBlendModeToComposite()
        self.mapper.SetAutoAdjustSampleDistances(0)
        self.mapper.SetLockSampleDistanceToInputSpacing(0)
        self.mapper.SetImageSampleDistance(1.0)
        if gpu:
            self.mapper.SetUseJittering(0)
        opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
        for value, alpha in fields.PEAK:
            opacity.AddPoint(65535.0 * value, alpha)
        colour.AddRGBPoint(0.0, 1.0, 1.0, 1.0)
        colour.AddRGBPoint(65535.0, 1.0, 1.0, 1.0)
        prop = vtk.vtkVolumeProperty()
        prop.SetScalarOpacity(opacity)
        prop.SetColor(colour)
        prop.SetScalarOpacityUnitDistance(fields.UNIT_DISTANCE)
        prop.SetInterpolationTypeToLinear()
        prop.ShadeOff()
        volume = vtk.vtkVolume()
        volume.SetMapper(self.mapper)
        volume.SetProperty(prop)
        renderer = vtk.vtkRenderer()
        renderer.SetBackground(0.0, 0.0, 0.0)
        renderer.AddVolume(volume)
        self.camera = renderer.GetActiveCamera()
        self.camera.ParallelProjectionOn()
        self.camera.SetParallelScale(fields.PARALLEL_SCALE)
        self.camera.SetFocalPoint(0.0, 0.0, 0.0)
        self.camera.SetPosition(*(-5.0 * fields.camera_axes()[2]))
        self.camera.SetViewUp(*fields.VIEW_UP)
        self.camera.SetClippingRange(2.0, 8.0)
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.window.SetSize(fields.SIZE, fields.SIZE)
        self.window.AddRenderer(renderer)

    def draw(self, distance):
        """Milliseconds of one picture at a sample distance in world units, finished."""
        self.mapper.SetSampleDistance(distance)
        start = time.perf_counter()
        self.window.Render()
        self.window.WaitForCompletion()
        return 1e3 * (time.perf_counter() - start)

    def picture(self):
        """The picture's red channel over 255, row 0 at the top."""
        import vtk
        from vtk.util import numpy_support

        import fields

        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.SetInputBufferTypeToRGB()
        grab.ReadFrontBufferOff()
        grab.ShouldRerenderOff()
        grab.Update()
        shown = grab.GetOutput().GetPointData().GetScalars()
        pixels = numpy_support.vtk_to_numpy(shown).reshape(fields.SIZE, fields.SIZE, 3)
        return pixels[::-1, :, 0] / 255.0


def run_vtk(name, n, path, exact, gpu, steps, scalar):
    """Rows of one of VTK's paths on one grid."""
    caster = Vtk(vtk_image(read_nrrd(path, n), scalar), gpu)
    rows = []
    for step in steps:
        caster.draw(step * 2.0 / n)
        row = {
            "program": "vtk-gpu" if gpu else "vtk-cpu",
            "scalar": scalar,
            "step_voxels": step,
            **measured(caster.picture(), exact),
        }
        times = []
        for _ in range(REPEAT):
            caster.camera.Azimuth(1.0)
            times.append(caster.draw(step * 2.0 / n))
        caster.camera.Azimuth(-float(REPEAT))
        rows.append({"field": name, "grid": n, **row, **timed(times)})
        report(rows[-1])
    adapter = [
        line.split(":", 1)[1].strip()
        for line in caster.window.ReportCapabilities().splitlines()
        if line.startswith("OpenGL renderer")
    ]
    caster.window.Finalize()
    return rows, (adapter or ["unknown"])[0]


def timed(times):
    return {
        "frame_ms": round(statistics.median(times), 1),
        "frame_ms_all": [round(t, 1) for t in times],
        "load_average": round(os.getloadavg()[0], 1),
    }


def run_voxsplat(binary, name, n, path, exact, kernel, slabs, classify, repeat):
    """The row of one of Voxsplat's modes on one grid, and its adapter's name."""
    import numpy as np
    import OpenEXR

    import fields

    numbers = lambda values: ",".join(repr(float(v)) for v in values)
    with tempfile.TemporaryDirectory() as folder:
        out, stats = pathlib.Path(folder) / "p.exr", pathlib.Path(folder) / "s.json"
        command = [
            str(binary), "render", str(path), "--output", str(out), "--stats", str(stats),
            "--resolution", f"{fields.SIZE},{fields.SIZE}",
            "--camera-direction", numbers(fields.DIRECTION),
            "--camera-view-up", numbers(fields.VIEW_UP),
            "--camera-focal-point", "0,0,0",
            "--parallel-scale", repr(fields.PARALLEL_SCALE),
            "--opacity", ",".join(f"{65535.0 * v!r}:{a!r}" for v, a in fields.PEAK),
            "--opacity-unit-distance", repr(fields.UNIT_DISTANCE),
            "--color", "0:ffffff,65535:ffffff", "--background", "000000",
            "--kernel", kernel, "--slabs-per-voxel", repr(slabs), "--classify", classify,
            "--visibility", "slabs", "--repeat", str(repeat),
        ]  # fmt: skip
        if kernel != "linear":
            command += ["--reconstruction", "interpolating"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"voxsplat failed: {done.stderr.strip()}\n{' '.join(command)}")
        with OpenEXR.File(str(out)) as file:
            channels = file.channels()
            key = next(k for k in ("RGBA", "RGB", "R") if k in channels)
            pixels = np.asarray(channels[key].pixels, np.float64)
        said = json.loads(stats.read_text())
    picture = pixels if pixels.ndim == 2 else pixels[:, :, 0]
    row = {
        "field": name,
        "grid": n,
        "program": "voxsplat",
        "kernel": kernel,
        "slabs_per_voxel": slabs,
        "classify": classify,
        **measured(picture, exact),
        **timed(said["frame_ms"][1:]),
    }
    report(row)
    return row, said["adapter"]


def report(row):
    mode = [str(row[k]) for k in ("scalar", "step_voxels", "kernel", "slabs_per_voxel", "classify") if k in row]
    print(
        f"{row['field']:15} {row['grid']:4} {row['program']:9} {' '.join(mode):32}"
        f" {row['frame_ms']:8.1f} ms {row['psnr_db']:6.2f} dB (float {row['psnr_float_db']},"
        f" encoded {row['psnr_encoded_db']}, shift {row['shift_px']},"
        f" without {row['psnr_without_shift_db']})",
        flush=True,
    )


def front(rows):
    """The rows that no other row beats in both time and PSNR, cheapest first."""
    kept = []
    for row in sorted(rows, key=lambda r: (r["frame_ms"], -r["psnr_db"])):
        if not kept or row["psnr_db"] > kept[-1]["psnr_db"]:
            kept.append(row)
    return kept


def time_at(rows, psnr):
    """Milliseconds at a PSNR on a front: log time linear in dB between its points.

    Below the front's first point that point's own time holds (nothing cheaper was measured: its PSNR
    is higher than asked for); above its last point there is none.
    """
    import math

    points = [(r["psnr_db"], r["frame_ms"]) for r in front(rows)]
    if psnr <= points[0][0]:
        return points[0][1]
    for (low, fast), (high, slow) in zip(points, points[1:]):
        if psnr <= high:
            part = (psnr - low) / (high - low)
            return math.exp(math.log(fast) + part * (math.log(slow) - math.log(fast)))
    return None


def ratios(rows):
    """For every point of VTK's: Voxsplat's time at the same PSNR over VTK's; and the gain in dB."""
    out = []
    for name, n in sorted({(r["field"], r["grid"]) for r in rows}):
        here = [r for r in rows if (r["field"], r["grid"]) == (name, n)]
        ours = [r for r in here if r["program"] == "voxsplat"]
        peers = [r for r in here if r["program"] != "voxsplat"]
        if not ours or not peers:
            continue
        for peer in peers:
            at = time_at(ours, peer["psnr_db"])
            out.append({
                "field": name,
                "grid": n,
                "program": peer["program"],
                "scalar": peer["scalar"],
                "step_voxels": peer["step_voxels"],
                "psnr_db": peer["psnr_db"],
                "vtk_ms": peer["frame_ms"],
                "voxsplat_ms": None if at is None else round(at, 1),
                "ratio": None if at is None else round(at / peer["frame_ms"], 2),
                "best_psnr_gain_db": round(
                    max(r["psnr_db"] for r in ours)
                    - max(r["psnr_db"] for r in peers if r["program"] == peer["program"]), 2,
                ),
            })  # fmt: skip
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--voxsplat", type=pathlib.Path, default=ROOT / "target/release/voxsplat")
    parser.add_argument("--commit", default="", help="commit of that binary, for the record")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "target/peers")
    parser.add_argument("--output", type=pathlib.Path, help="JSON; default: benches/results")
    parser.add_argument("--fields", nargs="+", default=["marschner-lobb", "blobs"])
    parser.add_argument("--grids", nargs="+", type=int, default=SIZES)
    parser.add_argument("--only", nargs="+", default=["vtk-cpu", "vtk-gpu", "voxsplat"])
    parser.add_argument("--kernels", nargs="+", default=["linear", "cubic", "bspline"])
    parser.add_argument("--classify", nargs="+", default=["pre-integrated", "after"])
    parser.add_argument("--vtk-scalars", nargs="+", default=["uint16"])
    parser.add_argument("--repeat", type=int, default=REPEAT, help="timed frames of Voxsplat")
    parser.add_argument("--append", action="store_true", help="keep the rows of --output that are not measured again")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    enter_environment(options.work / "venv")
    sys.path.insert(0, str(HERE))
    # Off screen, without an X server.
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    import vtk

    import fields

    rows, own_error, adapters = [], {}, {}
    output = options.output or ROOT / "benches/results/peers-llvmpipe.json"
    if options.append and output.exists():
        before = json.loads(output.read_text())
        rows, own_error, adapters = before["rows"], before["exact_rmse"], before["adapters"]

    def save():
        latest = {key_of(r): r for r in rows}
        kept = sorted(latest.values(), key=lambda r: (r["field"], r["grid"], r["program"]))
        output.write_text(json.dumps({
            "date": time.strftime("%Y-%m-%d", time.gmtime()),
            "machine": {"cores": os.cpu_count(), "system": platform.system()},
            "adapters": adapters,
            "versions": {"vtk": vtk.vtkVersion.GetVTKVersion(), "voxsplat": options.commit},
            "size": [fields.SIZE, fields.SIZE],
            "peak": fields.PEAK,
            "unit_distance": fields.UNIT_DISTANCE,
            "exact_steps": EXACT_STEPS,
            "exact_rmse": own_error,
            "rows": kept,
            "at_equal_psnr": ratios(kept),
        }, indent=1) + "\n")  # fmt: skip

    for name in options.fields:
        exact, own_error[name] = truth(options.work, name)
        for n in options.grids:
            path = options.work / f"{name}-{n}.nrrd"
            if not path.exists():
                fields.write_nrrd(path, fields.grid(fields.FIELDS[name], n))
            for program, steps in (("vtk-cpu", (2.0, 1.0, 0.5, 0.25)), ("vtk-gpu", (2.0, 1.0, 0.5))):
                for scalar in options.vtk_scalars if program in options.only else ():
                    gpu = program == "vtk-gpu"
                    more, adapter = run_vtk(name, n, path, exact, gpu, steps, scalar)
                    rows += more
                    adapters["vtk"] = adapter
            for kernel in options.kernels if "voxsplat" in options.only else ():
                for classify in options.classify:
                    for slabs in SLABS:
                        row, adapters["voxsplat"] = run_voxsplat(
                            options.voxsplat, name, n, path, exact, kernel, slabs, classify,
                            options.repeat,
                        )
                        rows.append(row)
            save()


def key_of(row):
    """What makes two rows measurements of the same thing."""
    names = ("field", "grid", "program", "scalar", "step_voxels", "kernel", "slabs_per_voxel")
    return tuple(row.get(k) for k in (*names, "classify"))


if __name__ == "__main__":
    main()
