"""Commands that hunt for failures, each with a small test of its own beside it; and what several tests share."""

collect_ignore = [
    "fuzz.py",
    "fuzz_seeds.py",
    "interrupts.py",
    "kills.py",
    "pictures.py",
    "transfer_kills.py",
    "window_endings.py",
    "window_process.py",
]
