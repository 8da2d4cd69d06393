"""The 2007 paper's way as a method: precomputed, compressed, and relit in four ways."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ...lighting.environment.environment import EnvironmentLight
from ...lighting.transfer.edge_refinement import placed
from ...lighting.transfer.hits import Hits
from ...lighting.visibility.occluders import Occluders
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM
from ..papers.transfer_tensors.brdf_tensor import BrdfTensor, brdf_tensor
from ..papers.transfer_tensors.components import Components, components_of
from ..papers.transfer_tensors.precomputed import bytes_of_site, transfer_tensors
from ..papers.transfer_tensors.relighting import Arriving, TensorTransfer
from ..timing import best_ms
from .pixels import Seen, seen_sites
from .scenes import TransferScene, family

# Longest edges between sites, in radii of the scene: where the search for one begins, and where it ends.
_FINEST, _COARSEST = 0.06, 2.0


@dataclass(frozen=True, eq=False)
class TensorMethod:
    """A scene's tensors, ready to be relit; precompute_cpu_seconds are without the family's own."""

    case: TransferScene
    hits: Hits
    seen: Seen
    transfer: TensorTransfer
    precompute_cpu_seconds: float

    @classmethod
    def of(
        cls,
        case: TransferScene,
        shared: tuple[BrdfTensor, Components],
        rays: int,
        across: int,
        most_bytes: float,
        progress: Callable[[str], None],
    ) -> TensorMethod:
        """Precompute the transfer, each part a region of its own.

        rays : of each site. across : texels of a face of its visibility. most_bytes : of the tensors before they are
        compressed; the scene has as many sites as fit.
        """
        start = time.process_time()
        progress(f"{case.name}: rays")
        room, longest_edge = most_bytes / bytes_of_site(len(case.scene.parts), shared[1]), _FINEST
        # As even as the paper's: none is added where light is not linear.
        bodies = placed(case.scene, longest_edge, most=0.0)
        while longest_edge < _COARSEST and len(bodies.sites) > room:
            longest_edge *= 2.0**0.25
            bodies = placed(case.scene, longest_edge, most=0.0)
        hits, occluders = bodies.traced(rays), Occluders(bodies.triangles)
        progress(f"{case.name}: transfer tensors of {len(hits.sites):,} sites")
        tensors = transfer_tensors(hits, np.arange(len(case.scene.parts)), shared[1], occluders, across)
        progress(f"{case.name}: clusters")
        transfer = TensorTransfer.of(tensors, family(), *shared)
        return cls(case, hits, seen_sites(bodies.scene, hits), transfer, time.process_time() - start)

    def xyz(self, arriving: Arriving, bounces: int) -> Float[np.ndarray, "S 3"]:
        """Colours of all sites for the scene's camera."""
        scene = self.case.scene
        low, high = scene.bounds
        eye = (np.asarray(scene.camera().position) - 0.5 * (low + high)) / (0.5 * float(np.linalg.norm(high - low)))
        weights = [scene.observer.weights(spectrum, NM) for spectrum in scene.lights[0].spectra]
        materials = [self.case.materials[part.material] for part in scene.parts]
        return self.transfer.xyz(
            arriving, materials, eye, weights, float(scene.viewing.reference_illuminance_lux), bounces
        )

    def arriving(self, light: EnvironmentLight | None = None) -> Arriving:
        """Compute what arrives of the scene's own light, or another."""
        own = self.case.scene.lights[0]
        assert isinstance(own, EnvironmentLight)
        return self.transfer.arriving(own if light is None else light)

    def relight_ms(self) -> dict[str, float]:
        """Time another view or material, another light before anything is seen of it, and all of them."""
        arriving = self.arriving()
        light, seen = best_ms(self.arriving), best_ms(lambda: self.xyz(arriving, 2))
        # A view is looked up in the same sums as a material is: neither is kept from the other.
        return {"view": seen, "material": seen, "light": light + seen, "all": light + seen}


def shared_by_all() -> tuple[BrdfTensor, Components]:
    """Return the family's factors and components, found once for all scenes."""
    return brdf_tensor(family()), components_of(family())
