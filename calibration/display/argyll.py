"""Measurement of a display by ArgyllCMS's `dispread`, an external program that shows patches and reads instruments."""

from __future__ import annotations

import os
import queue
import shutil
import subprocess
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from ...runtime.distribution import system_hint
from ...runtime.errors import InputError
from ...runtime.files import written_whole
from ...runtime.private_folder import private_folder
from ...runtime.shutdown import clearing, undisturbed
from .patch_files import read_patches
from .reading_files import read_readings
from .readings import Readings

_PROGRAM = "dispread"
# Name of the patches and, with another suffix, of the readings, in a folder of their own.
_STEM = "patches"
# Seconds that the program has to end by itself, and characters of its last words that an error repeats.
_ENDING_S, _LAST_WORDS = 1.0, 300


def measure(
    patches: str | Path,
    readings: str | Path,
    arguments: Sequence[str] = (),
    on_output: Callable[[str], object] = lambda _: None,
    patience_s: float = 300.0,
) -> Readings:
    """Run ArgyllCMS to show and measure patches, and write the readings, in cd/m2.

    It asks for keys in the terminal: to place the instrument, and to calibrate it.

    Parameters
    ----------
    patches : `.ti1`. readings : the `.ti3` to write; it exists only after a complete measurement.
    arguments : further arguments of `dispread`, such as ["-d2", "-X", "panel.ccss"].
    on_output : called with the program's output, as it arrives.
    patience_s : seconds without output after which it is killed, since it may wait for an instrument for ever.

    Raises
    ------
    InputError : ArgyllCMS is not installed, the patches are no `.ti1`, the program fails, measures fewer patches than
        it was given, or says nothing for too long. NoRoomError : a full disk.
    """
    program = shutil.which(_PROGRAM)
    if program is None:
        raise InputError(
            "ArgyllCMS is not installed",
            found=f"no {_PROGRAM} among the programs",
            expected=f"{_PROGRAM} of ArgyllCMS (https://www.argyllcms.com)",
            hint=f"{system_hint(['argyll'])}; or measure by another program: `metamer display show` shows the patches",
        )
    patches = Path(patches)
    asked = len(read_patches(patches))
    if patches.suffix.lower() != ".ti1":
        hint = "`metamer display patches -o patches.ti1` writes one"
        raise InputError("not the patches of ArgyllCMS", file=patches, expected="a .ti1 file", hint=hint)
    with private_folder() as folder:
        shutil.copyfile(patches, folder / f"{_STEM}.ti1")
        # XYZ in cd/m2, and a line for each patch.
        last = _run([program, "-v", "-w", *arguments, _STEM], folder, on_output, patience_s)
        made = folder / f"{_STEM}.ti3"
        if not made.is_file():
            raise _failed("measured nothing", last)
        with written_whole(readings) as beside:
            shutil.copyfile(made, beside)
    found = read_readings(Path(readings))
    if len(found.codes) < asked:
        raise InputError(
            "fewer readings than patches",
            file=readings,
            found=f"{len(found.codes)} of {asked}",
            hint="measure again; what was measured is in the file",
        )
    return found


def _run(command: list[str], folder: Path, on_output: Callable[[str], object], patience_s: float) -> str:
    """Run the program in this terminal, and return its last output."""
    started: list[subprocess.Popen[bytes]] = []
    heard: queue.SimpleQueue[str] = queue.SimpleQueue()
    last = ""
    with clearing(lambda: _end(started)):
        with undisturbed():
            # In the terminal's own group: keys and Ctrl-C are for both.
            started.append(subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT))
        process = started[0]
        assert process.stdout is not None
        threading.Thread(target=_listen, args=(process.stdout, heard), daemon=True).start()
        try:
            while words := heard.get(timeout=patience_s):
                on_output(words)
                last = (last + words)[-_LAST_WORDS:]
            code = process.wait(patience_s)
        except (queue.Empty, subprocess.TimeoutExpired):
            raise _failed(f"said nothing for {patience_s:g} s", last) from None
    if code:
        raise _failed(f"ended with {code}", last)
    return last


def _listen(stream: IO[bytes], heard: queue.SimpleQueue[str]) -> None:
    """Pass on a program's output, and "" at its end."""
    with stream:
        while said := os.read(stream.fileno(), 4096):
            heard.put(said.decode("utf-8", "replace"))
    heard.put("")


def _end(started: list[subprocess.Popen[bytes]]) -> None:
    """End the program, if it runs; given time, it restores the terminal."""
    for process in started:
        with suppress(OSError):
            process.terminate()
        try:
            process.wait(_ENDING_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _failed(how: str, last: str) -> InputError:
    lines = [line.strip() for line in last.replace("\r", "\n").splitlines() if line.strip()]
    return InputError(
        f"{_PROGRAM} {how}",
        found=" / ".join(lines[-2:]) or "no word from it",
        expected="a reading of each patch",
        hint="attach the instrument and end other programs that use it; answer what is asked in this terminal; "
        f"`{_PROGRAM} -?` lists screens and instruments (--screen, --instrument); --patience gives it more time",
    )
