#!/usr/bin/env python3
"""Encodings as basis functions beside zfp and SZ3 at equal bytes, and on meshes: see README.md in this folder.

Needs Python 3.10 or later with numpy, scipy, scikit-image, zfpy and pysz, and takes the ones that are there:
    pip install numpy scipy scikit-image zfpy pysz
"""

import argparse
import json
import math
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
# Fields on grids: a file under --data and flags to read it. Names that begin with demo: need none.
FIELDS = {
    "neghip": ("scalar/neghip/neghip_64x64x64_uint8.raw", ["--raw-dims", "64,64,64", "--raw-type", "uint8"]),
    "hydrogen": ("scalar/hydrogen.vti", []),
    "blobs": ("demo:blobs:64", []),
}
# Meshes: a file under --data and the field at its points.
MESHES = {
    "bluntfin": ("unstructured/derived/bluntfin_tets.vtu", "Density"),
    "disk_out": ("unstructured/disk_out_ref.ex2", "Temp"),
    "post": ("unstructured/post.vtk", "Pressure"),
    "notch": ("unstructured/notch_stress_fixed.vtk", "Nodal Stress-0"),
    "hexa": ("unstructured/hexa.vtk", "scalars"),
}
FUNCTIONS = (30, 100, 300, 800)
# A goal that so few functions do not reach: their number is what ends an encoding.
GOAL = "0.01%"
# Functions of a mesh, few to many, until MESH_PSNR is reached, and steps of bisection after that.
LADDER = (25, 50, 100, 200, 400, 800, 1600, 3200)
MESH_PSNR, BISECTIONS = 40.0, 3
# Corners of a cell, each an index of four bytes.
CORNERS = {"tetrahedra": 4, "pyramids": 5, "wedges": 6, "hexahedra": 8}
# A compressor may take so many times the bytes of the encoding.
SLACK = 1.03
SIZE = (200, 200)
DIRECTION = (0.45, 0.75, -0.48)
VIEW_UP = (0.0, 0.0, 1.0)
# Half the picture's height over the length of the volume's diagonal.
SCALE = 0.5
# Ten peaks of opacity: their middles and half widths over the range of values, and their height for a length of one
# spacing. The encoder is never told of them.
PEAKS = [(0.12 + 0.09 * i, (0.03, 0.06, 0.10)[i % 3]) for i in range(10)]
HEIGHT = 0.3


def run(command):
    """Seconds that a command took; the end of all where it fails."""
    start = time.perf_counter()
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"failed: {done.stderr.strip()}\n{' '.join(map(str, command))}")
    return time.perf_counter() - start, done.stdout


def read_nrrd(path):
    """Samples as float32 (z, y, x), the smallest spacing, the world's middle, its diagonal, and the header."""
    import numpy as np

    head, body = path.read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line)
    if fields["encoding"] != "raw" or fields["dimension"] != "3":
        raise SystemExit(f"expected raw samples of one number each: {path}")
    kinds = {"uint8": "u1", "int8": "i1", "uint16": "u2", "int16": "i2", "float32": "f4", "float": "f4", "float64": "f8", "double": "f8"}
    order = ">" if fields.get("endian") == "big" else "<"
    sizes = [int(n) for n in fields["sizes"].split()]
    samples = np.frombuffer(body, order + kinds[fields["type"]])
    samples = samples.astype(np.float32).reshape(sizes[::-1])
    vector = lambda text: np.array([float(n) for n in text.strip("()").split(",")])
    steps = np.array([vector(part) for part in fields["space directions"].split()])
    across = steps.T @ (np.array(sizes) - 1.0)
    return {
        "samples": samples,
        "spacing": float(np.linalg.norm(steps, axis=1).min()),
        "middle": vector(fields["space origin"]) + across / 2.0,
        "diagonal": float(np.linalg.norm(across)),
        "header": {key: fields[key] for key in ("sizes", "space directions", "space origin")},
    }


