"""Estimated cost of reading a mesh: triangles from the file size, memory and time from the triangles."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...runtime.memory import check_room, gigabytes

#: Peak bytes and seconds per triangle for reading, checking and joining, measured with meshes without normals, the most
#: expensive ones, on one core of a small machine.
BYTES_A_TRIANGLE, SECONDS_A_TRIANGLE = 950, 9e-6
#: Seconds of reading above which it is announced.
SAID_FROM_SECONDS = 0.5
# Least number of bytes per triangle in files, and in their text form if there is one.
_BINARY = {".ply": 18.0, ".stl": 50.0, ".obj": 35.0, ".off": 20.0, ".glb": 18.0, ".gltf": 18.0}
_TEXT = {".ply": 40.0, ".stl": 150.0}


@dataclass(frozen=True)
class MeshCost:
    """Upper bounds of triangles, bytes and seconds."""

    triangles: int

    @property
    def memory_bytes(self) -> int:
        """Peak memory, bytes."""
        return BYTES_A_TRIANGLE * self.triangles

    @property
    def seconds(self) -> float:
        """Seconds on one core of a small machine."""
        return SECONDS_A_TRIANGLE * self.triangles

    @property
    def words(self) -> str:
        """Description of the cost."""
        return (
            f"up to {self.triangles:,} triangles, {gigabytes(self.memory_bytes)} of memory and "
            f"{max(1.0, self.seconds):.0f} s"
        )

    def check_room(self, place: Path | str) -> None:
        """Raise `InputError` if this does not fit into free memory."""
        check_room(
            self.memory_bytes,
            "the mesh does not fit into memory",
            self.words,
            "thin the mesh out, or read it on a machine with more memory",
            file=place,
        )


def file_cost(path: Path) -> MeshCost:
    """Estimate the cost of an existing mesh file; a glTF includes its external buffers."""
    suffix = path.suffix.lower()
    size = path.stat().st_size
    if suffix == ".gltf":
        size += sum(beside.stat().st_size for beside in path.parent.glob("*.bin"))
    with path.open("rb") as file:
        head = file.read(512)
    text = (suffix == ".ply" and b"format ascii" in head) or (suffix == ".stl" and head.lstrip().startswith(b"solid"))
    # A binary STL may start with the same word; its size distinguishes it.
    if suffix == ".stl" and len(head) >= 84 and size == 84 + 50 * int.from_bytes(head[80:84], "little"):
        text = False
    return MeshCost(int(size / (_TEXT[suffix] if text else _BINARY.get(suffix, 18.0))))
