"""Bars of relighting, line by line, and measurements against them."""

from __future__ import annotations

from collections.abc import Callable, Iterable

# Vertices from which on a scene counts as one of 13,000.
_LARGE = 10_000


def bars(rows: Iterable[dict]) -> list[list[str]]:
    """Bar, limit, the worst that was measured, and of which scene and light; only those that some row tells of."""
    ours = [row for row in rows if row["method"] == "ours"]
    large = [row for row in ours if row["vertices"] >= _LARGE and row["scene"] != "growth"]
    lines: list[list[str]] = []

    def add(bar: str, limit: float | int, of: list[dict], value: Callable[[dict], float], least: bool = False) -> None:
        if of:
            worst = (min if least else max)(of, key=value)
            words = f"{worst['scene']}, {worst['light']}, {worst['vertices']:,} sites"
            lines.append([bar, f"{'>= ' if least else ''}{limit:g}", f"{value(worst):.3g}", words])

    for rays, seconds, megabytes in ((256, 15, 40), (1024, 90, 150)):
        # Pictures have sites of their own, finer ones.
        some = [row for row in large if row["rays"] == rays and row["at"] != "renderer"]
        add(f"precompute, {rays} rays, CPU s", seconds, some, lambda row: row["precompute_cpu_seconds"])
        add(f"rays kept, {rays} rays, MB", megabytes, some, lambda row: row["bytes"] / 1e6)
    relit = [row for row in large if row["rays"] == 256 and row["at"] == "sites" and row["bounces"] == "all"]
    for what, limit in (("all", 150), ("light", 50), ("matt", 50)):
        add(f"relight {what}, ms", limit, relit, lambda row, what=what: row["relight_ms"][what])
    for rays, matt, glossy, p99 in ((256, 1.0, 2.0, 2.5), (1024, 0.6, 1.0, 1.5)):
        one = [row for row in ours if row["rays"] == rays and row["at"] == "sites" and row["bounces"] == 1]
        add(f"one bounce, {rays} rays, matt p95", matt, one, lambda row: row["delta_e94_matt"]["p95"])
        add(f"one bounce, {rays} rays, glossy p95", glossy, one, lambda row: row["delta_e94_glossy"]["p95"])
        add(f"one bounce, {rays} rays, p99", p99, one, lambda row: row["delta_e94"]["p99"])
    for rays in (256, 1024):
        whole = [row for row in large if row["at"] == "pixels" and row["bounces"] == "all" and row["rays"] == rays]
        add(f"all bounces, {rays} rays, whole picture, p95", 1.0, whole, lambda row: row["delta_e94"]["p95"])
    add("between vertices, p95", 1.0, [row for row in large if "delta_e94_between" in row], _between)
    drawn = [row for row in large if row["at"] == "renderer"]
    add("all bounces, as rendered, p95", 1.0, drawn, lambda row: row["delta_e94"]["p95"])
    spectrum = [row for row in ours if row["at"] == "wavelengths"]
    add("J beside 81 wavelengths, max", 0.1, spectrum, lambda row: row["delta_e94"]["max"])
    add("surcharge over RGB", 1.15, spectrum, lambda row: row["rgb_surcharge"])
    grown = [row for row in ours if row["scene"] == "growth"]
    for what in ("precompute_cpu_seconds", "bytes", "light", "all"):
        add(f"growth, {what}", 1.3, grown, lambda row, what=what: row["beside_first"][what])
    traced = [row for row in rows if row["method"] == "mitsuba"]
    add("times faster than Mitsuba", 1000, traced, lambda row: row["faster"], least=True)
    return lines


def _between(row: dict) -> float:
    return row["delta_e94_between"]["p95"]
