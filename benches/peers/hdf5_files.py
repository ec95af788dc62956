#!/usr/bin/env python3
"""Writes the volume of `cargo bench --bench readers` as HDF5 and NetCDF-4, for which Rust has no writer here.

    python3 -m pip install h5py==3.16.0 netCDF4==1.7.5.1.post1
    python3 benches/peers/hdf5_files.py FOLDER
    cargo bench --bench readers -- FOLDER
"""

import sys
from pathlib import Path

import h5py
import netCDF4
import numpy as np

SIDE, CHUNK = 512, 128


def volume():
    """A ramp with noise in its last four bits, as of a scanner."""
    noise = np.random.default_rng(1).integers(0, 16, (SIDE, SIDE, SIDE), dtype=np.uint16)
    x, y, z = (np.arange(SIDE, dtype=np.uint16).reshape(shape) for shape in [(1, 1, -1), (1, -1, 1), (-1, 1, 1)])
    return ((x + y + z) & 0x07FF) | noise


def main(folder):
    samples = volume()
    chunks = (CHUNK,) * 3
    for name, how in [
        ("hdf5.h5", {}),
        ("hdf5-chunks.h5", {"chunks": chunks}),
        ("hdf5-gzip.h5", {"chunks": chunks, "compression": 1}),
    ]:
        with h5py.File(folder / name, "w") as file:
            file.create_dataset("density", data=samples, **how)
    for name, how in [
        ("netcdf4.nc", {"contiguous": True}),
        ("netcdf4-zlib.nc", {"chunksizes": chunks, "compression": "zlib", "complevel": 1}),
    ]:
        with netCDF4.Dataset(folder / name, "w") as file:
            for axis in "zyx":
                file.createDimension(axis, SIDE)
            file.createVariable("density", "u2", ("z", "y", "x"), **how)[:] = samples


if __name__ == "__main__":
    if len(sys.argv) != 2 or not Path(sys.argv[1]).is_dir():
        sys.exit(f"expected a folder to write to, found {sys.argv[1:]}")
    main(Path(sys.argv[1]))
