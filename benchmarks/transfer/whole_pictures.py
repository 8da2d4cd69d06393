"""Whole pictures as `metamer render` draws them: direct light at pixels, other light from sites, materials fitted."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ...lighting.transfer.hits import RAYS
from ...materials.fitting.fit import fit
from ...spectral.difference import delta_e_xyz
from ...viewer.software.backend import software_session
from .pixels import ALL, Truths, figures_of


def drawn_row(truths: Truths) -> dict:
    """Return a scene under its light with all its bounces beside paths in its materials as they are, so that what fits
    of materials, visibility, maps of highlights and bounces are off by is all in it.
    """
    case = truths.case
    truths.progress(f"{case.name}, {case.light}: drawn")
    surfaces = {name: fit(material).fast for name, material in case.materials.items()}
    start = time.process_time()
    with software_session() as renderer:
        xyz, coverage = renderer.render(replace(case.scene, bounces="auto"), None, surfaces)
        light = renderer.bounced
    spent = time.process_time() - start
    assert light is not None
    truth = truths.picture(ALL)
    whole = (coverage == 1.0) & (truth.coverage == 1.0)
    # Approximations below zero are black.
    off = delta_e_xyz(truth.xyz[0][whole], np.maximum(xyz[whole], 0.0), case.scene.adopted_white())
    return {
        "scene": case.name,
        "vertices": len(light.at_sites),
        "regions": len(case.scene.parts),
        "method": "ours",
        "at": "renderer",
        "rays": RAYS,
        "coefficients": light.basis.size,
        "bounces": "all",
        "precompute_cpu_seconds": spent,
        "bytes": light.at_sites.nbytes + (0 if light.maps is None else light.maps.nbytes),
        "relight_ms": {},
        "light": case.light,
        "delta_e94": figures_of(off),
        "reference_noise": None if truth.noise is None else float(max(truth.noise.mean)),
    }
