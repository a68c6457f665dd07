"""A trajectory's file while its run goes on: each record goes to the disk at once, so that memory does not grow.

The file has its whole size from the start, and what is written on the way is numbers in their places; whatever ends the
run, the file can be read, to the last checkpoint. Until the run ends it is called NAME.part. A NAME.part that is there is
another run's, which was broken off or still goes on: it is kept, unless this run goes on from it.
"""

from __future__ import annotations

import contextlib
import math
import secrets
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from darboux import __version__, files, scenario, store
from darboux.errors import InvalidInput
from darboux.files import part_of, unfinished
from darboux.motion import Motion
from darboux.trajectory import Trajectory

Array = NDArray[np.float64]

BLOCK = 2**20  # numbers that are written at a time
RECORD = 4096  # characters
UNFINISHED = " " * 64  # in the place of the check sum
BROKEN_OFF = {"code": "stopped", "message": "The run was broken off; it can be continued from its last record."}


class Stream:
    """The file of a run of ``records`` records of arrays with these shapes.

    Raises ``InvalidInput`` where the motion holds a Python function, or the folder has no room.
    """

    def __init__(
        self,
        path: Any,
        motion: Motion,
        method: Any,
        s: Array,
        records: int,
        checkpoint: int,
        statistics: dict[str, Any],
        before: Trajectory | None = None,
    ) -> None:
        import h5netcdf
        import h5py

        self.path = files.target(Path(path), store.SIGNATURE)
        self.part = part_of(self.path)
        self._spare(before)
        # By another name until what was recorded before is in it: that may lie in NAME.part.
        self.new = self.part.with_name(f".darboux-{secrets.token_hex(4)}.part")
        text = scenario.Scenario(motion.problem, None, motion, method).toml
        sizes = {"time": records, "vertex": len(s), "edge": len(s) - 1, "axis": 3, "number": checkpoint}
        arrays = store.MOTION_ARRAYS.values()
        numbers = sum(math.prod(sizes[dimension] for dimension in dimensions) for dimensions, _, _ in arrays)
        try:
            files.reserve(self.new, 8 * numbers + store.ROOM)  # HDF5 itself does not survive a full disk
            with h5netcdf.File(self.new, "w") as new:
                new.dimensions = sizes
                for name, (dimensions, unit, words) in store.MOTION_ARRAYS.items():
                    variable = new.create_variable(name, dimensions, "<f8")
                    variable.attrs.update(({"units": unit} if unit else {}) | {"long_name": words})
                new.create_variable("axis", ("axis",), h5py.string_dtype())[:] = ["x", "y", "z"]
                for name, words in store.TEXTS.items():
                    new.create_variable(name, (), h5py.string_dtype()).attrs["long_name"] = words
                new.attrs.update(
                    kind=store.MOTION, format=store.FORMAT, darboux=__version__, digest=UNFINISHED, streamed=1
                )
            self.file = h5py.File(self.new, "r+")
            for name in store.MOTION_ARRAYS:
                self._fill(self.file[name])
            self.file["s"][:], self.file["scenario"][()] = s, text
            self._state(BROKEN_OFF, statistics)
            self.file.flush()
        except OSError as error:
            self.abandon()
            raise files.refusal(self.path, error) from None

    def _spare(self, before: Trajectory | None) -> None:
        """Raise ``InvalidInput`` where NAME.part holds what this run does not go on from."""
        if not self.part.exists():
            return
        with contextlib.suppress(InvalidInput):
            if before is not None and store.open(self.part) == before:
                return
        raise InvalidInput(unfinished(self.part))

    def named(self) -> None:
        """Call the file NAME.part: from now on it holds all that was recorded before; raises ``OSError``."""
        import h5py

        self.file.close()
        self.new.replace(self.part)
        self.file = h5py.File(self.part, "r+")

    def abandon(self) -> None:
        """Take away a file that does not have its name yet."""
        with contextlib.suppress(Exception):
            self.file.close()
        self.new.unlink(missing_ok=True)

    @staticmethod
    def _fill(data: Any) -> None:
        """Take the room that an array needs."""
        rows = max(1, BLOCK // max(1, int(np.prod(data.shape[1:]))))
        for i in range(0, len(data), rows):
            data[i : i + rows] = np.nan

    def _state(self, status: dict[str, str], statistics: dict[str, Any]) -> None:
        text = store.json_of({"status": status, "statistics": statistics})
        self.file["record"][()] = text.ljust(RECORD)  # always as long, so that it has its room

    def write(self, i: int, rows: dict[str, Any], checkpoint: Array) -> None:
        """Write the record i, or records from i on, and what the run goes on with after it; raises ``OSError``."""
        for name, row in rows.items():
            self.file[name][i : i + len(row)] = row
        self.file.flush()
        self.file["checkpoint"][:] = checkpoint  # its time says how many records count
        self.file.flush()

    def energies(self) -> dict[str, Array]:
        """Return the energies so far."""
        return {name: self.file[name][:] for name in store.ENERGIES}

    def finish(self, status: Any, statistics: dict[str, Any]) -> dict[str, Array]:
        """Write how the run ended, give the file its name, and return its arrays, which stay on the disk.

        Where the disk is full the file keeps the name that it has.
        """
        where = self.part
        try:
            self._state({"code": status.code, "message": status.message}, statistics)
            self.file.flush()
            self.file.attrs["digest"] = store.digest_of_motion(self.part, self.file)
            self.file.close()
            if self.path.exists():
                shutil.copymode(self.path, self.part)
            where = self.part.replace(self.path)
        except OSError:
            with contextlib.suppress(Exception):
                self.file.close()
        return store.mapped(where)
