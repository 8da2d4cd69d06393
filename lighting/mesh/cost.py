"""Cost of a mesh before it is read: triangles by the size of its file, memory and time by its triangles."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...runtime.memory import check_room, gigabytes

#: Bytes at the peak and seconds, a triangle, of reading, checking and joining: measured with meshes without normals,
#: which cost the most, on one core of a small machine.
BYTES_A_TRIANGLE, SECONDS_A_TRIANGLE = 950, 9e-6
#: Meshes that take less time than this are read without a word.
SAID_FROM_SECONDS = 0.5
# Bytes of a file a triangle, at the least that programs write; of its text form, where it has one.
_BINARY = {".ply": 18.0, ".stl": 50.0, ".obj": 35.0, ".off": 20.0, ".glb": 18.0, ".gltf": 18.0}
_TEXT = {".ply": 40.0, ".stl": 150.0}


@dataclass(frozen=True)
class MeshCost:
    """At most so many triangles, bytes and seconds."""

    triangles: int

    @property
    def memory_bytes(self) -> int:
        """At the peak."""
        return BYTES_A_TRIANGLE * self.triangles

    @property
    def seconds(self) -> float:
        """Seconds on one core of a small machine."""
        return SECONDS_A_TRIANGLE * self.triangles

    @property
    def words(self) -> str:
        """Cost in words."""
        return (
            f"up to {self.triangles:,} triangles, {gigabytes(self.memory_bytes)} of memory and "
            f"{max(1.0, self.seconds):.0f} s"
        )

    def check_room(self, place: Path | str) -> None:
        """Raise `InputError` where this does not fit into the memory that there is."""
        check_room(
            self.memory_bytes,
            "the mesh does not fit into memory",
            self.words,
            "thin the mesh out, or read it on a machine with more memory",
            file=place,
        )


def file_cost(path: Path) -> MeshCost:
    """Return the cost of a mesh file that is there; a glTF counts with the buffers beside it."""
    suffix = path.suffix.lower()
    size = path.stat().st_size
    if suffix == ".gltf":
        size += sum(beside.stat().st_size for beside in path.parent.glob("*.bin"))
    with path.open("rb") as file:
        head = file.read(512)
    text = (suffix == ".ply" and b"format ascii" in head) or (suffix == ".stl" and head.lstrip().startswith(b"solid"))
    # A binary STL may start with the same word; its size tells.
    if suffix == ".stl" and len(head) >= 84 and size == 84 + 50 * int.from_bytes(head[80:84], "little"):
        text = False
    return MeshCost(int(size / (_TEXT[suffix] if text else _BINARY.get(suffix, 18.0))))