def write_nrrd(path, samples, header):
    """Float32 samples at the places of another file."""
    lines = [
        "NRRD0005", "type: float", "dimension: 3", "space dimension: 3",
        *(f"{key}: {header[key]}" for key in ("sizes", "space directions")),
        "kinds: domain domain domain", f"space origin: {header['space origin']}",
        "endian: little", "encoding: raw",
    ]  # fmt: skip
    path.write_bytes("\n".join(lines).encode() + b"\n\n" + samples.astype("<f4").tobytes())


def surface(samples, level):
    """A tree of the vertices of an isosurface, in voxels; None where there is none."""
    from scipy.spatial import cKDTree
    from skimage.measure import marching_cubes

    if not samples.min() < level < samples.max():
        return None
    return cKDTree(marching_cubes(samples, level)[0])


def surface_distance(one, other):
    """Mean distance from the vertices of each surface to the nearest one of the other: mean of both ways, voxels.

    A little more than the surfaces' own distance, for the nearest vertex lies to the side of the nearest point.
    """
    if one is None or other is None:
        return None
    ways = [a.query(b.data)[0].mean() for a, b in ((one, other), (other, one))]
    return float(sum(ways) / 2.0)


def draw(options, path, original, span, peak, folder):
    """The sRGB bytes of a picture under one transfer function."""
    import numpy as np
    from skimage.io import imread

    out = folder / "picture.png"
    numbers = lambda values: ",".join(repr(float(v)) for v in values)
    value = lambda share: repr(float(span[0] + share * (span[1] - span[0])))
    middle, width = peak
    run([
        options.voxsplat, "render", path, "--output", out, "--engine", "native", "--kernel", "bspline",
        "--resolution", f"{SIZE[0]},{SIZE[1]}",
        "--camera-direction", numbers(DIRECTION), "--camera-view-up", numbers(VIEW_UP),
        "--camera-focal-point", numbers(original["middle"]),
        "--parallel-scale", repr(SCALE * original["diagonal"]),
        "--opacity", f"{value(middle - width)}:0,{value(middle)}:{HEIGHT},{value(middle + width)}:0",
        "--opacity-unit-distance", repr(original["spacing"]),
        "--colormap", "viridis", "--color-range", f"{value(0.0)},{value(1.0)}",
        "--shading", "none", "--background", "000000",
    ])  # fmt: skip
    return np.asarray(imread(out), np.float64)[..., :3]


