"""Reference rendering of the current view in a separate process; only the newest view is rendered.

The process has the lowest non-idle priority (`nice` 19) and one BLAS thread, so that the window stays responsive. It
checks for a newer view after each row, caches the ray tracer of the last meshes and the surfaces of the last catalogue,
and computes the comparison too. Meshes are sent to it once.
"""

from __future__ import annotations

import io
import os
import pickle
import tempfile
import threading
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ...lighting.mesh.mesh import Mesh
from ...materials.catalogue.catalogue import Catalogue
from ...materials.core.surface import Surface
from ...runtime.errors import MetamerError
from ...runtime.private_folder import temporary_folder
from ...runtime.shutdown import clearing, undisturbed
from ...runtime.worker_pool import SPAWNING, as_workers_should_start, end_with_the_parent, ending_words
from .view_error import AskedView, Tracers, ViewError, view_errors

#: Niceness of the process: with 10 a concurrent fold in software took a quarter longer, with 19 no longer.
NICE = 19
# Polling interval of the pipe, seconds.
_LISTENS_S = 0.02
# Number of surfaces cached by the process; a BTF may take hundreds of megabytes.
_KEPT_SURFACES = 16


@dataclass(frozen=True)
class Failed:
    """Reason for a missing reference; the next view is requested as usual."""

    words: str


