#!/usr/bin/env python3
"""Prints the tables of benches/results/peers.md from the JSON that vtk_frontier.py wrote."""

import json
import pathlib
import sys

RESULTS = pathlib.Path(__file__).resolve().parent.parent / "results" / "peers-llvmpipe.json"


def main():
    found = json.loads(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else RESULTS).read_text())
    for name in sorted({row["field"] for row in found["rows"]}, reverse=True):
        print(f"\n### {name}: milliseconds, PSNR in dB\n")
        rows = [row for row in found["rows"] if row["field"] == name]
        grids = sorted({row["grid"] for row in rows})
        print("| program and mode | planes per voxel | " + " | ".join(f"{n}³" for n in grids) + " |")
        print("|---|---|" + "---|" * len(grids))
        modes = {}
        for row in rows:
            if row.get("scalar", "uint16") == "uint16":
                modes.setdefault(mode_of(row), {})[row["grid"]] = row
        for (mode, planes), cells in sorted(modes.items()):
            shown = [cell(cells.get(n)) for n in grids]
            print(f"| {mode} | {planes:g} | " + " | ".join(shown) + " |")
    print("\n### Voxsplat's time over VTK's at equal PSNR\n")
    print("| field | grid | VTK's path, step | dB | VTK ms | Voxsplat ms | ratio | best PSNR, Voxsplat − VTK |")
    print("|---|---|---|---|---|---|---|---|")
    for row in found["at_equal_psnr"]:
        if row["scalar"] == "uint16":
            ours = row["voxsplat_ms"] if row["voxsplat_ms"] is not None else "not reached"
            ratio = row["ratio"] if row["ratio"] is not None else "–"
            print(
                f"| {row['field']} | {row['grid']}³ | {row['program']} {row['step_voxels']:g}"
                f" | {row['psnr_db']:.1f} | {row['vtk_ms']:.0f} | {ours} | {ratio}"
                f" | {row['best_psnr_gain_db']:+.1f} |"
            )


def mode_of(row):
    if row["program"] == "voxsplat":
        return f"Voxsplat {row['kernel']}, {row['classify']}", row["slabs_per_voxel"]
    return {"vtk-cpu": "VTK CPU", "vtk-gpu": "VTK GPU path"}[row["program"]], 1 / row["step_voxels"]


def cell(row):
    return f"{row['frame_ms']:.0f} ms {row['psnr_db']:.1f}" if row else ""


if __name__ == "__main__":
    main()