class Field:
    """The original, and how far from it something decoded is."""

    def __init__(self, options, name, folder):
        self.options, self.name, self.folder = options, name, folder
        source, self.flags = FIELDS.get(name, (name, []))
        self.source = source if source.startswith("demo:") else options.data / source
        path = folder / "original.nrrd"
        run([options.voxsplat, "convert", self.source, *self.flags, "-o", path])
        self.original = read_nrrd(path)
        self.samples = self.original["samples"]
        self.span = (float(self.samples.min()), float(self.samples.max()))
        self.range = self.span[1] - self.span[0]
        self.level = sum(self.span) / 2.0
        self.surface = surface(self.samples, self.level)
        # Drawn as the decoded ones are: float32, the same header.
        write_nrrd(path, self.samples, self.original["header"])
        self.pictures = [self.draw(path, peak) for peak in PEAKS] if options.pictures else []

    def draw(self, path, peak):
        return draw(self.options, path, self.original, self.span, peak, self.folder)

    def psnr(self, decoded):
        rms = math.sqrt(float(((decoded.astype(float) - self.samples) ** 2).mean()))
        return psnr(self.range, rms)

    def row(self, coder, decoded, size, encode_s, decode_s, more):
        """All figures of something decoded."""
        import numpy as np

        if not np.isfinite(decoded).all():
            raise SystemExit(f"{coder} of {self.name} has values that are no numbers")
        path = self.folder / "decoded.nrrd"
        write_nrrd(path, decoded, self.original["header"])
        off = np.abs(decoded.astype(float) - self.samples)
        rms = [
            float(np.sqrt(((self.draw(path, peak) - exact) ** 2).mean()))
            for peak, exact in zip(PEAKS, self.pictures)
        ]
        distance = surface_distance(self.surface, surface(decoded, self.level))
        return {
            "field": self.name,
            "coder": coder,
            **more,
            "bytes": size,
            "bits_per_sample": round(8.0 * size / self.samples.size, 4),
            "psnr_db": round(self.psnr(decoded), 2),
            "greatest_error_percent": round(100.0 * float(off.max()) / self.range, 4),
            "mean_error_percent": round(100.0 * float(off.mean()) / self.range, 4),
            "surface_distance_voxels": None if distance is None else round(distance, 4),
            "picture_rms": [round(value, 3) for value in rms],
            "encode_s": round(encode_s, 3),
            "decode_s": round(decode_s, 3),
            "load_average": round(os.getloadavg()[0], 1),
        }

    def encoded(self, functions):
        """Voxsplat's row."""
        file, values = self.folder / "field.vrbf", self.folder / "field.nrrd"
        encode_s, info = encode(self.options, self.source, self.flags, file, ["--functions", functions])
        decode_s, _ = run([self.options.voxsplat, "convert", file, "-o", values])
        decoded = read_nrrd(values)["samples"]
        if decoded.shape != self.samples.shape:
            raise SystemExit(f"the encoding of {self.name} was converted to other dimensions")
        row = self.row(
            "voxsplat", decoded, file.stat().st_size, encode_s, decode_s,
            {"functions": info["functions"], "asked_functions": functions},
        )  # fmt: skip
        # What the file states, beside what was found here; 200 where there is no error at all.
        row["stated_psnr_db"] = round(psnr(self.range, info["rms_error"]), 2)
        row["stated_greatest_error_percent"] = round(100.0 * info["max_error"] / self.range, 4)
        return row

    def compressed(self, coder, most):
        """A compressor's row: the best PSNR within so many bytes, times SLACK, that bisection comes across."""
        best = None
        for trial in COMPRESSORS[coder]:
            # Tolerances on a logarithmic scale from a millionth of the range to far beyond it: zfp, which keeps to
            # its bound with much to spare, needs these for few bytes.
            low, high = math.log(1e-6 * self.range), math.log(1e3 * self.range)
            for _ in range(24):
                middle = (low + high) / 2.0
                start = time.perf_counter()
                size, decode = trial(self.samples, math.exp(middle))
                encode_s = time.perf_counter() - start
                if size > SLACK * most:
                    low = middle
                    continue
                high = middle
                start = time.perf_counter()
                decoded = decode()
                decode_s = time.perf_counter() - start
                quality = self.psnr(decoded)
                if best is None or quality > best[0]:
                    best = (quality, decoded, size, encode_s, decode_s, math.exp(middle))
        if best is None:
            return {"field": self.name, "coder": coder, "equal_to_bytes": most, "bytes": None}
        _, decoded, size, encode_s, decode_s, tolerance = best
        more = {"tolerance": tolerance, "equal_to_bytes": most}
        return self.row(coder, decoded, size, encode_s, decode_s, more)


def psnr(span, rms):
    """PSNR in dB, its peak the range of values; 200 at most, for JSON has no infinity."""
    return 200.0 if rms <= 1e-10 * span else 20.0 * math.log10(span / rms)


def zfp(samples, tolerance):
    """zfp of fixed accuracy: bytes, and what decodes them.

    zfp rounds a tolerance down to a power of two, so that the next smaller size may be half. Values are scaled
    until the tolerance is one: then all sizes can be had. The factor's four bytes are counted.
    """
    import numpy as np
    import zfpy

    power = 2.0 ** math.floor(math.log2(tolerance))
    factor = np.float32(power / tolerance)
    packed = zfpy.compress_numpy(np.ascontiguousarray(samples * factor), tolerance=power)
    return len(packed) + 4, lambda: zfpy.decompress_numpy(packed) / factor