class ReferenceWorker:
    """Non-blocking client of the reference process; a context manager.

    `ask` for a view and `poll` regularly; results are of the last requested view.
    """

    def __init__(self) -> None:
        self._open = ExitStack()
        self._newest = 0
        self._wanted: tuple[int, AskedView | None] | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._process: Any = None
        self._connection: Connection | None = None
        self._known: list[Mesh] = []
        self._heard: list[tuple[int, ViewError | Failed]] = []
        self._talk: threading.Thread | None = None

    def __enter__(self) -> ReferenceWorker:
        self._open.enter_context(clearing(self._kill))
        return self

    def __exit__(self, *_reason: object) -> None:
        self.close()

    def close(self) -> None:
        """Terminate the process."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._kill()
        if self._talk is not None:
            self._talk.join(timeout=5)
            # It may be starting.
            self._kill()
        self._open.close()

    def ask(self, view: AskedView) -> None:
        """Measure this view from now on, and none that was asked for before."""
        self._want(view)

    def cancel(self) -> None:
        """Measure nothing: the view has changed, and is not settled yet."""
        self._want(None)

    def poll(self) -> ViewError | Failed | None:
        """Return the latest result of the last requested view since the last poll; None without one."""
        with self._changed:
            mine = [what for ticket, what in self._heard if ticket == self._newest]
            self._heard.clear()
        return mine[-1] if mine else None

    def _want(self, view: AskedView | None) -> None:
        with self._changed:
            self._newest += 1
            self._wanted = self._newest, view
            if self._talk is None and not self._closed and view is not None:
                # Large arrays block the pipe until the process reads them, so another thread sends them.
                self._talk = threading.Thread(target=self._talking, daemon=True)
                self._talk.start()
            self._changed.notify_all()

    def _talking(self) -> None:
        """Send requests and receive results until closed."""
        while True:
            while self._hears():
                pass
            with self._changed:
                if self._wanted is None and not self._closed:
                    self._changed.wait(timeout=_LISTENS_S)
                if self._closed:
                    return
                wanted, self._wanted = self._wanted, None
            if wanted is not None:
                self._send(*wanted)

    def _hears(self) -> bool:
        """Receive results; return whether there were any. `poll` never waits for an image in transit."""
        if self._connection is None:
            return False
        try:
            if not self._connection.poll():
                return False
            came = self._connection.recv()
        except (EOFError, OSError):
            self._died()
            return False
        with self._changed:
            self._heard.append(came)
        return True

    def _send(self, ticket: int, view: AskedView | None) -> None:
        if self._connection is None:
            if view is None:
                return
            self._start()
        assert self._connection is not None
        try:
            self._connection.send_bytes(pack_message((ticket, view), self._known))
        except (BrokenPipeError, ConnectionResetError):
            self._died()

    def _start(self) -> None:
        ours, theirs = SPAWNING.Pipe()
        self._process = SPAWNING.Process(target=_serve, args=(theirs, str(temporary_folder()), NICE), daemon=True)
        # A half-started process would be orphaned and print that its parent has gone.
        with undisturbed(), as_workers_should_start():
            self._process.start()
        theirs.close()
        self._known, self._connection = [], ours

    def _died(self) -> None:
        """Handle the end of the process: the request has failed, and the next view gets a new process."""
        if self._connection is not None:
            self._connection.close()
        self._connection = None
        if self._process is not None and not self._closed:
            self._process.join(timeout=5)
            words = f"the reference's process ended abruptly ({ending_words(self._process.exitcode)})"
            with self._changed:
                self._heard.append((self._newest, Failed(words)))

    def _kill(self) -> None:
        if self._process is not None and self._process.pid is not None:
            self._process.kill()
            self._process.join(timeout=1)


class _Packer(pickle.Pickler):
    """Pickler that replaces meshes known to the other side by their numbers."""

    def __init__(self, file: io.BytesIO, known: list[Mesh]) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self._known = known

    def persistent_id(self, obj: object) -> int | None:
        """Return the number of a mesh."""
        if not isinstance(obj, Mesh):
            return None
        return next(number for number, one in enumerate(self._known) if one is obj)


class _Unpacker(pickle.Unpickler):
    """Unpickler that restores meshes by their numbers."""

    def __init__(self, file: io.BytesIO, known: list[Mesh]) -> None:
        super().__init__(file)
        self._known = known

    def persistent_load(self, pid: int) -> Mesh:
        """Return the mesh of that number."""
        return self._known[pid]


def pack_message(message: tuple[int, AskedView | None], known: list[Mesh]) -> bytes:
    """Pack a message with the meshes unknown to the other side, and add these to `known`; if none of its meshes is
    known, both sides discard the previous ones.
    """
    view = message[1]
    meshes = [] if view is None else [part.mesh for part in view.scene.parts]
    forget = bool(meshes) and not any(any(one is mesh for one in known) for mesh in meshes)
    if forget:
        known.clear()
    new: list[Mesh] = []
    for mesh in meshes:
        if not any(one is mesh for one in (*known, *new)):
            new.append(mesh)
    known += new
    file = io.BytesIO()
    pickle.dump((forget, new), file, protocol=pickle.HIGHEST_PROTOCOL)
    _Packer(file, known).dump(message)
    return file.getvalue()


def unpack_message(data: bytes, known: list[Mesh]) -> tuple[int, AskedView | None]:
    """Unpack what `pack_message` has packed."""
    file = io.BytesIO(data)
    forget, new = pickle.load(file)
    if forget:
        known.clear()
    known += new
    return _Unpacker(file, known).load()


def _serve(connection: Connection, temporary: str, nice: int) -> None:
    """Render the newest view, row by row, until the pipe or the parent is gone; `nice` lowers its priority."""
    tempfile.tempdir = temporary
    threading.Thread(target=end_with_the_parent, daemon=True).start()
    if hasattr(os, "nice"):
        os.nice(nice)
    meshes: list[Mesh] = []
    surfaces, tracers = _Surfaces(), Tracers()
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            ticket, view = unpack_message(connection.recv_bytes(), meshes)
            while connection.poll():
                ticket, view = unpack_message(connection.recv_bytes(), meshes)
            if view is None:
                continue
            try:
                for found in view_errors(view, surfaces.of(view), tracers):
                    if found is not None:
                        connection.send((ticket, found))
                    if connection.poll():
                        break
            except MetamerError as reason:
                connection.send((ticket, Failed(str(reason))))
            except MemoryError:
                connection.send((ticket, Failed("no memory for the reference")))


class _Surfaces:
    """Cache of original surfaces of the last catalogue, by id and state of the file."""

    def __init__(self) -> None:
        self._kept: dict[tuple[str, str, int, int], Surface] = {}

    def of(self, view: AskedView) -> dict[str, Surface]:
        """Return the surfaces of all materials of the scene."""
        catalogue = Catalogue(Path(view.catalogue))
        return {name: view.made.get(name) or self._of(catalogue, name) for name in view.scene.material_ids}

    def _of(self, catalogue: Catalogue, name: str) -> Surface:
        state = catalogue.path(name).stat()
        key = (str(catalogue.folder), name, state.st_mtime_ns, state.st_size)
        if key not in self._kept:
            while len(self._kept) >= _KEPT_SURFACES:
                self._kept.pop(next(iter(self._kept)))
            self._kept[key] = catalogue.surface(name).surface()
        return self._kept[key]
