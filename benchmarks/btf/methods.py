"""Every method that a BTF is written in few numbers by: what was published, and Metamer's."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float

from ...materials.btf.clustered_form import ClusteredForm
from ...materials.btf.form import SIZES, BtfForm, btf_form, palette_of
from ...materials.btf.images import BtfImages
from ...materials.btf.lobe_field import lobe_field
from ...materials.btf.paper_pca import paper_pca
from ...materials.btf.texels import BtfTexels
from ...materials.records.hdf5_tree import form_node, write_tree
from ..papers.btf_fields import Field, lafortune, ptm, rfp
from .rows import Reconstruct

#: Bytes a texel that local PCA is held to.
BYTES = 30.0


@dataclass(frozen=True, eq=False)
class Made:
    """A BTF in few numbers.

    reconstruct : its images again. bytes_per_texel : dictionaries and all. form : `Field` or texels of clusters, which
    can be drawn. fit_cpu_seconds : what finding it took.
    """

    reconstruct: Reconstruct
    bytes_per_texel: float
    form: Field | BtfTexels
    fit_cpu_seconds: float


@dataclass(frozen=True)
class Method:
    """A way to write a BTF.

    name : of its rows. make : from images to what is kept. registered : whether it takes registered images. full :
    only the long run has it. size : where there are several forms of one name. held : whether it is also fitted
    without some views, and judged by them.
    """

    name: str
    make: Callable[[BtfImages], Made]
    registered: bool = False
    full: bool = False
    size: str | None = None
    held: bool = False


def methods(full: bool) -> list[Method]:
    """Return the methods that a run of this length has, first those that take images as they were measured."""
    found = [
        Method("ptm", partial(_field, ptm)),
        Method("lafortune", partial(_field, lafortune), full=True),
        Method("lpca-paper", _paper, size="32 x 8"),
        Method("rfp", partial(_field, rfp), True),
        *(
            Method(f"rfnl-{count}", partial(_lobes, lobes=count), True, count != 2, held=count == 2)
            for count in (1, 2, 4)
        ),
        Method("rfnl-2-separate", partial(_lobes, lobes=2, shared=False), True),
        Method("lpca", _of_bytes, True, True, f"{BYTES:g} B"),
        *(Method("lpca", partial(_ours, size=size), True, size != "medium", size, size == "medium") for size in SIZES),
    ]
    return [method for method in found if full or not method.full]


def _field(fitted: Callable[[BtfImages], Field], images: BtfImages) -> Made:
    begun = time.process_time()
    field = fitted(images)
    return Made(field.reconstruct, float(field.bytes_per_texel), field, time.process_time() - begun)


def _lobes(images: BtfImages, lobes: int, shared: bool = True) -> Made:
    return _field(partial(lobe_field, lobes=lobes, shared=shared), images)


def _paper(images: BtfImages, clusters: int = 32, components: int = 8) -> Made:
    begun = time.process_time()
    found = paper_pca(images, clusters, components)
    seconds = time.process_time() - begun
    return _clustered(images, BtfTexels(found, palette_of(images.basis)), found.stored(), seconds)


def _ours(images: BtfImages, size: str) -> Made:
    begun = time.process_time()
    form: BtfForm = btf_form(images, SIZES[size])
    return _clustered(images, form.texels, form.stored(), time.process_time() - begun)


def _of_bytes(images: BtfImages) -> Made:
    """Return the medium size, but as many clusters as `BYTES` a texel have room for: of large samples more than of
    small.
    """
    begun = time.process_time()
    size = SIZES["medium"]
    form = btf_form(images, size)
    count = len(form.texels.table)
    each = stored_bytes({"parts": form.stored()["texels"]["parts"]}) / count
    room = BYTES * images.height * images.width - stored_bytes(form.stored())
    clusters = int(np.clip(count + room // max(each, 1.0), 1, 256))
    if clusters != count:
        form = btf_form(images, replace(size, clusters=clusters))
    return _clustered(images, form.texels, form.stored(), time.process_time() - begun)


def _clustered(images: BtfImages, texels: BtfTexels, kept: Mapping, seconds: float) -> Made:
    each = stored_bytes(kept) / texels.form.number.size
    again, basis = _decoded(texels.form), texels.form.basis
    if basis is images.basis:
        return Made(again, each, texels, seconds)
    back = (basis.synthesis.T @ images.basis.analysis).astype(np.float32)
    return Made(lambda view, light: again(view, light) @ back, each, texels, seconds)


def _decoded(form: ClusteredForm) -> Reconstruct:
    """Images again: each cluster's mean and its texels' shares of its components."""
    table, number = form.table(), form.number.ravel()
    weights = form.weights.reshape(len(number), -1).astype(np.float32)
    weights = np.concatenate([np.ones((len(number), 1), np.float32), weights], axis=1)
    order = np.argsort(number, kind="stable")
    clusters, starts = np.unique(number[order], return_index=True)
    groups = list(zip(clusters.tolist(), np.split(order, starts[1:]), strict=True))
    shares = [weights[here] for _, here in groups]

    def again(view: int, light: int) -> Float[np.ndarray, "H W J"]:
        found = np.empty((len(number), table.shape[-1]), dtype=np.float32)
        for (cluster, here), share in zip(groups, shares, strict=True):
            found[here] = share @ table[cluster, view, light]
        return found.reshape(*form.number.shape, -1)

    return again


def stored_bytes(kept: Mapping[str, Any]) -> int:
    """Sum the bytes of all data sets of a form in HDF5, compressed as they are there, not of the file's bookkeeping."""
    import h5py

    total = 0

    def add(name: str, found: object) -> None:
        nonlocal total
        if isinstance(found, h5py.Dataset):
            total += found.id.get_storage_size()

    with h5py.File("in memory", "w", driver="core", backing_store=False) as file:
        write_tree(file, form_node(kept))
        file.flush()
        file.visititems(add)
    return total
