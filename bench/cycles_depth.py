"""Do Cycles and rugae see the same wall from the same place? Their depths, pixel by pixel of a grid."""

import os

import bpy
import numpy as np

GRID_STEP_PX = 8


def read_depth(path):
    """First channel of an EXR file, row 0 on top."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    values = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(height, width, -1)[::-1, :, 0].astype(np.float64)


def undistorted(points, lens):
    """The x, y that Brown-Conrady leads to `points`, by fixed-point iteration; all normalised."""
    k1, k2, k3, p1, p2 = (lens.get(name, 0.0) for name in ("k1", "k2", "k3", "p1", "p2"))
    p = points.copy()
    for _ in range(200):
        x, y = p[..., 0], p[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        tangential = np.stack([2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y], -1)
        p = (points - tangential) / radial[..., None]
    return p


def difference_mm(ours, theirs, lens):
    """|difference| of both z-depths along the rays of every eighth pixel of ours.

    Our pixel's ray meets the pinhole's image between pixels. On a plane 1/z is linear there, so 1/z is interpolated; NaN
    where our ray leaves their image.
    """
    height, width = ours.shape
    row, column = np.mgrid[GRID_STEP_PX // 2 : height : GRID_STEP_PX, GRID_STEP_PX // 2 : width : GRID_STEP_PX]
    focal, centre = lens["fx"], np.array([lens["cx"], lens["cy"]])
    distorted = (np.stack([column, row], -1) + 0.5 - centre) / focal
    place = undistorted(distorted, lens) * focal + centre - 0.5  # counted from the centre of the first pixel
    x, y = place[..., 0], place[..., 1]
    inside = (x >= 0) & (y >= 0) & (x < width - 1) & (y < height - 1)
    x, y = np.where(inside, x, 0.0), np.where(inside, y, 0.0)
    x0, y0 = x.astype(int), y.astype(int)
    a, b = x - x0, y - y0
    inverse = 1 / theirs
    upper = (1 - a) * inverse[y0, x0] + a * inverse[y0, x0 + 1]
    lower = (1 - a) * inverse[y0 + 1, x0] + a * inverse[y0 + 1, x0 + 1]
    there = 1 / ((1 - b) * upper + b * lower)
    return np.where(inside, np.abs(ours[row, column] - there), np.nan)


def differences_mm(dataset, out, frames, lens):
    """Over all frames: how many pixels were compared, and the median and 95th percentile of the difference."""
    found = []
    for frame in frames:
        ours = read_depth(os.path.join(dataset, "truth", "depth", frame + ".exr"))
        theirs = read_depth(os.path.join(out, "depth", frame + ".exr"))
        found.append(difference_mm(ours, theirs, lens))
    found = np.array(found)
    known = found[np.isfinite(found)]
    return {
        "pixels": int(known.size),
        "share_in_both": float(known.size / found.size),
        "median": float(np.median(known)),
        "percentile_95": float(np.percentile(known, 95)),
    }
