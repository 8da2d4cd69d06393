"""A row of figures: what every case says of a method."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def svbrdf_row(
    case: str,
    method: str,
    light: str,
    apart: Float[np.ndarray, "*n"],
    noise: float,
    *,
    lobes: int = 0,
    cpu_seconds_per_1000_vertices: float | None = None,
    bytes_per_vertex: float | None = None,
    ms_per_megapixel: float | None = None,
) -> dict:
    """Make a row for JSON. apart : ΔE94 of all points. noise : what the reference itself may be off by, mean ΔE94."""
    p95, p99 = np.percentile(apart, [95, 99])
    return {
        "case": case,
        "method": method,
        "light": light,
        "lobes": lobes,
        "delta_e94": {"mean": float(np.mean(apart)), "p95": float(p95), "p99": float(p99)},
        "reference_noise": noise,
        "cpu_seconds_per_1000_vertices": cpu_seconds_per_1000_vertices,
        "bytes_per_vertex": bytes_per_vertex,
        "ms_per_megapixel": ms_per_megapixel,
    }