def sz3(algorithm):
    """SZ3 with an absolute bound."""

    def compress(samples, tolerance):
        import numpy as np
        import pysz

        config = pysz.szConfig(samples.shape)
        config.errorBoundMode = pysz.szErrorBoundMode.ABS
        config.absErrorBound = tolerance
        config.cmprAlgo = getattr(pysz.szAlgorithm, algorithm)
        packed, _ = pysz.sz.compress(np.ascontiguousarray(samples), config)
        return packed.size, lambda: pysz.sz.decompress(packed, np.float32, samples.shape)[0]

    return compress


# What is tried of each; the best counts.
COMPRESSORS = {"zfp": [zfp], "sz3": [sz3("INTERP_LORENZO"), sz3("INTERP")]}


def encode(options, source, flags, file, more):
    """Seconds of an encoding, and what its file says."""
    seconds, _ = run([
        options.voxsplat, "encode", source, *flags, "-o", file,
        "--max-error", GOAL, "--seconds", options.seconds, *more,
    ])  # fmt: skip
    return seconds, json.loads(run([options.voxsplat, "info", "--json", file])[1])


def mesh_rows(options, name, folder, can_bytes):
    """Encodings of a mesh: the fewest functions found with MESH_PSNR, and what a hundredth of the bytes gives."""
    path, field = MESHES[name]
    source = options.data / path
    about = json.loads(run([options.voxsplat, "info", "--json", source])[1])
    values = next(f for f in about["fields"] if f["name"] == field)
    span = values["max"] - values["min"]
    kinds = about["cell_kinds"]
    # Three coordinates and a value of four bytes at each point, and four bytes a corner: 16 a tetrahedron.
    points = 16 * about["points"]
    plain = points + sum(4 * CORNERS[kind] * count for kind, count in kinds.items())
    file = folder / "mesh.vrbf"

    def attempt(what, more):
        seconds, info = encode(options, source, ["--field", field], file, more)
        size = file.stat().st_size
        row = {
            "mesh": name,
            "field": field,
            "points": about["points"],
            "cells": sum(kinds.values()),
            "what": what,
            "functions": info["functions"],
            "bytes": size,
            # The file's own figure, over all points.
            "psnr_db": round(psnr(span, info["rms_error"]), 2),
            "greatest_error_percent": round(100.0 * info["max_error"] / span, 3),
            "plain_bytes": plain,
            "plain_over_bytes": round(plain / size, 1),
            "points_over_bytes": round(points / size, 1),
            "file_bytes": source.stat().st_size,
            "file_over_bytes": round(source.stat().st_size / size, 1),
            "encode_s": round(seconds, 2),
        }
        print(row, file=sys.stderr, flush=True)
        return row

    aim = f"{MESH_PSNR:g} dB"
    below, best = 0, None
    for count in (n for n in LADDER if n <= max(about["points"] // 4, LADDER[0])):
        tried = attempt(aim, ["--functions", count])
        if tried["psnr_db"] >= MESH_PSNR:
            best = tried
            break
        below, nearest = count, tried
        if tried["encode_s"] >= options.seconds or tried["functions"] < count:
            # Out of time, or no better by more: the rest of the ladder would be no other.
            break
    if best is None:
        rows = [{**nearest, "what": f"{aim} not reached"}]
    else:
        for _ in range(BISECTIONS):
            # The middle by powers; half, where no number is known to be too few.
            count = round(math.sqrt(below * best["functions"])) if below else best["functions"] // 2
            if not below < count < best["functions"]:
                break
            tried = attempt(aim, ["--functions", count])
            if tried["psnr_db"] >= MESH_PSNR:
                best = tried
            else:
                below = count
        rows = [best]
    if can_bytes:
        rows.append(attempt("a hundredth of the bytes", ["--bytes", plain // 100]))
    return rows


def field_table(rows):
    """The grids' rows in Markdown."""
    lines = [
        "| field | coder | functions | bytes | bits a sample | PSNR, dB | greatest error, % | mean, %"
        " | isosurface off by, voxels | pictures, RMS: mean / worst | encode, s | decode, s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        if row["bytes"] is None:
            lines.append(f"| {row['field']} | {row['coder']} | | not so few as {row['equal_to_bytes']} |" + " |" * 8)
            continue
        shown = row["picture_rms"]
        pictures = f"{sum(shown) / len(shown):.2f} / {max(shown):.2f}" if shown else "–"
        distance = row["surface_distance_voxels"]
        lines.append(
            f"| {row['field']} | {row['coder']} | {row.get('functions', '')} | {row['bytes']}"
            f" | {row['bits_per_sample']:.3f} | {row['psnr_db']:.1f} | {row['greatest_error_percent']:.2f}"
            f" | {row['mean_error_percent']:.3f} | {'no surface' if distance is None else f'{distance:.3f}'}"
            f" | {pictures} | {row['encode_s']:.2f} | {row['decode_s']:.2f} |"
        )
    return "\n".join(lines)


def ahead_table(rows):
    """By how much each encoding is ahead of the better compressor at its bytes."""
    lines = [
        "| field | functions | bits a sample | PSNR ahead of the better compressor, dB | of zfp | of SZ3"
        " | picture RMS, of the better one's |",
        "|---|---|---|---|---|---|---|",
    ]
    # Each encoding is followed by the compressors at its bytes.
    for at, ours in ((i, row) for i, row in enumerate(rows) if row["coder"] == "voxsplat"):
        peers = {row["coder"]: row for row in rows[at + 1 : at + 1 + len(COMPRESSORS)] if row["bytes"]}
        ahead = {name: ours["psnr_db"] - row["psnr_db"] for name, row in peers.items()}
        mean = lambda row: sum(row["picture_rms"]) / max(len(row["picture_rms"]), 1)
        least = min((mean(row) for row in peers.values()), default=0.0)
        words = lambda name: f"{ahead[name]:+.1f}" if name in ahead else "not so few bytes"
        lines.append(
            f"| {ours['field']} | {ours['functions']} | {ours['bits_per_sample']:.3f}"
            f" | {f'{min(ahead.values()):+.1f}' if ahead else '–'} | {words('zfp')} | {words('sz3')}"
            f" | {f'{mean(ours) / least:.2f}' if least > 0.0 else '–'} |"
        )
    return "\n".join(lines)


def mesh_table(rows):
    """The meshes' rows in Markdown."""
    lines = [
        "| mesh | field | points | cells | aim | functions | bytes | PSNR, dB | greatest error, %"
        " | points and cells: bytes | times ours | points alone, times ours | file, times ours | encode, s |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row['mesh']} | {row['field']} | {row['points']} | {row['cells']} | {row['what']} | {row['functions']}"
        f" | {row['bytes']} | {row['psnr_db']:.1f} | {row['greatest_error_percent']:.2f} | {row['plain_bytes']}"
        f" | {row['plain_over_bytes']} | {row['points_over_bytes']} | {row['file_over_bytes']} | {row['encode_s']:.1f} |"
        for row in rows
    ]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--voxsplat", type=pathlib.Path, default=ROOT / "target/release/voxsplat")
    parser.add_argument("--commit", default="", help="commit of that binary, for the record")
    parser.add_argument("--data", type=pathlib.Path, help="folder of scalar and unstructured; default: $VOXSPLAT_DATA")
    parser.add_argument("--fields", nargs="*", default=list(FIELDS), help=f"of {', '.join(FIELDS)}, or demo:NAME:SIZE; none: no grids")
    parser.add_argument("--functions", nargs="+", type=int, default=list(FUNCTIONS))
    parser.add_argument("--meshes", nargs="*", default=list(MESHES), choices=list(MESHES), help="none: no meshes")
    parser.add_argument("--seconds", type=float, default=25.0, help="an encoding ends after the round in which so many have passed")
    parser.add_argument("--threads", type=int, default=2, help="of Voxsplat; both compressors have one")
    parser.add_argument("--no-pictures", dest="pictures", action="store_false")
    parser.add_argument("--output", type=pathlib.Path, help="write all figures as JSON")
    options = parser.parse_args()
    for name in options.fields:
        if name not in FIELDS and not name.startswith("demo:"):
            parser.error(f"expected one of {', '.join(FIELDS)} or demo:NAME:SIZE, found {name}; name one of these")
    files = [FIELDS[name][0] for name in options.fields if name in FIELDS] + [MESHES[name][0] for name in options.meshes]
    files = [file for file in files if not file.startswith("demo:")]
    if files and options.data is None:
        if "VOXSPLAT_DATA" not in os.environ:
            parser.error("expected --data FOLDER or VOXSPLAT_DATA, found neither; name the folder of the data")
        options.data = pathlib.Path(os.environ["VOXSPLAT_DATA"])
    for needed in (options.voxsplat, *(options.data / file for file in files)):
        if not needed.is_file():
            parser.error(f"expected a file, found none; build it or name another: {needed}")
    os.environ["RAYON_NUM_THREADS"] = str(options.threads)
    # Older programs cannot be told how many bytes.
    can_bytes = "--bytes" in run([options.voxsplat, "encode", "--help"])[1]

    rows, meshes, start = [], [], time.perf_counter()
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for name in options.fields:
            field = Field(options, name, folder)
            for functions in options.functions:
                found = [field.encoded(functions)]
                found += [field.compressed(coder, found[0]["bytes"]) for coder in COMPRESSORS]
                for row in found:
                    print(row, file=sys.stderr, flush=True)
                rows += found
        for name in options.meshes:
            meshes += mesh_rows(options, name, folder, can_bytes)

    from importlib.metadata import version

    results = {
        "date": time.strftime("%Y-%m-%d", time.gmtime()),
        "machine": {"cores": os.cpu_count(), "system": platform.system()},
        "versions": {
            "voxsplat": options.commit,
            **{name: version(name) for name in ("zfpy", "pysz", "scikit-image", "scipy", "numpy")},
        },
        "threads": options.threads,
        "seconds_at_most": options.seconds,
        "whole_s": round(time.perf_counter() - start, 1),
        "slack": SLACK,
        "pictures": {"size": SIZE, "direction": DIRECTION, "view_up": VIEW_UP, "scale_over_diagonal": SCALE, "peaks": PEAKS, "height": HEIGHT, "unit": "sRGB bytes, 0 to 255"},
        "fields": rows,
        "meshes": meshes,
    }  # fmt: skip
    if options.output is not None:
        options.output.write_text(json.dumps(results, indent=1) + "\n")
    if rows:
        print(
            "PSNR: peak = range. Isosurface: at the middle of the range, mean distance of nearest vertices, both ways."
            f"\nPictures: RMS of sRGB bytes (0 to 255), RGB, {SIZE[0]} × {SIZE[1]}, ten transfer functions."
            f" Compressors: the best PSNR within {SLACK} times the encoding's bytes.\n"
        )
        print(field_table(rows), end="\n\n")
        print(ahead_table(rows), end="\n\n")
    if meshes:
        print(
            "PSNR over the mesh's points, from the rms error that the file states. Points and cells: 16 bytes a point"
            " (x, y, z, value)\nand 4 a corner of a cell (16 a tetrahedron), not compressed.\n"
        )
        print(mesh_table(meshes))


if __name__ == "__main__":
    main()
