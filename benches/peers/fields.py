"""Analytic fields, the scene they are drawn in, and its exact picture, in float64.

World space: the fields live in the ball of radius 0.95 about the origin, with values in [0, 1]. A grid
of n samples per axis covers the cube [-1, 1]^3, sample i at -1 + (2 i + 1) / n.

The colour is white everywhere and the background black, so a picture is its opacity: 1 - exp(-tau). No
colour is ever mixed with another, and it does not matter in which space a program composites.
"""

import numpy as np

SIZE = 512
# Half the height of the view, world units.
PARALLEL_SCALE = 1.0
DIRECTION = np.array([-0.45, 0.6, -0.66])
VIEW_UP = np.array([0.0, 0.0, 1.0])
# The thin peak, 0.2 of the range wide: opacity per unit distance over value, linear between.
PEAK = [(0.0, 0.0), (0.4, 0.0), (0.5, 0.1), (0.6, 0.0), (1.0, 0.0)]
# World length over which these opacities are given: one voxel of the 128^3 grid, for every grid, so
# that all of them have the same exact picture.
UNIT_DISTANCE = 2.0 / 128.0
RADIUS = 0.95


def window(r):
    """1 inside radius 0.7, 0 outside 0.95, twice differentiable between."""
    t = np.clip((RADIUS - r) / (RADIUS - 0.7), 0.0, 1.0)
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


def marschner_lobb(x, y, z):
    """Marschner and Lobb 1994, f_M = 6, alpha = 0.25, times the window."""
    alpha, f_m = 0.25, 6.0
    rho = np.cos(2.0 * np.pi * f_m * np.cos(0.5 * np.pi * np.sqrt(x * x + y * y)))
    value = (1.0 - np.sin(0.5 * np.pi * z) + alpha * (1.0 + rho)) / (2.0 * (1.0 + alpha))
    return value * window(np.sqrt(x * x + y * y + z * z))


_RNG = np.random.default_rng(3)
_CENTRES = _RNG.uniform(-0.45, 0.45, (10, 3))
_WIDTHS = _RNG.uniform(0.10, 0.22, 10)


def blobs(x, y, z):
    """Ten Gaussians (seed 3) that saturate smoothly at 1, times the window."""
    total = np.zeros(np.broadcast(x, y, z).shape)
    for (cx, cy, cz), width in zip(_CENTRES, _WIDTHS):
        total += np.exp(-((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2) / (2.0 * width * width))
    return (1.0 - np.exp(-total)) * window(np.sqrt(x * x + y * y + z * z))


FIELDS = {"marschner-lobb": marschner_lobb, "blobs": blobs}


def grid(field, n):
    """Samples of the field, uint16 of shape (z, y, x): stored 65535 stands for 1."""
    axis = -1.0 + (2.0 * np.arange(n) + 1.0) / n
    out = np.empty((n, n, n), np.uint16)
    for k, z in enumerate(axis):
        out[k] = np.rint(65535.0 * field(axis[None, :], axis[:, None], z))
    return out


def write_nrrd(path, samples):
    """An attached raw NRRD whose first sample lies at -1 + 1 / n."""
    n = samples.shape[0]
    step, start = 2.0 / n, -1.0 + 1.0 / n
    header = (
        "NRRD0004\ntype: uint16\ndimension: 3\nspace dimension: 3\n"
        f"sizes: {n} {n} {n}\nendian: little\nencoding: raw\n"
        f"space directions: ({step!r},0,0) (0,{step!r},0) (0,0,{step!r})\n"
        f"space origin: ({start!r},{start!r},{start!r})\n\n"
    )
    path.write_bytes(header.encode() + samples.astype("<u2").tobytes())


def camera_axes():
    """Right, up and forward unit vectors."""
    forward = DIRECTION / np.linalg.norm(DIRECTION)
    right = np.cross(forward, VIEW_UP)
    right /= np.linalg.norm(right)
    return right, np.cross(right, forward), forward


def exact(field, steps):
    """The picture of the field itself, opacity of shape (SIZE, SIZE), row 0 at the top.

    The optical depth of each pixel centre's ray through the ball, by the midpoint rule in `steps` and
    in `steps / 2` intervals. Returns the finer picture and the RMSE between the two, an upper estimate
    of its own error: the rule's error falls by four per halving here.
    """
    right, up, forward = camera_axes()
    at = PARALLEL_SCALE * ((2.0 * np.arange(SIZE) + 1.0) / SIZE - 1.0)
    values, opacities = np.array(PEAK).T
    pictures = []
    for count in (steps // 2, steps):
        # Midpoints along every ray: equal steps over the ball's diameter.
        t = RADIUS * ((2.0 * np.arange(count) + 1.0) / count - 1.0)
        picture = np.zeros((SIZE, SIZE))
        for row in range(SIZE):
            v = -at[row]
            hit = np.nonzero(at * at + v * v < RADIUS * RADIUS)[0]
            if hit.size == 0:
                continue
            foot = at[hit, None] * right + v * up
            x, y, z = (foot[:, None, a] + t[None, :] * forward[a] for a in range(3))
            alpha = np.interp(field(x, y, z), values, opacities)
            depth = -np.log1p(-alpha).sum(axis=1) * (2.0 * RADIUS / count) / UNIT_DISTANCE
            picture[row, hit] = -np.expm1(-depth)
        pictures.append(picture)
    return pictures[1], float(np.sqrt(np.mean((pictures[1] - pictures[0]) ** 2)))


def encoded(linear):
    """sRGB's display code of linear light, both in [0, 1]."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def psnr(picture, truth):
    """-10 log10 of the mean squared difference, peak 1."""
    return float(-10.0 * np.log10(np.mean((picture - truth) ** 2)))


def shift_of(picture, truth):
    """Least-squares displacement (right, down) in pixels of a picture against the truth."""
    down, right = np.gradient(truth)
    basis = np.stack([right.ravel(), down.ravel()], axis=1)
    found, *_ = np.linalg.lstsq(basis, (truth - picture).ravel(), rcond=None)
    return [float(v) for v in found]


def shifted(truth, offset):
    """The truth displaced by (right, down) pixels, by Fourier: it is empty at its border."""
    fx = np.fft.fftfreq(SIZE)[None, :] * offset[0]
    fy = np.fft.fftfreq(SIZE)[:, None] * offset[1]
    return np.fft.ifft2(np.fft.fft2(truth) * np.exp(-2j * np.pi * (fx + fy))).real
